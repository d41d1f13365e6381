"""Tables of fingerprints: a row for each report, a column for each transmitter.

As published for Wi-Fi benchmarks (UJIIndoorLoc and its successors): positions in some columns, and
levels in dBm in all others, 100 or nothing where a transmitter was not received.
"""

from __future__ import annotations

import csv
from collections import Counter
from io import StringIO
from pathlib import Path

import numpy as np
import pandas as pd

from mapfilter._arguments import Setting, check_arguments, path_argument
from mapfilter._crs_reach import likely_mistake, project_within
from mapfilter._cut_ends import without_cut_end
from mapfilter._inputs import read_input, wide_encoding
from mapfilter._separator_line import without_separator_line
from mapfilter._types import Bools, Floats
from mapfilter._words import number_of
from mapfilter.errors import InputError, fail, listed
from mapfilter.geodesy import projected_crs, short_crs, utm_crs_of
from mapfilter.positioning.fingerprints.report_checks import NOT_RECEIVED_DBM
from mapfilter.positioning.fingerprints.reports import Reports, make_reports

_METRES = (("east_m", "north_m"), ("x_m", "y_m"), ("x", "y"))
_DEGREES = (("lon_deg", "lat_deg"), ("longitude", "latitude"), ("lon", "lat"))
_PLACES = frozenset(name for pair in (*_METRES, *_DEGREES) for name in pair)
"""Columns of positions; of several pairs the first is used."""
_OTHER = frozenset(
    (
        *("floor", "building", "buildingid", "spaceid", "relativeposition", "userid", "phoneid"),
        *("timestamp", "time", "time_s", "z", "z_m", "altitude", "accuracy", "accuracy_m"),
        *("id", "session"),
    )
)
_LEVEL_DBM = (-200.0, 0.0)
_LONGEST = 40
_LARGEST_BYTES = 1 << 30
_MERCATOR = "EPSG:3857"
_SEPARATORS = (",", ";", "\t")


def read_fingerprint_table(path: Path | str, crs: str | None = None) -> Reports:
    """Read a table of fingerprints.

    Columns ``east_m, north_m`` (or ``x, y``) hold metres, ``lon, lat`` (or ``longitude, latitude``)
    degrees, or metres where they cannot be degrees; metres are used where a table has both. Columns
    such as ``floor`` and ``userid`` are not used; all others are transmitters. Levels that are none
    are left out and counted. Decimal commas are read where they separate nothing.

    Parameters
    ----------
    crs : str, optional
        Projected CRS: required for metres in ``x, y``; that of metres in ``longitude, latitude``
        is Web Mercator, as in UJIIndoorLoc, when left out.

    Raises
    ------
    InputError
        The file cannot be read, has no column of positions or of levels, a column twice, or no row
        with a level; or the CRS is unknown.
    ConfigError
        The path is none, or the CRS is no text.
    """
    check_arguments(
        "read_fingerprint_table",
        path_argument("path", path),
        keywords=[Setting("crs", crs, str | None)],
    )
    path = Path(path)
    table, separator, notes = _read(path)
    names = {name: str(name).strip() for name in table.columns}
    lower = {text.lower(): name for name, text in names.items()}
    used = next((p for p in (*_METRES, *_DEGREES) if set(p) <= lower.keys()), None)
    places = np.full((len(table), 2), np.nan)
    if used is not None:
        places = np.column_stack([_numbers(table[lower[name]], separator) for name in used])
    cells = [name for text, name in lower.items() if text not in _PLACES | _OTHER]
    if not cells:
        expected = "a column for each transmitter"
        raise fail(InputError, f"{path}, header", expected, listed(list(names.values())))
    levels = np.column_stack([_numbers(table[name], separator) for name in cells])
    crs, places = _projected(path, crs, places, degrees=used in _DEGREES, known=used is not None)
    received = np.isfinite(levels) & (levels != NOT_RECEIVED_DBM)
    levels, received, odd = _checked(levels, received)
    if odd:
        low, high = _LEVEL_DBM
        notes.append(
            f"{path.name}: {number_of(odd, 'level')} left out: not in {low:g}..{high:g} dBm"
        )
    if not received.any():
        expected = f"levels in dBm, {NOT_RECEIVED_DBM:g} where not received"
        raise fail(InputError, str(path), expected, "none", "another kind of table")
    report, column = np.nonzero(received)
    return make_reports(
        crs,
        report,
        np.array([names[name] for name in cells], dtype=str)[column],
        levels[report, column],
        count=len(table),
        places=places,
        notes=notes,
    )


