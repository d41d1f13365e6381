"""What a file holds may be shown on a terminal, but not act on it, nor cost the result."""

import json
import os
import re
import subprocess
import sys

import pytest

from mapfilter.errors import InputError, fail
from mapfilter.workflows import terminal

ACTING = "cell \x1b[2J\x07\x00\x9b31m\u202e\x7f"


def test_messages_show_escapes_and_do_not_send_them(capsys):
    def refuse():
        raise fail(InputError, "a\x1b]0;title\x07.csv row 1", "a number", ACTING)

    assert terminal.guarded(refuse) == 2
    said = capsys.readouterr().err
    assert r"\x1b[2J\x07\x00\x9b31m\u202e\x7f" in said
    assert not re.search("[\x00-\x09\x0b-\x1f\x7f-\x9f\u202e]", said)


@pytest.mark.parametrize("as_json", [True, False])
def test_results_hold_what_was_found_and_do_not_act(capsys, as_json):
    terminal.print_result({"notes": [ACTING], "cell": "2°"}, as_json)
    said = capsys.readouterr().out
    assert not re.search("[\x00-\x09\x0b-\x1f\x7f-\x9f\u202e]", said)
    assert "2°" in said
    if as_json:
        assert json.loads(said) == {"notes": [ACTING], "cell": "2°"}


def test_long_messages_are_cut(capsys):
    def refuse():
        raise fail(InputError, "a.csv", "a number", "9" * 1_000_000)

    assert terminal.guarded(refuse) == 2
    said = capsys.readouterr().err
    assert len(said) < 3000
    assert "more characters" in said


@pytest.mark.parametrize("options", [["--json"], []])
def test_a_terminal_without_the_letters_costs_no_result(tmp_path, options):
    head = {"crs": "EPSG:32635", "notes": ["Straße ²"]}
    (tmp_path / "log.json").write_text(json.dumps(head), encoding="utf-8")
    (tmp_path / "motion.csv").write_text("time_s,step_m\n0,1\n1,1\n")
    plain = {**os.environ, "LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
    plain.pop("PYTHONIOENCODING", None)
    done = subprocess.run(
        [sys.executable, "-m", "mapfilter", "info", str(tmp_path), *options],
        capture_output=True, env=plain, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr.decode()[-2000:]
    assert done.stdout.isascii()
    if options:
        assert json.loads(done.stdout)["notes"] == ["Straße ²"]
    else:
        assert rb"Stra\xdfe \xb2" in done.stdout
