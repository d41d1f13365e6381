"""Stretches of a journey between its positions, over which motion is compared with them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from mapfilter._types import Bools, Complexes, Floats, Ints

USUAL_M = 40.0
_SHORTEST, _LONGEST_M = 0.625, 300.0
"""Shortest line as a share of the usual one, and the longest."""
_COVERED = 0.6
_LONGEST_TIMES = 5.0
_FINEST, _COARSEST, _FEWER = 4096, 6, 1.4
_ROUNDED = 1e-6
"""Rows by which a mean number of rows may be off, as it is interpolated between two of them."""
FEWEST_PLACES = 6
"""With so many positions or fewer there are no stretches."""


@dataclass(frozen=True, eq=False)
class Stretches:
    """Pairs of straight lines between positions, one after the other; N pairs of M positions.

    Positions of a few seconds are one, their mean, so that noise counts less. What motion says is
    averaged over the same times.

    Parameters
    ----------
    time_s : ndarray of float64, shape (M,)
        Of each position.
    group : ndarray of int64, shape (M,)
        Number of its mean, from 0.
    first : ndarray of int64, shape (N,)
        Number of the mean with which a pair begins; the next two follow.
    before_m, after_m : ndarray of complex128, shape (N,)
        The two lines of a pair: east, and north as the imaginary part.
    """

    time_s: Floats
    group: Ints
    first: Ints
    before_m: Complexes
    after_m: Complexes

    def __len__(self) -> int:
        return self.first.size

    @property
    def turned_rad(self) -> Floats:
        """Change of course at the middle, in (-π, π]."""
        return np.asarray(np.angle(self.after_m * np.conj(self.before_m)))

    @property
    def lasted_s(self) -> Floats:
        """Duration of each pair."""
        return self.grown(self.time_s, self.time_s).real

    def where(self, kept: Bools) -> Stretches:
        """Return some of the pairs."""
        parts = self.first[kept], self.before_m[kept], self.after_m[kept]
        return Stretches(self.time_s, self.group, *parts)

    def grown(self, time_s: Floats, total: Floats | Complexes) -> Complexes:
        """Return how much a sum of motion grows along each pair.

        Parameters
        ----------
        time_s, total : (K,) array
            The sum, of real or complex numbers, and its times.
        """
        mean = _means(np.interp(self.time_s, time_s, total), self.group)
        return np.asarray(mean[self.first + 2] - mean[self.first])

    def without(self, time_s: Floats, count: Floats) -> Bools:
        """Return along which pairs a count stays as it is; its means over places are rounded.

        Parameters
        ----------
        time_s, count : (K,) array
            Whole numbers, and their times.
        """
        return np.asarray(np.abs(self.grown(time_s, count)) < _ROUNDED)

    def with_known(self, time_s: Floats, values: Floats) -> Stretches:
        """Return the pairs along which every value of motion is known.

        Parameters
        ----------
        time_s, values : (K,) array
        """
        unknown = np.cumsum(~np.isfinite(values), dtype=np.float64)
        return self.where(self.without(time_s, unknown))

    def turned_by(self, time_s: Floats, reckoned_m: Complexes) -> Floats:
        """Return the change of course at the middle by positions of motion's own.

        Parameters
        ----------
        time_s : (K,) array
        reckoned_m : (K,) array of complex128
            Positions by dead reckoning in any frame.
        """
        mean = _means(np.interp(self.time_s, time_s, reckoned_m), self.group)
        before_m, after_m = (np.diff(mean)[self.first + i] for i in (0, 1))
        return np.asarray(np.angle(after_m * np.conj(before_m)))


def reckoned_m(step_m: Floats, turn_rad: Floats) -> Complexes:
    """Return positions by dead reckoning from steps and turns, in a frame of their own.

    Parameters
    ----------
    step_m, turn_rad : (K,) array
        A step goes into the direction at the middle of its turn.

    Returns
    -------
    (K,) array of complex128
        Ahead at first, and to the left as the imaginary part.
    """
    heading_rad = np.cumsum(turn_rad)
    return np.asarray(np.cumsum(step_m * np.exp(1j * (heading_rad - turn_rad / 2))))


def known_places(places: pd.DataFrame) -> tuple[Floats, Floats, Floats]:
    """Return time, east and north of finite positions, in order, of each time the first."""
    columns = [places[name].to_numpy(dtype=np.float64) for name in ("time_s", "east_m", "north_m")]
    known = np.logical_and.reduce([np.isfinite(values) for values in columns])
    time_s, east_m, north_m = (values[known] for values in columns)
    if not (np.diff(time_s) > 0).all():
        time_s, first = np.unique(time_s, return_index=True)
        east_m, north_m = east_m[first], north_m[first]
    return time_s, east_m, north_m


def stretches(
    places: pd.DataFrame, time_s: Floats, way_m: Floats, usual_m: float = USUAL_M
) -> Stretches | None:
    """Return pairs of lines of some 40 m and more between positions; None where there are too few.

    The way is parted equally, as finely as it may be with lines of 40 m or more on most of it but
    for gaps between positions. It is that of motion, in whatever unit: the way between positions
    grows by their noise, and a rest is none. Lines of less than 25 m (positions that stand still),
    of more than 300 m, and over a gap are left out.

    Parameters
    ----------
    places : pandas.DataFrame
        time_s, east_m and north_m.
    time_s, way_m : (K,) array
        Of motion: times, and the way until each. Positions before and after are left out.
    usual_m : float
        Another length than 40 m; lines of less than 0.625 of it are left out.

    Examples
    --------
    >>> time_s = np.arange(201.0)
    >>> truth = pd.DataFrame({"time_s": time_s, "east_m": 10 * time_s, "north_m": 0.0})
    >>> found = stretches(truth, time_s, 10 * time_s)
    >>> line_m = float(np.median(np.abs(found.before_m)))
    >>> len(found), line_m, found.turned_rad.max(), np.median(found.grown(time_s, 10 * time_s).real)
    (50, 40.0, np.float64(0.0), np.float64(80.0))
    """
    at_s, east_m, north_m = known_places(places)
    within = np.zeros(at_s.size, dtype=np.bool_)
    if time_s.size:
        within = (at_s >= time_s[0]) & (at_s <= time_s[-1])
    at_s, place_m = at_s[within], (east_m + 1j * north_m)[within]
    walked_m = np.interp(at_s, time_s, way_m) if at_s.size else at_s
    if at_s.size <= FEWEST_PLACES or walked_m[-1] <= walked_m[0]:
        return None
    part = (walked_m - walked_m[0]) / (walked_m[-1] - walked_m[0])
    parts = float(_FINEST)
    while parts < at_s.size:
        parts *= _FEWER
    while parts >= _COARSEST:
        group = np.cumsum(np.diff(np.floor(parts * part), prepend=0.0) != 0)
        line_m, passed = np.diff(_means(place_m, group)), np.diff(_means(part, group).real)
        length_m = np.abs(line_m)
        is_gap = passed > _LONGEST_TIMES * np.median(passed)
        fits = (length_m <= _LONGEST_M) & ~is_gap
        if passed[fits & (length_m >= usual_m)].sum() >= _COVERED * passed[~is_gap].sum():
            fits &= length_m >= _SHORTEST * usual_m
            first = np.flatnonzero(fits[:-1] & fits[1:])
            return Stretches(at_s, group, first, line_m[first], line_m[first + 1])
        parts /= _FEWER
    return None


def _means(values: Floats | Complexes, group: Ints) -> Complexes:
    """Return the mean of each group."""
    east, north = (np.bincount(group, part) for part in (values.real, values.imag))
    return np.asarray((east + 1j * north) / np.bincount(group))


def motion_values(motion: pd.DataFrame, name: str) -> Floats:
    """Return a column of motion."""
    return np.asarray(motion[name], dtype=np.float64)


def steady_values(motion: pd.DataFrame, name: str) -> Floats:
    """Return a column of motion from the second row on; 0 where a value is not known."""
    values = np.nan_to_num(motion_values(motion, name), nan=0.0)
    values[:1] = 0.0
    return values


def rows_apart_s(time_s: Floats) -> float:
    """Return the usual time from row to row; the mean where most rows have that of another one.

    Examples
    --------
    >>> rows_apart_s(np.array([0.0, 1.0, 2.0, 9.0])), rows_apart_s(np.repeat(np.arange(3.0), 3))
    (1.0, 0.25)
    """
    lasted_s = np.diff(time_s)
    return float(np.median(lasted_s)) or float(np.mean(lasted_s))
