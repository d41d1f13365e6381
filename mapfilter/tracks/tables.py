"""Checks of a log's tables, one by one: columns, ranges, units, duplicates and order."""

from __future__ import annotations

import itertools
from difflib import get_close_matches
from functools import cache

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from mapfilter._types import Bools
from mapfilter._words import number_of
from mapfilter.angles import wrap_rad
from mapfilter.errors import Faults, listed
from mapfilter.radio.identities import LIMITS, technology
from mapfilter.radio.scale_ends import at_scale_end
from mapfilter.tracks.checks.cut_times import cut_times
from mapfilter.tracks.checks.repeated_readings import repeated_readings
from mapfilter.tracks.column_values import TableFaults, column_values, note_values
from mapfilter.tracks.schema import (
    LEAST_PLACE_M,
    MOST_PLACE_M,
    NEIGHBOUR,
    PLACE,
    SATELLITE,
    SCHEMA,
    SERVING,
    Column,
)

_SELDOM_S = 10.0
_SOMEWHERE_M = 25.0
_SLOW_MPS = 0.04
_UNITS = ((1e8, "nanoseconds", "ns"), (1e5, "microseconds", "us"), (0.0, "milliseconds", "ms"))
"""Units of times by the least number between rows a tenth of a second to minutes apart."""
_ROWS_AT_ONCE = 100_000
_MOVING = ("motion", "gnss", "truth")
_SHOWN = 40


def tidy_table(
    table: str,
    given: pd.DataFrame | None,
    where: str,
    faults: Faults,
    row_numbers: ArrayLike | None = None,
) -> tuple[pd.DataFrame, tuple[str, ...]]:
    """Return a table with the columns of the schema, sorted by time, without exact duplicates.

    The notes returned with it are on what was ignored, sorted or dropped. A table with faults only
    serves to find further ones.

    Parameters
    ----------
    given : pandas.DataFrame or None
        Table as read or made; None is an empty one. Values may be text, as from CSV.
    where : str
        Name of the file or table in messages.
    row_numbers : (N,) array_like of int, optional
        Number of each row in messages; 1 to N by default.
    """
    if given is None:
        return _empty_table(table).copy(), ()
    given = given.reset_index(drop=True)
    numbers = np.arange(1, len(given) + 1) if row_numbers is None else np.asarray(row_numbers)
    found = TableFaults(where, numbers, faults)
    notes = _check_columns(table, given, found)
    columns = [c for c in SCHEMA[table] if c.name in given.columns or not c.optional]
    tidy = pd.DataFrame({column.name: column_values(column, given, found) for column in columns})
    if table == "radio":
        role = tidy["role"]
        bad = role.notna().to_numpy() & ~role.isin([SERVING, NEIGHBOUR]).to_numpy()
        note_values(found, bad, SCHEMA["radio"][1], role)
        if "technology" in tidy:
            tidy["technology"] = _technologies(tidy["technology"], found)
            _check_technologies(tidy, found)
        tidy["censored"] = _bounds(tidy, found)
    if table == "gnss":
        _check_covariance(tidy, found)
    if table == "pseudoranges":
        _check_satellites(tidy, found)
    if table == "motion":
        tidy["heading_rad"] = wrap_rad(tidy["heading_rad"])
    else:
        _check_degrees(tidy, found)
    _check_milliseconds(table, tidy, found)
    return _sorted_unique(tidy, where, (*notes, *found.notes))


@cache
def _empty_table(table: str) -> pd.DataFrame:
    columns = pd.DataFrame({c.name: [] for c in SCHEMA[table] if not c.optional})
    return tidy_table(table, columns, table, Faults())[0]


def _check_columns(table: str, given: pd.DataFrame, found: TableFaults) -> tuple[str, ...]:
    names = [column.name for column in SCHEMA[table]]
    usual = [c.name for c in SCHEMA[table] if not c.optional and c.name not in given.columns]
    notes = []
    for name in (str(name) for name in given.columns if name not in names):
        near = get_close_matches(name, usual, 1, 0.6)
        if near:
            found.add(f", column {name}", f"columns {', '.join(names)}", name, near[0])
        else:
            notes.append(f"{found.where}: column {name} is not used")
    lacking = [c.name for c in SCHEMA[table] if c.required and c.name not in given.columns]
    placed = ["east_m", "north_m"]
    if table in ("gnss", "truth") and set(placed) <= set(lacking):
        expected = "columns east_m and north_m, or lat_deg and lon_deg"
        found.add("", expected, "neither", _likely_place(given))
        lacking = [name for name in lacking if name not in placed]
    for name in lacking:
        found.add("", f"a column {name}", "none")
    return tuple(notes)


