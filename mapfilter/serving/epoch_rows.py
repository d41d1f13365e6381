"""Epochs as they arrive: rows in the names of the track log's tables, checked by its schema."""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite, nan
from typing import Any

import pandas as pd

from mapfilter._inputs import shown
from mapfilter.angles import wrap_rad
from mapfilter.errors import Faults, InputError
from mapfilter.positioning.epochs import Epoch
from mapfilter.positioning.merging import epoch_columns, make_epoch
from mapfilter.positioning.sensors.pace import Pace
from mapfilter.radio.identities import IDENTITY, LIMITS, TIMING_STEP_M
from mapfilter.radio.identities import technology as technology_of
from mapfilter.radio.plan_names import PlanNames, ReportedCell
from mapfilter.serving.documents import (
    RequestError,
    as_json,
    check_keys,
    hint_of_mark,
    number,
    one_fault,
    rows_of,
    text,
    whole,
)
from mapfilter.serving.places import in_metres
from mapfilter.tracks.checks.repeated_readings import repeated_readings
from mapfilter.tracks.joining.neighbour_codes import CODED, CodedRow, neighbours_by_code
from mapfilter.tracks.schema import (
    LEAST_PLACE_M,
    MISSING_SIGNS,
    MOST_PLACE_M,
    NEIGHBOUR,
    PLACE,
    SCHEMA,
    SERVING,
    TABLES,
    Column,
)

MOST_EPOCHS = 300
"""Epochs in one request; more are sent one request after another."""

MOST_GAP_S = 86_400.0
"""Seconds from one epoch of a session to the next; a filter knows nothing any more after a day."""

_OF_GAP = "another clock, or milliseconds for s; after a longer pause begin a new session"
_MOST_ROWS = 200
_PACED_ROWS, _SELDOM_S, _SOMEWHERE_M, _SLOW_MPS = 5, 50.0, 25.0, 0.04
"""Rows of motion after which times that are milliseconds show, the time between these, the way, and
the speed: what gets somewhere is faster."""
_FAST_MPS = 100.0
"""No vehicle on the ground goes so fast in the mean."""
_LARGEST_JUDGED = 1e12
_TIME = SCHEMA["motion"][0]
_TABLES = tuple(name for name, table in TABLES.items() if table.kinds)
_COLUMNS = {name: {c.name: c for c in SCHEMA[name][1:]} for name in _TABLES}


def read_epochs(
    document: Mapping[str, Any], names: PlanNames, after_s: float, technology: str = ""
) -> list[Epoch]:
    """Return the epochs of a request, in the order of their times.

    Parameters
    ----------
    document : mapping
        ``epochs``: a list of objects with ``time_s`` and, by the names of the log's tables, lists
        of rows without ``time_s``. What is missing is left out, or null.
    names : PlanNames
        Gives cells the ids of the database.
    after_s : float
        Time of the last epoch before; NaN for none.
    technology : str
        Whose timing advances are read; those that state another are a fault. Empty for any.

    Raises
    ------
    RequestError
        With all faults together, such as an epoch more than a day after the one before; or the
        first epoch is not later than the last one (409).
    """
    faults = Faults()
    check_keys(document, ("epochs",), "body", faults)
    given = rows_of(document.get("epochs"), "epochs", faults, MOST_EPOCHS)
    if not given and not faults.found:
        raise one_fault("epochs", "a list of at least one epoch", "none")
    found: list[Epoch] = []
    for index, one in enumerate(given):
        where = f"epochs[{index}]"
        check_keys(one, ("time_s", *_TABLES), where, faults)
        low, high = _TIME.low, _TIME.high
        place, expected = f"{where}.time_s", _TIME.expected
        time_s = number(one.get("time_s"), place, expected, faults, low, high, _TIME.hint)
        rows = {
            name: _rows(name, one.get(name), f"{where}.{name}", names, faults, technology)
            for name in _TABLES
        }
        if time_s is not None:
            last_s = found[-1].time_s if found else after_s
            if time_s - last_s > MOST_GAP_S:
                # All later epochs would come too early after it.
                expected = f"at most {MOST_GAP_S:g} s later than {last_s!r}, the epoch before"
                faults.add(f"{where}.time_s", expected, f"{time_s!r}", _OF_GAP)
                continue
            if found and time_s <= last_s:
                expected = f"later than {last_s!r}, the epoch before"
                faults.add(f"{where}.time_s", expected, f"{time_s!r}", "epochs out of order")
            found.append(make_epoch(time_s, rows))
    if faults.found:
        raise RequestError.of(InputError(tuple(faults.found)))
    if found[0].time_s <= after_s:
        expected = f"later than {after_s!r}, the last epoch of the session"
        error = one_fault("epochs[0].time_s", expected, f"{found[0].time_s!r}", "sent before")
        raise RequestError(409, "outOfOrder", error.message, error.faults)
    return found


