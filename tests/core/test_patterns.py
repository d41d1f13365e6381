"""No regular expression of the package needs more than linear time, whatever it is given."""

import ast
import importlib
import pkgutil
import re
import time
from pathlib import Path

import pytest

import mapfilter

SIZE = 64 << 10
LONGEST_S = 0.1
CHARACTERS = "Aa0 \t\n.,:;-_+<>=\"'/()#$!"
ROOT = Path(mapfilter.__file__).parent
METHODS = {"match", "fullmatch", "search", "sub", "split", "findall", "finditer", "compile"}


def compiled_patterns():
    """Return patterns in the modules' globals, and those that calls of ``re`` name, by place."""
    found = {}
    for info in pkgutil.walk_packages([str(ROOT)], "mapfilter."):
        if info.name.endswith("__main__"):
            continue
        for name, value in vars(importlib.import_module(info.name)).items():
            if isinstance(value, re.Pattern):
                found[f"{info.name}.{name}"] = value
    for file in ROOT.rglob("*.py"):
        text = file.read_text(encoding="utf-8")
        # Most modules do not name it, and to parse all of them takes two seconds.
        for node in ast.walk(ast.parse(text)) if re.search(r"\bre\b", text) else ():
            if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)):
                continue
            of_re = isinstance(node.func.value, ast.Name) and node.func.value.id == "re"
            given = node.args[0] if node.args else None
            if of_re and node.func.attr in METHODS and isinstance(given, ast.Constant):
                found[f"{file.relative_to(ROOT)}:{node.lineno}"] = re.compile(given.value)
    named = {value.pattern for place, value in found.items() if ":" not in place}
    return {
        place: value
        for place, value in found.items()
        if ":" not in place or value.pattern not in named
    }


PATTERNS = compiled_patterns()


def test_the_walk_finds_patterns_of_both_kinds():
    assert len(PATTERNS) > 20
    assert any(":" in place for place in PATTERNS)


def slowest_s(pattern, text, longest_s=LONGEST_S):
    """Return the longest time of a search and a full match, the best of up to five."""
    times = []
    for use in (pattern.search, pattern.fullmatch):
        tries = []
        for _ in range(5):
            began_s = time.process_time()
            use(text)
            tries.append(time.process_time() - began_s)
            # Far above it, no further one is below.
            if not longest_s <= tries[-1] < 10 * longest_s:
                break
        times.append(min(tries))
    return max(times)


@pytest.mark.parametrize("place", sorted(PATTERNS))
def test_long_runs_of_one_character_take_no_time(place):
    pattern = PATTERNS[place]
    for character in CHARACTERS:
        # A part first: a pattern that backtracks would take minutes over the whole. The whole may
        # take twice as long: eight times as long a text takes 64 times as long where it backtracks.
        for size, longest_s in ((SIZE // 8, LONGEST_S), (SIZE, 2 * LONGEST_S)):
            text = character * size
            given = text if isinstance(pattern.pattern, str) else text.encode()
            assert slowest_s(pattern, given, longest_s) < longest_s, (place, character, size)


def test_the_clock_notices_a_pattern_that_backtracks():
    assert slowest_s(re.compile(r"A*B"), "A" * (SIZE // 2)) > LONGEST_S
