"""The door for vector files: formats that hold their data themselves, known by their content.

GDAL takes a file for what its content is, whatever its name: text named ``roads.geojson``, or
packed into a ZIP, may be a virtual layer that reads other files or asks a server. So the content is
looked at before GDAL sees it, and GDAL is given one file of a ZIP instead of all.
"""

from __future__ import annotations

import re
import zipfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from typing import NamedTuple

import pyogrio

from mapfilter._inputs import check_file, open_input
from mapfilter._words import likely_of_no_file
from mapfilter._zip import ZIP_DAMAGE
from mapfilter.errors import InputError, MapfilterError, fail

FORMATS = (
    "shapefile, GeoPackage, SpatiaLite, GeoJSON, FlatGeobuf, GML, KML, MapInfo TAB or MIF, "
    "file geodatabase, GeoParquet, or a ZIP of one of these"
)
"""What is read, for messages."""
PARQUET = (".parquet", ".geoparquet")

_HEAD_BYTES = 1 << 16
_LARGEST_RATIO = 60
_ALWAYS_ALLOWED_BYTES = 64 << 20
_MOST_ENTRIES = 100_000
_LARGEST_SHEET_BYTES = 16 << 20
_SHP_LENGTH = slice(24, 28)
# Marks of files that only refer to data elsewhere, and of XML that brings other files in.
_POINTERS = b"<OGRVRTDataSource <OGRWFSDataSource <OGRCSWDataSource gdal_streamed_alg".split()
_POINTERS += b"<WFS_Capabilities <VRTDataset <GDAL_WMS <!DOCTYPE <!ENTITY".split()
_LINKED_CRS = re.compile(
    rb'"crs"\s{0,9}:\s{0,9}\{[^{}]{0,99}"type"\s{0,9}:\s{0,9}"(?:link|url)"', re.IGNORECASE
)
_TAB_POINTERS = (b"open table", b"isseamless", b"type linked", b"create view")
_MAINS = frozenset(
    [
        ".shp",
        ".gpkg",
        ".sqlite",
        ".db",
        ".geojson",
        ".json",
        ".geojsonl",
        ".geojsons",
        ".fgb",
        ".gml",
        ".kml",
        ".tab",
        ".mif",
    ]
)
_ELSEWHERE = "a vector file that holds its data itself"
_OPEN_OPTIONS = {"GML": {"WRITE_GFS": "NO", "DOWNLOAD_SCHEMA": "NO"}}


_NO_PROXY = "none://"
_SEALED = {
    # Else a table of a SQLite file may be one of any other file or address, opened as it is listed.
    "OGR_SQLITE_STATIC_VIRTUAL_OGR": "NO",
    # GDAL's own default, which the environment may have changed.
    "ALLOW_OGR_SQL_FUNCTIONS_FROM_TRIGGER_AND_VIEW": "NO",
    # A CRS may be an address, wherever it stands in a file; requests end at a proxy that is none.
    "GDAL_HTTP_PROXY": _NO_PROXY,
    "GDAL_HTTPS_PROXY": _NO_PROXY,
}


class VectorSource(NamedTuple):
    """What GDAL is given: a path, which may lead into a ZIP, and options of the format."""

    path: Path | str
    options: dict[str, str]


def vector_source(path: Path) -> VectorSource:
    """Look at a vector file's content before GDAL does.

    Raises
    ------
    InputError
        There is no such file, it is a pipe or a device, cut off or of another format, it leads to
        other files, or a ZIP unpacks to far more than its size.
    """
    if path.is_dir():
        if path.suffix.lower() != ".gdb":
            raise fail(InputError, str(path), "a vector file", "a folder", "name a file in it")
        for inner in sorted(path.rglob("*")):
            if not inner.is_dir():
                check_file(inner)
        return VectorSource(path.absolute(), {})
    if not path.exists():
        hint = likely_of_no_file(path, "a mistyped path, or one relative to another folder")
        raise fail(InputError, str(path), "a vector file", "no such file", hint)
    size_bytes = check_file(path)
    if size_bytes == 0:
        raise fail(InputError, str(path), "a vector file", "an empty file", "a failed download")
    _check_beside(path)
    with open_input(path) as stream:
        head = stream.read(_HEAD_BYTES)
    if path.suffix.lower() in PARQUET:
        return VectorSource(path, {})
    if head.startswith(b"PK"):
        return _in_zip(path, size_bytes)
    kind = _format(path, path.name, head, size_bytes)
    if kind == "GML":
        # GDAL writes what it found out beside GML that comes without its schema.
        schema = path.with_suffix(".xsd")
        if not schema.exists():
            hint = "left out in copying; ogr2ogr OUT.gpkg IN.gml converts it without"
            raise fail(InputError, str(path), f"its schema {schema.name} beside it", "none", hint)
        with open_input(schema) as stream:
            _check_sheet(schema, stream.read(_LARGEST_SHEET_BYTES))
    return VectorSource(path.absolute(), _OPEN_OPTIONS.get(kind, {}))


