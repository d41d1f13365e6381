"""Fixes that contradict the belief: a few of them are outliers, many that agree are right.

A fix farther from the prediction than both may be off is an outlier, and not used where steps tell
the way: so a burst of positions that walls reflect does not move what they tell. Without steps
nothing else does, and its variance is raised until it is at the limit, as a heavy tail would have
it (Huber 1964). Where fixes go on to contradict it, and lie on one line or a smooth way beside it,
the belief is what is wrong, and begins anew with them. Where a belief has just begun with a fix, or
is in doubt, which of the two is right is not known, and it comes to cover both. Where steps say
rest and fixes go on, as on a tram or beside a dead odometer, the way was not measured.

Fixes that are off more often than their deviations say are less precise than they state. How often
that is so is followed, and their variances are raised by it (innovation-based estimation; Mehra
1970).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from math import hypot, nan, sqrt
from typing import NamedTuple

import numpy as np

from mapfilter._same import EqualByValue
from mapfilter._types import Floats
from mapfilter.positioning.kalman.stretches import LEAST_FIX_SD_M

_LIMIT = 13.8
"""Squared distance in deviations of the prediction that one in a thousand fixes exceeds."""
_MEMORY, _SHOWN, _MOST = 20.0, 1.5, 9.0
"""Fixes over which their precision is followed; times that squared distances are larger than stated
from which on variances are raised, and the most by which they are."""
_YOUNG = 3
"""Fixes that agreed with it, below which a belief has just begun."""
_LOST_FROM, _LOST_AFTER, _SETTLED = 3, 2, 10
"""Fixes in a row that contradict it, from which on a position is lost; how often it begins anew
until it is, as steps are wrong, and fixes that agree after which it is settled."""
_FORGOTTEN_S, _BURST_S, _TRUSTED = 60.0, 15.0, 30
"""Time without a further fix after which those that contradicted it are taken for outliers, for how
long they may have done so, and how many have to have agreed before."""
_FAR = 55.0
"""Squared distance beyond all that motion may have led astray, in deviations of the fix, from which
on it has jumped."""
_LEAST_ROWS, _FEWEST_ROWS = 5, 3
"""Fixes that show a belief to be wrong, and those that do where they are far apart in time."""
_MOVING_S, _MOVING_MPS, _SLOW_S, _SLOW_MPS = 5.0, 3.0, 10.0, 1.5
"""Times in which fixes that go on while steps say rest show it, and their least speeds."""
_MOST_MISFIT = 2.0
"""Largest mean square of fixes beside a line, in their variances."""


class Ruling(Enum):
    """What a fix means to a belief.

    ``AGREES``: it is as predicted. ``OUTLIER``: it is not. ``EITHER``: it or the belief, which has
    just begun, is wrong. ``ANEW``: the belief is wrong. ``CARRIED``: so it is, as fixes go on while
    steps say rest.
    """

    AGREES = "agrees"
    OUTLIER = "outlier"
    EITHER = "either"
    ANEW = "anew"
    CARRIED = "carried"

    @property
    def begins(self) -> bool:
        """Whether the belief begins anew at the fix."""
        return self in (Ruling.EITHER, Ruling.ANEW, Ruling.CARRIED)


class FixVerdict(NamedTuple):
    """What a fix means.

    Parameters
    ----------
    ruling : Ruling
    squared : float
        Its squared distance from the position predicted, in deviations and per component.
    larger : float
        Times that its variance is larger then.
    drifted : bool
        Whether those that show the belief to be wrong had left it by and by, without a jump.
    """

    ruling: Ruling
    squared: float
    larger: float = 1.0
    drifted: bool = False


class Patience(NamedTuple):
    """Time after which fixes that contradict a belief show it to be wrong.

    Parameters
    ----------
    usual_s : float
    jumped_s : float
        Where they had agreed for so long and then jumped: motion does not lead astray at once, as a
        spoofer or a wall does. Where they had agreed for less, so long.
    """

    usual_s: float
    jumped_s: float


class ComparedFix(NamedTuple):
    """A fix beside the prediction.

    Parameters
    ----------
    time_s : float
    off_m : (2,) array
        The fix less the position predicted.
    predicted_m2, stated_m2 : (2, 2) array
        Covariances of both, of the fix as stated.
    rests : bool
        Whether steps say that one stands.
    is_doubted : bool
        Whether the prediction is in doubt anyway.
    gone_m : float
        How far motion has led since the fix before.
    """

    time_s: float
    off_m: Floats
    predicted_m2: Floats
    stated_m2: Floats
    rests: bool
    is_doubted: bool
    gone_m: float


class _Row(NamedTuple):
    time_s: float
    off_east_m: float
    off_north_m: float
    variance_m2: float
    gone_m: float

    @property
    def has_jumped(self) -> bool:
        """Whether it is farther away than motion can have led astray since the fix before.

        That is twice its length, where headings are wrong by half a circle.
        """
        jump_m = hypot(self.off_east_m, self.off_north_m) - 2 * self.gone_m
        return jump_m >= sqrt(_FAR * self.variance_m2)


@dataclass(frozen=True, slots=True, eq=False)
class FixRecord(EqualByValue):
    """How well fixes have agreed with the belief.

    Parameters
    ----------
    excess : float
        Times that their squared distances have been larger than stated, of late.
    agreed : int
        Fixes that agreed since the belief began.
    agreed_from_s : float
        Time of the first of them.
    begun : int
        How often it has begun anew since ten fixes in a row agreed with it.
    rows : tuple of _Row
        The last ones in a row that did not: where they lay from the prediction.
    is_over : bool
        Whether these are taken for a burst of outliers that has ended.
    """

    excess: float = 1.0
    agreed: int = 0
    agreed_from_s: float = nan
    begun: int = 0
    rows: tuple[_Row, ...] = ()
    is_over: bool = False

    @property
    def understated(self) -> float:
        """Times that their variances are taken for larger than stated."""
        return self.excess if self.excess >= _SHOWN else 1.0

    @property
    def is_lost(self) -> bool:
        """Whether fixes contradict the belief, or what it is predicted by."""
        is_contradicted = len(self.rows) >= _LOST_FROM and not self.is_over
        return is_contradicted or self.begun >= _LOST_AFTER

    def at_time(self, time_s: float) -> FixRecord:
        """Return it at a later time."""
        if not self.rows or time_s - self.rows[-1].time_s <= _FORGOTTEN_S:
            return self
        is_burst = self.rows[-1].time_s - self.rows[0].time_s <= _BURST_S
        # They still count where the next fix contradicts the belief, too.
        return replace(self, is_over=True) if is_burst and self.agreed >= _TRUSTED else self

    def at_fix(self, fix: ComparedFix, patience: Patience) -> tuple[FixRecord, FixVerdict]:
        """Return it after a fix, and what the fix means.

        Parameters
        ----------
        fix : ComparedFix
        patience : Patience
            A belief that has begun anew before is given up sooner.
        """
        time_s, off_m, predicted_m2, stated_m2, *_, gone_m = fix
        noise_m2 = self.understated * stated_m2
        squared = _squared(off_m, predicted_m2 + noise_m2)
        if squared <= _LIMIT:
            found = _squared(off_m, predicted_m2 + stated_m2) / 2
            excess = self.excess + (min(found, _MOST) - self.excess) / _MEMORY
            # Fixes that leave a rest may be right: a lift, or a queue of cars.
            excess = min(excess, self.excess) if fix.rests else excess
            agreed = self.agreed + 1
            begun = self.begun if agreed < _SETTLED else 0
            from_s = self.agreed_from_s if self.agreed else time_s
            return FixRecord(excess, agreed, from_s, begun), FixVerdict(Ruling.AGREES, squared / 2)
        if fix.is_doubted:
            return replace(self, agreed=0, rows=()), FixVerdict(Ruling.EITHER, squared / 2)
        if self.agreed < _YOUNG:
            return self.anew(), FixVerdict(Ruling.EITHER, squared / 2)
        variance_m2 = max(float(np.trace(noise_m2)) / 2, LEAST_FIX_SD_M**2)
        rows = (*self.rows, _Row(time_s, float(off_m[0]), float(off_m[1]), variance_m2, gone_m))
        patience_s = patience.usual_s
        jumped = rows[0].has_jumped
        if jumped:
            agreed_s = rows[0].time_s - self.agreed_from_s
            patience_s = max(patience_s, min(agreed_s, patience.jumped_s))
        while time_s - rows[0].time_s > 2 * patience_s and len(rows) > _LEAST_ROWS:
            rows = rows[1:]
        patience_s /= 1 + min(self.begun, _LOST_AFTER)
        ruling = _ruling(np.array(rows), patience_s, rests=fix.rests)
        if ruling.begins:
            drifted = ruling is Ruling.ANEW and not jumped
            return self.anew(), FixVerdict(ruling, squared / 2, drifted=drifted)
        # So much larger that the fix is at the limit along the way to it.
        along = off_m / hypot(*off_m)
        own_m2 = float(along @ noise_m2 @ along)
        most_m2 = float(off_m @ off_m) / _LIMIT - float(along @ predicted_m2 @ along)
        larger = max(most_m2 / own_m2, 1.0)
        after = replace(self, rows=rows, is_over=False)
        return after, FixVerdict(ruling, squared / 2, larger)

    def anew(self) -> FixRecord:
        """Return it where the belief begins anew."""
        return FixRecord(self.excess, begun=self.begun + 1)


def contradicts(off_m: Floats, covariance_m2: Floats) -> bool:
    """Return whether a fix so far from its prediction is none of its covariance (2, 2)."""
    return _squared(off_m, covariance_m2) > _LIMIT


def _squared(off_m: Floats, covariance_m2: Floats) -> float:
    return float(off_m @ np.linalg.solve(covariance_m2, off_m))


def _ruling(rows: Floats, patience_s: float, *, rests: bool) -> Ruling:
    """Return what fixes in a row that contradict a belief mean."""
    time_s, off_m = rows[:, 0] - rows[:, 0].mean(), rows[:, 1:3]
    lasted_s = float(np.ptp(time_s))
    needed_s = _MOVING_S if rests else patience_s
    least = _LEAST_ROWS if lasted_s < 2 * needed_s else _FEWEST_ROWS
    if len(rows) < least or lasted_s < needed_s:
        return Ruling.OUTLIER
    beside_m = off_m - off_m.mean(axis=0)
    speed_mps = time_s @ beside_m / float(time_s @ time_s)
    beside_m = beside_m - np.outer(time_s, speed_mps)
    # Of both coordinates two are spent on the line.
    variance_m2 = float(rows[:, 3].mean())
    misfit = float((beside_m**2).sum()) / variance_m2 / (2 * len(rows) - 4)
    # Beside steps that do not turn a way has corners: it is smooth where second differences are
    # those of the fixes' errors, which are six times as large.
    bent_m = np.diff(off_m, n=2, axis=0)
    bent = float((bent_m**2).sum()) / variance_m2 / (12 * len(bent_m))
    if rests and len(rows) >= _LEAST_ROWS and _goes_on(off_m, lasted_s):
        return Ruling.CARRIED
    if min(misfit, bent) > _MOST_MISFIT:
        return Ruling.OUTLIER
    least_mps = _MOVING_MPS if lasted_s < _SLOW_S else _SLOW_MPS
    if rests and float(np.hypot(*speed_mps)) >= least_mps:
        return Ruling.CARRIED
    return Ruling.ANEW if lasted_s >= patience_s else Ruling.OUTLIER


def _goes_on(off_m: Floats, lasted_s: float) -> bool:
    """Return whether each of several fixes is farther along than the one before, as of a tram."""
    whole_m = off_m[-1] - off_m[0]
    gone_m = float(np.hypot(*whole_m))
    return gone_m >= _MOVING_MPS * lasted_s and bool((np.diff(off_m, axis=0) @ whole_m > 0).all())
