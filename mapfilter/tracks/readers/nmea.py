"""NMEA 0183: positions, speed and course, accuracy, date and time."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence

import numpy as np
import pandas as pd

from mapfilter._constants import DAY_S, KNOT_MPS
from mapfilter._types import Floats, Ints
from mapfilter._words import number_of
from mapfilter.errors import listed
from mapfilter.tracks.joining.position_units import RADIUS_68, UERE_M
from mapfilter.tracks.readers.format import Format, ReadOptions
from mapfilter.tracks.readers.nmea_sentences import sentences
from mapfilter.tracks.readers.nmea_stamps import stamped_dates
from mapfilter.tracks.readers.recorded.reading import Reading
from mapfilter.tracks.readers.recorded.recording import Clock
from mapfilter.tracks.readers.texts.columns import Columns
from mapfilter.tracks.readers.texts.separated_values import line_columns
from mapfilter.tracks.readers.texts.text import Text

_STAMP = rb"[^$!,;\t]{0,48}(?:[,;\t][^$!,;\t]{0,48}){0,2}"
_SENTENCE = re.compile(rb"\A" + _STAMP + rb"[$!]([A-Z]{2}|P)([A-Z]{3})[,\d]")
"""Apps for Android write ``NMEA,$GNGGA,…*hh,TIME``, loggers a time stamp before each sentence."""
_MODE = ("magnetic", "side", "mode")
"""Fields that old receivers do not have."""
_KINDS = {
    b"GGA": ("time", "lat", "ns", "lon", "ew", "quality", "used", "hdop", "altitude"),
    b"RMC": ("time", "status", "lat", "ns", "lon", "ew", "knots", "course", "date", *_MODE),
    b"GST": ("time", "rms", "major", "minor", "axis", "lat_sd", "lon_sd"),
    b"ZDA": ("time", "day", "month", "year"),
}
_FIELDS = 20
_OWN_SENTENCE = re.compile(rb"\$(P[A-Z0-9]{2,12}),")
_OF_CELLS = ("CELL", "GSM", "LTE", "RSSI", "RSRP", "CSQ", "QENG")
"""Parts of the names of sentences that loggers write among those of a receiver."""


def _matches(text: Text) -> bool:
    lines = [line.strip() for line in text.head[:200] if line.strip()]
    found = sum(_SENTENCE.match(line.encode()) is not None for line in lines)
    return found >= 1 and found >= 0.5 * len(lines)


def _read(text: Text, reading: Reading, options: ReadOptions) -> None:  # noqa: ARG001
    reading.program, reading.clock = "NMEA 0183 receiver", Clock("utc")
    found = sentences(text.data, _KINDS, reading)
    _note_cells(text.data, reading)
    tables = {kind: _table(kind, *found.pop(kind), reading) for kind in _KINDS}
    dates = _dates(tables)
    if dates.empty:
        gga = tables[b"GGA"]
        dates = stamped_dates(text.data, gga.line, _of_day(gga.texts("time")))
        if len(dates):
            reading.note("dates are those of the time stamps before the sentences")
    if dates.empty:
        reading.note("no date in the file (neither RMC nor ZDA): times count from a midnight")
        reading.clock = Clock("monotonic", from_midnight=True)
    known = tables[b"GGA"], tables[b"RMC"]
    parts = [_gga(known[0], dates, reading), _rmc(known[1], dates, reading)]
    rows = pd.concat(parts, ignore_index=True)
    rows = rows[rows["valid"]].sort_values("line", kind="stable")
    reading.refuse(rows["line"][rows["time_s"].isna()], "positions: no usable time")
    if rows.empty:
        return
    first = rows.groupby("time_s", sort=True).first().reset_index()
    accuracy = _accuracy(tables[b"GST"], dates, first)
    columns = {name: first[name].to_numpy() for name in first.columns}
    columns["accuracy_m"] = np.where(np.isnan(accuracy), columns["accuracy_m"], accuracy)
    reading.add("positions", columns, columns["line"])


def _note_cells(data: bytes, reading: Reading) -> None:
    """Note sentences of a user's own with cells, which no standard describes."""
    kinds = Counter(found.decode() for found in _OWN_SENTENCE.findall(data))
    cells = {kind: n for kind, n in kinds.items() if any(word in kind for word in _OF_CELLS)}
    if cells:
        names = listed([f"${kind}" for kind in cells], 5)
        count = number_of(sum(cells.values()), "sentence")
        hint = "write them as CSV of time, mcc, mnc, lac, ci, rsrp, and name both files"
        reading.ignore(f"{count}, perhaps of cells, not used: {names} ({hint})")