def check_pace(pace: Pace, travelled_m: float) -> None:
    """Check units of times and steps, once rows of motion have come for some way.

    Raises
    ------
    RequestError
        Rows seldom come, and none of them was faster than anything that gets somewhere; or their
        mean speed is none on the ground (400).
    """
    if pace.rows >= _PACED_ROWS and pace.speed_mps > _FAST_MPS:
        hint = "centimetres, or the way since the start; begin a new session"
        got = f"{pace.speed_mps:.3g} m/s in the mean"
        raise one_fault("motion, step_m", "metres since the row before", got, hint)
    if pace.rows < _PACED_ROWS or pace.interval_s < _SELDOM_S or travelled_m < _SOMEWHERE_M:
        return
    if 0 < pace.fastest_mps < _SLOW_MPS:
        got = f"{pace.interval_s:.0f} between rows of motion, hence {pace.fastest_mps:.2g} m/s"
        hint = f"{_TIME.hint}; begin a new session"
        raise one_fault("epochs, time_s", _TIME.expected, f"{got} at most", hint)


def _rows(
    table: str, given: object, where: str, names: PlanNames, faults: Faults, technology: str
) -> list[tuple[Any, ...]]:
    found: list[dict[str, Any]] = []
    for index, row in enumerate(rows_of(given, where, faults, _MOST_ROWS)):
        place = f"{where}[{index}]"
        before = len(faults.found)
        if table == "gnss":
            placed = in_metres(row, place, names.plan.crs, faults)
            if placed is None:
                continue
            row = dict(placed)
        check_keys(row, tuple(_COLUMNS[table]), place, faults)
        values = {
            name: _value(column, row.get(name), f"{place}.{name}", faults)
            for name, column in _COLUMNS[table].items()
        }
        if table == "radio" and values["technology"]:
            # 4G is LTE, as in a log.
            values["technology"] = technology_of(values["technology"]) or values["technology"]
        _CHECKS.get(table, _nothing)(values, place, faults)
        if table == "radio" and technology:
            _check_steps(values, technology, place, faults)
        if len(faults.found) > before:
            continue
        if table == "motion" and isfinite(values["heading_rad"]):
            values["heading_rad"] = float(wrap_rad(values["heading_rad"]))
        found.append(values)
    found = _each_once(found)
    if table == "radio":
        for values in found:
            values["cell"] = names.name(_reported(values))
        rows = [CodedRow(0.0, *(values[name] for name in CODED)) for values in found]
        told = neighbours_by_code(rows, names.plan)
        for values, (carrier, cell) in zip(found, told, strict=True):
            values.update(arfcn=carrier, cell=cell)
    return [tuple(values[name] for name in epoch_columns(table)) for values in found]


