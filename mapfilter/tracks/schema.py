"""The columns of a track log's tables: types, units, ranges and likely mistakes.

Every table has ``time_s``, seconds after the log's start. Headings are radians counter-clockwise
from grid east; positions are metres in the log's projected CRS.
"""

from __future__ import annotations

from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any, Literal

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from mapfilter._types import Bools, Floats, Ints
from mapfilter.errors import Faults
from mapfilter.geodesy import wrap_rad

TABLES = ("motion", "radio", "gnss", "pseudoranges", "tdoa", "truth")
"""The tables of a log, in the order in which they are stored."""

OPTIONAL = ("pseudoranges", "tdoa")
"""Tables that are stored only where they hold something."""

SATELLITE = r"[GRECJIS]\d{2}"
"""A satellite's name as in RINEX: the letter of its constellation and two digits."""

PLACE = ("x_m", "y_m", "z_m")
"""Where a satellite was, earth-centred."""

SERVING = "serving"
NEIGHBOUR = "neighbour"

MISSING_SIGNS = (-9999.0, -99999.0, -999999.0)
"""Numbers by which other programs mean that a value is missing; here its field is empty."""

_TURN_RAD = 2 * np.pi + 1e-9
# 2.0**63 itself is one more than an int64 holds.
_LARGEST_ID = float(np.nextafter(2.0**63, 0.0))


@dataclass(frozen=True, slots=True)
class Column:
    """One column of a table.

    Parameters
    ----------
    name : str
        With its unit.
    kind : {"number", "integer", "text"}
        A float64 (missing: NaN), a nullable Int64, or text (missing: None).
    required : bool
        Whether the column must be there and hold a value in every row.
    low, high : float
        Inclusive range of a value.
    expected, hint : str
        What an error message says of a value outside the range.
    """

    name: str
    kind: Literal["number", "integer", "text"] = "number"
    required: bool = False
    low: float = -np.inf
    high: float = np.inf
    expected: str = "a finite number"
    hint: str = ""


_TIME = Column(
    "time_s", required=True, low=-1e11, high=1e11, expected="seconds", hint="milliseconds for s"
)
_EAST = Column("east_m", required=True, low=-1e8, high=1e8, expected="metres east")
_NORTH = Column("north_m", required=True, low=-1e8, high=1e8, expected="metres north")

SCHEMA: dict[str, tuple[Column, ...]] = {
    "motion": (
        _TIME,
        Column("step_m", low=-1e6, high=1e6, expected="metres"),
        Column(
            "heading_rad",
            low=-_TURN_RAD,
            high=_TURN_RAD,
            expected="radians in -2π..2π",
            hint="degrees given for radians",
        ),
        Column(
            "turn_rad",
            low=-_TURN_RAD,
            high=_TURN_RAD,
            expected="radians in -2π..2π",
            hint="degrees given for radians",
        ),
    ),
    "radio": (
        _TIME,
        Column("role", kind="text", required=True, expected="serving or neighbour"),
        Column("cell", kind="text", expected="a cell id"),
        Column("arfcn", kind="integer", low=0, high=3_279_165, expected="a carrier number"),
        Column("bsic", kind="integer", low=0, high=1007, expected="a BSIC or PCI"),
        Column(
            "level_dbm",
            low=-200,
            high=0,
            expected="dBm in -200..0",
            hint="raw RXLEV given for dBm",
        ),
        Column("censored", kind="integer", low=-1, high=1, expected="-1, 0 or 1"),
        Column("timing_advance", kind="integer", low=0, high=3846, expected="steps >= 0"),
    ),
    "gnss": (
        _TIME,
        _EAST,
        _NORTH,
        Column("var_east_m2", low=0, expected="square metres >= 0"),
        Column("var_north_m2", low=0, expected="square metres >= 0"),
        Column("cov_east_north_m2", expected="square metres"),
    ),
    "pseudoranges": (
        _TIME,
        Column("satellite", kind="text", required=True, expected="a name such as G07 or E19"),
        Column(
            "pseudorange_m",
            low=1.5e7,
            high=6e7,
            expected="metres in 1.5e7..6e7",
            hint="kilometres or seconds for metres, or a leap second or week in the times",
        ),
        Column("sigma_m", low=1e-3, high=1e5, expected="metres in 0.001..100000"),
        *(
            Column(name, low=-6e7, high=6e7, expected="metres from the earth's centre")
            for name in ("x_m", "y_m", "z_m")
        ),
    ),
    "tdoa": (
        _TIME,
        Column("cell", kind="text", required=True, expected="a cell id"),
        Column("reference", kind="text", required=True, expected="a cell id"),
        Column(
            "difference_m",
            low=-2e5,
            high=2e5,
            expected="metres in -200000..200000",
            hint="nanoseconds given for metres",
        ),
        Column("sigma_m", low=1e-3, high=1e5, expected="metres in 0.001..100000"),
        Column("reference_sigma_m", low=1e-3, high=1e5, expected="metres in 0.001..100000"),
    ),
    "truth": (
        _TIME,
        _EAST,
        _NORTH,
        Column(
            "way_id", kind="integer", low=-_LARGEST_ID, high=_LARGEST_ID, expected="a way's number"
        ),
    ),
}
"""The columns of each table, in the order in which they are stored."""


