"""Exports of a planning tool: one raw raster per transmitter, and a table that lists them.

The table (``.csv`` or ``.txt``) has a column ``TX_NAME`` with the cell's id and ``FILE_NAME`` with
the raster; ``RESOLUTION``, ``AREA_XMIN``, ``AREA_XMAX``, ``AREA_YMIN``, ``AREA_YMAX`` and ``NBITS``
are compared with the raster's own header, and replace it where there is none. The area's limits
are outer *edges* of pixels, ``ULXMAP`` and ``ULYMAP`` of a header are a pixel's *centre*: taking
one for the other shifts everything by half a pixel.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

import numpy as np

from mapfilter._inputs import open_input, wide_encoding
from mapfilter._separator_line import without_separator_line
from mapfilter.errors import Faults, InputError, fail
from mapfilter.lattice import Lattice
from mapfilter.radio.cell_rules import id_fault
from mapfilter.radio.tables import Table, read_table
from mapfilter.rasters.planet import BITS, HEADER, PlanetLine, Unreadable, planet_lines

INDEX_COLUMNS = ("TX_NAME", "FILE_NAME")
"""Columns that make a table an index of rasters."""
_AREA = ("AREA_XMIN", "AREA_XMAX", "AREA_YMIN", "AREA_YMAX")
_NUMBERS = ("RESOLUTION", "NBITS", *_AREA)
INDEX_SUFFIXES = (".csv", ".txt")
_LONGEST_HEAD_BYTES = 1 << 16
_SAME_PX = 0.01


@dataclass(frozen=True, slots=True)
class IndexRow:
    """A row of an index: ``where`` it is, its cell and raster, and the raster's size and place.

    ``area_m`` are the western, southern, eastern and northern edges, and ``more`` what else a
    header would hold.
    """

    where: str
    cell_id: str
    path: Path
    resolution_m: float | None = None
    bits: float | None = None
    area_m: tuple[float, float, float, float] | None = None
    more: tuple[tuple[str, str], ...] = ()

    def header(self) -> tuple[str, dict[str, str]] | None:
        """Return the place and values of a header for a raster without one, if there is enough."""
        if self.area_m is None or self.resolution_m is None or self.bits is None:
            return None
        west, south, east, north = self.area_m
        values = {
            "NROWS": repr(round((north - south) / self.resolution_m, 6)),
            "NCOLS": repr(round((east - west) / self.resolution_m, 6)),
            "NBITS": repr(self.bits),
            "XDIM": repr(self.resolution_m),
            "YDIM": repr(self.resolution_m),
            "ULXMAP": repr(west + self.resolution_m / 2),
            "ULYMAP": repr(north - self.resolution_m / 2),
            **dict(self.more),
        }
        return self.where, values

    def check(self, lattice: Lattice, bits: int | None, faults: Faults) -> str:
        """Compare the row with a raster's own header; return a remark, and add to ``faults``."""
        side_m = lattice.resolution_m
        if self.resolution_m is not None and abs(self.resolution_m - side_m) > 1e-6 * side_m:
            got, hint = f"{side_m:g} in {self.path.name}", "index and rasters of different runs"
            faults.add(f"{self.where}, RESOLUTION", f"{self.resolution_m:g}", got, hint)
            return ""
        if self.bits is not None and bits is not None and self.bits != bits:
            got = f"{bits} in the header of {self.path.name}"
            faults.add(f"{self.where}, NBITS", f"{self.bits:g}", got, "one of them is wrong")
        if self.area_m is None:
            return ""
        off_px = (np.array(self.area_m) - lattice.bounds_m) / side_m
        west, south = off_px[:2]
        if np.abs(off_px).max() <= _SAME_PX:
            return ""
        if np.abs(off_px - [0.5, 0.5, -0.5, -0.5]).max() <= _SAME_PX:
            return "area limits are centres of pixels in the index"
        hint = "index and rasters of different runs"
        if np.abs(off_px[:2] - off_px[2:]).max() <= _SAME_PX:
            # Adding 0 turns -0.00 into +0.00.
            right, up = round(-west, 2) + 0.0, round(-south, 2) + 0.0
            got = f"{self.path.name} shifted by {right:+.2f} pixels east, {up:+.2f} north"
            if all(min(abs(px), abs(abs(px) - 0.5)) <= _SAME_PX for px in (west, south)):
                hint = "half a pixel: a corner where the header has to hold the pixel's centre"
            faults.add(f"{self.where}, area", "the area of the raster's header", got, hint)
        elif min(*off_px[:2], *-off_px[2:]) < -_SAME_PX:
            expected = ", ".join(f"{value:g}" for value in self.area_m)
            got = ", ".join(f"{value:g}" for value in lattice.bounds_m)
            faults.add(f"{self.where}, area", expected, f"{got} in {self.path.name}", hint)
        else:
            return "rasters reach beyond their areas in the index"
        return ""


