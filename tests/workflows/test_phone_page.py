"""The how-to page of a log from a phone, run as it stands there."""

import re
import shlex
import textwrap
from pathlib import Path

from command_line import mapfilter

PAGE = Path(__file__).resolve().parents[2] / "docs" / "howto" / "phone-log.rst"


def blocks(text, kind):
    found = re.findall(rf"code-block:: {kind}\n\n((?:   .*\n|\n)+)", text)
    return [textwrap.dedent(block) for block in found]


def run(block):
    lines = block.replace("\\\n", " ").splitlines()
    done = [mapfilter(*shlex.split(line)[2:]) for line in lines if line]
    assert [one.code for one in done] == [0] * len(done), done
    return done[-1].out


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
    printed = dict(line.split(": ", 1) for line in run(commands[1]).splitlines() if ": " in line)
    shown = dict(line.split(": ", 1) for line in tables[1].splitlines() if ": " in line)
    assert len(shown) == 8
    assert {name: printed[name] for name in shown} == shown
    assert "unknown_cells" not in printed
    as_it_is = dict(line.split(": ", 1) for line in run(commands[0]).splitlines() if ": " in line)
    assert as_it_is["success"] == "True"
    assert float(as_it_is["error_mean_m"]) < 30
