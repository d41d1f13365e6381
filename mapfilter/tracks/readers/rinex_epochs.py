"""Epochs of RINEX 3 observations: a line of the time, then a line of each satellite."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc

from mapfilter._constants import GPS_EPOCH_S
from mapfilter._types import Bools, Floats, Ints
from mapfilter.tracks.readers.recorded.reading import Reading
from mapfilter.tracks.readers.texts.lines import blocks, line_texts

_DATE = (
    r"^\s*(?P<year>\d{4})\s+(?P<month>\d{1,2})\s+(?P<day>\d{1,2})\s+(?P<hour>\d{1,2})"
    r"\s+(?P<minute>\d{1,2})\s+(?P<second>\d{1,2}(?:\.\d*)?)\s*$"
)
_NUMBER = r"^[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d{1,3})?$"
_NAME = r"^[GRECJIS]\d\d$"
_WIDTH, _DIGITS = 16, 14
_NAME_CHARACTERS = 3
_ALL_IN_A_LINE = 1 << 30


@dataclass(frozen=True)
class Wanted:
    """Types of observations in the order of their columns, and codes of interest.

    Parameters
    ----------
    types : mapping of str to sequence of str
        Of each constellation.
    codes : mapping of str to sequence of str
        Of each constellation, the best first.
    """

    types: Mapping[str, Sequence[str]]
    codes: Mapping[str, Sequence[str]]


@dataclass(frozen=True, eq=False)
class Records:
    """Lines of satellites, in fixed columns.

    Parameters
    ----------
    texts : pa.StringArray
        All lines of a block.
    first : (N,) array of int
        The first line of each satellite.
    lead : int
        Characters before the values of a line.
    values_of_line : int
        A satellite's values go on in the next line after as many.
    """

    texts: pa.StringArray
    first: Ints
    lead: int
    values_of_line: int

    def numbers(self, rows: Ints, place: int) -> Floats:
        """Return the numbers of one column of some satellites, NaN where there is none."""
        line = self.first[rows] + place // self.values_of_line
        there = line < len(self.texts)
        start = self.lead + _WIDTH * (place % self.values_of_line)
        texts = self.texts.take(pa.array(np.where(there, line, 0)))
        words = pc.utf8_trim_whitespace(pc.utf8_slice_codeunits(texts, start, start + _DIGITS))
        good = pc.and_(pa.array(there), pc.match_substring_regex(words, _NUMBER))
        value = pc.cast(pc.if_else(good, words, None), pa.float64())
        return np.asarray(value.to_numpy(zero_copy_only=False), dtype=np.float64)


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
    data: memoryview, first_line: int, wanted: Wanted, reading: Reading
) -> list[Observations]:
    """Read the lines below a header: of each satellite the first of its codes that is there."""
    found: list[Observations] = []
    last_s = np.nan
    for block, line in blocks(data, first_line):
        texts = line_texts(np.frombuffer(block, dtype=np.uint8))
        number = line + np.arange(len(texts))
        epoch = _bools(pc.starts_with(texts, ">"))
        blank = _bools(pc.equal(pc.utf8_trim_whitespace(texts), ""))
        reading.rows += int((~blank).sum())
        begins = texts.filter(pa.array(epoch))
        stamp = pc.utf8_slice_codeunits(begins, 1, 29)
        seconds = _seconds(stamp)
        # Flags from 2 on are events: header lines follow, no observations. They need no time.
        flag = pc.utf8_slice_codeunits(begins, 31, 32)
        event = ~_bools(pc.is_in(flag, pa.array(["0", "1", " ", ""])))
        timed = _bools(pc.not_equal(pc.utf8_trim_whitespace(stamp), ""))
        reading.refuse(
            number[epoch][np.isnan(seconds) & (timed | ~event)], "epoch: no date and time"
        )
        seconds[event] = np.nan
        time_s = np.concatenate([[last_s], seconds])[np.cumsum(epoch)]
        last_s = float(time_s[-1]) if len(time_s) else last_s
        rows = np.flatnonzero(~epoch & ~blank & np.isfinite(time_s))
        records = Records(texts, rows, _NAME_CHARACTERS, _ALL_IN_A_LINE)
        names = pc.utf8_slice_codeunits(texts.take(pa.array(rows)), 0, _NAME_CHARACTERS)
        found += observed(records, names, time_s[rows], number[rows], wanted, reading)
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
    # GPS time begins in 1980, nanoseconds since 1970 end in 2262.
    whole = (part["minute"] < 60) & (part["year"] >= 1980) & (part["year"] < 2262)
    for name, most in (("hour", 24), ("second", 61)):
        whole &= part[name] < most
    dates = pd.DataFrame({name: part[name] for name in ("year", "month", "day")})
    dates.loc[~whole] = np.nan
    day = pd.to_datetime(dates, errors="coerce")
    midnight_s = (day - pd.Timestamp(0)).dt.total_seconds().to_numpy(dtype=np.float64)
    of_day_s = 3600 * part["hour"] + 60 * part["minute"] + part["second"]
    return np.where(whole, midnight_s + of_day_s - GPS_EPOCH_S, np.nan)


def observed(
    records: Records,
    names: pa.Array,
    time_s: Floats,
    number: Ints,
    wanted: Wanted,
    reading: Reading,
) -> list[Observations]:
    """Return the code range of each satellite, with the level of its signal.

    Parameters
    ----------
    names : (N,) array of str
        Such as ``G07`` or ``G 7``.
    time_s : (N,) array
        Seconds since 6 January 1980.
    number : (N,) array of int
        The file's line of each satellite.
    """
    names = pc.replace_substring(names, " ", "0")
    named = _bools(pc.match_substring_regex(names, _NAME))
    reading.refuse(number[~named], "no satellite such as G07")
    letters = pc.utf8_slice_codeunits(names, 0, 1)
    found: list[Observations] = []
    for letter, best_first in wanted.codes.items():
        of = np.flatnonzero(named & _bools(pc.equal(letters, letter)))
        if not of.size:
            continue
        types = list(wanted.types.get(letter, []))
        range_m, cn0 = np.full(len(of), np.nan), np.full(len(of), np.nan)
        signal = np.full(len(of), "", dtype=object)
        for code in (code for code in best_first if code in types):
            missing = np.flatnonzero(np.isnan(range_m))
            value = records.numbers(of[missing], types.index(code))
            there = np.isfinite(value) & (value != 0)
            new = missing[there]
            range_m[new] = value[there]
            level = next((c for c in types if c[0] == "S" and c[1:] == code[1:]), None)
            if level is not None:
                cn0[new] = records.numbers(of[new], types.index(level))
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
