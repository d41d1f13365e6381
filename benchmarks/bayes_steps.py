"""Time of an epoch of the Bayes map filter while it tracks, and while the phone stands; a day's.

``mapfilter demo --out DEMO``, then ``python benchmarks/bayes_steps.py DEMO``: microseconds of
processor time an epoch, the median of runs over the demo's walk, from its first tracked epoch on.
With ``--day``: seconds of the filter and memory for 86 400 epochs, the walk there and back again.
"""

from __future__ import annotations

import argparse
import resource
import time
from dataclasses import replace
from math import pi
from multiprocessing import Process
from pathlib import Path
from statistics import median

import numpy as np
import pandas as pd

from mapfilter.database.store import open_database
from mapfilter.filters.contract import MotionStep, Status
from mapfilter.positioning.bayes.filter import BayesPositioner
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.bayes.state import BayesState
from mapfilter.positioning.epochs import Epoch
from mapfilter.positioning.loop import locate, usable_part
from mapfilter.positioning.merging import epochs
from mapfilter.tracks.log import TrackLog, make_log
from mapfilter.tracks.store import read_log, write_log

_DAY = 86_400
_STOOD = 600


def tracked_from(filter_: BayesPositioner, merged: list[Epoch]) -> tuple[BayesState, int]:
    """Return the state some epochs after the filter first tracks, and the next epoch."""
    rng, state, tracked = np.random.default_rng(7), filter_.begin(), 0
    for number, epoch in enumerate(merged, start=1):
        state, _ = filter_.step(state, epoch, rng)
        tracked += state.status in (Status.TRACKING, Status.UNCERTAIN)
        if tracked >= 30:
            return state, number
    raise SystemExit("the walk is never tracked")


def epoch_us(filter_: BayesPositioner, state: BayesState, some: list[Epoch]) -> float:
    """Return the mean processor time of epochs from a state, in microseconds."""
    rng = np.random.default_rng(11)
    began_s = time.process_time()
    for epoch in some:
        state, _ = filter_.step(state, epoch, rng)
    return 1e6 * (time.process_time() - began_s) / len(some)


def standing(last: Epoch) -> list[Epoch]:
    """Return epochs of a phone that stands still and goes on reporting."""
    still = (MotionStep(0.0, float("nan"), 0.0),)
    return [replace(last, time_s=last.time_s + k, motion=still) for k in range(1, _STOOD + 1)]


def day_of(log: TrackLog) -> TrackLog:
    """Return a walk there and back, again and again, of 86 400 epochs."""
    motion, radio = log.motion, log.radio
    end_s = float(motion["time_s"].max())
    back = motion.assign(time_s=2 * end_s + 1 - motion["time_s"])
    back = back.assign(heading_rad=(back["heading_rad"] + 2 * pi) % (2 * pi) - pi)
    mirrored = radio.assign(time_s=2 * end_s - radio["time_s"])
    mirrored = mirrored[mirrored["time_s"] > end_s].sort_values("time_s", kind="stable")
    there = radio[radio["time_s"] > 0]
    both = pd.concat([motion, back.sort_values("time_s")]), pd.concat([there, mirrored])
    repeats = range(int(np.ceil(_DAY / (2 * end_s))))
    tables = [
        pd.concat([table.assign(time_s=table["time_s"] + 2 * end_s * k) for k in repeats])
        for table in both
    ]
    motion, radio = (table[table["time_s"] <= _DAY] for table in tables)
    return make_log(log.crs, motion=motion, radio=radio)


def write_day(walk: Path, folder: Path) -> None:
    """Write the log of a day beside a walk."""
    write_log(day_of(read_log(walk)), folder)


def main() -> None:
    """Print the figures."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("demo", type=Path)
    arguments.add_argument("--runs", type=int, default=5)
    arguments.add_argument("--day", action="store_true")
    given = arguments.parse_args()
    filter_ = BayesFilter().over(open_database(given.demo / "database"))
    walk = next((given.demo / "journeys").iterdir())
    if given.day:
        folder = given.demo / "day"
        if not folder.exists():
            # In another process, as it takes more memory than the filter.
            made = Process(target=write_day, args=(walk, folder))
            made.start()
            made.join()
        day = read_log(folder)
        before_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        found = locate(day, filter_, np.random.default_rng(7))
        most_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        share = np.mean([one.is_followed for one in found.estimate.status])
        print(
            f"{len(found.estimate)} epochs, {share:.1%} followed: {found.filter_s:.1f} s", end=", "
        )
        print(f"{most_mb:.0f} MB, {before_mb:.0f} MB before it")
        return
    merged = epochs(usable_part(read_log(walk), filter_)[0])
    filter_.warm_up(merged)
    state, first = tracked_from(filter_, merged)
    rest = merged[first:]
    print("tracking", *_runs(given.runs, filter_, state, rest))
    print("standing", *_runs(given.runs, filter_, state, standing(merged[first - 1])))


def _runs(runs: int, filter_: BayesPositioner, state: BayesState, some: list[Epoch]) -> list[str]:
    found = [epoch_us(filter_, state, some) for _ in range(runs)]
    return [
        f"{median(found):.0f} us an epoch, of {runs} runs from {min(found):.0f} to {max(found):.0f}"
    ]


if __name__ == "__main__":
    main()
