"""The first hypotheses of a belief, drawn by its first evidence or about a known start."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite, pi
from typing import TYPE_CHECKING

import numpy as np

from mapfilter._same import EqualByValue
from mapfilter._types import Floats, Floats32
from mapfilter.angles import wrap_rad
from mapfilter.filters.belief_models import Cloud
from mapfilter.filters.resampling import systematic
from mapfilter.models.street_motion import (
    BIAS,
    EAST,
    LOG_SCALE,
    NORTH,
    OFF,
    RATE,
    STATES,
    STRETCH,
    TURN,
)
from mapfilter.positioning.bayes.area.area_frame import AreaFrame
from mapfilter.positioning.bayes.area.likely_points import likelihoods, likelihoods_on_ways
from mapfilter.positioning.bayes.area.tile_search import points_everywhere, searched_tiles
from mapfilter.positioning.bayes.area.tiled_area import TiledArea
from mapfilter.positioning.bayes.beliefs.path import RecentPath
from mapfilter.positioning.bayes.beliefs.path_start import (
    OFF_AT_START,
    ends_of_path,
    possible_turns_rad,
)
from mapfilter.positioning.bayes.sources.evidence import RadioReading

if TYPE_CHECKING:
    from mapfilter.positioning.bayes.beliefs.model import BayesModel

_F = np.float32
_OFF_SHARE, _TRIES = 0.2, 2
BEYOND_M = 300.0
"""Width of the belt around the area in which some of the first hypotheses lie."""
_BEYOND_SHARE, BEYOND_AT_START = 0.15, 0.02
"""Share of the first hypotheses in the belt, and that of the first belief."""


@dataclass(frozen=True, slots=True, eq=False)
class Start(EqualByValue):
    """Prior of a belief.

    Parameters
    ----------
    reading : RadioReading or None
        First evidence.
    compass : bool
        Headings are those of a compass; else their lasting error is uniform.
    east_m, north_m, sd_m : float
        Known start in the CRS of the database; NaN for an unknown one.
    path : RecentPath or None
        Way to the start, where the map alone is the first evidence.
    """

    reading: RadioReading | None
    compass: bool = True
    east_m: float = float("nan")
    north_m: float = float("nan")
    sd_m: float = float("nan")
    path: RecentPath | None = None


def first_hypotheses(
    model: BayesModel, prior: Start, most: int, rng: np.random.Generator
) -> tuple[Cloud, Floats]:
    """Draw the first hypotheses: by the first evidence, or about a known start.

    Without a known start they are drawn in proportion to their likelihood from the points on
    ways and from places anywhere; those on ways are spread over their pixel. Others lie around
    the area, as one may come into it.
    """
    state = np.zeros((STATES, most), dtype=np.float32)
    log_weight = np.full(most, -np.log(most))
    if isfinite(prior.east_m):
        west, south = model.area.origin_m
        place = np.array([[prior.east_m - west], [prior.north_m - south]])
        state[EAST : NORTH + 1] = place + prior.sd_m * rng.standard_normal((2, most))
        state[OFF] = OFF_AT_START
    elif prior.path is None:
        _spread(model, state, log_weight, prior.reading, rng)
    bias = rng.standard_normal(most) * model.motion.bias_sd_rad
    state[BIAS] = bias if prior.compass else pi * (2 * rng.random(most) - 1)
    state[LOG_SCALE] = model.motion.scale_sd * rng.standard_normal(most)
    state[TURN] = model.motion.turn_sd_rad * rng.standard_normal(most)
    state[STRETCH] = model.motion.stretch_sd * rng.standard_normal(most)
    if prior.path is not None:
        turns = possible_turns_rad(model.motion.bias_sd_rad, compass=prior.compass)
        ends = ends_of_path(model.whole, model.weights, prior.path, turns, most, rng)
        state[EAST : NORTH + 1], state[OFF], log_weight = (
            ends.place_m,
            ends.off,
            ends.log_weight,
        )
        state[BIAS] = wrap_rad(ends.turned_rad - state[TURN])
    biased = rng.random(most) < model.motion.rate_share
    state[RATE] = model.motion.rate_rad_per_m * rng.standard_normal(most) * biased
    return cloud_of(state), log_weight


def _spread(
    model: BayesModel,
    state: Floats32,
    log_weight: Floats,
    reading: RadioReading | None,
    rng: np.random.Generator,
) -> None:
    """Fill places on the map and off it; off it more of them, with smaller weights."""
    area, spread_m = model.area, model.area.lattice.resolution_m
    beyond = int(_BEYOND_SHARE * state.shape[1])
    off = int(_OFF_SHARE * state.shape[1])
    on = state.shape[1] - off - beyond
    searched, whole = None, not isinstance(area, TiledArea)
    if isinstance(area, TiledArea):
        searched = searched_tiles(area, reading, model.evidence.levels)
        on_ways = points_everywhere(area) if searched is None else searched.points
    else:
        on_ways = model.whole.points
    drawn = rng.random((_TRIES * off, 2))
    if searched is None:
        anywhere = (np.array(area.size_m) * drawn).T.astype(np.float32)
        around = _around(area, beyond, rng)
    else:
        anywhere = searched.anywhere(drawn)
        around = searched.around(area.size_m, BEYOND_M, beyond, rng)
        if not around.shape[1]:
            on, beyond = on + beyond, 0
    inside = 1 - BEYOND_AT_START
    first = 0
    for count, points, pixel_m, is_off, share in (
        (on, on_ways, spread_m, 0.0, inside * (1 - OFF_AT_START)),
        (off, anywhere, 0.0, 1.0, inside * OFF_AT_START),
        (beyond, around, 0.0, OFF_AT_START, BEYOND_AT_START),
    ):
        part = slice(first, first + count)
        first += count
        if not points.shape[1] or not count:
            log_weight[part] = -np.inf
            continue
        if points is on_ways and whole:
            weight, log_mean = likelihoods_on_ways(model, reading)
        else:
            weight, log_mean = likelihoods(model, points, reading)
        chosen = np.empty(count, dtype=np.int32)
        systematic(weight, rng.random(), chosen)
        beside = rng.random((2, count), dtype=np.float32) - _F(0.5)
        state[EAST : NORTH + 1, part] = points[:, chosen] + _F(pixel_m) * beside
        state[OFF, part] = is_off
        log_weight[part] = log_mean + np.log(share / count)


def _around(area: AreaFrame, count: int, rng: np.random.Generator) -> Floats32:
    """Draw places around the area, shape (2, count)."""
    size_m = np.array(area.size_m)[:, None]
    found = np.empty((2, 0), dtype=np.float32)
    while found.shape[1] < count:
        some = (size_m + 2 * BEYOND_M) * rng.random((2, 4 * count)) - BEYOND_M
        places = some.astype(np.float32)
        found = np.concatenate([found, places[:, np.flatnonzero(area.beyond(places))]], 1)
    return found[:, :count]


def any_heading(
    model: BayesModel, state: Floats32, times: int, rng: np.random.Generator
) -> Floats32:
    """Return ``times`` copies with uniform heading errors, spread over their pixels."""
    turned = np.tile(state, times)
    resolution_m = _F(model.area.lattice.resolution_m)
    spread = rng.random((2, turned.shape[1]), dtype=np.float32) - _F(0.5)
    turned[: NORTH + 1] += resolution_m * spread
    turned[BIAS] = pi * (2 * rng.random(turned.shape[1]) - 1)
    return turned


def cloud_of(state: Floats32) -> Cloud:
    """Return new hypotheses, which keep nothing besides their state."""
    return Cloud(state, np.empty((0, state.shape[1]), dtype=np.float32))
