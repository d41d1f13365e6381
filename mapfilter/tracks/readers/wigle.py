"""CSV of WiGLE: networks that a phone received, each with time, level and position."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import replace

import numpy as np

from mapfilter._types import Bools, Floats
from mapfilter._words import number_of
from mapfilter.radio.identities import technology
from mapfilter.tracks.readers.format import Format, ReadOptions
from mapfilter.tracks.readers.recorded.identities import add_radio, parse_identities
from mapfilter.tracks.readers.recorded.reading import Reading
from mapfilter.tracks.readers.recorded.recording import Clock
from mapfilter.tracks.readers.texts.columns import Columns
from mapfilter.tracks.readers.texts.kept_rows import changed_rows, only
from mapfilter.tracks.readers.texts.separated_values import (
    header_columns,
    header_names,
    likely_separator,
)
from mapfilter.tracks.readers.texts.text import Text

_TITLE = "wiglewifi-"
_COLUMNS = {"mac", "firstseen", "rssi", "currentlatitude", "currentlongitude", "type"}
_RELEASE = re.compile(r"\bappRelease=([^,]{0,20})")
_CELL = re.compile(r"\d{5,6}_\d{1,10}_\d{1,11}", re.ASCII)
"""MCC and MNC, LAC or TAC, and the cell."""
_MOST_TYPES = 8
_CELLS = ("GSM", "UMTS", "LTE", "NR")


def _matches(text: Text) -> bool:
    line = text.first_line
    names = header_names(line, likely_separator(line))
    return line.lower().startswith(_TITLE) or set(names) >= _COLUMNS


def _read(text: Text, reading: Reading, options: ReadOptions) -> None:
    reading.program = "WiGLE"
    if text.first_line.lower().startswith(_TITLE):
        release = _RELEASE.search(text.first_line)
        reading.program += f" {release[1].strip()}" if release else ""
        # The names of the columns are below a line about the phone.
        text = _below(text, text.data.find(text.first_line.encode()))
    rows = header_columns(text.data, reading, text.line)
    time_s, zoned = rows.times_of_part("firstseen", zone=options.zone)
    reading.clock = Clock("utc") if zoned else Clock("local", options.zone)
    position = {
        "time_s": time_s,
        "lat_deg": rows.number("currentlatitude"),
        "lon_deg": rows.number("currentlongitude"),
        "altitude_m": rows.number("altitudemeters"),
        "accuracy_m": rows.number("accuracymeters"),
    }
    # Each position is repeated for every network that was received there.
    new = changed_rows(position, ("time_s", "lat_deg", "lon_deg"))
    reading.add("positions", *only(position, rows.line, new))
    _add_networks(rows, reading, time_s)


def _below(text: Text, at: int) -> Text:
    """Return a text below the line at a place."""
    end = text.data.find(b"\n", max(at, 0))
    end = len(text.data) if end < 0 else end + 1
    return replace(text, data=text.data[end:], line=text.line + text.data[:end].count(b"\n"))


def _add_networks(rows: Columns, reading: Reading, time_s: Floats) -> None:
    """Add cells and access points; other devices, of which most move, are left out."""
    families, keys = rows.mapped(technology, "type"), rows.texts("mac")
    cell, point = np.isin(families, _CELLS), np.asarray(families == "WIFI", dtype=bool)
    _note_others(rows, reading, ~(cell | point))
    level = rows.number("rssi")
    reading.tallies.columns["level_dbm"] = "rssi"
    columns = {
        "time_s": time_s,
        "technology": families,
        # 0 where it was not measured.
        "level_dbm": np.where(level == 0, np.nan, level),
    }
    named = rows.mapped(lambda word: word if _CELL.fullmatch(word) else "", "mac")
    identity = parse_identities(np.where(cell, named, ""))
    known = np.isfinite(identity["ci"])
    reading.refuse(rows.line[cell & ~known], "radio: the MAC of a cell is no MCCMNC_LAC_CI")
    # Which cell served is not recorded; as in other lists, one with an identity may have.
    for role, of, more in (("serving", known, identity), ("neighbour", point, {"cell": keys})):
        if of.any():
            kept, line = only({**columns, **more}, rows.line, of)
            add_radio(reading, {**kept, "role": role}, line)


def _note_others(rows: Columns, reading: Reading, others: Bools) -> None:
    """Note rows of other networks than cells and access points, by type."""
    counts = Counter(rows.texts("type")[others])
    for name in sorted(counts)[:_MOST_TYPES]:
        some = number_of(counts.pop(name), "row")
        reading.ignore(f"{some} of type {name[:20] or '(none)'} left out")
    if counts:
        reading.ignore(f"{number_of(counts.total(), 'row')} of other types left out")


FORMAT = Format(
    "wigle",
    "a WiGLE export",
    "WiGLE (CSV of the app and of other programs that write it)",
    "cells with identity and level, Wi-Fi, positions",
    _matches,
    _read,
)
