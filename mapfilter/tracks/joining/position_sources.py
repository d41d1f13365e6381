"""Positions of recordings as fixes: of the best source, each once, without held ones."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from mapfilter._types import Bools, Floats, Ints
from mapfilter._words import number_of
from mapfilter.tracks.checks.rounded_degrees import rounding_m
from mapfilter.tracks.checks.stated_errors import stated_note
from mapfilter.tracks.joining.equal_times import in_order
from mapfilter.tracks.joining.frame import Frame
from mapfilter.tracks.joining.position_units import RADIUS_68
from mapfilter.tracks.readers.recorded.recording import Recording

PROVIDERS = ("gps", "fused", "flp", "network", "nlp")
"""The best first."""
_SAME_M, _FEWEST, _MOVED_M, _COMMON = 0.5, 20, 50.0, 0.5
_NEAR_S, _NEAR = 2.0, 1.5
"""A position stands for others within 2 s of it, or one and a half of its file's intervals."""
_STAY_M, _STAY_MOVED_M, _STANDING_MPS = 3.0, 100.0, 0.3
_HELD_S, _HELD_APART_S, _CELLS = 10.0, 60.0, 2.0
"""A way with corners within one step of rounded degrees is up to two steps long."""

Placed = tuple[Recording, pd.DataFrame]
"""A recording, and its positions: time_s, east_m and north_m."""


def measured_positions(recording: Recording) -> tuple[pd.DataFrame | None, str]:
    """Return measured positions of the best provider, and a note on those of others."""
    rows = recording.tables.get("positions", recording.tables.get("places"))
    if rows is None or "provider" not in rows or rows["provider"].isna().all():
        return rows, ""
    named = rows["provider"].astype(object).fillna("").str.lower()
    found = [name for name in PROVIDERS if (named == name).any()]
    if not found or (named == found[0]).all():
        return rows, ""
    left = number_of(int((named != found[0]).sum()), "fix", "fixes")
    kept = rows[named == found[0]].reset_index(drop=True)
    return kept, f"{recording.name}: {left} of other providers than {found[0]} left out"


