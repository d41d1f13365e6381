"""The track log: the recording of one journey, as tables of events.

Missing values stay missing: nothing is dropped because one of its fields is unknown. Rows out of
order are sorted and exact duplicates dropped, with a note in the log. Rows of equal time are
processed in the order motion, gnss and pseudoranges, radio and tdoa: first move, then measure.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from numbers import Real
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from mapfilter._arguments import Argument, Entries, Setting, check_arguments, items
from mapfilter._html import html_table, shortened
from mapfilter._same import EqualByContent
from mapfilter._types import Floats
from mapfilter._words import number_of
from mapfilter.errors import Faults, InputError, fail
from mapfilter.geodesy import projected_crs, short_crs
from mapfilter.gnss.almanacs import Almanac
from mapfilter.gnss.broadcast import UNPLACED
from mapfilter.tracks.checks.beyond_crs import check_metres
from mapfilter.tracks.checks.clock_steps import with_clocks_gone_on
from mapfilter.tracks.checks.log_checks import (
    TIMES_BEGIN,
    check_clocks,
    check_days,
    check_start,
    check_steps,
    check_turns,
    early_ends,
    odd_start,
    truth_far_off,
    undirected_note,
)
from mapfilter.tracks.checks.misplaced import FAR_APART
from mapfilter.tracks.checks.missing_levels import WITHOUT_LEVELS, levels_note
from mapfilter.tracks.checks.motion_faults import compared_places, motion_faults
from mapfilter.tracks.imu_noise import ImuNoise
from mapfilter.tracks.joining.geographic import in_metres
from mapfilter.tracks.joining.moved import UNDIRECTED
from mapfilter.tracks.log_times import seconds_of_tables
from mapfilter.tracks.satellites import place_satellites
from mapfilter.tracks.schema import PLACE, TABLES
from mapfilter.tracks.stated_crs import placed_in
from mapfilter.tracks.tables import tidy_table

_PLACED, _AXES = ("gnss", "truth"), ("east_m", "north_m")


@dataclass(frozen=True, eq=False, repr=False)
class TrackLog(EqualByContent):
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
    vehicle : bool or None
        Whether ``motion`` is a vehicle's, such as of its wheels; None where unknown.
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
    vehicle: bool | None = None

    def __hash__(self) -> int:  # type: ignore[override]
        """Return a hash of what is cheap to compare: equal logs have one hash."""
        start_utc_s = self.start_utc_s if np.isfinite(self.start_utc_s) else None
        return hash((self.crs, start_utc_s, *(len(getattr(self, table)) for table in TABLES)))

    def __repr__(self) -> str:
        """Return CRS, duration, start and the number of rows per table."""
        began = ""
        if np.isfinite(self.start_utc_s):
            start = datetime.fromtimestamp(self.start_utc_s, UTC)
            began = f" from {start.isoformat(' ', 'seconds').removesuffix('+00:00')} UTC"
        rows = [f"{table} {n}" for table in TABLES if (n := len(getattr(self, table)))]
        held = f"rows: {', '.join(rows) or 'none'}"
        notes = f"; {number_of(len(self.notes), 'note')}" if self.notes else ""
        crs = short_crs(self.crs)
        return f"TrackLog({crs}, {self.duration_s:.1f} s{began}; {held}{notes})"

    def _repr_html_(self) -> str:
        """Return a table, as notebooks show it."""
        began = "unknown"
        if np.isfinite(self.start_utc_s):
            began = datetime.fromtimestamp(self.start_utc_s, UTC).isoformat(" ", "seconds")
        rows = {f"rows of {name}": n for name in TABLES if (n := len(getattr(self, name)))}
        head = {"CRS": short_crs(self.crs), "start": began, "seconds": f"{self.duration_s:.1f}"}
        notes = {"notes": shortened(self.notes)} if self.notes else {}
        return html_table("Track log", {**head, **rows, **notes})

    @property
    def duration_s(self) -> float:
        """Seconds from the first to the last row of any table; 0 for an empty log."""
        times = np.concatenate([getattr(self, name)["time_s"].to_numpy() for name in TABLES])
        return float(np.ptp(times)) if len(times) else 0.0

    @property
    def fixes_m(self) -> Floats:
        """East and north of the GNSS fixes, (k, 2)."""
        fixes_m: Floats = self.gnss[["east_m", "north_m"]].to_numpy(dtype=np.float64)
        return fixes_m

    @property
    def truth_length_m(self) -> float:
        """Length of the true path, metres; 0 where the truth is unknown."""
        east, north = self.truth["east_m"].to_numpy(), self.truth["north_m"].to_numpy()
        return float(np.sum(np.hypot(np.diff(east), np.diff(north))))


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
    vehicle: bool | None = None,
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
        and ``reference`` (tdoa). Instead of variances gnss may have ``accuracy_m``, the radius that
        holds 68 % as phones state it. Instead of metres positions may have ``lat_deg`` and
        ``lon_deg``; rows in which both degrees are missing, or both 0, hold no fix and are left
        out. Instead of ``time_s`` in seconds there may be timestamps with a time zone, in a column
        ``time_s`` or ``time``: then the first of all is second 0.
    almanac : Almanac, optional
        Gives the places of satellites where their rows have none; requires a known start.
    start_utc_s : float
        UTC seconds (Unix time) at which ``time_s`` is zero; NaN where unknown, or given by the
        timestamps.
    notes : sequence of str
        Earlier notes on the tables.
    imu : ImuNoise, optional
        Errors of ``motion``, where they were measured.
    vehicle : bool, optional
        Whether ``motion`` is a vehicle's, where that is known.
    names : mapping, optional
        Name of each table (such as its file) in messages; ``log`` for the whole.
    row_numbers : mapping, optional
        Numbers of each table's rows in messages; counted from 1 by default.

    Raises
    ------
    InputError
        With every fault: NaN or infinity in times or coordinates, text for numbers, values out of
        their range, columns missing or misspelt, milliseconds for seconds, degrees for metres or
        for radians, steps that are none, raw RXLEV for dBm, a CRS that is not projected, or whose
        metres are none on the ground at the positions, tables that do not overlap in time, a
        start outside the years 1 to 9999, an almanac of another time, or one without a start.
    ConfigError
        An argument that is no table is of another type.

    Examples
    --------
    >>> walk = pd.DataFrame({"time_s": [2.0, 1.0, 2.0], "step_m": [1.5, 1.4, 1.5]})
    >>> log = make_log("EPSG:32629", motion=walk)
    >>> log.motion["step_m"].tolist(), log.duration_s
    ([1.4, 1.5], 1.0)
    >>> print(*log.notes, sep="; ")
    motion: 1 exact duplicate row dropped; motion: out of order in 1 place, sorted by time
    >>> seen = pd.to_datetime(["2026-05-01 12:00:00+02:00", "2026-05-01 12:00:30+02:00"])
    >>> make_log("EPSG:32629", motion=pd.DataFrame({"time": seen, "step_m": [30.0, 33.0]}))
    TrackLog(EPSG:32629, 30.0 s from 2026-05-01 10:00:00 UTC; rows: motion 2)
    """
    # Each table is an argument by its name: one without an argument is an error in every call.
    arguments = locals()
    check_arguments(
        "make_log",
        keywords=[
            Argument("almanac", almanac, Almanac | None, "an almanac"),
            Argument("start_utc_s", start_utc_s, Real, "UTC seconds, or NaN"),
            *items("notes", notes, str, "a text"),
            Argument("imu", imu, ImuNoise | None, "ImuNoise"),
            Setting("vehicle", vehicle, bool | None),
            Entries("names", names, str, "a text", "the name of each table"),
            Entries("row_numbers", row_numbers, object, "numbers", "the row numbers of each table"),
        ],
    )
    faults, called, numbers = Faults(), names or {}, row_numbers or {}
    whole = called.get("log", "log")
    try:
        if isinstance(crs, pd.DataFrame):
            hint = "tables are given by name: make_log(crs, motion=…)"
            raise fail(InputError, f"{whole}, crs", "such as EPSG:32629", "a table", hint)
        crs = projected_crs(crs, f"{whole}, crs")
    except InputError as error:
        faults.found.extend(error.faults)
    known = not faults.found
    present = {table: rows for table in TABLES if (rows := arguments[table]) is not None}
    given, start_utc_s = seconds_of_tables(present, float(start_utc_s), called, faults)
    given, of_clocks = with_clocks_gone_on(given, called)
    tables, every_note = dict[str, pd.DataFrame](), (*notes, *of_clocks)
    for table in TABLES:
        name, rows, number = called.get(table, table), given.get(table), numbers.get(table)
        if table in _PLACED and rows is not None:
            used = str(crs) if known else None
            rows, number, more = in_metres(table, rows, name, used, faults, number)
            every_note += more
        tables[table], more = tidy_table(table, rows, name, faults, number)
        every_note += more
    check_start(start_utc_s, tables, faults, whole)
    check_days(tables, called, faults)
    if not any(fault.where.endswith("time_s") for fault in faults.found):
        check_clocks(tables, called, faults)
        every_note += check_steps(tables, called.get("motion", "motion"), faults)
        check_turns(tables["motion"], called.get("motion", "motion"), faults)
        every_note += early_ends(tables)
        if not any(WITHOUT_LEVELS in note for note in every_note):
            every_note += levels_note(tables["radio"], called.get("radio", "radio"))
        if not any(TIMES_BEGIN in note for note in every_note):
            every_note += odd_start(start_utc_s, tables, whole)
        for name in _PLACED if not faults.found else ():
            east_m, north_m = (tables[name][axis].to_numpy(np.float64) for axis in _AXES)
            check_metres(called.get(name, name), str(crs), east_m, north_m, faults)
        if not faults.found and not any(FAR_APART in note for note in every_note):
            every_note += truth_far_off(str(crs), tables)
        # Of values that are refused nothing is told besides.
        if not faults.found:
            if not any(UNDIRECTED in note for note in every_note):
                every_note += undirected_note(tables["motion"], called.get("motion", "motion"))
            places = compared_places(tables["truth"], tables["gnss"])
            for column, wrong in motion_faults(tables["motion"], places).items():
                found = f", {column}: {wrong.found}; "
                # A log that was written and read has its notes of then; words of Python mend some.
                if not any(found in note for note in every_note):
                    every_note += (f"{called.get('motion', 'motion')}, {column}: {wrong}",)
    faults.raise_if_any(InputError)
    ranges = tables["pseudoranges"]
    placeless = int(ranges[list(PLACE)].isna().any(axis=1).sum()) if len(ranges) else 0
    if almanac is None and placeless and not any(UNPLACED in note for note in every_note):
        why = "without the place of their satellite: give the day's navigation file (RINEX), too"
        every_note += (f"pseudoranges: {number_of(placeless, 'row')} {why}",)
    if almanac is not None:
        where, rows = called.get("pseudoranges", "pseudoranges"), tables["pseudoranges"]
        tables["pseudoranges"], more = place_satellites(rows, almanac, start_utc_s, where)
        every_note += more
    every_note = tuple(dict.fromkeys(every_note))
    tables |= {name: placed_in(str(crs), tables[name]) for name in _PLACED}
    moved = None if vehicle is None else bool(vehicle)
    return TrackLog(str(crs), start_utc_s, **tables, notes=every_note, imu=imu, vehicle=moved)
