"""Nemo logs (``.nmf``, Nemo file format 2): positions, serving and neighbour cells, Wi-Fi.

Each line is an event, ``ID,HH:MM:SS.mmm,n,…``, with n ids of its context before its parameters;
events with ``#`` describe the measurement, of which ``#START`` has the date (``"26.8.2018"``) and
``#UT`` how many minutes its clock is ahead of UTC (420 in Bangkok). What is read, by place of the
parameter:

* ``GPS``: longitude, latitude, height (m), distance, fix, satellites, speed (km/h). A position
  without a fix and without satellites is left out.
* ``CELLMEAS``: system, number of header parameters and these, number of cells, number of
  parameters of a cell, and as many parameters for each cell. In UMTS channels come before the
  cells, by their number likewise. Parameters of a cell begin with its kind, band, carrier and
  code (BSIC, PSC, PCI). Then follow in GSM: RxLev full and sub, C1, C2, C31, C32, two of
  priorities, CI, LAC; in UMTS: Ec/N0, STTD, RSCP; in LTE: RSSI, RSRP, RSRQ. An access point has
  kind, band, quality, channel, RSSI, SSID and MAC.
* ``CHI``: the serving cell's identity; in LTE system, band, state, bandwidth, carrier, PCI, cell
  identity, TAC; in UMTS system, band, state, carrier, cell identity, LAC.
* ``SEI``: system, status, LAC, MCC, MNC.

Its maker calls the format open (Anite Finland, *Nemo File Format*, version 2.03); the lists of
parameters of that description were not at hand. Places are those that open parsers of the format
use, checked on published logs of Nemo Outdoor 7.8 and 8.0 (versions 2.27 and 2.31) for LTE (FDD),
UMTS, Wi-Fi and GPS; those of GSM only follow the parsers, and LTE (TDD) is taken to be as FDD.
Distances covered and speeds in these logs agree in km/h. BSIC are taken to be decimal (0 to 63).
Not read: scanners (``OFDMSCAN``, ``PILOTSCAN``, ``FREQSCAN``), NR, CDMA, timing advances (``TAD``;
its unit in LTE is not known), signalling, and version 1 (``.dt1``).
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from datetime import UTC, datetime

import numpy as np

from mapfilter._constants import KMH_MPS
from mapfilter._types import Ints
from mapfilter._words import number_of
from mapfilter.clocks.local_times import utc_from_local_s
from mapfilter.tracks.readers.clocks.local_parts import note_changes
from mapfilter.tracks.readers.format import Format, ReadOptions
from mapfilter.tracks.readers.nemo_identities import (
    Identities,
    context_size,
    followed,
    identity_at,
    nothing_known,
    of_systems,
)
from mapfilter.tracks.readers.plain_csv import has_content
from mapfilter.tracks.readers.recorded.identities import add_radio, available
from mapfilter.tracks.readers.recorded.reading import Reading
from mapfilter.tracks.readers.recorded.recording import Clock
from mapfilter.tracks.readers.texts.events import Events, read_events
from mapfilter.tracks.readers.texts.kept_rows import only
from mapfilter.tracks.readers.texts.separated_values import header_names, likely_separator
from mapfilter.tracks.readers.texts.text import Text

_BEGIN = re.compile(r"#(?:PRODUCT|FF|ID|START)[,;\t]")
_EVENT = re.compile(r"(?:GPS|CELLMEAS|CHI|SEI|RRCSM|L3SM)([,;\t])\d{1,2}:\d\d:\d\d[.,]\d{1,3}\1")
_START = re.compile(r'#START([,;\t])[^;\t\n]*?\1\d*\1"?(\d{1,2})\.(\d{1,2})\.(\d{4})', re.ASCII)
_AHEAD_MIN = re.compile(r'#UT([,;\t])[^;\t\n]*?\1\d*\1"?([-+]?\d{1,3})(?!\d)', re.ASCII)
_PRODUCT = re.compile(r'#PRODUCT[,;\t]+"?([^",;\t]*)"?[,;\t]"?([\d.]*)')
_KINDS = ("GPS", "CELLMEAS", "CHI", "SEI")
_SCANNERS = ("OFDMSCAN", "PILOTSCAN", "FREQSCAN")
_MOST_AHEAD_MIN = 14 * 60
_MOST = {"headers": 64, "channels": 64, "channel_size": 32, "cells": 500, "size": 64}
_NO_MAC = "00:00:00:00:00:00"


@dataclass(frozen=True)
class _System:
    """Where the parameters of a cell stand, by radio system."""

    family: str
    serving: int
    places: dict[str, int]


_CELL = {"kind": 0, "arfcn": 2, "bsic": 3}
_LTE = _System("LTE", 0, {**_CELL, "level": 5})
_SYSTEMS = {
    1: _System("GSM", 1, {**_CELL, "full": 4, "sub": 5, "ci": 12, "lac": 13}),
    5: _System("UMTS", 0, {**_CELL, "level": 6}),
    7: _LTE,
    8: _LTE,
    20: _System("WIFI", -1, {"kind": 0, "level": 4, "cell": 6}),
}


def _matches(text: Text) -> bool:
    if has_content(header_names(text.first_line, likely_separator(text.first_line))):
        # A table may have a column of such a name.
        return False
    lines = [line.lstrip() for line in text.head[:200]]
    return any(_BEGIN.match(line) or _EVENT.match(line) for line in lines)


def _separator(text: Text) -> str:
    found = (_BEGIN.match(line.lstrip()) or _EVENT.match(line.lstrip()) for line in text.head)
    return next((one[0][-1] for one in found if one), ",")


def _read(text: Text, reading: Reading, options: ReadOptions) -> None:
    head = "\n".join(text.head)
    product = _PRODUCT.search(head)
    reading.program = " ".join(filter(None, product.groups())).title() if product else "Nemo"
    midnight_s = _midnight_s(head)
    ahead_s = _ahead_s(head)
    zone = options.zone if ahead_s is None else ""
    reading.clock = Clock("monotonic", from_midnight=True)
    if midnight_s is None:
        reading.note("no date in #START: times count from an unknown day")
    elif ahead_s is None:
        reading.clock = Clock("local", zone)
    else:
        reading.clock = Clock("utc")
        reading.note(f"local times are those of UTC{ahead_s / 3600:+g}, by #UT")
        midnight_s -= ahead_s
    systems = {
        family: [number for number, one in _SYSTEMS.items() if one.family == family]
        for family in ("GSM", "UMTS", "LTE")
    }
    known = {family: nothing_known() for family in systems}
    others: dict[str, int] = {}
    for events in read_events(text.data, _separator(text), _KINDS, reading, others):
        if midnight_s is not None:
            events.time_s[:] += midnight_s
            if zone:
                utc_s = utc_from_local_s(events.time_s, zone, reading.passed_s)
                note_changes(reading, events.time_s, utc_s, zone, reading.passed_s)
                reading.passed_s = max([reading.passed_s, *utc_s[np.isfinite(utc_s)][-1:]])
                events.time_s[:] = utc_s
        _add_positions(events, reading)
        known = {
            family: followed(events, family, numbers, known[family])
            for family, numbers in systems.items()
        }
        others["CELLMEAS"] = others.get("CELLMEAS", 0) + _add_cells(events, reading, known)
    if count := others.pop("CELLMEAS", 0):
        what = "CELLMEAS of other systems (NR, CDMA, …)"
        reading.note(f"{number_of(count, f'{what} is', f'{what} are')} not read")
    if count := sum(others.pop(name, 0) for name in _SCANNERS):
        reading.note(f"{number_of(count, 'row of scanners is', 'rows of scanners are')} not read")
    others = {name: count for name, count in others.items() if not name.startswith("#")}
    if others:
        count, kinds = sum(others.values()), number_of(len(others), "other kind")
        some = number_of(count, f"event of {kinds} is", f"events of {kinds} are")
        reading.note(f"{some} not used")


def _midnight_s(head: str) -> float | None:
    """Return the midnight before the start, in seconds as if the zone were UTC."""
    if (found := _START.search(head)) is None:
        return None
    day, month, year = map(int, found.groups()[1:])
    try:
        return datetime(year, month, day, tzinfo=UTC).timestamp()
    except ValueError:
        return None


def _ahead_s(head: str) -> float | None:
    """Return how far the clock is ahead of UTC, in seconds; None where it is not written."""
    if (found := _AHEAD_MIN.search(head)) is None:
        return None
    minutes = int(found[2])
    return 60.0 * minutes if abs(minutes) <= _MOST_AHEAD_MIN else None


def _add_positions(events: Events, reading: Reading) -> None:
    at = np.flatnonzero(events.kind == "GPS")
    if not at.size:
        return
    shift = context_size(events, at)
    places = {"lon": 3, "lat": 4, "height": 5, "fix": 7, "satellites": 8, "speed": 9}
    rows = events.columns(at, **{name: shift + place for name, place in places.items()})
    fix, told = rows.whole("fix")
    nowhere = told & (fix == 0) & (rows.whole("satellites")[0] <= 0)
    reading.refuse(rows.line[nowhere], "positions: no fix and no satellites")
    columns = {
        "time_s": events.time_s[at],
        "lat_deg": rows.number("lat"),
        "lon_deg": rows.number("lon"),
        "altitude_m": rows.number("height"),
        "speed_mps": KMH_MPS * rows.number("speed"),
    }
    reading.add("positions", *only(columns, rows.line, ~nowhere))


def _add_cells(events: Events, reading: Reading, known: dict[str, Identities]) -> int:
    """Add the cells of all systems that are read; return the number of events of others."""
    at, system = of_systems(events, "CELLMEAS")
    for number, layout in _SYSTEMS.items():
        of = at[system == number]
        if of.size:
            _add_system(events, of, layout, reading, known.get(layout.family))
    return int((~np.isin(system, list(_SYSTEMS))).sum())


def _add_system(
    events: Events,
    at: Ints,
    layout: _System,
    reading: Reading,
    known: Identities | None,
) -> None:
    event, place, size = _cells(events, at, layout, reading)
    if not event.size:
        return
    places = {
        name: np.where(offset < size, place + offset, -1) for name, offset in layout.places.items()
    }
    rows = events.columns(event, **places)
    kind, named = rows.whole("kind")
    first = np.ones(len(event), dtype=bool)
    first[1:] = event[1:] != event[:-1]
    serving = named & (kind == layout.serving)
    if layout.family == "UMTS":
        # The first of the active set, which is its best.
        serving &= first
    level = rows.number("level")
    if layout.family == "GSM":
        level = rows.number("sub")
        level = np.where(np.isnan(level), rows.number("full"), level)
    columns = {"time_s": events.time_s[event], "level_dbm": level}
    good = ~np.isnan(level)
    if layout.family == "WIFI":
        columns["cell"] = rows.texts("cell")
        good &= (columns["cell"] != "") & (columns["cell"] != _NO_MAC)
    else:
        columns |= {name: available(*rows.whole(name)) for name in ("arfcn", "bsic")}
        if known is not None:
            active = np.bincount(np.searchsorted(at, event), kind == 0, len(at))
            alone = active[np.searchsorted(at, event)] == 1
            if layout.family == "GSM":
                identity = {name: available(*rows.whole(name)) for name in ("ci", "lac")}
                mcc, mnc = known.network.at(rows.line).T
                identity |= {"mcc": mcc, "mnc": mnc}
            else:
                identity = identity_at(
                    rows.line, columns["arfcn"], columns["bsic"], layout.family, known, alone
                )
            columns |= {name: np.where(serving, one, np.nan) for name, one in identity.items()}
    kept = {name: values[good] for name, values in columns.items()}
    kept["role"] = np.array(["neighbour", "serving"], dtype=object)[serving[good].astype(np.int64)]
    kept["technology"] = np.full(int(good.sum()), layout.family, dtype=object)
    add_radio(reading, kept, rows.line[good])


def _cells(events: Events, at: Ints, layout: _System, reading: Reading) -> tuple[Ints, Ints, Ints]:
    """Return of each cell of CELLMEAS its event, where its parameters begin, and their number."""
    begin = context_size(events, at) + 5
    good = np.ones(len(at), dtype=bool)

    def counted(where: Ints, name: str) -> Ints:
        nonlocal good
        number, there = events.columns(at, count=where).whole("count")
        good &= there & (number >= 0) & (number <= _MOST[name])
        return np.where(good, number, 0)

    begin = begin + counted(begin - 1, "headers")
    if layout.family == "UMTS":
        begin = begin + 2 + counted(begin, "channels") * counted(begin + 1, "channel_size")
    count, size = counted(begin, "cells"), counted(begin + 1, "size")
    whole = begin + 2 + count * size <= events.fields[at]
    reading.refuse(events.line[at[~good]], "CELLMEAS: numbers of cells and parameters are missing")
    hint = "fewer fields than its counts (likely: cut off)"
    reading.refuse(events.line[at[good & ~whole]], f"CELLMEAS: {hint}")
    count = np.where(good & whole, count, 0)
    row = np.repeat(np.arange(len(at)), count)
    nth = np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count)
    return at[row], begin[row] + 2 + nth * size[row], size[row]


FORMAT = Format(
    "nemo",
    "a Nemo log",
    "Nemo Outdoor, Nemo Handy (.nmf)",
    "serving and neighbour cells by carrier and code with levels, identity of the serving cell, "
    "Wi-Fi, positions",
    _matches,
    _read,
)
