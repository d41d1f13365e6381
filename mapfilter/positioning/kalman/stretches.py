"""Fixes of the last stretches of a way, compared with where its steps have led.

Fixes z and the way q of a stretch are complex numbers, and a least-squares line z = p + a q has the
weights h = (q - q̄) / Σ|q - q̄|²: a = h* z. What fixes are off by is noise of each and a first-order
Gauss-Markov process, so that with their covariance C the variance of a is h* C h: what changes
slowly hardly turns a short stretch, and a long one more than noise would. The same holds for the
place to which the line leads.
"""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

import numpy as np

from mapfilter._types import Floats

LEAST_ROWS, LEAST_FIX_SD_M = 6, 7.5
"""Fixes of a stretch, at least, and their deviation: between houses they are off to one side for a
while, beyond what they state."""
_NO_WAY_M2 = 1e-6
"""Sum of squares of a way about its middle up to which there is none."""
_SHORTEST, _LONGEST, _MOST_MISFIT = 0.7, 1.4, 2.0
"""Lengths of the way by fixes to that by steps between which they are the same way; largest mean
square of what is left of fixes, in their variances."""
_USUAL, _DEVIATIONS = 0.1, 2.0
"""What steps are usually too short or long by; deviations beyond it by which they may be, too."""
_JUMPED = 4.0
"""Deviations, as stated, beyond the way between two fixes from which on they have jumped."""


class WayFix(NamedTuple):
    """A fix, where steps have led at its time, and what the belief had.

    ``variance_m2`` is that of noise along one axis; ``usual_m`` and ``beyond_m`` are deviations of
    what lasts: of a usual fix, and what is known beyond that. ``turned_rad`` is the belief's
    heading error less what a rate of turns has added since the first fix, ``turned_rad2`` its
    variance. ``stated_m`` is the deviation along one axis that the fix states.
    """

    time_s: float
    way_east_m: float
    way_north_m: float
    east_m: float
    north_m: float
    variance_m2: float
    usual_m: float
    beyond_m: float
    turned_rad: float
    turned_rad2: float
    stated_m: float


class Led(NamedTuple):
    """Where a stretch leads: deviation of its direction, place, and how both are off together.

    ``sd_m`` is of one axis; ``shared_m_rad`` the covariance of east and of north with the angle.
    """

    sd_rad: float
    east_m: float
    north_m: float
    sd_m: float
    shared_m_rad: tuple[float, float]


class Stretches(NamedTuple):
    """Regressions of the fixes from each on to the last.

    Parameters
    ----------
    factor : (N,) complex array
        a.
    sd_rad : (N,) array
        Deviation of its angle, without what usually lasts of fixes.
    residual_m2 : (N,) array
        Sum of squares of what is left of the fixes.
    fits : (N,) bool array
        Whether the fixes lie on the way, without jumps: where headings have jumped places have not,
        and where walls reflect signals they have.
    drawn_out : (N,) bool array
        Whether that way is drawn out by more than steps may be too short or long, as where a
        spoofer leads away.
    """

    factor: np.ndarray
    sd_rad: Floats
    residual_m2: Floats
    fits: np.ndarray
    drawn_out: np.ndarray

    @classmethod
    def of(cls, rows: Floats, lasting_s: float) -> Stretches:
        """Return the regressions of rows whose columns are those of :class:`WayFix`.

        Parameters
        ----------
        rows : (N, 11) array
        lasting_s : float
            Time after which the correlation of what lasts is 1/e.
        """
        way, fix = _from_last(rows)
        count = np.arange(len(rows), 0, -1.0)
        within = np.triu(np.ones((len(rows), len(rows))))
        beside = within * (way - (within @ way / count)[:, None])
        spread = np.maximum((np.abs(beside) ** 2).sum(axis=1), _NO_WAY_M2)
        weights = beside / spread[:, None]
        factor = weights.conj() @ fix
        mean_fix = within @ fix / count
        left = within @ np.abs(fix) ** 2 - count * np.abs(mean_fix) ** 2
        residual = left - np.abs(factor) ** 2 * spread
        covariance = _covariance_m2(rows, rows[:, 7], lasting_s)
        slope = _quadratic(weights, covariance)
        # What a line leaves of errors, of both axes.
        mean = _quadratic(within, covariance) / count
        expected = 2 * (within @ np.diag(covariance) - mean - slope * spread)
        size = np.abs(factor)
        fits = residual <= _MOST_MISFIT * np.maximum(expected, covariance[-1, -1])
        fits &= (size >= _SHORTEST) & (size <= _LONGEST) & (count >= LEAST_ROWS)
        # One fix has no direction, nor have several in one place.
        slope[spread <= _NO_WAY_M2] = np.inf
        fits &= ~_jump_later(rows)
        sd_rad = np.sqrt(slope) / np.maximum(size, _SHORTEST)
        drawn_out = np.abs(size - 1) > _USUAL + _DEVIATIONS * sd_rad
        return cls(factor, sd_rad, residual, fits, drawn_out)

    def nats(self, off_rad: Floats, others_rad2: Floats) -> Floats:
        """Return the log-likelihood ratios of directions to others, which have variances.

        That of a fixed direction is ``|a| (1 - cos off) / var a``: large angles count by their
        chord.
        """
        variance = np.maximum(np.abs(self.factor), _SHORTEST) * self.sd_rad**2
        return np.asarray(2 * np.sin(off_rad / 2) ** 2 / (variance + others_rad2))


