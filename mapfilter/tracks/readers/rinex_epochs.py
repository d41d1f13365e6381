"""Epochs of RINEX 3 observations: fixed columns of all lines of a block at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc

from mapfilter._types import Bools, Floats, Ints
from mapfilter.gnss.broadcast import GPS_EPOCH_UTC_S
from mapfilter.tracks.readers.lines import blocks, line_texts
from mapfilter.tracks.readers.recording import Reading

_DATE = (
    r"^\s*(?P<year>\d{4})\s+(?P<month>\d{1,2})\s+(?P<day>\d{1,2})\s+(?P<hour>\d{1,2})"
    r"\s+(?P<minute>\d{1,2})\s+(?P<second>\d{1,2}(?:\.\d*)?)\s*$"
)
_NUMBER = r"^[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d{1,3})?$"
_NAME = r"^[GRECJIS]\d\d$"
_WIDTH, _DIGITS = 16, 14


@dataclass(frozen=True, eq=False)
class Observations:
    """Code ranges of satellites: seconds since 6 January 1980, and the line of each."""

    gps_s: Floats
    satellite: np.ndarray
    signal: np.ndarray
    pseudorange_m: Floats
    cn0_dbhz: Floats
    line: Ints


def read_epochs(
    data: memoryview,
    first_line: int,
    types: Mapping[str, Sequence[str]],
    codes: Mapping[str, Sequence[str]],
    reading: Reading,
) -> list[Observations]:
    """Read the lines below a header: of each satellite the first of its codes that is there.

    Parameters
    ----------
    types : mapping of str to sequence of str
        Columns of each constellation.
    codes : mapping of str to sequence of str
        Codes of each constellation, the best first.
    """
    found: list[Observations] = []
    last_s = np.nan
    for block, line in blocks(data, first_line):
        texts = line_texts(np.frombuffer(block, dtype=np.uint8))
        number = line + np.arange(len(texts))
        epoch = _bools(pc.starts_with(texts, ">"))
        blank = _bools(pc.equal(pc.utf8_trim_whitespace(texts), ""))
        reading.rows += int((~blank).sum())
        begins = texts.filter(pa.array(epoch))
        seconds = _seconds(pc.utf8_slice_codeunits(begins, 1, 29))
        reading.refuse(number[epoch][np.isnan(seconds)], "epoch: no date and time")
        # Flags from 2 on are events: header lines follow, no observations.
        flag = pc.utf8_slice_codeunits(begins, 31, 32)
        seconds[~_bools(pc.is_in(flag, pa.array(["0", "1", " ", ""])))] = np.nan
        time_s = np.concatenate([[last_s], seconds])[np.cumsum(epoch)]
        last_s = float(time_s[-1]) if len(time_s) else last_s
        rows = np.flatnonzero(~epoch & ~blank & np.isfinite(time_s))
        some = texts.take(pa.array(rows))
        found += _observed(some, time_s[rows], number[rows], types, codes, reading)
    return found


def _bools(values: pa.Array) -> Bools:
    return np.asarray(values.to_numpy(zero_copy_only=False), dtype=bool)


def _seconds(texts: pa.Array) -> Floats:
    """Return GPS seconds of year, month, day, hour, minute and second; NaN for other texts."""
    found = pc.extract_regex(texts, _DATE)
    part = {
        name: pc.cast(pc.if_else(found.is_valid(), found.field(name), None), pa.float64())
        for name in ("year", "month", "day", "hour", "minute", "second")
    }
    part = {name: values.to_numpy(zero_copy_only=False) for name, values in part.items()}
    whole = part["minute"] < 60
    for name, most in (("hour", 24), ("second", 61)):
        whole &= part[name] < most
    dates = pd.DataFrame({name: part[name] for name in ("year", "month", "day")})
    dates.loc[~whole] = np.nan
    day = pd.to_datetime(dates, errors="coerce")
    midnight_s = (day - pd.Timestamp(0)).dt.total_seconds().to_numpy(dtype=np.float64)
    of_day_s = 3600 * part["hour"] + 60 * part["minute"] + part["second"]
    return np.where(whole, midnight_s + of_day_s - GPS_EPOCH_UTC_S, np.nan)


def _observed(
    texts: pa.Array,
    time_s: Floats,
    number: Ints,
    types: Mapping[str, Sequence[str]],
    codes: Mapping[str, Sequence[str]],
    reading: Reading,
) -> list[Observations]:
    names = pc.replace_substring(pc.utf8_slice_codeunits(texts, 0, 3), " ", "0")
    named = _bools(pc.match_substring_regex(names, _NAME))
    reading.refuse(number[~named], "no satellite such as G07")
    letters = pc.utf8_slice_codeunits(names, 0, 1)
    found: list[Observations] = []
    for letter, wanted in codes.items():
        of = np.flatnonzero(named & _bools(pc.equal(letters, letter)))
        if not of.size:
            continue
        columns = list(types.get(letter, []))
        some = texts.take(pa.array(of))
        range_m, cn0 = np.full(len(of), np.nan), np.full(len(of), np.nan)
        signal = np.full(len(of), "", dtype=object)
        for code in (code for code in wanted if code in columns):
            value = _fixed(some, columns.index(code))
            new = np.isnan(range_m) & np.isfinite(value) & (value != 0)
            level = next((c for c in columns if c[0] == "S" and c[1:] == code[1:]), None)
            levels = np.nan if level is None else _fixed(some, columns.index(level))
            range_m = np.where(new, value, range_m)
            cn0 = np.where(new, levels, cn0)
            signal[new] = code
        good = np.isfinite(range_m)
        reading.refuse(number[of[~good]], "no code range on L1 (E1, B1)")
        kept = of[good]
        satellite = np.asarray(names.take(pa.array(kept)).to_pylist(), dtype=object)
        found.append(
            Observations(
                time_s[kept], satellite, signal[good], range_m[good], cn0[good], number[kept]
            )
        )
    return found


def _fixed(texts: pa.Array, place: int) -> Floats:
    """Return the numbers of one column, NaN where there is none."""
    start = 3 + _WIDTH * place
    words = pc.utf8_trim_whitespace(pc.utf8_slice_codeunits(texts, start, start + _DIGITS))
    numbers = pc.if_else(pc.match_substring_regex(words, _NUMBER), words, None)
    value = pc.cast(numbers, pa.float64()).to_numpy(zero_copy_only=False)
    return np.asarray(value, dtype=np.float64)
