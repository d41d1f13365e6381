"""Fixes that a belief rejects, though they agree with each other and with the motion between them.

One fix that contradicts a belief is an outlier. Several in a row that lie as dead reckoning leads
from one to the next, turned by any angle, are a way: the belief may be wrong, or its headings are.
Where the way goes on from the fixes that the belief used before, they were not put elsewhere: a
spoofer, or a tram, makes a step in between that dead reckoning does not have.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf, radians, sqrt
from typing import NamedTuple

import numpy as np

from mapfilter._types import Bools, Floats
from mapfilter.positioning.bayes.beliefs.path import DeadReckoning
from mapfilter.positioning.epochs import GnssFix
from mapfilter.positioning.gnss.fixes import widened

_MOST_FIXES, _EARLIER, _LEAST_FIXES = 20, 4, 3
"""Fixes that are kept; those that were used before that are looked at; the least that agree."""
_APART_M, _APART_S, _LASTS_S = 5.0, 3.0, 300.0
"""Way or time between two fixes that are kept; time without any after which these begin anew."""
_LEAST_SD_M, _DEVIATIONS, _LEAST_SHARE = 5.0, 2.0, 0.7
"""Errors of fixes last for longer than their noise; within how many deviations those lie that
agree, and how many of them have to."""

_TURNED_RAD, _TURNED_SD, _MOST_SD_RAD = radians(45.0), 3.0, radians(10.0)
"""Smallest angle, also in deviations, by which a way is turned; largest deviation of a direction
that is known, turned or not."""


class TrailFix(NamedTuple):
    """A fix with the dead reckoning at its time; ``sd_m`` is along one axis."""

    time_s: float
    travelled_m: float
    way_east_m: float
    way_north_m: float
    east_m: float
    north_m: float
    sd_m: float
    rejected: bool


class Contradiction(NamedTuple):
    """Rejected fixes that agree with each other and with the motion between them.

    Parameters
    ----------
    turned_rad, sd_rad : float
        Angle by which dead reckoning has to be turned to lead from one to the next, as far as they
        tell, and its deviation.
    fixes : int
        How many rejected fixes agree.
    goes_on : bool
        Whether the way goes on from fixes that were used before.
    nats : float
        Log Bayes factor that they give an alternative which begins there.
    """

    turned_rad: float
    sd_rad: float
    fixes: int
    goes_on: bool
    nats: float = 0.0

    @property
    def has_direction(self) -> bool:
        """Whether they show a direction."""
        return self.sd_rad <= _MOST_SD_RAD

    @property
    def is_turned(self) -> bool:
        """Whether dead reckoning leads in another direction than they do."""
        return abs(self.turned_rad) > max(_TURNED_RAD, _TURNED_SD * self.sd_rad)


@dataclass(frozen=True, slots=True)
class FixTrail:
    """The last fixes that were compared with a belief.

    Parameters
    ----------
    rows : tuple of TrailFix
        Oldest first.
    contradiction : Contradiction or None
        Of the last of them; None while they agree with the belief, or not with each other.
    """

    rows: tuple[TrailFix, ...] = ()
    contradiction: Contradiction | None = None

    @property
    def contradicts(self) -> bool:
        """Whether the last fix contradicts the belief, with others."""
        return self.contradiction is not None and self.rows[-1].rejected

    def after(
        self,
        time_s: float,
        fix: GnssFix,
        reckoning: DeadReckoning,
        least_s: float,
        *,
        rejected: bool,
    ) -> FixTrail:
        """Return it after a fix.

        Parameters
        ----------
        time_s : float
        fix : GnssFix
        reckoning : DeadReckoning
            By headings as the belief reads them.
        least_s : float
            Time over which fixes have to be rejected.
        rejected : bool
            Whether the belief rejects the fix.
        """
        if self.rows:
            last = self.rows[-1]
            gone_m = reckoning.travelled_m - last.travelled_m
            if gone_m < _APART_M and time_s - last.time_s < _APART_S:
                return self
            # A receiver that holds its position has measured it once.
            if (fix.east_m, fix.north_m) == (last.east_m, last.north_m):
                return self
        wide = widened(fix, 1.0)
        sd_m = max(sqrt((wide.var_east_m2 + wide.var_north_m2) / 2), _LEAST_SD_M)
        way = reckoning.travelled_m, reckoning.east_m, reckoning.north_m
        row = TrailFix(time_s, *way, fix.east_m, fix.north_m, sd_m, rejected)
        kept = () if self.rows and time_s - self.rows[-1].time_s > _LASTS_S else self.rows
        rows = (*kept, row)[-_MOST_FIXES:]
        after = replace(self, rows=rows)
        first = _first_rejected(rows)
        if first == len(rows):
            return replace(after, contradiction=None)
        if not rejected:
            # One that agrees with the belief may be an outlier of the others.
            return after
        found, before = _contradiction(rows, first, least_s), self.contradiction
        if found is not None and before is not None and before.goes_on:
            # Dead reckoning errs more the farther it goes, and old rows fall out.
            found = found._replace(goes_on=True)
        return replace(after, contradiction=found)


def _first_rejected(rows: tuple[TrailFix, ...]) -> int:
    """Return the first of the rejected fixes at the end; two that are used in a row end them."""
    first, used = len(rows), 0
    for index in range(len(rows) - 1, -1, -1):
        used = 0 if rows[index].rejected else used + 1
        if used == 2:
            break
        if rows[index].rejected:
            first = index
    return first


def _contradiction(rows: tuple[TrailFix, ...], first: int, least_s: float) -> Contradiction | None:
    """Return what the rejected fixes from ``first`` on show."""
    given = np.array(rows[first:])
    rejected = given[given[:, -1] > 0]
    # Where as many agree with the belief they are of two kinds, and it is right for one.
    if len(rejected) < max(2.0, _LEAST_SHARE * len(given)):
        return None
    used = [one for one in rows[:first] if not one.rejected]
    earlier = np.array(used[-_EARLIER:]).reshape(-1, given.shape[1])
    whole = _Way.through(np.concatenate([earlier, rejected])) if len(earlier) else None
    goes_on = whole is not None and bool(whole.agree[: len(earlier)].sum() >= min(2, len(earlier)))
    if whole is not None and goes_on:
        fixes = int(whole.agree[len(earlier) :].sum())
        found = Contradiction(whole.turned_rad, whole.sd_rad, fixes, goes_on)
        # Outliers do not lie on a way that is turned.
        if found.is_turned and found.has_direction and fixes >= 2:
            return found
    own = _Way.through(rejected) if len(rejected) >= _LEAST_FIXES else None
    if own is None or rejected[-1, 0] - rejected[0, 0] < least_s:
        return None
    way = whole if whole is not None and goes_on else own
    return Contradiction(way.turned_rad, way.sd_rad, int(own.agree.sum()), goes_on)


class _Way(NamedTuple):
    """Dead reckoning moved and turned so that it leads through fixes."""

    turned_rad: float
    sd_rad: float
    agree: Bools

    @classmethod
    def through(cls, rows: Floats) -> _Way | None:
        """Return the way through fixes by least squares, the worst left out; None if none is."""
        # From the last fix: squares of coordinates of a country lose digits.
        way = rows[:, 2] + 1j * rows[:, 3] - (rows[-1, 2] + 1j * rows[-1, 3])
        fix = rows[:, 4] + 1j * rows[:, 5] - (rows[-1, 4] + 1j * rows[-1, 5])
        sd_m, agree = rows[:, 6], np.ones(len(rows), dtype=np.bool_)
        while True:
            weight = agree / sd_m**2
            total = weight.sum()
            off_way = way - (weight * way).sum() / total
            off_fix = fix - (weight * fix).sum() / total
            cross = (weight * np.conj(off_way) * off_fix).sum()
            turn = cross / abs(cross) if abs(cross) > 0 else 1.0
            left = np.where(agree, np.abs(off_fix - turn * off_way) / sd_m, 0.0)
            if left.max() <= _DEVIATIONS:
                break
            agree[np.argmax(left)] = False
            if agree.mean() < _LEAST_SHARE or agree.sum() < _LEAST_FIXES:
                return None
        spread = float((weight * np.abs(off_way) ** 2).sum())
        return cls(float(np.angle(turn)), 1 / sqrt(spread) if spread > 0 else inf, agree)