def find_index(folder: Path) -> Path | None:
    """Return the index in a folder, or None; several are an error."""
    found = [path for path in sorted(folder.iterdir()) if is_index(path)]
    if len(found) > 1:
        names = ", ".join(path.name for path in found[:5])
        raise fail(InputError, str(folder), "one index of rasters", names, "name one of them")
    return found[0] if found else None


def index_of(path: Path) -> Path | None:
    """Return the index of a set of rasters: its path, or one in that folder; None without one."""
    if path.is_dir():
        return find_index(path)
    return path if path.suffix.lower() in INDEX_SUFFIXES else None


def read_index(path: Path) -> tuple[IndexRow, ...]:
    """Read an index of rasters, also one of Planet, which has no header.

    Raises
    ------
    InputError
        With every fault: columns missing, a name that leads out of the folder, a raster that is
        not there, numbers that cannot be read, an id given twice.
    """
    if not _is_listed(path) and (lines := planet_lines(path)):
        return _once_each(_of_planet(path, lines), "name", Faults())
    table = read_table(path, "an index of rasters")
    header = [name.strip('" ').upper() for name in table.header]
    faults = Faults()
    for name in INDEX_COLUMNS:
        if name not in header:
            faults.add(f"{path} header", f"a column {name}", "none", "no index of rasters")
    for name in sorted({name for name in header if name and header.count(name) > 1}):
        faults.add(f"{path} header", "each column once", name)
    faults.raise_if_any(InputError)
    if not table.rows:
        raise fail(InputError, str(path), "at least one raster", "a header without rows")
    names = {file.name.lower(): file.name for file in path.parent.iterdir()}
    rows = tuple(_rows(table, header, names, faults))
    return _once_each(rows, "TX_NAME", faults)


def _once_each(rows: tuple[IndexRow, ...], column: str, faults: Faults) -> tuple[IndexRow, ...]:
    """Return rows of which none has the cell of another one; raise the faults otherwise."""
    first: dict[str, str] = {}
    for row in rows:
        if row.cell_id in first:
            hint = "rows of several runs; keep one"
            got = f"{row.cell_id!r}, as in {first[row.cell_id]}"
            faults.add(f"{row.where}, {column}", "each cell once", got, hint)
        first.setdefault(row.cell_id, row.where)
    faults.raise_if_any(InputError)
    return rows


def _of_planet(path: Path, lines: Sequence[PlanetLine | Unreadable]) -> tuple[IndexRow, ...]:
    faults, rows = Faults(), list[IndexRow]()
    names = {file.name.lower(): file.name for file in path.parent.iterdir()}
    for one in lines:
        where = f"{path} row {one.line}"
        if isinstance(one, Unreadable):
            expected = "a file's name, west, east, south, north and side of a pixel"
            hint = "a number that is left out, or not written as 385000.5"
            faults.add(where, expected, repr(one.text[:80]), hint)
            continue
        file, cell_id = _within(path.parent, one.name, names), PurePosixPath(one.name).stem
        west, south, east, north = one.area_m
        if file is None:
            faults.add(f"{where}, name", *_absent(path.parent, one.name, names))
        elif wrong := id_fault(cell_id):
            faults.add(f"{where}, name", *wrong)
        elif not (west < east and south < north and one.resolution_m > 0):
            expected = "west < east, south < north, and the side of a pixel > 0"
            got = ", ".join(f"{value:g}" for value in (west, east, south, north, one.resolution_m))
            faults.add(f"{where}, area", expected, got, "another order of columns")
        else:
            more = IndexRow(where, cell_id, file, one.resolution_m, BITS, one.area_m, HEADER)
            rows.append(more)
    faults.raise_if_any(InputError)
    return tuple(rows)


