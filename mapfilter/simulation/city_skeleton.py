"""What a made city is laid out about: a river with quays and bridges, ring and radial roads."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from mapfilter._types import Floats
from mapfilter.roads.ways import Bounds, Geometries

_RINGS = (1.0, 2.5, 4.7, 7.6)
_RING_GROWTH = 1.45
_QUAY_M = 17.0
_BRIDGES_APART_M = 420.0


@dataclass(frozen=True, slots=True, eq=False)
class Skeleton:
    """What a city is laid out about, in metres from its centre.

    Parameters
    ----------
    lines : tuple of (LineString, str)
        Main roads, quays and bridges, each with its class.
    river, banks : numpy.ndarray of shapely.Polygon, shape (0,) or (1,)
        The water; the water and the strips up to the middle of the quays.
    old_town_m : float
        Radius of the old town.
    """

    lines: tuple[tuple[LineString, str], ...]
    river: Geometries
    banks: Geometries
    old_town_m: float


def skeleton(box: Bounds, with_river: bool, rng: np.random.Generator) -> Skeleton:
    """Return river, quays, bridges, ring roads and radial roads within a box about (0, 0)."""
    least_m = min(box[2] - box[0], box[3] - box[1])
    reach_m = float(np.hypot(box[2] - box[0], box[3] - box[1]))
    old_town_m = float(np.clip(0.115 * least_m, 90.0, 350.0))
    river, banks, middle = None, None, None
    if with_river:
        width_m = float(np.clip(0.036 * least_m, 25.0, 110.0))
        middle = _river_line(reach_m, 1.05 * old_town_m + width_m, least_m, rng)
        river = middle.buffer(width_m / 2, cap_style="flat", quad_segs=4)
        banks = middle.buffer(width_m / 2 + _QUAY_M, cap_style="flat", quad_segs=4)
    roads = [*_rings(old_town_m, reach_m, rng), *_radials(old_town_m, reach_m, rng)]
    lines: list[tuple[LineString, str]] = []
    crossings: list[LineString] = []
    for line, name in roads:
        if banks is None:
            lines.append((line, name))
            continue
        lines += [(part, name) for part in lines_of(line.difference(banks))]
        crossings += lines_of(line.intersection(banks))
    if banks is not None and middle is not None:
        lines += [(part, "secondary") for part in lines_of(banks.boundary)]
        lines += [(bridge, "primary") for bridge in _bridges(middle, banks, crossings, box)]
    none = np.empty(0, dtype=object)
    if river is None or banks is None:
        return Skeleton(tuple(lines), none, none, old_town_m)
    one = [np.array([shape], dtype=object) for shape in (river, banks)]
    return Skeleton(tuple(lines), one[0], one[1], old_town_m)


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


def _rings(
    old_town_m: float, reach_m: float, rng: np.random.Generator
) -> Iterator[tuple[LineString, str]]:
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
        yield LineString(corners), "secondary" if i else "tertiary"


def _radials(
    old_town_m: float, reach_m: float, rng: np.random.Generator
) -> Iterator[tuple[LineString, str]]:
    count = int(rng.integers(6, 9))
    first = rng.uniform(0, 2 * np.pi)
    step_m = 60.0
    for i in range(count):
        angle = first + (i + rng.uniform(-0.18, 0.18)) * 2 * np.pi / count
        # Every second one is a street of the old town, up to its middle.
        start_m = 0.12 * old_town_m if i % 2 else 0.9 * old_town_m
        along = np.arange(start_m, reach_m, step_m)
        drift = np.cumsum(rng.normal(0, 0.035, along.size)) * np.minimum(along / reach_m, 0.4)
        corners = along[:, None] * np.column_stack([np.cos(angle + drift), np.sin(angle + drift)])
        yield LineString(corners), "primary"


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
