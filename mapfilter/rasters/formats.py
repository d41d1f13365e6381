"""Which files make a set of rasters, and how each format is opened."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from mapfilter.errors import Faults, InputError, fail
from mapfilter.radio.cell_rules import id_fault
from mapfilter.rasters.atoll import INDEX_SUFFIXES, IndexRow, find_index, read_index
from mapfilter.rasters.files import Declared, Quantity, RasterFile, check_file
from mapfilter.rasters.geotiff import open_geotiff
from mapfilter.rasters.plain_grids import open_ascii_grid, open_raw_grid

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


class FoundRasters(NamedTuple):
    """The files of a set, the quantity they hold, the index that lists them, and remarks."""

    files: tuple[RasterFile, ...]
    quantity: Quantity
    index_file: Path | None
    notes: tuple[str, ...]


def is_raster_folder(path: Path) -> bool:
    """Return whether a folder holds rasters."""
    return path.is_dir() and any(_is_raster(inner) for inner in path.iterdir())


def open_files(path: Path, declared: Declared) -> FoundRasters:
    """Open a raster file, a folder of them or an index, without reading pixels."""
    index = find_index(path) if path.is_dir() else None
    if path.suffix.lower() in INDEX_SUFFIXES and not path.is_dir():
        check_file(path)
        index = path
    notes: list[str] = []
    faults = Faults()
    files: list[RasterFile] = []
    sources: list[tuple[Path, IndexRow | None]] = [(path, None)]
    if index is not None:
        sources = [(row.path, row) for row in read_index(index)]
    elif path.is_dir():
        sources = [(file, None) for file in _listed(path)]
    for file, row in sources:
        try:
            files.append(_open(file, declared, row, notes))
        except InputError as error:
            faults.found.extend(error.faults)
    faults.raise_if_any(InputError)
    files = _named_by_file(files, notes)
    _check_ids(path, files)
    counted = tuple(
        note if count == 1 else f"{note} ({count} rasters)"
        for note, count in Counter(notes).items()
    )
    return FoundRasters(tuple(files), _one_quantity(path, files, declared.quantity), index, counted)


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