def _table(kind: bytes, lines: list[bytes], places: Ints, reading: Reading) -> Columns:
    names = ["talker", *_KINDS[kind]]
    names += [f"field{i}" for i in range(len(names), _FIELDS)]
    rows = reading.rows
    least = len(_KINDS[kind]) + 1 - (len(_MODE) if kind == b"RMC" else 0)
    table = line_columns(lines, places, reading, names, ",", ragged=least)
    reading.rows = rows
    return table


def _dates(tables: dict[bytes, Columns]) -> pd.DataFrame:
    """Return the UTC midnight of each sentence with a date, by line, with its time of day."""
    parts = []
    rmc, zda = tables[b"RMC"], tables[b"ZDA"]
    if len(rmc):
        words, index = np.unique(rmc.texts("date").astype(str), return_inverse=True)
        years = np.array([_year(word) for word in words])
        months, days = ([word[i : i + 2] for word in words] for i in (2, 0))
        parts.append(_days(rmc, months, days, years, index))
    if len(zda):
        parts.append(
            _days(
                zda,
                zda.texts("month").tolist(),
                zda.texts("day").tolist(),
                zda.number("year"),
                np.arange(len(zda)),
            )
        )
    rows = (
        pd.concat(parts) if parts else pd.DataFrame({"line": [], "midnight_s": [], "of_day_s": []})
    )
    return rows.dropna().sort_values("line", kind="stable").reset_index(drop=True)


def _year(word: str) -> float:
    if not (len(word) == 6 and word.isascii() and word.isdigit()):
        return float("nan")
    year = int(word[4:])
    return 2000.0 + year if year < 80 else 1900.0 + year


def _days(
    rows: Columns, months: Sequence[str], days: Sequence[str], years: Floats, index: Ints
) -> pd.DataFrame:
    """Return line, midnight and time of day of sentences; ``index`` is the date of each."""
    texts = [
        f"{year:.0f}-{month:0>2}-{day:0>2}" if np.isfinite(year) else ""
        for year, month, day in zip(years, months, days, strict=True)
    ]
    moments = pd.to_datetime(pd.Series(texts), format="%Y-%m-%d", errors="coerce", utc=True)
    midnight = (moments - pd.Timestamp(0, tz="UTC")).dt.total_seconds().to_numpy()
    columns = {
        "line": rows.line,
        "midnight_s": midnight[index],
        "of_day_s": _of_day(rows.texts("time")),
    }
    return pd.DataFrame(columns)


def _of_day(texts: np.ndarray) -> Floats:
    """Return seconds of the day of ``hhmmss.ss``; second 60 is a leap second."""
    number = pd.to_numeric(pd.Series(texts, dtype=object), errors="coerce").to_numpy(np.float64)
    hours, rest = np.divmod(number, 10_000.0)
    minutes, seconds = np.divmod(rest, 100.0)
    good = (hours < 24) & (minutes < 60) & (seconds < 61) & (number >= 0)
    return np.where(good, 3600 * hours + 60 * minutes + seconds, np.nan)


