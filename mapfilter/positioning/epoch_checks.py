"""Epochs that a program gives to a filter itself.

Values of epochs have the types and ranges of a log's tables. Those of a log were checked when it
was read; the test that all is well costs them little.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from math import inf, isnan
from typing import Any

import numpy as np

from mapfilter._inputs import shown
from mapfilter.errors import Faults, InputError, fail
from mapfilter.filters.contract import MotionStep
from mapfilter.positioning.epochs import Difference, Epoch, GnssFix, Pseudorange, ReportRow
from mapfilter.tracks.schema import NEIGHBOUR, PLACE, SCHEMA, SERVING, Column

_COLUMNS = {table: {column.name: column for column in columns} for table, columns in SCHEMA.items()}
_TIME = SCHEMA["motion"][0]
_SPREAD = Column("spread_m", 0, inf, "metres >= 0")
_TURNED = Column("turned_sd_rad", 0, 1e6, "radians >= 0")
_ROWS = Column("rows", 1, 1e6, "a number of measured steps, 1 or more")
_OF_HEADINGS = (
    "degrees given for radians, or headings that count on beyond a turn; "
    "mapfilter.angles.wrap_one_rad wraps one"
)
_ROLES = (SERVING, NEIGHBOUR)
_FIELDS: dict[type, dict[str, Column]] = {
    MotionStep: {
        "step_m": _COLUMNS["motion"]["step_m"],
        # Of one epoch it is not known whether its headings count on.
        "heading_rad": replace(_COLUMNS["motion"]["heading_rad"], hint=_OF_HEADINGS),
        "turn_rad": _COLUMNS["motion"]["turn_rad"],
        "spread_m": _SPREAD,
        "sampling_sd_m": _COLUMNS["motion"]["sampling_sd_m"],
        "turned_sd_rad": _TURNED,
        "rows": _ROWS,
    },
    ReportRow: {
        name: _COLUMNS["radio"][name]
        for name in ("role", "cell", "arfcn", "bsic", "level_dbm", "censored", "timing_advance")
    },
    GnssFix: {
        # A position beyond all numbers is none, as is one of NaN.
        "east_m": replace(_COLUMNS["gnss"]["east_m"], low=-inf, high=inf),
        "north_m": replace(_COLUMNS["gnss"]["north_m"], low=-inf, high=inf),
        **{
            name: _COLUMNS["gnss"][name]
            for name in ("var_east_m2", "var_north_m2", "cov_east_north_m2")
        },
    },
    Pseudorange: {
        "satellite": _COLUMNS["pseudoranges"]["satellite"],
        # With a receiver's clock that runs away.
        "pseudorange_m": Column("pseudorange_m", -1e12, 1e12, "metres"),
        "sigma_m": _COLUMNS["pseudoranges"]["sigma_m"],
    },
    Difference: {
        name: _COLUMNS["tdoa"][name]
        for name in ("cell", "reference", "difference_m", "sigma_m", "reference_sigma_m")
    },
}
"""The column of a log's tables that each field of a row is checked by."""
_FLOATS = ("timing_advance",)
"""Whole numbers that rows hold as floats, NaN where they are missing."""
_ALWAYS = ("time_s", "sampling_sd_m", "turned_sd_rad", "rows")
"""Numbers that are never missing: errors are 0 where there are none, rows 1."""
_RANGES = {
    kind: tuple(
        (name, column.low, column.high, column.kind == "integer" and name not in _FLOATS)
        for name, column in columns.items()
        if column.kind != "text"
    )
    for kind, columns in _FIELDS.items()
}
_TEXTS = {
    kind: tuple(
        (name, column.required) for name, column in columns.items() if column.kind == "text"
    )
    for kind, columns in _FIELDS.items()
}
_OF_REPORT = tuple(
    (_COLUMNS["radio"][name].low, _COLUMNS["radio"][name].high)
    for name in ("arfcn", "bsic", "level_dbm", "censored", "timing_advance")
)
_PLACE = _COLUMNS["pseudoranges"][PLACE[0]]
_KINDS = {
    "motion": MotionStep,
    "radio": ReportRow,
    "pseudoranges": Pseudorange,
    "tdoa": Difference,
}


def check_epoch(epoch: Epoch) -> None:
    """Check the values of an epoch: numbers in their ranges, or NaN where they were not measured.

    Raises
    ------
    InputError
        With all faults of the epoch together, in the words of a log's tables.
    """
    if _is_well(epoch):
        return
    faults = Faults()
    given: Any = epoch
    if not isinstance(given, Epoch):
        raise fail(InputError, "epoch", "an Epoch", shown(given))
    _check_number("epoch, time_s", epoch.time_s, _TIME, faults)
    for where, kind, row in _rows(epoch, faults):
        if not isinstance(row, kind):
            faults.add(where, f"a {kind.__name__}", shown(row))
            continue
        for name, column in _FIELDS[kind].items():
            _check(f"{where}.{name}", getattr(row, name), column, faults)
        if isinstance(row, Pseudorange):
            _check_place(f"{where}.place_m", row.place_m, faults)
    faults.raise_if_any(InputError)


