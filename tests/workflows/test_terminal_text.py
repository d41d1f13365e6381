"""What a file holds may be shown on a terminal, but not act on it, nor cost the result."""

import json
import os
import re
import subprocess
import sys

import numpy as np
import pytest
import rasterio

from mapfilter._printing import quiet_callbacks
from mapfilter.errors import InputError, fail
from mapfilter.workflows.outputs import guard, terminal

ACTING = "cell \x1b[2J\x07\x00\x9b31m\u202e\x7f"


def test_messages_show_escapes_and_do_not_send_them(capsys):
    def refuse():
        raise fail(InputError, "a\x1b]0;title\x07.csv row 1", "a number", ACTING)

    assert guard.guarded(refuse) == 2
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

    assert guard.guarded(refuse) == 2
    said = capsys.readouterr().err
    assert len(said) < 3000
    assert "more characters" in said


def test_messages_of_gdal_that_cannot_be_decoded_print_no_traceback(tmp_path):
    path = tmp_path / "x.tif"
    profile = {"driver": "GTiff", "width": 64, "height": 64, "count": 1, "dtype": "uint8"}
    place = rasterio.Affine(5, 0, 385000, 0, -5, 6672000)
    with rasterio.open(path, "w", crs="EPSG:32635", transform=place, **profile) as target:
        target.write(np.full((1, 64, 64), 5, "uint8"))
        target.update_tags(NOTE="abcdefgh")
    # No XML, and no UTF-8: GDAL's warning cites it.
    path.write_bytes(path.read_bytes().replace(b"abcdefgh", b"\x80\x80<a\x80>xx"))
    done = subprocess.run(
        [sys.executable, "-m", "mapfilter", "info", str(path)],
        capture_output=True, check=False,
    )  # fmt: skip
    assert b"Traceback" not in done.stderr
    assert b"UnicodeDecodeError" not in done.stderr
    assert done.returncode in (0, 2)


def test_other_errors_of_callbacks_are_printed(capsys):
    """And Python's own hooks are there again afterwards."""
    before = sys.excepthook, sys.unraisablehook
    said = []

    class Lost:
        exc_value = ValueError("lost")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "unraisablehook", lambda lost: said.append(lost.exc_value))
        with quiet_callbacks():
            sys.unraisablehook(Lost)
            sys.excepthook(ValueError, ValueError("shown"), None)
            sys.excepthook(UnicodeDecodeError, UnicodeDecodeError("a", b"", 0, 1, "b"), None)
    assert said == [Lost.exc_value]
    assert capsys.readouterr().err == "ValueError: shown\n"
    assert (sys.excepthook, sys.unraisablehook) == before


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


@pytest.mark.parametrize("closed", [">&-", "2>&-", ">&- 2>&- <&-"])
def test_an_output_that_is_closed_costs_no_traceback(tmp_path, closed):
    (tmp_path / "log.json").write_text('{"crs": "EPSG:32635"}')
    (tmp_path / "motion.csv").write_text("time_s,step_m\n0,1\n1,1\n")
    command = f"'{sys.executable}' -m mapfilter info"
    for given, code in ((tmp_path, 0), (tmp_path / "absent", 2)):
        done = subprocess.run(
            ["/bin/sh", "-c", f"{command} '{given}' {closed}"], capture_output=True, check=False
        )
        assert done.returncode == code
        assert b"Traceback" not in done.stderr
