"""Errors of fixes in a Kalman-type filter: as they are in the belief, and as they have shown."""

from __future__ import annotations

from dataclasses import replace
from math import hypot, nan, sqrt
from typing import NamedTuple

from mapfilter._types import Floats
from mapfilter.positioning.epochs import GnssFix
from mapfilter.positioning.gnss.wander import FixWander, Way
from mapfilter.positioning.kalman.coasting import Coasting
from mapfilter.positioning.kalman.disputed import FixRecord
from mapfilter.positioning.kalman.lasting import Motion
from mapfilter.positioning.kalman.models import KalmanOptions
from mapfilter.positioning.kalman.proof import Doubt, usual_mps, way_agrees
from mapfilter.positioning.kalman.turned import Lasting

_PROVEN_S, _PROVEN_FIXES = 120.0, 10
"""Time for which fixes agree with a belief, and how many of them, that show it to be right whatever
the way."""

_BETWEEN_HOUSES_S = 60.0
"""Time after which the correlation of errors that last is 1/e, where fixes understate them."""


class FixErrors(NamedTuple):
    """Errors of fixes: as they are in the belief, and as they have shown.

    Parameters
    ----------
    lasting_m : float
        Deviation along one axis of the error that lasts; 0 without one.
    record : FixRecord
        How well fixes have agreed with the belief.
    fixed_s : float
        Time of the last fix; NaN before the first.
    wander : FixWander
        How far fixes have wandered beside dead reckoning.
    way, fixed_way : Way
        Where that has led, by headings as they were measured: now, and at the last fix.
    doubt : Doubt
        Whether the belief is claimed before fixes and steps have agreed on the way.
    doubted_s : float
        Time of the last fix that was used while there was no doubt; NaN before the first.
    coasting : Coasting
        Beliefs without the last fixes, where there is dead reckoning.
    """

    lasting_m: float = 0.0
    record: FixRecord = FixRecord()
    fixed_s: float = nan
    wander: FixWander = FixWander()
    way: Way = Way()
    fixed_way: Way = Way()
    doubt: Doubt = Doubt.NONE
    doubted_s: float = nan
    coasting: Coasting = Coasting()

    @property
    def understated(self) -> float:
        """Times that variances of fixes are taken for larger than stated."""
        times = self.record.understated, self.wander.now.understated, self.coasting.times
        return max(times)

    def lasting_s(self, usual_s: float) -> float:
        """Return the time for which errors last: those between houses do for longer."""
        return usual_s if self.coasting.times == 1 else max(usual_s, _BETWEEN_HOUSES_S)

    @property
    def gone_m(self) -> float:
        """How far dead reckoning has led since the last fix."""
        before = self.fixed_way
        return hypot(self.way.east_m - before.east_m, self.way.north_m - before.north_m)

    def moved(self, east_m: float, north_m: float, gaps: int) -> FixErrors:
        """Return them after dead reckoning, of which rows may have no direction or length."""
        east_m, north_m = self.way.east_m + east_m, self.way.north_m + north_m
        return self._replace(way=Way(east_m, north_m, self.way.gaps + gaps))

    def coasted(self, motion: Motion, about: Floats, gaps: int) -> FixErrors:
        """Return them after motion of dead reckoning, linear about a mean.

        Steps without direction or length, of which there are ``gaps``, lead to no place that fixes
        could contradict.
        """
        coasting = self.coasting.begun_anew() if gaps else self.coasting.moved(motion, about)
        return self if coasting is self.coasting else self._replace(coasting=coasting)

    def at_time(self, time_s: float) -> FixErrors:
        """Return them at a later time."""
        record = self.record.at_time(time_s)
        return self if record is self.record else self._replace(record=record)

    def lasting(self, variance_m2: float, options: KalmanOptions) -> Lasting:
        """Return what lasts of the error of a fix with a variance along one axis."""
        beyond_m = max(self.wander.before.beyond_m(variance_m2), options.fix_lasting_m)
        beyond_m = max(beyond_m, sqrt((self.coasting.times - 1) * variance_m2))
        usual_m = 0.0 if options.fix_lasting_m else options.lasting_fix_m(variance_m2)
        return Lasting(usual_m, beyond_m, options.fix_lasting_s)

    def led(self) -> FixErrors:
        """Return them where they lead another way than steps, by any angle."""
        return self._replace(doubt=Doubt.UNTIL_PROVEN, wander=self.wander.broken_off())

    def after_a_jump(self) -> FixErrors:
        """Return them where what contradicted the belief has led it elsewhere."""
        # Fixes that lead away along a street look like a turned phone up to the next corner.
        leads = self.coasting.is_held
        doubt = Doubt.UNTIL_PROVEN if leads else max(self.doubt, Doubt.IF_CONTRADICTED)
        record, wander = replace(self.record, rows=()), self.wander.broken_off()
        coasting = self.coasting.begun_anew()
        return self._replace(record=record, wander=wander, doubt=doubt, coasting=coasting)

    def after_fix(self, lasting_m: float, record: FixRecord, time_s: float) -> FixErrors:
        """Return them after a fix."""
        return self._replace(lasting_m=lasting_m, record=record, fixed_s=time_s, fixed_way=self.way)

    def wandered(
        self, fix: GnssFix, variance_m2: float, time_s: float, turns: tuple[float, float]
    ) -> FixErrors:
        """Return them after a fix that agreed, by the lasting error and the drift of turns."""
        place = fix.east_m, fix.north_m
        wander = self.wander.at_fix(time_s, self.way, place, variance_m2, *turns)
        return self._replace(wander=wander)

    def proven(self, time_s: float, lasting_s: float) -> FixErrors:
        """Return them after a fix that agreed: whether steps have led the same way since."""
        is_held = self.coasting.is_held
        if self.doubt is Doubt.NONE and not is_held:
            return self._replace(doubted_s=time_s)
        agrees = way_agrees(self.wander.rows, self.understated, lasting_s)
        after = self
        if is_held and self.wander.rows:
            mps = usual_mps(self.wander.rows)
            after = self._replace(coasting=self.coasting.along(time_s, agrees, mps))
        if self.doubt is Doubt.NONE:
            return after._replace(doubted_s=time_s)
        lasted_s = time_s - max(self.doubted_s, self.record.agreed_from_s)
        if lasted_s >= _PROVEN_S and self.record.agreed >= _PROVEN_FIXES:
            agrees = True
        return after._replace(doubt=self.doubt.after(agrees))
