"""Whether reports and motion have one clock, by reports and the positions around them.

Recordings of two devices are joined by hand, or sensors count from a phone's start and its modem by
the calendar; nothing in a log shows it, and the position lags behind by as much as the clocks
differ. So while a position is followed, reports are held back for 40 s and then compared with the
positions up to 40 s before and after them: as hypotheses of the model that weighs beliefs, each
with its own errors of levels. Beforehand one log in twenty has two clocks. Which of them is right
is not known: the position is off by the way that is gone in between with half of the probability,
radii are wider by that, and a position that may be too far off is not claimed. Positions by fixes
are by the fixes' clock, and stay as they are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import hypot, isfinite
from typing import NamedTuple

import numpy as np

from mapfilter._types import Floats
from mapfilter.filters.belief_models import Cloud
from mapfilter.filters.contract import Reason, Status
from mapfilter.filters.hypotheses import NEAR_M
from mapfilter.models.street_motion import EAST, NORTH, STATES
from mapfilter.positioning.bayes.beliefs.belief_filters import BeliefFilters
from mapfilter.positioning.bayes.beliefs.model import BayesModel
from mapfilter.positioning.bayes.clocks import APART_S, LATE_S, SAME, Clocks, HeldReport
from mapfilter.positioning.bayes.sources.evidence import EvidenceUpdate, RadioReading
from mapfilter.positioning.bayes.state import BayesState
from mapfilter.positioning.step_output import UnusedReading

_REACH_S = float(APART_S[-1])
_EVERY_M, _EVERY_S = 15.0, 5.0
_JUMP_M = 50.0
"""A position that goes on by more than was walked has been found anew."""
_MOST_NATS = 12.0
"""Evidence is no larger, as a clock may be set."""
_SHARES = (0.5, 0.67, 0.95, 0.99)
_FOLLOWED = (Status.CONVERGED, Status.TRACKING, Status.UNCERTAIN)


def with_clocks_checked(
    beliefs: BeliefFilters, state: BayesState, updates: Sequence[EvidenceUpdate], time_s: float
) -> tuple[BayesState, list[UnusedReading]]:
    """Compare the clocks of reports and motion after an epoch.

    Parameters
    ----------
    beliefs : BeliefFilters
    state : BayesState
        After the epoch's evidence has been weighed.
    updates : sequence of EvidenceUpdate
        The evidence.
    time_s : float
        Of the epoch.

    Returns
    -------
    state : BayesState
        With what is known of the clocks.
    unused : list of UnusedReading
        Reports are named once, with the difference, when one is found.
    """
    belief = state.belief
    if belief is None or state.status not in _FOLLOWED:
        return (state if state.clocks is None else replace(state, clocks=None)), []
    reading = next((one.radio for one in updates if one.radio is not None), None)
    if reading is None or reading.levels is None:
        return state, []
    travelled_m, mean = state.reckoning.travelled_m, belief.summary.mean
    place = Place(time_s, float(mean[0]), float(mean[1]))
    clocks = _traced(state.clocks, place, travelled_m)
    before = clocks.log_weight
    clocks = _compared(clocks, beliefs.model, place, travelled_m, reading)
    unused: list[UnusedReading] = []
    if clocks.log_weight is not before and not clocks.told and isfinite(clocks.apart_s):
        clocks, what = replace(clocks, told=True), f"{clocks.apart_s:+.0f} s"
        unused.append(UnusedReading(time_s, "radio", what, Reason.CLOCKS_APART))
    if clocks.log_weight is not None:
        positioned, radius_m = beliefs.is_positioned(state), float(belief.summary.radii_m[1])
        clocks = _in_doubt(clocks, time_s, radius_m, positioned=positioned)
    return replace(state, clocks=clocks), unused


class Place(NamedTuple):
    """Where a position was, in the area's frame."""

    time_s: float
    east_m: float
    north_m: float


