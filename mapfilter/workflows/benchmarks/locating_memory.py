"""The most memory that locating a walk takes, measured in a process of its own."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np

from mapfilter.database.estimate import peak_memory_bytes
from mapfilter.database.store import open_database
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.loop import locate
from mapfilter.tracks.store import read_log


def locating_memory_bytes(database: Path, log: Path, *, smooth: bool) -> tuple[int, int]:
    """Return the peak memory of a process: with its libraries loaded, and after locating a walk."""
    code = (
        "import sys; from pathlib import Path;"
        "from mapfilter.workflows.benchmarks.locating_memory import locate_once;"
        "print(*locate_once(Path(sys.argv[1]), Path(sys.argv[2]), smooth=sys.argv[3] == 'smooth'))"
    )
    given = [sys.executable, "-c", code, str(database), str(log), "smooth" if smooth else "forward"]
    done = subprocess.run(given, check=True, capture_output=True, text=True)
    loaded, at_the_end = map(int, done.stdout.split())
    return loaded, at_the_end


def locate_once(database: Path, log: Path, *, smooth: bool) -> tuple[int, int]:
    """Open, locate, and return this process's peak memory (bytes) before and after."""
    loaded = peak_memory_bytes()
    positioner = BayesFilter(smooth=smooth).over(open_database(database))
    locate(read_log(log), positioner, np.random.default_rng(0))
    return loaded, peak_memory_bytes()