def fixes_of(
    recordings: Sequence[Recording],
    frame: Frame,
    motion: pd.DataFrame | None,
    notes: list[str],
    truth: pd.DataFrame | None = None,
    *,
    driven: bool = False,
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
        Grows by what is left out, and by stated errors that are far too small.
    truth : pandas.DataFrame, optional
        time_s, east_m and north_m.
    driven : bool
        Whether motion is that of wheels.
    """
    placed, rounded_m = [], {}
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
            variance = np.where(radius > 0, (radius / RADIUS_68) ** 2, np.nan)
        columns = {"time_s": rows["time_s"], "east_m": east, "north_m": north}
        columns |= {"var_east_m2": variance, "var_north_m2": variance}
        fixes = pd.DataFrame({**columns, "cov_east_north_m2": 0.0 * variance})
        placed.append((recording, fixes))
        rounded_m[id(recording)] = rounding_m(rows)
    if not placed:
        return None
    notes += _stated_notes(placed, truth)
    kept, of_sources = of_one_receiver(placed)
    notes += of_sources
    parts = []
    for recording, fixes in kept:
        fixes, note = without_held(fixes, motion, rounded_m[id(recording)], driven=driven)
        notes += [f"{recording.name}: {note}"] if note else []
        parts.append(fixes)
    return in_order(parts)


def of_one_receiver(placed: Sequence[Placed]) -> tuple[list[Placed], tuple[str, ...]]:
    """Return recordings without positions that repeat those of another one, and notes on these.

    Of files by one program that name their provider the best one goes first. Positions within half
    a metre, nearly everywhere on a way, are those of one receiver, written twice: two receivers
    differ by more. Those go first that state an accuracy, then those of the larger file. Left out
    are those of moments at which another file has one: a file may hold a part of the journey.

    Parameters
    ----------
    placed : sequence of (Recording, pandas.DataFrame)
        Measured positions on one clock, in order.
    """
    kept: list[Placed] = []
    notes = []
    for recording, rows in sorted(placed, key=_precedence):
        left = rows
        for other, first in kept:
            better = _rank(other) < _rank(recording) and other.format == recording.format
            if not (better or _same(first, rows)):
                continue
            repeated = _near(first, left)
            if not repeated.any():
                continue
            why = "as they are of another provider" if better else "as they are the same"
            notes.append(
                f"{recording.name}: {number_of(int(repeated.sum()), 'position')} left out "
                f"beside {other.name}, {why}"
            )
            left = left[~repeated].reset_index(drop=True)
        if len(left):
            kept.append((recording, left))
    order = [id(recording) for recording, _ in placed]
    return sorted(kept, key=lambda pair: order.index(id(pair[0]))), tuple(notes)


def without_held(
    gnss: pd.DataFrame,
    motion: pd.DataFrame | None,
    rounded_m: float = 0.0,
    *,
    driven: bool = False,
) -> tuple[pd.DataFrame, str]:
    """Return fixes without those that stay where they are while the phone moves, and a note.

    A receiver without satellites, or a program, may repeat its last position for minutes. Of equal
    positions over more than 10 s, in which motion goes more than 50 m, the first one stays. Those
    of rounded degrees are equal on a longer way. Wheels, which do not turn where one stands, show
    it also of positions within 3 m, over more than 100 m.

    Parameters
    ----------
    gnss : pandas.DataFrame
        time_s, east_m and north_m, in order.
    motion : pandas.DataFrame or None
        time_s and step_m.
    rounded_m : float
        The step of rounded degrees, see :func:`mapfilter.tracks.checks.rounded_degrees.rounding_m`.
    driven : bool
        Whether motion is that of wheels.

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
    moved_s = motion["time_s"].to_numpy(dtype=np.float64)
    way_m = np.interp(time_s, moved_s, np.cumsum(moved))
    changed = np.concatenate([[True], (np.diff(east_m) != 0) | (np.diff(north_m) != 0)])
    first = np.flatnonzero(changed)
    last = np.append(first[1:], len(gnss)) - 1
    moved_m = max(_MOVED_M, _CELLS * rounded_m)
    held = (time_s[last] - time_s[first] > _HELD_S) & (way_m[last] - way_m[first] > moved_m)
    first, last = first[held], last[held]
    if driven:
        places = east_m + 1j * north_m
        # The noise of speeds at rest adds up to a way.
        moved[moved < _STANDING_MPS * np.diff(moved_s, prepend=moved_s[:1])] = 0.0
        way_m = np.interp(time_s, moved_s, np.cumsum(moved))
        stay = _stays(time_s, places, way_m, max(_STAY_MOVED_M, _CELLS * rounded_m))
        first, last = (
            np.append(some, more) for some, more in zip((first, last), stay, strict=True)
        )
    if not first.size:
        return gnss, ""
    dropped = np.zeros(len(gnss), dtype=np.bool_)
    for begin, end in zip(first.tolist(), last.tolist(), strict=True):
        dropped[begin + 1 : end + 1] = True
    longest_s = float((time_s[last] - time_s[first]).max())
    gone_m = float((way_m[last] - way_m[first]).max())
    near = "the same" if held.any() else f"within {_STAY_M:g} m"
    note = (
        f"gnss: {number_of(int(dropped.sum()), 'position')} left out, as they stay {near} for up "
        f"to {longest_s:.0f} s while motion goes {gone_m:.0f} m (likely: held by a receiver "
        "without satellites)"
    )
    return gnss[~dropped].reset_index(drop=True), note


def _stays(time_s: Floats, places: np.ndarray, way_m: Floats, moved_m: float) -> tuple[Ints, Ints]:
    """Return first and last rows of stretches that stay near their first place on a way."""
    later = np.searchsorted(way_m, way_m + moved_m, side="right")
    rows = np.flatnonzero(later < len(places))
    near = np.abs(places[later[rows]] - places[rows]) <= _STAY_M
    found, end = [], -1
    for begin in rows[near].tolist():
        if begin <= end:
            continue
        # Who is back after a way round has not stayed.
        if (np.abs(places[begin : later[begin]] - places[begin]) > _STAY_M).any():
            continue
        left = np.abs(places[begin:] - places[begin]) > _STAY_M
        last = begin + int(np.argmax(left)) - 1 if left.any() else len(places) - 1
        lasted_s = time_s[last] - time_s[begin]
        # Few positions, hours apart, are of one who comes back.
        is_dense = last - begin >= 2 and np.diff(time_s[begin : last + 1]).max() <= _HELD_APART_S
        if is_dense and lasted_s > _HELD_S and way_m[last] - way_m[begin] > moved_m:
            found.append((begin, last))
            end = last
    first, last_rows = np.array(found, dtype=np.int64).reshape(-1, 2).T
    return first, last_rows


def _stated_notes(placed: Sequence[Placed], truth: pd.DataFrame | None) -> list[str]:
    """Return notes on plain CSV whose positions state far smaller errors than others show."""
    notes = []
    for recording, fixes in placed:
        if recording.format != "csv":
            continue
        others = [(one.name, rows) for one, rows in placed if one is not recording]
        if truth is not None and len(truth):
            others = [("the truth", truth), *others]
        found = (stated_note(fixes, rows, name) for name, rows in others)
        if note := next(filter(None, found), ""):
            notes.append(f"{recording.name}: {note}")
    return notes


def _rank(recording: Recording) -> int:
    """Return the number of the provider of all positions of a recording."""
    rows = recording.tables.get("positions")
    if rows is None or "provider" not in rows:
        return 0
    named = rows["provider"].dropna().unique()
    name = str(named[0]).lower() if len(named) == 1 else ""
    return PROVIDERS.index(name) if name in PROVIDERS else 0


def _precedence(placed: Placed) -> tuple[int, bool, int]:
    recording, rows = placed
    stated = "var_east_m2" in rows and bool(rows["var_east_m2"].notna().any())
    return _rank(recording), not stated, -len(rows)


def _same(one: pd.DataFrame, other: pd.DataFrame) -> bool:
    """Return whether positions of common moments are the same; those of half of a file at least."""
    (time_s, east_m, north_m), (at_s, *there_m) = _columns(one), _columns(other)
    inside = _near(one, other)
    if inside.sum() < max(_FEWEST, _COMMON * min(len(one), len(other))):
        return False
    # Beside the ends nothing tells where the receiver was.
    inside &= (at_s >= time_s[0]) & (at_s <= time_s[-1])
    if not inside.any():
        return False
    off_m = np.hypot(
        np.interp(at_s, time_s, east_m) - there_m[0], np.interp(at_s, time_s, north_m) - there_m[1]
    )[inside]
    moved = float(np.hypot(np.ptp(there_m[0][inside]), np.ptp(there_m[1][inside])))
    return bool(moved > _MOVED_M and np.quantile(off_m, 0.9) < _SAME_M)


def _near(one: pd.DataFrame, other: pd.DataFrame) -> Bools:
    """Return which rows of the other table have one of the first near them in time."""
    time_s, at_s = (rows["time_s"].to_numpy(dtype=np.float64) for rows in (one, other))
    usual_s = float(np.median(np.diff(time_s))) if time_s.size > 1 else 0.0
    after = np.searchsorted(time_s, at_s)
    off_s = np.minimum(
        np.abs(time_s[np.minimum(after, time_s.size - 1)] - at_s),
        np.abs(time_s[np.maximum(after - 1, 0)] - at_s),
    )
    return np.asarray(off_s <= max(_NEAR_S, _NEAR * usual_s), dtype=np.bool_)


def _columns(rows: pd.DataFrame) -> tuple[Floats, Floats, Floats]:
    time_s, east_m, north_m = (
        rows[name].to_numpy(dtype=np.float64) for name in ("time_s", "east_m", "north_m")
    )
    return time_s, east_m, north_m
