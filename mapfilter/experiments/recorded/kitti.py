"""Drives of KITTI on a road raster: odometry and map alone, unknown start and heading.

Odometry is that of a SLAM program where there is one; else true steps and turns with an error that
drifts: of the scale and of the heading, between 1 and 4 % of the way, drawn anew for each run. The
filter is not told how large it is. The runs of a drive begin at different places of its first
third. The first run of each winding drive is located by oracles, too: one that is given the true
positions of the first 30 m, and one that knows how large the errors of its motion are.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from mapfilter._types import Floats
from mapfilter.angles import wrap_rad
from mapfilter.database.build import build_roads
from mapfilter.database.sources import LayerRoutes
from mapfilter.errors import InputError, fail
from mapfilter.evaluation.truth import Truth
from mapfilter.experiments.recorded.benchmark import Benchmark, Journey, Judged, Task
from mapfilter.experiments.recorded.locating import OpenMap, locate_log
from mapfilter.experiments.recorded.oracles import NOISE, START, motion_errors, with_start
from mapfilter.experiments.recorded.rows import Found
from mapfilter.experiments.recorded.scoring import score_journey
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.propagation.shadowing import named_rng
from mapfilter.roads.raster import raster_lattice, read_raster_ways
from mapfilter.roads.route_points import RouteSource
from mapfilter.roads.widths import half_width_of
from mapfilter.tracks.deadreckoning import dead_reckon
from mapfilter.tracks.log import TrackLog, make_log
from mapfilter.tracks.readers.formats import read_recording

STARTS = 10
"""Runs of a drive."""
STRAIGHT = ("01", "04", "06")
"""A motorway, a straight drive, and one that goes up and down one street: by the data's README
there is too little in them to converge."""
LEAST_PERCENT, MOST_PERCENT = 1.0, 4.0
_FIRST_PART = 1 / 3
_CORRELATION_M = 300.0
_HEADING_RAD_PER_SQRT_M = np.sqrt(3) / np.sqrt(100.0)
"""Random walk of a heading that puts the end of 100 m as far aside as they are long."""
_ROAD, _RESOLUTION_M = "residential", 5.0
_MAP, _MADE = "map", "made"


def units(folder: Path) -> list[tuple[str, str, int]]:
    """Return each drive with each odometry; those with real odometry have no made one."""
    found = []
    for truth in sorted((folder / "truth").glob("*.csv")):
        real = sorted((folder / "odometry").glob(f"*-{truth.stem}.csv"))
        found += [(truth.stem, file.stem, STARTS) for file in real] or [(truth.stem, _MADE, STARTS)]
    return found


def prepare(folder: Path, work: Path) -> None:
    """Build the database of the roads of the raster."""
    raster = folder / "roads.tif"
    lattice = raster_lattice(raster, _RESOLUTION_M)
    ways = read_raster_ways(raster, {_ROAD: 1}, lattice.crs, lattice.bounds_m)
    source = RouteSource.of(ways, None, None, half_width_of(_ROAD))
    work.mkdir(parents=True, exist_ok=True)
    build_roads(LayerRoutes(source, lattice), work / _MAP)


def read(task: Task) -> OpenMap:
    """Open the map."""
    return OpenMap.open(task.work / _MAP)


def judge(task: Task, over: OpenMap) -> Judged:
    """Locate one run of a drive."""
    truth = read_truth(task.data / "truth" / f"{task.part}.csv")
    rng = named_rng(task.seed, "kitti", task.part, task.unit, str(task.run))
    if task.unit == _MADE:
        motion = with_drift(perfect_motion(truth), rng)
    else:
        file = task.data / "odometry" / f"{task.unit}.csv"
        motion = read_odometry(file, len(truth))
    first = int(len(truth) * _FIRST_PART * task.run / STARTS)
    log = log_from(truth, motion, first, over.database.lattice.crs)
    located = locate_log(log, over, rng)
    known = Truth.of_table(log.truth)
    assert known is not None, "drives have more than one row"
    found = score_journey(
        task.part,
        "bayes",
        task.unit,
        located.estimate,
        known,
        baseline_m=reckoning_errors_m(truth.iloc[first:], log.motion),
        seconds=located.filter_s,
        asked=(lambda claimed, _: not claimed) if task.part in STRAIGHT else None,
    )
    oracles = []
    if task.run == 0 and task.part not in STRAIGHT:
        scale, drift_deg = motion_errors(log.motion, perfect_motion(truth.iloc[first:]))
        oracles = [
            (START, with_start(log, known), BayesFilter()),
            (NOISE, log, BayesFilter(scale=scale, drift_deg_per_sqrt_m=drift_deg)),
        ]
    return Judged(
        (found, *(_by_oracle(task, over, known, *one) for one in oracles)),
        {"bayes": Journey(located.estimate, known, over.path)},
    )


def _by_oracle(
    task: Task, over: OpenMap, truth: Truth, method: str, log: TrackLog, options: BayesFilter
) -> Found:
    """Locate a run that is given the start, or the errors of its motion."""
    rng = named_rng(task.seed, "kitti", task.part, task.unit, str(task.run), method)
    located = locate_log(log, over, rng, options)
    return score_journey(
        task.part, method, task.unit, located.estimate, truth, seconds=located.filter_s
    )


def read_truth(path: Path) -> pd.DataFrame:
    """Read the true track of a drive: time, place and heading of each frame."""
    rows = read_recording(path).tables["places"]
    return rows[["time_s", "east_m", "north_m", "heading_rad"]]


def read_odometry(path: Path, frames: int) -> pd.DataFrame:
    """Read the odometry of a drive, a row for each frame of its truth.

    Raises
    ------
    InputError
        It has more or fewer rows.
    """
    motion = read_recording(path).tables["motion"]
    if len(motion) != frames:
        raise fail(InputError, str(path), f"{frames} rows, as the truth", len(motion))
    return motion


def perfect_motion(truth: pd.DataFrame) -> pd.DataFrame:
    """Return the steps and turns between the rows of a true track."""
    heading = truth["heading_rad"].to_numpy()
    turn = np.append(0.0, wrap_rad(np.diff(heading)))
    middle = heading - turn / 2
    east, north = (np.append(0.0, np.diff(truth[name])) for name in ("east_m", "north_m"))
    step = east * np.cos(middle) + north * np.sin(middle)
    return pd.DataFrame({"time_s": truth["time_s"], "step_m": step, "turn_rad": turn})


def with_drift(motion: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    """Return motion with an error that drifts, of 1 to 4 % of the way.

    The scale's error wanders about a constant one, the heading's is a random walk by distance.
    """
    share = rng.uniform(LEAST_PERCENT, MOST_PERCENT) / 100
    step = motion["step_m"].to_numpy()
    length = np.abs(step)
    keep = np.exp(-length / _CORRELATION_M)
    noise = np.sqrt(1 - keep**2) * rng.standard_normal(length.size)
    wander, last = np.empty(length.size), rng.standard_normal()
    for i in range(length.size):
        last = keep[i] * last + noise[i]
        wander[i] = last
    scale = share * (rng.standard_normal() + wander) / np.sqrt(2)
    walk = share * _HEADING_RAD_PER_SQRT_M * np.sqrt(length) * rng.standard_normal(length.size)
    return motion.assign(step_m=step * (1 + scale), turn_rad=motion["turn_rad"] + walk)


def log_from(truth: pd.DataFrame, motion: pd.DataFrame, first: int, crs: str) -> TrackLog:
    """Return the log of a drive from a row on."""
    after = motion.iloc[first:].copy()
    after.loc[after.index[0], ["step_m", "turn_rad"]] = 0.0
    known = truth.iloc[first:][["time_s", "east_m", "north_m"]]
    return make_log(crs, motion=after[["time_s", "step_m", "turn_rad"]], truth=known)


def reckoning_errors_m(truth: pd.DataFrame, motion: pd.DataFrame) -> Floats:
    """Return the errors of dead reckoning that is given the true start and heading."""
    start = truth.iloc[0]
    turn = motion["turn_rad"].to_numpy()
    middle = start["heading_rad"] + np.cumsum(turn) - turn / 2
    east, north = dead_reckon(
        float(start["east_m"]), float(start["north_m"]), motion["step_m"].to_numpy(), middle
    )
    true_m = [np.interp(motion["time_s"], truth["time_s"], truth[c]) for c in ("east_m", "north_m")]
    return np.asarray(np.hypot(east - true_m[0], north - true_m[1]))


BENCHMARK = Benchmark(
    "kitti",
    "kitti-osm",
    ("roads.tif", "truth/*.csv"),
    units,
    judge,
    prepare,
    read,
    published_m={("", ""): 3.1},
)
