"""The first sheet of a workbook, and the layer of points of a GeoPackage, as CSV."""

from __future__ import annotations

import warnings
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyogrio
import shapely

from mapfilter._ogr import sealed_gdal, vector_source
from mapfilter._types import Floats
from mapfilter.errors import InputError, fail, listed
from mapfilter.radio.tables import read_table
from mapfilter.tracks.readers.contained.tables import as_table, written
from mapfilter.tracks.readers.plain.fields import usual_fields
from mapfilter.tracks.readers.plain.headers import stated_fields
from mapfilter.tracks.readers.texts.text import Text

_DEGREES, _MOST_ROWS = "EPSG:4326", 5_000_000


def sheet_of(path: Path) -> Text:
    """Return the first sheet of a workbook as a text of CSV.

    Raises
    ------
    InputError
        It cannot be read, is empty, or too large.
    """
    table = read_table(path, "a recording")
    width = len(table.header)
    rows = ([*row[:width], *[""] * (width - len(row))] for _, row in table.rows)
    notes = tuple(note.removeprefix(f"{path.name}: ") for note in table.notes)
    return as_table(Text(path, b"", notes), table.header, rows, "workbook")


def layer_of(path: Path, most_rows: int = -1, own: Collection[str] = ()) -> Text:
    """Return the points of a GeoPackage's layer, with longitude and latitude, as a text of CSV.

    ``most_rows`` are read at most, all of them where it is negative. Of several layers of points
    that are not empty it is the only one with the columns ``own``, or else with times.

    Raises
    ------
    InputError
        It cannot be read, has several layers that may be meant, or none, or several points in a
        row, or a CRS that is no part of the Earth.
    """
    source = vector_source(path)
    try:
        with sealed_gdal(), warnings.catch_warnings():
            # GDAL warns of much that it copes with.
            warnings.simplefilter("ignore", RuntimeWarning)
            layers = [
                str(name)
                for name, kind in pyogrio.list_layers(source.path).tolist()
                if kind is not None and "Point" in str(kind)
            ]
            held = {one: _columns(source.path, one) for one in layers}
            filled = {one: names for one, (names, rows) in held.items() if rows}
            layer, notes = _journey_of(path, filled or {one: held[one][0] for one in held}, own)
            if filled and (empty := [one for one in held if one not in filled]):
                notes += (f"empty layers of points not read: {listed(empty)}",)
            # A layer may be a view without an end.
            few = most_rows if most_rows >= 0 else _MOST_ROWS + 1
            frame: Any = pyogrio.read_dataframe(source.path, layer=layer, max_features=few)
    except (RuntimeError, OSError, ValueError) as error:
        got = str(error).partition(";")[0][:200].replace(f"'{path.absolute()}' ", "")
        raise fail(InputError, str(path), "a GeoPackage that can be read", got) from error
    if len(frame) > _MOST_ROWS:
        hint = "export parts of the journey"
        raise fail(InputError, str(path), "a layer of at most 5e6 points", "more", hint)
    points = _degrees_of(path, frame)
    names = [name for name in frame.columns if name != frame.geometry.name]
    lower = {name.lower() for name in names}
    columns = [[written(_plain(value)) for value in frame[name]] for name in names]
    if not lower & {"lat", "latitude", "lat_deg"}:
        names += ["longitude", "latitude"]
        columns += [[_degrees(one) for one in axis] for axis in points]
    rows = zip(*columns, strict=True)
    return as_table(Text(path, b"", notes), names, (list(row) for row in rows), f"layer {layer}")


def _columns(source: Path | str, layer: str) -> tuple[list[str], int]:
    """Return the names of a layer's columns, and 1 where it has a row."""
    few: Any = pyogrio.read_dataframe(source, layer=layer, max_features=1, read_geometry=False)
    return [str(name).lower() for name in few.columns], len(few)


def _journey_of(
    path: Path, layers: Mapping[str, Sequence[str]], own: Collection[str]
) -> tuple[str, tuple[str, ...]]:
    """Return the layer of points of a journey, and a note on the others.

    Parameters
    ----------
    path : Path
    layers : mapping of str to sequence of str
        Columns of each layer of points.
    own : collection of str
        Columns that a user gives fields.
    """
    named = [one for one, names in layers.items() if {name.lower() for name in own} <= {*names}]
    timed = [
        one
        for one, names in layers.items()
        if "time" in {*usual_fields(names), *stated_fields(names, (), ())}
    ]
    for found, why in ((list(layers), ""), (named, "the columns named"), (timed, "times")):
        if len(found) == 1:
            left = [one for one in layers if one != found[0]]
            note = f"layers of points without {why} not read: {listed(left)}"
            return found[0], (note,) if left else ()
    hint = (
        "name a column that only the journey's has, such as --column time=COLUMN, or "
        f"export it alone: ogr2ogr LAYER.gpkg {path.name} LAYER"
    )
    if not layers:
        hint = "export the journey as points"
    expected = "one layer of points, or one of them with times"
    raise fail(InputError, str(path), expected, ", ".join(layers)[:200] or "none", hint)


def _degrees_of(path: Path, frame: Any) -> tuple[Floats, Floats]:
    """Return longitudes and latitudes of a layer's points, NaN where there is none."""
    where, hint = f"{path}, crs", "set the layer's CRS, or export it in WGS 84 (EPSG:4326)"
    if frame.crs is None:
        raise fail(InputError, where, "a CRS of the layer", "none", hint)
    try:
        geometry = frame.geometry.to_crs(_DEGREES).to_numpy()
    except RuntimeError as error:
        expected, got = "a CRS that leads to longitude and latitude", frame.crs.name[:100]
        raise fail(InputError, where, expected, got, hint) from error
    if (shapely.get_num_geometries(geometry) > 1).any():
        hint = "make single points of it (Multipart to Singleparts in QGIS)"
        raise fail(InputError, str(path), "one point in each row", "several in some", hint)
    point = shapely.get_geometry(geometry, 0)
    point[shapely.is_empty(point)] = None
    return shapely.get_x(point), shapely.get_y(point)


def _plain(value: object) -> object:
    """Return a value of a layer without the types of a data frame; None where it is missing."""
    if value is None or value != value:
        return None
    if isinstance(value, np.generic):
        return value.item()
    return value


def _degrees(value: float) -> str:
    return f"{value:.9f}" if np.isfinite(value) else ""
