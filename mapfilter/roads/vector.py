"""Reading a layer of a vector file, cut to an area."""

from __future__ import annotations

import difflib
import warnings
import zipfile
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, TypeAlias, TypeVar

import geopandas
import numpy as np
import pyarrow as pa
import pyogrio
import pyproj
import shapely
from geopandas import GeoDataFrame
from numpy.typing import NDArray
from pyproj.exceptions import CRSError, ProjError
from shapely.errors import GEOSException

from mapfilter._arrow import arrow_file, open_parquet
from mapfilter._inputs import open_input, shown
from mapfilter._ogr import PARQUET, VectorSource, sealed_gdal, vector_source
from mapfilter._types import Ints
from mapfilter._words import number_of
from mapfilter.errors import InputError, MapfilterError, fail
from mapfilter.geodesy import horizontal_part, known_crs, same_crs, utm_zone, utm_zone_crs
from mapfilter.roads.maps import box_deg, boxes_overlap
from mapfilter.roads.ways import Bounds, Geometries, on_earth

T = TypeVar("T")

Layer: TypeAlias = Path | str | GeoDataFrame
"""A vector file, or a table with geometry in memory."""

_MOST_DEG = 360.0
# Raised where a file is not what its format demands; pyogrio raises UnboundLocalError for a CRS
# that cannot be written out.
_ANY_DAMAGE = (RuntimeError, ValueError, TypeError, LookupError, ArithmeticError, UnboundLocalError)
_FILE_DAMAGE = (OSError, EOFError, MemoryError, zipfile.BadZipFile, zlib.error, pa.ArrowException)
_DAMAGES = (*_ANY_DAMAGE, *_FILE_DAMAGE, GEOSException, CRSError, ProjError)


@dataclass(frozen=True, slots=True, eq=False)
class Features:
    """N features of a layer, in and about an area, in the CRS asked for.

    ``name`` is the file, for messages; ``number`` are the features' own numbers in it (FID), plus
    1; ``notes`` count features left out.
    """

    name: str
    geometry: Geometries
    number: Ints
    columns: Mapping[str, NDArray[np.object_]]
    notes: tuple[str, ...]

    @property
    def kinds(self) -> str:
        """Types of geometry, for messages."""
        return ", ".join(sorted({shape.geom_type for shape in self.geometry}))

    def column(self, name: str | None) -> NDArray[np.object_] | None:
        """Return a column, or None without a name."""
        return None if name is None else self.columns[name]


def read_layer(
    source: Layer,
    crs: str,
    bounds_m: Bounds,
    layer_name: str | None,
    wanted: Sequence[str | None] = (),
    *,
    may_be_empty: bool = False,
) -> Features:
    """Read the features of a layer that touch an area.

    Parameters
    ----------
    source : path or GeoDataFrame
        A file, a zipped one, or a folder that is a file geodatabase; or a table in memory.
    crs, bounds_m, layer_name
        As for :func:`mapfilter.roads.layers.read_layer_roads`.
    wanted : sequence of str or None
        Columns to read beside the geometry; None are passed over.
    may_be_empty : bool
        Accept a layer with nothing in the area.

    Raises
    ------
    InputError
        The file is missing, damaged or no vector file, has several layers, no CRS, or lacks a
        column, or nothing of it lies in the area.
    """
    columns = [column for column in wanted if column is not None]
    name, frame, hint = "GeoDataFrame", None, ""
    if isinstance(source, GeoDataFrame):
        frame, hint = source.reset_index(drop=True), "not set; see GeoDataFrame.set_crs"
        if frame.active_geometry_name is None:
            raise fail(InputError, name, "a geometry column", "none", "a plain table")
    else:
        path, name = Path(source), str(source)
        place = vector_source(path)
        if path.suffix.lower() in PARQUET:
            with open_input(path) as stream:
                frame = _guarded(name, lambda: _parquet_frame(stream))
        elif path.suffix.lower() == ".shp":
            hint = _of_prj(path)
    if frame is not None:
        known = [str(column) for column in frame.columns if column != frame.active_geometry_name]
        _check_columns(name, known, columns)
        source_crs, covered = frame.crs, frame.total_bounds
    else:
        layer = _layer(path, place, layer_name)
        about = _guarded(name, lambda: pyogrio.read_info(place.path, layer=layer, **place.options))
        _check_columns(name, list(about["fields"]), columns)
        source_crs, covered = about["crs"], about["total_bounds"]
    if source_crs is None:
        raise fail(InputError, f"{name}, crs", "a layer with a CRS", "none", hint)
    source_crs = _horizontal_crs(name, source_crs)
    box = _box(name, crs, bounds_m, source_crs)
    if frame is None:
        settings: dict[str, Any] = {"columns": columns, "bbox": box, **place.options}
        settings |= {"layer": layer, "fid_as_index": True, "force_2d": True}
        frame = _guarded(name, lambda: pyogrio.read_dataframe(place.path, **settings))
    frame = frame.set_crs(source_crs, allow_override=True)
    found = _features(name, frame, crs, bounds_m, columns)
    if not (found.number.size or may_be_empty):
        raise _nothing_there(name, crs, bounds_m, source_crs, covered)
    return found


