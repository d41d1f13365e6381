"""Pipelines tell what a user can mend as the command line does."""

import ctypes
import errno
import signal
import time

import pytest

from mapfilter.errors import InputError, fail
from mapfilter.workflows.outputs.guard import guarded
from mapfilter.workflows.pipeline import run_pipeline

RAISED = [
    (fail(InputError, "cells.csv", "a plan", "none"), "cells.csv: expected a plan, found none"),
    (MemoryError(), "memory: expected enough of it, found none left"),
    (OSError(errno.ENOSPC, "full", "out.tif"), "out.tif: expected space on the disk, found none"),
]


def raising(error):
    def run(*_config):
        raise error

    return run


@pytest.mark.parametrize(("error", "told"), RAISED, ids=["input", "memory", "disk"])
def test_what_can_be_mended_is_one_message(error, told, tmp_path, capsys):
    assert guarded(raising(error)) == 2
    file = tmp_path / "stage.toml"
    file.write_text("[output]\n")
    assert run_pipeline({"stage": raising(error)}, file, []) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 2
    assert all(line.startswith(f"mapfilter: error: {told}") for line in lines)


def test_codes_pass_and_other_errors_are_raised():
    assert guarded(lambda: 3) == 3
    assert guarded(lambda: None) == 0
    with pytest.raises(PermissionError):
        guarded(raising(PermissionError(errno.EACCES, "no", "x")))


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["SIGINT", "SIGTERM"])
def test_a_signal_that_arrives_in_a_callback_of_a_library_still_ends_the_command(number, capsys):
    """What a callback raises is lost to whoever called it."""
    reached = []

    @ctypes.CFUNCTYPE(None)
    def called():
        signal.raise_signal(number)

    def run():
        called()
        reached.append("after the callback")
        until_s = time.monotonic() + 20
        while time.monotonic() < until_s:
            time.sleep(0.01)
        return 0

    # A process in the background of a shell ignores the one, and whoever ignores it goes on.
    before = signal.signal(number, signal.SIG_DFL)
    try:
        assert guarded(run) == 128 + number
    finally:
        signal.signal(number, before)
    assert reached == ["after the callback"]
    err = capsys.readouterr().err
    assert f"stopped by {number.name}" in err
    assert "Traceback" not in err
