"""Drives located by a road map and odometry alone: python benchmarks/maps_without_radio.py DATA.

DATA is a folder with ``kitti-osm``: drives of KITTI, a raster of the roads about them, and stereo
odometry of drive 00. Other drives have perfect odometry plus made errors. Each drive is also turned
about (every left turn a right one: a path of which the map holds nothing), and located on a map
from which the piece about it is cut. Settings were chosen on drives 02 and 07, and on drives 01,
02, 05 and 07 turned about; the others judge.
"""

import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import rasterio
from scipy.ndimage import label

from mapfilter.database.build import build_roads
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.database.sources import LayerRoutes
from mapfilter.experiments.recorded.kitti import perfect_motion
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.filter import Filter
from mapfilter.positioning.loop import locate
from mapfilter.roads.raster import raster_lattice, read_raster_ways
from mapfilter.roads.route_points import RouteSource
from mapfilter.tracks.log import TrackLog, make_log

DRIVES = ("00", "01", "02", "04", "05", "06", "07")
REAL = {"ORB-SLAM": "orb-slam-00.csv", "S-PTAM": "s-ptam-00.csv"}
SEEDS = (1, 2, 3)
SCALE, STEP_M, WALK_DEG, RATE_DEG_PER_M = 0.02, 0.03, 0.2, 0.01
"""Made errors: deviations of the journey's scale, of a step of 1 m, of the random walk of the
heading (per square root of a metre), and of its steady growth."""
UNKNOWN = 255
WRONG_M = 50.0


@dataclass(frozen=True, eq=False)
class Case:
    """A log, the map that it is located on, and what is to be expected."""

    kind: str
    drive: str
    odometry: str
    log: TrackLog
    filter: Filter
    seed: int


def read_drive(data: Path, drive: str) -> pd.DataFrame:
    """Read the true track of a drive."""
    return pd.read_csv(data / "truth" / f"{drive}.csv")


def with_errors(motion: pd.DataFrame, seed: int) -> pd.DataFrame:
    """Return motion with made errors."""
    rng = np.random.default_rng(seed)
    step, length = motion["step_m"].to_numpy(), motion["step_m"].abs().to_numpy()
    noisy = step * np.exp(SCALE * rng.standard_normal())
    noisy = noisy + STEP_M * np.sqrt(length) * rng.standard_normal(length.size)
    walk = np.radians(WALK_DEG) * np.sqrt(length) * rng.standard_normal(length.size)
    rate = np.radians(RATE_DEG_PER_M) * rng.standard_normal() * length
    return motion.assign(step_m=noisy, turn_rad=motion["turn_rad"] + walk + rate)


def turned_about(motion: pd.DataFrame) -> pd.DataFrame:
    """Return motion with left and right exchanged."""
    return motion.assign(turn_rad=-motion["turn_rad"])


def as_log(crs: str, motion: pd.DataFrame, truth: pd.DataFrame) -> TrackLog:
    """Return a log of motion and truth."""
    return make_log(crs, motion=motion, truth=truth[["time_s", "east_m", "north_m"]])


def over_raster(raster: Path, folder: Path) -> RadioRouteDatabase:
    """Build a database of the roads of a raster."""
    lattice = raster_lattice(raster, 5.0)
    ways = read_raster_ways(raster, {"road": 1}, lattice.crs, lattice.bounds_m)
    return build_roads(LayerRoutes(RouteSource.of(ways, None, None, 6.0), lattice), folder)


def without_piece(raster: Path, truth: pd.DataFrame, target: Path) -> None:
    """Write a raster without the covered piece that a drive lies in."""
    with rasterio.open(raster) as source:
        values, profile = source.read(1), source.profile
        row, col = rasterio.transform.rowcol(source.transform, truth["east_m"], truth["north_m"])
    piece, _ = label(values != UNKNOWN)
    values[np.isin(piece, np.unique(piece[row, col]))] = UNKNOWN
    with rasterio.open(target, "w", **profile) as source:
        source.write(values, 1)


def cases(data: Path, folder: Path) -> Iterator[Case]:
    """Yield all cases, those that judge first."""
    options = BayesFilter(vehicle=True)
    database = over_raster(data / "roads.tif", folder / "all")
    everywhere, crs = options.over(database), database.lattice.crs
    truths = {drive: read_drive(data, drive) for drive in DRIVES}
    for name, file in REAL.items():
        motion = pd.read_csv(data / "odometry" / file)
        for seed in SEEDS:
            log = as_log(crs, motion, truths["00"])
            yield Case("own", "00", name, log, everywhere, seed)
    for drive, truth in truths.items():
        for seed in SEEDS:
            log = as_log(crs, with_errors(perfect_motion(truth), seed), truth)
            yield Case("own", drive, "made", log, everywhere, seed)
    for drive, truth in truths.items():
        for seed in SEEDS[:2]:
            motion = turned_about(with_errors(perfect_motion(truth), seed))
            yield Case("turned", drive, "made", as_log(crs, motion, truth), everywhere, seed)
    for drive, truth in truths.items():
        raster = folder / f"{drive}.tif"
        without_piece(data / "roads.tif", truth, raster)
        away = options.over(over_raster(raster, folder / drive))
        for seed in SEEDS[:2]:
            log = as_log(crs, with_errors(perfect_motion(truth), seed), truth)
            yield Case("away", drive, "made", log, away, seed)


def figures(case: Case) -> dict[str, object]:
    """Locate a case and score it."""
    track = locate(case.log, case.filter, np.random.default_rng(case.seed))
    estimate, truth = track.estimate, case.log.truth
    east_m = np.interp(estimate.time_s, truth["time_s"], truth["east_m"])
    north_m = np.interp(estimate.time_s, truth["time_s"], truth["north_m"])
    error_m = np.hypot(estimate.east_m - east_m, estimate.north_m - north_m)
    status = np.array([str(one) for one in estimate.status])
    claimed = np.isin(status, ("CONVERGED", "TRACKING"))
    travelled_m = case.log.motion["step_m"].abs().cumsum().to_numpy()
    found = {"kind": case.kind, "drive": case.drive, "odometry": case.odometry, "seed": case.seed}
    found |= {"claimed": claimed.mean(), "end": status[-1], "seconds": track.filter_s}
    if claimed.any():
        at = int(np.argmax(claimed))
        found |= {"first_m": travelled_m[at], "first_error_m": error_m[at]}
        found |= {"median_m": np.median(error_m[claimed])}
        found |= {"p95_m": np.percentile(error_m[claimed], 95)}
        found |= {"wrong": np.mean(error_m[claimed] > WRONG_M)}
        found |= {"within_r95": np.mean(error_m[claimed] <= estimate.radii_m[claimed, 2])}
    return found


def main(data: Path) -> None:
    """Print one line for each case."""
    with tempfile.TemporaryDirectory() as folder:
        for case in cases(data / "kitti-osm", Path(folder)):
            row = figures(case)
            shown = (f"{v:.3g}" if isinstance(v, float) else str(v) for v in row.values())
            names = " ".join(f"{name}={value}" for name, value in zip(row, shown, strict=True))
            print(names, flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
