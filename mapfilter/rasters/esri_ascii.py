"""ESRI ASCII grids (``.asc``): a header of six lines, then one line of numbers per row.

The rows begin in the north, although the header gives the lower left pixel: its corner
(``XLLCORNER``) or its centre (``XLLCENTER``).

References
----------
Esri, "ASCII raster file format" (ArcGIS help).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import cast

import numpy as np

from mapfilter._types import Floats32, Ints
from mapfilter.errors import Faults, InputError, fail
from mapfilter.geodesy import Lattice
from mapfilter.rasters.files import Window, existing, without_nodata
from mapfilter.rasters.grid_header import GridHeader, crs_beside, crs_file, grid_lattice

_NODATA = -9999.0
_LARGEST_HEADER_BYTES = 4096
_MOST_HEADER_LINES = 12
_MOST_COLS = 1_000_000
_LONGEST_NUMBER = 64
_CHUNK_BYTES = 1 << 22
_NEWLINE = ord("\n")


@dataclass(frozen=True, slots=True)
class AsciiGrid:
    """One grid of numbers written as text.

    Parameters
    ----------
    path : Path
    cell_ids : tuple of one str
    lattice : Lattice
    header_bytes : int
        Where the first row begins.
    nodata : tuple of float
        Numbers that mean no data.
    """

    path: Path
    cell_ids: tuple[str, ...]
    lattice: Lattice
    header_bytes: int
    nodata: tuple[float, ...]

    @property
    def parts(self) -> tuple[Path, ...]:
        """The file and its CRS."""
        return existing(self.path, crs_file(self.path))

    def read(self, bands: Sequence[int], window: Window) -> Floats32:
        """Read a window line by line; see :class:`~mapfilter.rasters.files.RasterFile`."""
        row, col, rows, cols = window
        values = np.empty((rows, cols), dtype=np.float64)
        try:
            status = self.path.stat()
            starts = _row_starts(
                self.path, status.st_size, status.st_mtime_ns, self.header_bytes, self.lattice.rows
            )
            with self.path.open("rb") as stream:
                for i in range(row, row + rows):
                    stream.seek(int(starts[i]))
                    values[i - row] = self._numbers(
                        stream.read(int(starts[i + 1] - starts[i])), i, col, cols
                    )
        except OSError as error:
            got = error.strerror or str(error)
            raise fail(InputError, str(self.path), "readable pixels", got) from error
        with np.errstate(over="ignore"):
            found = without_nodata(values.astype(np.float32), self.nodata)
        return np.repeat(found[np.newaxis], len(bands), axis=0)

    def _numbers(self, line: bytes, row: int, col: int, cols: int) -> list[float]:
        where, expected = f"{self.path} row {row + 1}", f"{self.lattice.cols} numbers"
        if len(line) > self.lattice.cols * _LONGEST_NUMBER:
            raise fail(InputError, where, expected, f"{len(line)} bytes", "rows run together")
        fields = line.replace(b",", b".").split(None, self.lattice.cols)
        if len(fields) != self.lattice.cols:
            more = len(fields) > self.lattice.cols
            hint = "NCOLS is wrong, or rows run together" if more else "cut off, or NCOLS is wrong"
            raise fail(InputError, where, expected, "more" if more else len(fields), hint)
        try:
            if b"_" in line:
                raise ValueError("an underscore")
            return [float(field) for field in fields[col : col + cols]]
        except ValueError as error:
            raise fail(InputError, where, expected, "something else", "damaged") from error


def open_ascii_grid(
    path: Path, cell_id: str, crs: str | None = None, nodata: float | None = None
) -> AsciiGrid:
    """Read the header of an ESRI ASCII grid.

    Parameters
    ----------
    path : Path
    cell_id : str
    crs : str, optional
        For files without a ``.prj`` beside them.
    nodata : float, optional
        A number that means no data, besides the header's own (-9999 where it tells none).

    Raises
    ------
    InputError
        With every fault: no such header, a place or size that makes no sense, fewer bytes than
        the pixels need.
    """
    try:
        size = path.stat().st_size
        with path.open("rb") as stream:
            head = stream.read(_LARGEST_HEADER_BYTES)
    except OSError as error:
        raise fail(InputError, str(path), "a readable file", error.strerror or error) from error
    lines, header_bytes = [], 0
    for line in head.splitlines(keepends=True)[:_MOST_HEADER_LINES]:
        if not line.strip()[:1].isalpha():
            break
        lines.append(line)
        header_bytes += len(line)
    header, faults = GridHeader.of(str(path), lines), Faults()
    if "NCOLS" not in header.values or "NROWS" not in header.values:
        raise fail(InputError, str(path), "lines NCOLS and NROWS first", "none", "no ASCII grid")
    system = crs_beside(path, crs)
    rows, cols = header.whole("NROWS", faults, low=1), header.whole("NCOLS", faults, low=1)
    lattice = grid_lattice(header, system, rows, cols, faults)
    own = _NODATA
    if key := header.first("NODATA_VALUE", "NODATA"):
        own = header.number(key, faults) or 0.0
    if cols is not None and cols > _MOST_COLS:
        faults.add(f"{path}, NCOLS", f"at most {_MOST_COLS}", cols)
    if rows is not None and cols is not None and 2 * rows * cols - 1 > size - header_bytes:
        expected = f"at least {2 * rows * cols - 1} bytes for {rows} x {cols} numbers"
        hint = "the file is cut off, or its header is damaged"
        faults.add(str(path), expected, f"{size - header_bytes} bytes", hint)
    faults.raise_if_any(InputError)
    empty = (own,) if nodata is None else (own, nodata)
    return AsciiGrid(path, (cell_id,), cast(Lattice, lattice), header_bytes, empty)


@lru_cache(maxsize=1024)
def _row_starts(path: Path, size: int, _modified_ns: int, header_bytes: int, rows: int) -> Ints:
    """Return where each row begins, and the end of the last; the file is read through once.

    Raises
    ------
    InputError
        There are more or fewer rows than the header tells.
    """
    ends: list[Ints] = []
    found, at = 0, header_bytes
    with path.open("rb") as stream:
        stream.seek(header_bytes)
        while found <= rows and (chunk := stream.read(_CHUNK_BYTES)):
            newlines = np.flatnonzero(np.frombuffer(chunk, dtype=np.uint8) == _NEWLINE)
            ends.append(newlines.astype(np.int64) + at + 1)
            found += newlines.size
            at += len(chunk)
        starts = np.concatenate([np.array([header_bytes], dtype=np.int64), *ends])
        if starts.size == rows and starts[-1] < size:
            starts = np.append(starts, size)
        extra_bytes = size - int(starts[rows]) if starts.size > rows else 0
        stream.seek(size - extra_bytes)
        blank = not stream.read(_CHUNK_BYTES).strip()
    if starts.size <= rows:
        got, hint = f"{starts.size - 1}", "the file is cut off, or rows are broken over lines"
        raise fail(InputError, str(path), f"{rows} lines of numbers", got, hint)
    if not blank or extra_bytes > _CHUNK_BYTES:
        hint = "NROWS is wrong, or rows are broken over lines"
        raise fail(InputError, str(path), f"{rows} lines of numbers", "more", hint)
    return starts[: rows + 1]
