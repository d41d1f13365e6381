"""Lines of gliders' loggers (IGC) and of VBOX (VBO), whose layouts stand in no header of a table.

References
----------
FAI, "Technical specification for GNSS flight recorders", appendix A (records H and B).
Racelogic, "VBO file format": latitudes and longitudes in minutes, longitudes positive to the west.
"""

from __future__ import annotations

import re
from bisect import bisect_left
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime, timedelta

from mapfilter._words import number_of
from mapfilter.tracks.readers.contained.tables import as_table
from mapfilter.tracks.readers.texts.text import Text

_IGC_DATE = re.compile(r"^HFDTE(?:DATE:\s?)?(\d\d)(\d\d)(\d\d)", re.MULTILINE | re.ASCII)
_IGC_FIX = re.compile(
    r"^B(\d{6})(\d\d)(\d{5})([NS])(\d{3})(\d{5})([EW])([AV])([-\d]\d{4})([-\d]\d{4})",
    re.MULTILINE | re.ASCII,
)
_IGC_BEGINS = re.compile(rb"A[A-Z0-9]{3,}")
_VBO_NAMES, _VBO_DATA = "[column names]", "[data]"
_VBO_DATE = re.compile(r"File created on (\d\d)/(\d\d)/(\d{4})", re.ASCII)
_VBO_TIME = re.compile(r"\d{6}(?:\.\d{1,6})?", re.ASCII)
_VBO_MEANT = {"time": "time", "lat": "lat", "long": "lon", "velocity": "speed [km/h]"}
_VBO_MORE = {"heading": "course [deg]", "height": "altitude [m]"}
_HEAD_BYTES = 1 << 16
_LATEST_YEAR = 80
"""Of two digits: from it on they are of the last century, as IGC began in 1995."""


def is_igc(text: Text) -> bool:
    """Return whether a text is a flight of IGC that has fixes."""
    head = text.data[:_HEAD_BYTES]
    return _IGC_BEGINS.match(head) is not None and b"\nHFDTE" in head and b"\nB" in head


def igc_table(text: Text) -> Text | None:
    """Return the fixes of IGC as a text of CSV; None where there is none."""
    content = text.data.decode("utf-8", "replace")
    dates = [one.groups() for one in _IGC_DATE.finditer(content)]
    starts = [one.start() for one in _IGC_DATE.finditer(content)]
    rows, by_pressure, without = list[list[str]](), list[str](), 0
    clock = _Clock()
    for fix in _IGC_FIX.finditer(content):
        time, lat, lat_m, ns, lon, lon_m, ew, valid, pressure_m, gnss_m = fix.groups()
        before = bisect_left(starts, fix.start())
        if not before:
            continue
        day, month, year = map(int, dates[before - 1])
        century = 1900 if year >= _LATEST_YEAR else 2000
        stamp = clock.stamp((century + year, month, day), time)
        if valid != "A":
            without += 1
        elif stamp:
            at_lat = (int(lat) + int(lat_m) / 60_000) * (-1 if ns == "S" else 1)
            at_lon = (int(lon) + int(lon_m) / 60_000) * (-1 if ew == "W" else 1)
            rows.append([stamp, f"{at_lat:.9f}", f"{at_lon:.9f}", str(int(gnss_m))])
            by_pressure.append(str(int(pressure_m)))
    if not rows:
        return None
    if all(row[-1] == "0" for row in rows):
        # A recorder without heights of GNSS.
        rows = [[*row[:-1], height] for row, height in zip(rows, by_pressure, strict=True)]
    notes = (f"{number_of(without, 'fix', 'fixes')} without a height (V) left out",)
    return as_table(_noted(text, notes if without else ()), _IGC_HEADER, rows, "IGC")


_IGC_HEADER = ("time", "lat", "lon", "altitude [m]")


def is_vbo(text: Text) -> bool:
    """Return whether a text has the sections of a VBO."""
    head = text.data[:_HEAD_BYTES].decode("utf-8", "replace").lower()
    return _VBO_NAMES in head and _VBO_DATA in head


def vbo_table(text: Text) -> Text | None:
    """Return the rows of a VBO as a text of CSV; None without positions, or a date of them."""
    content = text.data.decode("utf-8", "replace")
    created = _VBO_DATE.search(content[:_HEAD_BYTES])
    names = _section(content, _VBO_NAMES)[:1]
    if created is None or not names or not {"time", "lat", "long"} <= set(names[0].lower().split()):
        return None
    day, month, year = map(int, created.groups())
    columns = names[0].split()
    meant = {**_VBO_MEANT, **_VBO_MORE}
    header = [meant.get(name.lower(), name) for name in columns]
    rows = _vbo_rows(columns, _section(content, _VBO_DATA), (year, month, day))
    note = f"time: UTC, from the day of its creation on, {year}-{month:02d}-{day:02d}"
    return as_table(_noted(text, (note,)), header, rows, "VBO")


def _vbo_rows(
    names: Sequence[str], lines: Sequence[str], date: tuple[int, int, int]
) -> Iterator[list[str]]:
    places = {name.lower(): at for at, name in enumerate(names)}
    clock = _Clock()
    for line in lines:
        values = line.split()
        if len(values) != len(names):
            continue
        time = values[places["time"]]
        values[places["time"]] = clock.stamp(date, time) if _VBO_TIME.fullmatch(time) else ""
        for name, sign in (("lat", 1), ("long", -1)):
            values[places[name]] = _degrees(values[places[name]], sign)
        yield values


def _degrees(minutes: str, sign: int) -> str:
    try:
        return f"{sign * float(minutes) / 60:.9f}"
    except ValueError:
        return ""


def _section(content: str, title: str) -> list[str]:
    """Return the lines of a section that are not blank."""
    # Lower case may have more letters, so that places in it are others.
    found = re.search(re.escape(title), content, re.IGNORECASE | re.ASCII)
    if found is None:
        return []
    body = content[found.end() :]
    end = body.find("\n[")
    return [line for line in body[: end if end >= 0 else None].splitlines() if line.strip()]


def _noted(text: Text, notes: tuple[str, ...]) -> Text:
    return Text(text.path, text.data, (*text.notes, *notes))


class _Clock:
    """Times of day of rows, which go on with the next day after midnight."""

    def __init__(self) -> None:
        self._day, self._date = timedelta(), (0, 0, 0)
        self._last = timedelta()

    def stamp(self, date: tuple[int, int, int], time: str) -> str:
        """Return the moment of digits such as 101530.25 in ISO 8601; "" for none."""
        hours, minutes, seconds = int(time[:2]), int(time[2:4]), float(time[4:])
        of_day = timedelta(hours=hours, minutes=minutes, seconds=seconds)
        try:
            start = datetime(*date, tzinfo=UTC)
        except ValueError:
            return ""
        if date != self._date:
            self._date, self._day = date, timedelta()
        elif self._last - of_day > timedelta(hours=12):
            self._day += timedelta(days=1)
        self._last = of_day
        try:
            return (start + self._day + of_day).isoformat()
        except OverflowError:
            return ""
