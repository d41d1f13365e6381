"""A drive in Mountain View with outages of the receiver, coasting on the corridor of the drive.

Speed and course of the receiver stand in for wheels and a gyroscope, as the data's README suggests;
as they are better than these, errors of a vehicle's sensors are added. No other drive is in the
data, so the corridor is that of the receiver's own positions: the streets are known, the place
along them is not.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from mapfilter.angles import wrap_rad
from mapfilter.errors import InputError, fail
from mapfilter.evaluation.truth import Truth
from mapfilter.experiments.recorded.benchmark import Benchmark, Journey, Judged, Task
from mapfilter.experiments.recorded.ground import (
    corridor_routes,
    lattice_about,
    positions_of,
    roads_alone,
)
from mapfilter.experiments.recorded.locating import OpenMap, locate_log
from mapfilter.experiments.recorded.outages import (
    Outages,
    coasted_errors_m,
    errors_at,
    log_without,
)
from mapfilter.experiments.recorded.scoring import score_journey
from mapfilter.propagation.shadowing import named_rng
from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.open_log import open_log
from mapfilter.tracks.open_options import CombineOptions, OpenOptions

PARTS = {"1-minute": 60.0, "3-minutes": 180.0}
RUNS = 5
FIRST_S, PAUSE_S = 120.0, 90.0
SCALE, RATE_DEG_PER_S, WALK_DEG_PER_SQRT_S = 0.02, 0.02, 0.1
"""Added errors, as deviations: of the scale of steps, of a gyroscope's bias and of its noise."""
RIGHT_M = 15.0
_RECEIVER, _REFERENCE = "*ublox*.nmea.gz", "*SPAN*.gga.gz"
_MARGIN_M = 300.0
_MAP = "corridor"
_GAP_S = 3.0


def units(_: Path) -> list[tuple[str, str, int]]:
    """Return the drive once for each length of the outages."""
    return [(part, "drive", RUNS) for part in PARTS]


def prepare(folder: Path, work: Path) -> None:
    """Build the corridor of the receiver's positions."""
    log = _drive(folder)
    track = positions_of(log.gnss)
    lattice = lattice_about(log.crs, [track], _MARGIN_M)
    roads_alone(corridor_routes(lattice, [track]), work / _MAP)


def read(task: Task) -> tuple[TrackLog, OpenMap]:
    """Read the drive, and open the map."""
    return _drive(task.data), OpenMap.open(task.work / _MAP)


def judge(task: Task, shared: tuple[TrackLog, OpenMap]) -> Judged:
    """Locate the drive with outages and one draw of the errors; score their ends."""
    log, over = shared
    rng = named_rng(task.seed, "mountain-view", task.part, str(task.run))
    log = replace(log, motion=with_errors(log.motion, rng), imu=None)
    truth = Truth.of_table(log.truth)
    assert truth is not None, "the reference has more than one position"
    length_s = PARTS[task.part]
    # Each run has its outages elsewhere.
    first_s = FIRST_S + task.run * (length_s + PAUSE_S) / RUNS
    spans = Outages(first_s, length_s, PAUSE_S).within(float(truth.time_s[-1]))
    spans = [span for span in spans if _moves(truth, *span) and _measured(log, *span)]
    located = locate_log(log_without(log, spans), over, rng)
    errors_m, held = errors_at(located.estimate, truth, [end_s for _, end_s in spans])
    whole = score_journey(
        task.part, "bayes", task.unit, located.estimate, truth, seconds=located.filter_s
    )
    there = np.isfinite(errors_m)
    coasted_m = coasted_errors_m(log.motion, truth, spans)
    found = replace(
        whole,
        error_m=errors_m,
        covered=held,
        baseline_m=coasted_m,
        success=bool(np.median(errors_m) <= RIGHT_M) if len(errors_m) else None,
        note=f"{len(spans)} outages, {int(there.sum())} ends with a position. {whole.note}",
    )
    return Judged((found,), {"bayes": Journey(located.estimate, truth, over.path)})


def with_errors(motion: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    """Return steps and turns in place of steps and headings, with the errors of a vehicle's."""
    heading = motion["heading_rad"].ffill().bfill().to_numpy()
    interval_s = np.append(0.0, np.diff(motion["time_s"]))
    turn = np.append(0.0, wrap_rad(np.diff(heading)))
    rate = np.radians(RATE_DEG_PER_S) * rng.standard_normal()
    noise = np.radians(WALK_DEG_PER_SQRT_S) * np.sqrt(interval_s) * rng.standard_normal(len(turn))
    step = motion["step_m"] * np.exp(SCALE * rng.standard_normal())
    turned = turn + rate * interval_s + noise
    return motion.assign(step_m=step, turn_rad=turned, heading_rad=np.nan)


def _drive(folder: Path) -> TrackLog:
    """Read the drive: fixes and motion of the receiver, the reference as truth."""
    found = [sorted(folder.glob(pattern))[:1] for pattern in (_RECEIVER, _REFERENCE)]
    if not all(found):
        raise fail(InputError, str(folder), f"{_RECEIVER} and {_REFERENCE}", "none")
    receiver, reference = (files[0] for files in found)
    combine = CombineOptions(truth=(reference,), course_motion=True)
    return open_log([receiver, reference], options=OpenOptions(combine=combine)).log


def _moves(truth: Truth, begin_s: float, end_s: float) -> bool:
    """Return whether the car drives at 1 m/s or more on average during an outage."""
    way_m = float(truth.distance_at(end_s) - truth.distance_at(begin_s))
    return way_m >= end_s - begin_s


def _measured(log: TrackLog, begin_s: float, end_s: float) -> bool:
    """Return whether the receiver, which stands in for wheels, has no gap in an outage."""
    time_s = log.motion["time_s"][log.motion["step_m"].notna()].to_numpy()
    inside = time_s[(time_s >= begin_s) & (time_s <= end_s)]
    return bool(np.max(np.diff([begin_s, *inside, end_s])) <= _GAP_S)


BENCHMARK = Benchmark(
    "mountain-view",
    "gnss-android-vehicle",
    (_RECEIVER, _REFERENCE),
    units,
    judge,
    prepare,
    read,
)