def led_by(rows: Floats, here: complex, lasting_s: float) -> Led:
    """Return where a stretch leads, with all that lasts of its fixes.

    Parameters
    ----------
    rows : (N, 11) array
        Of the stretch; columns are those of :class:`WayFix`.
    here : complex
        Where steps have led by now.
    lasting_s : float
    """
    way, fix = _from_last(rows)
    beside = way - way.mean()
    slope = beside.conj() / max(float((np.abs(beside) ** 2).sum()), _NO_WAY_M2)
    factor = complex(slope @ fix)
    off = here - complex(rows[-1, 1], rows[-1, 2]) - way.mean()
    place = np.full(len(rows), 1 / len(rows)) + slope * off
    covariance = _covariance_m2(rows, np.hypot(rows[:, 6], rows[:, 7]), lasting_s)
    by_angle = slope / factor
    led = complex(place @ fix) + complex(rows[-1, 3], rows[-1, 4])
    shared = 1j * complex(place @ covariance @ by_angle.conj())
    return Led(
        sqrt(float((by_angle @ covariance @ by_angle.conj()).real)),
        led.real,
        led.imag,
        sqrt(float((place @ covariance @ place.conj()).real)),
        (shared.real, shared.imag),
    )


def _from_last(rows: Floats) -> tuple[np.ndarray, np.ndarray]:
    """Return way and fixes from the last on: squares of coordinates of a country lose digits."""
    both = rows[:, [1, 3]] + 1j * rows[:, [2, 4]]
    way, fix = (both - both[-1]).T
    return way, fix


def _jump_later(rows: Floats) -> np.ndarray:
    """Return whether fixes jump after each, farther than steps have led."""
    gone_m, moved_m = (np.hypot(*np.diff(rows[:, place], axis=0).T) for place in ([1, 2], [3, 4]))
    jumps = moved_m > gone_m + _JUMPED * np.hypot(rows[1:, 10], rows[:-1, 10])
    return np.append(np.logical_or.accumulate(jumps[::-1])[::-1], False)


def _covariance_m2(rows: Floats, lasting_m: Floats, lasting_s: float) -> Floats:
    """Return the covariance of fixes along one axis."""
    apart_s = np.abs(rows[:, None, 0] - rows[:, 0])
    lasting = np.outer(lasting_m, lasting_m) * np.exp(-apart_s / lasting_s)
    return np.asarray(np.diag(rows[:, 5]) + lasting)


def _quadratic(weights: np.ndarray, covariance: Floats) -> Floats:
    """Return w* C w of each row."""
    return np.asarray(((weights @ covariance) * weights.conj()).sum(axis=1).real)
