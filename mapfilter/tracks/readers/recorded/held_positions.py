"""Positions that are none of their own moment: repeated, rounded, or of before the journey."""

from __future__ import annotations

import numpy as np
import pandas as pd

from mapfilter._types import Bools, Floats, Ints
from mapfilter._words import number_of
from mapfilter.tracks.checks.rounded_degrees import with_rounding
from mapfilter.tracks.joining.position_units import metres_about_middle

_FEWEST = 20
_LONGEST_RUN_S, _ALIKE, _LONG = 5.0, 0.8, 3
"""Runs of equal positions of a slow receiver; longer ones are rests."""
_JUMP_M, _JUMP_MPS, _SETTLED = 2000.0, 350.0, 10
_FIRST_SHARE, _FIRST_ROWS = 0.02, 3
_JOURNEY_S = 6 * 3600.0


def own_positions(rows: pd.DataFrame) -> tuple[pd.DataFrame, tuple[str, ...]]:
    """Return the positions that a receiver measured, and notes on others.

    First rows that lie kilometres from the following ones, farther than any speed explains, are a
    last position of before. Where positions change at a steady pace of several rows, a program
    repeats those of a slower receiver: of each the first row stays, and of a rest as many as the
    receiver measured. Degrees of three decimals or fewer have at least the error of rounding.

    Parameters
    ----------
    rows : pandas.DataFrame
        time_s, in order, lat_deg, lon_deg and accuracy_m.
    """
    notes: tuple[str, ...] = ()
    for part in (_without_first, _without_repeated, with_rounding):
        rows, note = part(rows)
        notes += (note,) if note else ()
    pause_s = float(rows["time_s"].diff().max()) if len(rows) > 1 else 0.0
    if pause_s > _JOURNEY_S:
        notes += (
            f"positions pause for {pause_s / 3600:.1f} h (likely: several journeys: split the file "
            "there, convert each alone)",
        )
    return rows, notes


def _without_first(rows: pd.DataFrame) -> tuple[pd.DataFrame, str]:
    many = int(max(_FIRST_ROWS, _FIRST_SHARE * len(rows)))
    if len(rows) < 4 * many:
        return rows, ""
    time_s, east_m, north_m = _metres(rows.iloc[: many + 1 + _SETTLED])
    step_m, lasted_s = np.hypot(np.diff(east_m), np.diff(north_m)), np.diff(time_s)
    jumps = np.flatnonzero((step_m > _JUMP_M) & (step_m > _JUMP_MPS * lasted_s))
    if not jumps.size or jumps[-1] >= many:
        return rows, ""
    count = int(jumps[-1]) + 1
    first = "first row lies" if count == 1 else f"first {count} rows lie"
    note = (
        f"positions: the {first} {step_m[jumps[-1]] / 1000:.1f} km "
        "from the next one, left out (likely: the last position of before)"
    )
    return rows.iloc[count:].reset_index(drop=True), note


def _without_repeated(rows: pd.DataFrame) -> tuple[pd.DataFrame, str]:
    lat, lon = (rows[name].to_numpy(dtype=np.float64) for name in ("lat_deg", "lon_deg"))
    if len(rows) < _FEWEST:
        return rows, ""
    first = np.flatnonzero(np.concatenate([[True], (np.diff(lat) != 0) | (np.diff(lon) != 0)]))
    length = np.diff(np.append(first, len(rows)))
    # The first and the last run may be cut off.
    usual = int(np.median(length[1:-1])) if length.size >= _FEWEST else 1
    if usual < 2 or not _steady(length[1:-1], usual):
        return rows, ""
    time_s = rows["time_s"].to_numpy(dtype=np.float64)
    period_s = float(np.median(np.diff(time_s[first])))
    if period_s > _LONGEST_RUN_S:
        return rows, ""
    kept = _measured(first, length, usual)
    note = (
        f"positions: {number_of(int(np.sum(~kept)), 'row')} repeat those of a receiver that "
        f"measures every {period_s:.2g} s, left out"
    )
    return rows[kept].reset_index(drop=True), note


def _steady(length: Ints, usual: int) -> bool:
    """Return whether most runs are about as long as the usual one, or rests."""
    near = np.abs(length - usual) <= max(1.0, 0.25 * usual)
    return bool(np.mean(near | (length >= _LONG * usual)) >= _ALIKE and near.mean() >= 0.5)


def _measured(first: Ints, length: Ints, usual: int) -> Bools:
    """Return the first row of each run, and those of a rest at which the receiver measured."""
    number = np.arange(int(length.sum())) - np.repeat(first, length)
    rests = np.repeat(length >= _LONG * usual, length)
    return np.asarray((number == 0) | (rests & (number % usual == 0)))


def _metres(rows: pd.DataFrame) -> tuple[Floats, Floats, Floats]:
    time_s = rows["time_s"].to_numpy(dtype=np.float64)
    return time_s, *metres_about_middle(rows["lon_deg"], rows["lat_deg"])
