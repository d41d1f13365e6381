"""Logs of the Android program Antennas: a serving cell, its neighbours, and a position."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from mapfilter._types import Floats, Ints
from mapfilter.tracks.readers.format import Format, ReadOptions
from mapfilter.tracks.readers.recorded.identities import add_radio
from mapfilter.tracks.readers.recorded.reading import Reading
from mapfilter.tracks.readers.recorded.recording import Clock
from mapfilter.tracks.readers.texts.columns import Columns
from mapfilter.tracks.readers.texts.lines import blocks, line_texts
from mapfilter.tracks.readers.texts.text import Text

_NUMBER = r'\bNAME=\s*"?(?P<value>-?\d{1,12}(?:\.\d+)?)"?\s*(?:,|$)'
_WORD = r'\bNAME=\s*"?(?P<value>[^",]*)'
_LEVEL = r"\bSignal=[^,]*?(?P<value>-?\d{1,3})\s*dBm"
_BOUND = r"\bSignal=[^,]*?>\s*-?\d{1,3}\s*dBm"
_PHONES = {"GSM": "GSM", "UMTS": "UMTS", "WCDMA": "UMTS", "LTE": "LTE", "CDMA": "CDMA"}
_CELLS = {f"{active}{phone}": phone for phone in _PHONES for active in ("", "ACTIVE ")}


def _matches(text: Text) -> bool:
    return any(line.startswith("Antennas,") for line in text.head[:10]) or any(
        line.startswith("Record, Time=") for line in text.head[:40]
    )


@dataclass(frozen=True, eq=False)
class _Records:
    """The records of a part, each with its line, time and network; first the last one before."""

    line: Ints
    time_s: Floats
    mcc: Floats
    mnc: Floats

    def of(self, lines: Ints) -> tuple[Floats, Floats, Floats]:
        """Return time and network of the record that each line belongs to."""
        at = np.searchsorted(self.line, lines) - 1
        return self.time_s[at], self.mcc[at], self.mnc[at]


def _read(text: Text, reading: Reading, options: ReadOptions) -> None:
    reading.program = "Antennas"
    clocks: set[bool] = set()
    nothing = np.full(1, np.nan)
    records = _Records(np.zeros(1, dtype=np.int64), nothing, nothing, nothing)
    for block, first_line in blocks(memoryview(text.data), 1):
        lines = line_texts(np.frombuffer(block, dtype=np.uint8))
        first = pc.list_element(pc.split_pattern(lines, ",", max_splits=1), 0)
        kind = pc.utf8_trim_whitespace(first)
        number = first_line + np.arange(len(lines))
        records = _records(lines, kind, number, records, reading, options, clocks)
        reading.clock = Clock("local" if False in clocks else "utc")
        _add_cells(lines, kind, number, records, reading)
        _add_places(lines, kind, number, records, reading)


def _picked(lines: pa.Array, kind: pa.Array, kinds: Iterable[str]) -> tuple[pa.Array, Ints]:
    """Return the lines of some kinds, and their places."""
    of = np.flatnonzero(pc.is_in(kind, pa.array(list(kinds))).to_numpy(zero_copy_only=False))
    return lines.take(pa.array(of)), of


def _values(lines: pa.Array, pattern: str, name: str = "") -> pa.Array:
    return pc.extract_regex(lines, pattern.replace("NAME", name)).field("value")


def _numbers(lines: pa.Array, pattern: str, name: str = "") -> Floats:
    """Return numbers, NaN where there is none; -1 is none, too."""
    found = pc.extract_regex(lines, pattern.replace("NAME", name))
    texts = pc.if_else(found.is_valid(), found.field("value"), None)
    value = pc.cast(texts, pa.float64()).to_numpy(zero_copy_only=False)
    return np.where(value == -1, np.nan, value)


def _records(
    lines: pa.Array,
    kind: pa.Array,
    number: Ints,
    before: _Records,
    reading: Reading,
    options: ReadOptions,
    clocks: set[bool],
) -> _Records:
    """Return the records of a part, after the last one of that before."""
    some, at = _picked(lines, kind, ["Record"])
    last = slice(-1, None)
    if not at.size:
        return _Records(before.line[last], before.time_s[last], before.mcc[last], before.mnc[last])
    stamp = pc.fill_null(_values(some, _WORD, "Time"), "")
    # Such as 2014-09-24 19:21:42:61 GMT+05:30, with milliseconds in one to three digits.
    for digits, zeros in ((r"\d", "00"), (r"\d\d", "0"), (r"\d\d\d", "")):
        stamp = pc.replace_substring_regex(stamp, f":({digits}) GMT", rf".{zeros}\1")
    rows = Columns(reading, ("time",), number[at])
    rows._columns[0] = pa.chunked_array([pc.replace_substring(stamp, " GMT", "")])
    time_s, zoned = rows.times_of_part("time", zone=options.zone)
    if np.isfinite(time_s).any():
        clocks.add(zoned)
    operator = _values(some, _WORD, "Operator").dictionary_encode()
    words = [word.strip() if word else "" for word in operator.dictionary.to_pylist()]
    networks = [word if re.fullmatch(r"[0-9]{5,6}", word) else "" for word in words]
    codes = np.array(
        [(float(w[:3]), float(w[3:])) if w else (np.nan, np.nan) for w in [*networks, ""]]
    )
    index = pc.fill_null(operator.indices, len(words)).to_numpy(zero_copy_only=False)
    mcc, mnc = codes[index].T
    return _Records(
        np.concatenate([before.line[last], number[at]]),
        np.concatenate([before.time_s[last], time_s]),
        np.concatenate([before.mcc[last], mcc]),
        np.concatenate([before.mnc[last], mnc]),
    )


def _add_cells(
    lines: pa.Array, kind: pa.Array, number: Ints, records: _Records, reading: Reading
) -> None:
    some, at = _picked(lines, kind, _CELLS)
    if not at.size:
        return
    reading.rows += len(at)
    own = np.asarray(kind.take(pa.array(at)).to_pylist(), dtype=object)
    time_s, mcc, mnc = records.of(number[at])
    serving = np.asarray(pc.starts_with(some, "ACTIVE").to_numpy(zero_copy_only=False), dtype=bool)
    columns = {
        "time_s": time_s,
        "role": np.array(["neighbour", "serving"], dtype=object)[serving.astype(np.int64)],
        "technology": np.array([_PHONES[_CELLS[one]] for one in own], dtype=object),
        "mcc": mcc,
        "mnc": mnc,
        "lac": _numbers(some, _NUMBER, "LAC"),
        "ci": _numbers(some, _NUMBER, "CID"),
        "level_dbm": _numbers(some, _LEVEL),
        # A level written with > is a bound.
        "censored": pc.match_substring_regex(some, _BOUND).to_numpy(zero_copy_only=False) * 1.0,
    }
    add_radio(reading, columns, number[at])


def _add_places(
    lines: pa.Array, kind: pa.Array, number: Ints, records: _Records, reading: Reading
) -> None:
    some, at = _picked(lines, kind, ["Best Location"])
    if not at.size:
        return
    reading.rows += len(at)
    columns = {
        "time_s": records.of(number[at])[0],
        "lat_deg": _numbers(some, _NUMBER, "Lat"),
        "lon_deg": _numbers(some, _NUMBER, "Lon"),
        "provider": "network",
    }
    reading.add("positions", columns, number[at])


FORMAT = Format(
    "antennas",
    "an Antennas log",
    "Antennas for Android",
    "serving and neighbour cells with identity, levels (bounds are censored), network positions",
    _matches,
    _read,
)
