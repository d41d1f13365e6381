"""What is known of the sensors after an epoch, and why the way of an epoch is not known."""

from __future__ import annotations

from math import nan
from typing import NamedTuple

from mapfilter.filters.contract import Reason
from mapfilter.positioning.epochs import ReportRow
from mapfilter.positioning.sensors import unheard
from mapfilter.positioning.sensors.pace import Pace
from mapfilter.positioning.sensors.pauses import RowTimes
from mapfilter.positioning.sensors.places import Places
from mapfilter.positioning.sensors.repeats import MotionRepeats
from mapfilter.positioning.sensors.rest import Rest
from mapfilter.positioning.sensors.short_steps import ShortSteps
from mapfilter.positioning.sensors.undirected import UndirectedWay


class SensorWatch(NamedTuple):
    """What is known of the sensors after an epoch.

    Parameters
    ----------
    pace : Pace
        How often motion rows come, and how fast one moves.
    moving_s : float
        Time of the last step at the usual pace, or of what has shown since that slow ones are
        right; since then the way is unmeasured, or at rest. NaN before the first epoch.
    known_s : float
        Time until which the way is measured, or in the belief as an unmeasured one.
    rest : Rest or None
        Reports since ``moving_s``, while no motion is reported, or far less than usual; None while
        it moves.
    unmeasured_s : float
        Time for which an unmeasured way is in the belief already.
    moved_m : float
        Distance since the last report, in the unit of the steps.
    report : tuple of ReportRow
        The last report.
    repeated_nats : float
        How much repeated reports speak for a radio that stands still.
    repeats : MotionRepeats
        How motion rows repeat each other.
    times : RowTimes
        When rows came.
    places : Places
        Positions since steps became fewer than usual.
    undirected : UndirectedWay
        Whether steps have directions, and the way since a position where they have none.
    stepped_m : float
        Length of all steps since the last report, in their unit.
    rode_unheard : bool
        Whether this epoch's report is the first one after a ride without reception.
    has_motion : bool
        Whether motion is measured, as far as is known; False for a log without any, and as long
        as there was none though positions have moved.
    short : ShortSteps
        Steps that wait until they are long enough.
    are_astray : bool
        Whether positions contradicted the belief while steps were as usual, and none has been used
        since: they do not show how far one is carried without steps.
    """

    pace: Pace = Pace()
    moving_s: float = nan
    known_s: float = nan
    rest: Rest | None = None
    unmeasured_s: float = 0.0
    moved_m: float = 0.0
    report: tuple[ReportRow, ...] = ()
    repeated_nats: float = 0.0
    repeats: MotionRepeats = MotionRepeats()
    times: RowTimes = RowTimes()
    places: Places = Places()
    undirected: UndirectedWay = UndirectedWay()
    stepped_m: float = 0.0
    rode_unheard: bool = False
    has_motion: bool = True
    short: ShortSteps = ShortSteps()
    are_astray: bool = False

    @property
    def is_unmeasured(self) -> bool:
        """Whether some of the way since the last position that was used was not measured."""
        return self.undirected.is_unmeasured

    def is_unheard(self, step_unit_m: float) -> bool:
        """Return whether a walker may have left though hardly a step is counted."""
        return unheard.is_in_doubt(self.pace, self.times, self.stepped_m, step_unit_m)

    def positioned(self, time_s: float) -> SensorWatch:
        """Return the watch after a position was measured and used.

        Of slow steps before it nothing remains to be shown. A counter that stands still stays in
        doubt: the next position may be far away.
        """
        way = self.undirected.positioned()
        watch = self if way is self.undirected else self._replace(undirected=way)
        if watch.are_astray:
            watch = watch._replace(are_astray=False)
        if self.rest is None or not self.rest.measured_m > 0:
            return watch
        return watch.after_way(time_s)

    def contradicted(self) -> SensorWatch:
        """Return the watch after a position that contradicts the belief.

        While steps are as usual, the position is wrong, or the belief. Once they are fewer, it may
        be the counter.
        """
        is_usual = self.pace.rows > 0 and self.rest is None and not self.places.rows
        return self._replace(are_astray=True) if is_usual and not self.are_astray else self

    def carried(self) -> SensorWatch:
        """Return the watch of what goes on though no step is counted, as positions have shown.

        Those before do not show that it stands.
        """
        if self.rest is None:
            return self
        return self._replace(rest=self.rest.carried(), places=Places())

    def after_way(self, time_s: float) -> SensorWatch:
        """Return the watch after a measured way to a time."""
        return self._replace(moving_s=time_s, known_s=time_s, rest=None, unmeasured_s=0.0)


UNMEASURED = frozenset(
    {
        Reason.NO_STEP,
        Reason.IMPOSSIBLE_STEP,
        Reason.MOTION_MISSING,
        Reason.MOTION_STUCK,
        Reason.HEADING_STUCK,
    }
)
"""Reasons for which the way of an epoch is not known."""
