"""Pedestrians: anywhere on the width of a way, at changing speed, with pauses, from anywhere.

Speeds are those of Weidmann 1993, *Transporttechnik der Fussgänger* (ETH Zürich, IVT 90): 1.34 m/s
on average, with a standard deviation of 0.26 m/s between and within persons.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
import pandas as pd
from annotated_types import Ge, Le
from scipy.ndimage import gaussian_filter1d, minimum_filter1d

from mapfilter._types import Floats
from mapfilter.options import NotNegative, Options, Positive, Share
from mapfilter.simulation.worlds.itinerary import STEP_M, Itinerary, itinerary
from mapfilter.simulation.worlds.open_ground import OpenGround
from mapfilter.simulation.worlds.shortcuts import off_ways_m, with_shortcuts
from mapfilter.simulation.worlds.sinusoids import gauss_markov
from mapfilter.simulation.worlds.starts import from_indoors, from_outside
from mapfilter.simulation.worlds.street_lines import StreetLines

_SPARE = 1.6
_CORNER_M, _SWERVE_M = 2.0, 10.0
_PARTS = (0.2, 0.4, 0.6, 0.8, 1.0)
_SLOWEST = 0.4
_PAUSE_SPREAD = 0.6
_CLEARANCE_M = 8.0


@dataclass(frozen=True, slots=True)
class PedestrianModel(Options):
    """How a pedestrian goes; defaults are those of the foreign world.

    Parameters
    ----------
    length_m : float
        Of the walk, outdoors.
    offset_share : float
        Largest distance from the centre line, as a share of half the way's width.
    offset_length_m : float
        Distance over which the offset is correlated by 1/e.
    off_ways : float
        Share of the distance off the ways; of each journey between 0 and this, unless
        ``off_ways_exactly``.
    off_ways_exactly : bool
        Whether every journey has this share, as far as there is open ground.
    speed_mps : float
        Mean speed of all pedestrians.
    speed_sd : float
        Standard deviation of a person's speed, as a fraction of the mean.
    speed_wander : float
        Standard deviation of the speed about the person's own, as a fraction of it.
    speed_correlation_s : float
        Time over which it is correlated by 1/e.
    pause_every_m : float
        Mean distance between two pauses; 0 for none.
    pause_s : float
        Median duration of a pause (log-normal).
    start : {"street", "indoors", "outside"}
        Where the journey begins.
    indoors_s : float
        Time indoors before a walk that starts there.
    indoors_loss_db : float
        Loss of the walls until one is outdoors.
    outside_m : float
        Distance outside the area from which a walk comes that starts there.

    Raises
    ------
    ConfigError
        With every value that is out of range.
    """

    length_m: Positive = 1940.0
    offset_share: Share = 1.0
    offset_length_m: Positive = 60.0
    off_ways: Annotated[float, Ge(0), Le(0.6)] = 0.08
    off_ways_exactly: bool = False
    speed_mps: Positive = 1.34
    speed_sd: Annotated[float, Ge(0), Le(0.3)] = 0.12
    speed_wander: Annotated[float, Ge(0), Le(0.3)] = 0.1
    speed_correlation_s: Positive = 30.0
    pause_every_m: NotNegative = 350.0
    pause_s: Positive = 15.0
    start: Literal["street", "indoors", "outside"] = "street"
    indoors_s: NotNegative = 180.0
    indoors_loss_db: NotNegative = 15.0
    outside_m: Positive = 250.0


@dataclass(frozen=True, eq=False)
class PedestrianWalk:
    """A journey's truth, and the walls about the phone.

    Parameters
    ----------
    truth : pandas.DataFrame
        time_s from 0, every second; east_m, north_m; way_id, missing off the ways.
    loss_db : (rows,) array
        Of walls.
    off_ways : float
        Share of the distance off the ways.
    """

    truth: pd.DataFrame
    loss_db: Floats
    off_ways: float


def pedestrian_walk(
    streets: StreetLines,
    ground: OpenGround,
    model: PedestrianModel,
    rng: np.random.Generator,
) -> PedestrianWalk:
    """Draw one walk.

    Raises
    ------
    InputError
        There are no streets to walk on.
    """
    start = None
    if model.start == "outside":
        start, prefix = from_outside(streets, ground.lattice, model.outside_m, rng)
    planned = itinerary(streets, _SPARE * model.length_m, rng, start=start)
    if start is not None:
        planned = _joined(prefix, planned)
    share = model.off_ways if model.off_ways_exactly else rng.uniform(0.0, model.off_ways)
    if share > 0:
        path = with_shortcuts(planned, share, model.length_m, streets, ground, rng)
    else:
        path = planned.cut(model.length_m)
    path = beside_centre_line(path, model, ground, rng).cut(model.length_m)
    off = off_ways_m(path, streets) / (STEP_M * path.east_m.size)
    time_s, east, north = _timed(path, model, rng)
    loss = np.zeros(time_s.size)
    if model.start == "indoors":
        indoors = from_indoors(east[0], north[0], ground, model.indoors_s, rng)
        east, north = (
            np.concatenate(pair) for pair in zip(indoors[:2], (east, north), strict=True)
        )
        loss = np.concatenate([np.where(indoors[2], model.indoors_loss_db, 0.0), loss])
        time_s = np.arange(east.size, dtype=np.float64)
    way_id = _way_ids(east, north, streets)
    truth = pd.DataFrame({"time_s": time_s, "east_m": east, "north_m": north, "way_id": way_id})
    return PedestrianWalk(truth, loss, off)


def beside_centre_line(
    path: Itinerary, model: PedestrianModel, ground: OpenGround, rng: np.random.Generator
) -> Itinerary:
    """Return a path beside the centre lines: within half the width, out of buildings.

    The offset is a smooth random process along the way, anywhere between the two edges; off the
    ways there is none.
    """
    along = path.walked_m
    process = gauss_markov(along, model.offset_length_m, rng)
    # The distribution function of the normal distribution would make every offset equally likely;
    # this keeps pavements, near the edges, likelier than the middle of the carriageway.
    wanted = model.offset_share * np.tanh(2.0 * process) * path.half_width_m
    # Nobody weaves: sides change within tens of metres.
    limit = model.offset_share * path.half_width_m
    wanted = gaussian_filter1d(wanted, _SWERVE_M / STEP_M, mode="nearest")
    wanted = np.clip(wanted, -limit, limit)
    east = gaussian_filter1d(path.east_m, _CORNER_M / STEP_M, mode="nearest")
    north = gaussian_filter1d(path.north_m, _CORNER_M / STEP_M, mode="nearest")
    slope_east, slope_north = np.gradient(east), np.gradient(north)
    length = np.maximum(np.hypot(slope_east, slope_north), 1e-9)
    left_east, left_north = -slope_north / length, slope_east / length
    share, clear = np.zeros(wanted.shape), np.ones(wanted.shape, dtype=bool)
    for part in _PARTS:
        clear &= ~ground.is_built(
            east + part * wanted * left_east, north + part * wanted * left_north
        )
        share = np.where(clear, part, share)
    offset = wanted * minimum_filter1d(share, int(_CLEARANCE_M / STEP_M), mode="nearest")
    return Itinerary(east + offset * left_east, north + offset * left_north, path.half_width_m)


def _timed(
    path: Itinerary, model: PedestrianModel, rng: np.random.Generator
) -> tuple[Floats, Floats, Floats]:
    """Return times, every second, and positions of a walk along a path."""
    walked = path.walked_m
    person = model.speed_mps * float(np.clip(1 + model.speed_sd * rng.standard_normal(), 0.6, 1.4))
    seconds = int(walked[-1] / (_SLOWEST * person)) + 2
    time_s = np.arange(seconds, dtype=np.float64)
    wander = gauss_markov(time_s, model.speed_correlation_s, rng)
    speed = person * np.maximum(1 + model.speed_wander * wander, _SLOWEST)
    gone = np.concatenate([[0.0], np.cumsum(speed[:-1])])
    passed_s = np.interp(walked, gone, time_s)
    number = int(rng.poisson(walked[-1] / model.pause_every_m)) if model.pause_every_m > 0 else 0
    place = np.sort(rng.uniform(0.0, walked[-1], number))
    lasts_s = model.pause_s * np.exp(_PAUSE_SPREAD * rng.standard_normal(number))
    arrives_s = np.interp(place, walked, passed_s)
    waited_s = np.concatenate([[0.0], np.cumsum(lasts_s)])
    knots_s = np.concatenate(
        [
            passed_s + waited_s[np.searchsorted(place, walked, side="right")],
            arrives_s + waited_s[:-1],
            arrives_s + waited_s[1:],
        ]
    )
    knots_m = np.concatenate([walked, place, place])
    order = np.lexsort((knots_m, knots_s))
    tick_s = np.arange(int(knots_s[order[-1]]) + 1, dtype=np.float64)
    at = np.interp(tick_s, knots_s[order], knots_m[order])
    return tick_s, np.interp(at, walked, path.east_m), np.interp(at, walked, path.north_m)


def _joined(first: Itinerary, then: Itinerary) -> Itinerary:
    def both(name: str) -> Floats:
        return np.concatenate([getattr(first, name), getattr(then, name)])

    return Itinerary(both("east_m"), both("north_m"), both("half_width_m"))


def _way_ids(
    east_m: Floats, north_m: Floats, streets: StreetLines
) -> pd.api.extensions.ExtensionArray:
    """Return the way at each place: the nearest one within its width; missing elsewhere."""
    feet = streets.near(east_m, north_m, float(streets.half_width_m.max(initial=0.0)) + 2.0)
    within = feet.distance_m <= streets.half_width_m[feet.edge] + 2.0
    position, distance = feet.position[within], feet.distance_m[within]
    way = streets.network.way_id[feet.edge[within]]
    order = np.lexsort((-distance, position))
    found = np.zeros(east_m.size, dtype=np.int64)
    found[position[order]] = way[order]
    ids = pd.array(found, dtype="Int64")
    ids[found == 0] = pd.NA
    return ids
