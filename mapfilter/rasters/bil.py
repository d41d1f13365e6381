"""Raw pixels with an ESRI header (``.bil`` and ``.hdr``), as planning tools export them.

``ULXMAP`` and ``ULYMAP`` are the *centre* of the upper left pixel, so its corner lies half a pixel
to the north-west of them.

References
----------
Esri, "BIL, BIP, and BSQ raster files" (ArcGIS help).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import cast

import numpy as np

from mapfilter._types import Floats32
from mapfilter.errors import Faults, InputError, fail
from mapfilter.geodesy import Lattice
from mapfilter.rasters.files import Window, existing, without_nodata
from mapfilter.rasters.grid_header import GridHeader, crs_beside, crs_file, grid_lattice, is_placed

_ORDERS = {"I": "<", "LSBFIRST": "<", "M": ">", "MSBFIRST": ">"}
_TYPES = {
    (8, "SIGNEDINT"): "i1", (8, "UNSIGNEDINT"): "u1", (16, "SIGNEDINT"): "i2",
    (16, "UNSIGNEDINT"): "u2", (32, "SIGNEDINT"): "i4", (32, "UNSIGNEDINT"): "u4",
    (32, "FLOAT"): "f4", (64, "FLOAT"): "f8",
}  # fmt: skip
_LARGEST_SKIP_BYTES = 1 << 20


@dataclass(frozen=True, slots=True)
class Bil:
    """One band of raw pixels.

    Parameters
    ----------
    path : Path
    cell_ids : tuple of one str
    lattice : Lattice
    dtype : str
        NumPy's text for the type of a pixel, such as ``">i2"``.
    skip_bytes, row_bytes : int
        What lies before the first row, and from each row to the next.
    nodata : tuple of float
        Numbers that mean no data.
    """

    path: Path
    cell_ids: tuple[str, ...]
    lattice: Lattice
    dtype: str
    skip_bytes: int
    row_bytes: int
    nodata: tuple[float, ...] = ()

    @property
    def bits(self) -> int:
        """Size of a pixel."""
        return 8 * np.dtype(self.dtype).itemsize

    @property
    def parts(self) -> tuple[Path, ...]:
        """The file, its header and its CRS."""
        return existing(self.path, header_of(self.path), crs_file(self.path))

    def read(self, bands: Sequence[int], window: Window) -> Floats32:
        """Read a window row by row; see :class:`~mapfilter.rasters.files.RasterFile`."""
        row, col, rows, cols = window
        values = np.empty((rows, cols), dtype=self.dtype)
        start = self.skip_bytes + col * values.itemsize
        try:
            with self.path.open("rb", buffering=0) as stream:
                for i in range(rows):
                    stream.seek(start + (row + i) * self.row_bytes)
                    if stream.readinto(values[i].view(np.uint8)) != values[i].nbytes:
                        got = f"the end in row {row + i + 1}"
                        raise fail(InputError, str(self.path), "all rows", got, "cut off")
        except OSError as error:
            got = error.strerror or str(error)
            raise fail(InputError, str(self.path), "readable pixels", got) from error
        with np.errstate(over="ignore", invalid="ignore"):
            found = without_nodata(values.astype(np.float32), self.nodata)
        return np.repeat(found[np.newaxis], len(bands), axis=0)


def header_of(path: Path) -> Path:
    """Return where the header of raw pixels is, if there is one: same name, ``.hdr``."""
    upper = path.with_suffix(".HDR")
    return upper if upper.is_file() else path.with_suffix(".hdr")


def open_bil(
    path: Path,
    cell_id: str,
    crs: str | None = None,
    nodata: float | None = None,
    *,
    instead: GridHeader | None = None,
) -> Bil:
    """Read the header of raw pixels and compare it with the file.

    Parameters
    ----------
    path : Path
        The ``.bil`` or ``.flt`` file; its header lies beside it.
    cell_id : str
    crs : str, optional
        For files without a ``.prj`` beside them.
    nodata : float, optional
        A number that means no data, besides the header's own.
    instead : GridHeader, optional
        Used where there is no header, or one that does not tell the place.

    Raises
    ------
    InputError
        With every fault: no header, an unknown type of pixels, several bands, a place or size that
        makes no sense, a file shorter or longer than the header tells.
    """
    header = _header(path, instead)
    faults = Faults()
    system = crs_beside(path, crs)
    rows, cols = header.whole("NROWS", faults, low=1), header.whole("NCOLS", faults, low=1)
    lattice = grid_lattice(header, system, rows, cols, faults)
    if (bands := header.whole("NBANDS", faults, 1)) not in (1, None):
        faults.add(header.where, "one band per file", f"NBANDS {bands}")
    dtype = _dtype(path, header, faults)
    empty = [] if nodata is None else [nodata]
    if key := header.first("NODATA", "NODATA_VALUE"):
        own = header.number(key, faults)
        empty += [] if own is None else [own]
    skip_bytes = header.whole("SKIPBYTES", faults, 0)
    if skip_bytes is not None and skip_bytes > _LARGEST_SKIP_BYTES:
        faults.add(f"{header.where}, SKIPBYTES", f"at most {_LARGEST_SKIP_BYTES}", skip_bytes)
    if rows is None or cols is None or dtype is None or skip_bytes is None:
        raise InputError(tuple(faults.found))
    pixel_bytes = np.dtype(dtype).itemsize
    row_bytes = header.whole("TOTALROWBYTES", faults, cols * pixel_bytes) or 0
    if row_bytes < cols * pixel_bytes:
        expected = f"at least {cols * pixel_bytes} for {cols} pixels of {8 * pixel_bytes} bits"
        faults.add(f"{header.where}, TOTALROWBYTES", expected, row_bytes)
    _check_size(path, skip_bytes, rows, row_bytes, cols * pixel_bytes, faults)
    faults.raise_if_any(InputError)
    return Bil(path, (cell_id,), cast(Lattice, lattice), dtype, skip_bytes, row_bytes, tuple(empty))


def _header(path: Path, instead: GridHeader | None) -> GridHeader:
    if instead is not None and not header_of(path).is_file():
        return instead
    header = GridHeader.read(header_of(path))
    if instead is None or is_placed(header):
        return header
    return GridHeader(header.where, {**instead.values, **header.values})


def _check_size(
    path: Path, skip_bytes: int, rows: int, row_bytes: int, pixels_bytes: int, faults: Faults
) -> None:
    """Note a fault when a file is not as long as its rows; the last one need not be filled up."""
    try:
        size = path.stat().st_size
    except OSError as error:
        faults.add(str(path), "a readable file", error.strerror or str(error))
        return
    least = skip_bytes + (rows - 1) * row_bytes + pixels_bytes
    most = max(skip_bytes + rows * row_bytes, least)
    if not least <= size <= most:
        hint = "the file is cut off, or the header is of another" if size < least else (
            "the header is of another file, or NBITS, NROWS or NCOLS is wrong"
        )  # fmt: skip
        faults.add(str(path), f"{most} bytes for {rows} rows of {row_bytes}", f"{size} bytes", hint)


def _dtype(path: Path, header: GridHeader, faults: Faults) -> str | None:
    floating = path.suffix.lower() == ".flt"
    bits = header.whole("NBITS", faults, 32 if floating else 8)
    order_text = header.values.get("BYTEORDER", "I").upper()
    # Without a type, 16 bits are mostly signed, and 32 mostly real, as GDAL takes them, too.
    default = {8: "UNSIGNEDINT", 16: "SIGNEDINT"}.get(bits or 0, "FLOAT")
    kind = header.values.get("PIXELTYPE", default).upper()
    kind = {"SIGNED": "SIGNEDINT", "UNSIGNED": "UNSIGNEDINT"}.get(kind, kind)
    order = _ORDERS.get(order_text)
    if order is None:
        faults.add(f"{header.where}, BYTEORDER", "I or M", repr(order_text[:20]))
    found = _TYPES.get((bits or 0, kind))
    if found is None and bits is not None:
        expected = "NBITS 8, 16 or 32, and PIXELTYPE SIGNEDINT, UNSIGNEDINT or FLOAT"
        faults.add(header.where, expected, f"{bits} and {kind[:20]}")
    return f"{order}{found}" if order and found else None
