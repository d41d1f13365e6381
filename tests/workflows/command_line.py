"""Running commands in this process, and what a refusal looks like."""

import contextlib
import hashlib
import io
import json
import re
import sys
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path
from unittest.mock import patch

import pandas as pd

from mapfilter.cli import main

ONE = "journey-0000-draw-000"
"""The first simulated log of the small world."""

IDENTITIES = {"A": (3021, 117001), "B": (3021, 117002), "C": (3022, 117003)}
"""LAC and CI of the cells in the plan with identities."""

PROGRESS = re.compile(r"mapfilter: [^:]+: \d+ of \d+ \w+, [\d.]+ \w+/(s|min), \d+ s left")
"""What work that takes more than half a minute prints, as it does on a slow machine."""


@dataclass(frozen=True)
class Outcome:
    code: int
    out: str
    err: str

    @property
    def json(self):
        """The last line of stdout, parsed; constants that are no JSON are refused."""

        def refuse(name):
            raise ValueError(name)

        return json.loads(self.out.splitlines()[-1], parse_constant=refuse)


def mapfilter(*args: object) -> Outcome:
    """Run the command line with its own ``main``, as the installed command does."""
    out, err, code = io.StringIO(), io.StringIO(), 0
    argv = ["mapfilter", *map(str, args)]
    with (
        patch.object(sys, "argv", argv),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
    ):
        try:
            main()
        except SystemExit as end:
            code = int(end.code or 0)
    return Outcome(code, out.getvalue(), err.getvalue())


def assert_done(outcome: Outcome) -> Outcome:
    assert outcome.code == 0, outcome.err
    lines = [line for line in outcome.err.splitlines() if not PROGRESS.fullmatch(line)]
    assert all(line.startswith("mapfilter: note: ") for line in lines), lines
    return outcome


def assert_refused(outcome: Outcome, *told: object) -> None:
    """Exit code 2, nothing on stdout; notes, then a message per line: where, expected, found."""
    assert outcome.code == 2, (outcome.code, outcome.err)
    assert outcome.out == ""
    lines = outcome.err.splitlines()
    notes = list(takewhile(lambda line: line.startswith("mapfilter: note: "), lines))
    assert len(set(notes)) == len(notes)
    assert lines[len(notes) :]
    for line in lines[len(notes) :]:
        assert re.fullmatch(r"mapfilter: error: .+: expected .+, found .+", line), line
    for text in told:
        assert str(text) in outcome.err, (text, outcome.err)


def contents(*places: Path) -> dict[str, str]:
    """SHA-256 of every file in folders (hidden ones too), so that two states can be compared."""
    found = {}
    for place in places:
        for path in sorted(place.rglob("*")) if place.is_dir() else [place]:
            if path.is_file():
                name = str(path.relative_to(place)) if place.is_dir() else path.name
                found[f"{place.name}/{name}"] = hashlib.sha256(path.read_bytes()).hexdigest()
    return found


def settings(**values: object) -> list[str]:
    """``--set`` for each, with ``__`` for the dot."""
    return [f"--set={key.replace('__', '.')}={value}" for key, value in values.items()]


def change(file, **columns):
    """Give columns of a CSV table new values, each a function of the old ones."""
    table = pd.read_csv(file)
    for name, function in columns.items():
        table[name] = function(table[name])
    table.to_csv(file, index=False)


def put(value, row=2):
    """Return a function that puts a value into a row of a column, counted from 1."""

    def changed(column):
        column = column.astype(object)
        column.iloc[row - 1] = value
        return column

    return changed
