"""Which files make a set of rasters, and what each of them is."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from mapfilter.errors import Faults, InputError, fail
from mapfilter.radio.cell_rules import id_fault
from mapfilter.rasters.atoll import IndexRow, find_index, read_index
from mapfilter.rasters.files import Quantity, RasterFile, check_file
from mapfilter.rasters.geotiff import GeoTiff, open_geotiff
from mapfilter.rasters.plain_grids import Bil, open_ascii_grid, open_bil

SUFFIXES = (".tif", ".tiff", ".asc", ".bil", ".flt")
"""Of the files that are taken from a folder."""
_INDEX_SUFFIXES = (".csv", ".txt")
_MOST_FILES = 100_000

Opened = tuple[RasterFile, Quantity | None]


@dataclass(frozen=True, slots=True)
class Declared:
    """What a user says of files that do not say it themselves.

    Parameters
    ----------
    quantity : {"level", "loss", "deviation"} or None
    crs : str or None
        Projected CRS.
    nodata : float or None
        A number that means no data, besides those that the files tell.
    """

    quantity: Quantity | None = None
    crs: str | None = None
    nodata: float | None = None


@dataclass(frozen=True, slots=True)
class FoundRasters:
    """The files of a set, what they hold, and what is worth telling of them.

    Parameters
    ----------
    files : tuple of RasterFile
    quantity : {"level", "loss", "deviation"}
    index : Path or None
        The table that lists them.
    notes : tuple of str
    """

    files: tuple[RasterFile, ...]
    quantity: Quantity
    index: Path | None
    notes: tuple[str, ...]


def is_raster_folder(path: Path) -> bool:
    """Tell whether a folder holds rasters."""
    return path.is_dir() and any(_is_raster(inner) for inner in path.iterdir())


def open_files(path: Path, declared: Declared) -> FoundRasters:
    """Open a raster file, a folder of them or an index, without reading pixels.

    Raises
    ------
    InputError
        With every fault of every file.
    """
    index = find_index(path) if path.is_dir() else None
    if path.suffix.lower() in _INDEX_SUFFIXES and not path.is_dir():
        check_file(path)
        index = path
    notes: list[str] = []
    if index is not None:
        opened = _open_all(
            [_indexed(row, declared, notes) for row in read_index(index)],
        )
    elif path.is_dir():
        opened = _open_all([_alone(file, declared) for file in _listed(path)])
    else:
        opened = [_open(path, path.stem, declared)]
    opened = _named_by_file(opened, notes)
    files = tuple(file for file, _ in opened)
    _check_ids(path, files)
    quantity = _one_quantity(path, opened, declared.quantity)
    told = tuple(
        note if count == 1 else f"{note} ({count} rasters)"
        for note, count in Counter(notes).items()
    )
    return FoundRasters(files, quantity, index, told)


def _is_raster(path: Path) -> bool:
    hidden = path.name.startswith(".")
    return not hidden and path.suffix.lower() in SUFFIXES and path.is_file()


def _listed(folder: Path) -> list[Path]:
    found = sorted(path for path in folder.iterdir() if _is_raster(path))
    if not found:
        expected = f"raster files ({', '.join(SUFFIXES)}) or an index of them"
        raise fail(InputError, str(folder), expected, "none in this folder")
    if len(found) > _MOST_FILES:
        raise fail(InputError, str(folder), f"at most {_MOST_FILES} rasters", len(found))
    return found


def _open(path: Path, cell_id: str, declared: Declared, index: IndexRow | None = None) -> Opened:
    if path.suffix.lower() == ".asc":
        check_file(path)
        return open_ascii_grid(path, cell_id, declared.crs, declared.nodata), None
    if path.suffix.lower() in (".bil", ".flt") or (index and path.suffix.lower() not in SUFFIXES):
        check_file(path)
        instead = index.header() if index else None
        return open_bil(path, cell_id, declared.crs, declared.nodata, instead=instead), None
    return open_geotiff(path, declared.crs, declared.nodata)


def _alone(path: Path, declared: Declared) -> Callable[[], Opened]:
    return lambda: _open(path, path.stem, declared)


def _indexed(row: IndexRow, declared: Declared, notes: list[str]) -> Callable[[], Opened]:
    def opened() -> Opened:
        file, quantity = _open(row.path, row.cell_id, declared, row)
        if isinstance(file, GeoTiff):
            if len(file.cell_ids) > 1:
                got = f"{len(file.cell_ids)} bands"
                raise fail(InputError, str(row.path), "one band per file of an index", got)
            file = replace(file, cell_ids=(row.cell_id,))
        faults = Faults()
        note = row.check(file.lattice, file.bits if isinstance(file, Bil) else None, faults)
        faults.raise_if_any(InputError)
        if note:
            notes.append(note)
        return file, quantity

    return opened


def _open_all(openers: Sequence[Callable[[], Opened]]) -> list[Opened]:
    opened, faults = [], Faults()
    for opener in openers:
        try:
            opened.append(opener())
        except InputError as error:
            faults.found.extend(error.faults)
    faults.raise_if_any(InputError)
    return opened


def _named_by_file(opened: list[Opened], notes: list[str]) -> list[Opened]:
    """Name cells by their files where all descriptions are the same, such as "Band 1"."""
    single = [file for file, _ in opened if isinstance(file, GeoTiff) and len(file.cell_ids) == 1]
    if len(single) < 2 or len({file.cell_ids for file in single}) > 1:
        return opened
    notes.append(f"cells are named by their files: all bands are called {single[0].cell_ids[0]!r}")
    return [
        (replace(file, cell_ids=(file.path.stem,)), quantity)
        if isinstance(file, GeoTiff) and len(file.cell_ids) == 1
        else (file, quantity)
        for file, quantity in opened
    ]


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


def _one_quantity(path: Path, opened: Sequence[Opened], declared: Quantity | None) -> Quantity:
    told = {quantity for _, quantity in opened}
    if declared is not None:
        for file, quantity in opened:
            if isinstance(file, GeoTiff) and file.tagged and quantity != declared:
                hint = "quantity in [rasters] is of other rasters"
                raise fail(InputError, str(file.path), f"{declared}, as declared", quantity, hint)
        return declared
    known = told - {None}
    if len(known) > 1:
        got = " and ".join(sorted(str(quantity) for quantity in known))
        raise fail(InputError, str(path), "levels or losses in all files", got)
    found = known.pop() if known and None not in told else None
    if found is None:
        expected = "to know whether the bands are levels (dBm) or losses (dB)"
        hint = "say quantity = level or loss"
        raise fail(InputError, str(path), expected, "neither tag nor unit", hint)
    return found