def _is_well(epoch: Any) -> bool:
    """Return whether all values are as expected; most epochs end here."""
    if not (isinstance(epoch, Epoch) and _is_within(epoch.time_s, _TIME.low, _TIME.high)):
        return False
    parts = (epoch.motion, epoch.radio, epoch.pseudoranges, epoch.tdoa)
    # What can be gone over once only would be empty afterwards.
    if not all(map(_are_rows, parts)):
        return False
    try:
        rows = (*epoch.motion, *epoch.radio, *epoch.pseudoranges, *epoch.tdoa)
        rows = rows if epoch.gnss is None else (*rows, epoch.gnss)
        return all(map(_row_is_well, rows))
    except (TypeError, ValueError, KeyError):
        return False


def _are_rows(given: Any) -> bool:
    # Of tuples, as epochs have mostly, that is known at once.
    if type(given) is tuple:
        return True
    return isinstance(given, Sequence) and not isinstance(given, str | bytes)


def _is_within(value: Any, low: float, high: float) -> bool:
    try:
        return bool(low <= value <= high)
    except TypeError:
        return False


def _row_is_well(row: Any) -> bool:
    kind = type(row)
    if kind is ReportRow:
        return _report_is_well(row)
    for name, low, high, may_lack in _RANGES[kind]:
        value = getattr(row, name)
        # Arrays of one number compare as numbers do, but have no hash.
        hash(value)
        if (may_lack and value is None) or low <= value <= high:
            continue
        # NaN is the only number that is not itself.
        if value == value or name in _ALWAYS:
            return False
    for name, required in _TEXTS[kind]:
        value = getattr(row, name)
        if not (isinstance(value, str) or (value is None and not required)):
            return False
    if kind is Pseudorange:
        x_m, y_m, z_m = row.place_m
        hash((x_m, y_m, z_m))
        return all(_PLACE.low <= one <= _PLACE.high or one != one for one in (x_m, y_m, z_m))
    return True


def _report_is_well(row: Any) -> bool:
    """Return the same of a report's row, of which epochs have most: one by one, that is quicker."""
    carrier, code, level, censored, advance = _OF_REPORT
    arfcn, bsic, bound = row.arfcn, row.bsic, row.censored
    level_dbm, steps = row.level_dbm, row.timing_advance
    hash((arfcn, bsic, bound, level_dbm, steps))
    return bool(
        row.role in _ROLES
        and (row.cell is None or isinstance(row.cell, str))
        and (arfcn is None or carrier[0] <= arfcn <= carrier[1])
        and (bsic is None or code[0] <= bsic <= code[1])
        and (bound is None or censored[0] <= bound <= censored[1])
        and (level[0] <= level_dbm <= level[1] or level_dbm != level_dbm)
        and (advance[0] <= steps <= advance[1] or steps != steps)
    )


def _rows(epoch: Epoch, faults: Faults) -> Iterator[tuple[str, type, Any]]:
    for name, kind in _KINDS.items():
        rows = getattr(epoch, name)
        if not _are_rows(rows):
            faults.add(f"epoch, {name}", f"a tuple of {kind.__name__}", shown(rows))
            continue
        for number, row in enumerate(rows):
            yield f"epoch, {name}[{number}]", kind, row
    if epoch.gnss is not None:
        yield "epoch, gnss", GnssFix, epoch.gnss


def _check(where: str, value: object, column: Column, faults: Faults) -> None:
    if column.name == "role":
        if value not in _ROLES:
            faults.add(where, column.expected, shown(value))
    elif column.kind == "text":
        if not isinstance(value, str) and (column.required or value is not None):
            faults.add(where, column.expected, shown(value), "None where it is not known")
    elif column.kind == "integer" and column.name not in _FLOATS:
        if value is not None:
            _check_number(where, value, column, faults)
    else:
        _check_number(where, value, column, faults)


def _check_number(where: str, value: Any, column: Column, faults: Faults) -> None:
    if value is None:
        hint = "" if column.name in _ALWAYS else "give NaN where it was not measured"
        faults.add(where, column.expected, "None", hint)
        return
    if isinstance(value, str | bytes):
        faults.add(where, column.expected, shown(value), "a text given for a number")
        return
    try:
        number = float(value)
    except OverflowError:
        number = inf
    except (TypeError, ValueError):
        # Any number may be a position, and this is none.
        faults.add(where, column.expected, shown(value), column.likely(inf))
        return
    is_missing = isnan(number) and column.name not in _ALWAYS
    if not (is_missing or column.low <= number <= column.high):
        faults.add(where, column.expected, shown(value), column.likely(number))


def _check_place(where: str, value: object, faults: Faults) -> None:
    given = value.tolist() if isinstance(value, np.ndarray) else value
    if not isinstance(given, tuple | list) or len(given) != len(PLACE):
        faults.add(where, "three numbers, metres from the earth's centre", shown(value))
        return
    for name, one in zip(PLACE, given, strict=True):
        _check_number(f"{where}, {name}", one, _COLUMNS["pseudoranges"][name], faults)
