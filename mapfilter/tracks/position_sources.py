"""Positions of recordings as fixes: of the best source, each once, without held ones."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from mapfilter._types import Bools, Floats
from mapfilter._words import number_of
from mapfilter.tracks.frame import Frame
from mapfilter.tracks.readers.recording import Recording

PROVIDERS = ("gps", "fused", "flp", "network", "nlp")
"""The best first."""
_SAME_M, _FEWEST, _MOVED_M, _COMMON = 0.5, 20, 50.0, 0.5
_HELD_S = 10.0

_RADIUS_68 = 1.515
"""Radius of 68 % of a two-dimensional normal distribution, in standard deviations."""

Placed = tuple[Recording, pd.DataFrame]
"""A recording, and its positions: time_s, east_m and north_m."""


def measured_positions(recording: Recording) -> tuple[pd.DataFrame | None, str]:
    """Return measured positions of the best provider, and a note on those of others."""
    rows = recording.tables.get("positions", recording.tables.get("places"))
    if rows is None or "provider" not in rows or rows["provider"].isna().all():
        return rows, ""
    named = rows["provider"].fillna("").str.lower()
    found = [name for name in PROVIDERS if (named == name).any()]
    if not found or (named == found[0]).all():
        return rows, ""
    left = int((named != found[0]).sum())
    kept = rows[named == found[0]].reset_index(drop=True)
    return kept, f"{recording.path.name}: {left} fixes of other providers than {found[0]} left out"


def fixes_of(
    recordings: Sequence[Recording],
    frame: Frame,
    motion: pd.DataFrame | None,
    notes: list[str],
) -> pd.DataFrame | None:
    """Return the positions of recordings as fixes of a log; None without any.

    Parameters
    ----------
    recordings : sequence of Recording
        Without those of the truth, on one clock.
    frame : Frame
    motion : pandas.DataFrame or None
        Motion that is no receiver's, by which positions that a receiver holds are known.
    notes : list of str
        Grows by what is left out.
    """
    placed = []
    for recording in recordings:
        rows, note = measured_positions(recording)
        if rows is None:
            continue
        if note:
            notes.append(note)
        east, north = frame.east_north(rows, recording.crs)
        variance = np.full(len(rows), np.nan)
        if "accuracy_m" in rows:
            radius = rows["accuracy_m"].to_numpy()
            variance = np.where(radius > 0, (radius / _RADIUS_68) ** 2, np.nan)
        columns = {"time_s": rows["time_s"], "east_m": east, "north_m": north}
        columns |= {"var_east_m2": variance, "var_north_m2": variance}
        fixes = pd.DataFrame({**columns, "cov_east_north_m2": 0.0 * variance})
        placed.append((recording, fixes))
    if not placed:
        return None
    kept, told = of_one_receiver(placed)
    notes += told
    parts = []
    for recording, fixes in kept:
        fixes, note = without_held(fixes, motion)
        notes += [f"{recording.path.name}: {note}"] if note else []
        parts.append(fixes)
    return pd.concat(parts, ignore_index=True).sort_values("time_s")


def of_one_receiver(placed: Sequence[Placed]) -> tuple[list[Placed], tuple[str, ...]]:
    """Return recordings without those that repeat positions of another one, and notes on these.

    Of files by one program that name their provider the best one stays. Positions within half a
    metre, nearly everywhere on a way, are those of one receiver, written twice: two receivers
    differ by more.

    Parameters
    ----------
    placed : sequence of (Recording, pandas.DataFrame)
        Measured positions on one clock, in order.
    """
    kept: list[Placed] = []
    notes = []
    for one in sorted(placed, key=lambda pair: _rank(pair[0])):
        for other in kept:
            better = _rank(other[0]) < _rank(one[0]) and other[0].format == one[0].format
            better = better and _inside(other[1], one[1]).mean() >= _COMMON
            if better or _same(other[1], one[1]):
                why = "as they are of another provider" if better else "as they are the same"
                notes.append(
                    f"{one[0].path.name}: {number_of(len(one[1]), 'position')} left out beside "
                    f"{other[0].path.name}, {why}"
                )
                break
        else:
            kept.append(one)
    order = [id(recording) for recording, _ in placed]
    return sorted(kept, key=lambda pair: order.index(id(pair[0]))), tuple(notes)


def without_held(gnss: pd.DataFrame, motion: pd.DataFrame | None) -> tuple[pd.DataFrame, str]:
    """Return fixes without those that stay where they are while the phone moves, and a note.

    A receiver without satellites, or a program, may repeat its last position for minutes. Of equal
    positions over more than 10 s, in which motion goes more than 50 m, the first one stays.

    Parameters
    ----------
    gnss : pandas.DataFrame
        time_s, east_m and north_m, in order.
    motion : pandas.DataFrame or None
        time_s and step_m.

    Examples
    --------
    >>> time_s = np.arange(100.0)
    >>> fixes = pd.DataFrame({"time_s": time_s, "east_m": np.minimum(time_s, 50), "north_m": 0.0})
    >>> kept, note = without_held(fixes, pd.DataFrame({"time_s": time_s, "step_m": 10.0}))
    >>> len(kept), note[:59]
    (51, 'gnss: 49 positions left out, as they stay the same for up t')
    """
    if motion is None or len(gnss) < 2:
        return gnss, ""
    time_s, east_m, north_m = _columns(gnss)
    moved = np.nan_to_num(np.abs(motion["step_m"].to_numpy(dtype=np.float64)))
    way_m = np.interp(time_s, motion["time_s"].to_numpy(dtype=np.float64), np.cumsum(moved))
    changed = np.concatenate([[True], (np.diff(east_m) != 0) | (np.diff(north_m) != 0)])
    first = np.flatnonzero(changed)
    last = np.append(first[1:], len(gnss)) - 1
    held = (time_s[last] - time_s[first] > _HELD_S) & (way_m[last] - way_m[first] > _MOVED_M)
    if not held.any():
        return gnss, ""
    dropped = np.repeat(held, last - first + 1) & ~changed
    longest_s = float((time_s[last] - time_s[first])[held].max())
    gone_m = float((way_m[last] - way_m[first])[held].max())
    note = (
        f"gnss: {number_of(int(dropped.sum()), 'position')} left out, as they stay the same for up "
        f"to {longest_s:.0f} s while motion goes {gone_m:.0f} m (likely: held by a receiver "
        "without satellites)"
    )
    return gnss[~dropped].reset_index(drop=True), note


def _rank(recording: Recording) -> int:
    """Return the number of the provider of all positions of a recording."""
    rows = recording.tables.get("positions")
    if rows is None or "provider" not in rows:
        return 0
    named = rows["provider"].dropna().unique()
    name = str(named[0]).lower() if len(named) == 1 else ""
    return PROVIDERS.index(name) if name in PROVIDERS else 0


def _same(one: pd.DataFrame, other: pd.DataFrame) -> bool:
    (time_s, east_m, north_m), (at_s, *there_m) = _columns(one), _columns(other)
    inside = _inside(one, other)
    if inside.sum() < max(_FEWEST, _COMMON * inside.size):
        return False
    off_m = np.hypot(
        np.interp(at_s, time_s, east_m) - there_m[0], np.interp(at_s, time_s, north_m) - there_m[1]
    )[inside]
    moved = float(np.hypot(np.ptp(there_m[0][inside]), np.ptp(there_m[1][inside])))
    return bool(moved > _MOVED_M and np.quantile(off_m, 0.9) < _SAME_M)


def _inside(one: pd.DataFrame, other: pd.DataFrame) -> Bools:
    """Return which rows of the other table lie within the times of the one."""
    begin_s, end_s = one["time_s"].iloc[[0, -1]]
    return np.asarray(other["time_s"].between(begin_s, end_s), dtype=np.bool_)


def _columns(rows: pd.DataFrame) -> tuple[Floats, Floats, Floats]:
    time_s, east_m, north_m = (
        rows[name].to_numpy(dtype=np.float64) for name in ("time_s", "east_m", "north_m")
    )
    return time_s, east_m, north_m