def _each_once(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return rows without those that repeat another one exactly, as a log has them."""
    if len({tuple(values.values()) for values in rows}) == len(rows):
        return rows
    table = pd.DataFrame(rows).assign(time_s=0.0)
    repeated = repeated_readings(table, table.duplicated().to_numpy())
    return [values for values, again in zip(rows, repeated.tolist(), strict=True) if not again]


def _value(column: Column, value: object, where: str, faults: Faults) -> Any:
    """Return a field's value: NaN or None where it is missing or faulty."""
    missing = nan if column.kind == "number" else None
    if value is None:
        if column.required:
            faults.add(where, column.expected, "nothing")
        return missing
    if column.kind == "text":
        return text(value, where, column.expected, faults)
    if isinstance(value, int | float) and (hint := hint_of_mark(value)):
        faults.add(where, column.expected, shown(value), hint)
        return missing
    if column.kind == "integer":
        low, high = int(column.low), int(column.high)
        found = whole(value, where, column.expected, faults, low, high, column.hint)
        return missing if found is None else found
    if value in MISSING_SIGNS:
        hint = "a sign for a missing value; leave the field out"
        faults.add(where, column.expected, as_json(value), hint)
        return missing
    least, most = column.low, column.high
    likely = column.hint
    # Larger whole numbers may be no floats.
    if isinstance(value, float | int) and abs(value) <= _LARGEST_JUDGED:
        likely = column.likely(value)
    found_number = number(value, where, column.expected, faults, least, most, likely)
    return missing if found_number is None else found_number


def _reported(values: Mapping[str, Any]) -> ReportedCell:
    keys = ("role", "cell", "technology", *IDENTITY, "arfcn", "bsic")
    return ReportedCell(**{name: values[name] for name in keys})


def _nothing(values: Mapping[str, Any], where: str, faults: Faults) -> None:
    """Check nothing: columns are all that such a row has to keep."""


def _check_radio(values: Mapping[str, Any], where: str, faults: Faults) -> None:
    if values["role"] not in (SERVING, NEIGHBOUR, None):
        faults.add(f"{where}.role", "serving or neighbour", shown(values["role"]))
    family = values["technology"]
    for name, most in LIMITS.get(family or "", {}).items():
        if values[name] is not None and values[name] > most:
            faults.add(f"{where}.{name}", f"0..{most} in {family}", values[name])


def _check_steps(values: Mapping[str, Any], read: str, where: str, faults: Faults) -> None:
    """Note a timing advance in steps that the session does not read: its distance is another."""
    family = values["technology"]
    if values["timing_advance"] is None or family in (None, read):
        return
    hint = "leave it out"
    if family in TIMING_STEP_M:
        hint = f'begin a session with "log": {{"technology": "{family}"}}, or leave it out'
    expected = f"steps of {read}, as the session reads them"
    faults.add(f"{where}.timing_advance", expected, f"those of {shown(family)}", hint)


def _check_gnss(values: Mapping[str, Any], where: str, faults: Faults) -> None:
    product = values["var_east_m2"] * values["var_north_m2"]
    if values["cov_east_north_m2"] ** 2 > product * (1 + 1e-9):
        expected = "a covariance of at most √(var_east·var_north)"
        faults.add(f"{where}.cov_east_north_m2", expected, values["cov_east_north_m2"])


def _check_pseudorange(values: Mapping[str, Any], where: str, faults: Faults) -> None:
    place = [values[name] for name in PLACE]
    known = [isfinite(one) for one in place]
    if any(known) and not all(known):
        faults.add(f"{where}, {', '.join(PLACE)}", "all three, or none", "some of them")
    elif all(known):
        away_m = sum(one * one for one in place) ** 0.5
        if not LEAST_PLACE_M <= away_m <= MOST_PLACE_M:
            expected = "20 000 to 55 000 km from the earth's centre"
            faults.add(f"{where}, {', '.join(PLACE)}", expected, f"{away_m / 1000:.0f} km")


_CHECKS = {"radio": _check_radio, "gnss": _check_gnss, "pseudoranges": _check_pseudorange}
