"""A town of irregular blocks, drives along its streets, and their odometry with errors."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
import shapely

from mapfilter.angles import wrap_rad
from mapfilter.lattice import Lattice
from mapfilter.roads.ways import Ways
from mapfilter.tracks.log import make_log

CRS = "EPSG:32632"
WEST_M, SOUTH_M, SIDE_M = 455_000.0, 5_430_000.0, 1200.0
STEP_M, STEP_S = 2.0, 0.25
_CORNER_STEPS = 5


@dataclass(frozen=True)
class Town:
    """Junctions (N, 2) in the CRS, and the pairs of them that a street joins."""

    junctions_m: np.ndarray
    streets: tuple[tuple[int, int], ...]

    @property
    def ways(self) -> Ways:
        lines = shapely.linestrings(self.junctions_m[np.array(self.streets)])
        ids = np.arange(1, len(lines) + 1)
        return Ways.open(CRS, ids, np.full(len(lines), "road", dtype=object), lines)


LATTICE = Lattice.covering(
    CRS, (WEST_M - 60, SOUTH_M - 60, WEST_M + SIDE_M + 60, SOUTH_M + SIDE_M + 60), 5.0
)


def make_town(seed: int) -> Town:
    """Streets 70 to 190 m apart, junctions shifted, every sixth street missing."""
    rng = np.random.default_rng(seed)
    lines = [np.append(0.0, np.cumsum(rng.uniform(70, 190, 40))) for _ in range(2)]
    east, north = (line[line < SIDE_M] for line in lines)
    grid = np.stack(np.meshgrid(east, north, indexing="ij"), axis=-1)
    grid += rng.uniform(-18, 18, grid.shape)
    number = np.arange(grid.shape[0] * grid.shape[1]).reshape(grid.shape[:2])
    pairs = [*zip(number[:-1].ravel(), number[1:].ravel(), strict=True)]
    pairs += zip(number[:, :-1].ravel(), number[:, 1:].ravel(), strict=True)
    kept = tuple((int(a), int(b)) for a, b in pairs if rng.random() > 1 / 6)
    return Town(grid.reshape(-1, 2) + np.array([WEST_M, SOUTH_M]), kept)


def drive(town: Town, seed: int, length_m: float) -> np.ndarray:
    """Return a path along streets, turning at junctions at random, (N, 2), a step apart."""
    rng = np.random.default_rng(seed)
    near = {}
    for a, b in town.streets:
        near.setdefault(a, []).append(b)
        near.setdefault(b, []).append(a)
    # Dead ends are not driven into.
    while dead := [one for one, others in near.items() if len(others) == 1]:
        for one in dead:
            near[near.pop(one)[0]].remove(one)
    here = int(rng.choice(sorted(near)))
    passed, before, gone_m = [here], -1, 0.0
    while gone_m < length_m + 50:
        ahead = [other for other in near[here] if other != before]
        before, here = here, int(rng.choice(ahead))
        passed.append(here)
        gone_m += float(np.hypot(*(town.junctions_m[here] - town.junctions_m[before])))
    line = shapely.LineString(town.junctions_m[passed])
    at_m = np.arange(0.0, length_m, STEP_M)
    path = shapely.get_coordinates(shapely.line_interpolate_point(line, at_m))
    # Corners are rounded as a car does.
    around = np.pad(path, ((_CORNER_STEPS // 2,) * 2, (0, 0)), mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(around, _CORNER_STEPS, axis=0)
    return windows.mean(axis=-1)


def wander(seed: int, length_m: float) -> np.ndarray:
    """Return a path that keeps to no street: bends of all kinds, within the town."""
    rng = np.random.default_rng(seed)
    count = int(length_m / STEP_M)
    bend = np.repeat(rng.uniform(-0.05, 0.05, count // 12 + 1), 12)[:count]
    heading = np.cumsum(bend)
    steps = STEP_M * np.stack([np.cos(heading), np.sin(heading)], axis=-1)
    return np.cumsum(steps, axis=0) + np.array([WEST_M, SOUTH_M]) + SIDE_M / 2


def odometry(path, seed, *, scale=0.01, walk_deg=0.15, compass_sd_deg=None):
    """Return motion of a path with errors, turns alone or headings of a compass."""
    rng = np.random.default_rng(seed)
    moved = np.diff(path, axis=0)
    heading = np.arctan2(moved[:, 1], moved[:, 0])
    step = np.hypot(*moved.T) * np.exp(scale * rng.standard_normal())
    error = np.cumsum(np.radians(walk_deg) * np.sqrt(step) * rng.standard_normal(step.size))
    table = pd.DataFrame({"time_s": STEP_S * np.arange(1, len(path)), "step_m": step})
    if compass_sd_deg is None:
        turn = wrap_rad(np.diff(heading + error, prepend=heading[0]))
        return table.assign(heading_rad=np.nan, turn_rad=turn)
    lasting = np.radians(compass_sd_deg) * rng.standard_normal()
    return table.assign(heading_rad=wrap_rad(heading + error + lasting), turn_rad=np.nan)


def as_log(path, motion):
    """Return a log of motion with its truth."""
    time_s = STEP_S * np.arange(len(path))
    truth = pd.DataFrame({"time_s": time_s, "east_m": path[:, 0], "north_m": path[:, 1]})
    return make_log(CRS, motion=motion, truth=truth)
