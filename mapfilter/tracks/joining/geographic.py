"""Positions given in degrees, as phones and pandas users have them, in a log's CRS."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from mapfilter._crs_reach import project_within
from mapfilter._types import Ints
from mapfilter.errors import Faults
from mapfilter.tracks.checks.beyond_crs import without_beyond
from mapfilter.tracks.checks.rounded_degrees import with_rounding
from mapfilter.tracks.column_values import TableFaults, column_values
from mapfilter.tracks.joining.no_fix import first_row, no_fix_note, rows_without_fix
from mapfilter.tracks.joining.position_units import RADIUS_68
from mapfilter.tracks.schema import SCHEMA, Column

_SWAPPED = "longitude and latitude swapped, or metres given for degrees"
_LAT = Column("lat_deg", -90, 90, "degrees in -90..90", _SWAPPED, required=True)
_LON = Column("lon_deg", -180, 180, "degrees in -180..180", _SWAPPED, required=True)
_ACCURACY = Column("accuracy_m", 0, 1e5, "metres in 0..100000")
_VARIANCES = ("var_east_m2", "var_north_m2", "cov_east_north_m2")
_TIME = SCHEMA["gnss"][0]


class PlacedTable(NamedTuple):
    """A table of positions with columns in metres, the numbers of its rows, and notes."""

    rows: pd.DataFrame
    row_numbers: ArrayLike | None = None
    notes: tuple[str, ...] = ()


def in_metres(
    table: str,
    given: pd.DataFrame,
    where: str,
    crs: str | None,
    faults: Faults,
    row_numbers: ArrayLike | None = None,
) -> PlacedTable:
    """Return a table of positions with columns in metres in place of those in degrees.

    Rows without a position, as receivers write them while they have no fix, are left out: both
    degrees are missing, or both are 0. Degrees of three decimals or fewer have at least the error
    of rounding. Positions at which the CRS means nothing are left out, too.

    Parameters
    ----------
    table : str
        "gnss" or "truth"; errors are those of the former alone.
    given : pandas.DataFrame
        With ``lat_deg`` and ``lon_deg`` (WGS 84), or places in metres, which go first. Of gnss
        ``accuracy_m``, if known, is the radius that holds 68 % as phones state it; variances that
        are given count, and an accuracy does not then.
    where : str
        Name of the table in messages.
    crs : str
        The log's CRS; None where it is at fault.
    row_numbers : (N,) array_like of int, optional
        Number of each row in messages; 1 to N by default.
    """
    degrees = ("lat_deg", "lon_deg")
    stated = bool(set(_VARIANCES) & set(given.columns))
    has_accuracy = table == "gnss" and "accuracy_m" in given.columns and not stated
    numbers = np.arange(1, len(given) + 1) if row_numbers is None else np.asarray(row_numbers)
    if not set(degrees) <= set(given.columns) or {"east_m", "north_m"} & set(given.columns):
        if not has_accuracy:
            return PlacedTable(given, row_numbers)
        accuracy_m = column_values(_ACCURACY, given, TableFaults(where, numbers, faults))
        rest = given.drop(columns="accuracy_m")
        return PlacedTable(_with_variances(rest, accuracy_m), row_numbers)
    given, numbers, notes = _with_fix(given.reset_index(drop=True), where, numbers, faults)
    found, before = TableFaults(where, numbers, faults), len(faults.found)
    lat_deg, lon_deg = (column_values(one, given, found) for one in (_LAT, _LON))
    places = pd.DataFrame({"lat_deg": lat_deg, "lon_deg": lon_deg})
    if has_accuracy:
        places = places.assign(accuracy_m=column_values(_ACCURACY, given, found))
    rest = given.drop(columns=[*degrees, *(("accuracy_m",) if has_accuracy else ())])
    if crs is None or len(faults.found) > before:
        return PlacedTable(rest.assign(east_m=0.0, north_m=0.0), numbers, notes)
    places, rounded = with_rounding(places, where)
    notes += (rounded,) if rounded else ()
    east_m, north_m, beyond = project_within(crs, lon_deg, lat_deg)
    note = without_beyond(where, crs, lon_deg, lat_deg, beyond, faults, numbers)
    notes += (note,) if note else ()
    kept = ~beyond
    rest, places, numbers = rest[kept], places[kept], numbers[kept]
    placed = rest.assign(east_m=east_m[kept], north_m=north_m[kept])
    if table != "gnss" or stated or "accuracy_m" not in places:
        return PlacedTable(placed, numbers, notes)
    return PlacedTable(_with_variances(placed, places["accuracy_m"]), numbers, notes)


def _with_variances(rows: pd.DataFrame, accuracy: ArrayLike) -> pd.DataFrame:
    """Return positions with the variances of radii that hold 68 %."""
    accuracy_m = np.asarray(accuracy, dtype=np.float64)
    variance_m2 = np.where(accuracy_m > 0, (accuracy_m / RADIUS_68) ** 2, np.nan)
    return rows.assign(
        var_east_m2=variance_m2,
        var_north_m2=variance_m2,
        cov_east_north_m2=np.where(np.isnan(variance_m2), np.nan, 0.0),
    )


def _with_fix(
    given: pd.DataFrame, where: str, numbers: Ints, faults: Faults
) -> tuple[pd.DataFrame, Ints, tuple[str, ...]]:
    """Return the rows that hold a position, their numbers, and a note on the others."""
    without = rows_without_fix(given["lat_deg"], given["lon_deg"])
    if not without.any():
        return given, numbers, ()
    # A wrong clock is a fault also of rows that hold nothing else.
    column_values(
        _TIME, given[without].reset_index(drop=True), TableFaults(where, numbers[without], faults)
    )
    note = no_fix_note(where, int(without.sum()), first_row(numbers, without))
    return given[~without].reset_index(drop=True), numbers[~without], (note,)
