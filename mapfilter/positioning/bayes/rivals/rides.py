"""Walkers who may be anywhere, as they took a bus or a train and no position was measured."""

from __future__ import annotations

from math import inf

from mapfilter.positioning.bayes.state import BayesState
from mapfilter.positioning.gnss.source import gnss_of
from mapfilter.positioning.sensors.watch import SensorWatch


def rode(state: BayesState, watch: SensorWatch, time_s: float) -> bool:
    """Return whether what is known so far tells nothing of the place at an epoch.

    Parameters
    ----------
    state : BayesState
        After the epoch before.
    watch : SensorWatch
        After this epoch's readings.
    time_s : float
        Of the epoch.
    """
    since_s, rest = inf, state.watch.rest
    if rest is not None and watch.rest is None and rest.was_ride(time_s):
        since_s = rest.since_s
    if watch.rode_unheard:
        since_s = min(since_s, state.watch.times.report_s)
    return gnss_of(state).compared_at_s < since_s < inf


def rides_unheard(state: BayesState) -> bool:
    """Return whether one who hardly steps may have left, as nothing is heard any more."""
    watch = state.watch
    is_unheard = watch.is_unheard(state.hold.step_unit_m)
    return is_unheard and gnss_of(state).compared_at_s < watch.times.report_s
