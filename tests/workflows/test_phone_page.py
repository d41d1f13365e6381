"""The how-to page of a log from a phone, run as it stands there."""

import re
import shlex
import textwrap
from pathlib import Path

import pytest
from command_line import mapfilter

SAMPLED = 0.1
"""Share by which figures of a sampled filter may differ: on other processors last digits differ,
and so may what is drawn by them."""
PAGE = Path(__file__).resolve().parents[2] / "docs" / "howto" / "phone-log.rst"


def blocks(text, kind):
    found = re.findall(rf"code-block:: {kind}\n\n((?:   .*\n|\n)+)", text)
    return [textwrap.dedent(block) for block in found]


def run(block):
    lines = block.replace("\\\n", " ").splitlines()
    done = [mapfilter(*shlex.split(line)[2:]) for line in lines if line]
    assert [one.code for one in done] == [0] * len(done), done
    return done[-1].out


def assert_shown(shown, printed):
    """Compare words as they are, and figures within the tolerance of a sampled filter."""
    for name, text in shown.items():
        if re.fullmatch(r"[0-9.]+", text):
            assert float(printed[name]) == pytest.approx(float(text), rel=SAMPLED), name
        else:
            assert printed[name] == text, name


def figures_of(text):
    return dict(line.split(": ", 1) for line in text.splitlines() if ": " in line)


def test_the_walk_of_the_page_is_located(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = PAGE.read_text(encoding="utf-8")
    tables, settings = blocks(text, "text"), blocks(text, "toml")
    scripts, commands = blocks(text, "python"), blocks(text, "console")
    Path("cells.csv").write_text(tables[-1], encoding="utf-8")
    Path("phone.toml").write_text(settings[0], encoding="utf-8")
    Path("area.toml").write_text(settings[1], encoding="utf-8")
    run(commands[2])
    exec(scripts[-1], {})
    head, first = Path("phone.csv").read_text(encoding="utf-8").splitlines()[:2]
    assert head == tables[0].splitlines()[0]
    assert first.startswith("2026-05-01 10:00:0")
    exec(scripts[0], {})
    printed, shown = figures_of(run(commands[1])), figures_of(tables[1])
    assert len(shown) == 8
    assert shown["success"] == "True"
    assert_shown(shown, printed)
    assert "unknown_cells" not in printed
    as_it_is = figures_of(run(commands[0]))
    assert as_it_is["success"] == "True"
    assert float(as_it_is["error_mean_m"]) < 30


def test_figures_of_an_older_page_are_not_within_the_tolerance():
    """Of a page that is not brought up to date, some figure has to be noticed."""
    shown = figures_of(blocks(PAGE.read_text(encoding="utf-8"), "text")[1])
    older = {
        "switch_distance_m": "1067.1",
        "error_at_switch_m": "6.621",
        "error_mean_m": "10.61",
        "error_67_m": "13.92",
        "error_95_m": "23.34",
    }
    assert older.keys() < shown.keys()
    assert_shown(shown, shown)
    with pytest.raises(AssertionError):
        assert_shown(shown, shown | older)
    for name in ("error_mean_m", "error_67_m", "error_95_m"):
        with pytest.raises(AssertionError):
            assert_shown(shown, shown | {name: older[name]})
    with pytest.raises(AssertionError):
        assert_shown(shown, shown | {"switched": "False"})
