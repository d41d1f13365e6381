"""Elements of OpenStreetMap XML, packed or not, by GDAL.

GDAL ends without an error where a file is cut off, so the whole XML is parsed before.
"""

from __future__ import annotations

import contextlib
import gzip
import tempfile
import warnings
import zlib
from collections.abc import Iterator
from io import BufferedReader
from pathlib import Path
from typing import Any
from xml.parsers import expat

import numpy as np
import pandas as pd
import pyogrio
from geopandas import GeoDataFrame
from pyogrio.errors import DataLayerError, DataSourceError
from shapely.errors import GEOSException

from mapfilter._inputs import open_input
from mapfilter._ogr import most_unpacked_bytes, sealed_gdal
from mapfilter.errors import InputError, fail
from mapfilter.roads.elements import CUT_OFF, BoxDeg, Query

_CHUNK_BYTES = 1 << 20
_MOST_NODES_IN_MEMORY_MB = 100
# Keys whose closed ways are areas; closed highways are lines here unless area=yes.
_AREA_KEYS = "building,landuse,natural,place,water,waterway"
_LAYERS = ("lines", "multipolygons")


def read_xml(path: Path, box: BoxDeg | None, query: Query) -> GeoDataFrame | None:
    """Return the elements of a map that touch a box (degrees); None without any.

    Raises
    ------
    InputError
        The file is damaged, or no map.
    """
    with tempfile.TemporaryDirectory(prefix="mapfilter-osm-") as folder:
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


def xml_header_deg(path: Path) -> BoxDeg | None:
    """Return the box in the header of a map; None without any.

    Raises
    ------
    InputError
        The file is damaged, or no map.
    """
    head = _Head()
    with _faults_of(path), _opened(path) as stream:
        while head.parser.StartElementHandler is not None and (chunk := stream.read(1 << 16)):
            head.parser.Parse(chunk)
    return head.bounds


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
    allowed_bytes = most_unpacked_bytes(path.stat().st_size)
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
        raise fail(InputError, where, expected, got, CUT_OFF) from error
    except (OSError, EOFError, LookupError, ValueError, zlib.error) as error:
        raise fail(InputError, str(path), expected, error, CUT_OFF) from error


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


def _nodes_mb(plain: Path) -> int:
    """Return the memory for nodes: as GDAL fills all of it, no more than the file can need."""
    return min(_MOST_NODES_IN_MEMORY_MB, 1 + (plain.stat().st_size >> 20))