def _utc(rows: Columns, dates: pd.DataFrame) -> Floats:
    """Return UTC seconds by the date of the nearest line that has one."""
    of_day = _of_day(rows.texts("time"))
    if dates.empty:
        # A receiver that has no time yet, or none any more, passes no midnight.
        known = np.flatnonzero(np.isfinite(of_day))
        falls = np.diff(of_day[known], prepend=of_day[known][:1]) < -DAY_S / 2
        of_day[known] += DAY_S * np.cumsum(falls)
        return of_day
    lines = dates["line"].to_numpy()
    at = np.clip(np.searchsorted(lines, rows.line), 1, max(len(lines) - 1, 1))
    before = np.clip(at - 1, 0, len(lines) - 1)
    at = np.clip(at, 0, len(lines) - 1)
    nearer = np.abs(lines[at] - rows.line) < np.abs(lines[before] - rows.line)
    index = np.where(nearer, at, before)
    midnight, dated = dates["midnight_s"].to_numpy()[index], dates["of_day_s"].to_numpy()[index]
    # A sentence just before or after midnight may have its date from the other side.
    turn = np.round((dated - of_day) / DAY_S)
    return np.asarray(midnight + of_day + DAY_S * np.nan_to_num(turn))


def _degrees(rows: Columns, name: str, sign: str, negative: str) -> Floats:
    value = rows.number(name)
    degrees, minutes = np.divmod(value, 100.0)
    result = np.where(minutes < 60, degrees + minutes / 60, np.nan)
    return np.asarray(np.where(rows.texts(sign) == negative, -result, result))


def _gga(rows: Columns, dates: pd.DataFrame, reading: Reading) -> pd.DataFrame:
    quality = rows.texts("quality")
    computed = np.isin(quality, ("6", "7", "8"))
    reading.refuse(
        rows.line[computed],
        "GGA: quality 6, 7 or 8 (dead reckoning, entered or simulated): no measured position",
    )
    columns = {
        "line": rows.line,
        "time_s": _utc(rows, dates),
        "lat_deg": _degrees(rows, "lat", "ns", "S"),
        "lon_deg": _degrees(rows, "lon", "ew", "W"),
        "altitude_m": rows.number("altitude"),
        "accuracy_m": UERE_M * rows.number("hdop"),
        "valid": ~np.isin(quality, ("", "0")) & ~computed,
    }
    return pd.DataFrame(columns)


def _rmc(rows: Columns, dates: pd.DataFrame, reading: Reading) -> pd.DataFrame:
    valid = rows.texts("status") == "A"
    computed = valid & np.isin(rows.texts("mode"), tuple("EMSN"))
    reading.refuse(
        rows.line[computed],
        "RMC: mode E, M, S or N (dead reckoning, entered, simulated or none): no measured position",
    )
    columns = {
        "line": rows.line,
        "time_s": _utc(rows, dates),
        "lat_deg": _degrees(rows, "lat", "ns", "S"),
        "lon_deg": _degrees(rows, "lon", "ew", "W"),
        "speed_mps": KNOT_MPS * rows.number("knots"),
        "course_deg": rows.number("course"),
        "valid": valid & ~computed,
    }
    return pd.DataFrame(columns)


def _accuracy(rows: Columns, dates: pd.DataFrame, first: pd.DataFrame) -> Floats:
    """Return the 68 % radius of GST sentences at the times of positions, NaN without."""
    if not len(rows):
        return np.full(len(first), np.nan)
    radius = RADIUS_68 * np.sqrt((rows.number("lat_sd") ** 2 + rows.number("lon_sd") ** 2) / 2)
    known = pd.Series(radius, index=_utc(rows, dates)).groupby(level=0).first()
    return np.asarray(known.reindex(first["time_s"]), dtype=np.float64)


FORMAT = Format(
    "nmea",
    "NMEA 0183",
    "GNSS receivers, u-center, NMEA loggers",
    "GGA, RMC, GST and ZDA: positions, speed, course, accuracy",
    _matches,
    _read,
)
