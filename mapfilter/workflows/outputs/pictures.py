"""Pictures of a database; removal of those of an older run."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np

from mapfilter._io import ensure_writable_folder
from mapfilter._types import Floats32
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.errors import OutputError, fail
from mapfilter.lattice import Lattice
from mapfilter.rasters.raster_set import RxLevRasters
from mapfilter.report.basemap import BaseMap
from mapfilter.report.canvas import BLUE, ORANGE, Drawn
from mapfilter.report.coverage import plot_landuse, plot_level, plot_margin
from mapfilter.report.network import plot_best_server, plot_points_per_cell
from mapfilter.report.saving import save
from mapfilter.roads.buildings import rasterise_heights
from mapfilter.roads.landuse import LandUse
from mapfilter.roads.ways import Buildings
from mapfilter.workflows.outputs.served import (
    MOST_READ_PX,
    ServedPoints,
    best_servers,
    common_window,
    served_points,
    street_map,
    thinned_lattice,
)

NETWORK_PICTURES = (
    "coverage.png",
    "best-server.png",
    "margin.png",
    "points-per-cell.png",
    "points-of-one-site.png",
    "land-use.png",
)

_NEARLY_ALL = (1.0, 99.0)
_IF_NONE_DBM = (-110.0, -50.0)


def clear_pictures(folder: Path, names: Iterable[str]) -> None:
    """Remove files of an older run from a folder.

    Raises
    ------
    OutputError
        One cannot be removed.
    """
    with _removal(folder):
        for name in names:
            (folder / name).unlink(missing_ok=True)


@contextmanager
def _removal(folder: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        what, where = error.strerror or error, error.filename or folder
        raise fail(OutputError, str(where), "a file that can be removed", what) from error


def draw_network(
    rasters: RxLevRasters,
    database: RadioRouteDatabase,
    folder: Path,
    *,
    area: Lattice | None = None,
    landuse: LandUse | None = None,
    buildings: Buildings | None = None,
) -> tuple[Path, ...]:
    """Draw a database and the rasters that it was built from.

    Coverage, best server, margin, points per cell, points of the site with the most sectors if
    any has several, and land use where it is known. Memory is bounded whatever the area: it is
    thinned to what a picture can show, and of very large sets of rasters only the database's points
    are shown. Where nearly all points lie in less than half of the area, only that is shown, and
    the titles show that.

    Parameters
    ----------
    folder : Path
        Made where it is missing; pictures of an older database in it are removed.
    area : Lattice, optional
        The part of the database's lattice that its roads were laid on, when that is not all.
    landuse : LandUse, optional
        On that part: the classes that the points were laid on.
    buildings : Buildings, optional
        Without ``landuse``: drawn beside ways and squares.

    Raises
    ------
    InputError
        Rasters and database are of different areas, or a raster is damaged.
    OutputError
        A picture cannot be written.
    """
    _ = common_window(rasters.lattice, database.lattice, str(database.path))
    within = common_window(database.lattice, area or database.lattice, str(database.path))
    ensure_writable_folder(folder)
    clear_pictures(folder, NETWORK_PICTURES)
    everywhere = served_points(database, within)
    window, points, where = everywhere.crowded_window(), everywhere, ""
    if window != within:
        points = served_points(database, window)
        share = 100 * points.counts.sum() // everywhere.counts.sum()
        where = f", where {share} % of the points lie"
    shown = database.lattice.window(*window)
    at_points = shown.rows * shown.cols * len(rasters.cell_ids) > MOST_READ_PX
    best = points.best if at_points else best_servers(rasters, database, shown)
    lattice, plan = best.lattice, database.plan
    drawn: list[Path] = []

    def keep(picture: Drawn, number: int) -> None:
        drawn.append(save(picture, folder / NETWORK_PICTURES[number]))

    on_map = lattice, plan, _base(database, lattice)
    title, ends_dbm = f"Level of the best server{where}", _ends(best.level_dbm)
    keep(plot_level(best.level_dbm, *on_map, title=title, range_dbm=ends_dbm), 0)
    keep(plot_best_server(best.server, plan.ids, *on_map, title=f"Best server{where}"), 1)
    title = f"Margin of the best server over the second{where}"
    keep(plot_margin(best.margin_db, *on_map, title=title), 2)
    title = f"Points by best server{where}"
    keep(_plot_points(database, points, database.cell_ids, title), 3)
    site, cells = Counter(cell.site for cell in plan.cells).most_common(1)[0]
    if cells > 1:
        keep(_plot_site(database, everywhere, site), 4)
    classes = None
    if landuse is not None:
        _, step = thinned_lattice(shown)
        top, left = window[0] - within[0], window[1] - within[1]
        code = landuse.code[top : top + window[2] : step, left : left + window[3] : step]
        classes = replace(landuse, code=code)
    elif buildings is not None and len(buildings):
        classes = land_use_of_map(points, buildings)
    if classes is not None:
        lattice = points.best.lattice
        base = _base(database, lattice)
        keep(plot_landuse(classes, lattice, base, title=f"Land use{where}"), 5)
    return tuple(drawn)


def _base(database: RadioRouteDatabase, part: Lattice) -> BaseMap:
    """Return the empty map of a part of a database's area."""
    whole_m = database.lattice.bounds_m
    return BaseMap(part.bounds_m, attribution=database.attribution, whole_m=whole_m)


def _plot_site(database: RadioRouteDatabase, points: ServedPoints, site: str) -> Drawn:
    """Draw the points that the sectors of one site serve best (the paper's Fig. 2).

    In an area that had to be thinned, only the surroundings of these points are shown.
    """
    plan = database.plan
    cells = [cell.id for cell in plan.cells if cell.site == site]
    own = np.isin(points.best.server, [plan.index(cell_id) for cell_id in cells])
    row, col = np.nonzero(own)
    if points.step > 1 and row.size:
        rows, cols = ((int(at.min()), int(at.max())) for at in (row, col))
        points = served_points(database, points.window_about(rows, cols))
    return _plot_points(database, points, cells, f"Points served by site {site}")


def _plot_points(
    database: RadioRouteDatabase, points: ServedPoints, cells: Sequence[str], title: str
) -> Drawn:
    numbers = [database.plan.index(cell_id) for cell_id in cells]
    return plot_points_per_cell(
        {cell_id: points.places(number) for cell_id, number in zip(cells, numbers, strict=True)},
        database.plan,
        street_map(database, points),
        title=title,
        counts=points.counts[numbers].tolist(),
        resolution_m=points.best.lattice.resolution_m,
    )


def land_use_of_map(points: ServedPoints, buildings: Buildings) -> LandUse:
    """Return the land use of a street map: ways, squares, buildings, and the rest."""
    code = np.where(rasterise_heights(buildings, points.best.lattice) > 0, 2, 3).astype(np.int16)
    there = points.best.server >= 0
    code[there] = np.where(points.on_square[there], 1, 0)
    return LandUse(
        code,
        ("way", "square", "building", "other"),
        (True, True, False, False),
        (BLUE, ORANGE, "#8c8c8c", "#eee9dd"),
    )


def _ends(level_dbm: Floats32) -> tuple[float, float]:
    """Return tens of dBm between which nearly all levels lie."""
    known = level_dbm[np.isfinite(level_dbm)]
    low, high = np.percentile(known, _NEARLY_ALL) if known.size else _IF_NONE_DBM
    low, high = 10 * np.floor(low / 10), 10 * np.ceil(high / 10)
    return float(low), float(max(high, low + 10))
