"""Houses of a synthetic city: what is built on the blocks between its streets."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import shapely
from shapely.geometry import Polygon

from mapfilter._types import Floats, Ints
from mapfilter.roads.ways import Geometries
from mapfilter.simulation.city_streets import GRID, INNER, OLD_TOWN, PARK, VILLAS

_STOREY_M = 3.2
_ROOF_M = 1.5
_LEAST_HOUSE_M2 = 30.0
_LEAST_COURT_M2 = 60.0
_CORNER_RAD = np.radians(25.0)


class _Manner(NamedTuple):
    """Depth and front of houses, gaps to the plot's border and to the street, mean storeys."""

    depth_m: float
    front_m: float
    apart_m: float
    garden_m: float
    storeys: tuple[float, float]


_MANNERS = {
    OLD_TOWN: _Manner(10.0, 9.0, 0.0, 0.0, (3.0, 5.0)),
    INNER: _Manner(12.5, 17.0, 0.0, 0.0, (4.0, 6.5)),
    GRID: _Manner(13.0, 20.0, 0.0, 0.0, (4.0, 7.0)),
    VILLAS: _Manner(13.0, 18.0, 2.5, 3.5, (1.6, 3.2)),
}


_SLABS = _Manner(20.0, 45.0, 4.0, 2.0, (7.0, 13.0))


_SLAB_SHARE = 0.1


def houses(blocks: Geometries, style: Ints, rng: np.random.Generator) -> tuple[Geometries, Floats]:
    """Return the houses on what streets leave of blocks, and their heights; parks stay free."""
    built: list[Polygon] = []
    heights = [np.empty(0)]
    for block, kind in zip(blocks, style.tolist(), strict=True):
        if kind == PARK:
            continue
        is_slabs = kind in (GRID, VILLAS) and rng.random() < _SLAB_SHARE
        manner = _SLABS if is_slabs else _MANNERS[kind]
        mean = rng.uniform(*manner.storeys)
        for part in shapely.get_parts(shapely.buffer(block, -manner.garden_m, join_style="mitre")):
            found = _about(part, manner, rng)
            storeys = np.maximum(np.round(mean + rng.normal(0, 0.7, len(found))), 1)
            built += found
            heights.append(np.round(_STOREY_M * storeys + _ROOF_M, 1))
    return np.array(built, dtype=object), np.concatenate(heights)


def _about(plot: Polygon, manner: _Manner, rng: np.random.Generator) -> list[Polygon]:
    """Return the houses along the edge of a plot, which leave a court in its middle."""
    if plot.area < _LEAST_HOUSE_M2:
        return []
    plot = Polygon(plot.exterior).simplify(0.3)
    court = shapely.buffer(plot, -manner.depth_m, join_style="mitre")
    if court.area < _LEAST_COURT_M2:
        court = shapely.buffer(plot, -0.7 * manner.depth_m, join_style="mitre")
    ring = plot.difference(court)
    cut = shapely.union_all([ring.boundary, *_party_walls(plot, manner, rng)])
    parts = shapely.get_parts(shapely.polygonize([cut]))
    parts = parts[shapely.contains(ring, shapely.point_on_surface(parts))]
    if manner.apart_m:
        parts = shapely.get_parts(shapely.buffer(parts, -manner.apart_m, join_style="mitre"))
    return [part for part in parts if part.area >= _LEAST_HOUSE_M2]


def _party_walls(plot: Polygon, manner: _Manner, rng: np.random.Generator) -> Geometries:
    """Return lines inward from the edge of a plot, clear of its corners."""
    edge = shapely.get_coordinates(shapely.orient_polygons(plot).exterior)
    side = np.diff(edge, axis=0)
    length_m = np.hypot(side[:, 0], side[:, 1])
    side /= length_m[:, None]
    after = np.roll(side, -1, 0)
    sine = side[:, 0] * after[:, 1] - side[:, 1] * after[:, 0]
    turn = np.abs(np.arctan2(sine, (side * after).sum(1)))
    end_m = np.cumsum(length_m)
    corner_m = np.concatenate([[0.0], end_m])[np.concatenate([[turn[-1]], turn]) > _CORNER_RAD]
    count = max(int(end_m[-1] / manner.front_m), 1)
    place_m = (np.arange(count) + rng.uniform(0.2, 0.8, count)) * end_m[-1] / count
    off_m = np.abs(place_m[:, None] - corner_m[None, :]).min(axis=1, initial=np.inf)
    place_m = place_m[off_m > 0.9 * manner.depth_m]
    on = np.minimum(np.searchsorted(end_m, place_m), len(side) - 1)
    foot = edge[on] + side[on] * (place_m - end_m[on] + length_m[on])[:, None]
    inward = np.column_stack([-side[on, 1], side[on, 0]])
    ends = np.stack([foot - 0.5 * inward, foot + (manner.depth_m + 0.5) * inward], axis=1)
    return np.asarray(shapely.linestrings(ends))
