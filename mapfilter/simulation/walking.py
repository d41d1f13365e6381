"""Walkers beside the centre line of their way, who stop now and then."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Annotated, Literal, NamedTuple

import numpy as np
from annotated_types import Ge, Le

from mapfilter._types import Bools, Floats, Floats32
from mapfilter.lattice import Lattice
from mapfilter.options import NotNegative, Options
from mapfilter.simulation.routes import Route

PAVEMENT_M: Mapping[str, float] = MappingProxyType(
    {
        "motorway": 14.0,
        "trunk": 11.0,
        "primary": 9.0,
        "secondary": 8.0,
        "tertiary": 6.5,
        "unclassified": 5.0,
        "residential": 5.0,
        "living_street": 2.5,
        "pedestrian": 3.0,
        "service": 2.0,
        "track": 1.0,
        "cycleway": 1.0,
        "footway": 0.5,
        "path": 0.5,
        "steps": 0.5,
    }
)
"""Distance of a pavement's middle from the centre line, by OpenStreetMap's class of way: half the
carriageway (two lanes of 2.75 m in residential streets, four of 3.25 m in main ones) and half of a
pavement of 2.5 m, as in the German guideline for urban streets (FGSV, RASt 06)."""

Inside = Callable[[Floats, Floats], Bools]

_OTHER_PAVEMENT_M = 3.0
_GRID_M = 1.0
_SMOOTHED_M = 4.0
_PARTS = (0.25, 0.5, 0.75, 1.0)
_CLEARANCE_PX = 7

Beside = Annotated[float, Ge(0), Le(50)]


@dataclass(frozen=True, slots=True)
class WalkerModel(Options):
    """Differences of a walker from a point that moves along centre lines at constant speed.

    Parameters
    ----------
    beside : {"centre", "pavement"} or float
        On the centre line, on the pavement of each class of way (see :data:`PAVEMENT_M`), or so
        many metres beside the centre line of every way.
    change_side_m : float
        Mean distance after which the street is crossed; at first, either side is as likely.
    stop_every_m : float
        Mean distance between two stops, which come at random; 0 for a walk without stops.
    stop_s : float
        Mean duration of a stop; durations are exponential.

    Raises
    ------
    ConfigError
        With every value that is out of range.
    """

    beside: Literal["centre", "pavement"] | Beside = "centre"
    change_side_m: Annotated[float, Ge(1)] = 150.0
    stop_every_m: NotNegative = 0.0
    stop_s: NotNegative = 20.0

    @property
    def on_centre_line(self) -> bool:
        """Whether the path is the centre line itself."""
        return self.beside in ("centre", 0)

    def offsets_m(self, along: Route) -> Floats:
        """Return the distance from the centre line on each segment of a route."""
        if isinstance(self.beside, str):
            by_class = [PAVEMENT_M.get(name, _OTHER_PAVEMENT_M) for name in along.class_names]
            width_m = np.array(by_class)[along.way_class]
            return width_m if self.beside == "pavement" else np.zeros_like(width_m)
        return np.full(len(along.way_class), float(self.beside))


class WalkedPath(NamedTuple):
    """A walker's path: distance along the route and along the path itself, and position."""

    distance_m: Floats
    walked_m: Floats
    east_m: Floats
    north_m: Floats


