"""Raster files as planning tools write them, made by their published descriptions."""

from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from mapfilter.lattice import Lattice

HDR = """NROWS {rows}
NCOLS {cols}
NBANDS 1
NBITS {bits}
BYTEORDER {order}
LAYOUT BIL
SKIPBYTES 0
ULXMAP {ulx!r}
ULYMAP {uly!r}
XDIM {side!r}
YDIM {side!r}
PIXELTYPE {kind}
NODATA {nodata}
"""
INDEX_HEADER = "TX_NAME;FILE_NAME;RESOLUTION;AREA_XMIN;AREA_XMAX;AREA_YMIN;AREA_YMAX;NBITS\n"
WINDOWS = (
    ((0, 0, 6, 8), True),
    ((5, 7, 1, 1), True),
    ((5, 0, 1, 8), True),
    ((0, 0, 7, 8), False),
    ((0, 0, 6, 9), False),
    ((-1, 0, 2, 2), False),
    ((0, -1, 2, 2), False),
    ((6, 0, 1, 1), False),
    ((0, 8, 1, 1), False),
    ((0, 0, 0, 1), False),
    ((0, 0, 1, 0), False),
)
"""Windows, and whether they lie on a lattice of 6 rows and 8 columns."""


def write_bil(
    path: Path,
    lattice: Lattice,
    values: NDArray[Any],
    *,
    order: str = "I",
    header: str = HDR,
    shift_px: float = 0.0,
    nodata: int = -9999,
) -> Path:
    """Write raw pixels and their header; ULXMAP and ULYMAP are the first pixel's centre.

    ``shift_px`` = -0.5 makes the classic mistake: the corner in place of the centre.
    """
    kind = {"i": "SIGNEDINT", "u": "UNSIGNEDINT", "f": "FLOAT"}[values.dtype.kind]
    east_m, north_m = lattice.east_north(shift_px, shift_px)
    path.write_bytes(values.astype(values.dtype.newbyteorder("<" if order == "I" else ">")))
    text = header.format(
        rows=lattice.rows,
        cols=lattice.cols,
        bits=8 * values.dtype.itemsize,
        order=order,
        ulx=east_m,
        uly=north_m,
        side=lattice.resolution_m,
        kind=kind,
        nodata=nodata,
    )
    path.with_suffix(".hdr").write_text(text)
    return path


def index_row(cell_id: str, path: Path, lattice: Lattice, bits: int = 16) -> str:
    """Return a line of an index: the area's limits are outer edges."""
    west, south, east, north = lattice.bounds_m
    area = f"{west!r};{east!r};{south!r};{north!r}"
    return f"{cell_id};{path.name};{lattice.resolution_m!r};{area};{bits}\n"


def write_ascii(
    path: Path, lattice: Lattice, values: NDArray[Any], *, corner: bool = True, nodata: str = ""
) -> Path:
    """Write an ESRI ASCII grid, placed by the lower left pixel's corner or centre."""
    west, south, _, _ = lattice.bounds_m
    half_m = 0 if corner else lattice.resolution_m / 2
    name = "corner" if corner else "center"
    lines = [
        f"ncols         {lattice.cols}",
        f"nrows         {lattice.rows}",
        f"xll{name}     {west + half_m!r}",
        f"yll{name}     {south + half_m!r}",
        f"cellsize      {lattice.resolution_m!r}",
    ]
    lines += [f"NODATA_value  {nodata}"] if nodata else []
    lines += [" ".join(f"{value:g}" for value in row) for row in values]
    path.write_text("\n".join(lines) + "\n")
    return path