def _likely_place(given: pd.DataFrame) -> str:
    """Return what columns without the usual names of positions most likely are; "" for unknown."""
    names = {str(name).lower() for name in given.columns}
    for lat, lon in (("latitude", "longitude"), ("lat", "lon"), ("lat", "lng"), ("lat", "long")):
        if {lat, lon} <= names:
            return f"{lat} and {lon}; call them lat_deg and lon_deg"
    if {"x", "y"} <= names:
        return "x and y; call them east_m and north_m if they are metres in the CRS of the log"
    if "geometry" in names:
        return "points; give east_m and north_m, their x and y in the CRS of the log"
    return ""


def _technologies(stated: pd.Series, found: TableFaults) -> pd.Series:
    """Return technologies by their usual names, as LTE for 4G; note words that are none."""
    names = {word: technology(word) for word in stated.dropna().unique()}
    if unknown := [word for word, name in names.items() if name is None]:
        some = listed([repr(word[:_SHOWN]) for word in unknown])
        found.notes.append(f"{found.where}, technology: {some} not known, taken for none")
    others = {word: name for word, name in names.items() if name not in (None, word)}
    return stated.replace(others) if others else stated


def _bounds(radio: pd.DataFrame, found: TableFaults) -> pd.Series:
    """Return on which side of the scale levels are, where it is not stated as levels show it."""
    censored = radio["censored"]
    level_dbm = radio["level_dbm"].to_numpy(dtype=np.float64, na_value=np.nan)
    unstated = censored.isna().to_numpy()
    of = np.zeros(len(radio), dtype=np.int64)
    families: list[str] = []
    if "technology" in radio:
        of, found_families = pd.factorize(radio["technology"])
        families = [str(family) for family in found_families]
    for one in np.unique(of):
        some = unstated & (of == one)
        bounds = at_scale_end(np.where(some, level_dbm, np.nan))
        if not bounds.any():
            continue
        censored = censored.mask(bounds, 1)
        count = number_of(int(bounds.sum()), "level")
        end = f"{level_dbm[bounds][0]:g} dBm, where a scale ends"
        family = f" of {families[one]}" if one >= 0 and len(families) > 1 else ""
        text = f"level_dbm{family}: {count} of {end}: taken for that or more"
        found.notes.append(f"{found.where}, {text}")
    return censored.fillna(0)


def _check_technologies(radio: pd.DataFrame, found: TableFaults) -> None:
    """Note carriers, codes and timing advances that the row's technology does not have."""
    for family, limits in LIMITS.items():
        of = (radio["technology"] == family).to_numpy()
        for name, most in limits.items():
            if of.any() and name in radio:
                value = radio[name].to_numpy(dtype=np.float64, na_value=np.nan)
                hint = "metres for steps" if name == "timing_advance" else ""
                column = Column(name, expected=f"0..{most} in {family}", hint=hint)
                note_values(found, of & (value > most), column, radio[name])


def _check_covariance(gnss: pd.DataFrame, found: TableFaults) -> None:
    with np.errstate(invalid="ignore"):  # Variances below 0 are a fault of their own.
        sd_east_m = np.sqrt(gnss["var_east_m2"].to_numpy())
        sd_north_m = np.sqrt(gnss["var_north_m2"].to_numpy())
    # Squares and products of the largest numbers would be infinite.
    bad = np.abs(gnss["cov_east_north_m2"].to_numpy()) > sd_east_m * sd_north_m * (1 + 1e-9)
    column = Column("cov_east_north_m2", expected="a covariance of at most √(var_east·var_north)")
    note_values(found, bad, column, gnss["cov_east_north_m2"])


