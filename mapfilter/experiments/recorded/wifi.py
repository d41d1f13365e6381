"""Wi-Fi fingerprints of four buildings or campuses, each test report located by itself."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mapfilter.experiments.benchmarks.single_reports import (
    BASELINE,
    WIFI,
    WIFI_FOLDER,
    locate_wifi,
    read_wifi,
)
from mapfilter.experiments.recorded.benchmark import Benchmark, Judged, Task
from mapfilter.experiments.recorded.rows import Found
from mapfilter.experiments.recorded.worst_report import worst_report
from mapfilter.positioning.fingerprints.options import AUTO


def units(_: Path) -> list[tuple[str, str, int]]:
    """Return one unit for each set."""
    return [(name, "test", 1) for name in WIFI]


def judge(task: Task, _: None = None) -> Judged:
    """Locate the test reports of a set by all methods, beside three nearest neighbours."""
    training, test = read_wifi(task.data, task.part)
    methods = {"locate": AUTO, "probabilistic": "probabilistic", BASELINE: BASELINE}
    located = {name: locate_wifi(training, test, one)[0] for name, one in methods.items()}
    baseline_m = located[BASELINE].error_m
    found = []
    for name, result in located.items():
        known = np.isfinite(result.error_m)
        found.append(
            Found(
                task.part,
                name,
                task.unit,
                None,
                None,
                None,
                result.error_m[known],
                (result.error_m <= result.radii_m[:, 2])[known],
                baseline_m[np.isfinite(baseline_m)],
                count=len(result.error_m),
            )
        )
    worst = {name: worst_report(test, result, training) for name, result in located.items()}
    reports = {name: one for name, one in worst.items() if one is not None}
    return Judged(tuple(found), reports=reports)


BENCHMARK = Benchmark(
    "fingerprints",
    WIFI_FOLDER,
    tuple(f"{name}.mat" for name in WIFI),
    units,
    judge,
    baseline="mean",
)
