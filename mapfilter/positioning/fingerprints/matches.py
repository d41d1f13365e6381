"""From one report to weights of the database's reports, and from these to a position."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from mapfilter._types import Floats, Ints, Ints8, Ints32
from mapfilter.errors import InputError, fail
from mapfilter.positioning.fingerprints.censoring import likely
from mapfilter.positioning.fingerprints.likelihoods import LevelErrors, Likelihoods
from mapfilter.positioning.fingerprints.matching import ByCell, Distances, Scale, usual_levels
from mapfilter.positioning.fingerprints.options import (
    Centroid,
    Method,
    Neighbours,
    Probabilistic,
    SurveyMaps,
)
from mapfilter.positioning.fingerprints.reports import Reports

_NO_LEVEL_DBM = -30.0
_NEGLIGIBLE = 1e-4
_LOG_NEGLIGIBLE = float(np.log(_NEGLIGIBLE / 2)) - 1e-9
_MOST = 4000
_TINY = 1e-6
_ROUNDS = 60
_SOFT_M = 1.0


class Received(NamedTuple):
    """One report to be located: cells by index, levels, serving cell (-1: none), steps (or NaN).

    Parameters
    ----------
    censored : ndarray of int8 or None
        -1: the level is below; 1: above; None where no level is a bound.
    """

    cell: Ints32
    level_dbm: Floats
    serving: int
    timing_advance: float
    censored: Ints8 | None = None


class Match(NamedTuple):
    """Reports of the database that a report resembles.

    Parameters
    ----------
    reports : ndarray, shape (K,)
        Indices in the database.
    weight : ndarray, shape (K,)
        Sums to one.
    mismatch : float
        How unlike the best of them are; comparable between reports, larger is worse.
    """

    reports: Ints
    weight: Floats
    mismatch: float


Matcher = Callable[[Received], Match]


class Position(NamedTuple):
    """East and north, the root mean square distance of the matched places, and the mismatch."""

    east_m: float
    north_m: float
    spread_m: float
    mismatch: float


@dataclass(frozen=True, eq=False)
class Locator:
    """A method over a database; a function from one report to a position."""

    places: Floats
    matcher: Matcher
    median: bool

    def __call__(self, received: Received) -> Position:
        """Return the position of a report that has at least one cell of the database."""
        match = self.matcher(received)
        places = self.places[match.reports]
        at = match.weight @ places
        if self.median:
            at = _geometric_median(places, match.weight, at)
        spread_m = float(np.sqrt(match.weight @ np.sum((places - at) ** 2, axis=1)))
        return Position(float(at[0]), float(at[1]), spread_m, match.mismatch)


def locator(method: Method, database: Reports) -> Locator:
    """Return a method over the reports of a database, all with positions.

    Raises
    ------
    InputError
        There are none.
    """
    if not len(database):
        raise fail(InputError, "database", "reports with positions and transmitters", "none")
    places = database.places
    if isinstance(method, Centroid):
        return Locator(places, _centroid(database), median=False)
    known = np.isfinite(database.level_dbm)
    # Logs of serving cells alone have no levels; all cells then count alike.
    floor_dbm = float(database.level_dbm[known].min()) - 1.0 if known.any() else _NO_LEVEL_DBM
    if isinstance(method, Neighbours):
        scale = Scale(method.representation, floor_dbm, method.exponent)
        return Locator(places, _neighbours(database, method, scale), median=False)
    if isinstance(method, SurveyMaps):
        # Here, as it imports what fits surveys.
        from mapfilter.positioning.fingerprints.survey_levels import surveyed_levels

        database = surveyed_levels(database)
    return Locator(places, _posterior(database, method, floor_dbm), median=True)


def located_once(
    locate: Callable[[Received], Position], most: int = 1 << 14
) -> Callable[[Received], Position]:
    """Return a function that locates equal reports once; the latest ``most`` are kept.

    Journeys that differ in their dead reckoning alone have the same reports.
    """

    # Arrays are no keys; as bytes missing levels are equal, too.
    @lru_cache(most)
    def position(
        cell: bytes, level_dbm: bytes, serving: int, advance: bytes, censored: bytes
    ) -> Position:
        received = Received(
            np.frombuffer(cell, np.int32),
            np.frombuffer(level_dbm, np.float64),
            serving,
            float(np.frombuffer(advance, np.float64)[0]),
            np.frombuffer(censored, np.int8) if censored else None,
        )
        return locate(received)

    def once(received: Received) -> Position:
        cell = received.cell.astype(np.int32, copy=False).tobytes()
        level_dbm = received.level_dbm.astype(np.float64, copy=False).tobytes()
        advance = np.float64(received.timing_advance).tobytes()
        ends = received.censored
        censored = b"" if ends is None else ends.astype(np.int8, copy=False).tobytes()
        return position(cell, level_dbm, received.serving, advance, censored)

    return once


def _centroid(database: Reports) -> Matcher:
    by_cell, usual_dbm = ByCell.of(database), usual_levels(database)

    def match(received: Received) -> Match:
        cell = received.serving
        if cell < 0 or by_cell.first[cell] == by_cell.first[cell + 1]:
            level_dbm = likely(received.level_dbm, received.censored, received.cell, usual_dbm)
            # Of equally strong ones the first of the database, whatever the order of readings.
            cell = int(received.cell[level_dbm == level_dbm.max()].min())
        own = by_cell.report[by_cell.of_cell(cell)]
        return Match(own, np.full(len(own), 1 / len(own)), 0.0)

    return match


def _neighbours(database: Reports, method: Neighbours, scale: Scale) -> Matcher:
    distances = Distances.to(database, method.metric, scale)
    k = min(method.k, len(database))

    def match(received: Received) -> Match:
        distance = distances.of(received.cell, received.level_dbm, received.censored)
        index = np.argpartition(distance, k - 1)[:k]
        near = distance[index]
        weight = (near + _TINY) ** -method.weight_power
        # Powers of small distances overflow sums of others: relative to the largest.
        weight /= weight.max()
        return Match(index, weight / weight.sum(), float(near.mean()))

    return match


def _posterior(database: Reports, method: Probabilistic | SurveyMaps, floor_dbm: float) -> Matcher:
    shared_db = method.shared_db
    if database.planned is not None:
        shared_db = float(np.hypot(shared_db, database.planned.common_db))
    errors = LevelErrors(method.level_db, shared_db, method.absence_per_db, floor_dbm)
    likelihoods = Likelihoods.at(database, errors)
    out = np.log(max(method.outliers, np.finfo(np.float64).tiny))
    inlier = np.log(max(1 - method.outliers, np.finfo(np.float64).tiny))

    def match(received: Received) -> Match:
        cells, levels = likelihoods.of(received.cell, received.level_dbm, received.censored)
        effective = min(len(received.cell), method.effective_readings)
        share = effective / len(received.cell)
        levels = share * levels + _timing(database, received, method.timing_sd_steps)
        # An outlier goes by its cells alone; the levels of others are -n/2 on average.
        by_cells, by_levels, outlier = share * cells, inlier + levels, out - effective / 2
        # The sum of two is at most twice the larger one: most places need no closer look.
        least = by_cells + np.maximum(by_levels, outlier)
        index = np.flatnonzero(least >= least.max() + _LOG_NEGLIGIBLE)
        log_weight = by_cells[index] + np.logaddexp(by_levels[index], outlier)
        best = float(log_weight.max())
        weight = np.exp(log_weight - best)
        some = np.flatnonzero(weight > _NEGLIGIBLE)
        if len(some) > _MOST:
            some = some[np.argpartition(-weight[some], _MOST)[:_MOST]]
        index, weight = index[some], weight[some]
        total = float(weight.sum())
        return Match(index, weight / total, -(best + float(np.log(total))))

    return match


def _timing(database: Reports, received: Received, sd_steps: float) -> Floats:
    """Return log-likelihoods of the timing advance where the same cell serves, else 0."""
    found = np.zeros(len(database))
    if received.serving < 0 or np.isnan(received.timing_advance):
        return found
    if database.planned is not None:
        own = (received.serving, received.timing_advance)
        return database.planned.log_timing(database.places, *own)
    apart = received.timing_advance - database.timing_advance
    same = (database.serving == received.serving) & np.isfinite(apart)
    found[same] = -0.5 * (apart[same] / sd_steps) ** 2
    # Where none was reported it may be any: as far off as two deviations.
    found[(database.serving == received.serving) & ~np.isfinite(apart)] = -2.0
    return found


def _geometric_median(places: Floats, weight: Floats, start: Floats) -> Floats:
    """Return the place with the least mean distance to weighted places (Weiszfeld 1937)."""
    at = start
    # Sums over an axis of two are slow.
    east_m, north_m = np.ascontiguousarray(places.T)
    for _ in range(_ROUNDS):
        distance_m = np.sqrt((east_m - at[0]) ** 2 + (north_m - at[1]) ** 2 + _SOFT_M**2)
        pull = weight / distance_m
        new = pull @ places / pull.sum()
        if np.abs(new - at).max() < _SOFT_M / 100:
            return np.asarray(new)
        at = new
    return at
