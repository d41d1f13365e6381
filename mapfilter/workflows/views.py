"""Views: replays and databases as HTML files that open in a browser, without a server."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rasterio.errors import RasterioError

from mapfilter._gdal import open_raster
from mapfilter._inputs import shown
from mapfilter.database.checked import MANIFEST
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.database.store import open_database
from mapfilter.errors import Faults, InputError, OutputError, fail
from mapfilter.evaluation.map_bound import BANDS
from mapfilter.geodesy import same_crs, shown_crs
from mapfilter.lattice import Lattice
from mapfilter.roads.buildings import read_buildings
from mapfilter.viewing.bundle import database_bundle
from mapfilter.viewing.layers import frame_of, with_bound, with_buildings
from mapfilter.viewing.merge import side_by_side
from mapfilter.viewing.page import read_page, write_page
from mapfilter.workflows.inputs.apart import check_in_no_store, check_out_apart
from mapfilter.workflows.outputs.results import REPLAY_HTML

VIEW_HTML = "view.html"

BOUND_TIF = "bound.tif"

_USUAL_NAME = "database"
_BOUND_LAYERS = {
    "levels_to_fix_m": "Metres to convergence by levels, at best",
    "cells_to_fix_m": "Metres to convergence by cells, at best",
    "along_bound_m": "Least error along the street",
}
"""Bands of a bound that a page shows, and their names there."""


def run_view(
    paths: Sequence[Path], out: Path | None = None, street_map: str | None = None
) -> dict[str, Any]:
    """Show results of replays side by side, or a database.

    Parameters
    ----------
    paths : sequence of Path
        Results of ``replay --html`` (folders, or the HTML files in them), all over one database;
        or one database. A result of ``bound`` beside them adds its layers.
    out : Path, optional
        The HTML file; ``view.html`` in the working folder when left out.
    street_map : str, optional
        An OpenStreetMap file, or the name of an embedded map, whose buildings are drawn.

    Returns
    -------
    dict
        The file, its size in MB, and what it shows.

    Raises
    ------
    MapfilterError
        A result has no view, or is of another database; or the file cannot be written, or is one
        that is no older page, or an input.
    """
    file = (out or Path(VIEW_HTML)).absolute()
    check_out_apart(file, [path for path in paths if (path / MANIFEST).is_file()])
    check_in_no_store(file)
    bounds = [path for path in paths if (path / BOUND_TIF).is_file()]
    rest = [path for path in paths if path not in bounds]
    if len(rest) == 1 and (rest[0] / MANIFEST).is_file():
        bundle = database_view(open_database(rest[0]))
    else:
        pages = pages_of(rest or paths)
        if file.resolve() in [page.resolve() for page in pages]:
            hint = "a page of several beside those that it shows: give another name"
            raise fail(OutputError, str(file), "another place than an input", "one of them", hint)
        bundle = side_by_side([(shown(str(page)), read_page(page)) for page in pages])
    for path in bounds:
        bundle = _bounded(bundle, path / BOUND_TIF)
    if street_map is not None:
        frame, bounds_m = frame_of(bundle)
        buildings = read_buildings(street_map, frame.crs, bounds_m)
        if not len(buildings):
            hint = "a map of another area, or one without buildings"
            raise fail(InputError, f"--map, {street_map}", "buildings of the area", "none", hint)
        bundle = with_buildings(bundle, buildings)
    write_page(bundle, file)
    return view_figures(bundle, file)


def _bounded(bundle: Mapping[str, Any], path: Path) -> dict[str, Any]:
    """Return a view with the layers of a result of ``bound``."""
    frame, _ = frame_of(bundle)
    where, numbers = shown(str(path)), {name: at for at, (name, _) in enumerate(BANDS, start=1)}
    try:
        with open_raster(path) as source:
            if tuple(source.descriptions) != tuple(numbers):
                raise fail(InputError, where, "what mapfilter bound writes", "other bands")
            crs, side, top = str(source.crs), float(source.res[0]), source.bounds
            values = {name: source.read(numbers[name]) for name in _BOUND_LAYERS}
    except RasterioError as error:
        raise fail(InputError, where, "a whole GeoTIFF", f"{error}", "cut off") from error
    if not same_crs(crs, frame.crs):
        hint = "the bound of another database"
        raise fail(InputError, where, shown_crs(frame.crs), shown_crs(crs), hint)
    rows, cols = next(iter(values.values())).shape
    lattice = Lattice(frame.crs, top.left, top.top, side, rows, cols)
    layers = {label: ("m", values[name]) for name, label in _BOUND_LAYERS.items()}
    return with_bound(bundle, lattice, layers)


def database_view(database: RadioRouteDatabase) -> dict[str, Any]:
    """Return the bundle of a database, with its name as title, or that of its folder."""
    path = database.path.absolute()
    name = path.parent.name if path.name == _USUAL_NAME else path.name
    return database_bundle(f"Database {name}", database)


def view_figures(bundle: Mapping[str, Any], file: Path) -> dict[str, Any]:
    """Return what a page shows, for the terminal."""
    return {
        "html": file,
        "megabytes": round(file.stat().st_size / 1e6, 2),
        "runs": [run["name"] for run in bundle["runs"]],
        "cells": len(bundle["cells"]),
        "open": file.as_uri(),
    }


def pages_of(paths: Sequence[Path]) -> list[Path]:
    """Return the pages of results: files, those of folders, or of the folders in them.

    Raises
    ------
    InputError
        A result has none.
    """
    found: list[Path] = []
    faults = Faults()
    for path in paths:
        pages = [path] if path.is_file() else sorted(path.glob(REPLAY_HTML))
        pages = pages or sorted(path.glob(f"*/{REPLAY_HTML}"))
        if (path / MANIFEST).is_file():
            expected = f"results with {REPLAY_HTML} alone, or one database alone"
            hint = "each database is a page of its own; mapfilter merge makes one of several"
            faults.add(shown(str(path)), expected, "a database beside others", hint)
        elif not pages:
            expected = f"a result with {REPLAY_HTML}, or a database"
            what = "a folder without any" if path.is_dir() else "nothing there"
            hint = "run mapfilter replay with --html"
            if (path / BOUND_TIF).is_file():
                hint = "a result of mapfilter bound: name its database beside it"
            faults.add(shown(str(path)), expected, what, hint)
        found += pages
    faults.raise_if_any(InputError)
    return found
