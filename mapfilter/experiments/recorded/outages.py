"""Outages of satellites in a journey, and the errors at their ends."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from mapfilter._types import Bools, Floats
from mapfilter.evaluation.accuracy import position_errors_m
from mapfilter.evaluation.truth import Truth
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.tracks.deadreckoning import dead_reckon
from mapfilter.tracks.log import TrackLog

PLACE, HEADING, PLACE_HEADING = "oracle-place", "oracle-heading", "oracle-place-heading"
"""Names of the methods by what is true at the beginning of an outage."""
_DIRECTION_M = 30.0


@dataclass(frozen=True)
class Outages:
    """Equal outages one after another.

    Parameters
    ----------
    first_s : float
        Begin of the first one.
    length_s, pause_s : float
        Of each, and between two of them.
    """

    first_s: float
    length_s: float
    pause_s: float

    def within(self, until_s: float) -> list[tuple[float, float]]:
        """Return begin and end of all outages that end in time."""
        found, begin_s = [], self.first_s
        while begin_s + self.length_s <= until_s:
            found.append((begin_s, begin_s + self.length_s))
            begin_s += self.length_s + self.pause_s
        return found


def without(table: pd.DataFrame, spans: Sequence[tuple[float, float]]) -> pd.DataFrame:
    """Return a table without the rows of some spans of time."""
    time_s = table["time_s"].to_numpy()
    inside = np.zeros(len(table), dtype=np.bool_)
    for begin_s, end_s in spans:
        inside |= (time_s > begin_s) & (time_s <= end_s)
    return table[~inside].reset_index(drop=True)


def log_without(log: TrackLog, spans: Sequence[tuple[float, float]]) -> TrackLog:
    """Return a log without satellites in some spans of time."""
    return replace(
        log, gnss=without(log.gnss, spans), pseudoranges=without(log.pseudoranges, spans)
    )


def errors_at(
    estimate: TrackEstimate, truth: Truth, times_s: Sequence[float]
) -> tuple[Floats, Bools]:
    """Return the error at the last epoch up to each time, and whether the 95 % radius held it.

    Without a position the error is infinite, as before the first epoch. The true positions asked
    for are taken as they are given, with straight lines between them.
    """
    east_m, north_m = truth.at(estimate.time_s)
    errors_m = np.hypot(estimate.east_m - east_m, estimate.north_m - north_m)
    at = np.searchsorted(estimate.time_s, np.asarray(times_s) + 1e-6) - 1
    there = (at >= 0) & np.isfinite(errors_m[at])
    held = there & (errors_m[at] <= estimate.radii_m[at, 2])
    return np.where(there, errors_m[at], np.inf), held


def errors_between(
    estimate: TrackEstimate, truth: Truth, after_s: float, until_s: float
) -> tuple[Floats, Bools]:
    """Return the errors of all epochs in a span of time in which the true position is known.

    Without a position the error is infinite. Second, whether the 95 % radius held it.
    """
    known = truth.tells(estimate.time_s)
    asked = known & (estimate.time_s > after_s) & (estimate.time_s <= until_s)
    errors_m = position_errors_m(estimate, truth)[asked]
    there = np.isfinite(errors_m)
    return np.where(there, errors_m, np.inf), there & (errors_m <= estimate.radii_m[asked, 2])


def errors_from_true_begin(
    estimate: TrackEstimate, truth: Truth, spans: Sequence[tuple[float, float]]
) -> dict[str, Floats]:
    """Return the errors at the ends of spans, had the estimate begun each of them at the truth.

    Its displacement over a span begins at the true position, is turned by the error of its
    direction over the first 30 m, or both. What is left are errors of lengths and turns. Infinite
    where there is no position.

    Returns
    -------
    dict of str to ndarray, shape (number of spans,)
        By :data:`PLACE`, :data:`HEADING` and :data:`PLACE_HEADING`.
    """
    found: dict[str, list[float]] = {PLACE: [], HEADING: [], PLACE_HEADING: []}
    for begin_s, end_s in spans:
        length_m = truth.distance_at(truth.time_s) - truth.distance_at(begin_s)
        far = np.searchsorted(length_m, _DIRECTION_M)
        first_s = float(truth.time_s[min(int(far), len(length_m) - 1)])
        at_s = np.array([begin_s, min(first_s, end_s), end_s])
        at = np.searchsorted(estimate.time_s, at_s + 1e-6) - 1
        # Complex numbers are turned by a factor.
        own = np.where(at >= 0, estimate.east_m[at] + 1j * estimate.north_m[at], np.nan)
        east_m, north_m = truth.at(at_s)
        true = east_m + 1j * north_m
        off = own[0] - true[0]
        moved, should = own[2] - own[0], true[2] - true[0]
        turned = np.exp(1j * (np.angle(true[1] - true[0]) - np.angle(own[1] - own[0])))
        found[PLACE].append(abs(moved - should))
        found[HEADING].append(abs(off + turned * moved - should))
        found[PLACE_HEADING].append(abs(turned * moved - should))
    return {name: np.nan_to_num(np.array(each), nan=np.inf) for name, each in found.items()}


def coasted_errors_m(
    motion: pd.DataFrame, truth: Truth, spans: Sequence[tuple[float, float]]
) -> Floats:
    """Return the errors at the ends of spans of dead reckoning alone.

    It is given the true position at their beginnings, and the true direction of the last 30 m.
    """
    time_s = motion["time_s"].to_numpy()
    turn = motion["turn_rad"].fillna(0.0).to_numpy()
    heading = np.cumsum(turn) - turn / 2
    found = np.stack(dead_reckon(0.0, 0.0, motion["step_m"].fillna(0.0), heading))
    true = np.stack(truth.at(time_s))
    length = truth.distance_at(time_s)
    errors = []
    for begin_s, end_s in spans:
        i, k = np.searchsorted(time_s, [begin_s, end_s], side="right") - 1
        j = int(np.searchsorted(length, length[i] - _DIRECTION_M))
        known, seen = (part[:, i] - part[:, j] for part in (true, found))
        turned = np.arctan2(known[1], known[0]) - np.arctan2(seen[1], seen[0])
        rotation = np.array([[np.cos(turned), -np.sin(turned)], [np.sin(turned), np.cos(turned)]])
        apart = rotation @ (found[:, k] - found[:, i]) - (true[:, k] - true[:, i])
        errors.append(float(np.hypot(*apart)))
    return np.array(errors, dtype=np.float64)
