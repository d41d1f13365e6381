"""Logs of the Android program Antennas: a serving cell, its neighbours, and a position."""

from __future__ import annotations

import re
from typing import Any

import numpy as np

from mapfilter.tracks.readers.format import Format, ReadOptions
from mapfilter.tracks.readers.identities import add_radio
from mapfilter.tracks.readers.recording import Clock, Reading
from mapfilter.tracks.readers.text import Text
from mapfilter.tracks.readers.times import parse_times

_KEY = re.compile(r'(\w[\w ]*)=\s*("[^"]*"|[^,]*)')
_LEVEL = re.compile(r"(>?)\s*(-?\d{1,3})\s*dBm")
_MILLISECONDS = re.compile(r":(\d{1,3}) GMT")
_PHONES = {"GSM": "GSM", "UMTS": "UMTS", "WCDMA": "UMTS", "LTE": "LTE", "CDMA": "CDMA"}


def _matches(text: Text) -> bool:
    return any(line.startswith("Antennas,") for line in text.head[:10]) or any(
        line.startswith("Record, Time=") for line in text.head[:40]
    )


def _read(text: Text, reading: Reading, options: ReadOptions) -> None:
    reading.program = "Antennas"
    cells: list[dict[str, Any]] = []
    places: list[dict[str, Any]] = []
    record: dict[str, str] = {}
    for number, line in enumerate(text.data.decode("utf-8", "replace").split("\n"), start=1):
        kind = line.split(",", 1)[0].strip()
        values = {key.strip(): value.strip(' "') for key, value in _KEY.findall(line[:4096])}
        if kind == "Record":
            record = values
        elif kind.removeprefix("ACTIVE ") in _PHONES:
            reading.rows += 1
            cells.append(_cell(kind, values, record) | {"line": number})
        elif kind == "Best Location":
            reading.rows += 1
            place = {"lat": _number(values.get("Lat", "")), "lon": _number(values.get("Lon", ""))}
            places.append(place | {"time": _iso(record), "line": number})
    zoned = True
    for rows, table in ((cells, "radio"), (places, "positions")):
        if not rows:
            continue
        times = np.array([row["time"] for row in rows], dtype=object)
        time_s, zoned = parse_times(times, options.zone)
        lines = [row["line"] for row in rows]
        if table == "positions":
            columns = {"lat_deg": [r["lat"] for r in rows], "lon_deg": [r["lon"] for r in rows]}
            reading.add(table, {"time_s": time_s, **columns, "provider": "network"}, lines)
            continue
        names = ("role", "mcc", "mnc", "lac", "ci", "level_dbm", "censored")
        columns = {name: [row[name] for row in rows] for name in names}
        family = np.array([row["technology"] for row in rows], dtype=object)
        add_radio(reading, {**columns, "time_s": time_s, "technology": family}, lines)
    reading.clock = Clock("utc" if zoned else "local")


def _cell(kind: str, values: dict[str, str], record: dict[str, str]) -> dict[str, Any]:
    operator = record.get("Operator", "")
    network = operator if operator.isdigit() and len(operator) in (5, 6) else ""
    level = _LEVEL.search(values.get("Signal", ""))
    return {
        "time": _iso(record),
        "role": "serving" if kind.startswith("ACTIVE") else "neighbour",
        "technology": _PHONES[kind.removeprefix("ACTIVE ")],
        "mcc": _number(network[:3]),
        "mnc": _number(network[3:]),
        "lac": _number(values.get("LAC", "")),
        "ci": _number(values.get("CID", "")),
        "level_dbm": float(level[2]) if level else np.nan,
        # A level written with > is a bound.
        "censored": 1.0 if level and level[1] else 0.0,
    }


def _number(text: str) -> float:
    return float(text) if re.fullmatch(r"-?\d{1,12}(\.\d+)?", text) and text != "-1" else np.nan


def _iso(record: dict[str, str]) -> str:
    """Return a time such as ``2014-09-24 19:21:42:61 GMT+05:30`` as in ISO 8601."""
    return _MILLISECONDS.sub(lambda f: f".{f[1]:0>3}", record.get("Time", "")).replace(" GMT", "")


FORMAT = Format(
    "antennas",
    "an Antennas log",
    "Antennas for Android",
    "serving and neighbour cells with identity, levels (bounds are censored), network positions",
    _matches,
    _read,
)