def is_index(path: Path) -> bool:
    """Return whether a file is an index of rasters, of Atoll or Planet."""
    named = path.suffix.lower() in (*INDEX_SUFFIXES, "") and path.stem.lower() == "index"
    return _is_listed(path) or (named and path.is_file() and bool(planet_lines(path)))


def _is_listed(path: Path) -> bool:
    if path.suffix.lower() not in INDEX_SUFFIXES or path.name.startswith(".") or not path.is_file():
        return False
    try:
        with open_input(path) as stream:
            data = stream.read(_LONGEST_HEAD_BYTES)
    except (OSError, InputError):
        return False
    head = data.decode(wide_encoding(data) or "utf-8", errors="replace")
    lines = without_separator_line(head).upper().splitlines()
    first = next((line for line in lines if line.strip()), "")
    return all(name in first for name in INDEX_COLUMNS)


def _rows(
    table: Table, header: list[str], names: dict[str, str], faults: Faults
) -> Iterator[IndexRow]:
    for line, texts in table.whole_rows(len(header), faults):
        where = f"{table.path} row {line}"
        given = dict(zip(header, (text.strip() for text in texts), strict=True))
        if wrong := id_fault(given["TX_NAME"]):
            faults.add(f"{where}, TX_NAME", *wrong)
        path = _within(table.path.parent, given["FILE_NAME"], names)
        if path is None:
            faults.add(
                f"{where}, FILE_NAME", *_absent(table.path.parent, given["FILE_NAME"], names)
            )
        values: dict[str, float | None] = {}
        for name in _NUMBERS:
            values[name] = table.number(given[name]) if given.get(name) else None
            if given.get(name) and values[name] is None:
                faults.add(f"{where}, {name}", "a number", repr(given[name][:80]))
        west, east, south, north = (values[name] for name in _AREA)
        area = None
        if west is not None and east is not None and south is not None and north is not None:
            area = west, south, east, north
            if west >= east or south >= north:
                got = ", ".join(f"{value:g}" for value in (west, east, south, north))
                faults.add(f"{where}, area", "XMIN < XMAX and YMIN < YMAX", got, "swapped")
        side_m = values["RESOLUTION"]
        if side_m is not None and side_m <= 0:
            faults.add(f"{where}, RESOLUTION", "metres > 0", f"{side_m:g}")
        if path is not None and not wrong:
            yield IndexRow(where, given["TX_NAME"], path, side_m, values["NBITS"], area)


def _within(folder: Path, name: str, names: dict[str, str]) -> Path | None:
    """Return a file of the folder or below it; None for none, and for names that lead out of it."""
    path = _named(folder, name, names)
    try:
        # A name may be longer than the file system allows.
        held = path is not None and path.is_file() and _is_below(folder, path)
    except (OSError, ValueError):
        return None
    return path if held else None


def _absent(folder: Path, name: str, names: dict[str, str]) -> tuple[str, str, str]:
    """Return what was expected of a name that is none of the folder, what was found, and a hint."""
    got, hint = repr(name[:80]), "rasters moved elsewhere, or exported to another folder"
    own = re.split(r"[\\/]", name)[-1]
    if own != name and (beside := names.get(own.lower())):
        hint = f"a path of another computer; {beside} is beside the index: leave its name alone"
    if _leads_out(folder, name, names):
        got += ", a link out of the folder"
        hint = "rasters linked instead of copied; links out of the folder are not followed"
        hint += ", so that inputs reach no other files: copy them, or link the whole folder"
    return f"the name of a file in {folder}", got, hint


def _leads_out(folder: Path, name: str, names: dict[str, str]) -> bool:
    """Return whether a name of the folder is a link to what lies elsewhere."""
    path = _named(folder, name, names)
    try:
        return path is not None and path.is_symlink() and not _is_below(folder, path)
    except (OSError, ValueError):
        return False


def _is_below(folder: Path, path: Path) -> bool:
    return path.resolve().is_relative_to(folder.resolve())


def _named(folder: Path, name: str, names: dict[str, str]) -> Path | None:
    """Return what a name of an index means in its folder, be it there or not."""
    place = PurePosixPath(name.replace("\\", "/"))
    if not place.parts or place.is_absolute() or ".." in place.parts or ":" in name or "\0" in name:
        return None
    # Names from Windows ignore the case.
    own = place.name
    return folder / (names.get(own.lower(), own) if len(place.parts) == 1 else place)
