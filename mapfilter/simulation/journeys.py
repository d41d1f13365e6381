"""Ground truth of journeys: the motion of a walker or a driver along a route."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Literal

import numpy as np
import pandas as pd

from mapfilter._types import Floats
from mapfilter.angles import wrap_rad
from mapfilter.errors import Faults
from mapfilter.options import Options, Positive
from mapfilter.simulation.routes import Route
from mapfilter.simulation.walking import Inside, WalkerModel, path_beside, with_stops

DRIVING_SPEED_MPS: Mapping[str, float] = MappingProxyType(
    {
        "motorway": 25.0,
        "motorway_link": 14.0,
        "trunk": 19.0,
        "trunk_link": 11.0,
        "primary": 14.0,
        "primary_link": 11.0,
        "secondary": 14.0,
        "secondary_link": 11.0,
        "tertiary": 12.0,
        "tertiary_link": 10.0,
        "unclassified": 11.0,
        "residential": 8.3,
        "living_street": 3.0,
        "service": 5.0,
    }
)
"""Undisturbed urban speeds by OpenStreetMap's class of way."""

_OTHER_SPEED_MPS = 8.3
_SETBACK_M = 6.0
_CRAWL_MPS = 1.0
_GRID_M = 1.0


@dataclass(frozen=True, slots=True)
class JourneyPlan(Options):
    """Length, speed and goals of a journey.

    Parameters
    ----------
    length_m : float
        Length of the route; 1 940 m in Khalaf-Allah 2007.
    profile : {"walking", "driving"}
        Walking keeps ``speed_mps``; driving takes each way's speed, within the accelerations.
    speed_mps : float
        Walking speed.
    period_s : float
        Between two rows of the truth.
    leg_m : tuple of float
        Least and largest distance of successive goals as the crow flies.
    acceleration_mps2 : float
        Along the road, speeding up and braking.
    lateral_acceleration_mps2 : float
        Largest in a turn.
    driving_speed_mps : mapping
        Speed by class of way; 8.3 m/s for classes that it lacks.
    walker : WalkerModel
        Place on the street, and stops; of walking only.

    Raises
    ------
    ConfigError
        With every value that is out of range.
    """

    length_m: Positive = 1940.0
    profile: Literal["walking", "driving"] = "walking"
    speed_mps: Positive = 1.4
    period_s: Positive = 1.0
    leg_m: tuple[float, float] = (300.0, 1200.0)
    acceleration_mps2: Positive = 2.0
    lateral_acceleration_mps2: Positive = 2.0
    driving_speed_mps: Mapping[str, float] = field(
        default_factory=lambda: dict(DRIVING_SPEED_MPS), hash=False
    )
    walker: WalkerModel = field(default_factory=WalkerModel)

    def check(self, faults: Faults) -> None:
        """Check the distances of goals and the speeds of ways."""
        if not 0 <= self.leg_m[0] < self.leg_m[1] < np.inf:
            faults.add("JourneyPlan, leg_m", "least < largest distance", self.leg_m)
        for name, speed in self.driving_speed_mps.items():
            if not (np.isfinite(speed) and speed > 0):
                faults.add(f"JourneyPlan, driving_speed_mps, {name}", "a number > 0", speed)


