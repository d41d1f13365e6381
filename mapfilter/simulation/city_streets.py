"""The streets of a made city: quarters between its main roads, cut into blocks.

Quarters are cut across their longer side again and again, as Parish and Müller (2001),
"Procedural modeling of cities", SIGGRAPH, and those after them do; in an old town by uneven cuts,
farther out by grids that each have their own direction. At the end the plane is bent a little, most
of all in the old town, so that no street is quite straight and every crossing stays one.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np
import shapely
from shapely.geometry import LineString, Polygon
from shapely.ops import split

from mapfilter._types import Floats
from mapfilter.roads.ways import Bounds
from mapfilter.simulation.city_skeleton import Skeleton, lines_of, turned

CLASSES = (
    "footway", "living_street", "path", "pedestrian", "primary", "residential", "secondary",
    "service", "tertiary",
)  # fmt: skip
"""Kinds of way, as OpenStreetMap calls them."""

OLD_TOWN, INNER, GRID, VILLAS, PARK = range(5)

SNAP_M = 0.01
"""Corners are rounded to this, so that streets share them exactly."""

_CROSSED = 0.45
_NAME_SHARES = (0.55, 0.3, 0.15)
# Area of a block, least side, how uneven the cuts are, and kinds of street.
_CUTS: dict[int, tuple[tuple[float, float], float, float, tuple[str, str, str]]] = {
    OLD_TOWN: (
        (3200.0, 7000.0), 30.0, 0.3, ("living_street", "pedestrian", "footway"),
    ),
    INNER: ((14000.0, 27000.0), 65.0, 0.2, ("residential", "residential", "residential")),
    VILLAS: ((18000.0, 34000.0), 70.0, 0.18, ("residential", "residential", "residential")),
    PARK: ((30000.0, 70000.0), 80.0, 0.3, ("path", "path", "footway")),
}  # fmt: skip


@dataclass(frozen=True, slots=True, eq=False)
class Quarter:
    """A part of the city that is built in one style."""

    outline: Polygon
    style: int


def quarters(
    plan: Skeleton, box: Bounds, rng: np.random.Generator
) -> tuple[list[Quarter], list[tuple[LineString, str]]]:
    """Cut a box along the main roads, and large parts again, into quarters.

    Returns
    -------
    quarters : list of Quarter
    lines : list of (LineString, str)
        The further roads between them.
    """
    edge = shapely.box(*box).exterior
    noded = shapely.unary_union([edge, *(line for line, _ in plan.lines)], grid_size=SNAP_M)
    found: list[Quarter] = []
    lines: list[tuple[LineString, str]] = []
    for part in shapely.get_parts(shapely.polygonize([noded])):
        place = part.representative_point()
        if shapely.contains(plan.banks, place).any():
            continue
        pieces, cuts = _cut_up(part, (1.5e5, 3.6e5), 220.0, 0.12, rng)
        lines += [(cut, "tertiary") for cut in cuts]
        found += [Quarter(piece, _style(piece, plan.old_town_m, rng)) for piece in pieces]
    return found, lines


def _style(outline: Polygon, old_town_m: float, rng: np.random.Generator) -> int:
    away = float(np.hypot(outline.centroid.x, outline.centroid.y)) / old_town_m
    if away < 1.0:
        return OLD_TOWN
    if away < 2.2:
        return PARK if rng.random() < 0.03 else INNER
    shares = (0.22, 0.46, 0.27, 0.05) if away < 4.5 else (0.08, 0.44, 0.42, 0.06)
    return int(rng.choice([INNER, GRID, VILLAS, PARK], p=shares))


def streets(quarter: Quarter, rng: np.random.Generator) -> list[tuple[LineString, str]]:
    """Return the streets within a quarter."""
    style = quarter.style
    if style == GRID:
        return [(line, "residential") for line in _grid(quarter.outline, rng)]
    area_m2, least_m, uneven, names = _CUTS[style]
    _, cuts = _cut_up(quarter.outline, area_m2, least_m, uneven, rng)
    return [(cut, names[int(rng.choice(3, p=_NAME_SHARES))]) for cut in cuts]


def _grid(outline: Polygon, rng: np.random.Generator) -> Iterator[LineString]:
    """Yield the streets of a grid along the longer side; some rows are shifted."""
    turn = _direction(outline)
    west, south, east, north = shapely.transform(outline, partial(turned, angle_rad=-turn)).bounds
    deep_m, long_m = rng.uniform(90, 122), rng.uniform(140, 225)
    rows = _spread(south, north, deep_m)
    for row in rows[1:-1]:
        yield from _within(outline, turned(np.array([[west, row], [east, row]]), turn))
    columns = _spread(west, east, long_m)[1:-1]
    for low, high in itertools.pairwise(rows):
        shift_m = rng.uniform(-0.4, 0.4) * long_m if rng.random() < 0.15 else 0.0
        for column in columns + shift_m:
            if rng.random() > 0.05:
                ends = np.array([[column, low], [column, high]])
                yield from _within(outline, turned(ends, turn))


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
    """Move places a little, most of all in the old town; what crosses goes on crossing.

    Parameters
    ----------
    at : numpy.ndarray, shape (N, 2)
        Metres from the centre.
    old_town_m : float
    phases : numpy.ndarray, shape (2, 3)
        Of the waves, radians.
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


def _within(outline: Polygon, ends: Floats) -> list[LineString]:
    return lines_of(LineString(ends).intersection(outline))