def _read(path: Path) -> tuple[pd.DataFrame, str, list[str]]:
    """Return a table, what separates its fields, and notes."""
    expected = "a table with a header line"
    data = read_input(path, _LARGEST_BYTES, "a table")
    if wide := wide_encoding(data):
        hint = "saved as Unicode; save as UTF-8"
        raise fail(InputError, str(path), "text in UTF-8", f"{wide} text", hint)
    data, notes = without_cut_end(data, _SEPARATORS, path.name)
    text = data.decode("utf-8-sig", "replace")
    lines = [line for line in without_separator_line(text).splitlines() if line.strip()]
    if not lines:
        raise fail(InputError, str(path), expected, "an empty file", "cut off")
    separator = max(_SEPARATORS, key=lines[0].count)
    named = [name.strip().lower() for name in _fields(lines[0], separator)]
    if len(set(named)) < len(named):
        twice = sorted(name for name, times in Counter(named).items() if times > 1)
        raise fail(InputError, f"{path}, header", "each column once", listed(twice))
    # Rows that are too short end in empty fields; which field of one too long is which is unknown.
    kept = [line for line in lines[1:] if len(_fields(line, separator)) <= len(named)]
    if len(kept) < len(lines) - 1:
        count = len(lines) - 1 - len(kept)
        notes.append(f"{path.name}: {number_of(count, 'row')} left out: too many fields")
    if not kept:
        raise fail(InputError, str(path), f"{expected} and rows", "no rows", "cut off")
    try:
        rows = StringIO("\n".join([lines[0], *kept]))
        table = pd.read_csv(rows, sep=separator, index_col=False, low_memory=False)
    except (ValueError, pd.errors.ParserError, pd.errors.ParserWarning) as error:
        got = str(error).splitlines()[0]
        raise fail(InputError, str(path), expected, got, "cut off, or no text") from error
    return table, separator, notes


def _fields(line: str, separator: str) -> list[str]:
    if '"' not in line:
        return line.split(separator)
    try:
        return next(csv.reader([line], delimiter=separator), [])
    except csv.Error:
        return line.split(separator)


def _numbers(column: pd.Series, separator: str) -> Floats:
    if pd.api.types.is_bool_dtype(column.dtype):
        return np.full(len(column), np.nan)
    if separator != "," and not pd.api.types.is_numeric_dtype(column.dtype):
        column = column.astype(str).str.replace(",", ".", regex=False)
    try:
        numbers = pd.to_numeric(column, errors="coerce")
    except OverflowError:
        # A whole number of hundreds of digits.
        numbers = pd.to_numeric(column.astype(str).str.slice(0, _LONGEST), errors="coerce")
    return np.asarray(numbers.to_numpy(np.float64, na_value=np.nan))


def _checked(levels: Floats, received: Bools) -> tuple[Floats, Bools, int]:
    low, high = _LEVEL_DBM
    right = np.asarray((levels >= low) & (levels <= high))
    return levels, received & right, int((received & ~right).sum())


def _projected(
    path: Path, crs: str | None, places: Floats, *, degrees: bool, known: bool
) -> tuple[str, Floats]:
    """Return CRS and positions in metres."""
    finite = np.asarray(np.isfinite(places).all(axis=1))
    places = np.where(finite[:, np.newaxis], places, np.nan)
    largest = np.abs(places[finite]).max(axis=0, initial=0.0)
    if known and degrees and finite.any() and bool(np.all(largest <= (180.0, 90.0))):
        lon_deg, lat_deg = places.T
        found = projected_crs(crs or utm_crs_of(*places[finite].T))
        east_m, north_m, beyond = project_within(found, lon_deg, lat_deg)
        _check_covered(path, found, places, beyond & finite)
        return found, np.column_stack([east_m, north_m])
    if crs is None and degrees:
        crs = _MERCATOR
    if crs is None:
        hint = (
            "give crs (--crs), such as EPSG:32630; for a frame of its own any projected CRS of the "
            "place"
        )
        raise fail(InputError, f"{path}, positions", "a CRS of the metres", "none", hint)
    return projected_crs(crs, "crs"), places


def _check_covered(path: Path, crs: str, places: Floats, beyond: Bools) -> None:
    """Check that a CRS covers the positions in degrees of a table."""
    if not beyond.any():
        return
    row = int(np.argmax(beyond))
    lon_deg, lat_deg = places[row]
    where, expected = f"{path}, row {row + 1}", f"a position that {short_crs(crs)} covers"
    got = f"{lat_deg:.6g}, {lon_deg:.6g}"
    raise fail(InputError, where, expected, got, likely_mistake(crs, lon_deg, lat_deg))
