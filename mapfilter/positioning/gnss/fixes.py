"""Position fixes as evidence: their likelihoods, and whether they agree with a belief."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isfinite, log, pi, sqrt

import numpy as np

from mapfilter._types import Floats, Floats32
from mapfilter.models.street_motion import EAST, NORTH
from mapfilter.positioning.bayes.rivals.alternative import MapBelief
from mapfilter.positioning.epochs import FIX_SD_M, GnssFix

_F = np.float32
_FIX_CLIP = 5.0
_AGREES = -2 * log(0.05)
"""Squared distance, in standard deviations, that 95 % of two-dimensional errors keep."""
_MOST_REFUTED_NATS = 5.0
"""The most that one fix takes from the null hypothesis."""


@dataclass(frozen=True)
class FixTerm:
    """Log-likelihood of a position fix: Gaussian, clipped at five standard deviations.

    ``origin_m`` is that of the frame of the hypotheses.
    """

    fix: GnssFix
    origin_m: tuple[float, float]

    @property
    def place_m(self) -> tuple[float, float]:
        """East and north of the fix in the frame of the hypotheses."""
        return self.fix.east_m - self.origin_m[0], self.fix.north_m - self.origin_m[1]

    def log_likelihood(self, state: Floats32) -> Floats:
        """Return the log-likelihood of each hypothesis."""
        fix, (west, south) = widened(self.fix, 1.0), self.origin_m
        dx = state[EAST] - _F(fix.east_m - west)
        dy = state[NORTH] - _F(fix.north_m - south)
        var_x, var_y = max(fix.var_east_m2, 1.0), max(fix.var_north_m2, 1.0)
        cross = cross_of(var_x, var_y, fix)
        det = var_x * var_y - cross**2
        square = (var_y * dx**2 - 2 * cross * dx * dy + var_x * dy**2) / det
        return np.asarray(-0.5 * np.minimum(square, _FIX_CLIP**2), dtype=np.float64)


@dataclass(frozen=True)
class RejectedFixTerm:
    """Log-likelihood of a fix that the belief has rejected, for its rivals: beyond its gate.

    Hypotheses that the fix contradicts as well gain nothing by it, and lose nothing. ``share`` is
    that of the fix which is new: fixes in a row repeat the same error.
    """

    term: FixTerm
    gate: float
    share: float = 1.0

    def log_likelihood(self, state: Floats32) -> Floats:
        """Return the log-likelihood of each hypothesis, over that of the belief at its gate."""
        return self.share * np.maximum(self.term.log_likelihood(state) + self.gate, 0.0)


def refutation(fix: GnssFix, total: float, area_m2: float) -> float:
    """Return the log-likelihood of a fix under the null hypothesis, less that of a belief.

    Under the null hypothesis the fix may be of any place in the area: what a wide belief expects
    refutes nothing, what agrees with a narrow one does, up to a bound, as fixes may be faulty.

    Parameters
    ----------
    fix : GnssFix
        With its variances.
    total : float
        Log-likelihood of the fix under the belief, in nats; 0 for a belief at the fix.
    area_m2 : float
        Size of the area.
    """
    cross = fix.cov_east_north_m2 if isfinite(fix.cov_east_north_m2) else 0.0
    spread_m4 = max(fix.var_east_m2, 1.0) * max(fix.var_north_m2, 1.0) - cross**2
    anywhere = log(2 * pi * sqrt(max(spread_m4, 1.0)) / area_m2)
    return min(max(anywhere - total, -_MOST_REFUTED_NATS), 0.0)


def cross_of(var_east_m2: float, var_north_m2: float, fix: GnssFix) -> float:
    """Return the covariance of a fix, 0 where it has none, as far as its variances allow."""
    cross_m2 = fix.cov_east_north_m2 if isfinite(fix.cov_east_north_m2) else 0.0
    most_m2 = 0.99 * sqrt(var_east_m2 * var_north_m2)
    return float(np.clip(cross_m2, -most_m2, most_m2))


def agrees_with(belief: MapBelief, fix: GnssFix, origin_m: tuple[float, float]) -> bool:
    """Return whether a fix lies where 95 % of them would, by the errors of the belief and its own.

    Parameters
    ----------
    belief : ParticleBelief or GridBelief
    fix : GnssFix
        With its variances.
    origin_m : tuple of float
        Of the frame of the hypotheses.
    """
    return squared_distance(belief, fix, origin_m) <= _AGREES


def squared_distance(belief: MapBelief, fix: GnssFix, origin_m: tuple[float, float]) -> float:
    """Return the squared distance of a fix from a belief's mean, in deviations of both."""
    summary, cross_m2 = belief.summary, cross_of(fix.var_east_m2, fix.var_north_m2, fix)
    covariance_m2 = summary.covariance_m2 + np.array(
        [[fix.var_east_m2, cross_m2], [cross_m2, fix.var_north_m2]]
    )
    apart_m = np.array([fix.east_m, fix.north_m]) - np.array(origin_m) - summary.mean[:2]
    return float(apart_m @ np.linalg.solve(covariance_m2, apart_m))


def repeated(belief: MapBelief, fix: GnssFix) -> float:
    """Return by how much a variance grows of a fix that makes a belief as precise as it is itself.

    A fix whose error is that of the one before adds nothing to a belief that is more precise, for
    which this is infinite; of one that has grown wider since, it restores the place.

    Parameters
    ----------
    belief : ParticleBelief or GridBelief
    fix : GnssFix
        With its variances.
    """
    own_m2 = (fix.var_east_m2 + fix.var_north_m2) / 2
    wide_m2 = float(np.trace(belief.summary.covariance_m2)) / 2
    return wide_m2 / (wide_m2 - own_m2) if wide_m2 > own_m2 else inf


def widened(fix: GnssFix, times: float) -> GnssFix:
    """Return a fix with its variance multiplied; 10 m are assumed where it has none, or 0."""
    known = 0 < fix.var_east_m2 < inf and 0 < fix.var_north_m2 < inf
    east_m2, north_m2 = (fix.var_east_m2, fix.var_north_m2) if known else (FIX_SD_M**2,) * 2
    cross_m2 = fix.cov_east_north_m2 if known else 0.0
    return GnssFix(fix.east_m, fix.north_m, times * east_m2, times * north_m2, times * cross_m2)
