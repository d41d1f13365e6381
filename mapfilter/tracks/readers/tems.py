"""Text exports of TEMS Investigation: a table of messages, one column for each chosen element.

The header names ``Time`` (a time of day) or ``Timestamp`` (with a date), ``MS`` or ``EQ``,
``Message Type``, and information elements, of all devices as ``All-…``, of a list with its
place ``[1]``. Elements that are not in a message are empty. Those read:

* ``Latitude``, ``Longitude`` (decimal degrees, also ``… Decimal Degree``), ``Altitude (m)``;
* of GSM ``LAC``, ``Cell Id``, ``BSIC (Num)``, ``ARFCN BCCH``, ``RxLev Sub (dBm)``, ``RxLev Full
  (dBm)``, and ``Neighbor LAC``, ``… Cell Id``, ``… BSIC (Num)``, ``… ARFCN``, ``… RxLev (dBm)``,
  also ``(Sorted)``;
* of LTE ``Serving Cell Identity`` (the PCI), ``Serving Cell DL EARFCN``, ``Serving Cell RSRP
  (dBm)``, the same of ``Neighbor Cell``, and the cell's identity ``Cell Identity (eNB Part)`` and
  ``Cell Identity (Cell Part)``.

An export may write the last values again in every message: rows that repeat all elements of cells
of the row before are read once a second.

Names are those of open programs that read such exports; there is no public description of the
export itself. Not read are elements of UMTS and NR, of which no names were found, of scanners
(``Scanned ARFCN``, ``Scanned RxLev (dBm)``), which have no codes, those of single devices
(``MS1-…``), levels without a unit, and timing advances. Name such columns yourself, as those of a
plain CSV.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from mapfilter._types import Bools, Floats
from mapfilter.clocks.times import without_midnights
from mapfilter.errors import InputError, fail
from mapfilter.tracks.readers.format import Format, ReadOptions
from mapfilter.tracks.readers.plain_csv import has_content
from mapfilter.tracks.readers.recorded.identities import add_radio, available
from mapfilter.tracks.readers.recorded.reading import Reading
from mapfilter.tracks.readers.recorded.recording import Clock
from mapfilter.tracks.readers.texts.columns import Columns
from mapfilter.tracks.readers.texts.kept_rows import only
from mapfilter.tracks.readers.texts.separated_values import (
    header_columns,
    header_names,
    likely_separator,
)
from mapfilter.tracks.readers.texts.text import Text

_TIMES = ("timestamp", "time")
_LAT = ("latitude", "latitude decimal degree")
_LON = ("longitude", "longitude decimal degree")
_GSM = {
    "arfcn": "arfcn bcch",
    "bsic": "bsic (num)",
    "level": "rxlev sub (dbm)",
    "full": "rxlev full (dbm)",
    "lac": "lac",
    "ci": "cell id",
}
_GSM_NEIGHBOUR = {
    "arfcn": "neighbor arfcn",
    "bsic": "neighbor bsic (num)",
    "level": "neighbor rxlev (dbm)",
    "lac": "neighbor lac",
    "ci": "neighbor cell id",
}
_LTE = {
    "arfcn": "serving cell dl earfcn",
    "bsic": "serving cell identity",
    "level": "serving cell rsrp (dbm)",
    "enb": "cell identity (enb part)",
    "part": "cell identity (cell part)",
}
_LTE_NEIGHBOUR = {
    "arfcn": "neighbor cell dl earfcn",
    "bsic": "neighbor cell identity",
    "level": "neighbor cell rsrp (dbm)",
}
_LTE_AGGREGATED = {field: _LTE[field] for field in ("arfcn", "bsic", "level")}
_TITLE, _DEVICES = "message type", {"ms", "eq"}
_ELEMENTS = {*_LAT, *_LON, *_GSM.values(), *_GSM_NEIGHBOUR.values(), *_LTE.values()}
_ELEMENTS_OF_CELLS = _ELEMENTS - {*_LAT, *_LON} | set(_LTE_NEIGHBOUR.values())
_LEVELS = {name for name in _ELEMENTS if "(dbm)" in name}
_MOST_LISTED = 32
_CELLS_OF_ENB = 256
_RENEWED_S = 1.0
_DAY_FIRST = r"^\s*(\d{2})[./](\d{2})[./](\d{4})\s+(\S.*)$"


@dataclass(frozen=True, eq=False)
class _Messages:
    """Rows with their times, and which of them are read for cells."""

    rows: Columns
    reading: Reading
    time_s: Floats
    renewed: Bools


def _plain(name: str) -> str:
    """Return an element's name without device and ways of listing it.

    Examples
    --------
    >>> _plain("all-neighbor rxlev (dbm) (sorted)[2]"), _plain("all-serving cell rsrp (dbm)[1]")
    ('neighbor rxlev (dbm)[2]', 'serving cell rsrp (dbm)')
    """
    bare = name.removeprefix("all-").replace(" (text)", "").replace(" (sorted)", "")
    return bare if bare.startswith("neighbor") else bare.removesuffix("[1]")


def _matches(text: Text) -> bool:
    names = header_names(text.first_line, likely_separator(text.first_line))
    plain = {_plain(name) for name in names}
    elements = {name.partition("[")[0] for name in plain} & _ELEMENTS
    exported = _TITLE in plain or any(name.startswith("all-") for name in names)
    # A column "ms" may be of milliseconds.
    exported |= bool(plain & _DEVICES) and (bool(elements & _LEVELS) or not has_content(names))
    return exported and bool(plain & set(_TIMES)) and len(elements - {"latitude", "longitude"}) > 0


def _read(text: Text, reading: Reading, options: ReadOptions) -> None:
    reading.program = "TEMS Investigation"
    rows = header_columns(text.data, reading, text.line)
    own = any(name.startswith("all-") for name in rows.names)
    rows = replace(rows, names=tuple(_plain(name) for name in rows.names))
    if not (own or {name.partition("[")[0] for name in rows.names} & _LEVELS or _matches(text)):
        expected = "elements of TEMS, such as All-Serving Cell RSRP (dBm)[1]"
        raise fail(InputError, f"{reading.path} header", expected, ", ".join(rows.names)[:200])
    time_s = _times(rows, reading, options)
    _add_positions(rows, reading, time_s)
    messages = _Messages(rows, reading, time_s, _renewed(rows, reading, time_s))
    _add_serving_gsm(messages)
    _add_serving_lte(messages)
    for place in range(_MOST_LISTED):
        listed = f"[{place}]"
        _add_listed(messages, "GSM", _GSM_NEIGHBOUR, listed)
        _add_listed(messages, "LTE", _LTE_NEIGHBOUR, listed)
        # Carriers of an aggregation after the first.
        _add_listed(messages, "LTE", _LTE_AGGREGATED, listed)


def _times(rows: Columns, reading: Reading, options: ReadOptions) -> Floats:
    """Return times by stamps with dates, else seconds from the midnight before the first row."""
    reading.clock = Clock("local", options.zone)
    if not len(rows):
        return np.zeros(0)
    day_s = rows.seconds_of_day(*_TIMES)
    if np.isfinite(day_s).sum() > 0.5 * (rows.texts(*_TIMES) != "").sum():
        reading.clock = Clock("monotonic", from_midnight=True)
        reading.note("times of day without a date: they count from an unknown day")
        before_s = max((p[-1]["time_s"].iloc[-1] for p in reading.tables.values()), default=np.nan)
        return without_midnights(day_s, float(before_s))
    iso = rows.rewritten(_DAY_FIRST, r"\3-\2-\1T\4", *_TIMES)
    time_s, zoned = iso.times_of_part(*_TIMES, zone=options.zone)
    if zoned and not options.zone:
        reading.clock = Clock("utc")
    return time_s


def _renewed(rows: Columns, reading: Reading, time_s: Floats) -> Bools:
    """Return the rows with another element of cells than the row before, or a second later."""
    names = [name for name in rows.names if name.partition("[")[0] in _ELEMENTS_OF_CELLS]
    changed = np.ones(len(rows), dtype=bool)
    if names and len(rows):
        changed[1:] = np.logical_or.reduce([rows.changes(name) for name in names])[1:]
    first = np.flatnonzero(changed)[np.cumsum(changed) - 1]
    second = np.floor((time_s - time_s[first]) / _RENEWED_S)
    repeated = ~changed
    repeated[1:] &= (second[1:] == second[:-1]) & (time_s[1:] > time_s[:-1])
    if repeated.any():
        some = np.logical_or.reduce([~rows.flags(name, true=("",)) for name in names])
        reading.refuse(rows.line[repeated & some], "radio: repeats the row before within a second")
    return ~repeated


def _add_positions(rows: Columns, reading: Reading, time_s: Floats) -> None:
    """Add the positions that differ from the one before."""
    lat, lon = rows.number(*_LAT), rows.number(*_LON)
    there = np.flatnonzero(np.isfinite(lat) | np.isfinite(lon))
    new = np.ones(len(there), dtype=bool)
    new[1:] = (np.diff(lat[there]) != 0) | (np.diff(lon[there]) != 0)
    kept = np.zeros(len(rows), dtype=bool)
    kept[there[new]] = True
    columns = {
        "time_s": time_s,
        "lat_deg": lat,
        "lon_deg": lon,
        "altitude_m": rows.number("altitude (m)"),
    }
    if kept.any():
        reading.add("positions", *only(columns, rows.line, kept))


def _add_serving_gsm(messages: _Messages) -> None:
    columns = _cells(messages.rows, _GSM)
    full = messages.rows.number(_GSM["full"])
    columns["level_dbm"] = np.where(np.isnan(columns["level_dbm"]), full, columns["level_dbm"])
    _add_cells(messages, columns, "GSM", "serving")


def _add_serving_lte(messages: _Messages) -> None:
    rows, reading = messages.rows, messages.reading
    columns = _cells(rows, _LTE)
    enb, part = (available(*rows.whole(_LTE[name])) for name in ("enb", "part"))
    known = (enb >= 0) & (part >= 0) & (part < _CELLS_OF_ENB)
    ci = np.where(known, _CELLS_OF_ENB * enb + part, np.nan)
    # An identity is in the messages that have it: it holds until carrier or PCI change.
    cell = pd.DataFrame({name: columns[name] for name in ("arfcn", "bsic")} | {"ci": ci})
    cell = pd.concat([_last_serving(reading), cell])
    shown = cell[["arfcn", "bsic"]].ffill().fillna(-1)
    run = (shown != shown.shift()).any(axis=1).cumsum().to_numpy()
    columns["ci"] = cell["ci"].groupby(run).ffill().to_numpy()[len(cell) - len(rows) :]
    _add_cells(messages, columns, "LTE", "serving")


def _last_serving(reading: Reading) -> pd.DataFrame:
    """Return the last serving cell of LTE of the part of the file read before, if any."""
    names = ["arfcn", "bsic", "ci"]
    for part in reversed(reading.tables.get("radio", [])):
        last = part[(part["role"] == "serving") & (part["technology"] == "LTE")]
        if len(last):
            return last.iloc[-1:][names]
    return pd.DataFrame({name: np.zeros(0) for name in names})


def _add_listed(messages: _Messages, family: str, names: Mapping[str, str], listed: str) -> None:
    """Add the cells of one place of a list."""
    names = {field: name + listed for field, name in names.items()}
    if messages.rows.has(names["level"]):
        _add_cells(messages, _cells(messages.rows, names), family, "neighbour")


def _cells(rows: Columns, names: Mapping[str, str]) -> dict[str, np.ndarray]:
    whole = [name for name in ("arfcn", "bsic", "lac", "ci") if name in names]
    columns = {name: available(*rows.whole(names[name])) for name in whole}
    return {**columns, "level_dbm": rows.number(names["level"])}


def _add_cells(
    messages: _Messages, columns: Mapping[str, np.ndarray], family: str, role: str
) -> None:
    """Add the rows with a level and something that names its cell."""
    named = [~np.isnan(columns[name]) for name in ("arfcn", "bsic", "ci") if name in columns]
    kept = np.logical_or.reduce(named) & ~np.isnan(columns["level_dbm"]) & messages.renewed
    if kept.any():
        timed = {**columns, "time_s": messages.time_s}
        some, lines = only(timed, messages.rows.line, kept)
        some["technology"] = np.full(len(lines), family, dtype=object)
        add_radio(messages.reading, {**some, "role": role}, lines)


FORMAT = Format(
    "tems",
    "a TEMS Investigation export",
    "TEMS Investigation (text export, tab-delimited)",
    "serving cells and neighbours of GSM and LTE by carrier and code with levels, identities, "
    "positions",
    _matches,
    _read,
    by_rows=True,
)
