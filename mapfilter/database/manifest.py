"""The manifest of a database folder: what it must hold, and names that it gives to the parts."""

from __future__ import annotations

import hashlib
import re
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Annotated, Any, Literal
from urllib.parse import quote

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    FiniteFloat,
    ValidationError,
    model_validator,
)

from mapfilter._inputs import read_input
from mapfilter._io import sha256_file
from mapfilter._json_files import check_replaceable, check_seal, check_version, parse_json
from mapfilter.database.checked import BLOCK_BYTES, checksums
from mapfilter.database.checked import MANIFEST as MANIFEST
from mapfilter.errors import Fault, Faults, StoreError, fail

_LARGEST_BYTES = 1 << 30
FORMAT = "mapfilter radio-route database"
VERSION = 2
CELLS = "cells.parquet"
POINTS = "points.parquet"
READINGS = "readings.parquet"
DEVIATIONS = "deviations.parquet"
_SURVEYED = (READINGS, DEVIATIONS)

_Layers = Literal["map", "roads", "tracks", "buildings", "water", "landuse", "landuse_table"]
InputRole = _Layers | Literal["plan", "rasters", "database", "patch"]

_LONGEST_NAME = 200
_OWN = re.compile(r"(cells|points|readings|deviations)\.parquet|levels/[^/]+/part-[0-9]+\.parquet")
_DAMAGED = "edited or damaged"
_Count = Annotated[int, Field(ge=0)]
_Sha256 = Annotated[str, Field(pattern="^[0-9a-f]{64}$")]


@dataclass(frozen=True, slots=True)
class InputFile:
    """A file that a database was made from; ``name`` is without its folder."""

    role: InputRole
    name: str
    sha256: str

    @classmethod
    def of(cls, role: InputRole, path: Path) -> InputFile:
        """Return the record of a file."""
        return cls(role, path.name, sha256_file(path))


def _within(path: str) -> str:
    place = PurePosixPath(path)
    if place.is_absolute() or ".." in place.parts or "\0" in path:
        raise ValueError("a path within the folder")
    return path


class _Strict(BaseModel):
    model_config = ConfigDict(strict=True, frozen=True)


class _Lattice(_Strict):
    crs: str
    west_m: FiniteFloat
    north_m: FiniteFloat
    resolution_m: Annotated[FiniteFloat, Field(gt=0)]
    rows: Annotated[int, Field(ge=1)]
    cols: Annotated[int, Field(ge=1)]


class _Parameters(_Strict):
    margin_db: Annotated[FiniteFloat, Field(ge=0)]
    floor_dbm: FiniteFloat
    tile_px: Annotated[int, Field(ge=1)]


class _Input(_Strict):
    role: InputRole
    name: str
    sha256: str


class _Counts(_Strict):
    points: _Count
    points_below_floor: _Count | None
    points_off_rasters: _Count | None
    points_without_level: _Count | None = None