def _check_satellites(rows: pd.DataFrame, found: TableFaults) -> None:
    """Note satellites not named as in RINEX, or not as high as satellites are."""
    name = rows["satellite"]
    wrong = name.notna().to_numpy() & ~name.astype(str).str.fullmatch(SATELLITE).to_numpy(bool)
    hint = "its constellation's letter (G, R, E, C, J, I, S) and two digits"
    found.add_rows(
        wrong, "satellite", "a name such as G07", lambda row: repr(name.iloc[row]), lambda _: hint
    )
    place, field = rows[list(PLACE)].to_numpy(dtype=np.float64), ", ".join(PLACE)
    known = np.isfinite(place)
    some = known.any(axis=1) & ~known.all(axis=1)
    found.add_rows(some, field, "all three, or none", lambda _: "some of them", lambda _: "")
    away_m = np.sqrt(np.sum(place**2, axis=1))
    bad = known.all(axis=1) & ~((away_m >= LEAST_PLACE_M) & (away_m <= MOST_PLACE_M))
    found.add_rows(
        bad,
        field,
        "20 000 to 55 000 km from the earth's centre",
        lambda row: f"{away_m[row] / 1000:.0f} km",
        lambda _: "kilometres for metres, or a receiver's place",
    )


def _check_degrees(table: pd.DataFrame, found: TableFaults) -> None:
    """Find positions that are longitudes and latitudes: near zero, and hardly moving for long."""
    if "east_m" not in table or len(table) < 2:
        return
    east, north = table["east_m"].to_numpy(), table["north_m"].to_numpy()
    small = bool(np.all(np.abs(east) <= 180) and np.all(np.abs(north) <= 180))
    extent = max(np.ptp(east), np.ptp(north))
    if small and 0 < extent < 0.5 and np.ptp(table["time_s"].to_numpy()) >= 10:
        got = f"all within {extent:.4g} of ({east[0]:.6g}, {north[0]:.6g})"
        found.add(", east_m and north_m", "metres", got, "degrees given for metres")


def _check_milliseconds(table: str, rows: pd.DataFrame, found: TableFaults) -> None:
    """Find times in milliseconds: rows seldom come, and what gets somewhere goes very slowly."""
    time = rows["time_s"].to_numpy()
    time = time if (np.diff(time) > 0).all() else np.unique(time)
    if len(time) < 3 or table not in _MOVING or not np.isfinite(time).all():
        return
    between_s = float(np.median(np.diff(time)))
    if table == "motion":
        moved_m = float(np.nansum(np.abs(rows["step_m"].to_numpy())))
    else:
        # Not the path's length: the fixes of a parked car jitter.
        moved_m = float(np.hypot(*(np.ptp(rows[n].to_numpy()) for n in ("east_m", "north_m"))))
    speed_mps = moved_m / (time[-1] - time[0])
    if between_s >= _SELDOM_S and moved_m >= _SOMEWHERE_M and speed_mps < _SLOW_MPS:
        got = f"{between_s:g} between rows, hence {speed_mps:.2g} m/s"
        words, unit = next(of for least_s, *of in _UNITS if between_s >= least_s)
        hint = f"{words} for s; convert them; a recording (CSV) may have a column time_{unit}"
        found.add(", time_s", "seconds", got, hint)


def _sorted_unique(
    table: pd.DataFrame, where: str, notes: tuple[str, ...]
) -> tuple[pd.DataFrame, tuple[str, ...]]:
    if "step_m" in table and (cut := cut_times(table["time_s"].to_numpy())):
        notes += (f"{where}: {cut}",)
    duplicate = repeated_readings(table, _repeated(table))
    if duplicate.any():
        notes += (f"{where}: {number_of(int(duplicate.sum()), 'exact duplicate row')} dropped",)
        table = table[~duplicate]
    time_s = table["time_s"].to_numpy()
    backwards = int(np.sum(np.diff(time_s) < 0))
    if backwards:
        notes += (f"{where}: out of order in {number_of(backwards, 'place')}, sorted by time",)
        table = table.sort_values("time_s", kind="stable")
    return table.reset_index(drop=True), notes


def _repeated(table: pd.DataFrame) -> Bools:
    """Return which rows equal an earlier one, part by part where that needs less memory."""
    time_s = table["time_s"].to_numpy()
    between_s = np.diff(time_s)
    if (between_s > 0).all():
        return np.zeros(len(table), dtype=np.bool_)
    if not (between_s >= 0).all():
        return np.asarray(table.duplicated())
    # Equal rows have equal times, so no part ends between them.
    cuts = np.searchsorted(time_s, time_s[_ROWS_AT_ONCE::_ROWS_AT_ONCE])
    ends = [0, *np.unique(cuts).tolist(), len(table)]
    parts = [table.iloc[a:b].duplicated() for a, b in itertools.pairwise(ends)]
    return np.concatenate(parts) if parts else np.zeros(0, dtype=np.bool_)
