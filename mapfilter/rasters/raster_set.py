"""RxLev rasters: levels or losses of many cells, read by window and never all at once.

A set of rasters is one GeoTIFF with a band per cell, a folder with a file per cell, or a planning
tool's export with its index; :func:`open_rasters` makes all of them look alike.
"""

from __future__ import annotations

import hashlib
import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from mapfilter._io import sha256_file
from mapfilter._types import Floats, Floats32
from mapfilter.errors import Faults, InputError, fail, listed
from mapfilter.geodesy import Lattice, projected_crs
from mapfilter.radio.cell_rules import id_fault
from mapfilter.radio.cells import CellPlan
from mapfilter.rasters.ascii_grids import open_ascii_grid
from mapfilter.rasters.atoll import INDEX_SUFFIXES, IndexRow, find_index, read_index
from mapfilter.rasters.files import (
    Declared,
    Quantity,
    RasterFile,
    Window,
    check_file,
    check_plausible,
)
from mapfilter.rasters.geotiff import open_geotiff
from mapfilter.rasters.raw_grids import open_raw_grid
from mapfilter.rasters.resampling import Resampling, common_lattice, read_on

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
_MOST_FILES = 100_000
_LARGEST_READ_BYTES = 4 << 30


@dataclass(frozen=True, repr=False)
class RxLevRasters:
    """Cells and lattice of a set of rasters, whose values stay in the files until they are read.

    Parameters
    ----------
    path : Path
        The file, the folder or the index.
    cell_ids : tuple of str
        In the order of the files and their bands.
    lattice : Lattice
        Lattice of the pixels, resampled where files differ from it.
    quantity : {"level", "loss", "deviation"}
        Received level (dBm), path loss (dB) that is to be taken from a cell's EIRP, or how far off
        levels may be (dB, one standard deviation).
    files : tuple of RasterFile
        Files that hold the values.
    parts : tuple of Path
        All files that the set is made of, with headers, CRS files and the index.
    factor : float
        dB (dBm) per unit stored in the files.
    resampling : {"nearest", "bilinear"}
        Method for files on another lattice.
    notes : tuple of str
        Changes made in reading: resampled, put on one extent, named by their file.
    """

    path: Path
    cell_ids: tuple[str, ...]
    lattice: Lattice
    quantity: Quantity
    files: tuple[RasterFile, ...]
    parts: tuple[Path, ...]
    factor: float = 1.0
    resampling: Resampling = "nearest"
    notes: tuple[str, ...] = ()

    def __repr__(self) -> str:
        """Return name, number of cells, size and place in one line."""
        held = f"{self.quantity} of {len(self.cell_ids)} cells"
        return f"<RxLevRasters {self.path.name}: {held}, {self.lattice}>"

    def sha256(self) -> str:
        """Return the checksum of the file, or one of the names and checksums of all files."""
        if self.parts == (self.path,):
            return sha256_file(self.path)
        folder = self.path if self.path.is_dir() else self.path.parent
        lines = [
            f"{part.relative_to(folder).as_posix()} {sha256_file(part)}\n" for part in self.parts
        ]
        return hashlib.sha256("".join(lines).encode()).hexdigest()

    @cached_property
    def _reach_m(self) -> Floats:
        """West, south, east and north of what each file has data for, shape (files, 4)."""
        bounds_m = np.array([file.lattice.bounds_m for file in self.files])
        # Half a pixel may be rounded away, where a file is put on the lattice.
        own_m = np.array([file.lattice.resolution_m for file in self.files])
        pad_m = np.maximum(own_m, self.lattice.resolution_m)
        return np.asarray(bounds_m + pad_m[:, None] * [-1, -1, 1, 1])

    def reaching(self, window: Window) -> RxLevRasters:
        """Return the set of the files, possibly none, that have pixels in a window."""
        west, south, east, north = self.lattice.window(*window).bounds_m
        low, high = np.split(self._reach_m, 2, axis=1)
        there = (low < (east, north)).all(axis=1) & (high > (west, south)).all(axis=1)
        if there.all():
            return self
        files = tuple(self.files[n] for n in np.flatnonzero(there).tolist())
        ids = tuple(cell_id for file in files for cell_id in file.cell_ids)
        parts = tuple(part for file in files for part in file.parts)
        return replace(self, files=files, cell_ids=ids, parts=parts)

    def read(self, window: Window | None = None, cells: Sequence[str] | None = None) -> Floats32:
        """Read values of some or all cells in a window, or everywhere.

        Parameters
        ----------
        window : (row, col, rows, cols), optional
            Must lie on the lattice.
        cells : sequence of str, optional
            Cell ids in the order wanted; all cells in their own order when left out.

        Returns
        -------
        ndarray of float32, shape (cells, rows, cols)
            dBm or dB, by ``quantity``; NaN where there is no data.

        Raises
        ------
        InputError
            The window or a cell is not in the set, a file is cut off, or the values are not
            plausible for ``quantity``.
        """
        window = window or (0, 0, self.lattice.rows, self.lattice.cols)
        ids = self.cell_ids if cells is None else tuple(cells)
        self._check_request(window, ids)
        of_cell = {
            cell_id: (file, band)
            for file in self.files
            for band, cell_id in enumerate(file.cell_ids)
        }
        # By file: the places of its cells among those wanted, and their bands.
        wanted: dict[Path, tuple[RasterFile, list[int], list[int]]] = {}
        for place, cell_id in enumerate(ids):
            file, band = of_cell[cell_id]
            _, places, bands = wanted.setdefault(file.path, (file, [], []))
            places.append(place)
            bands.append(band)
        values = np.empty((len(ids), *window[2:]), dtype=np.float32)
        for file, places, bands in wanted.values():
            found = read_on(file, bands, self.lattice, window, self.resampling)
            if self.factor != 1.0:
                found = found * np.float32(self.factor)
            check_plausible(found, self.quantity, file.path)
            if len(wanted) == 1:
                return found
            values[places] = found
        return values

    def read_levels_dbm(
        self,
        plan: CellPlan,
        window: Window | None = None,
        cells: Sequence[str] | None = None,
    ) -> Floats32:
        """Read as :meth:`read`, but always levels (dBm): losses are taken from the cells' EIRP.

        Raises
        ------
        InputError
            As :meth:`read`, or the plan lacks a cell, or the files hold deviations.
        """
        self.check_holds_levels()
        ids = self.cell_ids if cells is None else tuple(cells)
        return self.levels_dbm(self.read(window, ids), plan, ids)

    def check_holds_levels(self) -> None:
        """Raise InputError where the files hold deviations."""
        if self.quantity == "deviation":
            hint = "the deviations of a survey given for its levels"
            raise fail(InputError, str(self.path), "levels or losses", "deviations", hint)

    def levels_dbm(self, values: Floats32, plan: CellPlan, cells: Sequence[str]) -> Floats32:
        """Return levels (dBm) for values of the files, the first axis being that of the cells."""
        if self.quantity == "level":
            return values
        eirp_dbm = np.array([plan[cell_id].eirp_dbm for cell_id in cells], dtype=np.float32)
        return eirp_dbm.reshape(-1, *[1] * (values.ndim - 1)) - values

    def _check_request(self, window: Window, ids: tuple[str, ...]) -> None:
        row, col, rows, cols = window
        faults = Faults()
        size = (self.lattice.rows, self.lattice.cols)
        if min(row, col) < 0 or min(rows, cols) < 1 or row + rows > size[0] or col + cols > size[1]:
            got = f"row {row}, col {col}, {rows} x {cols}"
            faults.add(f"{self.path} window", f"a window on {size[0]} x {size[1]} pixels", got)
        elif rows * cols * len(ids) * 4 > _LARGEST_READ_BYTES:
            got = f"{rows} x {cols} x {len(ids)} cells"
            faults.add(f"{self.path} window", "at most 4 GiB at a time", got, "read it by windows")
        known = set(self.cell_ids)
        for cell_id in ids:
            if cell_id not in known:
                faults.add(str(self.path), "a cell of the rasters", repr(cell_id))
        faults.raise_if_any(InputError)


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
    """
    path = Path(path)
    _check_options(crs, factor, nodata, resolution_m)
    declared = Declared(projected_crs(crs) if crs is not None else None, nodata)
    index = find_index(path) if path.is_dir() else None
    if path.suffix.lower() in INDEX_SUFFIXES and not path.is_dir():
        check_file(path)
        index = path
    sources: list[tuple[Path, IndexRow | None]] = [(path, None)]
    if index is not None:
        sources = [(row.path, row) for row in read_index(index)]
    elif path.is_dir():
        sources = [(file, None) for file in _listed(path)]
    faults, notes, files = Faults(), list[str](), list[RasterFile]()
    for source, row in sources:
        try:
            files.append(_open(source, declared, row, notes))
        except InputError as error:
            faults.found.extend(error.faults)
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
    """Return whether a folder holds rasters."""
    return path.is_dir() and any(_is_raster(inner) for inner in path.iterdir())


def check_against_plan(rasters: RxLevRasters, plan: CellPlan) -> None:
    """Check that rasters and plan hold the same cells."""
    faults, held = Faults(), set(rasters.cell_ids)
    unknown = [repr(cell_id) for cell_id in rasters.cell_ids if cell_id not in plan]
    missing = [repr(cell_id) for cell_id in plan.ids if cell_id not in held]
    hint = "rasters and plan of different dates or places"
    if unknown:
        faults.add(str(rasters.path), "cells of the plan only", listed(unknown), hint)
    if missing:
        got = f"no band for {listed(missing)}"
        faults.add(str(rasters.path), "a band for each cell of the plan", got, hint)
    faults.raise_if_any(InputError)


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
        raise fail(InputError, str(folder), expected, "none in this folder")
    if len(found) > _MOST_FILES:
        raise fail(InputError, str(folder), f"at most {_MOST_FILES} rasters", len(found))
    return found


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
