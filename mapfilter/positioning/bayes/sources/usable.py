"""What is usable of an epoch: sensors looked at, repeated fixes and crowded positions left out."""

from __future__ import annotations

from dataclasses import replace
from math import isfinite
from typing import NamedTuple

from mapfilter.filters.contract import Reason
from mapfilter.positioning.bayes.state import BayesState
from mapfilter.positioning.epochs import Epoch
from mapfilter.positioning.sensors.watch import UNMEASURED, SensorWatch
from mapfilter.positioning.sensors.watching import watched
from mapfilter.positioning.step_output import UnusedReading


class UsableEpoch(NamedTuple):
    """An epoch without what cannot be used of it.

    Parameters
    ----------
    watch : SensorWatch
        After the epoch.
    epoch : Epoch
        As of :func:`mapfilter.positioning.sensors.watching.watched`, without a fix that has no
        position or repeats the last one that was used, and without positions that are too near to
        the last one.
    motion, radio : Reason
        Whether motion and the report are used, or why not.
    unused : list of UnusedReading
        What is left out of the report and the positions.
    """

    watch: SensorWatch
    epoch: Epoch
    motion: Reason
    radio: Reason
    unused: list[UnusedReading]

    @property
    def is_measured(self) -> bool:
        """Whether its motion was measured."""
        return self.motion not in UNMEASURED


def usable_epoch(state: BayesState, given: Epoch, *, by_ways: bool = False) -> UsableEpoch:
    """Return what is usable of an epoch, and the sensors after it."""
    fix, is_repeated = given.gnss, False
    epoch = given
    if fix is not None:
        is_repeated = fix.repeats(state.last_fix)
        if is_repeated or not (isfinite(fix.east_m) and isfinite(fix.north_m)):
            epoch = replace(given, gnss=None)
    watch, epoch, (motion, radio) = watched(state.watch, epoch, state.hold.step_unit_m)
    measured = motion not in UNMEASURED
    way, epoch, left_out = watch.undirected.spread(epoch, is_measured=measured, by_ways=by_ways)
    watch = watch if way is watch.undirected else watch._replace(undirected=way)
    short, epoch = watch.short.gathered(epoch)
    watch = watch if short is watch.short else watch._replace(short=short)
    time_s, unused = given.time_s, []
    if radio is not Reason.USED:
        unused = [UnusedReading(time_s, row.role, row.name, radio) for row in given.radio]
    unused += left_out
    if is_repeated:
        unused.append(UnusedReading(time_s, "gnss", "", Reason.REPEATED_FIX))
    return UsableEpoch(watch, epoch, motion, radio, unused)
