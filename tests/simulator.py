"""Tests of kernels of a graphics processor, run in numba's simulator.

The simulator has to be asked for before numba is loaded: hence a process of its own.
"""

import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def run_simulated(files: Sequence[Path]) -> None:
    """Run files of tests in one process that simulates the device."""
    command = [sys.executable, "-m", "pytest", "-x", "-n", "0", "-p", "no:cacheprovider"]
    done = subprocess.run(
        [*command, *map(str, files), "-W", "default"],
        # Options of the outer run would change what is printed.
        env={**os.environ, "NUMBA_ENABLE_CUDASIM": "1", "PYTEST_ADDOPTS": ""},
        cwd=ROOT,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout[-4000:] + done.stderr[-1000:]
    for file in files:
        assert f"{file.relative_to(ROOT)} ." in done.stdout
