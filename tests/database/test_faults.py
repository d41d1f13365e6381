"""A few of the faults of ``python -m tests.faults``, which tries many."""

import json
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def faults(tmp_path, *given):
    """Run a kind of faults, and go on with it where it ended."""
    command = [sys.executable, "-m", "tests.faults", *given, "--work", str(tmp_path)]
    run = subprocess.run(
        command, capture_output=True, text=True, cwd=ROOT, timeout=600, check=False
    )
    assert run.returncode == 0, run.stderr
    return json.loads(run.stdout)


def test_writers_that_are_killed_leave_whole_results(tmp_path):
    assert faults(tmp_path, "kill", "--count", "4") == {"build: whole": 2, "merge: whole": 2}


def test_readers_of_a_database_that_is_replaced_see_no_mix(tmp_path):
    found = faults(tmp_path, "replace", "--count", "8")
    assert found["replacements"] == 8
    assert found["reader: whole"] > 0
    assert set(found) <= {"replacements", "reader: whole", "reader: told that it was replaced"}
