"""RxLev rasters: levels or losses of many cells, read by window and never all at once.

:func:`~mapfilter.rasters.opening.open_rasters` opens a set of them, and
:func:`~mapfilter.rasters.geotiff_writer.write_rasters` writes one of arrays.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from mapfilter._io import sha256_file
from mapfilter._types import Floats, Floats32
from mapfilter.errors import Faults, InputError, fail, listed
from mapfilter.lattice import Lattice
from mapfilter.radio.cells import CellPlan
from mapfilter.rasters.files import (
    Quantity,
    RasterFile,
    Window,
    check_plausible,
)
from mapfilter.rasters.resampling import Resampling, read_on

_LARGEST_READ_BYTES = 4 << 30
_TRIED = 3
ARRAYS = (
    (np.ndarray | Mapping, "arrays; write_rasters writes them to a file, which open_rasters opens"),
)
"""What is given for rasters, and what to do with it."""


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

    @property
    def crs(self) -> str:
        """CRS of the lattice."""
        return self.lattice.crs

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
            check_plausible(found, self.quantity, file.path, self.factor)
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


def in_other_case(unknown: Sequence[str], missing: Sequence[str]) -> str:
    """Return that names of rasters are ids without one but for the case, or "".

    Examples
    --------
    >>> in_other_case(["s1a", "x"], ["S1A", "S1B"])
    "names differ in upper and lower case only: raster 's1a', cell 'S1A'"
    """
    ids = {cell_id.casefold(): cell_id for cell_id in missing}
    alike = [(name, ids[name.casefold()]) for name in unknown if name.casefold() in ids]
    if not alike:
        return ""
    (name, cell_id), more = alike[0], len(alike) - 1
    others = f" and {more} more" if more else ""
    return f"names differ in upper and lower case only: raster {name!r}, cell {cell_id!r}{others}"


def switched_off(unknown: Sequence[str], plan: CellPlan) -> str:
    """Return which rasters without a cell are of cells that the plan switches off, or "".

    Examples
    --------
    >>> switched_off(["S1B", "X"], CellPlan("EPSG:32635", (), inactive=("S1B", "S1C")))
    'the plan has S1B, but switched off: switch it on, or take its raster out'
    """
    off = [name for name in unknown if name in plan.inactive]
    if not off:
        return ""
    them, its = ("it", "its raster") if len(off) == 1 else ("them", "their rasters")
    return f"the plan has {listed(off)}, but switched off: switch {them} on, or take {its} out"


def _several_of_one(unknown: Sequence[str], missing: Sequence[str]) -> str:
    """Return that several rasters have the name of one cell in theirs, or ""."""
    for cell_id in missing[:_TRIED]:
        several = [name for name in unknown if cell_id in name]
        if len(several) > 1 and len(unknown) >= 2 * len(missing):
            some = " and ".join(map(repr, several[:2]))
            return (
                f"several rasters of cell {cell_id!r}, such as {some}; join tiles of an area "
                "(gdal_merge.py), and leave one raster for each cell"
            )
    return ""


def check_against_plan(rasters: RxLevRasters, plan: CellPlan) -> None:
    """Check that rasters and plan hold the same cells."""
    faults, held = Faults(), set(rasters.cell_ids)
    unknown = [cell_id for cell_id in rasters.cell_ids if cell_id not in plan]
    missing = [cell_id for cell_id in plan.ids if cell_id not in held]
    hint = switched_off(unknown, plan)
    hint = hint or in_other_case(unknown, missing) or _several_of_one(unknown, missing)
    if not missing:
        hint = hint or "cells left out of the plan, or rasters of terrain or clutter: move these"
    hint = hint or "rasters and plan of different dates or places"
    if unknown:
        got = listed([repr(one) for one in unknown])
        faults.add(str(rasters.path), "cells of the plan only", got, hint)
    if missing:
        got = f"no band for {listed([repr(one) for one in missing])}"
        faults.add(str(rasters.path), "a band for each cell of the plan", got, hint)
    faults.raise_if_any(InputError)
