"""Ground truth: the true positions of a journey."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from mapfilter._types import Bools, Floats

if TYPE_CHECKING:
    import pandas as pd


GAP_S, GAP_M = 30.0, 50.0
"""Between true positions that are farther apart than both, the way is unknown."""

_COLUMNS = ("time_s", "east_m", "north_m")


@dataclass(frozen=True, slots=True)
class Truth:
    """True positions of a journey.

    Parameters
    ----------
    time_s, east_m, north_m : (T,) arrays
        True positions, in ascending time, in the CRS of the estimate.
    """

    time_s: Floats
    east_m: Floats
    north_m: Floats

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
        """Return the true distance travelled since the start, interpolated to other times."""
        legs_m = np.hypot(np.diff(self.east_m), np.diff(self.north_m))
        travelled_m = np.concatenate([[0.0], np.cumsum(legs_m)])
        return np.asarray(np.interp(np.asarray(time_s, dtype=np.float64), self.time_s, travelled_m))