_SHOWN_ROWS = 3
_LOWEST_M, _HIGHEST_M = 2.0e7, 5.5e7
_SELDOM_S = 10.0
_SOMEWHERE_M = 25.0
_SLOW_MPS = 0.04
_MOVING = ("motion", "gnss", "truth")


@dataclass(frozen=True, eq=False, slots=True)
class _Door:
    """Where a table comes in: what messages call it and its rows, and who collects them."""

    where: str
    row_numbers: Ints
    faults: Faults

    def add(self, field: str, expected: str, got: object, hint: str = "") -> None:
        self.faults.add(f"{self.where}{field}", expected, got, hint)


def tidy_table(
    table: str,
    given: pd.DataFrame | None,
    where: str,
    faults: Faults,
    row_numbers: ArrayLike | None = None,
) -> tuple[pd.DataFrame, tuple[str, ...]]:
    """Return a table with the columns of the schema, sorted by time, without exact duplicates.

    Parameters
    ----------
    table : str
        Which table it is, out of :data:`mapfilter.tracks.schema.TABLES`.
    given : pandas.DataFrame or None
        As read or made; None is an empty table. Values may be text, as from CSV.
    where : str
        The file's or table's name for messages.
    faults : Faults
        Collects what is wrong; the table returned then serves only to find further faults.
    row_numbers : (N,) array_like of int, optional
        What messages call each row; 1 to N without.

    Returns
    -------
    table : pandas.DataFrame
    notes : tuple of str
        What was ignored, sorted or dropped.
    """
    if given is None:
        given = pd.DataFrame({column.name: [] for column in SCHEMA[table]})
    given = given.reset_index(drop=True)
    numbers = np.arange(1, len(given) + 1) if row_numbers is None else np.asarray(row_numbers)
    door = _Door(where, numbers, faults)
    notes = _check_columns(table, given, door)
    tidy = pd.DataFrame({column.name: _column(column, given, door) for column in SCHEMA[table]})
    if table == "radio":
        _check_roles(tidy["role"], door)
        tidy["censored"] = tidy["censored"].fillna(0)
    if table == "gnss":
        _check_covariance(tidy, door)
    if table == "pseudoranges":
        _check_satellites(tidy, door)
    if table == "motion":
        tidy["heading_rad"] = wrap_rad(tidy["heading_rad"])
    else:
        _check_degrees(tidy, door)
    _check_milliseconds(table, tidy, door)
    return _sorted_unique(tidy, where, notes)


def _check_columns(table: str, given: pd.DataFrame, door: _Door) -> tuple[str, ...]:
    names = [column.name for column in SCHEMA[table]]
    notes = []
    for name in (str(name) for name in given.columns if name not in names):
        near = get_close_matches(name, [n for n in names if n not in given.columns], 1, 0.6)
        if near:
            door.add(f", column {name}", f"columns {', '.join(names)}", name, near[0])
        else:
            notes.append(f"{door.where}: column {name} is not used")
    for column in SCHEMA[table]:
        if column.required and column.name not in given.columns:
            door.add("", f"a column {column.name}", "none")
    return tuple(notes)


