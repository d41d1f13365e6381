"""A fix in a Kalman-type filter: what its errors are, what it means, and the belief after it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import nan
from typing import NamedTuple

import numpy as np

from mapfilter._types import Floats
from mapfilter.filters.gaussian import Method
from mapfilter.models.ranging import position_fix
from mapfilter.models.state import MOVING, StateLayout
from mapfilter.positioning.epochs import GnssFix
from mapfilter.positioning.kalman.belief import SumBelief
from mapfilter.positioning.kalman.disputed import Finding, FixRecord, Ruling
from mapfilter.positioning.kalman.lasting import Motion, fix_layout, rescaled, white_part
from mapfilter.positioning.kalman.models import KalmanOptions, compiled
from mapfilter.positioning.kalman.readings import fix_covariance_m2
from mapfilter.positioning.kalman.reckoning import at_rest

_RECKONED_S, _MOVING_S = 30.0, 5.0
"""Time after which fixes that contradict a belief show it to be wrong: one with dead reckoning, and
one that knows but its velocity."""


class FixErrors(NamedTuple):
    """Errors of fixes: as they are in the belief, and as they have shown.

    Parameters
    ----------
    lasting_m : float
        Deviation along one axis of the error that lasts; 0 without one.
    record : FixRecord
        How well fixes have agreed with the belief.
    """

    lasting_m: float = 0.0
    record: FixRecord = FixRecord()

    def at_time(self, time_s: float) -> FixErrors:
        """Return them at a later time."""
        record = self.record.at_time(time_s)
        return self if record is self.record else self._replace(record=record)

    def after_a_jump(self) -> FixErrors:
        """Return them where what contradicted the belief has led it elsewhere."""
        return self._replace(record=replace(self.record, rows=()))


class WeighedFix(NamedTuple):
    """What a fix has led to.

    Parameters
    ----------
    belief : SumBelief
    errors : FixErrors
    motion : tuple of arrays
        By which the belief has gone on before it was updated.
    ruling : Ruling
    nis : float
        Its squared distance from the position predicted, in deviations and per component; NaN where
        it was not updated, or by an outlier.
    used : bool
        Whether the fix is in the belief.
    """

    belief: SumBelief
    errors: FixErrors
    motion: Motion
    ruling: Ruling
    nis: float
    used: bool


@dataclass(frozen=True)
class FixWeighing:
    """How fixes are weighed in a state.

    Parameters
    ----------
    options : KalmanOptions
    own : StateLayout
        Position and velocity, or position and errors of dead reckoning.
    layout : StateLayout
        The same, and errors that last behind it.
    method : Method
    compared : int
        Components by which parts of a belief are the same.
    """

    options: KalmanOptions
    own: StateLayout
    layout: StateLayout
    method: Method
    compared: int

    @property
    def _lasts(self) -> bool:
        return self.options.has_lasting_fixes

    def weighed(
        self, belief: SumBelief, errors: FixErrors, fix: GnssFix, time_s: float, *, rests: bool
    ) -> WeighedFix:
        """Return what a fix leads to; ``rests`` is whether steps say that one stands."""
        own, record = self.own, errors.record
        stated = fix_covariance_m2(fix, self.options.fix_sd_m)
        noise = stated * record.understated
        motion, layout, white, lasting_m = at_rest(self.layout), self.layout, noise, 0.0
        if self._lasts:
            lasting_m = self.options.lasting_fix_m(float(np.trace(noise)) / 2)
            motion = rescaled(own, self.layout.size, errors.lasting_m, lasting_m)
            belief, white = belief.predict(*motion), white_part(noise, lasting_m)
            layout = fix_layout(layout, own.size)
        found: Finding | None = None
        # Of a belief in many parts each has its own prediction.
        if belief.weights.size == 1:
            moments, where = belief.moments, [own.east, own.north]
            off_m = np.array([fix.east_m, fix.north_m]) - moments.mean[where]
            record, found = record.at_fix(
                (time_s, off_m, moments.covariance[np.ix_(where, where)], stated),
                _MOVING_S if own is MOVING else _RECKONED_S,
                rests=rests,
            )
            if found.ruling.begins:
                either_m2 = np.outer(off_m, off_m) if found.ruling is Ruling.EITHER else 0.0
                motion = self._begun(fix, white + either_m2, lasting_m)
                errors = FixErrors(lasting_m, record)
                return WeighedFix(belief.predict(*motion), errors, motion, found.ruling, nan, True)
            if found.ruling is Ruling.OUTLIER and own is not MOVING:
                errors = FixErrors(lasting_m, record)
                return WeighedFix(belief, errors, motion, found.ruling, nan, False)
            white = white + (found.larger - 1) * noise
        model = compiled(position_fix(layout, white))
        place = [fix.east_m, fix.north_m]
        belief, info = belief.update(model, place, self.method, self.compared)
        found = found or Finding(Ruling.AGREES, info.nis / 2)
        nis = found.squared if info.used and found.ruling is Ruling.AGREES else nan
        errors = FixErrors(lasting_m, record)
        return WeighedFix(belief, errors, motion, found.ruling, nis, info.used)

    def _begun(self, fix: GnssFix, white_m2: Floats, lasting_m: float) -> Motion:
        """Return the motion to a fix that a belief begins at.

        The place that fixes are of is the fix less white noise, and the position is that less what
        lasts. A velocity is unknown again.
        """
        transition, noise, shift = at_rest(self.layout)
        own = [self.own.east, self.own.north]
        places = [own, [self.own.size, self.own.size + 1]] if self._lasts else [own]
        for place in places:
            transition[place] = 0.0
            shift[place] = fix.east_m, fix.north_m
            for other in places:
                noise[np.ix_(place, other)] = white_m2
        noise[own, own] += lasting_m**2
        if self.own is MOVING:
            velocity = list(self.own.velocity)
            transition[velocity] = 0.0
            noise[velocity, velocity] = self.options.speed_sd_mps**2
        return transition, noise, shift