def _features(
    name: str, frame: Any, crs: str, bounds_m: Bounds, columns: Sequence[str]
) -> Features:
    notes = []
    has_shape = (~frame.geometry.isna()).to_numpy()
    if not has_shape.all():
        notes.append(
            f"{name}: {number_of(int((~has_shape).sum()), 'feature')} without geometry left out"
        )
        frame = frame[has_shape]
    number = frame.index.to_numpy().astype(np.int64) + 1
    frame = _guarded(name, lambda: frame.to_crs(crs))
    geometry = shapely.force_2d(frame.geometry.to_numpy())
    kept = on_earth(geometry)
    if not kept.all():
        notes.append(
            f"{name}: {number_of(int((~kept).sum()), 'feature')} left out: {crs} has no such places"
        )
    kept[kept] = shapely.intersects(shapely.box(*bounds_m), geometry[kept])
    values = {column: frame[column].to_numpy(dtype=object)[kept] for column in columns}
    return Features(name, geometry[kept], number[kept], values, tuple(notes))


def _layer(path: Path, place: VectorSource, wanted: str | None) -> str:
    layers = _guarded(str(path), lambda: pyogrio.list_layers(place.path))
    names = [str(name) for name, kind in layers if kind is not None]
    if wanted is None and len(names) == 1:
        return names[0]
    if wanted is not None and wanted in names:
        return wanted
    if not names:
        hint = "a table without places"
        raise fail(InputError, str(path), "a layer with geometry", "none", hint)
    expected = f"the name of one of its layers: {', '.join(names)}"
    close = difflib.get_close_matches(wanted or "", names, n=1)
    hint = repr(close[0]) if close else ""
    raise fail(InputError, f"{path}, layer", expected, repr(wanted) if wanted else "none", hint)


def _check_columns(name: str, known: Sequence[str], wanted: Sequence[str]) -> None:
    for column in wanted:
        if column not in known:
            close = difflib.get_close_matches(column, known, n=1)
            expected = f"one of its columns: {', '.join(known) or 'it has none'}"
            hint = repr(close[0]) if close else ""
            raise fail(InputError, f"{name}, column", expected, repr(column), hint)


def _box(name: str, crs: str, bounds_m: Bounds, source_crs: Any) -> tuple[float, ...]:
    """Return a box in the layer's CRS that holds a box in another."""
    try:
        change = pyproj.Transformer.from_crs(crs, source_crs, always_xy=True)
        box = change.transform_bounds(*bounds_m, densify_pts=21)
    except (CRSError, ProjError) as error:
        raise fail(InputError, f"{name}, crs", "a CRS on Earth", error) from error
    if not np.isfinite(box).all():
        expected = f"a CRS that can show the area {_numbers(bounds_m)}"
        raise fail(InputError, f"{name}, crs", expected, source_crs, "a CRS of another region")
    return tuple(float(side) for side in box)


def _horizontal_crs(name: str, source_crs: Any) -> pyproj.CRS:
    """Return the horizontal part of a layer's CRS."""
    try:
        return horizontal_part(known_crs(source_crs, f"{name}, crs"))
    except (CRSError, TypeError, ValueError) as error:
        hint = "a damaged .prj file, or one of another program"
        got = shown(str(source_crs))
        raise fail(InputError, f"{name}, crs", "a CRS that is known", got, hint) from error


