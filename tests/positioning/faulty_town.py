"""The made town as a faulty plan, prediction or map shows it, and walks through the true one."""

from dataclasses import dataclass, replace

import numpy as np
from made_town import FLOOR_DBM, STEP_M, Town, walk_log

TOWN = Town.of(1)
LENGTH_M = 500.0
_SECTORS = np.arange(6) * 2.1


@dataclass(frozen=True, eq=False)
class OtherTown(Town):
    """A town that differs from another one in its radio.

    Parameters
    ----------
    turned_rad, bias_db : tuple of float
        Of each cell: how far its antenna is turned, and what is added to its levels.
    district : tuple of float
        East, north and radius of a disc in metres, and what is added to all levels there.
    off : tuple of int
        Cells that are not on air.
    """

    turned_rad: tuple[float, ...] = (0.0,) * 6
    bias_db: tuple[float, ...] = (0.0,) * 6
    district: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    off: tuple[int, ...] = ()

    def levels_dbm(self, place_m):
        place_m = np.asarray(place_m)
        level = super().levels_dbm(place_m)
        apart = place_m[..., None, :] - self.cells_m
        angle = np.arctan2(apart[..., 1], apart[..., 0]) - _SECTORS
        # The pattern of a sector is 8 dB (cos - 1).
        level = level + 8 * (np.cos(angle - np.array(self.turned_rad)) - np.cos(angle))
        east_m, north_m, radius_m, offset_db = self.district
        inside = np.hypot(place_m[..., 0] - east_m, place_m[..., 1] - north_m) < radius_m
        level = level + np.array(self.bias_db) + offset_db * inside[..., None]
        level[..., list(self.off)] = FLOOR_DBM - 35.0
        return level


def other(town=TOWN, **faults):
    return OtherTown(town.east_m, town.north_m, town.cells_m, town.slope, **faults)


def moved(cell, east_m, north_m):
    cells_m = TOWN.cells_m.copy()
    cells_m[cell] += (east_m, north_m)
    return replace(TOWN, cells_m=cells_m)


def without_streets(east, north):
    """Return the town without some of the streets along either axis."""
    return replace(
        TOWN, east_m=np.delete(TOWN.east_m, east), north_m=np.delete(TOWN.north_m, north)
    )


@dataclass(frozen=True, eq=False)
class OffWays(Town):
    """A town whose walkers leave the streets half way, and go straight on for 120 m."""

    def walk(self, length_m, rng):
        path = super().walk(length_m, rng)
        left = path[len(path) // 2]
        toward = np.array([np.cos(1.0), np.sin(1.0)]) * np.where(left < 450.0, 1.0, -1.0)
        beyond = left + toward * STEP_M * np.arange(1, 25)[:, None]
        return np.concatenate([path[: len(path) // 2], beyond])


def walk(seed, town=TOWN, length_m=LENGTH_M):
    return walk_log(town, seed, length_m, error_db=1.0)


def turned(log, radians):
    """Return a log whose headings are off by some radians, one number or one each."""
    heading = log.motion["heading_rad"] + radians
    wrapped = (heading + np.pi) % (2 * np.pi) - np.pi
    return replace(log, motion=log.motion.assign(heading_rad=wrapped))
