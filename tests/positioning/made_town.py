"""A made town of 0.8 km² in memory, walks through it, and walks through another one.

Streets run along both axes, from 70 to 150 m apart. Levels fall off with the distance, and about
their prediction they wander along the way as a sum of sines does: no process of the filter's.
"""

from dataclasses import dataclass, replace
from functools import cache, lru_cache

import numpy as np
import pandas as pd

from mapfilter.database.field import RadioField
from mapfilter.lattice import Lattice
from mapfilter.positioning.bayes.area.area_map import AreaMap
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.tracks.log import make_log

CRS, PIXEL_M, SIDE_M = "EPSG:32629", 5.0, 900.0
WEST_M, SOUTH_M, FLOOR_DBM, STEP_M = 500_000.0, 4_500_000.0, -115.0, 5.0
NAMES, TABLES = tuple("ABCDEF"), ("motion", "radio", "truth")


# Towns are the same by identity, as arrays have no hash.
@dataclass(frozen=True, eq=False)
class Town:
    """Streets by the coordinates that they run along, and cells by their places."""

    east_m: np.ndarray
    north_m: np.ndarray
    cells_m: np.ndarray
    slope: float = 35.0

    @classmethod
    @cache
    def of(cls, seed, slope=35.0):
        """Return a town; others have other streets and cells of the same names."""
        rng = np.random.default_rng(seed)
        east_m, north_m = (np.cumsum(rng.uniform(70, 150, 12)) for _ in range(2))
        east_m, north_m = (x[x < SIDE_M - 30] for x in (east_m, north_m))
        sites_m = rng.uniform(100, SIDE_M - 100, (4, 2))
        cells_m = sites_m[[0, 0, 1, 2, 3, 3]] + [[0, 0], [3, 0]] * 3
        return cls(east_m, north_m, cells_m, slope)

    def levels_dbm(self, place_m):
        """Levels of all cells at places, (..., 2), each sector stronger to its own side."""
        apart = np.asarray(place_m)[..., None, :] - self.cells_m
        angle = np.arctan2(apart[..., 1], apart[..., 0]) - np.arange(6) * 2.1
        return (
            -28
            - self.slope * np.log10(np.hypot(*np.moveaxis(apart, -1, 0)) / 10 + 2)
            + (8 * (np.cos(angle) - 1))
        )

    def area(self):
        """Return the town's map."""
        count = round(SIDE_M / PIXEL_M)
        lattice = Lattice(CRS, WEST_M, SOUTH_M + SIDE_M, PIXEL_M, count, count)
        middle = (np.arange(count) + 0.5) * PIXEL_M
        east, north = np.meshgrid(middle, middle[::-1])
        away = [np.abs(axis[..., None] - lines).min(axis=-1)
                for axis, lines in ((east, self.east_m), (north, self.north_m))]  # fmt: skip
        distance = np.minimum(*away).astype(np.float32)
        level = self.levels_dbm(np.stack([east, north], axis=-1)).astype(np.float32)
        level[level < FLOOR_DBM] = np.nan
        on_way = distance <= 4.0
        way = np.ones(distance.shape, dtype=np.int64)
        field = RadioField(
            lattice, NAMES, level, distance, np.full_like(distance, 3.0), way, on_way
        )
        return AreaMap.of_field(field, self.plan(), FLOOR_DBM)

    def plan(self):
        """Return the town's cells."""
        cells = tuple(
            Cell(name, name, WEST_M + x, SOUTH_M + y, 30.0, None, 50.0, 900.0, "omni")
            for name, (x, y) in zip(NAMES, self.cells_m, strict=True)
        )
        return CellPlan(CRS, cells)

    def walk(self, length_m, rng):
        """Return places every 5 m: on along streets, with turns at crossings."""
        crossing = [int(rng.integers(len(x))) for x in (self.east_m, self.north_m)]
        lines, places, before = (self.east_m, self.north_m), [], None
        while len(places) * STEP_M < length_m:
            ways = [(axis, way) for axis in (0, 1) for way in (-1, 1)
                    if 0 <= crossing[axis] + way < len(lines[axis])
                    and (axis, -way) != before]  # fmt: skip
            axis, way = before = ways[rng.integers(len(ways))]
            start = np.array([lines[k][crossing[k]] for k in (0, 1)])
            crossing[axis] += way
            end = np.array([lines[k][crossing[k]] for k in (0, 1)])
            steps = np.arange(0.0, np.hypot(*(end - start)), STEP_M) / np.hypot(*(end - start))
            places.extend(start + share * (end - start) for share in steps)
        return np.array(places)[: round(length_m / STEP_M)]


def walk_log(town, seed, length_m=1200.0, *, turned_rad=0.0, levels=True, error_db=6.0):
    """Return a log of a walk: headings of 6°, a bias of 5°, levels that err along the way.

    Many tests take the same walks; each has tables of its own.
    """
    log = _walked(town, seed, length_m, turned_rad, levels, error_db)
    return replace(log, **{name: getattr(log, name).copy() for name in TABLES})


@lru_cache(128)
def _walked(town, seed, length_m, turned_rad, levels, error_db):
    rng = np.random.default_rng(seed)
    place_m = town.walk(length_m, rng)
    moved = np.diff(place_m, axis=0)
    gone_m = np.arange(len(place_m)) * STEP_M
    heading = np.arctan2(moved[:, 1], moved[:, 0]) + turned_rad
    heading += np.radians(rng.normal(0, 5) + rng.normal(0, 6, heading.size))
    step_m = np.hypot(*moved.T) * rng.normal(1, 0.02) + rng.normal(0, 0.3, heading.size)
    wave = 2 * np.pi * gone_m[:, None, None] / rng.uniform(60, 500, (6, 5)) + rng.uniform(0, 6, 5)
    level = town.levels_dbm(place_m) + error_db * np.sqrt(2 / 5) * np.sin(wave).sum(axis=-1)
    level += rng.normal(0, 4) + rng.normal(0, 2, level.shape)
    rows = []
    for time_s, heard in enumerate(level.tolist()):
        order = np.argsort(heard)[::-1][:5]
        for k, cell in enumerate(order):
            if heard[cell] > FLOOR_DBM and (levels or k == 0):
                role = "neighbour" if k else "serving"
                rows.append((float(time_s), role, NAMES[cell], heard[cell] if levels else np.nan))
    radio = pd.DataFrame(rows, columns=["time_s", "role", "cell", "level_dbm"])
    time_s = np.arange(len(place_m), dtype=float)
    motion = pd.DataFrame({"time_s": time_s[1:], "step_m": step_m, "heading_rad": heading})
    truth = pd.DataFrame({"time_s": time_s, "east_m": WEST_M + place_m[:, 0],
                          "north_m": SOUTH_M + place_m[:, 1]})  # fmt: skip
    return make_log(CRS, motion=motion, radio=radio, truth=truth, start_utc_s=1.7e9)


def slowed(log, times=4.0):
    """Return a walk at a fraction of its 5 m/s, which are no walker's speed."""
    tables = {name: getattr(log, name) for name in TABLES}
    slow = {name: rows.assign(time_s=times * rows["time_s"]) for name, rows in tables.items()}
    return replace(log, **slow)
