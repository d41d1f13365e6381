"""RxLev rasters: levels or losses of many cells, read by window and never all at once.

A set of rasters is one GeoTIFF with a band per cell, a folder with a file per cell, or a planning
tool's export with its index; :func:`open_rasters` makes all of them look alike.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from mapfilter._io import sha256_file
from mapfilter._types import Floats, Floats32
from mapfilter.errors import Faults, InputError, fail, listed
from mapfilter.geodesy import Lattice, projected_crs
from mapfilter.radio.cells import CellPlan
from mapfilter.rasters.files import Declared, Quantity, RasterFile, Window, check_plausible
from mapfilter.rasters.formats import open_files
from mapfilter.rasters.resampling import Resampling, common_lattice, read_on

_LARGEST_READ_BYTES = 4 << 30


@dataclass(frozen=True, repr=False)
class RxLevRasters:
    """Which cells a set of rasters holds and where; the values stay in the files until read.

    Parameters
    ----------
    path : Path
        The file, the folder or the index.
    cell_ids : tuple of str
        In the order of the files and their bands.
    lattice : Lattice
        Where the pixels lie, or are put by resampling.
    quantity : {"level", "loss", "deviation"}
        Received level (dBm), path loss (dB) that is to be taken from a cell's EIRP, or how far off
        levels may be (dB, one standard deviation).
    files : tuple of RasterFile
        Where the values are.
    parts : tuple of Path
        All files that the set is made of, with headers, CRS files and the index.
    factor : float
        dB (dBm) per unit stored in the files.
    resampling : {"nearest", "bilinear"}
        How files on another lattice are read.
    notes : tuple of str
        What was done to the files: resampled, put on one extent, named by their file.
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
        if self.quantity == "deviation":
            hint = "the deviations of a survey given for its levels"
            raise fail(InputError, str(self.path), "levels or losses", "deviations", hint)
        values = self.read(window, cells)
        if self.quantity == "level":
            return values
        ids = self.cell_ids if cells is None else cells
        eirp_dbm = np.array([plan[cell_id].eirp_dbm for cell_id in ids], dtype=np.float32)
        return eirp_dbm[:, None, None] - values

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
        How files on another lattice are read; bilinear in dB.

    Raises
    ------
    InputError
        With every fault: missing, empty or cut-off file, no CRS or degrees, rotated, oblong or
        upside-down pixels, bands without or with the same cell id, unknown quantity, files of
        different systems, an index that does not fit its files.
    """
    path = Path(path)
    _check_options(crs, factor, nodata, resolution_m)
    system = projected_crs(crs) if crs is not None else None
    found = open_files(path, Declared(quantity, system, nodata))
    lattice, notes = common_lattice(found.files, resolution_m, resampling)
    index = () if found.index_file is None else (found.index_file,)
    return RxLevRasters(
        path,
        tuple(cell_id for file in found.files for cell_id in file.cell_ids),
        lattice,
        found.quantity,
        found.files,
        tuple(dict.fromkeys(part for file in found.files for part in file.parts)) + index,
        float(factor),
        resampling,
        (*found.notes, *notes),
    )


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
