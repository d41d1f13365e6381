"""A log's tables merged into epochs: dead reckoning, radio report and GNSS of one moment."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import astuple, dataclass, fields
from math import isfinite, isnan, nan
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from mapfilter._arguments import Argument, check_arguments
from mapfilter.filters.contract import MotionStep
from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.schema import SCHEMA, SERVING, TABLES

_AT_ONCE = 20_000
"""Rows of a table that are taken out of it at a time: as objects they are ten times as large."""


@dataclass(frozen=True, slots=True)
class ReportRow:
    """One row of a radio report.

    Parameters
    ----------
    role : str
        ``serving`` or ``neighbour``.
    level_dbm : float
        NaN where it was not reported.
    censored : int
        -1: below the reported level, 1: above it, 0: the level itself.
    timing_advance : float
        Steps; NaN where it was not reported.
    """

    role: str
    cell: str | None
    arfcn: int | None
    bsic: int | None
    level_dbm: float
    censored: int
    timing_advance: float = nan

    @property
    def name(self) -> str:
        """The cell as messages name it."""
        if self.cell is not None:
            return self.cell
        bsic = "unknown" if self.bsic is None else self.bsic
        return "" if self.arfcn is None else f"ARFCN {self.arfcn}, BSIC {bsic}"


@dataclass(frozen=True, slots=True)
class GnssFix:
    """A position by GNSS in the CRS of the database.

    Parameters
    ----------
    var_east_m2, var_north_m2, cov_east_north_m2 : float
        NaN where unknown.
    """

    east_m: float
    north_m: float
    var_east_m2: float = nan
    var_north_m2: float = nan
    cov_east_north_m2: float = nan

    def repeats(self, last: GnssFix | None) -> bool:
        """Return whether position and errors are those of the last fix, to the last digit.

        Noise makes two measured positions differ, also at a standstill.
        """
        if last is None:
            return False
        pairs = zip(astuple(self), astuple(last), strict=True)
        return all(a == b or (isnan(a) and isnan(b)) for a, b in pairs)


@dataclass(frozen=True, slots=True)
class Pseudorange:
    """One satellite received.

    Parameters
    ----------
    range_m : float
        With the receiver's clock in it; NaN where it was not measured.
    sigma_m : float
        NaN where unknown.
    place_m : tuple of float
        Of the satellite, earth-centred; NaN where unknown.
    """

    satellite: str
    range_m: float
    sigma_m: float
    place_m: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Difference:
    """How much farther away a cell is than another, by times of arrival.

    Parameters
    ----------
    difference_m : float
        NaN where it was not measured.
    sigma_m, reference_sigma_m : float
        Of the two times, as distances; NaN where unknown.
    """

    cell: str
    reference: str
    difference_m: float
    sigma_m: float = nan
    reference_sigma_m: float = nan


@dataclass(frozen=True, slots=True)
class Epoch:
    """Motion and measurements of one moment; filters move first, then measure.

    Parameters
    ----------
    motion : tuple of MotionStep
        Intervals that end now.
    radio : tuple of ReportRow
        The report, of all its rows.
    """

    time_s: float
    motion: tuple[MotionStep, ...] = ()
    radio: tuple[ReportRow, ...] = ()
    fix: GnssFix | None = None
    ranges: tuple[Pseudorange, ...] = ()
    differences: tuple[Difference, ...] = ()

    @property
    def measured(self) -> bool:
        """Whether something besides motion was measured; NaN, None and ``()`` are no reading."""
        return any(_is_reading(getattr(self, one.name)) for one in fields(self)[2:])


def _is_reading(value: Any) -> bool:
    missing = value is None or value == () or (isinstance(value, float) and isnan(value))
    return not missing


def epochs(log: TrackLog) -> list[Epoch]:
    """Merge a log's tables by time.

    Raises
    ------
    ConfigError
        It is no log.
    """
    check_arguments("epochs", Argument("log", log, TrackLog, "a log of read_log or make_log"))
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


def _pseudorange(name: str, range_m: float, sigma_m: float, *place_m: float) -> Pseudorange:
    return Pseudorange(name, range_m, sigma_m, (place_m[0], place_m[1], place_m[2]))


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
    "gnss": _Field("fix", GnssFix, _last),
    "pseudoranges": _Field("ranges", _pseudorange),
    "tdoa": _Field("differences", Difference),
}
"""The field of each table of :data:`mapfilter.tracks.schema.TABLES` that holds measurements."""


def headed(step: MotionStep, heading_rad: float) -> tuple[MotionStep, float]:
    """Give a step without a compass the heading that its turns add up to.

    Parameters
    ----------
    heading_rad : float
        After the last step; NaN before the first.

    Returns
    -------
    step : MotionStep
        With a heading; without one where it has neither heading nor turn and none was known.
    """
    if isfinite(step.heading_rad):
        return step, step.heading_rad
    if isfinite(step.spread_m):
        return step, heading_rad
    if isfinite(step.turn_rad):
        heading_rad = (heading_rad if isfinite(heading_rad) else 0.0) + step.turn_rad
    elif not isfinite(heading_rad):
        # A first step has no turn: the headings that follow are counted from it.
        heading_rad = 0.0
    else:
        return step, heading_rad
    # Each epoch has such a step: a copy by `dataclasses.replace` takes several times as long.
    with_heading = MotionStep(
        step.step_m, heading_rad, step.turn_rad, step.spread_m, step.sampling_sd_m
    )
    return with_heading, heading_rad


def serving_cell(epoch: Epoch) -> str | None:
    """Return the first serving cell that a report names."""
    named = (row.cell for row in epoch.radio if row.role == SERVING and row.cell is not None)
    return next(named, None)
