"""Opening a set of RxLev rasters, without reading pixels.

A set is one GeoTIFF with a band per cell, a folder with a file per cell, or a planning tool's
export with its index; :func:`open_rasters` makes all of them look alike.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from numbers import Real
from pathlib import Path

from mapfilter._arguments import Argument, Setting, check_arguments, path_argument
from mapfilter.errors import Fault, Faults, InputError, fail, listed
from mapfilter.geodesy import projected_crs
from mapfilter.radio.cell_rules import id_fault
from mapfilter.rasters.ascii_grids import open_ascii_grid
from mapfilter.rasters.atoll import IndexRow, index_of, is_index, read_index
from mapfilter.rasters.files import (
    Declared,
    Quantity,
    RasterFile,
    check_file,
)
from mapfilter.rasters.geotiff import open_geotiff
from mapfilter.rasters.raster_set import ARRAYS, RxLevRasters
from mapfilter.rasters.raw_grids import open_raw_grid
from mapfilter.rasters.resampling import Resampling, common_lattice

Opener = Callable[[Path, str, Declared], RasterFile]
"""From a file, the cell's id if the file names none, and what the user or an index declares, to the
opened file; pixels are not read."""

FORMATS: Mapping[str, Opener] = {
    ".tif": open_geotiff,
    ".tiff": open_geotiff,
    ".asc": open_ascii_grid,
    ".bil": open_raw_grid,
    ".flt": open_raw_grid,
}
"""Formats of raster files by suffix. A new one needs its module and a line here."""
_OTHER_FORMATS: Mapping[tuple[str, ...], str] = {
    (
        ".bin",
        ".dat",
        ".raw",
    ): "pixels without a header: beside an index of Planet (index.txt: "
    "name, west, east, south, north and side of a pixel) they are read; else rename it to .bil, "
    "and write a .hdr beside it (NROWS, NCOLS, NBITS 16, BYTEORDER M or I, XLLCORNER, YLLCORNER, "
    "CELLSIZE)",
    (".grc",): "classes of Vertical Mapper, without levels: export a .grd, which gdal_translate "
    "FROM.grd TO.tif converts",
    (".xyz", ".txt", ".csv", ".tab"): "points as text are no rasters: gdal_translate FROM.xyz "
    "TO.tif converts east, north and value of all pixels in rows; else name them as "
    "prediction.survey.files",
}
"""By suffix what else lies in folders of exports, and how it becomes a raster."""
_GRIDS = (".grd", ".img", ".vrt")
"""Other rasters that GDAL reads as they are."""
_MOST_FILES = 100_000
_FEW_FILES = 3
"""Files with the same fault are reported one by one; of more the first ones are named."""


def open_rasters(
    path: Path | str,
    quantity: Quantity | None = None,
    *,
    crs: str | None = None,
    factor: float = 1.0,
    nodata: float | None = None,
    resolution_m: float | None = None,
    resampling: Resampling = "nearest",
) -> RxLevRasters:
    """Open a set of rasters, and check it without reading pixels.

    Parameters
    ----------
    path : Path or str
        A GeoTIFF (COG) whose bands are described by cell ids; an ESRI ASCII grid (``.asc``) or raw
        pixels with a header (``.bil``, ``.flt`` with ``.hdr``), named by the cell id; a folder of
        such files; or an index of raw pixels (see :mod:`mapfilter.rasters.atoll`), or its folder.
    quantity : {"level", "loss", "deviation"}, optional
        What the files hold, where neither mapfilter's tag nor their unit states it.
    crs : str, optional
        Projected CRS, where the files have none.
    factor : float
        dB (dBm) per unit stored, such as 0.0625 for sixteenths.
    nodata : float, optional
        A stored number that means no data, besides the files' own.
    resolution_m : float, optional
        Of the lattice that all files are read on; the finest of them when left out.
    resampling : {"nearest", "bilinear"}
        Method for files on another lattice; bilinear in dB.

    Raises
    ------
    InputError
        With every fault: missing, empty or cut-off file, no CRS or degrees, rotated, oblong or
        upside-down pixels, bands without or with the same cell id, unknown quantity, files of
        different systems, an index that does not fit its files.
    ConfigError
        The path is none, or another argument is of another type.
    """
    check_arguments(
        "open_rasters",
        path_argument("path", path, ARRAYS),
        keywords=[
            Setting("quantity", quantity, Quantity | None),
            Setting("crs", crs, str | None),
            Argument("factor", factor, Real, "a number"),
            Argument("nodata", nodata, Real | None, "a number"),
            Argument("resolution_m", resolution_m, Real | None, "metres"),
            Setting("resampling", resampling, Resampling),
        ],
    )
    path = Path(path)
    _check_options(crs, factor, nodata, resolution_m)
    crs = projected_crs(crs, "rasters, crs") if crs is not None else None
    declared = Declared(crs, nodata, float(factor))
    index = index_of(path)
    if index == path:
        check_file(path)
    sources: list[tuple[Path, IndexRow | None]] = [(path, None)]
    if index is not None:
        sources = [(row.path, row) for row in read_index(index)]
    elif path.is_dir():
        sources = [(file, None) for file in _listed(path)]
    faults, notes, files = Faults(), list[str](), list[RasterFile]()
    wrong: list[tuple[Path, Fault]] = []
    for source, row in sources:
        try:
            files.append(_open(source, declared, row, notes))
        except InputError as error:
            wrong += [(source, fault) for fault in error.faults]
    faults.found.extend(_shared(path, wrong, len(sources)))
    faults.raise_if_any(InputError)
    files = _named_by_file(files, notes)
    _check_ids(path, files)
    held = _one_quantity(path, files, quantity)
    lattice, resampled = common_lattice(files, resolution_m, resampling)
    parts = [part for file in files for part in file.parts]
    counted = (
        note if count == 1 else f"{note} ({count} rasters)"
        for note, count in Counter(notes).items()
    )
    return RxLevRasters(
        path,
        tuple(cell_id for file in files for cell_id in file.cell_ids),
        lattice,
        held,
        tuple(files),
        tuple(dict.fromkeys(parts if index is None else [*parts, index])),
        float(factor),
        resampling,
        (*counted, *resampled),
    )


def is_raster_folder(path: Path) -> bool:
    """Return whether a folder holds rasters, or an index of them."""
    return path.is_dir() and any(_is_raster(one) or is_index(one) for one in path.iterdir())


def _check_options(
    crs: str | None, factor: float, nodata: float | None, resolution_m: float | None
) -> None:
    faults = Faults()
    if crs is not None and not crs.strip():
        faults.add("rasters, crs", "a projected CRS in metres", "an empty text")
    if not (math.isfinite(factor) and factor != 0):
        faults.add("rasters, factor", "a number other than 0", factor)
    if nodata is not None and math.isnan(nodata):
        faults.add("rasters, nodata", "a number", nodata, "NaN means no data anyway")
    if resolution_m is not None and not (math.isfinite(resolution_m) and resolution_m > 0):
        faults.add("rasters, resolution_m", "metres > 0", resolution_m)
    faults.raise_if_any(InputError)


def _is_raster(path: Path) -> bool:
    hidden = path.name.startswith(".")
    return not hidden and path.suffix.lower() in FORMATS and path.is_file()


def _listed(folder: Path) -> list[Path]:
    found = sorted(path for path in folder.iterdir() if _is_raster(path))
    if not found:
        expected = f"raster files ({', '.join(FORMATS)}) or an index of them"
        others = sorted(path.name for path in folder.iterdir() if path.is_file())
        hint = _how_to_convert(others)
        if inside := sorted(one.name for one in folder.iterdir() if is_raster_folder(one)):
            hint = f"they are in folders in it ({listed(inside)}): name one, or move all into one, "
            hint += "as for the carriers of a network"
        raise fail(InputError, str(folder), expected, "none in this folder", hint)
    if len(found) > _MOST_FILES:
        raise fail(InputError, str(folder), f"at most {_MOST_FILES} rasters", len(found))
    return found


def _how_to_convert(names: Sequence[str]) -> str:
    """Return how files of other formats become rasters that are read; "" without any."""
    by_suffix = {Path(name).suffix.lower(): name for name in reversed(names)}
    # Headers and texts lie beside grids, which alone are converted.
    if grid := next((by_suffix[one] for one in _GRIDS if one in by_suffix), ""):
        names, by_suffix = [grid], {}
    for suffixes, hint in _OTHER_FORMATS.items():
        if found := next((by_suffix[one] for one in suffixes if one in by_suffix), ""):
            return f"{found}: {hint}"
    return f"gdal_translate FROM TO.tif converts others, such as {names[0]}" if names else ""


def _open(path: Path, declared: Declared, row: IndexRow | None, notes: list[str]) -> RasterFile:
    """Open one file, and compare it with its row of an index."""
    check_file(path)
    opener = FORMATS.get(path.suffix.lower(), open_geotiff if row is None else open_raw_grid)
    if row is None:
        return opener(path, path.stem, declared)
    file = opener(path, row.cell_id, replace(declared, header=row.header()))
    if len(file.cell_ids) > 1:
        got = f"{len(file.cell_ids)} bands"
        raise fail(InputError, str(path), "one band per file of an index", got)
    faults = Faults()
    if note := row.check(file.lattice, file.bits, faults):
        notes.append(note)
    faults.raise_if_any(InputError)
    return replace(file, cell_ids=(row.cell_id,), described=False)


def _shared(path: Path, wrong: Sequence[tuple[Path, Fault]], count: int) -> Iterator[Fault]:
    """Yield the faults of files, each once that several files share.

    Parameters
    ----------
    path : Path
        The folder or index of the files.
    wrong : sequence of (Path, Fault)
        Each fault with its file.
    count : int
        Of all files.
    """
    alike: dict[tuple[str, str, str], list[tuple[Path, Fault]]] = {}
    for file, fault in wrong:
        part = fault.where.removeprefix(str(file))
        alike.setdefault((part, fault.expected, fault.hint), []).append((file, fault))
    for (part, _, _), found in alike.items():
        file, fault = found[0]
        if len(found) <= _FEW_FILES:
            yield from (one for _, one in found)
            continue
        names = listed([one.name for one, _ in found], _FEW_FILES)
        own = "" if len({one.got for _, one in found}) == 1 else f" in {file.name}"
        where = f"{path}, {len(found)} of {count} rasters ({names}){part}"
        yield replace(fault, where=where, got=f"{fault.got}{own}")


def _named_by_file(files: list[RasterFile], notes: list[str]) -> list[RasterFile]:
    """Name cells by their files where all descriptions are the same, such as "Band 1"."""
    single = [file for file in files if file.described and len(file.cell_ids) == 1]
    if len(single) < 2 or len({file.cell_ids for file in single}) > 1:
        return files
    notes.append(f"cells are named by their files: all bands are called {single[0].cell_ids[0]!r}")
    return [replace(file, cell_ids=(file.path.stem,)) if file in single else file for file in files]


def _check_ids(path: Path, files: Sequence[RasterFile]) -> None:
    faults, first = Faults(), dict[str, Path]()
    for file in files:
        for cell_id in file.cell_ids:
            if wrong := id_fault(cell_id):
                faults.add(f"{file.path}, name", *wrong)
            if cell_id in first and first[cell_id] != file.path:
                got = f"{cell_id!r} in {first[cell_id].name} and {file.path.name}"
                faults.add(str(path), "each cell once", got)
            first.setdefault(cell_id, file.path)
    faults.raise_if_any(InputError)


def _one_quantity(path: Path, files: Sequence[RasterFile], declared: Quantity | None) -> Quantity:
    if declared is not None:
        for file in files:
            if file.tagged and file.quantity != declared:
                expected, got = f"{declared}, as declared", file.quantity
                hint = "quantity in [rasters] is of other rasters"
                raise fail(InputError, str(file.path), expected, got, hint)
        return declared
    stated = {file.quantity for file in files}
    known = stated - {None}
    if len(known) > 1:
        both = " and ".join(sorted(str(quantity) for quantity in known))
        raise fail(InputError, str(path), "levels or losses in all files", both)
    found = known.pop() if known and None not in stated else None
    if found is None:
        expected = "a quantity of the bands, levels (dBm) or losses (dB)"
        hint = "set quantity = level or loss"
        raise fail(InputError, str(path), expected, "neither tag nor unit", hint)
    return found