def journey(
    along: Route,
    plan: JourneyPlan,
    rng: np.random.Generator | None = None,
    inside: Inside | None = None,
) -> pd.DataFrame:
    """Return the truth of one journey along a route.

    Parameters
    ----------
    rng : numpy.random.Generator, optional
        Draws on which side a walker goes, and the stops.
    inside : callable, optional
        Where buildings keep a walker off the pavement, see
        :func:`mapfilter.simulation.walking.inside_buildings`.

    Returns
    -------
    truth : pandas.DataFrame
        time_s from 0 in steps of ``period_s``, east_m, north_m, way_id; it ends with the last tick
        that is still on the route.

    Raises
    ------
    ValueError
        The walker needs a generator.
    """
    walker = plan.walker
    plain = walker.on_centre_line and walker.stop_every_m == 0
    if plan.profile == "driving" or plain:
        distance_m, time_s = speed_profile(along, plan)
        tick_s = ticks_s(time_s, plan.period_s)
        east, north, way_id = along.at(np.interp(tick_s, time_s, distance_m))
    elif rng is None:
        raise ValueError("a walker beside the centre line, or one that stops, needs rng")
    else:
        path = path_beside(along, walker, rng, inside)
        walked_m, time_s = with_stops(path.walked_m, path.walked_m / plan.speed_mps, walker, rng)
        tick_s = ticks_s(time_s, plan.period_s)
        at_m = np.interp(tick_s, time_s, walked_m)
        _, _, way_id = along.at(np.interp(at_m, path.walked_m, path.distance_m))
        east, north = (np.interp(at_m, path.walked_m, axis) for axis in (path.east_m, path.north_m))
    ways = pd.array(way_id, "Int64")
    return pd.DataFrame({"time_s": tick_s, "east_m": east, "north_m": north, "way_id": ways})


def ticks_s(time_s: Floats, period_s: float) -> Floats:
    """Return times from the first to the last of some, a period apart."""
    # A whole number of periods must not lose the last tick to rounding.
    count = int(np.floor((time_s[-1] - time_s[0]) / period_s + 1e-9)) + 1
    return np.asarray(time_s[0] + np.arange(count) * period_s)


def speed_profile(along: Route, plan: JourneyPlan) -> tuple[Floats, Floats]:
    """Return when each place of a route is passed.

    A driver starts and ends standing, goes at most at each way's speed, and takes a turn by θ at
    most at √(a·r), with a the lateral acceleration and r = 6 m / tan(θ/2) the radius of a curve
    that leaves the street 6 m before the corner. Between these limits the acceleration is bounded:
    the speed is the largest with v² rising and falling by at most 2·a per metre.

    Returns
    -------
    distance_m, time_s : ndarray, shape (K,)
        Both rise; when driving, places are at most 1 m apart.
    """
    if plan.profile == "walking":
        ends_m = np.array([0.0, along.length_m])
        return ends_m, ends_m / plan.speed_mps
    steps = max(int(np.ceil(along.length_m / _GRID_M)), 2)
    distance = np.union1d(np.linspace(0.0, along.length_m, steps + 1), along.corner_m)
    square = _speed_limits_mps(along, plan, distance) ** 2
    rise = 2 * plan.acceleration_mps2 * distance
    square = np.minimum.accumulate(square - rise) + rise
    square = np.minimum.accumulate((square + rise)[::-1])[::-1] - rise
    speed = np.sqrt(np.maximum(square, 0.0))
    took_s = 2 * np.diff(distance) / (speed[:-1] + speed[1:])
    return distance, np.concatenate([[0.0], np.cumsum(took_s)])


def _speed_limits_mps(along: Route, plan: JourneyPlan, distance_m: Floats) -> Floats:
    by_class = np.array(
        [plan.driving_speed_mps.get(name, _OTHER_SPEED_MPS) for name in along.class_names]
    )
    by_segment = by_class[along.way_class]
    # Where two segments meet, the slower one's limit holds.
    last = len(by_segment) - 1
    after = np.clip(np.searchsorted(along.corner_m, distance_m, side="right") - 1, 0, last)
    before = np.clip(np.searchsorted(along.corner_m, distance_m, side="left") - 1, 0, last)
    limit = np.minimum(by_segment[after], by_segment[before])
    heading = np.arctan2(np.diff(along.north_m), np.diff(along.east_m))
    turn = np.abs(wrap_rad(np.diff(heading)))
    radius_m = _SETBACK_M / np.maximum(np.tan(turn / 2), 1e-9)
    corner = np.maximum(np.sqrt(plan.lateral_acceleration_mps2 * radius_m), _CRAWL_MPS)
    place = np.searchsorted(distance_m, along.corner_m[1:-1])
    np.minimum.at(limit, place, corner)
    limit[[0, -1]] = 0.0
    return np.asarray(limit, dtype=np.float64)
