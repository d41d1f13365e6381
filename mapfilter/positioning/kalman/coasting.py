"""A belief without its fixes of late, beside the one that uses them: whether fixes lead away.

A spoofer leads fixes away so slowly that each agrees with a belief that has followed the one
before; a receiver that was jammed may come back beside the place. What contradicts them is where
dead reckoning has led from before: each half minute the belief is kept as it is, and goes on
without fixes (solution separation; Brown & McBurney 1988, and coasted inertial monitors,
Tanıl et al. 2018), but for their way (:mod:`mapfilter.positioning.kalman.coast`). For the speed u
by which fixes would be led, known with a covariance U at first and V by now,

    odds = o N(0; 0, U) / N(0; u, V);

o are prior odds, larger for a while after fixes had been missing. Steps may be wrong as well, with
the prior odds of usual fixes; so both beliefs stay as likely as each other where all of them
disagree. Fixes that the belief rejects are back where they are at the place of one that is held.

Distances of younger ones show by how much fixes understate what lasts of their errors
(:mod:`mapfilter.positioning.kalman.understated`).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import exp, isnan, log, nan
from typing import NamedTuple

import numpy as np

from mapfilter._same import EqualByValue
from mapfilter._types import Floats
from mapfilter.filters.gaussian import Gaussian
from mapfilter.positioning.kalman.coast import Coast
from mapfilter.positioning.kalman.lasting import Motion
from mapfilter.positioning.kalman.understated import Understated
from mapfilter.positioning.sensors.pace import WALKERS_MPS

_APART_S, _YOUNGEST_S, _OLDEST_S, _KEPT_S = 30.0, 55.0, 150.0, 600.0
"""Time between two beliefs that are kept, ages at which they are compared, and for how long one is
kept that contradicts fixes: spoofing ends some time, and steps that were wrong are right again."""
_HEARD_S = 15.0
"""Time between two fixes whose way is used, as errors of those in a row are much the same."""
_LED, _RETURNED, _RETURNS_S = 3e-3, 0.2, 90.0
"""Prior odds that fixes are wrong: usual ones, and ones that come back after a gap, which fade."""
_WALKED_S, _DRIVEN_S, _LOOKED_S = 30.0, 300.0, 180.0
"""Time for which fixes and steps have to agree on the way until both are right again: beside a
vehicle's way one that is led away by a walker's speed is hardly drawn out. Age of a belief without
fixes up to which such a way is mostly that of before."""
_BENT_RAD2, _UNKNOWN_RAD2 = 0.15**2, 0.5**2
"""Variance of the heading error from which on a belief is bent, and no normal one: it is not
compared then; from the other on one that was held shows nothing."""
_GAP_S, _LONGER = 20.0, 3.0
"""Time without a fix that is a gap, and how much longer than that between the last two it is."""
_WRONG_M2, _MOST_NATS = 60.0**2 * np.eye(2), 50.0
"""Covariance of wrong fixes, beside that of right ones, where a rejected one is looked at, and the
most that fixes say of both."""
_DOUBTED, _FAR_M = 0.2, 50.0
"""Probability of a belief without fixes, and its distance, from which on nothing is claimed."""
_REGAINED, _KNOWN = 6.0, 4.0
"""Squared distance of a fix from such a belief, in its deviations, with which it takes over; that
of another belief from the fix, in its variances."""
_LEAST, _AGREES = 0.01, 0.05
"""Probability below which such a belief is none, and that below which fixes agree with one that
they had contradicted."""


class Separation(NamedTuple):
    """A belief without fixes, and its probability."""

    probability: float = 0.0
    coast: Coast | None = None

    def leaves_too_little(self, place_m: Floats) -> bool:
        """Return whether it leaves too little to claim a place."""
        if self.coast is None or self.probability < _DOUBTED:
            return False
        return float(np.hypot(*(self.coast.mean[:2] - place_m))) > _FAR_M


@dataclass(frozen=True, slots=True, eq=False)
class Coasting(EqualByValue):
    """Beliefs without the last fixes.

    Parameters
    ----------
    kept : tuple of Coast
        From the oldest to the newest.
    times : float
        By which fixes are taken to understate the variance of what lasts of their errors.
    learnt : Understated
        What is known of that; it is not used while fixes may lead away.
    returned_s : float
        When fixes last came back after a gap; NaN where there was none.
    usual_s : float
        Time between the last two fixes.
    apart : Separation
        The belief without fixes that contradicts them most.
    is_held : bool
        Whether it has contradicted them so much that it stays until they agree with it again.
    agrees_s : float
        Since when fixes have lain where steps lead; NaN where they do not.
    is_met : bool
        Whether a fix that was not used agrees with the belief that is held.
    """

    kept: tuple[Coast, ...] = ()
    times: float = 1.0
    learnt: Understated = field(default_factory=Understated)
    returned_s: float = nan
    usual_s: float = 0.0
    apart: Separation = field(default_factory=Separation)
    is_held: bool = False
    agrees_s: float = nan
    is_met: bool = False

    def begun_anew(self) -> Coasting:
        """Return it where the belief begins anew as steps were wrong.

        So it seems, too, where fixes that lead away go on while one rests.
        """
        return self if self.is_held else self.broken_off()

    def broken_off(self) -> Coasting:
        """Return it where fixes and steps agree again."""
        return replace(self, kept=(), apart=Separation(), is_held=False, agrees_s=nan, is_met=False)

    def moved(self, motion: Motion, about: Floats) -> Coasting:
        """Return it after motion of dead reckoning, linear about a mean."""
        if not self.kept and self.apart.coast is None:
            return self
        apart, coast = self.apart, self.apart.coast
        if coast is not None:
            apart = apart._replace(coast=coast.moved(motion, about))
        return replace(self, kept=tuple(one.moved(motion, about) for one in self.kept), apart=apart)

    def compared(
        self,
        time_s: float,
        place_m: Floats,
        stated_m2: Floats,
        predicted: Gaussian,
        since_s: float,
    ) -> Coasting:
        """Return it at a fix.

        Parameters
        ----------
        time_s : float
        place_m : (2,) array
        stated_m2 : (2, 2) array
        predicted : Gaussian
            The belief before it, in the layout of dead reckoning.
        since_s : float
            Time since the fix before; NaN for the first.
        """
        kept, returned_s = self.kept, self.returned_s
        if since_s > max(_GAP_S, _LONGER * self.usual_s):
            returned_s = time_s
            kept = (*kept, Coast.of(time_s, predicted, self.times, place_m, is_aside=True))
        kept = tuple(one for one in kept if time_s - one.begun_s <= _OLDEST_S)
        usual_s = since_s if since_s > 0 else self.usual_s
        after = replace(self, returned_s=returned_s, usual_s=usual_s, is_met=False)
        held = self.apart.coast if self.is_held else None
        if held is not None:
            is_over = time_s - held.begun_s > _KEPT_S or held.heading_rad2 > _UNKNOWN_RAD2
            if is_over:
                return after.broken_off()
        most, later = Separation(), []
        for one in (held,) if held is not None else kept:
            found = after._apart(one, (time_s, place_m, stated_m2), is_held=one is held)
            later.append(found.coast or one)
            most = max(most, found, key=lambda one: one.probability)
        after = replace(after, kept=kept if held is not None else tuple(later))
        is_held = self.is_held or most.probability >= _DOUBTED
        most = most if is_held or most.probability >= _LEAST else Separation()
        return replace(after, apart=most, is_held=is_held)

    def _apart(self, one: Coast, fix: tuple[float, Floats, Floats], *, is_held: bool) -> Separation:
        """Return a belief after a fix that was used, with its probability."""
        time_s = fix[0]
        is_return = one.begun_s == self.returned_s
        is_young = time_s - one.begun_s < _YOUNGEST_S
        if not (is_return or is_held) and (is_young or one.heading_rad2 > _BENT_RAD2):
            return Separation()
        after = one.heard(*fix)
        probability = _probability(after.nats, self._prior(one, time_s))
        is_next = time_s - one.heard_s >= _HEARD_S and not one.is_beyond(*fix)
        return Separation(probability, after if is_next else one)

    def again(self, time_s: float, place_m: Floats, stated_m2: Floats) -> Coasting:
        """Return it at a fix that is not used: whether that agrees with what they contradicted."""
        if not self.is_held or self.apart.coast is None:
            return self
        prior = self._prior(self.apart.coast, time_s)
        off_m, right_m2 = self.apart.coast.off(place_m, stated_m2)
        nats = _log_density(off_m, right_m2 + _WRONG_M2) - _log_density(off_m, right_m2)
        return replace(self, is_met=_probability(nats, prior) < _AGREES)

    def _prior(self, one: Coast, time_s: float) -> float:
        """Return the odds that fixes are wrong by what a belief without them is older than."""
        if not one.begun_s <= self.returned_s:
            return _LED
        return _LED + _RETURNED * exp((self.returned_s - time_s) / _RETURNS_S)

    def after_fix(
        self, time_s: float, seen_m: Floats, stated_m2: Floats, belief: Gaussian
    ) -> Coasting:
        """Return it after a fix that was used.

        Parameters
        ----------
        time_s : float
        seen_m : (2,) array
            The place that fixes are of, without their white noise.
        stated_m2 : (2, 2) array
        belief : Gaussian
            With the fix, in the layout of dead reckoning.
        """
        usual = (one for one in self.kept if not one.is_aside)
        learnt = self.learnt.at_fix(time_s, seen_m, stated_m2, usual)
        after = replace(self, learnt=learnt, times=self.times if self.is_held else learnt.times)
        if self.kept and time_s - self.kept[-1].begun_s < _APART_S:
            return after
        return replace(after, kept=(*self.kept, Coast.of(time_s, belief, after.times, seen_m)))

    def along(self, time_s: float, agrees: bool | None, mps: float) -> Coasting:
        """Return it after a fix, by whether fixes lie where steps lead, turned by some angle.

        Parameters
        ----------
        time_s : float
        agrees : bool or None
            None where it cannot be told.
        mps : float
            The usual speed.
        """
        if not self.is_held or self.apart.coast is None or agrees is None:
            return self
        if not agrees or time_s - self.apart.coast.begun_s < _LOOKED_S:
            return replace(self, agrees_s=nan)
        since_s = time_s if isnan(self.agrees_s) else self.agrees_s
        if time_s - since_s >= (_DRIVEN_S if mps > WALKERS_MPS else _WALKED_S):
            return self.broken_off()
        return replace(self, agrees_s=since_s)

    def regained(self) -> Coasting:
        """Return it where the belief without fixes has taken over: what was learnt was wrong."""
        times = self.times if self.apart.coast is None else self.apart.coast.times
        return replace(self.broken_off(), learnt=Understated(), times=times)

    @property
    def is_back(self) -> bool:
        """Whether fixes agree again with a belief without them that they had contradicted."""
        return self.is_held and (self.is_met or self.apart.probability < _AGREES)

    def is_known(self, place_m: Floats, stated_m2: Floats, other_m: Floats) -> bool:
        """Return whether that belief is at a fix, and so well known that another place is not."""
        if self.apart.coast is None:
            return False
        off_m, right_m2 = self.apart.coast.off(place_m, stated_m2)
        apart_m = float(np.hypot(*(other_m - place_m)))
        known = apart_m**2 > _KNOWN * float(np.trace(right_m2))
        return known and float(off_m @ np.linalg.solve(right_m2, off_m)) <= _REGAINED


def _probability(nats: float, prior: float) -> float:
    """Return the probability that a belief without fixes is right, and they are not."""
    ratio = exp(min(nats, _MOST_NATS))
    # Steps that were wrong are as likely as usual fixes that are.
    return prior * ratio / (1 + (prior + _LED) * ratio)


def _log_density(off_m: Floats, covariance_m2: Floats) -> float:
    """Return the logarithm of a normal density of two coordinates, but for a constant."""
    east_m, north_m = off_m.tolist()
    (east_m2, cross_m2), (_, north_m2) = covariance_m2.tolist()
    volume = east_m2 * north_m2 - cross_m2**2
    squared = north_m2 * east_m**2 - 2 * cross_m2 * east_m * north_m + east_m2 * north_m**2
    return float(-0.5 * squared / volume - 0.5 * log(volume))
