"""``mapfilter bound``: position bounds of a radio-route database, without a journey."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd
import shapely

from mapfilter._io import atomic_file, ensure_writable_folder
from mapfilter._parallel import Progress
from mapfilter._partial import nothing_left
from mapfilter._types import Floats
from mapfilter.database.export import write_layers
from mapfilter.database.store import open_database
from mapfilter.evaluation.first_fix import FirstFixOptions
from mapfilter.evaluation.map_bound import TWIN_ERROR, MapBound, bound, on_lattice, write_bound
from mapfilter.evaluation.radio_map import ErrorModel
from mapfilter.radio.cells import CellPlan
from mapfilter.radio.layers import layer_numbers
from mapfilter.report.basemap import BaseMap
from mapfilter.report.coverage import plot_point_values, plot_twins
from mapfilter.report.saving import save
from mapfilter.workflows.inputs.apart import check_in_no_store, check_out_apart

NOTES = (
    "exact for the error model: the bound from given gradients; bits by the serving cell",
    "exact for the journeys drawn: metres to the fix by cells, where cells serve as predicted",
    "approximate: gradients are those of planes fitted to the levels within the correlation length",
    "approximate: levels along a path count as 1 + length / (2 x correlation length) looks",
    "motion is taken as known without error; a real filter needs longer",
    "without_plane_bound: share of the points where levels tell nothing of the place along one "
    "direction; plane_bound_m is the median over the others",
    "cells_unclear, levels_unclear: share of the journeys on which not even an ideal filter "
    "converges; levels_wrong: of the others, the share in a wrong place; twins: share with a place "
    "that looks alike",
)
LAYERS_NOTE = (
    "the network has several layers: phones are on that of the strongest cell of each place, and "
    "report its cells alone; a database of the cells of one carrier bounds phones that stay on it"
)
_DECIMALS = 3
_FILES = ("bound.tif", "bound.gpkg", "ways.parquet", "twins.parquet")

_BOUND_TITLE = "Least position error along the street from one report of levels"
_FIX_TITLE = "Expected metres to convergence of an ideal filter"


@dataclass(frozen=True)
class BoundResult:
    """Bounds of a database; medians and shares over points or journeys."""

    points: int
    cells: int
    ways: int
    starts: int
    """Number of points at which journeys begin."""
    plane_bound_m: float
    """Median of the position-error bound of one report, of points that have one."""
    along_bound_m: float
    """The same along the street."""
    without_plane_bound: float
    """Share of points at which levels carry no information along one direction."""
    cell_bits: float
    """Mean information of the serving cell of one report; ``level_bits`` of its levels."""
    level_bits: float
    cells_bits_per_m: float
    """Expected information on the start per metre, over the first ``path_m``."""
    levels_bits_per_m: float
    cells_to_fix_m: float
    """Expected metres to convergence."""
    levels_to_fix_m: float
    cells_unclear: float
    """Share of journeys that never converged."""
    levels_unclear: float
    levels_wrong: float
    """Of the journeys that converged by levels, the share that did so in a wrong place."""
    twins: float
    """Share of journeys with a twin."""
    seconds: float
    notes: tuple[str, ...]
    """Which of the figures are exact and which are approximate."""
    outputs: tuple[Path, ...]


def run_bound(
    path: Path,
    out: Path,
    *,
    errors: ErrorModel | None = None,
    options: FirstFixOptions | None = None,
    seed: int = 0,
    progress: Progress | None = None,
) -> BoundResult:
    """Compute bounds on positioning by a database; write a raster, tables by way and of twins."""
    began_s = time.perf_counter()
    check_out_apart(out, [path])
    check_in_no_store(out)
    database = open_database(path)
    with nothing_left(out):
        ensure_writable_folder(out)
        found = bound(database, errors=errors, options=options, seed=seed, progress=progress)
    radio, ways, twins = found.radio, found.by_way(), found.twins()
    rasters = {name: on_lattice(radio, values) for name, values in found.at_points().items()}
    write_bound(rasters, radio.lattice, out / "bound.tif", database.attribution)
    layers = {"ways": _ways_as_points(ways, found), "twins": _twins_as_lines(twins, found)}
    for name, layer in layers.items():
        with atomic_file(out / f"{name}.parquet") as temporary:
            layer.to_parquet(temporary, index=False)
    write_layers(layers, out / "bound.gpkg")
    base = BaseMap(
        radio.lattice.bounds_m,
        attribution=database.attribution,
        whole_m=database.lattice.bounds_m,
    )
    on_map = radio.lattice, database.plan, base
    along, fix = rasters["along_bound_m"], rasters["levels_to_fix_m"]
    pairs_m = twins[["east_m", "north_m", "twin_east_m", "twin_north_m"]].to_numpy()
    label = "distance to convergence / m"
    pictures = {
        "position-bound.png": plot_point_values(
            along, *on_map, title=_BOUND_TITLE, label="bound / m"
        ),
        "metres-to-fix.png": plot_point_values(fix, *on_map, title=_FIX_TITLE, label=label),
        "twins.png": plot_twins(rasters["twin_error"], pairs_m, *on_map),
    }
    drawn = [save(picture, out / name) for name, picture in pictures.items()]
    tables = [out / name for name in _FILES]
    return _summary(found, database.plan, began_s, (*tables, *drawn))


def _ways_as_points(ways: pd.DataFrame, found: MapBound) -> gpd.GeoDataFrame:
    """Return the table of ways with the points of each as geometry."""
    radio = found.radio
    place_m = np.column_stack(radio.lattice.east_north(radio.row, radio.col))
    order = np.argsort(radio.way_id, kind="stable")
    ids, first = np.unique(radio.way_id[order], return_index=True)
    parts = map(shapely.MultiPoint, np.split(place_m[order], first[1:]))
    geometry = gpd.GeoSeries(list(parts), index=ids, crs=radio.lattice.crs)
    return gpd.GeoDataFrame(
        ways, geometry=geometry.loc[ways["way_id"]].to_numpy(), crs=geometry.crs
    )


def _twins_as_lines(twins: pd.DataFrame, found: MapBound) -> gpd.GeoDataFrame:
    """Return the table of twins with a line from each place to its twin."""
    ends_m = twins[["east_m", "north_m", "twin_east_m", "twin_north_m"]].to_numpy()
    lines = shapely.linestrings(ends_m.reshape(-1, 2, 2))
    return gpd.GeoDataFrame(twins, geometry=lines, crs=found.radio.lattice.crs)


def _summary(
    found: MapBound, plan: CellPlan, began_s: float, outputs: tuple[Path, ...]
) -> BoundResult:
    fix, options, radio = found.fix, found.options, found.radio
    plane, along = found.position.plane_m, found.position.along_m
    clear = np.isfinite(fix.levels_m)
    return BoundResult(
        points=len(radio),
        cells=len(radio.cell_ids),
        ways=int(np.unique(radio.way_id[radio.way_id > 0]).size),
        starts=int(fix.start.size),
        plane_bound_m=_median(plane),
        along_bound_m=_median(along),
        without_plane_bound=_rounded((~np.isfinite(plane)).mean()),
        cell_bits=_rounded(found.distinct.cell_bits.mean()),
        level_bits=_rounded(found.distinct.level_bits.mean()),
        cells_bits_per_m=round(float(fix.cells_bits.mean()) / options.path_m, 5),
        levels_bits_per_m=round(float(fix.levels_bits.mean()) / options.path_m, 5),
        cells_to_fix_m=_rounded(np.minimum(fix.cells_m, options.most_m).mean()),
        levels_to_fix_m=_rounded(np.minimum(fix.levels_m, options.most_m).mean()),
        cells_unclear=_rounded((~np.isfinite(fix.cells_m)).mean()),
        levels_unclear=_rounded((~clear).mean()),
        levels_wrong=_rounded((~fix.right[clear]).mean()) if clear.any() else float("nan"),
        twins=_rounded((fix.twin_error >= TWIN_ERROR).mean()),
        seconds=round(time.perf_counter() - began_s, 2),
        notes=(*NOTES, *([LAYERS_NOTE] if layer_numbers(plan.cells).any() else [])),
        outputs=outputs,
    )


def _median(values: Floats) -> float:
    known = values[np.isfinite(values)]
    return _rounded(np.median(known)) if known.size else float("nan")


def _rounded(value: float) -> float:
    return round(float(value), _DECIMALS)
