"""Logs of G-NetTrack: text with tabs, and CSV of several versions."""

from __future__ import annotations

import re

import numpy as np
import pandas as pd

from mapfilter._constants import KMH_MPS
from mapfilter._types import Bools, Floats, Ints
from mapfilter._words import number_of
from mapfilter.radio.identities import technology
from mapfilter.tracks.readers.format import Format, ReadOptions
from mapfilter.tracks.readers.recorded.identities import add_radio, available
from mapfilter.tracks.readers.recorded.reading import Reading
from mapfilter.tracks.readers.recorded.recording import Clock
from mapfilter.tracks.readers.recorded.stale import repeated_readings
from mapfilter.tracks.readers.texts.columns import Columns
from mapfilter.tracks.readers.texts.separated_values import (
    header_columns,
    header_names,
    likely_separator,
)
from mapfilter.tracks.readers.texts.text import Text

_NEEDED = {"timestamp", "longitude", "latitude", "networkmode"}
_IDENTITIES = ({"rawcellid"}, {"node", "cellid"})
_LTE_CELLS = 256
_LEAST_FIELDS = 20
_MOST_NEIGHBOURS = 18
_LAYOUT = "%Y.%m.%d_%H.%M.%S"


def _matches(text: Text) -> bool:
    line = text.first_line
    names = set(header_names(line, likely_separator(line)))
    return names >= _NEEDED and any(names >= needed for needed in _IDENTITIES)


def _read(text: Text, reading: Reading, options: ReadOptions) -> None:
    reading.program = "G-NetTrack"
    rows = header_columns(text.data, reading, text.line, ragged=_LEAST_FIELDS)
    version = [word for word in rows.texts("version_name")[:1] if word]
    reading.program += f" {version[0]}" if version else ""
    time_s, zoned = rows.times_of_part("timestamp", zone=options.zone, layout=_LAYOUT)
    reading.clock = Clock("local", options.zone if zoned else "")
    lat, lon = rows.number("latitude"), rows.number("longitude")
    _add_positions(rows, reading, time_s, lat, lon)
    serving = _serving(rows, reading)
    state = _state(rows, serving)
    repeated = repeated_readings(state, time_s, lat, lon)
    reading.refuse(rows.line[repeated], "radio not renewed: repeats a reading for over 30 s, 50 m")
    _add_serving(rows, reading, time_s, serving, ~repeated)
    _add_neighbours(rows, reading, time_s, ~repeated)


def _add_positions(
    rows: Columns, reading: Reading, time_s: Floats, lat: Floats, lon: Floats
) -> None:
    """Add the positions that differ from the row before: others are not renewed."""
    new = np.ones(len(rows), dtype=bool)
    new[1:] = (np.diff(lat) != 0) | (np.diff(lon) != 0)
    if (repeats := int((~new).sum())) > 0:
        why = "the position before, left out"
        reading.count(
            lambda n: f"positions: {number_of(n, 'row repeats', 'rows repeat')} {why}", repeats
        )
    columns = {
        "time_s": time_s,
        "lat_deg": lat,
        "lon_deg": lon,
        "altitude_m": rows.number("altitude"),
        "accuracy_m": rows.number("accuracy"),
        "speed_mps": KMH_MPS * rows.number("speed"),
    }
    kept = {name: values[new] for name, values in columns.items()}
    reading.add("positions", kept, rows.line[new])