def _column(column: Column, given: pd.DataFrame, door: _Door) -> Any:
    values = given.get(column.name)
    if values is None:
        values = pd.Series([None] * len(given), dtype=object)
    if column.kind == "text":
        return _text(column, values, door)
    number, readable = _numbers(values)
    missing = np.isnan(number)
    bad = ~readable | np.isinf(number) | (number < column.low) | (number > column.high)
    if column.kind == "integer":
        bad |= ~missing & np.isfinite(number) & (number != np.round(number))
    if column.required and column.name in given.columns:
        bad |= missing
    elif not column.required:
        bad |= np.isin(number, MISSING_SIGNS)
    _add_rows(door, bad, column, values)
    if column.kind == "number":
        return number
    kept = np.where(bad | missing, 0.0, number).astype(np.int64)
    if pd.api.types.is_integer_dtype(values.dtype):
        kept = values.fillna(0).to_numpy(dtype=np.int64)
    return pd.arrays.IntegerArray(kept, bad | missing)


def _text(column: Column, values: pd.Series, door: _Door) -> Any:
    present = values.notna().to_numpy() & (values.astype(str) != "").to_numpy()
    if column.required:
        _add_rows(door, ~present, column, values)
    texts = [str(v) if ok else None for v, ok in zip(values, present, strict=True)]
    # Without the dtype pandas 3 makes these strings, and None becomes NaN.
    return pd.Series(texts, dtype=object)


def _numbers(values: pd.Series) -> tuple[Floats, Bools]:
    """Return values as floats, and which of them could be read as a number or as missing."""
    if pd.api.types.is_numeric_dtype(values.dtype):
        number = values.to_numpy(dtype=np.float64, na_value=np.nan)
        return number, np.ones(len(number), dtype=bool)
    number = np.full(len(values), np.nan)
    readable = np.ones(len(values), dtype=bool)
    for row, value in enumerate(values):
        if value is None or value is pd.NA or value == "":
            continue
        try:
            number[row] = float(value)
        except (TypeError, ValueError):
            readable[row] = False
    return number, readable


def _add_rows(door: _Door, bad: Bools, column: Column, values: pd.Series) -> None:
    rows = np.flatnonzero(bad)
    for row in rows[:_SHOWN_ROWS]:
        value = values.iloc[row]
        empty = value is None or value is pd.NA or value == ""
        door.add(
            f" row {door.row_numbers[row]}, {column.name}",
            column.expected,
            "nothing" if empty else value,
            "" if empty else _hint(column, value),
        )
    if len(rows) > _SHOWN_ROWS:
        more = f"{len(rows) - _SHOWN_ROWS} more rows like these"
        door.add(f", {column.name}", column.expected, more, _hint(column, values.iloc[rows[-1]]))


def _hint(column: Column, value: Any) -> str:
    if not _is_finite_number(value):
        return ""
    if float(value) in MISSING_SIGNS:
        return "a sign for a missing value; leave the field empty"
    return column.hint


def _is_finite_number(value: Any) -> bool:
    try:
        return bool(np.isfinite(float(value)))
    except (TypeError, ValueError):
        return False


def _check_roles(role: pd.Series, door: _Door) -> None:
    bad = role.notna().to_numpy() & ~role.isin([SERVING, NEIGHBOUR]).to_numpy()
    _add_rows(door, bad, SCHEMA["radio"][1], role)


def _check_covariance(gnss: pd.DataFrame, door: _Door) -> None:
    product = gnss["var_east_m2"].to_numpy() * gnss["var_north_m2"].to_numpy()
    bad = gnss["cov_east_north_m2"].to_numpy() ** 2 > product * (1 + 1e-9)
    column = Column("cov_east_north_m2", expected="a covariance of at most √(var_east·var_north)")
    _add_rows(door, bad, column, gnss["cov_east_north_m2"])


