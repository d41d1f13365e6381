"""``mapfilter bound``: where a radio-route database will work, before anybody drives."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from mapfilter._io import atomic_file, ensure_writable_folder
from mapfilter._parallel import Progress
from mapfilter._types import Floats
from mapfilter.database.store import open_database
from mapfilter.evaluation.first_fix import FirstFixOptions
from mapfilter.evaluation.map_bound import TWIN_ERROR, MapBound, bound, on_lattice, write_bound
from mapfilter.evaluation.radio_map import ErrorModel
from mapfilter.report.basemap import BaseMap
from mapfilter.report.bound import plot_point_values, plot_twins
from mapfilter.report.canvas import save

NOTES = (
    "exact for the error model: the bound from given gradients; bits by the serving cell",
    "exact for the journeys drawn: metres to the fix by cells, where cells serve as predicted",
    "approximate: gradients are those of planes fitted to the levels within the correlation length",
    "approximate: levels along a path count as 1 + length / (2 x correlation length) looks",
    "motion is taken as known without error; a real filter needs longer",
)
_DECIMALS = 3

_BOUND_TITLE = "Least position error along the street from one report of levels"
_FIX_TITLE = "Expected metres to convergence of an ideal filter"


@dataclass(frozen=True)
class BoundResult:
    """What a database promises; medians and shares over points or journeys.

    Parameters
    ----------
    points, cells, ways, starts : int
        Counts; journeys begin at the starts.
    plane_bound_m, along_bound_m : float
        Medians of the position-error bound of one report, of points that have one.
    without_plane_bound : float
        Share of points at which levels carry no information along one direction.
    cell_bits, level_bits : float
        Mean information of one report.
    cells_bits_per_m, levels_bits_per_m : float
        Expected information on the start per metre, over the first ``path_m``.
    cells_to_fix_m, levels_to_fix_m : float
        Expected metres to convergence.
    cells_unclear, levels_unclear : float
        Share of journeys that never converged.
    levels_wrong : float
        Of those that did by levels, the share that did so in a wrong place.
    twins : float
        Share of journeys with a twin.
    notes : tuple of str
        What is exact and what is approximate.
    """

    points: int
    cells: int
    ways: int
    starts: int
    plane_bound_m: float
    along_bound_m: float
    without_plane_bound: float
    cell_bits: float
    level_bits: float
    cells_bits_per_m: float
    levels_bits_per_m: float
    cells_to_fix_m: float
    levels_to_fix_m: float
    cells_unclear: float
    levels_unclear: float
    levels_wrong: float
    twins: float
    seconds: float
    notes: tuple[str, ...]
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
    """Bound what a database is good for; write a raster, tables by way and of twins, pictures.

    Raises
    ------
    MapfilterError
        The database is missing, damaged or too large, an option is out of range, or the output
        cannot be written.
    """
    began_s = time.perf_counter()
    database = open_database(path)
    ensure_writable_folder(out)
    found = bound(database, errors=errors, options=options, seed=seed, progress=progress)
    radio = found.radio
    columns = found.at_points()
    rasters = {name: on_lattice(radio, values) for name, values in columns.items()}
    write_bound(rasters, radio.lattice, out / "bound.tif", database.attribution)
    ways, twins = found.by_way(), found.twins()
    _write_table(ways, out / "ways.parquet")
    _write_table(twins, out / "twins.parquet")
    base = BaseMap(radio.lattice.bounds_m, attribution=database.attribution)
    on_map = radio.lattice, database.plan, base
    along, fix = rasters["along_bound_m"], rasters["levels_to_fix_m"]
    drawn = plot_point_values(along, *on_map, title=_BOUND_TITLE, label="bound / m")
    save(drawn, out / "position-bound.png")
    drawn = plot_point_values(fix, *on_map, title=_FIX_TITLE, label="metres to convergence / m")
    save(drawn, out / "metres-to-fix.png")
    pairs_m = twins[["east_m", "north_m", "twin_east_m", "twin_north_m"]].to_numpy()
    save(plot_twins(rasters["twin_error"], pairs_m, *on_map), out / "twins.png")
    tables = ["bound.tif", "ways.parquet", "twins.parquet"]
    names = [*tables, "position-bound.png", "metres-to-fix.png", "twins.png"]
    return _summary(found, began_s, tuple(out / name for name in names))


def _summary(found: MapBound, began_s: float, outputs: tuple[Path, ...]) -> BoundResult:
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
        notes=NOTES,
        outputs=outputs,
    )


def _median(values: Floats) -> float:
    known = values[np.isfinite(values)]
    return _rounded(np.median(known)) if known.size else float("nan")


def _rounded(value: float) -> float:
    return round(float(value), _DECIMALS)


def _write_table(table: pd.DataFrame, path: Path) -> None:
    with atomic_file(path) as temporary:
        table.to_parquet(temporary, index=False)