def _compared(
    clocks: Clocks, model: BayesModel, place: Place, travelled_m: float, reading: RadioReading
) -> Clocks:
    """Return the clocks after a report, which is kept, and those that are due by now."""
    last, levels = clocks.held[-1] if clocks.held else None, reading.levels
    assert levels is not None
    long = last is None or place.time_s - last.time_s >= _EVERY_S
    if last is None or (long and travelled_m - last.travelled_m >= _EVERY_M):
        report = HeldReport(place.time_s, travelled_m, reading.serving, levels)
        clocks = replace(clocks, held=(*clocks.held, report))
    while clocks.held and clocks.held[0].time_s <= place.time_s - _REACH_S:
        report, *others = clocks.held
        if clocks.trace[0, 0] <= report.time_s - _REACH_S:
            clocks = _weighed(clocks, model, report)
        clocks = replace(clocks, held=tuple(others))
    return clocks


def _traced(clocks: Clocks | None, place: Place, travelled_m: float) -> Clocks:
    """Return the clocks with a further position, and without those that are no longer needed."""
    if clocks is not None:
        trace, gone_m = clocks.trace, travelled_m - clocks.travelled_m
        if hypot(*(place[1:] - trace[-1, 1:])) <= gone_m + _JUMP_M:
            first = np.searchsorted(trace[:, 0], place.time_s - 3 * _REACH_S)
            trace = np.concatenate([trace[first:], [place]])
            return replace(clocks, trace=trace, travelled_m=travelled_m)
    return Clocks(np.array([place]), travelled_m)


def _weighed(clocks: Clocks, model: BayesModel, report: HeldReport) -> Clocks:
    """Return the clocks after a report has been compared with the positions around it."""
    places = _places(clocks.trace, report.time_s + APART_S)
    options, first = model.evidence, not isfinite(clocks.compared_m)
    gone_m = 0.0 if first else report.travelled_m - clocks.compared_m
    weight = options.serving.weight_per_m * min(gone_m, options.first_m)
    reading = RadioReading(
        report.serving,
        weight * options.serving_with_levels * (report.serving >= 0),
        report.levels,
        length_m=gone_m,
    )
    state = np.zeros((STATES, APART_S.size), dtype=np.float32)
    state[EAST], state[NORTH] = places
    kept = np.empty((0, APART_S.size), np.float32) if clocks.kept is None else clocks.kept
    log_weight = np.zeros(APART_S.size) if clocks.log_weight is None else clocks.log_weight.copy()
    cloud, _ = model.weigh(Cloud(state, kept, clocks.memory), log_weight, reading)
    log_weight = np.maximum(log_weight - log_weight.max(), -_MOST_NATS)
    # A view of records, of which a saved state would have those of others, too.
    now = np.ascontiguousarray(cloud.kept)
    travelled_m, memory = report.travelled_m, cloud.shared
    return replace(clocks, kept=now, memory=memory, log_weight=log_weight, compared_m=travelled_m)


def _in_doubt(clocks: Clocks, time_s: float, radius_m: float, *, positioned: bool) -> Clocks:
    """Return the clocks with what their difference means for the position now."""
    found = clocks.probability
    wider_m, away = (0.0, 0.0, 0.0, 0.0), 0.0
    # Half of a smaller probability widens none of the radii.
    if not positioned and 1 - found[SAME] > 2 * (1 - _SHARES[-1]):
        # Modems average over seconds, so reports that are a little late are usual.
        gone_s = np.where(APART_S == -LATE_S, 0.0, np.abs(APART_S))
        now, before = clocks.trace[-1, 1:, None], _places(clocks.trace, time_s - gone_s)
        off_m = np.hypot(*(before - now))
        order = np.argsort(-off_m)
        beyond = 0.5 * np.cumsum(found[order])
        lags_m = np.append(off_m[order], 0.0)
        one, two, three, four = (
            float(lags_m[np.searchsorted(beyond, 1 - share, side="right")]) for share in _SHARES
        )
        wider_m, away = (one, two, three, four), 0.5 * float(found[off_m + radius_m > NEAR_M].sum())
    return replace(clocks, wider_m=wider_m, away=away)


def _places(trace: Floats, time_s: Floats) -> Floats:
    """Return east and north at times, (2, K)."""
    return np.stack([np.interp(time_s, trace[:, 0], trace[:, axis]) for axis in (1, 2)])