def path_beside(
    along: Route,
    walker: WalkerModel,
    rng: np.random.Generator,
    inside: Inside | None = None,
) -> WalkedPath:
    """Lay a walker's path beside the centre lines of a route.

    The distance from the centre line follows the class of way and changes its sign where the
    street is crossed, both over about ten metres; corners are cut by as much. Where a building
    stands on the pavement, the path is closer to the centre line. A walker on the centre line cuts
    no corners.

    Parameters
    ----------
    inside : callable, optional
        From east and north (m), shape (N,), to whether a building stands there.
    """
    from scipy.ndimage import gaussian_filter1d

    count = max(int(np.ceil(along.length_m / _GRID_M)), 2)
    distance = np.linspace(0.0, along.length_m, count + 1)
    spacing = distance[1]
    east, north, _ = along.at(distance)
    if walker.on_centre_line:
        return WalkedPath(distance, distance, east, north)
    segment = np.searchsorted(along.corner_m, distance, side="right") - 1
    segment = np.clip(segment, 0, len(along.way_id) - 1)
    crossings = rng.random(distance.size) < spacing / walker.change_side_m
    side = np.where(np.cumsum(crossings) % 2 == 0, 1.0, -1.0) * (1.0 if rng.random() < 0.5 else -1)
    smooth = _SMOOTHED_M / spacing
    wanted_m = side * walker.offsets_m(along)[segment]
    east_slope = gaussian_filter1d(np.gradient(east, spacing), smooth, mode="nearest")
    north_slope = gaussian_filter1d(np.gradient(north, spacing), smooth, mode="nearest")
    # Where one turns back on the spot there is no direction; one crosses over instead.
    length = np.maximum(np.hypot(east_slope, north_slope), 0.2)
    left_east, left_north = -north_slope / length, east_slope / length
    if inside is not None:
        wanted_m *= _room(east, north, wanted_m * left_east, wanted_m * left_north, inside)
    offset_m = gaussian_filter1d(wanted_m, smooth, mode="nearest")
    east = gaussian_filter1d(east, smooth / 2, mode="nearest") + offset_m * left_east
    north = gaussian_filter1d(north, smooth / 2, mode="nearest") + offset_m * left_north
    walked = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(east), np.diff(north)))])
    return WalkedPath(distance, walked, east, north)


def _room(
    east_m: Floats, north_m: Floats, aside_east_m: Floats, aside_north_m: Floats, inside: Inside
) -> Floats:
    """Return the largest share of an offset that is clear of buildings, for places near by too."""
    from scipy.ndimage import minimum_filter1d

    share = np.zeros_like(east_m)
    clear = np.ones(east_m.shape, dtype=bool)
    for part in _PARTS:
        clear &= ~inside(east_m + part * aside_east_m, north_m + part * aside_north_m)
        share = np.where(clear, part, share)
    return np.asarray(minimum_filter1d(share, _CLEARANCE_PX, mode="nearest"))


def with_stops(
    distance_m: Floats, time_s: Floats, walker: WalkerModel, rng: np.random.Generator
) -> tuple[Floats, Floats]:
    """Insert stops at random places into the times at which places are passed.

    Returns
    -------
    distance_m, time_s : (K,) arrays
        The first does not fall, the second rises.
    """
    if walker.stop_every_m == 0:
        return distance_m, time_s
    number = int(rng.poisson(distance_m[-1] / walker.stop_every_m))
    place_m = np.sort(rng.uniform(0.0, distance_m[-1], number))
    lasts_s = rng.exponential(walker.stop_s, number)
    arrive_s = np.interp(place_m, distance_m, time_s)
    before_s = np.concatenate([[0.0], np.cumsum(lasts_s)])
    passed = np.searchsorted(place_m, distance_m, side="right")
    knots_m = np.concatenate([distance_m, place_m, place_m])
    arrivals_s = arrive_s + before_s[:-1]
    knots_s = np.concatenate([time_s + before_s[passed], arrivals_s, arrivals_s + lasts_s])
    order = np.lexsort((knots_m, knots_s))
    return knots_m[order], knots_s[order]


def inside_buildings(heights_m: Floats32, lattice: Lattice) -> Inside:
    """Return a function that looks up whether a building stands at places of a lattice."""

    def inside(east_m: Floats, north_m: Floats) -> Bools:
        row, col = lattice.row_col(east_m, north_m)
        there = lattice.contains(row, col)
        built = heights_m[np.where(there, row, 0), np.where(there, col, 0)] > 0
        return np.asarray(built & there)

    return inside
