"""The how-to page of odometry and a street map, run as it stands there."""

import re
import shlex
import textwrap
from pathlib import Path

import pytest
from command_line import mapfilter

PAGE = Path(__file__).resolve().parents[2] / "docs" / "howto" / "odometry.rst"
SHOWN = ("final_status", "switched", "success", "epochs")


def blocks(text, kind):
    found = re.findall(rf"code-block:: {kind}\n\n((?:   .*\n|\n)+)", text)
    return [textwrap.dedent(block) for block in found]


def test_the_drive_of_the_page_is_located(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = PAGE.read_text(encoding="utf-8")
    text = text[text.index("\nLocate\n") :]
    exec(blocks(text, "python")[0], {})
    Path("town.toml").write_text(blocks(text, "toml")[0], encoding="utf-8")
    outcomes = [
        mapfilter(*shlex.split(line)[2:])
        for line in blocks(text, "console")[0].splitlines()
        if line
    ]
    assert [outcome.code for outcome in outcomes] == [0, 0, 0], outcomes
    printed = dict(
        line.strip().split(": ", 1) for line in outcomes[-1].out.splitlines() if ": " in line
    )
    for line in blocks(text, "text")[0].splitlines():
        name, _, shown = line.strip().partition(": ")
        if name in SHOWN:
            assert printed[name] == shown
        elif name.endswith("_m"):
            assert float(printed[name]) == pytest.approx(float(shown), rel=0.5, abs=2.0), name
    assert Path("located/track.png").exists()