def _serving(rows: Columns, reading: Reading) -> dict[str, Floats]:
    """Return the identity of the serving cell; a network code that varies is the commonest one."""
    operator = rows.texts("operator")
    lac = available(*rows.whole("lac"))
    if not rows.has("lac"):
        lac = _hexadecimal(rows.texts("lachex"))
    ci = available(*rows.whole("rawcellid"))
    if np.isnan(ci).any():
        node, cell = available(*rows.whole("node")), available(*rows.whole("cellid"))
        # A base station of LTE has 256 cells; GSM and UMTS have none, or that of a controller.
        lte = (rows.mapped(technology, "networkmode", "networktech") == "LTE") & (node > 0)
        ci = np.where(np.isnan(ci) & lte, node * _LTE_CELLS + cell, ci)
        ci = ci if rows.has("rawcellid") else np.where(lte, ci, cell)
    # The program writes 0 where the phone does not know its cell.
    unknown = ci == 0
    if unknown.any():
        of = "a cell id of 0, which is no identity"
        reading.count(
            lambda n: f"radio: {number_of(n, 'row has', 'rows have')} {of}",
            int(unknown.sum()),
            ignored=True,
        )
    ci = np.where(unknown, np.nan, ci)
    mcc, mnc = (np.full(len(rows), np.nan) for _ in range(2))
    for word in pd.unique(operator):
        if re.fullmatch(r"\d{5,6}", str(word)):
            of = operator == word
            mcc[of], mnc[of] = float(word[:3]), float(word[3:])
    networks = pd.Series(list(zip(mcc, mnc, strict=True)))[~np.isnan(mcc)]
    if networks.nunique() > 1:
        commonest = networks.groupby([lac[~np.isnan(mcc)], ci[~np.isnan(mcc)]]).agg(
            lambda codes: codes.mode().iloc[0]
        )
        varied = networks.groupby([lac[~np.isnan(mcc)], ci[~np.isnan(mcc)]]).nunique()
        for (one_lac, one_ci), count in varied.items():
            if count > 1:
                of = (lac == one_lac) & (ci == one_ci)
                mcc[of], mnc[of] = commonest[one_lac, one_ci]
                reading.note(
                    f"radio: cell {one_ci:.0f} with {count} network codes, "
                    f"{mcc[of][0]:.0f}-{mnc[of][0]:.0f} taken"
                )
    return {"mcc": mcc, "mnc": mnc, "lac": lac, "ci": ci}


def _hexadecimal(texts: np.ndarray) -> Floats:
    known = {
        word: float(int(word, 16)) if re.fullmatch(r"[0-9A-Fa-f]{1,7}", word) else np.nan
        for word in set(texts.tolist())
    }
    return np.array([known[word] for word in texts], dtype=np.float64)


def _state(rows: Columns, serving: dict[str, Floats]) -> Ints:
    """Return numbers that change where anything that was measured does."""
    names = ["level", "rsrp", "qual", "rsrq", "psc", "arfcn", "ta"]
    for i in range(1, _MOST_NEIGHBOURS + 1):
        names += [f"ncell{i}", f"nrxlev{i}"]
    ci = np.nan_to_num(serving["ci"], nan=-1.0)
    changed = np.zeros(len(rows), dtype=bool)
    changed[1:] = ci[1:] != ci[:-1]
    for name in names:
        if rows.has(name):
            changed |= rows.changes(name)
    return np.cumsum(changed)


def _add_serving(
    rows: Columns, reading: Reading, time_s: Floats, serving: dict[str, Floats], good: Bools
) -> None:
    families = rows.mapped(technology, "networkmode", "networktech")
    columns = {
        **serving,
        "time_s": time_s,
        "technology": families,
        "arfcn": available(*rows.whole("arfcn")),
        "bsic": available(*rows.whole("psc")),
        "level_dbm": rows.number("level", "rsrp"),
        "timing_advance": available(*rows.whole("ta")),
    }
    kept = {name: values[good] for name, values in columns.items()}
    add_radio(reading, {**kept, "role": "serving"}, rows.line[good])


def _add_neighbours(rows: Columns, reading: Reading, time_s: Floats, good: Bools) -> None:
    false = 0
    for i in range(1, _MOST_NEIGHBOURS + 1):
        words = rows.texts(f"ntech{i}")
        there = good & (words != "")
        if not there.any():
            continue
        names = rows.texts(f"ncell{i}")
        # Some versions list GSM neighbours that are no cells, with a dump of an object as name.
        dump = there & rows.contains("=", f"ncell{i}")
        false += int(dump.sum())
        there &= ~dump
        columns = {
            "time_s": time_s,
            "technology": rows.mapped(technology, f"ntech{i}"),
            "arfcn": available(*rows.whole(f"narfcn{i}")),
            "bsic": _codes(names),
            "level_dbm": rows.number(f"nrxlev{i}"),
        }
        kept = {name: values[there] for name, values in columns.items()}
        add_radio(reading, {**kept, "role": "neighbour"}, rows.line[there])
    if false:
        reading.count(
            lambda n: f"radio: {n} neighbours are no cells (a dump for a code), left out", false
        )


def _codes(texts: np.ndarray) -> Floats:
    words = set(texts.tolist())
    # Of other scripts, and raised ones, are digits, too.
    known = {w: float(w) if w.isascii() and w.isdigit() else np.nan for w in words}
    return np.array([known[word] for word in texts], dtype=np.float64)


FORMAT = Format(
    "gnettrack",
    "a G-NetTrack log",
    "G-NetTrack, G-NetTrack Pro (text or CSV)",
    "serving cell, neighbours by carrier and PCI, levels, timing advance, positions",
    _matches,
    _read,
    # Of a part's first row it is not known whether it repeats the one before.
    by_rows=True,
)
