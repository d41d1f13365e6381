"""ESRI ASCII grids (``.asc``), read by window."""

from __future__ import annotations

from array import array
from codecs import BOM_UTF8
from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from functools import lru_cache
from itertools import takewhile
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from mapfilter._inputs import open_input
from mapfilter._types import Ints
from mapfilter.errors import InputError, fail
from mapfilter.lattice import Lattice
from mapfilter.rasters.files import Declared
from mapfilter.rasters.plain_grids import NODATA, GridHeader, PlainGrid, file_beside, grid_crs

_LARGEST_ASCII_HEADER_BYTES = 4096
_MOST_HEADER_LINES = 12
_MOST_COLS = 1_000_000
_LONGEST_NUMBER = 64
_NO_WORDS = (b"nan", b"inf", b"infinity")


@dataclass(frozen=True, slots=True)
class AsciiGrid(PlainGrid):
    """One grid of numbers written as text; the first row begins after ``header_bytes``."""

    _: KW_ONLY
    header_bytes: int

    def _pixels(self, row: int, col: int, rows: int, cols: int) -> NDArray[Any]:
        changed_ns = self.path.stat().st_mtime_ns
        starts = _row_starts(self.path, changed_ns, self.header_bytes, self.lattice.rows)
        values = np.empty((rows, cols), dtype=np.float64)
        with open_input(self.path) as stream:
            for i in range(rows):
                stream.seek(int(starts[row + i]))
                line = stream.read(int(starts[row + i + 1] - starts[row + i]))
                values[i] = self._numbers(line, row + i, slice(col, col + cols))
        return values

    def _numbers(self, line: bytes, row: int, wanted: slice) -> Sequence[float]:
        cols, where = self.lattice.cols, f"{self.path} row {row + 1}"
        if len(line) > cols * _LONGEST_NUMBER:
            got = f"{len(line)} bytes"
            raise fail(InputError, where, f"{cols} numbers", got, "rows run together")
        fields = line.replace(b",", b".").split(None, cols)
        if len(fields) != cols:
            more = len(fields) > cols
            hint = "NCOLS is wrong, or rows run together" if more else "cut off, or NCOLS is wrong"
            raise fail(InputError, where, f"{cols} numbers", "more" if more else len(fields), hint)
        try:
            return [float(b"?" if b"_" in field else field) for field in fields[wanted]]
        except ValueError as error:
            expected = f"{cols} numbers"
            raise fail(InputError, where, expected, "something else", "damaged") from error


def open_ascii_grid(path: Path, cell_id: str, declared: Declared) -> AsciiGrid:
    """Read the header of an ESRI ASCII grid; numbers that mean no data are -9999 by default.

    Raises
    ------
    InputError
        With every fault: no such header, a place or size that makes no sense, fewer bytes than
        the pixels need.
    """
    with open_input(path) as stream:
        head = stream.read(_LARGEST_ASCII_HEADER_BYTES)
    mark = BOM_UTF8 if head.startswith(BOM_UTF8) else b""
    lines = head[len(mark) :].splitlines(keepends=True)[:_MOST_HEADER_LINES]
    lines = list(takewhile(_has_key, lines))
    header, header_bytes = GridHeader.of(str(path), lines), len(mark) + sum(map(len, lines))
    if "NCOLS" not in header.values or "NROWS" not in header.values:
        raise fail(InputError, str(path), "lines NCOLS and NROWS first", "none", "no ASCII grid")
    crs, faults = grid_crs(path, declared.crs), header.faults
    rows, cols = header.whole("NROWS", low=1), header.whole("NCOLS", low=1)
    lattice = header.lattice(crs, rows, cols)
    own = header.nodata("NODATA_VALUE", "NODATA")
    own = NODATA if own is None else own
    if cols is not None and cols > _MOST_COLS:
        faults.add(f"{path}, NCOLS", f"at most {_MOST_COLS}", cols)
    found_bytes = path.stat().st_size - header_bytes
    if rows is not None and cols is not None and 2 * rows * cols - 1 > found_bytes:
        expected = f"at least {2 * rows * cols - 1} bytes for {rows} x {cols} numbers"
        hint = "the file is cut off, or its header is damaged"
        faults.add(str(path), expected, f"{found_bytes} bytes", hint)
    faults.raise_if_any(InputError)
    nodata = (own,) if declared.nodata is None else (own, declared.nodata)
    parts = tuple(filter(None, (path, file_beside(path, ".prj", ".PRJ"))))
    place = cast(Lattice, lattice)
    return AsciiGrid(path, (cell_id,), place, nodata, parts, header_bytes=header_bytes)


def _has_key(line: bytes) -> bool:
    """Return whether a line begins with a word, which NaN and infinity are not."""
    word, *_ = line.split(None, 1) or [b""]
    return word[:1].isalpha() and word.lower() not in _NO_WORDS


@lru_cache(maxsize=1024)
def _row_starts(path: Path, _changed_ns: int, header_bytes: int, rows: int) -> Ints:
    """Return where each row begins, and the end of the last; the file is read through once."""
    ends, expected = array("q", [header_bytes]), f"{rows} lines of numbers"
    with open_input(path) as stream:
        stream.seek(header_bytes)
        for line in stream:
            if len(ends) <= rows:
                ends.append(ends[-1] + len(line))
            elif line.strip():
                hint = "NROWS is wrong, or rows are broken over lines"
                raise fail(InputError, str(path), expected, "more", hint)
    if len(ends) <= rows:
        got, hint = f"{len(ends) - 1}", "the file is cut off, or rows are broken over lines"
        raise fail(InputError, str(path), expected, got, hint)
    return np.array(ends, dtype=np.int64)
