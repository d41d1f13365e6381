"""Ground truth: the true positions of a journey."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from mapfilter._arguments import shown
from mapfilter._same import EqualByContent
from mapfilter._types import Bools, Floats, Ints
from mapfilter.errors import Faults, InputError

if TYPE_CHECKING:
    import pandas as pd


GAP_S, GAP_M = 30.0, 50.0
"""Between true positions that are farther apart than both, the way is unknown."""

_MOST_TURNING_BACK, _FEWEST_TURNS, _SOON_S = 0.1, 10, 10.0
"""Share of legs that turn back on the one before, within seconds; more, if there are some, are
noise."""
_APART = 6.0
"""Standard deviations of noise between places, of which one in 8000 is farther from another."""
_COLUMNS = ("time_s", "east_m", "north_m")
_WHERE = "ground truth"


@dataclass(frozen=True, slots=True, eq=False)
class Truth(EqualByContent):
    """True positions of a journey.

    Parameters
    ----------
    time_s, east_m, north_m : (T,) arrays
        True positions, in ascending time, in the CRS of the estimate; lists will do.

    Raises
    ------
    InputError
        A column is of another length, or no numbers; times step back, or are not finite.
    """

    time_s: Floats
    east_m: Floats
    north_m: Floats

    def __post_init__(self) -> None:
        faults = Faults()
        for name in _COLUMNS:
            object.__setattr__(self, name, _numbers(name, getattr(self, name), faults))
        faults.raise_if_any(InputError)
        for name in _COLUMNS[1:]:
            shape = getattr(self, name).shape
            if shape != self.time_s.shape:
                faults.add(f"{_WHERE}, {name}", f"{self.time_s.size} positions", f"shape {shape}")
        if not np.isfinite(self.time_s).all():
            unknown = self.time_s[~np.isfinite(self.time_s)][0]
            faults.add(f"{_WHERE}, time_s", "finite seconds", unknown)
        elif (np.diff(self.time_s) < 0).any():
            faults.add(f"{_WHERE}, time_s", "seconds in ascending order", "a step back")
        faults.raise_if_any(InputError)

    @classmethod
    def of_table(cls, table: pd.DataFrame) -> Truth | None:
        """Return the ground truth in a log's table ``truth``; None below two positions.

        Rows are sorted by time and repeated ones dropped, as in a log.
        """
        table = table[list(_COLUMNS)]
        if not (np.diff(table["time_s"].to_numpy(np.float64)) > 0).all():
            table = table.drop_duplicates().sort_values("time_s", kind="stable")
        if len(table) < 2:
            return None
        return cls(*(table[name].to_numpy(np.float64) for name in _COLUMNS))

    def at(self, time_s: ArrayLike) -> tuple[Floats, Floats]:
        """Return true positions at other times by linear interpolation; NaN outside the record."""
        at_s = np.asarray(time_s, dtype=np.float64)
        inside = (at_s >= self.time_s[0]) & (at_s <= self.time_s[-1])
        east_m = np.interp(at_s, self.time_s, self.east_m)
        north_m = np.interp(at_s, self.time_s, self.north_m)
        return np.where(inside, east_m, np.nan), np.where(inside, north_m, np.nan)

    def tells(self, time_s: ArrayLike) -> Bools:
        """Return whether the true position is known at other times: within the record, in no gap.

        A gap is between neighbours more than 30 s and 50 m apart.

        Examples
        --------
        >>> truth = Truth(*np.array([[0.0, 10.0, 60.0, 99.0], [0.0, 9.0, 99.0, 130.0], [0.0] * 4]))
        >>> truth.tells([-1.0, 5.0, 10.0, 20.0, 70.0, 100.0]).tolist()
        [False, True, True, False, True, False]
        """
        at_s = np.asarray(time_s, dtype=np.float64)
        legs_m = np.hypot(np.diff(self.east_m), np.diff(self.north_m))
        # No gap follows the last one.
        is_gap = np.append((np.diff(self.time_s) > GAP_S) & (legs_m > GAP_M), False)
        before = np.clip(np.searchsorted(self.time_s, at_s, side="right") - 1, 0, None)
        measured = np.isin(at_s, self.time_s)
        return np.asarray(np.isfinite(self.at(at_s)).all(axis=0) & (measured | ~is_gap[before]))

    def distance_at(self, time_s: ArrayLike) -> Floats:
        """Return the true distance travelled since the start, interpolated to other times.

        The legs of the record are added up. Where more than a tenth of them turn back on the one
        before within 10 s, as those of a receiver's positions with noise do, only places more than
        six standard deviations of the noise apart count, so that a rest adds nothing; the sum is
        then within some 10 % of the way.

        Examples
        --------
        >>> walk = 1.5 * np.minimum(np.arange(200.0), 100.0)
        >>> noise = np.random.default_rng(0).normal(0.0, 5.0, (2, 200))
        >>> noisy = Truth(np.arange(200.0), walk + noise[0], noise[1])
        >>> round(np.hypot(np.diff(noisy.east_m), np.diff(noisy.north_m)).sum())
        1770
        >>> noisy.distance_at([100.0, 199.0]).round().tolist()
        [161.0, 161.0]
        """
        at = self._places_apart()
        legs_m = np.hypot(np.diff(self.east_m[at]), np.diff(self.north_m[at]))
        travelled_m = np.concatenate([[0.0], np.cumsum(legs_m)])
        at_s = np.asarray(time_s, dtype=np.float64)
        return np.asarray(np.interp(at_s, self.time_s[at], travelled_m))

    def _places_apart(self) -> Ints:
        """Return the positions whose legs make up the way: all of a record without noise."""
        every = np.arange(self.time_s.size)
        places_m = np.column_stack([self.east_m, self.north_m])
        legs_m = np.diff(places_m, axis=0)
        turns_back = (legs_m[1:] * legs_m[:-1]).sum(axis=1) < 0
        turns_back &= self.time_s[2:] - self.time_s[:-2] <= _SOON_S
        count = np.count_nonzero(turns_back)
        if count < _FEWEST_TURNS or count <= _MOST_TURNING_BACK * turns_back.size:
            return every
        apart_m = _APART * _noise_m(self.time_s, places_m)
        kept = [0]
        for i, place_m in enumerate(places_m):
            if np.hypot(*(place_m - places_m[kept[-1]])) > apart_m:
                kept.append(i)
        return np.array(kept)


def _numbers(name: str, given: object, faults: Faults) -> Floats:
    """Return a column as an array of numbers; empty, with a fault, where it is none."""
    try:
        found = None if given is None else np.asarray(given, dtype=np.float64)
    except (TypeError, ValueError):
        found = None
    if found is not None and found.ndim == 1:
        return found
    if found is None:
        faults.add(f"{_WHERE}, {name}", "numbers", shown(given))
    else:
        faults.add(f"{_WHERE}, {name}", "one dimension", f"shape {found.shape}")
    return np.empty(0)


def _noise_m(time_s: Floats, places_m: Floats) -> float:
    """Return the standard deviation of the noise of positions, to the east as to the north.

    By the median distance of positions from the line between their neighbours, at the same time.
    """
    after = ((time_s[1:-1] - time_s[:-2]) / (time_s[2:] - time_s[:-2]))[:, np.newaxis]
    before = 1 - after
    off_m = places_m[1:-1] - before * places_m[:-2] - after * places_m[2:]
    variance_m2 = (off_m**2).sum(axis=1) / (1 + before**2 + after**2)[:, 0]
    # The sum of two squared normal errors is 2 ln 2 of their variance in the median.
    return float(np.sqrt(np.median(variance_m2) / (2 * np.log(2))))
