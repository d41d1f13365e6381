"""CSV of Tower Collector, and of OpenCellID and Mozilla's location service."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from mapfilter._types import Floats
from mapfilter._words import number_of
from mapfilter.radio.asu import UNKNOWN_ASU
from mapfilter.radio.identities import technology
from mapfilter.tracks.readers.format import Format, ReadOptions
from mapfilter.tracks.readers.plain_csv import has_content
from mapfilter.tracks.readers.recorded.identities import add_radio, available
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

_UNAVAILABLE = 1e9
_ASU = {"GSM": (-113.0, 2.0, 31.0), "UMTS": (-120.0, 1.0, 96.0), "LTE": (-140.0, 1.0, 97.0)}
"""Level of ASU 0, step and largest ASU: 3GPP TS 27.007, +CSQ and +CESQ."""


@dataclass(frozen=True)
class _Dialect:
    """Names of the columns that hold each field, the first that is there."""

    program: str
    columns: Mapping[str, tuple[str, ...]]

    def of(self, name: str) -> tuple[str, ...]:
        return self.columns.get(name, (name,))


_UPLOAD = _Dialect(
    "OpenCellID upload",
    {
        "mnc": ("mnc", "net"),
        "lac": ("lac", "area"),
        "ci": ("cellid", "cell", "cell_id"),
        "level": ("signal", "dbm"),
        "accuracy": ("rating", "accuracy"),
        "bearing": ("direction", "heading", "bearing"),
        "technology": ("act", "radio", "net_type"),
    },
)
_TOWERS = _Dialect(
    "Tower Collector",
    {
        "ci": ("cell_id",),
        "level": ("dbm",),
        "bearing": ("bearing",),
        "technology": ("net_type",),
    },
)


def _names(text: Text) -> set[str]:
    line = text.first_line
    return set(header_names(line, likely_separator(line)))


def _is_tower_collector(text: Text) -> bool:
    return _names(text) >= {"mcc", "mnc", "lac", "cell_id", "lat", "lon", "measured_at", "dbm"}


def _is_upload(text: Text) -> bool:
    names = _names(text)
    identity = {"mcc", "mnc", "lac", "cellid"} <= names or {"mcc", "net", "area", "cell"} <= names
    return identity and {"lat", "lon", "measured_at"} <= names


def _read_tower_collector(text: Text, reading: Reading, options: ReadOptions) -> None:
    _read_measurements(text, reading, options, _TOWERS)


def _read_upload(text: Text, reading: Reading, options: ReadOptions) -> None:
    _read_measurements(text, reading, options, _UPLOAD)


def _read_measurements(
    text: Text, reading: Reading, options: ReadOptions, dialect: _Dialect
) -> None:
    reading.program = dialect.program
    rows = header_columns(text.data, reading, text.line)
    time_s, zoned = rows.times_of_part("measured_at", zone=options.zone)
    reading.clock = Clock("utc") if zoned else Clock("local", options.zone)
    position = {
        "time_s": time_s,
        "lat_deg": rows.number("lat"),
        "lon_deg": rows.number("lon"),
        "altitude_m": rows.number("altitude"),
        "accuracy_m": rows.number(*dialect.of("accuracy")),
        "speed_mps": rows.number("speed"),
        "course_deg": rows.number(*dialect.of("bearing")),
    }
    # Each position is repeated for every cell of a report.
    new = changed_rows(position, ("time_s", "lat_deg", "lon_deg"))
    reading.add("positions", *only(position, rows.line, new))
    _add_cells(rows, reading, time_s, dialect)


def _add_cells(rows: Columns, reading: Reading, time_s: Floats, dialect: _Dialect) -> None:
    families = rows.mapped(technology, *dialect.of("technology"))
    lac = available(*rows.whole(*dialect.of("lac")))
    if rows.has("tac") and rows.has("lac"):
        lac = np.where(np.isnan(lac), available(*rows.whole("tac")), lac)
    codes = [available(*rows.whole(name)) for name in ("pci", "psc", "bsic") if rows.has(name)]
    bsic = np.full(len(rows), np.nan)
    for code in codes:
        bsic = np.where(np.isnan(bsic), code, bsic)
    neighbour = rows.flags("neighboring", true=("true", "True", "TRUE", "1"))
    columns = {
        "time_s": time_s,
        "role": np.array(["serving", "neighbour"], dtype=object)[neighbour.astype(np.int64)],
        "technology": families,
        "mcc": available(*rows.whole("mcc")),
        "mnc": available(*rows.whole(*dialect.of("mnc"))),
        "lac": lac,
        "ci": available(*rows.whole(*dialect.of("ci"))),
        "arfcn": available(*rows.whole("arfcn", "channel")),
        "bsic": bsic,
        "level_dbm": _levels(rows, reading, families, dialect),
        "timing_advance": available(*rows.whole("ta")),
    }
    add_radio(reading, columns, rows.line)


def _levels(rows: Columns, reading: Reading, families: np.ndarray, dialect: _Dialect) -> Floats:
    """Return levels in dBm; those given as ASU are turned, NaN where neither is known."""
    level = rows.number(*dialect.of("level"))
    given, column = level.copy(), rows.find(*dialect.of("level"))
    if column is not None:
        reading.tallies.columns["level_dbm"] = column
    elif not rows.has("asu"):
        reading.note(f"no column {' or '.join(dialect.of('level'))}: cells without levels")
    asu = np.where(level >= 0, level, rows.number("asu"))
    level = np.where(level < 0, level, np.nan)
    turned = 0
    for family, (lowest, step, most) in _ASU.items():
        of = np.isnan(level) & (families == family) & (asu >= 0) & (asu <= most)
        level = np.where(of, lowest + step * asu, level)
        turned += int(of.sum())
    reading.tallies.signs.add(given[(given < _UNAVAILABLE) & (families != "NR")])
    left = np.isnan(level) & (given > 0) & (given < _UNAVAILABLE) & ~np.isin(given, UNKNOWN_ASU)
    if left.any():
        first = rows.line[left][0]
        reading.count(
            lambda n: (
                f"radio, level_dbm: {number_of(n, 'level')} as ASU of an unknown "
                f"technology, or beyond its scale, ignored (first in line {first})"
            ),
            int(left.sum()),
            key="ASU of an unknown technology",
            ignored=True,
        )
    if turned:
        asu_dbm = "given as ASU, turned into dBm"
        reading.count(lambda n: f"radio, level_dbm: {number_of(n, 'level')} {asu_dbm}", turned)
    return level


def _is_cell_list(text: Text) -> bool:
    names = _names(text)
    new = {"radio", "mcc", "net", "area", "cell", "lat", "lon"} <= names
    old = {"mcc", "mnc", "lac", "cellid", "lat", "lon"} <= names
    counted = bool({"samples", "nbsamples", "averagesignal", "range"} & names)
    # With times it is a journey.
    return (new or old) and counted and not has_content([*names])


def _read_cell_list(text: Text, reading: Reading, options: ReadOptions) -> None:  # noqa: ARG001
    reading.program = "OpenCellID or MLS cell list"
    rows = header_columns(text.data, reading, text.line)
    columns = {
        "technology": rows.mapped(technology, "radio"),
        "mcc": available(*rows.whole("mcc")),
        "mnc": available(*rows.whole("net", "mnc")),
        "lac": available(*rows.whole("area", "lac")),
        "ci": available(*rows.whole("cell", "cellid")),
        "lat_deg": rows.number("lat"),
        "lon_deg": rows.number("lon"),
        "range_m": rows.number("range"),
        "samples": rows.number("samples", "nbsamples"),
    }
    reading.add("cells", columns, rows.line)


TOWER_COLLECTOR = Format(
    "towercollector",
    "a Tower Collector export",
    "Tower Collector (CSV export)",
    "serving and neighbour cells with identity, levels, timing advance, positions",
    _is_tower_collector,
    _read_tower_collector,
    by_rows=True,
)
UPLOAD = Format(
    "opencellid",
    "an OpenCellID or MLS measurement file",
    "OpenCellID, Mozilla location service (CSV of measurements, both header dialects)",
    "cells with identity, PCI or PSC, levels, timing advance, positions, speed and course",
    _is_upload,
    _read_upload,
    by_rows=True,
)
CELL_LIST = Format(
    "opencellid-cells",
    "an OpenCellID or MLS cell list",
    "OpenCellID, Mozilla location service (CSV of cells, both header dialects)",
    "cells; no journey: it is named, and left to ``[cells] plan``",
    _is_cell_list,
    _read_cell_list,
    by_rows=True,
)
