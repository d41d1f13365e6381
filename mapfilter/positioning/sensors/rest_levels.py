"""Two blocks of levels compared: at rest, on a way, or elsewhere."""

from __future__ import annotations

from collections.abc import Mapping
from math import exp, log, sqrt

_AT_REST_DB, _ELSEWHERE_DB, _ALL_DB = 4.0, 9.0, 6.0
"""Deviations of a level from an earlier one at rest, and elsewhere; of all levels together, as a
phone is put into a pocket."""
_BLOCK_SHARE = 0.5
"""Power of a block's likelihoods: blocks near each other repeat the same deviation."""
_FADING_DB, _WHITE_DB = 2.7, 3.3
"""Deviation of a level at rest from its earlier mean, and of a single level besides."""
_WAY_DB, _WAY_M = 10.5, 60.0
"""Deviation of a level far along a way from that at its start; the distance of 1 - 1/e of its
variance."""
_MOST_NATS, _LEAST_NATS = 3.0, -21.0
"""The most that a block gains, either way, and the least sum."""
_STROLL_SHARE = 0.5
"""Share of that variance which a way as measured explains, where it is compared with being
elsewhere: with all of it, the two could hardly be told apart after 30 m."""


def carried_nats_of(
    first: Mapping[str, tuple[float, int]],
    now: Mapping[str, tuple[float, int]],
    measured_m: float,
) -> float:
    """Return how much the levels of two blocks speak for being carried elsewhere.

    Parameters
    ----------
    first, now : mapping of str to tuple of float
        Sum in dBm and number of each cell's levels, of the first block and of one of now.
    measured_m : float
        Way that was measured between them.

    Returns
    -------
    float
        Logarithm of the likelihood ratio of "elsewhere" to "as measured", by its power.
    """
    changes = [
        now[name][0] / now[name][1] - first[name][0] / first[name][1]
        for name in now
        if name in first
    ]
    if not changes:
        return 0.0
    as_measured_db = sqrt(_AT_REST_DB**2 + _STROLL_SHARE * _on_way_db2(measured_m))
    ratio = _log_density(changes, _ELSEWHERE_DB) - _log_density(changes, as_measured_db)
    return _BLOCK_SHARE * ratio


def left_nats_of(
    first: Mapping[str, tuple[float, int]],
    now: Mapping[str, tuple[float, int]],
    way_m: float,
    measured_m: float,
) -> tuple[float, float]:
    """Return how much the levels of two blocks speak for a way beyond what was measured.

    Parameters
    ----------
    first, now, measured_m
        As of :func:`carried_nats_of`.
    way_m : float
        The way at the pace before.

    Returns
    -------
    gained, unchanged : float
        Logarithm of the likelihood ratio of that way to "as measured", by its power; the same for
        levels without a change.
    """
    pairs = [(now[name], first[name]) for name in now if name in first]
    if not pairs or way_m <= measured_m:
        return 0.0, 0.0
    changes = [own[0] / own[1] - other[0] / other[1] for own, other in pairs]
    per_mean = sum(1 / own[1] + 1 / other[1] for own, other in pairs) / len(pairs)
    at_rest_db2 = _FADING_DB**2 + _WHITE_DB**2 * per_mean
    as_measured_db = sqrt(at_rest_db2 + _on_way_db2(measured_m))
    on_way_db = sqrt(at_rest_db2 + _on_way_db2(way_m))
    ratios = (
        _log_density(seen, on_way_db) - _log_density(seen, as_measured_db)
        for seen in (changes, [0.0] * len(changes))
    )
    gained, unchanged = (_BLOCK_SHARE * ratio for ratio in ratios)
    return gained, unchanged


def _on_way_db2(way_m: float) -> float:
    """Return the variance of how a level changes along a way."""
    return _WAY_DB**2 * (1 - exp(-way_m / _WAY_M))


def added_nats(nats: float, gained: float) -> float:
    """Return a bounded sum in nats with what a block gains."""
    return max(nats + min(max(gained, -_MOST_NATS), _MOST_NATS), _LEAST_NATS)


def _log_density(changes_db: list[float], sd_db: float) -> float:
    """Return the log density of changes that share an error, up to a constant."""
    count, mean = len(changes_db), sum(changes_db) / len(changes_db)
    apart = sum((change - mean) ** 2 for change in changes_db)
    shared_db2 = sd_db**2 + count * _ALL_DB**2
    exponent = apart / sd_db**2 + count * mean**2 / shared_db2
    return -0.5 * exponent - (count - 1) * log(sd_db) - 0.5 * log(shared_db2)