@contextmanager
def sealed_gdal() -> Iterator[None]:
    """Let tables of a file be of that file within the block: every read of GDAL is in one."""
    before = {name: pyogrio.get_gdal_config_option(name) for name in _SEALED}
    pyogrio.set_gdal_config_options(_SEALED)
    try:
        yield
    finally:
        pyogrio.set_gdal_config_options(before)


def _check_beside(path: Path) -> None:
    """Check the files of the same name beside a file, which GDAL may read as its parts."""
    for beside in sorted(path.parent.iterdir()):
        if beside.stem == path.stem and not beside.is_dir() and beside.exists():
            check_file(beside)


def _check_sheet(path: Path, schema: bytes) -> None:
    """Refuse a schema that takes in other files than those of the format itself."""
    if b":include" in schema or b"<include" in schema or b"<!DOCTYPE" in schema:
        raise fail(InputError, str(path), _ELSEWHERE, "a schema that includes other files")


def _format(path: Path, name: str, head: bytes, size_bytes: int) -> str:
    """Return the format of a file, or of a file in a ZIP, by its first bytes."""
    where = str(path) if name == path.name else f"{path}, {name}"
    suffix = PurePosixPath(name).suffix.lower()
    if any(mark in head for mark in _POINTERS):
        raise fail(InputError, where, _ELSEWHERE, "one that leads to other places")
    if head.startswith(b"SQLite format 3\0"):
        return "SQLite"
    if head.startswith(b"\0\0\x27\x0a") and suffix == ".shp":
        stated_bytes = 2 * int.from_bytes(head[_SHP_LENGTH], "big")
        if size_bytes < stated_bytes:
            raise fail(InputError, where, f"{stated_bytes} bytes", size_bytes, "cut off")
        return "ESRI Shapefile"
    if head[:3] == b"fgb" and head[4:7] == b"fgb":
        return "FlatGeobuf"
    text = head.removeprefix(b"\xef\xbb\xbf").lstrip(b" \t\r\n\x1e")
    if text.startswith(b"{") and ".gdalg" not in name.lower():
        if _LINKED_CRS.search(head):
            hint = "write the CRS by its name, or convert the layer to WGS 84"
            raise fail(InputError, f"{where}, crs", _ELSEWHERE, "an address of its CRS", hint)
        return "GeoJSON"
    if text.startswith(b"<"):
        root = _root(text)
        if root == b"kml":
            return "KML"
        if b"opengis.net/gml" in head:
            return "GML"
    lower = text[:4096].lower()
    if lower.startswith(b"!table") and suffix == ".tab":
        if any(mark in lower for mark in _TAB_POINTERS):
            raise fail(InputError, where, _ELSEWHERE, "one that leads to other places")
        return "MapInfo File"
    if lower.startswith(b"version") and suffix == ".mif":
        return "MapInfo File"
    hint = "cut off, or another format under this name; ogr2ogr OUT.gpkg IN converts many"
    begins = head[:16].decode("latin-1")
    got = f"a file that begins with {begins!r}"
    raise fail(InputError, where, f"a vector file that GDAL reads ({FORMATS})", got, hint)


