"""Pipelines tell what a user can mend as the command line does."""

import errno

import pytest

from mapfilter.errors import InputError, fail
from mapfilter.workflows.terminal import guarded, run_pipeline

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