class _Part(_Strict):
    path: Annotated[str, AfterValidator(_within)]
    rows: _Count
    bytes: _Count
    sha256: _Sha256
    blocks: list[_Sha256] = []
    cell: str | None = None

    @model_validator(mode="after")
    def _blocks_of_all_bytes(self) -> _Part:
        count = -(-self.bytes // BLOCK_BYTES)
        if len(self.blocks) != (count if count > 1 else 0):
            raise ValueError(f"a checksum for each of {count} blocks")
        return self


class _Manifest(_Strict):
    software: str
    crs: str
    lattice: _Lattice
    cells: list[str]
    parameters: _Parameters
    attribution: str
    inputs: list[_Input]
    counts: _Counts
    parts: list[_Part]


def read_manifest(folder: Path) -> tuple[dict[str, Any], str]:
    """Read the manifest of a database folder, check all of it, and return it with its SHA-256.

    Raises
    ------
    StoreError
        It is missing, cut off, changed after it was written, of another version or format, or,
        with every fault, its fields are not what a build writes or contradict each other.
    """
    file = folder / MANIFEST
    data = read_input(file, _LARGEST_BYTES, "a manifest", StoreError)
    manifest = parse_json(data, str(file))
    if manifest.get("format") != FORMAT:
        raise fail(StoreError, str(file), f"format {FORMAT!r}", manifest.get("format"))
    check_version(str(file), manifest.get("version"), VERSION)
    check_seal(manifest, str(file))
    try:
        whole = _Manifest.model_validate(manifest)
    except ValidationError as error:
        raise StoreError(tuple(_fault(file, detail) for detail in error.errors())) from None
    faults = Faults()
    _check_together(whole, str(file), faults)
    faults.raise_if_any(StoreError)
    return manifest, hashlib.sha256(data).hexdigest()


def levels_folders(cell_ids: Iterable[str]) -> dict[str, str]:
    """Return each cell's folder within the database; no id leads out of it.

    Ids that differ only in case get folders that differ in more, as not every file
    system distinguishes them.

    Examples
    --------
    >>> list(levels_folders(["S1A", "../x", "12.7"]).values())
    ['levels/S1A', 'levels/%2E%2E%2Fx', 'levels/12%2E7']
    """
    escaped = {cell_id: _escaped(cell_id) for cell_id in cell_ids}
    return {cell_id: f"levels/{name}" for cell_id, name in apart(escaped).items()}


def apart(names: Mapping[str, str]) -> dict[str, str]:
    """Return id -> name, with a suffix where names would differ in case only, or not at all.

    Examples
    --------
    >>> apart({"a": "cell a", "b": "cell b"})
    {'a': 'cell a', 'b': 'cell b'}
    >>> apart({"a": "cell a", "A": "cell A"})
    {'a': 'cell a-ca978112ca1b', 'A': 'cell A-559aead08264'}
    """
    times = Counter(name.casefold() for name in names.values())
    return {
        key: name if times[name.casefold()] == 1 else f"{name}-{_digest(key)[:12]}"
        for key, name in names.items()
    }


def check_database_replaceable(folder: Path) -> None:
    """Raise OutputError where a folder, which may be absent, holds other files than a database."""
    check_replaceable(folder, MANIFEST, FORMAT, lambda path: _OWN.fullmatch(path) is not None)


def describe_part(folder: Path, file: Path, rows: int, cell: str | None = None) -> dict[str, Any]:
    """Return a part's entry for the manifest."""
    entry: dict[str, Any] = {"path": file.relative_to(folder).as_posix(), "rows": rows}
    if cell is not None:
        entry["cell"] = cell
    digest, blocks = checksums(file)
    entry |= {"bytes": file.stat().st_size, "sha256": digest}
    return {**entry, "blocks": list(blocks)} if blocks else entry


def _escaped(cell_id: str) -> str:
    name = quote(cell_id, safe="").replace(".", "%2E")
    if len(name) > _LONGEST_NAME:
        name = name[: _LONGEST_NAME // 2] + "-" + _digest(cell_id)
    return name


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def _fault(file: Path, detail: Mapping[str, Any]) -> Fault:
    where = ", ".join([str(file), ".".join(str(key) for key in detail["loc"])])
    if detail["type"] == "missing":
        return Fault(where, "a value", "none", _DAMAGED)
    expected = detail["msg"].removeprefix("Input should be ").removeprefix("Value error, ")
    return Fault(where, expected, repr(detail["input"])[:80], _DAMAGED)


def _check_together(manifest: _Manifest, where: str, faults: Faults) -> None:
    """Note fields that contradict each other."""
    if manifest.crs != manifest.lattice.crs:
        faults.add(f"{where}, crs", "the lattice's CRS", manifest.crs, _DAMAGED)
    folders = levels_folders(manifest.cells)
    named = {CELLS: len(manifest.cells), POINTS: manifest.counts.points}
    paths = Counter(part.path for part in manifest.parts)
    for name in named:
        if name not in paths:
            faults.add(where, f"a part {name}", "none", _DAMAGED)
    for path, times in paths.items():
        if times > 1:
            faults.add(where, f"part {path} once", f"{times} times", _DAMAGED)
    if len(some := [name for name in _SURVEYED if name in paths]) == 1:
        faults.add(where, f"parts {' and '.join(_SURVEYED)}", f"{some[0]} alone", _DAMAGED)
    for part in manifest.parts:
        if part.cell is None:
            if part.path in _SURVEYED:
                continue
            if part.path not in named:
                faults.add(f"{where}, {part.path}", "the cell whose part it is", "none", _DAMAGED)
            elif part.rows != named[part.path]:
                faults.add(f"{where}, {part.path}", f"{named[part.path]} rows", part.rows, _DAMAGED)
        elif part.cell not in folders:
            faults.add(f"{where}, {part.path}", "a cell listed", repr(part.cell), _DAMAGED)
        elif PurePosixPath(part.path).parent != PurePosixPath(folders[part.cell]):
            expected = f"a part in {folders[part.cell]} for cell {part.cell!r}"
            faults.add(where, expected, part.path, _DAMAGED)
