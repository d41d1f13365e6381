"""The scripts of ``pipelines/``, run in this process as a user runs them."""

from __future__ import annotations

import json
import runpy
import sys
from pathlib import Path

import pytest

PIPELINES = Path(__file__).resolve().parents[2] / "pipelines"


def run_script(name: str, capsys: pytest.CaptureFixture[str], *given: str) -> dict:
    """Run a script; return the JSON object that it prints last."""
    argv, sys.argv = sys.argv, [name, "--json", *given]
    try:
        with pytest.raises(SystemExit) as ended:
            runpy.run_path(str(PIPELINES / f"{name}.py"), run_name="__main__")
    finally:
        sys.argv = argv
    out = capsys.readouterr()
    assert ended.value.code == 0, out.err
    return json.loads(out.out.splitlines()[-1])