def _root(text: bytes) -> bytes:
    """Return the local name of the first element of XML, after comments and declarations."""
    while text.startswith((b"<?", b"<!--")):
        _, end, rest = text.partition(b"?>" if text.startswith(b"<?") else b"-->")
        text = rest.lstrip() if end else b""
    name = text[1:200].split(b">")[0].split()[:1]
    return name[0].rsplit(b":", 1)[-1].rstrip(b"/") if name else b""


def _in_zip(path: Path, size_bytes: int) -> VectorSource:
    """Look into a ZIP: its size, the names in it, and the content of each file of features."""
    try:
        with zipfile.ZipFile(path) as archive:
            entries = [entry for entry in archive.infolist() if not entry.is_dir()]
            _check_extent(path, entries, size_bytes)
            mains = [entry for entry in entries if _is_main(entry.filename)]
            kinds = set()
            for entry in mains:
                with archive.open(entry) as stream:
                    head = stream.read(_HEAD_BYTES)
                kinds.add(_format(path, entry.filename, head, entry.file_size))
            for entry in entries:
                if entry.filename.lower().endswith(".xsd"):
                    _check_sheet(path / entry.filename, archive.read(entry))
    except MapfilterError:
        raise
    except ZIP_DAMAGE as error:
        hint = "cut off, or another format under this name"
        raise fail(InputError, str(path), "a ZIP of vector files", error, hint) from error
    return VectorSource(_place_in(path, entries, mains), _OPEN_OPTIONS.get("".join(kinds), {}))


def _place_in(
    path: Path, entries: Sequence[zipfile.ZipInfo], mains: Sequence[zipfile.ZipInfo]
) -> str:
    """Return the path by which GDAL finds the one file, or the one folder of layers, in a ZIP."""
    inside = f"/vsizip/{{{path.absolute()}}}"
    geodatabases = {
        PurePosixPath(*parts[: i + 1]).as_posix()
        for parts in (PurePosixPath(entry.filename).parts for entry in entries)
        for i, part in enumerate(parts[:-1])
        if part.lower().endswith(".gdb")
    }
    if len(geodatabases) == 1 and not mains:
        return f"{inside}/{geodatabases.pop()}"
    if len(mains) == 1:
        return f"{inside}/{mains[0].filename}"
    folders = {PurePosixPath(entry.filename).parent.as_posix() for entry in mains}
    if mains and len(folders) == 1 and {_suffix(m.filename) for m in mains} == {".shp"}:
        folder = folders.pop()
        return inside if folder == "." else f"{inside}/{folder}"
    names = ", ".join(entry.filename for entry in mains[:5]) or "none"
    hint = "unpack it, and name one of its files"
    expected = "a ZIP with one file of layers, or the shapefiles of one folder"
    raise fail(InputError, str(path), expected, names, hint)


def most_unpacked_bytes(size_bytes: int) -> int:
    """Return the most bytes that a packed file of a size may have when unpacked."""
    return _LARGEST_RATIO * size_bytes + _ALWAYS_ALLOWED_BYTES


def _check_extent(path: Path, entries: Sequence[zipfile.ZipInfo], size_bytes: int) -> None:
    unpacked_bytes = sum(entry.file_size for entry in entries)
    allowed_bytes = most_unpacked_bytes(size_bytes)
    if unpacked_bytes > allowed_bytes or len(entries) > _MOST_ENTRIES:
        expected = f"at most {allowed_bytes >> 20} MB when unpacked"
        got, hint = f"{unpacked_bytes >> 20} MB", "possible decompression bomb"
        raise fail(InputError, str(path), expected, got, hint)
    for entry in entries:
        place = PurePosixPath(entry.filename)
        if place.is_absolute() or ".." in place.parts or set(entry.filename) & set("{}\\"):
            got = repr(entry.filename[:80])
            raise fail(InputError, str(path), "names within the ZIP", got, "a damaged ZIP")


def _is_main(name: str) -> bool:
    place = PurePosixPath(name)
    hidden = any(part.startswith((".", "__MACOSX")) for part in place.parts)
    in_geodatabase = any(part.lower().endswith(".gdb") for part in place.parts[:-1])
    return not hidden and not in_geodatabase and place.suffix.lower() in _MAINS


def _suffix(name: str) -> str:
    return PurePosixPath(name).suffix.lower()