def _check_satellites(rows: pd.DataFrame, door: _Door) -> None:
    """See that satellites are called as in RINEX, and are as high as satellites are."""
    name = rows["satellite"]
    wrong = name.notna().to_numpy() & ~name.astype(str).str.fullmatch(SATELLITE).to_numpy(bool)
    for row in np.flatnonzero(wrong)[:_SHOWN_ROWS]:
        hint = "its constellation's letter (G, R, E, C, J, I, S) and two digits"
        door.add(
            f" row {door.row_numbers[row]}, satellite",
            "a name such as G07",
            repr(name.iloc[row]),
            hint,
        )
    place = rows[list(PLACE)].to_numpy(dtype=np.float64)
    told = np.isfinite(place)
    away_m = np.sqrt(np.sum(place**2, axis=1))
    for row in np.flatnonzero(told.any(axis=1) & ~told.all(axis=1))[:_SHOWN_ROWS]:
        door.add(
            f" row {door.row_numbers[row]}, x_m, y_m, z_m", "all three, or none", "some of them"
        )
    bad = told.all(axis=1) & ~((away_m >= _LOWEST_M) & (away_m <= _HIGHEST_M))
    for row in np.flatnonzero(bad)[:_SHOWN_ROWS]:
        hint = "kilometres for metres, or a receiver's place"
        expected = "20 000 to 55 000 km from the earth's centre"
        got = f"{away_m[row] / 1000:.0f} km"
        door.add(f" row {door.row_numbers[row]}, x_m, y_m, z_m", expected, got, hint)


def _check_degrees(table: pd.DataFrame, door: _Door) -> None:
    """Find positions that are longitudes and latitudes: near zero, and hardly moving for long."""
    if "east_m" not in table or len(table) < 2:
        return
    east, north = table["east_m"].to_numpy(), table["north_m"].to_numpy()
    small = bool(np.all(np.abs(east) <= 180) and np.all(np.abs(north) <= 180))
    if not small:
        return
    extent = max(np.ptp(east), np.ptp(north))
    if 0 < extent < 0.5 and np.ptp(table["time_s"].to_numpy()) >= 10:
        got = f"all within {extent:.4g} of ({east[0]:.6g}, {north[0]:.6g})"
        door.add(", east_m and north_m", "metres", got, "degrees given for metres")


def _check_milliseconds(table: str, rows: pd.DataFrame, door: _Door) -> None:
    """Find times in milliseconds: rows seldom come, and what gets somewhere goes very slowly."""
    time = np.unique(rows["time_s"].to_numpy())
    if len(time) < 3 or table not in _MOVING or not np.isfinite(time).all():
        return
    between_s = float(np.median(np.diff(time)))
    if table == "motion":
        moved_m = float(np.nansum(np.abs(rows["step_m"].to_numpy())))
    else:
        # Not the path's length: the fixes of a parked car jitter.
        moved_m = float(np.hypot(np.ptp(rows["east_m"]), np.ptp(rows["north_m"])))
    speed_mps = moved_m / (time[-1] - time[0])
    if between_s >= _SELDOM_S and moved_m >= _SOMEWHERE_M and speed_mps < _SLOW_MPS:
        got = f"{between_s:g} between rows, hence {speed_mps:.2g} m/s"
        door.add(", time_s", "seconds", got, "milliseconds for s")


def _sorted_unique(
    table: pd.DataFrame, where: str, notes: tuple[str, ...]
) -> tuple[pd.DataFrame, tuple[str, ...]]:
    duplicate = table.duplicated().to_numpy()
    if duplicate.any():
        notes += (f"{where}: {int(duplicate.sum())} exact duplicate rows dropped",)
        table = table[~duplicate]
    backwards = int(np.sum(np.diff(table["time_s"].to_numpy()) < 0))
    if backwards:
        notes += (f"{where}: out of order in {backwards} places, sorted by time",)
        table = table.sort_values("time_s", kind="stable")
    return table.reset_index(drop=True), notes