def _of_prj(path: Path) -> str:
    """Return why a shapefile has no CRS."""
    found = next((p for p in (path.with_suffix(s) for s in (".prj", ".PRJ")) if p.is_file()), None)
    if found is None:
        return "the .prj file was left behind"
    what = "is empty" if not found.stat().st_size else "holds none that is known"
    return f"{found.name} {what}: copy it again, or write that of the CRS"


def _guarded(name: str, read: Callable[[], T]) -> T:
    try:
        with sealed_gdal(), warnings.catch_warnings():
            # GDAL warns of much that it copes with; what it cannot read has no geometry.
            warnings.simplefilter("ignore", RuntimeWarning)
            warnings.simplefilter("ignore", UserWarning)
            return read()
    except pyogrio.errors.CRSError as error:
        hint = "a .prj file that was cut off; copy it again"
        raise fail(InputError, f"{name}, crs", "a CRS that is known", error, hint) from error
    except _DAMAGES as error:
        reason = str(error).strip().splitlines()[0] if str(error).strip() else type(error).__name__
        hint = "cut off, or another format under this name"
        raise fail(InputError, name, "a vector file that GDAL reads", reason, hint) from error


def _parquet_frame(stream: BinaryIO) -> GeoDataFrame:
    # What is no Parquet is refused by its end, before all of it is read.
    with open_parquet(stream):
        pass
    return geopandas.read_parquet(pa.BufferReader(arrow_file(stream)))


def _nothing_there(
    name: str, crs: str, bounds_m: Bounds, source_crs: Any, covered: Any
) -> MapfilterError:
    """Return the error for a layer with nothing in the area, with the likely mistake."""
    where, hint = f"{name}, area {_numbers(bounds_m)} in {crs}", "the area lies outside the layer"
    got = "none"
    if covered is None or not np.isfinite(covered).all():
        return fail(InputError, where, "features in the area", "none", hint)
    if pyproj.CRS.from_user_input(source_crs).is_geographic:
        west, south, east, north = box_deg(crs, bounds_m)
        if np.any(np.abs(covered) > (_MOST_DEG, 90.0, _MOST_DEG, 90.0)):
            hint = "a CRS in degrees with other numbers: another CRS left out on export"
        elif boxes_overlap((south, west, north, east), covered):
            hint = "longitude and latitude swapped"
    expected = f"features in the area; the layer covers {_numbers(covered)}"
    if hint == "the area lies outside the layer":
        zone, away_m = _fitting_zone(crs, bounds_m, source_crs, covered)
        if zone:
            got = f"none: the area is {away_m / 1000:.0f} km away, and would be there as numbers "
            got += f"of {zone} instead of {crs}"
            hint = "the CRS of the rasters, or of the area, is of another zone"
    return fail(InputError, where, expected, got, hint)


def _fitting_zone(crs: str, bounds_m: Bounds, source_crs: Any, covered: Any) -> tuple[str, float]:
    """Return the UTM zone in whose numbers an area meets a layer, or "", and how far off it is."""
    source = pyproj.CRS.from_user_input(source_crs)
    box = tuple(covered) if source.is_geographic else box_deg(source.to_wkt(), tuple(covered))
    if not np.isfinite(box).all() or "UTM zone" not in pyproj.CRS.from_user_input(crs).name:
        return "", np.nan
    lon, lat = (box[0] + box[2]) / 2, (box[1] + box[3]) / 2
    west, south, east, north = box_deg(crs, bounds_m)
    middle = (west + east) / 2, (south + north) / 2
    away_m = float(pyproj.Geod(ellps="WGS84").inv(*middle, lon, lat)[2])
    zone = utm_zone(lon, lat)
    for apart in (0, -1, 1):
        other = utm_zone_crs((zone + apart - 1) % 60 + 1, lat)
        if not same_crs(other, crs) and boxes_overlap(box_deg(other, bounds_m), box):
            return other, away_m
    return "", away_m


def _numbers(values: Sequence[float]) -> str:
    return ", ".join(f"{value:.8g}" for value in values)
