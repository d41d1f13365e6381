"""Streets of a synthetic city: main roads, the quarters between them, and the streets in these.

Quarters are cut across their longer side again and again, as Parish and Müller (2001),
"Procedural modeling of cities", SIGGRAPH, and those after them do; in an old town by uneven cuts,
farther out by grids that each have their own direction. At the end the plane is bent a little, most
of all in the old town, so that no street is quite straight and every crossing stays one.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from functools import partial
from typing import NamedTuple

import numpy as np
import shapely
from shapely.geometry import LineString, Polygon
from shapely.geometry.base import BaseGeometry
from shapely.ops import split

from mapfilter._types import Floats
from mapfilter.roads.ways import Bounds

Roads = list[tuple[LineString, str]]
"""Lines with their classes, as OpenStreetMap calls them."""

Quarter = tuple[Polygon, int]
"""A part of the city that is built in one style."""

OLD_TOWN, INNER, GRID, VILLAS, PARK = range(5)

SNAP_M = 0.01
"""Corners are rounded to this, so that streets share them exactly."""

_RINGS = (1.0, 2.5, 4.7, 7.6)
_RING_GROWTH = 1.45
_QUAY_M = 17.0
_BRIDGES_APART_M = 420.0
_CROSSED = 0.45
_NAME_SHARES = (0.55, 0.3, 0.15)
_RESIDENTIAL = ("residential", "residential", "residential")
# Area of a block, least side, how uneven the cuts are, and kinds of street.
_CUTS: dict[int, tuple[tuple[float, float], float, float, tuple[str, str, str]]] = {
    OLD_TOWN: ((3200.0, 7000.0), 30.0, 0.3, ("living_street", "pedestrian", "footway")),
    INNER: ((14000.0, 27000.0), 65.0, 0.2, _RESIDENTIAL),
    VILLAS: ((18000.0, 34000.0), 70.0, 0.18, _RESIDENTIAL),
    PARK: ((30000.0, 70000.0), 80.0, 0.3, ("path", "path", "footway")),
}


class Skeleton(NamedTuple):
    """Layout of a city in metres from its centre.

    ``roads`` are main roads, quays and bridges. ``banks`` is the ``river`` with the strips up to
    the middle of the quays; without a river both are empty.
    """

    roads: Roads
    river: Polygon
    banks: Polygon
    old_town_m: float


def skeleton(box: Bounds, with_river: bool, rng: np.random.Generator) -> Skeleton:
    """Return river, quays, bridges, ring roads and radial roads within a box about (0, 0)."""
    sides_m = box[2] - box[0], box[3] - box[1]
    least_m, reach_m = min(sides_m), float(np.hypot(*sides_m))
    old_town_m = float(np.clip(0.115 * least_m, 90.0, 350.0))
    river, banks, middle = Polygon(), Polygon(), LineString()
    if with_river:
        width_m = float(np.clip(0.036 * least_m, 25.0, 110.0))
        middle = _river_line(reach_m, 1.05 * old_town_m + width_m, least_m, rng)
        river = middle.buffer(width_m / 2, cap_style="flat", quad_segs=4)
        banks = middle.buffer(width_m / 2 + _QUAY_M, cap_style="flat", quad_segs=4)
    roads: Roads = []
    crossings: list[LineString] = []
    for line, name in (*_rings(old_town_m, reach_m, rng), *_radials(old_town_m, reach_m, rng)):
        roads += [(part, name) for part in lines_of(line.difference(banks))]
        crossings += lines_of(line.intersection(banks))
    if with_river:
        roads += [(part, "secondary") for part in lines_of(banks.boundary)]
        roads += [(bridge, "primary") for bridge in _bridges(middle, banks, crossings, box)]
    return Skeleton(roads, river, banks, old_town_m)


def _river_line(
    reach_m: float, off_m: float, least_m: float, rng: np.random.Generator
) -> LineString:
    """Return the middle of a river that passes the centre at about ``off_m``."""
    along = np.arange(-reach_m, reach_m + 30.0, 30.0)
    aside = np.full_like(along, off_m)
    for waves, height in ((1.4, 0.05), (3.1, 0.012)):
        # No bend where the river passes the old town, which it must not cut.
        bend = np.sin(2 * np.pi * waves * along / least_m + rng.uniform(0, 2 * np.pi))
        aside += height * least_m * bend * (1 - np.exp(-((along / (2 * off_m)) ** 2)))
    turn = rng.uniform(0, 2 * np.pi)
    return LineString(turned(np.column_stack([along, aside]), turn))


def _rings(old_town_m: float, reach_m: float, rng: np.random.Generator) -> Roads:
    rings: Roads = []
    radii = [old_town_m * share for share in _RINGS]
    while radii[-1] < reach_m:
        radii.append(radii[-1] * _RING_GROWTH)
    for i, radius_m in enumerate(radii):
        angle = np.linspace(0, 2 * np.pi, max(24, int(radius_m / 12)))
        radius = np.full_like(angle, radius_m)
        for waves, share in ((2, 0.07), (3, 0.05), (5, 0.02)):
            radius += radius_m * share * np.sin(waves * angle + rng.uniform(0, 2 * np.pi))
        corners = np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])
        corners[-1] = corners[0]
        rings.append((LineString(corners), "secondary" if i else "tertiary"))
    return rings


def _radials(old_town_m: float, reach_m: float, rng: np.random.Generator) -> Roads:
    radials: Roads = []
    count = int(rng.integers(6, 9))
    first = rng.uniform(0, 2 * np.pi)
    for i in range(count):
        angle = first + (i + rng.uniform(-0.18, 0.18)) * 2 * np.pi / count
        # Every second one is a street of the old town, up to its middle.
        start_m = 0.12 * old_town_m if i % 2 else 0.9 * old_town_m
        along = np.arange(start_m, reach_m, 60.0)
        drift = np.cumsum(rng.normal(0, 0.035, along.size)) * np.minimum(along / reach_m, 0.4)
        corners = along[:, None] * np.column_stack([np.cos(angle + drift), np.sin(angle + drift)])
        radials.append((LineString(corners), "primary"))
    return radials


def _bridges(
    middle: LineString, banks: Polygon, crossings: list[LineString], box: Bounds
) -> list[LineString]:
    """Return straight lines from quay to quay, no two near each other, those of roads first."""
    inside = shapely.box(*box)
    half_m = 30.0 + banks.area / middle.length
    wanted = [middle.project(line.interpolate(0.5, normalized=True)) for line in crossings]
    wanted += list(np.arange(0.5, middle.length / _BRIDGES_APART_M) * 2.2 * _BRIDGES_APART_M)
    # There is at least one, where the river is nearest to the old town.
    wanted.append(middle.project(shapely.Point(0, 0)))
    kept: list[float] = []
    bridges: list[LineString] = []
    for place in wanted:
        here, ahead = (np.array(middle.interpolate(place + more).coords[0]) for more in (0.0, 5.0))
        across = np.array([here[1] - ahead[1], ahead[0] - here[0]])
        if not across.any() or any(abs(place - other) < _BRIDGES_APART_M for other in kept):
            continue
        across *= half_m / np.hypot(*across)
        parts = lines_of(LineString([here - across, here + across]).intersection(banks))
        if len(parts) == 1 and inside.contains(parts[0]):
            kept.append(place)
            bridges.append(parts[0])
    return bridges


def turned(at: Floats, angle_rad: float) -> Floats:
    """Turn places counter-clockwise about (0, 0)."""
    cos, sin = np.cos(angle_rad), np.sin(angle_rad)
    return np.asarray(at @ np.array([[cos, sin], [-sin, cos]]))


def lines_of(shape: BaseGeometry) -> list[LineString]:
    """Return the lines in a geometry, each in one piece where parts meet end to end."""
    if shape.geom_type == "MultiLineString":
        shape = shapely.line_merge(shape)
    return [
        part
        for part in shapely.get_parts(shape)
        if part.geom_type in ("LineString", "LinearRing") and part.length > 1.0
    ]


def quarters(plan: Skeleton, box: Bounds, rng: np.random.Generator) -> tuple[list[Quarter], Roads]:
    """Cut a box along the main roads, and large parts again; return further roads, too."""
    edge = shapely.box(*box).exterior
    noded = shapely.unary_union([edge, *(line for line, _ in plan.roads)], grid_size=SNAP_M)
    found: list[Quarter] = []
    roads: Roads = []
    for part in shapely.get_parts(shapely.polygonize([noded])):
        if plan.banks.contains(part.representative_point()):
            continue
        pieces, cuts = _cut_up(part, (1.5e5, 3.6e5), 220.0, 0.12, rng)
        roads += [(cut, "tertiary") for cut in cuts]
        found += [(piece, _style(piece, plan.old_town_m, rng)) for piece in pieces]
    return found, roads


def _style(outline: Polygon, old_town_m: float, rng: np.random.Generator) -> int:
    away = float(np.hypot(outline.centroid.x, outline.centroid.y)) / old_town_m
    if away < 1.0:
        return OLD_TOWN
    if away < 2.2:
        return PARK if rng.random() < 0.03 else INNER
    shares = (0.22, 0.46, 0.27, 0.05) if away < 4.5 else (0.08, 0.44, 0.42, 0.06)
    return int(rng.choice([INNER, GRID, VILLAS, PARK], p=shares))


def streets(quarter: Quarter, rng: np.random.Generator) -> Roads:
    """Return the streets within a quarter."""
    outline, style = quarter
    if style == GRID:
        return [(line, "residential") for line in _grid(outline, rng)]
    area_m2, least_m, uneven, names = _CUTS[style]
    _, cuts = _cut_up(outline, area_m2, least_m, uneven, rng)
    return [(cut, names[int(rng.choice(3, p=_NAME_SHARES))]) for cut in cuts]


def _grid(outline: Polygon, rng: np.random.Generator) -> Iterator[LineString]:
    """Yield the streets of a grid along the longer side; some rows are shifted."""
    turn = _direction(outline)
    west, south, east, north = shapely.transform(outline, partial(turned, angle_rad=-turn)).bounds
    deep_m, long_m = rng.uniform(90, 122), rng.uniform(140, 225)
    rows, columns = _spread(south, north, deep_m), _spread(west, east, long_m)[1:-1]
    lines = [[[west, row], [east, row]] for row in rows[1:-1]]
    for low, high in itertools.pairwise(rows):
        shift_m = rng.uniform(-0.4, 0.4) * long_m if rng.random() < 0.15 else 0.0
        for column in columns + shift_m:
            if rng.random() > 0.05:
                lines.append([[column, low], [column, high]])
    for ends in lines:
        yield from lines_of(LineString(turned(np.array(ends), turn)).intersection(outline))


def _spread(low: float, high: float, step_m: float) -> Floats:
    return np.linspace(low, high, max(round((high - low) / step_m), 1) + 1)


def _cut_up(
    outline: Polygon,
    area_m2: tuple[float, float],
    least_m: float,
    uneven: float,
    rng: np.random.Generator,
) -> tuple[list[Polygon], list[LineString]]:
    """Cut a polygon across its longer side until the parts are small; return parts and cuts."""
    waiting, parts, cuts = [outline], [], []
    while waiting:
        part = waiting.pop()
        turn = _direction(part)
        flat = shapely.transform(part, partial(turned, angle_rad=-turn))
        west, south, east, north = flat.bounds
        limit_m2 = rng.uniform(*area_m2)
        if part.area < limit_m2 or east - west < 2 * least_m:
            parts.append(part)
            continue
        along, up = west + (east - west) * _about_half(uneven, rng), north - south
        lean = up * uneven * rng.uniform(-0.5, 0.5)
        lines = [[[along - lean, south - 1.0], [along + lean, north + 1.0]]]
        # Two cuts at once make a crossing, one at a time two junctions.
        if part.area > 2 * limit_m2 and up > 2 * least_m and rng.random() < _CROSSED:
            across = south + up * _about_half(uneven, rng)
            lines.append([[west - 1.0, across], [east + 1.0, across]])
        pieces = [part]
        for line in lines:
            cut = LineString(turned(np.array(line), turn))
            cuts += lines_of(cut.intersection(part))
            pieces = [piece for whole in pieces for piece in split(whole, cut).geoms]
        waiting += [piece for piece in pieces if piece.area > 1.0]
    return parts, cuts


def _about_half(uneven: float, rng: np.random.Generator) -> float:
    return 0.5 + uneven * float(rng.uniform(-0.5, 0.5))


def bend(at: Floats, old_town_m: float, phases: Floats) -> Floats:
    """Displace points (N, 2) slightly, most in the old town; crossings are preserved.

    ``phases`` are those of the waves in radians, shape (2, 3).
    """
    away = np.hypot(at[:, 0], at[:, 1]) / old_town_m
    moved = at.copy()
    for axis in (0, 1):
        other = at[:, 1 - axis]
        # Slopes stay below a half, so that the bending cannot fold the plane.
        waves = 0.06 * 90 * np.exp(-(away**2)) * np.sin(2 * np.pi * other / 90 + phases[axis, 0])
        waves += 0.045 * 210 * np.exp(-away / 2) * np.sin(2 * np.pi * other / 210 + phases[axis, 1])
        waves += 0.012 * 900 * np.sin(2 * np.pi * other / 900 + phases[axis, 2])
        moved[:, axis] += waves
    return moved


def _direction(outline: Polygon) -> float:
    """Return the direction of the longer side of the least rectangle about a polygon."""
    corners = shapely.get_coordinates(shapely.minimum_rotated_rectangle(outline))
    sides = np.diff(corners[:3], axis=0)
    longer = sides[int(np.argmax(np.hypot(sides[:, 0], sides[:, 1])))]
    return float(np.arctan2(longer[1], longer[0]))
