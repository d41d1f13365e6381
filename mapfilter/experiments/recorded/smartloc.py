"""A drive through a street canyon in Berlin: odometry and pseudoranges, without a street map.

The other drives of the data set are in other streets, so the map is open ground about the
receiver's least-squares positions of the first minute. All satellites are used for the first
minute; afterwards none, one, two or three of the highest ones, or all. ``outages`` takes all of
them away for 60 s, again and again. Where a figure is asked for, two oracles locate the same drive:
one knows the true positions before (in place of satellites), one the true size of each error. With
outages three more take the filter's own way through each, from the true place at its beginning, in
the true direction there, or both.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from mapfilter._types import Floats
from mapfilter.errors import InputError, fail
from mapfilter.evaluation.truth import Truth
from mapfilter.experiments.recorded.benchmark import Benchmark, Journey, Judged, Task
from mapfilter.experiments.recorded.ground import lattice_about, open_ground, roads_alone
from mapfilter.experiments.recorded.least_squares import least_squares_positions
from mapfilter.experiments.recorded.locating import OpenMap, locate_log
from mapfilter.experiments.recorded.oracles import (
    NOISE,
    START,
    with_range_errors,
    with_true_fixes,
)
from mapfilter.experiments.recorded.outages import (
    Outages,
    coasted_errors_m,
    errors_at,
    errors_between,
    errors_from_true_begin,
    log_without,
)
from mapfilter.experiments.recorded.rows import Found
from mapfilter.experiments.recorded.scoring import score_journey
from mapfilter.geodesy import unproject
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.positioning.positioned_track import PositionedTrack
from mapfilter.propagation.shadowing import named_rng
from mapfilter.roads.corridors import Positions
from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.open_log import open_log
from mapfilter.tracks.open_options import CombineOptions, OpenOptions

SATELLITES = {"satellites-0": 0, "satellites-1": 1, "satellites-2": 2, "satellites-3": 3}
ALL, OUTAGES = "satellites-all", "outages-60s"
FIRST_S, OUTAGE_S, PAUSE_S = 60.0, 60.0, 15.0
RIGHT_M = {ALL: 12.0, OUTAGES: 25.0}
"""What is asked for: the median error, and that at the ends of outages."""
RUNS = 3
_MARGIN_M = 600.0
_MAP = "open"


def units(folder: Path) -> list[tuple[str, str, int]]:
    """Return the drives that have sensors, each with every number of satellites."""
    parts = (*SATELLITES, ALL, OUTAGES)
    # Without outages nothing differs between runs but the filter's random numbers.
    return [
        (part, _name(file), RUNS if part == OUTAGES else 1)
        for file in _inputs(folder)
        for part in parts
    ]


def prepare(folder: Path, work: Path) -> None:
    """Build open ground about the first positions of each drive."""
    for file in _inputs(folder):
        log = _drive(file)
        first = log.pseudoranges[log.pseudoranges["time_s"] <= FIRST_S]
        east, north = least_squares_positions(first, log.crs)[1:]
        middle = Positions(np.array([np.median(east)]), np.array([np.median(north)]))
        lattice = lattice_about(log.crs, [middle], _MARGIN_M)
        roads_alone(open_ground(lattice), work / _name(file) / _MAP)


def read(task: Task) -> tuple[TrackLog, OpenMap]:
    """Read a drive, and open its map."""
    file = next(file for file in _inputs(task.data) if _name(file) == task.unit)
    return _drive(file), OpenMap.open(task.work / task.unit / _MAP)


def judge(task: Task, shared: tuple[TrackLog, OpenMap]) -> Judged:
    """Locate a drive with some of its satellites."""
    log, over = shared
    truth = Truth.of_table(log.truth)
    assert truth is not None, "the ground truth has more than one position"
    end_s = float(truth.time_s[-1])
    spans: list[tuple[float, float]] = []
    if task.part == OUTAGES:
        first_s = FIRST_S + task.run * (OUTAGE_S + PAUSE_S) / RUNS
        spans = Outages(first_s, OUTAGE_S, PAUSE_S).within(end_s)
        given = log_without(log, spans)
        baseline_m = coasted_errors_m(log.motion, truth, spans)
    else:
        most = SATELLITES.get(task.part)
        kept = log.pseudoranges if most is None else highest(log, most, FIRST_S)
        given = replace(log, pseudoranges=kept)
        if task.part == ALL:
            baseline_m = _least_squares_errors_m(log, truth)
        else:
            baseline_m = _reckoned_errors_m(log, truth)
    found: list[Found] = []
    journeys: dict[str, Journey] = {}
    for method, one in {"bayes": given, **by_oracles(task.part, given, truth, spans)}.items():
        words = (task.part, str(task.run), *(() if method == "bayes" else (method,)))
        located = located_by(method, one, over, named_rng(task.seed, "smartloc", *words))
        scored = score_journey(
            task.part, method, task.unit, located.estimate, truth, seconds=located.filter_s
        )
        if task.part == OUTAGES:
            errors_m, held = errors_at(located.estimate, truth, [end for _, end in spans])
        else:
            errors_m, held = errors_between(located.estimate, truth, FIRST_S, end_s)
        missing = int(np.isinf(errors_m).sum())
        right = is_right(errors_m, RIGHT_M[task.part]) if task.part in RIGHT_M else scored.success
        found.append(
            replace(
                scored,
                error_m=errors_m,
                covered=held,
                baseline_m=baseline_m,
                success=right,
                note=f"{missing} of {len(errors_m)} without a position. {scored.note}",
            )
        )
        journeys[method] = Journey(located.estimate, truth, over.path)
        if task.part == OUTAGES and method == "bayes":
            found += _from_true_begin(task, located.estimate, truth, spans)
    return Judged(tuple(found), journeys)


def is_right(errors_m: Floats, most_m: float) -> bool | None:
    """Return whether the median error is what is asked for; None of a drive too short for any."""
    return bool(np.median(errors_m) <= most_m) if errors_m.size else None


def located_by(
    method: str, log: TrackLog, over: OpenMap, rng: np.random.Generator
) -> PositionedTrack:
    """Locate a log as its method is: with white errors where their true sizes are stated."""
    return locate_log(log, over, rng, white_ranges=method == NOISE)


def _from_true_begin(
    task: Task, estimate: TrackEstimate, truth: Truth, spans: Sequence[tuple[float, float]]
) -> list[Found]:
    """Return the errors at the ends of outages with parts of their beginnings true."""
    none, no_radii = (None, None, None), np.empty(0, dtype=np.bool_)
    return [
        Found(task.part, method, task.unit, *none, errors_m, no_radii)
        for method, errors_m in errors_from_true_begin(estimate, truth, spans).items()
    ]


def by_oracles(
    part: str, log: TrackLog, truth: Truth, spans: Sequence[tuple[float, float]]
) -> dict[str, TrackLog]:
    """Return what the oracles of a part are given, by method; nothing where no figure is asked for.

    The start is known by true positions: of the first minute, with outages until each of them. The
    noise is known by the true size of each pseudorange's error.
    """
    if part not in RIGHT_M:
        return {}
    which = truth.time_s <= FIRST_S
    if spans:
        inside = [(truth.time_s > begin) & (truth.time_s <= end) for begin, end in spans]
        which = ~np.any(inside, axis=0)
    kept = log.pseudoranges if not spans else log.pseudoranges.iloc[:0]
    later = kept[kept["time_s"] > FIRST_S].reset_index(drop=True)
    started = with_true_fixes(replace(log, pseudoranges=later), truth, which)
    return {START: started, NOISE: with_range_errors(log, truth)}


def highest(log: TrackLog, most: int, after_s: float) -> pd.DataFrame:
    """Return pseudoranges of which so many, of the highest satellites, are left after a time."""
    rows = log.pseudoranges
    east, north = log.truth["east_m"].iloc[0], log.truth["north_m"].iloc[0]
    up = _up_of(log.crs, float(east), float(north))
    place = rows[["x_m", "y_m", "z_m"]].to_numpy()
    # Far above the earth the direction from its centre orders satellites as their elevation does.
    height = (place @ up) / np.linalg.norm(place, axis=1)
    rank = pd.Series(-height).groupby(rows["time_s"].to_numpy()).rank(method="first").to_numpy()
    kept = (rows["time_s"].to_numpy() <= after_s) | (rank <= most)
    return rows[kept].reset_index(drop=True)


def _up_of(crs: str, east_m: float, north_m: float) -> Floats:
    lon, lat = (np.radians(part[0]) for part in unproject(crs, [east_m], [north_m]))
    return np.array([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)])


def _least_squares_errors_m(log: TrackLog, truth: Truth) -> Floats:
    time_s, east, north = least_squares_positions(log.pseudoranges, log.crs)
    true_east, true_north = truth.at(time_s)
    errors = np.hypot(east - true_east, north - true_north)
    return np.asarray(errors[np.isfinite(errors) & (time_s > FIRST_S)])


def _reckoned_errors_m(log: TrackLog, truth: Truth) -> Floats:
    """Return the errors of dead reckoning alone from the end of the first minute on."""
    times = log.motion["time_s"].to_numpy()
    after = times[(times > FIRST_S) & (times <= truth.time_s[-1])]
    return coasted_errors_m(log.motion, truth, [(FIRST_S, float(end)) for end in after])


def _drive(file: Path) -> TrackLog:
    """Read a drive: odometry and pseudoranges, and its ground truth."""
    truth = file.with_name(file.name.replace("_Input", "_GT"))
    if not truth.is_file():
        raise fail(InputError, str(truth), "the ground truth of the drive", "none")
    combine = CombineOptions(truth=(truth,))
    return open_log([file, truth], options=OpenOptions(combine=combine)).log


def _inputs(folder: Path) -> list[Path]:
    """Return the drives with sensors; those of RTKLIB are the same drives, solved otherwise."""
    files = sorted(folder.glob("*_Input.txt.gz"))
    return [file for file in files if not file.name.startswith("RTKLIB")]


def _name(file: Path) -> str:
    return file.name.removesuffix("_Input.txt.gz")


BENCHMARK = Benchmark(
    "smartloc",
    "gnss-odometry-smartloc",
    ("*_Input.txt.gz", "*_GT.txt.gz"),
    units,
    judge,
    prepare,
    read,
)
