"""The map under a view: streets, best servers and predicted levels of a database."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import partial
from math import ceil
from typing import Any

import numpy as np
from scipy.ndimage import distance_transform_edt

from mapfilter._types import Floats32, Ints
from mapfilter.database.field import RadioField
from mapfilter.database.points import Points
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.models.level_errors import roughness
from mapfilter.positioning.bayes.area.area_frame import BELOW_FLOOR_DB
from mapfilter.radio.cells import CellPlan
from mapfilter.radio.layers import layers_of
from mapfilter.roads.ways import Bounds
from mapfilter.viewing.arrays import cell_numbers, packed, places, starts
from mapfilter.viewing.streets import middle_lines

LEVEL_DB = 0.3
"""Least step of levels. 254 of them reach from below the floor up to the strongest level."""
_MOST_STEPS = 254

_MOST_LEVELS = 1_500_000
_MOST_BEST_PX, _MOST_POINTS, _MOST_PX = 512, 400_000, 12_000_000
_FILLED_PX = 3
_STEPS = (1, 2, 3, 4, 5, 6, 8, 10, 15, 20, 30, 50, 100)
_LARGEST_STEP_M = 25.0


@dataclass(frozen=True, slots=True)
class ViewFrame:
    """The frame of a view: metres from a south-western corner in a CRS."""

    crs: str
    west_m: float
    south_m: float

    def east(self, east_m: Any) -> dict[str, Any]:
        """Return eastings of the CRS as the page reads them."""
        return places(np.asarray(east_m, dtype=np.float64) - self.west_m)

    def north(self, north_m: Any) -> dict[str, Any]:
        """Return northings of the CRS as the page reads them."""
        return places(np.asarray(north_m, dtype=np.float64) - self.south_m)

    def grid(self, west_m: float, north_m: float, step_m: float, shape: Any) -> dict[str, Any]:
        """Return where the pixels of a raster lie."""
        return {
            "west": west_m - self.west_m,
            "north": north_m - self.south_m,
            "step": step_m,
            "rows": int(shape[0]),
            "cols": int(shape[1]),
        }


def cells_of(plan: CellPlan, frame: ViewFrame) -> list[dict[str, Any]]:
    """Return the cells of a plan as the page reads them."""
    return [
        {
            "id": cell.id,
            "site": cell.site,
            "east": round(cell.east_m - frame.west_m, 1),
            "north": round(cell.north_m - frame.south_m, 1),
            "height_m": cell.height_m,
            "azimuth_deg": cell.azimuth_deg,
            "arfcn": cell.arfcn,
            "bsic": cell.bsic,
            "label": cell.id,
        }
        for cell in plan.cells
    ]


def background(database: RadioRouteDatabase, frame: ViewFrame) -> dict[str, Any]:
    """Return streets and best servers of a whole database."""
    points = database.points()
    few = len(points) <= _MOST_POINTS and database.lattice.rows * database.lattice.cols < _MOST_PX
    streets, ways = _streets(points, database, frame) if few else (_no_streets(), [])
    return {
        "streets": streets,
        "ways": ways,
        "points": None if few and ways else _bits(points, database, frame),
        "buildings": None,
        "best": _best(points, database, frame) if database.cell_ids else None,
        "bound": None,
    }


def empty_background() -> dict[str, Any]:
    """Return a background without anything on it."""
    nothing = {"points": None, "buildings": None, "best": None, "bound": None}
    return {"streets": _no_streets(), "ways": [], **nothing}


def _no_streets() -> dict[str, Any]:
    nowhere = places(np.empty(0))
    return {"first": starts([]), "east": nowhere, "north": nowhere, "way": packed([], "u4")}


def _streets(
    points: Points, database: RadioRouteDatabase, frame: ViewFrame
) -> tuple[dict[str, Any], list[dict[str, str]]]:
    """Return the points of ways, which lie two and more abreast, as lines along their middle."""
    lattice = database.lattice
    way = np.zeros((lattice.rows, lattice.cols), dtype=np.int64)
    way[points.row, points.col] = points.way_id
    lines, ids = middle_lines(way)
    if not lines:
        return _no_streets(), []
    corner = np.concatenate(lines)
    east_m, north_m = lattice.east_north(corner[:, 0], corner[:, 1])
    names, number = np.unique(np.array(ids, dtype=np.int64), return_inverse=True)
    return {
        "first": starts([len(line) for line in lines]),
        "east": frame.east(east_m),
        "north": frame.north(north_m),
        "way": packed(number.astype(np.int64), "u4"),
    }, [{"id": str(one), "name": ""} for one in names.tolist()]


def _bits(points: Points, database: RadioRouteDatabase, frame: ViewFrame) -> dict[str, Any]:
    """Return the points as a picture of one bit a pixel."""
    lattice = database.lattice
    step = ceil(max(lattice.rows, lattice.cols) / 4096)
    shape = ceil(lattice.rows / step), ceil(lattice.cols / step)
    there = np.zeros(shape, dtype=np.bool_)
    there[points.row // step, points.col // step] = True
    west_m, _, _, north_m = lattice.bounds_m
    grid = frame.grid(west_m, north_m, step * lattice.resolution_m, shape)
    return {"grid": grid, "bits": packed(np.packbits(there), "u1"), "square": None}


def _best(points: Points, database: RadioRouteDatabase, frame: ViewFrame) -> dict[str, Any]:
    """Return the best server about the points, its level and its margin."""
    lattice = database.lattice
    step = max(ceil(max(lattice.rows, lattice.cols) / _MOST_BEST_PX), 1)
    shape = ceil(lattice.rows / step), ceil(lattice.cols / step)
    server = np.full(shape, -1, dtype=np.int32)
    level, margin = (np.full(shape, np.nan, dtype=np.float32) for _ in range(2))
    at = points.row // step, points.col // step
    server[at], level[at] = points.best_server, points.best_level_dbm
    margin[at] = np.where(np.isnan(points.margin_db), 63.0, points.margin_db)
    away, (row, col) = distance_transform_edt(server < 0, return_indices=True)
    near = away <= _FILLED_PX
    server = np.where(near, server[row, col], -1)
    west_m, _, _, north_m = lattice.bounds_m
    return {
        "grid": frame.grid(west_m, north_m, step * lattice.resolution_m, shape),
        "server": cell_numbers(server),
        "level": packed(
            np.where(near, level[row, col], np.nan), "u1", scale=0.5, offset=-140.0, none=255
        ),
        "margin": packed(np.where(near, margin[row, col], np.nan), "u1", scale=0.25, none=255),
    }


def level_fields(
    database: RadioRouteDatabase,
    frame: ViewFrame,
    bounds_m: Bounds | None,
    wanted: Collection[str] = (),
) -> tuple[dict[str, Any], Mapping[str, int]]:
    """Return the predicted levels of an area, thinned to what a file can hold; and the bands.

    Parameters
    ----------
    bounds_m : tuple of float or None
        West, south, east, north; None for the whole.
    wanted : collection of str
        Cells that are needed most: only these are in it where all of them would be too many.
    """
    field = database.field(bounds_m)
    quiet_dbm = database.floor_dbm - BELOW_FLOOR_DB
    quiet = np.float32(quiet_dbm)
    level = np.where(np.isnan(field.level_dbm), quiet, field.level_dbm)
    rough = roughness(level, field.lattice.resolution_m)
    chosen = list(range(len(field.cell_ids)))
    step = _step(field, len(chosen))
    most = max(int(_LARGEST_STEP_M / field.lattice.resolution_m), 1)
    needed = [i for i, cell in enumerate(field.cell_ids) if cell in set(wanted)]
    if step > most and needed:
        chosen, step = needed, _step(field, len(needed))
    some = np.s_[step // 2 :: step, step // 2 :: step]
    west_m, _, _, north_m = field.lattice.bounds_m
    plan = database.plan
    layer = np.array(layers_of(plan, field.cell_ids), dtype=np.int64)
    layers, layer_of = np.unique(layer[chosen], return_inverse=True)
    best, second = _two_strongest(level[some], layer, layers, quiet)
    span_db = float(level[some].max(initial=quiet)) - quiet_dbm
    step_db = max(LEVEL_DB, round(span_db / _MOST_STEPS + 5e-4, 3))
    levels = partial(packed, code="u1", scale=step_db, offset=quiet_dbm, none=255)
    found = {
        "grid": frame.grid(
            west_m, north_m, step * field.lattice.resolution_m, level[some].shape[:2]
        ),
        "cells": [plan.index(field.cell_ids[i]) for i in chosen],
        "layer": layer_of.tolist(),
        "level": levels(np.moveaxis(field.level_dbm[some][..., chosen], 2, 0)),
        "rough": packed(np.moveaxis(rough[some][..., chosen], 2, 0), "u1", scale=0.25),
        "quiet_dbm": quiet_dbm,
        "best": levels(best),
        "second": levels(second),
        "distance": packed(
            np.maximum(field.distance_to_way_m - field.half_width_m, 0)[some], "u1", none=255
        ),
        "complete": len(chosen) == len(field.cell_ids),
    }
    return found, {field.cell_ids[i]: band for band, i in enumerate(chosen)}


def _two_strongest(
    level_dbm: Floats32, layer: Ints, layers: Ints, quiet: np.float32
) -> tuple[Floats32, Floats32]:
    """Return the strongest and second strongest level of some layers, each (layers, rows, cols).

    Without any it is the quiet one. ``layer`` is that of each cell.
    """
    found = np.full((2, layers.size, *level_dbm.shape[:2]), quiet)
    for number, one in enumerate(layers):
        order = np.sort(level_dbm[..., layer == one], axis=2)
        for nth in range(min(order.shape[2], 2)):
            found[nth, number] = order[..., -1 - nth]
    return found[0], found[1]


def _step(field: RadioField, cells: int) -> int:
    pixels = field.distance_to_way_m.size * max(cells, 1)
    fits = (step for step in _STEPS if pixels / step**2 <= _MOST_LEVELS)
    return next(fits, _STEPS[-1])
