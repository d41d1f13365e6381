"""A log's tables merged into epochs, and epochs made of rows as they arrive."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from math import isnan, nan
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from mapfilter._arguments import Argument, check_arguments
from mapfilter.errors import InputError, fail
from mapfilter.filters.contract import MotionStep
from mapfilter.geodesy import projected_crs, short_crs
from mapfilter.positioning.epochs import Difference, Epoch, GnssFix, Pseudorange, ReportRow
from mapfilter.tracks.checks.placeless import (
    LOCAL_FRAME,
    LOCAL_FRAME_HINT,
    in_frame,
    is_local_frame,
)
from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.schema import SCHEMA, TABLES

_AT_ONCE = 20_000
"""Rows of a table that are taken out of it at a time: as objects they are ten times as large."""


def epochs(log: TrackLog, crs: str = "") -> list[Epoch]:
    """Merge a log's tables by time.

    Parameters
    ----------
    crs : str
        CRS of the filter that takes them, such as ``database.lattice.crs``: a log in another one is
        projected. Epochs state none; "" for that of the log.

    Raises
    ------
    ConfigError
        It is no log, or the CRS no text.
    InputError
        The CRS is none, or covers none of the positions; or the log cannot be projected: it is in a
        local frame, or has headings and no position.
    """
    check_arguments(
        "epochs",
        Argument("log", log, TrackLog, "a log of read_log or make_log"),
        Argument("crs", crs, str, "a CRS such as database.lattice.crs"),
    )
    log = _placed(log, projected_crs(crs, "epochs, crs")) if crs else log
    tables = {_FIELDS[name]: _by_time(log, name) for name, table in TABLES.items() if table.kinds}
    ahead = dict.fromkeys(tables, 0)
    merged = []
    for time_s in np.unique(np.concatenate([one.time_s for one in tables.values()])).tolist():
        fields_now = {}
        for one, table in tables.items():
            k = ahead[one]
            if k < len(table.time_s) and table.time_s[k] == time_s:
                fields_now[one.name] = one.of_rows(table.rows[table.first[k] : table.first[k + 1]])
                ahead[one] = k + 1
        merged.append(Epoch(time_s, **fields_now))
    return merged


def _placed(log: TrackLog, crs: str) -> TrackLog:
    """Return a log in a CRS; InputError where it cannot be projected."""
    placed = in_frame(log, crs)
    if placed.crs != crs:
        got, hint = LOCAL_FRAME, LOCAL_FRAME_HINT
        if not is_local_frame(log.crs):
            got = f"headings in {short_crs(log.crs)}, and no position by which they turn"
            hint = "mf.locate turns them by the place of the database"
        raise fail(InputError, "epochs, log", short_crs(crs), got, hint)
    return placed


def epoch_columns(table: str) -> tuple[str, ...]:
    """Return the columns of a log's table that rows of an epoch have; optional ones come last."""
    usual = (known.name for known in SCHEMA[table][1:] if not known.optional)
    return (*usual, *_FIELDS[table].more)


def make_epoch(time_s: float, rows: Mapping[str, Sequence[Sequence[Any]]]) -> Epoch:
    """Make one epoch of rows as they arrive.

    Parameters
    ----------
    rows : mapping of str to sequences
        By table of :data:`mapfilter.tracks.schema.TABLES`; the values of a row are those of the
        table's columns after ``time_s`` by :func:`epoch_columns`, without those at the end that
        may be missing. Missing numbers are NaN, missing integers and texts None.

    Examples
    --------
    >>> (step,) = make_epoch(1.0, {"motion": [(1.4, 0.5, nan)]}).motion
    >>> step.step_m, step.heading_rad, step.turn_rad
    (1.4, 0.5, nan)
    """
    made = {name: [_FIELDS[name].row(*values) for values in rows[name]] for name in rows}
    return Epoch(
        time_s,
        **{_FIELDS[name].name: _FIELDS[name].of_rows(one) for name, one in made.items() if one},
    )


class _Timed(NamedTuple):
    """Rows of a table in the order of time, and the first one of each of its times."""

    time_s: list[float]
    first: list[int]
    rows: list[Any]


def _by_time(log: TrackLog, name: str) -> _Timed:
    """Return the rows of a table; equal ones, as reports repeat themselves, are one object."""
    table: pd.DataFrame = getattr(log, name)
    may_lack = _FIELDS[name].more
    columns = [one for one in epoch_columns(name) if one in table or one not in may_lack]
    rows: list[Any] = []
    made: dict[tuple[Any, ...], Any] = {}
    for begin in range(0, len(table), _AT_ONCE):
        part = table.iloc[begin : begin + _AT_ONCE]
        for values in zip(*(_values(part[column]) for column in columns), strict=True):
            one = made.get(values)
            if one is None:
                one = made[values] = _FIELDS[name].row(*values)
            rows.append(one)
    time_s = table["time_s"].to_numpy(dtype=np.float64)
    if np.any(np.diff(time_s) < 0):
        order = np.argsort(time_s, kind="stable")
        time_s, rows = time_s[order], [rows[k] for k in order.tolist()]
    times, first = np.unique(time_s, return_index=True)
    return _Timed(times.tolist(), [*first.tolist(), len(rows)], rows)


def _values(column: pd.Series) -> list[Any]:
    """Return the values of a column; missing ones are None, or one NaN where they are numbers."""
    values = column.tolist()
    if str(column.dtype) in ("Int64", "Int8", "object", "str", "string"):
        return [None if value is pd.NA or value != value else value for value in values]
    # One NaN for all, so that rows without a value are equal.
    return [nan if value != value else value for value in values]


def _report_row(
    role: str, cell: str, arfcn: int, bsic: int, level: float, censored: int, steps: int
) -> ReportRow:
    level_dbm, advance = (nan if value is None else float(value) for value in (level, steps))
    return ReportRow(role, cell, arfcn, bsic, level_dbm, censored or 0, advance)


def _motion_step(
    step_m: float, heading_rad: float, turn_rad: float, sampling_sd_m: float = 0.0
) -> MotionStep:
    known_m = 0.0 if isnan(sampling_sd_m) else sampling_sd_m
    return MotionStep(step_m, heading_rad, turn_rad, sampling_sd_m=known_m)


def _pseudorange(name: str, pseudorange_m: float, sigma_m: float, *place_m: float) -> Pseudorange:
    return Pseudorange(name, pseudorange_m, sigma_m, (place_m[0], place_m[1], place_m[2]))


def _last(rows: list[Any]) -> Any:
    return rows[-1]


class _Field(NamedTuple):
    """A field of an epoch: its name, a row by the columns of its table, and the rows of a time.

    ``more`` are columns that a table may lack.
    """

    name: str
    row: Callable[..., Any]
    of_rows: Callable[[list[Any]], Any] = tuple
    more: tuple[str, ...] = ()


_FIELDS = {
    "motion": _Field("motion", _motion_step, more=("sampling_sd_m",)),
    "radio": _Field("radio", _report_row),
    "gnss": _Field("gnss", GnssFix, _last),
    "pseudoranges": _Field("pseudoranges", _pseudorange),
    "tdoa": _Field("tdoa", Difference),
}
"""The field of each table of :data:`mapfilter.tracks.schema.TABLES` that holds measurements."""
