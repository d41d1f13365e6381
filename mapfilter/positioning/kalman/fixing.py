"""A fix in a Kalman-type filter: what it means, and the belief after it."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from math import exp, isfinite, nan, radians, sqrt
from typing import NamedTuple

import numpy as np

from mapfilter._types import Floats
from mapfilter.filters.gaussian import Gaussian, Method
from mapfilter.models.motion import constant_velocity
from mapfilter.models.ranging import position_fix
from mapfilter.models.state import MOVING, StateLayout
from mapfilter.positioning.epochs import GnssFix
from mapfilter.positioning.gnss.wander import FixWander
from mapfilter.positioning.kalman.belief import SumBelief
from mapfilter.positioning.kalman.coasting import Coasting
from mapfilter.positioning.kalman.disputed import (
    ComparedFix,
    FixRecord,
    FixVerdict,
    Patience,
    Ruling,
    contradicts,
)
from mapfilter.positioning.kalman.fix_errors import FixErrors
from mapfilter.positioning.kalman.lasting import Motion, fix_layout, rescaled, white_part
from mapfilter.positioning.kalman.models import KalmanOptions, compiled
from mapfilter.positioning.kalman.proof import Doubt
from mapfilter.positioning.kalman.readings import fix_covariance_m2
from mapfilter.positioning.kalman.reckoning import RATE, after_each_other, at_rest

_RECKONED, _MOVING = Patience(30.0, 120.0), Patience(5.0, 5.0)
"""With dead reckoning, and where but a velocity is known."""
_UNSEEN_S = 20.0
"""Time without a fix after which one that contradicts the belief is as likely to be right."""
_SETTLED, _DOUBTFUL = 10, 60
"""Fixes that agreed with a belief, from which on it goes on without them, too; of one in doubt."""
_RETURNED = 3
"""Fixes in a row that contradict a belief, and agree with one that is older than what it has
followed, from which on they are right."""
_FREER_MPS_PER_SQRT_S = 4.0
"""Random walk of the speed of a vehicle that brakes and turns: some 1.3 m/s² for 5 s."""
_SHARE = 0.5
"""Deviation of where it then is from where its velocity leads, as a share of that way."""


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
    drifted : bool
        Whether the belief has begun anew after fixes that had left it by and by.
    """

    belief: SumBelief
    errors: FixErrors
    motion: Motion
    ruling: Ruling
    nis: float
    used: bool
    drifted: bool = False


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
        self,
        belief: SumBelief,
        errors: FixErrors,
        fix: GnssFix,
        time_s: float,
        *,
        drift_deg_per_sqrt_m: float,
        rests_since_s: float = nan,
        is_doubted: bool = False,
        astray_m2: float = 0.0,
    ) -> WeighedFix:
        """Return what a fix leads to.

        Parameters
        ----------
        belief : SumBelief
        errors : FixErrors
        fix : GnssFix
        time_s : float
        drift_deg_per_sqrt_m : float
            Assumed random walk of headings.
        rests_since_s : float
            Time since which steps say that one stands; NaN where they do not.
        is_doubted : bool
            Whether the belief may be wrong by what is known before the fix.
        astray_m2 : float
            Variance along one axis of what it may lag behind besides.
        """
        own, record, rests = self.own, errors.record, isfinite(rests_since_s)
        stated = fix_covariance_m2(fix, self.options.fix_sd_m)
        place_m = np.array([fix.east_m, fix.north_m])
        noise = stated * errors.understated
        motion, layout, white, lasting_m = at_rest(self.layout), self.layout, noise, 0.0
        wanted_m = 0.0
        if self._lasts:
            wanted_m = self.options.lasting_fix_m(float(np.trace(noise)) / 2)
            wanted_m = max(wanted_m, errors.wander.now.lasting_m(float(np.trace(stated)) / 2))
            lasting_m = self._lasting_m(errors, wanted_m, time_s)
            motion = rescaled(own, self.layout.size, errors.lasting_m, lasting_m)
            belief, white = belief.predict(*motion), white_part(noise, lasting_m)
            layout = fix_layout(layout, own.size)
        found: FixVerdict | None = None
        # Of a belief in many parts each has its own prediction.
        if belief.weights.size == 1:
            moments, where = belief.moments, [own.east, own.north]
            off_m = np.array([fix.east_m, fix.north_m]) - moments.mean[where]
            freer = self._freer(
                moments, off_m, stated * record.understated, time_s - errors.fixed_s
            )
            if freer is not None:
                belief, motion = belief.predict(*freer), after_each_other(motion, freer)
                moments = belief.moments
            record, found = record.at_fix(
                ComparedFix(
                    time_s,
                    off_m,
                    moments.covariance[np.ix_(where, where)],
                    stated * errors.coasting.times,
                    rests,
                    is_doubted or time_s - errors.fixed_s > _UNSEEN_S,
                    errors.gone_m,
                ),
                _MOVING if own is MOVING else _RECKONED,
            )
            # Steps that say rest, or that may be missing, contradict nothing.
            if own is not MOVING and not rests and not is_doubted:
                coasting, given = errors.coasting, (time_s, place_m, stated)
                if found.ruling in (Ruling.AGREES, Ruling.EITHER):
                    own_belief, since_s = self._own(belief), time_s - errors.fixed_s
                    coasting = coasting.compared(*given, own_belief, since_s)
                else:
                    coasting = coasting.again(*given)
                if coasting.is_back and found.ruling is Ruling.AGREES:
                    # They have come back by and by: errors that change, and no spoofer.
                    coasting = coasting.broken_off()
                elif coasting.is_back and len(record.rows) != 1:
                    if coasting.is_known(place_m, stated, moments.mean[where]):
                        onto = self._regained(coasting, lasting_m)
                        belief, motion = belief.predict(*onto), after_each_other(motion, onto)
                        record, found = FixRecord(), FixVerdict(Ruling.AGREES, nan)
                        errors = errors._replace(wander=FixWander(), doubt=Doubt.NONE)
                    elif len(record.rows) >= _RETURNED:
                        record, found = record.anew(), FixVerdict(Ruling.ANEW, found.squared)
                    if found.ruling is not Ruling.OUTLIER:
                        coasting = coasting.regained()
                errors = errors._replace(coasting=coasting)
            elif found.ruling.begins:
                errors = errors._replace(coasting=errors.coasting.begun_anew())
            if found.ruling.begins:
                white = white_part(noise, wanted_m) if self._lasts else noise
                # Of two places that are as likely as each other the middle, out to both.
                back_m = off_m / 2 if found.ruling is Ruling.EITHER else np.zeros(2)
                white = white + np.outer(back_m, back_m)
                motion = self._begun((fix.east_m, fix.north_m) - back_m, white, wanted_m)
                # What was learnt beside a belief that was wrong is no more than that.
                errors = errors.after_fix(wanted_m, record, time_s)._replace(wander=FixWander())
                if found.ruling is Ruling.ANEW and own is not MOVING:
                    errors = errors._replace(doubt=Doubt.UNTIL_PROVEN)
                led = found.drifted or found.ruling is Ruling.EITHER
                if not led and found.ruling is not Ruling.CARRIED:
                    errors = errors._replace(coasting=errors.coasting.broken_off())
                belief = belief.predict(*motion)
                return WeighedFix(
                    belief, errors, motion, found.ruling, nan, True, drifted=found.drifted
                )
            if found.ruling is Ruling.OUTLIER and own is not MOVING:
                errors = errors.after_fix(lasting_m, record, time_s)
                return WeighedFix(belief, errors, motion, found.ruling, nan, False)
            white = white + (found.larger - 1) * noise
        if astray_m2:
            lag = at_rest(self.layout)
            for one, other in product(self._places, repeat=2):
                lag[1][one, other] = astray_m2
            belief, motion = belief.predict(*lag), after_each_other(motion, lag)
        model = compiled(position_fix(layout, white))
        place = [fix.east_m, fix.north_m]
        belief, info = belief.update(model, place, self.method, self.compared)
        found = found or FixVerdict(Ruling.AGREES, info.nis / 2)
        nis = found.squared if info.used and found.ruling is Ruling.AGREES else nan
        errors = errors.after_fix(lasting_m, record, time_s)
        if rests:
            errors = errors._replace(wander=errors.wander.rested(time_s, rests_since_s))
        elif own is not MOVING:
            turns = float(belief.moments.mean[RATE]), radians(drift_deg_per_sqrt_m)
            errors = errors.wandered(fix, float(np.trace(stated)) / 2, time_s, turns)
        errors = errors.proven(time_s, self.options.fix_lasting_s)
        if self._coasts(errors) and not rests:
            seen_m = belief.moments.mean[self._places[-1]] if self._lasts else place_m
            coasting = errors.coasting.after_fix(time_s, seen_m, stated, self._own(belief))
            errors = errors._replace(coasting=coasting)
        return WeighedFix(belief, errors, motion, found.ruling, nis, info.used)

    def _coasts(self, errors: FixErrors) -> bool:
        """Return whether a belief is settled, and dead reckoning would go on with it alone."""
        needed = _SETTLED if errors.doubt is Doubt.NONE else _DOUBTFUL
        return self.own is not MOVING and errors.record.agreed >= needed

    def _own(self, belief: SumBelief) -> Gaussian:
        """Return a belief without what is behind position and errors of dead reckoning."""
        moments, size = belief.moments, self.own.size
        return Gaussian(moments.mean[:size], moments.covariance[:size, :size])

    def _regained(self, coasting: Coasting, lasting_m: float) -> Motion:
        """Return the motion to a belief without the last fixes, whose errors are unknown again."""
        coast, size = coasting.apart.coast, self.own.size
        if coast is None:
            raise AssertionError("regains with a belief")
        transition, noise, shift = at_rest(self.layout)
        both = list(range(size)) + (self._places[1] if self._lasts else [])
        of = np.eye(size)[[*range(size), *self._places[0][: len(both) - size]]]
        transition[both] = 0.0
        shift[both] = of @ coast.mean
        noise[np.ix_(both, both)] = of @ coast.covariance @ of.T
        if self._lasts:
            noise[self._places[1], self._places[1]] += lasting_m**2
        return transition, noise, shift

    def _freer(
        self, moments: Gaussian, off_m: Floats, noise_m2: Floats, elapsed_s: float
    ) -> Motion | None:
        """Return the motion by which a fix agrees that contradicts a constant velocity.

        None where it does not contradict it, or one that brakes and turns, too; or where steps tell
        the way. Seconds after the last fix one may be anywhere that an acceleration leads to.
        """
        if self.own is not MOVING or not elapsed_s > 0:
            return None
        own, size, where = self.own, self.own.size, [self.own.east, self.own.north]
        expected_m2 = moments.covariance[np.ix_(where, where)] + noise_m2
        if not contradicts(off_m, expected_m2):
            return None
        velocity = list(own.velocity)
        mean_mps, spread_mps2 = moments.mean[velocity], moments.covariance[velocity, velocity]
        speed_mps = sqrt(float(mean_mps @ mean_mps + spread_mps2.sum()))
        root = min(_FREER_MPS_PER_SQRT_S, _SHARE * speed_mps * sqrt(3 / elapsed_s))
        more = constant_velocity(elapsed_s, root, noise="continuous").noise
        if contradicts(off_m, expected_m2 + more[np.ix_(where, where)]):
            return None
        transition, noise, shift = at_rest(self.layout)
        moved = np.zeros((self.layout.size, size))
        moved[:size] = np.eye(size)
        for place in self._places:
            moved[place, where] = 1.0
        return transition, noise + moved @ more @ moved.T, shift

    @property
    def _places(self) -> list[list[int]]:
        """Components of the position, and of the place that fixes are of."""
        own, size = [self.own.east, self.own.north], self.own.size
        return [own, [size, size + 1]] if self._lasts else [own]

    def _lasting_m(self, errors: FixErrors, wanted_m: float, time_s: float) -> float:
        """Return B at a fix: smaller errors last less at once, larger ones come with time.

        What is stated in turn as 3 and 30 m is of two sources, and not of one that jumps.
        """
        before_m = errors.lasting_m
        if wanted_m <= before_m or not isfinite(errors.fixed_s):
            return wanted_m
        grown = 1 - exp(-2 * (time_s - errors.fixed_s) / self.options.fix_lasting_s)
        return sqrt(before_m**2 + grown * (wanted_m**2 - before_m**2))

    def _begun(self, place_m: Floats, white_m2: Floats, lasting_m: float) -> Motion:
        """Return the motion to the place of a fix that a belief begins at.

        The place that fixes are of is the fix less white noise, and the position is that less what
        lasts. A velocity is unknown again.
        """
        transition, noise, shift = at_rest(self.layout)
        for place, other in product(self._places, repeat=2):
            transition[place] = 0.0
            shift[place] = place_m
            noise[np.ix_(place, other)] = white_m2
        own = self._places[0]
        noise[own, own] += lasting_m**2
        if self.own is MOVING:
            velocity = list(self.own.velocity)
            transition[velocity] = 0.0
            noise[velocity, velocity] = self.options.speed_sd_mps**2
        return transition, noise, shift
