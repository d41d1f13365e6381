"""The grid filter on a graphics processor beside the processor: python benchmarks/device.py.

A walk on the embedded map is located by ``grid`` on both, in turns: how far the estimates lie
apart, and wall time. Cases are a walk with a compass, without one, with GNSS fixes, and one that
receives a single report, so that the belief stays spread over the map.
``mapfilter bench filter --device gpu`` times a step of many particles.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from statistics import median

import numpy as np
from numpy.typing import NDArray

from mapfilter._device import open_device
from mapfilter.angles import wrap_rad
from mapfilter.database.store import open_database
from mapfilter.errors import MapfilterError
from mapfilter.positioning.bayes.filter import BayesPositioner
from mapfilter.positioning.bayes.options import GridFilter
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.positioning.loop import locate
from mapfilter.tracks.log import TrackLog, make_log
from mapfilter.tracks.store import read_log
from mapfilter.workflows.benchmarks.filter import make_world

_FIX_SD_M, _EPOCHS_A_FIX = 9.0, 7


def without_compass(log: TrackLog) -> TrackLog:
    """Return a log with turns in place of headings."""
    turn = wrap_rad(np.diff(log.motion["heading_rad"].to_numpy(), prepend=np.nan))
    return replace(log, motion=log.motion.assign(heading_rad=np.nan, turn_rad=turn))


def with_fixes(log: TrackLog) -> TrackLog:
    """Return a log with a fix now and then."""
    fixes = log.truth[["time_s", "east_m", "north_m"]].iloc[::_EPOCHS_A_FIX].copy()
    rng = np.random.default_rng(3)
    fixes[["east_m", "north_m"]] += rng.normal(0.0, _FIX_SD_M, (len(fixes), 2))
    fixes = fixes.assign(var_east_m2=_FIX_SD_M**2, var_north_m2=_FIX_SD_M**2)
    return replace(log, gnss=make_log(log.crs, gnss=fixes).gnss)


def one_report(log: TrackLog) -> TrackLog:
    """Return a log whose phone receives nothing after its first report."""
    first_s = log.radio["time_s"].min()
    return replace(log, radio=log.radio[log.radio["time_s"] == first_s])


CASES: dict[str, Callable[[TrackLog], TrackLog]] = {
    "compass": lambda log: log,
    "no-compass": without_compass,
    "fixes": with_fixes,
    "one-report": one_report,
}


def located(log: TrackLog, positioner: BayesPositioner) -> tuple[TrackEstimate, float]:
    """Return the estimate of a walk, and the wall time it took."""
    began_s = time.perf_counter()
    estimate = locate(log, positioner, np.random.default_rng(0)).estimate
    return estimate, time.perf_counter() - began_s


def largest(values: NDArray[np.float64]) -> float | None:
    """Return the largest of the numbers; None where there is none."""
    return float(np.nanmax(values)) if np.isfinite(values).any() else None


def apart(one: TrackEstimate, other: TrackEstimate) -> dict[str, object]:
    """Return how far positions and radii lie apart at most, and how many epochs differ otherwise.

    Positions are compared where both have one; epochs in which only one has are counted.
    """
    return {
        "epochs": len(one.status),
        "with_one_position": int(np.sum(np.isnan(one.east_m) != np.isnan(other.east_m))),
        "position_m": largest(np.hypot(one.east_m - other.east_m, one.north_m - other.north_m)),
        "radii_m": largest(np.abs(one.radii_m - other.radii_m)),
        "statuses": sum(a != b for a, b in zip(one.status, other.status, strict=True)),
    }


def main() -> None:
    """Locate the walk on both, and print what was seen."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=5, help="that the medians are of")
    parser.add_argument("--length-m", type=float, default=100.0, help="of the walk")
    parser.add_argument("--seed", type=int, default=1, help="of the walk")
    parser.add_argument(
        "--case", choices=CASES, nargs="*", default=list(CASES), help="all by default"
    )
    given = parser.parse_args()
    if given.runs < 1:
        parser.error("--runs: expected a number from 1 on")
    try:
        device = open_device("gpu")
    except MapfilterError as error:
        raise SystemExit(str(error)) from error
    with tempfile.TemporaryDirectory(prefix="mapfilter-device-") as name:
        world = f"journeys.length_m={given.length_m}", f"journeys.seed={given.seed}"
        database, folders = make_world(Path(name), ["journeys.count=1", *world])
        here, walk = GridFilter().over(open_database(database)), read_log(folders[0])
        there = replace(here, device=device)
        for case in given.case:
            log = CASES[case](walk)
            # The first run of each compiles and fills caches.
            found = [located(log, one)[0] for one in (here, there)]
            took = [[located(log, one)[1] for one in (here, there)] for _ in range(given.runs)]
            cpu_s, gpu_s = (median(times) for times in zip(*took, strict=True))
            times = {"cpu_s": cpu_s, "gpu_s": gpu_s, "speedup": cpu_s / gpu_s}
            row = {"device": device.title, "case": case, **apart(*found), **times}
            print(json.dumps(row), flush=True)


if __name__ == "__main__":
    main()
