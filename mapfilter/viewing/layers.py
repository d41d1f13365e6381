"""Layers that a view gets besides its database: buildings of a map, and bounds."""

from __future__ import annotations

from collections.abc import Mapping
from math import ceil
from typing import Any

import numpy as np
import shapely
from scipy.ndimage import distance_transform_edt

from mapfilter._types import Floats32
from mapfilter.lattice import Lattice
from mapfilter.roads.ways import Buildings
from mapfilter.viewing.arrays import packed, starts
from mapfilter.viewing.ground import ViewFrame

_SIMPLER_M = 0.5
_MOST_CORNERS = 400_000
_MOST_PX, _FILLED_PX = 512, 2
_MIDDLE = (2.0, 95.0)
_STEP_M = 0.5


def frame_of(bundle: Mapping[str, Any]) -> tuple[ViewFrame, tuple[float, float, float, float]]:
    """Return the frame of a view, and the area that it covers: west, south, east, north."""
    frame = bundle["frame"]
    west, south = (float(at) for at in frame["origin"])
    width, height = (float(side) for side in frame["size"])
    return ViewFrame(str(frame["crs"]), west, south), (west, south, west + width, south + height)


def with_buildings(bundle: Mapping[str, Any], buildings: Buildings) -> dict[str, Any]:
    """Return a view with the outlines of buildings under its streets.

    The smallest buildings are left out where all of them are more than a page can hold.
    """
    frame, _ = frame_of(bundle)
    shapes = shapely.simplify(buildings.footprints, _SIMPLER_M)
    order = np.argsort(-shapely.area(shapes), kind="stable")
    fits = np.cumsum(shapely.get_num_coordinates(shapes[order])) <= _MOST_CORNERS
    rings = shapely.get_rings(shapes[order][fits])
    corner = shapely.get_coordinates(rings)
    found = {
        "first": starts(shapely.get_num_coordinates(rings)),
        "east": frame.east(corner[:, 0]),
        "north": frame.north(corner[:, 1]),
    }
    return {**bundle, "background": {**bundle["background"], "buildings": found}}


def with_bound(
    bundle: Mapping[str, Any], lattice: Lattice, layers: Mapping[str, tuple[str, Floats32]]
) -> dict[str, Any]:
    """Return a view with bounds as layers.

    Parameters
    ----------
    lattice : Lattice
        Of the layers.
    layers : mapping of str to (str, ndarray)
        Name, unit and values, NaN for none, shape (rows, cols).
    """
    frame, _ = frame_of(bundle)
    step = max(ceil(max(lattice.rows, lattice.cols) / _MOST_PX), 1)
    shape = ceil(lattice.rows / step), ceil(lattice.cols / step)
    west_m, _, _, north_m = lattice.bounds_m
    grid = frame.grid(west_m, north_m, step * lattice.resolution_m, shape)
    found = []
    for name, (unit, values) in layers.items():
        row, col = np.nonzero(np.isfinite(values))
        if not row.size:
            continue
        thin = np.full(shape, np.nan)
        thin[row // step, col // step] = values[row, col]
        away, (near_row, near_col) = distance_transform_edt(np.isnan(thin), return_indices=True)
        filled = np.where(away <= _FILLED_PX, thin[near_row, near_col], np.nan)
        low, high = np.percentile(values[row, col], _MIDDLE).tolist()
        value = packed(filled, "u2", scale=_STEP_M, none=65_535)
        one = {"grid": grid, "value": value, "name": name, "unit": unit, "range": [low, high]}
        found.append(one)
    return {**bundle, "background": {**bundle["background"], "bound": found or None}}
