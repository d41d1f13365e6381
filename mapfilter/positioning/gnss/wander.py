"""How far fixes wander beside dead reckoning, in times of the variance that they state.

Between houses a receiver's error stays for a while, and changes slowly: fixes agree with each other
and with a belief that follows them, so that what they are off by in total is not seen one by one.
It is seen beside dead reckoning over one to three minutes. There the last fixes z are compared with
where steps have led, q, moved, turned, drawn out and bent by least squares, as complex numbers:

    z = p + a q + c ∫ t dq + w + b,

with white noise w and a first-order Gauss-Markov process b of a minute; c is a lasting error of the
rate of turns. The sums of squares of what is left, and of its second differences, are linear in the
variances of w and b and in that of a random walk of headings, which is assumed; the two equations
give both (estimation by moments).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import hypot, radians, sqrt
from typing import NamedTuple

import numpy as np

from mapfilter._types import Floats

_APART_S, _WINDOW_S, _LEAST_S, _LEAST_ROWS = 5.0, 180.0, 60.0, 8
"""Time between two fixes that are kept, and for which they are; time and number of those that are
looked at, at least."""
_LEAST_WAY_M = 20.0
"""Way from the first to the farthest of them, at least: what goes on while steps rest may be
right."""
_RESTS_S = 10.0
"""Time without a step from which on one rests."""
_BEFORE_S = 120.0
"""Time by which what was known is older than what may be of a jump of headings."""
_LASTS_S = 60.0
"""Time after which the correlation of the error that lasts is 1/e. Errors of receivers between
houses last for up to some minutes, and what lasts longer than this is found too small; filters that
take it for an error of half a minute believe fixes less, and no longer."""
_MEMORY_S, _PRIOR_S = 180.0, 120.0
"""Time over which the variances are followed, and that for which stated ones count before."""
_LEAST_M2 = 1.0
"""Least variance of a fix that is compared: no receiver states less of what lasts."""
_DRIFT_RAD = radians(0.3)
"""Random walk of headings per root metre, where none is given."""
_SHOWN, _MOST = 1.5, 9.0
"""Times that variances are larger than stated from which on they are raised, and the most by which
they are."""


class Way(NamedTuple):
    """Where steps have led, from anywhere and turned by any angle.

    ``gaps`` is how often some of it was not measured.
    """

    east_m: float = 0.0
    north_m: float = 0.0
    gaps: int = 0


class FoundErrors(NamedTuple):
    """Variances of errors of fixes, in times of what fixes state of all of them."""

    white: float = 1.0
    lasting: float = 0.0

    @property
    def understated(self) -> float:
        """Times that variances of fixes are taken for larger than stated."""
        times = self.white + self.lasting
        return times if times >= _SHOWN else 1.0

    def lasting_m(self, variance_m2: float) -> float:
        """Return the deviation of what lasts along one axis; 0 where fixes state enough.

        Parameters
        ----------
        variance_m2 : float
            That a fix states, along one axis.
        """
        return sqrt(self.lasting * variance_m2) if self.understated > 1 else 0.0

    def beyond_m(self, variance_m2: float) -> float:
        """Return the deviation of what lasts beyond all that a fix states."""
        return sqrt(max(self.lasting - 1.0, 0.0) * variance_m2)

    def towards(self, white: float, lasting: float, share: float) -> FoundErrors:
        """Return them after others were found, which count by a share."""
        most = share * _MOST / max(white + lasting, _MOST)
        kept = 1 - share
        return FoundErrors(kept * self.white + most * white, kept * self.lasting + most * lasting)


class WanderFix(NamedTuple):
    """A fix, and where steps had led; ``sd_m`` is as stated."""

    time_s: float
    way_east_m: float
    way_north_m: float
    gaps: int
    east_m: float
    north_m: float
    sd_m: float


@dataclass(frozen=True, slots=True)
class FixWander:
    """How far fixes have wandered of late.

    Parameters
    ----------
    rows : tuple of WanderFix
        The last ones.
    now, before : FoundErrors
        What is known of errors, and what was two minutes ago, before a jump of headings, or
        positions that began to lead away, could be in it.
    known : tuple of (float, float, float)
        What was known in between: time, and both variances.
    seen_s : float
        For how long that was looked at.
    """

    rows: tuple[WanderFix, ...] = ()
    now: FoundErrors = field(default_factory=FoundErrors)
    before: FoundErrors = field(default_factory=FoundErrors)
    known: tuple[tuple[float, float, float], ...] = ()
    seen_s: float = 0.0

    def broken_off(self) -> FixWander:
        """Return it where steps may not tell the way from one fix to the next."""
        return replace(self, rows=()) if self.rows else self

    def before_a_jump(self) -> FixWander:
        """Return it where headings have jumped: what was learnt since may be of the jump."""
        return replace(self, rows=(), now=self.before, known=())

    def rested(self, time_s: float, since_s: float) -> FixWander:
        """Return it at a fix while no step has been counted since a time.

        Rows of steps may be some seconds apart. Fixes that leave a rest may be right.
        """
        return self.broken_off() if time_s - since_s > _RESTS_S else self

    def at_fix(
        self,
        time_s: float,
        way: Way,
        place_m: tuple[float, float],
        variance_m2: float,
        rate_radps: float = 0.0,
        drift_rad_per_sqrt_m: float = _DRIFT_RAD,
    ) -> FixWander:
        """Return it after a fix.

        Parameters
        ----------
        time_s : float
        way : Way
            By its time.
        place_m : (float, float)
            East and north of the fix.
        variance_m2 : float
            That the fix states, along one axis.
        rate_radps : float
            Lasting error of the rate of turns by which steps lead, as far as it is known.
        drift_rad_per_sqrt_m : float
            Assumed random walk of headings.
        """
        since_s = time_s - self.rows[-1].time_s if self.rows else 0.0
        if self.rows and since_s < _APART_S:
            return self
        row = WanderFix(time_s, *way, *place_m, sqrt(max(variance_m2, _LEAST_M2)))
        begin_s = time_s - _WINDOW_S
        kept = (one for one in self.rows if one.time_s >= begin_s and one.gaps == way.gaps)
        rows = (*kept, row)
        span_s = time_s - rows[0].time_s
        after = replace(self._known_at(time_s), rows=rows)
        if span_s < _LEAST_S or len(rows) < _LEAST_ROWS:
            return after
        away_m = (hypot(way.east_m - one.way_east_m, way.north_m - one.way_north_m) for one in rows)
        if max(away_m) < _LEAST_WAY_M:
            return after
        new_s = since_s if self.seen_s > 0 else span_s
        seen_s = self.seen_s + new_s
        share = new_s / min(seen_s + _PRIOR_S, _MEMORY_S)
        found = _times_stated(np.array(rows), rate_radps, drift_rad_per_sqrt_m)
        return replace(after, now=self.now.towards(*found, share), seen_s=seen_s)

    def _known_at(self, time_s: float) -> FixWander:
        """Return it with what was known two minutes before a time."""
        old = [one for one in self.known if one[0] <= time_s - _BEFORE_S]
        before = FoundErrors(*old[-1][1:]) if old else self.before
        known = (*self.known[len(old) :], (time_s, *self.now))
        return replace(self, before=before, known=known)


def _times_stated(
    rows: Floats, rate_radps: float, drift_rad_per_sqrt_m: float
) -> tuple[float, float]:
    """Return the variances of white and of lasting errors by what has been stated of both.

    Columns are those of :class:`WanderFix`.
    """
    time_s, sd_m = rows[:, 0], rows[:, 6]
    middle_s = time_s - time_s.mean()
    gone = np.diff(rows[:, 1] + 1j * rows[:, 2], prepend=complex(*rows[0, 1:3]))
    gone = gone * np.exp(1j * rate_radps * middle_s)
    way, bending = np.cumsum(gone), np.cumsum(middle_s * gone)
    # From the last fix: squares of coordinates of a country lose digits.
    fix = rows[:, 4] + 1j * rows[:, 5] - (rows[-1, 4] + 1j * rows[-1, 5])
    known, _ = np.linalg.qr(np.stack([np.ones(len(rows)), way, bending], axis=1) / sd_m[:, None])
    beside = np.eye(len(rows)) - known @ known.conj().T
    bent = np.diff(beside, n=2, axis=0)
    lasting = np.exp(-np.abs(time_s[:, None] - time_s) / _LASTS_S)
    # What a change of headings between two rows moves those after it, across the way.
    changed = np.tril(way[:, None] - way) * np.sqrt(np.abs(gone)) * drift_rad_per_sqrt_m
    changed /= sd_m[:, None]
    seen, left, wanted = [], [], []
    for shape in (beside, bent):
        # Of both axes.
        by_headings = (np.abs(shape @ changed) ** 2).sum()
        both = (np.abs(shape @ (fix / sd_m)) ** 2).sum() - by_headings
        left.append(max(float(both), 0.0) / 2)
        squared = shape.conj().T @ shape
        seen.append(squared)
        wanted.append([float(np.trace(squared).real), float((squared * lasting.T).sum().real)])
    inverse = np.linalg.inv(np.array(wanted))
    white, slow = inverse @ left
    if white < 0:
        return 0.0, left[0] / wanted[0][1]
    # White noise alone looks as if some of it lasted, by chance.
    only_white = left[0] / wanted[0][0]
    covariance = np.array([[float((one * other.T).sum().real) for other in seen] for one in seen])
    by_chance = only_white * sqrt(float((inverse @ covariance @ inverse.T)[1, 1]))
    return (float(white), float(slow)) if slow > by_chance else (only_white, 0.0)
