"""First hypotheses by the map alone: where the path of the last metres fits its streets.

With a map and nothing else, a belief starts when the vehicle or walker has come some way. Each
place on the map and each direction is as probable as that path is on the map's streets.
"""

from __future__ import annotations

from math import ceil, inf, pi, radians
from typing import NamedTuple

import numpy as np

from mapfilter._types import Floats, Floats32, Ints, Ints32
from mapfilter.filters.resampling import systematic
from mapfilter.models.street_path import weigh_path
from mapfilter.models.way_map import MapWeights
from mapfilter.positioning.bayes.area.area_map import AreaMap
from mapfilter.positioning.bayes.beliefs.path import LEG_M, RecentPath

OFF_AT_START = 0.05
"""Probability that a start lies off the map."""

_F = np.float32
_BIN_RAD = radians(3.0)
_LEAST_NATS = 14.0
"""Places and directions that are less probable than the best by this many nats are left out."""
_EVENNESS = 0.5
"""Hypotheses are drawn by the likelihood to this power, and keep the rest of it as weights."""


class PathEnds(NamedTuple):
    """Hypotheses at the end of a path.

    Parameters
    ----------
    place_m : ndarray of float32, shape (2, N)
        East and north in the area's frame.
    turned_rad : ndarray, shape (N,)
        Error of the headings of dead reckoning.
    off : ndarray of float32, shape (N,)
        Probability of being off the map.
    log_weight : ndarray, shape (N,)
        Of weights that sum to one.
    """

    place_m: Floats32
    turned_rad: Floats
    off: Floats32
    log_weight: Floats


def possible_turns_rad(bias_sd_rad: float, *, compass: bool) -> tuple[Floats, Floats, float]:
    """Return errors of headings on a grid, their log prior, and the grid's spacing."""
    if not compass:
        count = round(2 * pi / _BIN_RAD)
        return 2 * pi * np.arange(count) / count - pi, np.zeros(count), 2 * pi / count
    step_rad = max(min(_BIN_RAD, 0.5 * bias_sd_rad), 1e-6)
    side = ceil(3 * bias_sd_rad / step_rad)
    turned = step_rad * np.arange(-side, side + 1, dtype=np.float64)
    return turned, -0.5 * (turned / max(bias_sd_rad, 1e-6)) ** 2, step_rad


def ends_of_path(
    area: AreaMap,
    weights: MapWeights,
    path: RecentPath,
    turns: tuple[Floats, Floats, float],
    count: int,
    rng: np.random.Generator,
) -> PathEnds:
    """Draw ends of a path from all points on ways and all directions, by how well it fits there.

    ``turns`` are those of :func:`possible_turns_rad`.
    """
    factors = weights.over(LEG_M)
    on_map = np.exp(_F(factors.exponent) * area.log_map(weights.sd_m))
    points, earlier_m = area.points, path.earlier_m
    turned_rad, log_prior, width_rad = turns
    found = np.empty(points.shape[1], dtype=np.float32)
    off = np.empty_like(found)
    best, kept = -inf, list[tuple[Ints32, Floats32, Floats32]]()
    for turn in range(turned_rad.size):
        off[:] = OFF_AT_START
        weigh_path(
            points,
            earlier_m,
            turned_rad[turn],
            on_map,
            area.lattice.resolution_m,
            factors,
            found,
            off,
        )
        found += _F(log_prior[turn])
        best = max(best, float(found.max()))
        likely_at = np.flatnonzero(found > best - _LEAST_NATS)
        kept.append((likely_at.astype(np.int32), found[likely_at], off[likely_at]))
    log_likelihood = np.concatenate([likely for _, likely, _ in kept])
    # There are millions: nothing is kept of them but what they are drawn by.
    drawn_by = _log_drawn(log_likelihood, best)
    np.exp(drawn_by, out=drawn_by)
    drawn_by /= drawn_by.sum()
    chosen = np.empty(count, dtype=np.int32)
    systematic(drawn_by.astype(np.float32), rng.random(), chosen)
    beside_m = area.lattice.resolution_m * (rng.random((2, count)) - 0.5)
    aside_rad = width_rad * (rng.random(count) - 0.5)
    likely = log_likelihood[chosen]
    log_weight = likely - best - _log_drawn(likely, best)
    turn_of, place, off = _picked([(place, off) for place, _, off in kept], chosen)
    return PathEnds(
        points[:, place] + beside_m.astype(np.float32),
        turned_rad[turn_of] + aside_rad,
        off,
        log_weight - np.log(np.sum(np.exp(log_weight))),
    )


def _log_drawn(log_likelihood: Floats32, best: float) -> Floats:
    """Return the logarithm of what ends are drawn in proportion to."""
    log_drawn = log_likelihood.astype(np.float64)
    log_drawn -= best
    log_drawn *= _EVENNESS
    return log_drawn


def _picked(kept: list[tuple[Ints32, Floats32]], chosen: Ints32) -> tuple[Ints, Ints32, Floats32]:
    """Return part, place and ``off`` of each chosen one, by increasing numbers over all parts."""
    edges = np.cumsum([0, *(place.size for place, _ in kept)])
    ends = np.searchsorted(chosen, edges)
    local = [
        chosen[first:last] - edge
        for edge, first, last in zip(edges[:-1], ends[:-1], ends[1:], strict=True)
    ]
    part = np.repeat(np.arange(len(kept)), np.diff(ends))
    place = np.concatenate([own[at] for (own, _), at in zip(kept, local, strict=True)])
    off = np.concatenate([own[at] for (_, own), at in zip(kept, local, strict=True)])
    return part, place, off
