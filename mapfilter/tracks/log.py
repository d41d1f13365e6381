"""The track log: the recording of one journey, as tables of events.

Missing values stay missing: nothing is dropped because one of its fields is unknown. Rows out of
order are sorted and exact duplicates dropped, with a note in the log. Rows of equal time are
processed in the order motion, gnss and pseudoranges, radio and tdoa: first move, then measure.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from typing import Any, get_args

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from mapfilter._types import Floats
from mapfilter.errors import Faults, InputError, fail
from mapfilter.geodesy import projected_crs, short_crs
from mapfilter.gnss.orbits import Almanac
from mapfilter.tracks.headings import heading_fault
from mapfilter.tracks.imu_noise import ImuNoise
from mapfilter.tracks.satellites import place_satellites
from mapfilter.tracks.schema import NEIGHBOUR, PLACE, TABLES, Kind, Without
from mapfilter.tracks.tables import tidy_table

_PART_OF: dict[Without, str] = {"fixes": "gnss", "ta": "radio", "neighbours": "radio"}
"""Tables of those parts that are not left out by the name of their table."""


# Tables may begin this long after another ends.
_APART_S = 600.0
# Between these, one duration is taken for milliseconds of another.
_TIMES_MS = (300.0, 3000.0)
_EARLY_S = 30.0
_EARLY_SHARE = 0.1
_EARLIEST_UTC_S = datetime(1, 1, 1, tzinfo=UTC).timestamp()
_MOST_S = 1e11
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
_EXPECTED = "metres moved in each interval"


def _check_clocks(
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
        hint = "seconds of the day, or Unix time, in one of them, or milliseconds for s"
    if hint:
        spans = "; ".join(f"{name} {time[0]:.10g}..{time[-1]:.10g}" for name, time in times.items())
        whole = names.get("log", "log")
        faults.add(f"{whole}, time_s", "tables that overlap in time", spans, hint)


def _early_ends(tables: Mapping[str, pd.DataFrame]) -> tuple[str, ...]:
    """Return a note where motion or radio ends long before the other one, as if cut off."""
    filled = [table for table in ("motion", "radio") if len(tables[table])]
    ends_s = {table: float(tables[table]["time_s"].iloc[-1]) for table in filled}
    if len(ends_s) < 2:
        return ()
    (first, first_s), (last, last_s) = sorted(ends_s.items(), key=lambda end: end[1])
    begin_s = min(float(rows["time_s"].iloc[0]) for rows in tables.values() if len(rows))
    if last_s - first_s <= max(_EARLY_S, _EARLY_SHARE * (last_s - begin_s)):
        return ()
    return (f"{first}: ends {last_s - first_s:.0f} s before {last}, as if cut off",)


def _check_start(
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


def _check_steps(tables: Mapping[str, pd.DataFrame], where: str, faults: Faults) -> tuple[str, ...]:
    """Note steps that are cumulative, backwards or in another unit; return notes on odd ones."""
    motion = tables["motion"]
    motion = motion[np.isfinite(motion["step_m"].to_numpy())]
    time_s, step_m = motion["time_s"].to_numpy(), motion["step_m"].to_numpy()
    if len(step_m) < _FEW_ROWS:
        return ()
    lasted_s, moved_m = float(np.ptp(time_s)), float(np.abs(step_m).sum())
    between_s = np.diff(time_s)
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
        faults.add(column, _EXPECTED, got, "distance since the start; give its differences")
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


def _extent_m(tables: Mapping[str, pd.DataFrame], first_s: float, last_s: float) -> float:
    """Return how far apart true positions or fixes lie within some time."""
    every = (tables[table] for table in ("truth", "gnss"))
    within = (places[places["time_s"].between(first_s, last_s)] for places in every)
    extents = (np.hypot(np.ptp(p["east_m"]), np.ptp(p["north_m"])) for p in within if len(p))
    return float(max(extents, default=0.0))


@dataclass(frozen=True, eq=False, repr=False)
class TrackLog:
    """The recording of one journey; made by :func:`make_log`, which checks everything.

    Parameters
    ----------
    crs : str
        Projected CRS of all positions, as :func:`mapfilter.geodesy.projected_crs` returns it.
    start_utc_s : float
        UTC seconds (Unix time) at which ``time_s`` is zero; NaN where unknown.
    motion : pandas.DataFrame
        time_s, step_m, heading_rad, turn_rad: the interval that *ends* at time_s and begins at the
        previous row. Headings are radians counter-clockwise from grid east in [-π, π); NaN where
        unknown.
    radio : pandas.DataFrame
        time_s, role ("serving" or "neighbour"), cell (str or None), arfcn, bsic (nullable
        integers), level_dbm, censored (-1 below the scale, 0 inside, 1 above), timing_advance
        (nullable): one row for each cell received.
    gnss : pandas.DataFrame
        time_s, east_m, north_m, var_east_m2, var_north_m2, cov_east_north_m2.
    pseudoranges : pandas.DataFrame
        time_s, satellite ("G07": its constellation's letter and number), pseudorange_m, sigma_m,
        and where the satellite was, earth-centred: x_m, y_m, z_m. One row for each satellite
        received. NaN: not measured or not known.
    tdoa : pandas.DataFrame
        time_s, cell, reference, difference_m (how much farther the cell is than the reference),
        sigma_m and reference_sigma_m: of each one's time of arrival, as distances.
    truth : pandas.DataFrame
        time_s, east_m, north_m, way_id (nullable integer).
    notes : tuple of str
        What was sorted, dropped and ignored.
    imu : ImuNoise or None
        Errors of ``motion``, as measured when it was made of raw sensors; None where unknown.
    """

    crs: str
    start_utc_s: float
    motion: pd.DataFrame
    radio: pd.DataFrame
    gnss: pd.DataFrame
    pseudoranges: pd.DataFrame
    tdoa: pd.DataFrame
    truth: pd.DataFrame
    notes: tuple[str, ...] = ()
    imu: ImuNoise | None = None

    def __repr__(self) -> str:
        """Return CRS, duration, start and the number of rows per table."""
        began = ""
        if np.isfinite(self.start_utc_s):
            start = datetime.fromtimestamp(self.start_utc_s, UTC)
            began = f" from {start.isoformat(' ', 'seconds').removesuffix('+00:00')} UTC"
        rows = [f"{table} {n}" for table in TABLES if (n := len(getattr(self, table)))]
        held = f"rows: {', '.join(rows) or 'none'}"
        notes = f"; {len(self.notes)} notes" if self.notes else ""
        crs = short_crs(self.crs)
        return f"TrackLog({crs}, {self.duration_s:.1f} s{began}; {held}{notes})"

    @property
    def duration_s(self) -> float:
        """Seconds from the first to the last row of any table; 0 for an empty log."""
        times = np.concatenate([getattr(self, name)["time_s"].to_numpy() for name in TABLES])
        return float(np.ptp(times)) if len(times) else 0.0

    @property
    def truth_length_m(self) -> float:
        """Length of the true path, metres; 0 where the truth is unknown."""
        east, north = self.truth["east_m"].to_numpy(), self.truth["north_m"].to_numpy()
        return float(np.sum(np.hypot(np.diff(east), np.diff(north))))


def _seconds(
    given: Mapping[str, Any], start_utc_s: float, names: Mapping[str, str], faults: Faults
) -> tuple[dict[str, pd.DataFrame], float]:
    """Convert timestamps to seconds; return the tables and the start in UTC seconds."""
    tables: dict[str, pd.DataFrame] = {}
    times: dict[str, pd.Series] = {}
    for table, rows in given.items():
        where = names.get(table, table)
        if not isinstance(rows, pd.DataFrame):
            faults.add(where, "a pandas.DataFrame", type(rows).__name__)
            continue
        if not rows.columns.is_unique:
            twice = ", ".join(map(str, rows.columns[rows.columns.duplicated()].unique()))
            faults.add(where, "each column once", f"{twice} more often")
            continue
        tables[table] = rows
        name = "time_s" if "time_s" in rows else "time"
        time = rows[name].infer_objects() if name in rows else pd.Series(dtype=float)
        if isinstance(time.dtype, pd.DatetimeTZDtype):
            tables[table], times[table] = rows.drop(columns=name), time
        elif pd.api.types.is_datetime64_any_dtype(time.dtype):
            hint = 'UTC or local time? add it, such as by .dt.tz_localize("UTC")'
            faults.add(f"{where}, {name}", "timestamps with a time zone", "none", hint)
            del tables[table]
    known = [time.min() for time in times.values() if time.notna().any()]
    if known and np.isnan(start_utc_s):
        origin, offset_s = min(known), 0.0
        start_utc_s = origin.timestamp()
        if plain := [names.get(t, t) for t in tables if t not in times and len(tables[t])]:
            got, hint = f"seconds in {', '.join(plain)}", "give start_utc_s, UTC seconds at 0"
            faults.add("log, time_s", "timestamps in every table, or a start", got, hint)
    else:
        origin, offset_s = pd.Timestamp(0, tz="UTC"), start_utc_s
    for table, time in times.items():
        time_s = (time - origin).dt.total_seconds() - offset_s
        tables[table] = tables[table].assign(time_s=time_s)
    return tables, start_utc_s


def make_log(
    crs: Any,
    *,
    motion: pd.DataFrame | None = None,
    radio: pd.DataFrame | None = None,
    gnss: pd.DataFrame | None = None,
    truth: pd.DataFrame | None = None,
    pseudoranges: pd.DataFrame | None = None,
    tdoa: pd.DataFrame | None = None,
    almanac: Almanac | None = None,
    start_utc_s: float = float("nan"),
    notes: Sequence[str] = (),
    imu: ImuNoise | None = None,
    names: Mapping[str, str] | None = None,
    row_numbers: Mapping[str, ArrayLike] | None = None,
) -> TrackLog:
    """Check tables and make them a log.

    Parameters
    ----------
    crs : str
        Projected CRS in metres, in any form that pyproj knows.
    motion, radio, gnss, truth, pseudoranges, tdoa : pandas.DataFrame, optional
        Tables with the columns of :class:`TrackLog`. Required are only ``time_s``, ``role``
        (radio), ``east_m`` and ``north_m`` (gnss, truth), ``satellite`` (pseudoranges), ``cell``
        and ``reference`` (tdoa). Instead of ``time_s`` in seconds there may be timestamps with a
        time zone, in a column ``time_s`` or ``time``: then the first of all is second 0.
    almanac : Almanac, optional
        Gives the places of satellites where their rows have none; requires a known start.
    start_utc_s : float
        UTC seconds (Unix time) at which ``time_s`` is zero; NaN where unknown, or given by the
        timestamps.
    notes : sequence of str
        Earlier notes on the tables.
    imu : ImuNoise, optional
        Errors of ``motion``, where they were measured.
    names : mapping, optional
        Name of each table (such as its file) in messages; ``log`` for the whole.
    row_numbers : mapping, optional
        Numbers of each table's rows in messages; counted from 1 by default.

    Raises
    ------
    InputError
        With every fault: NaN or infinity in times or coordinates, text for numbers, values out of
        their range, columns missing or misspelt, milliseconds for seconds, degrees for metres or
        for radians, steps that are none, raw RXLEV for dBm, a CRS that is not projected, tables
        that do not overlap in time, a start outside the years 1 to 9999, an almanac of another
        time, or one without a start.

    Examples
    --------
    >>> walk = pd.DataFrame({"time_s": [2.0, 1.0, 2.0], "step_m": [1.5, 1.4, 1.5]})
    >>> log = make_log("EPSG:32629", motion=walk)
    >>> log.motion["step_m"].tolist(), log.duration_s
    ([1.4, 1.5], 1.0)
    >>> print(*log.notes, sep="; ")
    motion: 1 exact duplicate rows dropped; motion: out of order in 1 places, sorted by time
    >>> seen = pd.to_datetime(["2026-05-01 12:00:00+02:00", "2026-05-01 12:00:30+02:00"])
    >>> make_log("EPSG:32629", motion=pd.DataFrame({"time": seen, "step_m": [30.0, 33.0]}))
    TrackLog(EPSG:32629, 30.0 s from 2026-05-01 10:00:00 UTC; rows: motion 2)
    """
    # Each table is an argument by its name: one without an argument is an error in every call.
    arguments = locals()
    faults, called, numbers = Faults(), names or {}, row_numbers or {}
    whole = called.get("log", "log")
    try:
        if isinstance(crs, pd.DataFrame):
            hint = "tables are given by name: make_log(crs, motion=…)"
            raise fail(InputError, f"{whole}, crs", "such as EPSG:32629", "a table", hint)
        crs = projected_crs(crs, f"{whole}, crs")
    except InputError as error:
        faults.found.extend(error.faults)
    present = {table: rows for table in TABLES if (rows := arguments[table]) is not None}
    given, start_utc_s = _seconds(present, float(start_utc_s), called, faults)
    tables, every_note = dict[str, pd.DataFrame](), tuple(notes)
    for table in TABLES:
        name, number = called.get(table, table), numbers.get(table)
        tables[table], more = tidy_table(table, given.get(table), name, faults, number)
        every_note += more
    _check_start(start_utc_s, tables, faults, whole)
    if not any(fault.where.endswith("time_s") for fault in faults.found):
        _check_clocks(tables, called, faults)
        every_note += _check_steps(tables, called.get("motion", "motion"), faults)
        every_note += _early_ends(tables)
        places = next((tables[name] for name in ("truth", "gnss") if len(tables[name]) > 1), None)
        if places is not None and (wrong := heading_fault(tables["motion"], places)):
            every_note += (f"{called.get('motion', 'motion')}, heading_rad: {wrong}",)
    faults.raise_if_any(InputError)
    placeless = int(tables["pseudoranges"][list(PLACE)].isna().any(axis=1).sum())
    if almanac is None and placeless:
        why = "without the place of their satellite: give the day's navigation file (RINEX), too"
        every_note += (f"pseudoranges: {placeless} rows {why}",)
    if almanac is not None:
        where, rows = called.get("pseudoranges", "pseudoranges"), tables["pseudoranges"]
        tables["pseudoranges"], more = place_satellites(rows, almanac, start_utc_s, where)
        every_note += more
    return TrackLog(
        str(crs), start_utc_s, **tables, notes=tuple(dict.fromkeys(every_note)), imu=imu
    )


def rows_by_kind(log: TrackLog) -> dict[Kind, pd.DataFrame]:
    """Return the rows of each kind of measurement."""
    found: dict[Kind, pd.DataFrame] = {}
    for name, table in TABLES.items():
        rows = getattr(log, name)
        for kind in table.kinds:
            found[kind] = rows if len(table.kinds) == 1 else rows[rows["role"] == kind]
    return found


def leave_out(log: TrackLog, kinds: Collection[Without]) -> TrackLog:
    """Return a log without some kinds of measurements; its notes count them.

    Parameters
    ----------
    kinds : collection of str
        Tables by their names, such as ``tdoa`` and ``radio`` (all reports); ``gnss`` leaves out
        ``fixes`` and ``pseudoranges``. Of the reports: ``ta`` (timing advances) and ``neighbours``
        (all cells but the serving one).

    Examples
    --------
    >>> received = pd.DataFrame({"time_s": [0.0, 0.0], "role": ["serving", "neighbour"]})
    >>> log = make_log("EPSG:32635", radio=received.assign(timing_advance=[1, None]))
    >>> alone = leave_out(log, ["neighbours", "ta"])
    >>> alone.radio["role"].tolist(), alone.radio["timing_advance"].isna().all()
    (['serving'], np.True_)
    >>> print(*alone.notes, sep="; ")
    ta: 1 left out; neighbours: 1 left out
    """
    wanted, notes = set(kinds), list(log.notes)
    if "gnss" in wanted:
        wanted.discard("fixes")
        if len(log.pseudoranges):
            wanted.add("pseudoranges")
    if "radio" in wanted:
        wanted.discard("neighbours")
    for kind in (one for one in get_args(Without) if one in wanted):
        table = _PART_OF.get(kind, kind)
        rows = getattr(log, table)
        if kind == "ta":
            count = int(rows["timing_advance"].notna().sum())
            kept = rows.assign(timing_advance=pd.array([pd.NA] * len(rows), dtype="Int64"))
        elif kind == "neighbours":
            neighbour = rows["role"] == NEIGHBOUR
            count, kept = int(neighbour.sum()), rows[~neighbour].reset_index(drop=True)
        else:
            count, kept = len(rows), rows.iloc[:0]
        log = replace(log, **{table: kept})
        notes.append(f"{kind}: {count} left out")
    return replace(log, notes=tuple(notes))
