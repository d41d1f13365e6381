"""Checks of a log's tables against each other: clocks, units of times, steps and turns."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import UTC, datetime

import numpy as np
import pandas as pd

from mapfilter._constants import DAY_S
from mapfilter._types import Floats
from mapfilter.clocks.times import are_days
from mapfilter.errors import Faults
from mapfilter.lattice import Lattice
from mapfilter.tracks.checks.clock_notes import week_fault
from mapfilter.tracks.checks.exchanged import sideways_mps2
from mapfilter.tracks.checks.misplaced import FAR_M, misplaced_by
from mapfilter.tracks.checks.second_deliveries import once_each
from mapfilter.tracks.joining.moved import UNDIRECTED

# Tables may begin this long after another ends.
_APART_S = 600.0
# Between these, one duration is taken for milliseconds of another.
_TIMES_MS = (300.0, 3000.0)
_EARLY_S = 30.0
_EARLY_SHARE = 0.1
_EARLIEST_UTC_S = datetime(1, 1, 1, tzinfo=UTC).timestamp()
_USUAL_UTC_S = tuple(datetime(year, 1, 1, tzinfo=UTC).timestamp() for year in (1980, 2100))
"""Logs begin between these: not before GPS."""
_MOST_S = 1e11
_YEAR_S = 365.2425 * DAY_S
TIMES_BEGIN = "times begin in"
"""Words by which notes on an odd start are known."""
_FEW_ROWS = 10
_MANY_ROWS = 20
_FASTEST_MPS = 100.0
_SLOWEST_MPS = 0.02
_LONG_S = 60.0
_MOSTLY = 2 / 3
_SOMEWHERE_M = 100.0
# Between these, positions lie apart by the kilometres of the steps, or a part of them.
_KILO = (100.0, 1200.0)
_FASTEST_KMPS = 0.1
_AREA_M = 100.0
_TURNING_SHARE = 0.2
_EXPECTED = "metres moved in each interval"
_SINCE_START = "distance since the start; give its differences"
_COUNTER = (
    "a counter of steps, --column steps=COLUMN of a CSV; or distance since the start, then give "
    "its differences"
)


def check_clocks(
    tables: Mapping[str, pd.DataFrame], names: Mapping[str, str], faults: Faults
) -> None:
    """Note tables that do not overlap in time, or last about 1000 times as long as another.

    At most one fault is added, since it takes two tables to disagree.
    """
    filled = {names.get(table, table): rows for table, rows in tables.items() if len(rows)}
    times = {name: np.unique(rows["time_s"].to_numpy()) for name, rows in filled.items()}
    if len(times) < 2:
        return
    gap_s = max(time[0] for time in times.values()) - min(time[-1] for time in times.values())
    hint = _milliseconds(times)
    if gap_s > _APART_S and not hint:
        hint = week_fault(gap_s)
        hint = hint or (
            "seconds of the day, or Unix time, in one of them, milliseconds for s, or local time "
            "of another zone"
        )
    if hint:
        spans = "; ".join(f"{name} {time[0]:.10g}..{time[-1]:.10g}" for name, time in times.items())
        whole = names.get("log", "log")
        faults.add(f"{whole}, time_s", "tables that overlap in time", spans, hint)


def check_days(
    tables: Mapping[str, pd.DataFrame], names: Mapping[str, str], faults: Faults
) -> None:
    """Note tables whose times are days of a spreadsheet: a walk would last milliseconds."""
    for table, rows in tables.items():
        time_s = rows["time_s"].to_numpy()
        if len(rows) >= _FEW_ROWS and are_days(time_s):
            got = f"{time_s[0]:.6f} to {time_s[-1]:.6f}"
            hint = "days of a spreadsheet; take the first from them, and multiply by 86400"
            faults.add(f"{names.get(table, table)}, time_s", "seconds", got, hint)


def ends_early(before_s: float, whole_s: float) -> bool:
    """Return whether rows that end some time before the others look cut off."""
    return before_s > max(_EARLY_S, _EARLY_SHARE * whole_s)


def early_ends(tables: Mapping[str, pd.DataFrame]) -> tuple[str, ...]:
    """Return a note where motion or radio ends long before the other one, as if cut off."""
    filled = [table for table in ("motion", "radio") if len(tables[table])]
    ends_s = {table: float(tables[table]["time_s"].iloc[-1]) for table in filled}
    if len(ends_s) < 2:
        return ()
    (first, first_s), (last, last_s) = sorted(ends_s.items(), key=lambda end: end[1])
    begin_s = min(float(rows["time_s"].iloc[0]) for rows in tables.values() if len(rows))
    if not ends_early(last_s - first_s, last_s - begin_s):
        return ()
    return (f"{first}: ends {last_s - first_s:.0f} s before {last}, as if cut off",)


def truth_far_off(crs: str, tables: Mapping[str, pd.DataFrame]) -> tuple[str, ...]:
    """Return a note where fixes lie kilometres from the truth of the same times; none else.

    Parameters
    ----------
    crs : str
        That of the positions.
    """
    if min(len(tables[name]) for name in ("truth", "gnss")) < _FEW_ROWS:
        return ()
    truth, fixes = (tables[name].drop_duplicates("time_s") for name in ("truth", "gnss"))
    inside = fixes[fixes["time_s"].between(truth["time_s"].min(), truth["time_s"].max())]
    if len(truth) < _FEW_ROWS or len(inside) < _FEW_ROWS:
        return ()
    east_m, north_m = (inside[name].to_numpy() for name in ("east_m", "north_m"))
    true_east_m, true_north_m = (
        np.interp(inside["time_s"], truth["time_s"], truth[name]) for name in ("east_m", "north_m")
    )
    off_m = float(np.median(np.hypot(east_m - true_east_m, north_m - true_north_m)))
    if not off_m > FAR_M:
        return ()
    low, high = (truth[["east_m", "north_m"]].agg(of) for of in ("min", "max"))
    # A truth at rest has an extent, too.
    bounds_m = (*(low - _AREA_M).tolist(), *(high + _AREA_M).tolist())
    area = Lattice.covering(crs, bounds_m, _AREA_M)
    mistake = misplaced_by(east_m, north_m, area)
    likely = (
        f"{mistake} in one of them" if mistake else "another journey, or fixes that were spoofed"
    )
    return (f"gnss lies {off_m / 1000:.1f} km from the truth (median) (likely: {likely})",)


def check_start(
    start_utc_s: float, tables: Mapping[str, pd.DataFrame], faults: Faults, whole: str
) -> None:
    """Note a start or times that are no dates within the years 1 to 9999."""
    if np.isnan(start_utc_s):
        return
    where = f"{whole}, start_utc_s"
    if not abs(start_utc_s) <= _MOST_S:
        hint = "milliseconds for s" if np.isfinite(start_utc_s) else ""
        faults.add(where, "UTC seconds", start_utc_s, hint)
        return
    # Times are at most 1e11 s, too: none comes near the year 9999.
    first_s = min((float(rows["time_s"].min()) for rows in tables.values() if len(rows)), default=0)
    if start_utc_s + min(first_s, 0.0) < _EARLIEST_UTC_S:
        got = f"{start_utc_s:.15g}, and times from {first_s:g} s on"
        faults.add(where, "UTC seconds, not before the year 1", got)


def odd_start(
    start_utc_s: float, tables: Mapping[str, pd.DataFrame], whole: str
) -> tuple[str, ...]:
    """Return a note on a log that begins before 1980 or after 2099, or counts Unix time twice.

    Examples
    --------
    >>> odd_start(1.78e9, {"motion": pd.DataFrame({"time_s": [0.0, 1.0]})}, "log")
    ()
    >>> odd_start(1.78e9, {"motion": pd.DataFrame({"time_s": [1.78e9]})}, "log.json")[0]
    'log.json, start_utc_s: times begin in 2082 (likely: time_s are Unix times already, and \
start_utc_s is added: take it from them)'
    """
    first_s = min((float(rows["time_s"].min()) for rows in tables.values() if len(rows)), default=0)
    begin_s, (low, high) = start_utc_s + first_s, _USUAL_UTC_S
    twice = min(start_utc_s, first_s) >= low
    if not np.isfinite(begin_s) or (low <= begin_s < high and not twice):
        return ()
    if twice:
        likely = "time_s are Unix times already, and start_utc_s is added: take it from them"
    elif begin_s < low:
        likely = (
            "seconds since another moment than 1970-01-01, or 0 for an unknown start: leave it out"
        )
    else:
        likely = "seconds since another moment than 1970-01-01"
    year = 1970 + begin_s // _YEAR_S
    return (f"{whole}, start_utc_s: {TIMES_BEGIN} {year:.0f} (likely: {likely})",)


def _milliseconds(times: Mapping[str, Floats]) -> str:
    # A burst of a second in a long log, or a table with rare rows, fulfils one of two conditions.
    paced = {name: time for name, time in times.items() if len(time) >= 3}
    low, high = _TIMES_MS
    for name, time in paced.items():
        for other in paced.values():
            with np.errstate(over="ignore"):
                longer = np.ptp(time) / np.ptp(other)
                seldomer = np.median(np.diff(time)) / np.median(np.diff(other))
            if low <= longer <= high and low <= seldomer <= high:
                return f"milliseconds for s in {name}"
    return ""


def check_steps(tables: Mapping[str, pd.DataFrame], where: str, faults: Faults) -> tuple[str, ...]:
    """Note steps that are cumulative, backwards or in another unit; return notes on odd ones."""
    motion = once_each(tables["motion"])
    time_s, step_m = motion["time_s"].to_numpy(), motion["step_m"].to_numpy()
    time_s, step_m = time_s[np.isfinite(step_m)], step_m[np.isfinite(step_m)]
    if len(step_m) < _FEW_ROWS:
        return ()
    lasted_s, moved_m = float(np.ptp(time_s)), float(np.abs(step_m).sum())
    between_s = np.diff(time_s)
    with np.errstate(over="ignore"):
        speed_mps = np.abs(step_m[1:])[between_s > 0] / between_s[between_s > 0]
    typical_mps = float(np.median(speed_mps)) if speed_mps.size else 0.0
    is_slow, moving = typical_mps < _FASTEST_KMPS, step_m[step_m != 0]
    extent_m = _extent_m(tables, float(time_s[0]), float(time_s[-1]))
    column = f"{where}, step_m"
    growth_m = np.diff(step_m)
    long = len(step_m) >= _MANY_ROWS and lasted_s >= _LONG_S / 3
    low, high = _KILO
    if long and np.all(growth_m >= 0) and np.mean(growth_m > 0) > 0.5:
        # A car that speeds up does not do so for long.
        got = f"steps that only grow, from {step_m[0]:g} to {step_m[-1]:g}"
        is_count = bool(np.all(step_m == np.round(step_m)))
        faults.add(column, _EXPECTED, got, _COUNTER if is_count else _SINCE_START)
    elif typical_mps > _FASTEST_MPS:
        hint = "centimetres or millimetres given for metres, or distance since the start"
        faults.add(column, _EXPECTED, f"{typical_mps:.0f} m/s in the median", hint)
    elif moving.size >= _FEW_ROWS and np.mean(moving < 0) > _MOSTLY:
        got = f"{int(np.sum(moving < 0))} negative steps of {moving.size}"
        faults.add(column, f"{_EXPECTED} along its heading", got, "a sign the other way round")
    elif is_slow and extent_m > _SOMEWHERE_M and low * moved_m < extent_m <= high * moved_m:
        got = f"{moved_m:.3g} m in all, while positions lie {extent_m:.0f} m apart"
        faults.add(column, _EXPECTED, got, "kilometres given for metres")
    elif lasted_s >= _LONG_S and 0 < moved_m < _SLOWEST_MPS * lasted_s:
        note = f"motion, step_m: only {moved_m:.3g} m in {lasted_s:.0f} s; kilometres for metres?"
        return (note,)
    return ()


def check_turns(motion: pd.DataFrame, where: str, faults: Faults) -> None:
    """Note turns that beside the steps push sideways more than tyres or feet hold.

    Turns of a second are added up: from row to row those of a compass are mostly noise.
    """
    if motion.empty or motion["turn_rad"].isna().all():
        return
    time_s = motion["time_s"].to_numpy()
    first = np.flatnonzero(np.diff(np.floor(time_s), prepend=np.nan) != 0)
    last = np.append(first[1:], len(time_s)) - 1
    step_m, turn_rad = (
        np.add.reduceat(np.nan_to_num(motion[name].to_numpy()), first)
        for name in ("step_m", "turn_rad")
    )
    lasted_s = np.diff(time_s[last], prepend=np.nan)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        lasted_s = np.where(lasted_s > 0, lasted_s, np.nan)
        most = sideways_mps2(step_m / lasted_s, turn_rad / lasted_s, _TURNING_SHARE)
    if most:
        got = f"{most:.0f} m/s² sideways (speed times rate of turning) in {_TURNING_SHARE:.0%} of "
        got += "the time or more"
        expected = "radians turned in each interval, as tyres or feet hold them"
        faults.add(f"{where}, turn_rad", expected, got, "degrees given for radians")


def undirected_note(motion: pd.DataFrame, where: str) -> tuple[str, ...]:
    """Return a note on steps without any heading or turn; none of a few rows.

    Examples
    --------
    >>> walk = pd.DataFrame({"step_m": [1.4] * 10, "heading_rad": np.nan, "turn_rad": np.nan})
    >>> undirected_note(walk, "motion")[0][:58]
    'motion: no headings and no turns (heading_rad or turn_rad)'
    >>> undirected_note(walk.assign(turn_rad=0.0), "motion")
    ()
    """
    if len(motion) < _FEW_ROWS or not (motion["step_m"].abs() > 0).any():
        return ()
    # The first row turns by nothing.
    if motion["heading_rad"].notna().any() or motion["turn_rad"].iloc[1:].notna().any():
        return ()
    return (f"{where}: no headings and no turns (heading_rad or turn_rad): {UNDIRECTED}",)


def _extent_m(tables: Mapping[str, pd.DataFrame], first_s: float, last_s: float) -> float:
    """Return how far apart true positions or fixes lie within some time."""
    extents = []
    for places in (tables[table] for table in ("truth", "gnss")):
        time_s = places["time_s"].to_numpy()
        within = (time_s >= first_s) & (time_s <= last_s)
        if within.any():
            # Infinite places are a fault of their own.
            with np.errstate(invalid="ignore", over="ignore"):
                axes_m = (np.ptp(places[name].to_numpy()[within]) for name in ("east_m", "north_m"))
                extents.append(float(np.hypot(*axes_m)))
    return max(extents, default=0.0)
