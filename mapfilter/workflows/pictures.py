"""Which pictures a replay and a database get."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import ceil
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.errors import InputError, fail
from mapfilter.geodesy import Lattice, same_crs
from mapfilter.positioning.global_positioning import PositionedTrack
from mapfilter.positioning.snapshot import Snapshot
from mapfilter.radio.rasters import RxLevRasters
from mapfilter.report.basemap import BaseMap
from mapfilter.report.candidates import MAX_PANELS, plot_candidates
from mapfilter.report.canvas import BLUE, ORANGE
from mapfilter.report.coverage import plot_best_server, plot_level, plot_points_per_cell
from mapfilter.report.error_curve import plot_error_over_distance
from mapfilter.report.landuse import LandUseClasses, plot_landuse
from mapfilter.report.margin import plot_margin
from mapfilter.report.track import plot_track
from mapfilter.tracks.log import TrackLog
from mapfilter.workflows.survey_pictures import SurveyEvidence, draw_survey
from mapfilter.workflows.truth import truth_of

_MOST_PX = 2000
_STRIP_PX = 20_000_000


@dataclass(frozen=True, eq=False)
class BestServers:
    """The strongest cell at every pixel of an area, thinned to what a picture shows.

    Parameters
    ----------
    lattice : Lattice
        Of the arrays.
    server : numpy.ndarray of int32, shape (rows, cols)
        Index into the database's cells; -1 where none is heard.
    level_dbm : numpy.ndarray of float32, shape (rows, cols)
        NaN where nothing is predicted.
    margin_db : numpy.ndarray of float32, shape (rows, cols)
        Above the second best; infinite where there is none, NaN where none is heard.
    """

    lattice: Lattice
    server: NDArray[np.int32]
    level_dbm: NDArray[np.float32]
    margin_db: NDArray[np.float32]


def draw_network(
    rasters: RxLevRasters,
    database: RadioRouteDatabase,
    folder: Path,
    *,
    landuse: LandUseClasses | None = None,
    survey: SurveyEvidence | None = None,
) -> tuple[Path, ...]:
    """Draw a database and the rasters that it was built from.

    Coverage, best server, margin, points per cell, points of the site with the most cells; and,
    where they are given, land use and a survey. Large areas are thinned to what a picture can show
    and read in strips, so that memory stays bounded.

    Parameters
    ----------
    rasters : RxLevRasters
        Levels or losses; those of the survey where one is given.
    database : RadioRouteDatabase
    folder : Path
        Made where it is missing.
    landuse : LandUseClasses, optional
        On the database's lattice.
    survey : SurveyEvidence, optional

    Returns
    -------
    tuple of Path
        The pictures, in this order.

    Raises
    ------
    InputError
        Rasters and database are of different areas, or a raster is damaged.
    OutputError
        A picture cannot be written.
    """
    best = best_servers(rasters, database)
    base = BaseMap(best.lattice.bounds_m, attribution=database.attribution)
    plan = database.plan
    drawn = [folder / f"{name}.png" for name in ("coverage", "best-server", "margin")]
    plot_level(best.level_dbm, best.lattice, plan, base, drawn[0])
    plot_best_server(best.server, plan.ids, best.lattice, plan, base, drawn[1])
    plot_margin(best.margin_db, best.lattice, plan, base, drawn[2])
    drawn.append(draw_database(database, folder / "points-per-cell.png"))
    sites = Counter(cell.site for cell in plan.cells)
    site = sites.most_common(1)[0][0]
    drawn.append(draw_site(database, site, folder / "points-of-one-site.png"))
    if landuse is not None:
        whole = BaseMap(database.lattice.bounds_m, attribution=database.attribution)
        drawn.append(folder / "land-use.png")
        plot_landuse(landuse, database.lattice, whole, drawn[-1])
    if survey is not None:
        drawn.extend(draw_survey(survey, folder))
    return tuple(drawn)


def best_servers(rasters: RxLevRasters, database: RadioRouteDatabase) -> BestServers:
    """Return the best server, its level and its margin over the area of a database.

    Cells below the database's floor are not heard. Of areas wider than 2 000 pixels only every
    second, third... pixel is kept.

    Raises
    ------
    InputError
        Rasters and database are of different areas, or a raster is damaged.
    """
    window = _common_window(rasters.lattice, database)
    top, left, rows, cols = window
    step = ceil(max(rows, cols) / _MOST_PX)
    area = rasters.lattice.window(*window)
    thinned = replace(
        area, resolution_m=step * area.resolution_m, rows=ceil(rows / step), cols=ceil(cols / step)
    )
    level_dbm = np.full((thinned.rows, thinned.cols), np.nan, dtype=np.float32)
    margin_db, server = level_dbm.copy(), np.full(level_dbm.shape, -1, dtype=np.int32)
    ids = [cell_id for cell_id in rasters.cell_ids if cell_id in database.plan]
    index = np.array([database.plan.index(cell_id) for cell_id in ids], dtype=np.int32)
    strip = step * max(_STRIP_PX // (step * cols * max(len(ids), 1)), 1)
    for first in range(0, rows if ids else 0, strip):
        height = min(strip, rows - first)
        levels = rasters.read_levels_dbm(database.plan, (top + first, left, height, cols), ids)
        levels = np.where(np.isnan(levels), -np.inf, levels)[:, ::step, ::step]
        place = levels.argmax(axis=0)
        best = levels.max(axis=0)
        np.put_along_axis(levels, place[None], -np.inf, axis=0)
        second = levels.max(axis=0)
        floor_dbm = np.float32(database.floor_dbm)
        second[second < floor_dbm] = -np.inf
        heard = best >= floor_dbm
        here = slice(first // step, first // step + len(best))
        server[here] = np.where(heard, index[place], -1)
        level_dbm[here] = np.where(np.isfinite(best), best, np.nan)
        margin_db[here][heard] = best[heard] - second[heard]
    return BestServers(thinned, server, level_dbm, margin_db)


def classes_of_map(database: RadioRouteDatabase, heights_m: NDArray[np.floating]) -> LandUseClasses:
    """Return the land use that a street map tells: ways, squares, buildings, and the rest.

    Parameters
    ----------
    database : RadioRouteDatabase
        Its points are what is walkable.
    heights_m : (rows, cols) array
        Building heights on the database's lattice, 0 where there is none.
    """
    points = database.points()
    code = np.where(heights_m > 0, 2, 3)
    code[points.row, points.col] = np.where(points.on_square, 1, 0)
    return LandUseClasses(
        code,
        ("way", "square", "building", "other"),
        (True, True, False, False),
        (BLUE, ORANGE, "#8c8c8c", "#eee9dd"),
    )


def draw_database(database: RadioRouteDatabase, path: Path) -> Path:
    """Draw all points grouped by the cell that serves them best (the paper's Fig. 4)."""
    return _draw_points(database, database.cell_ids, path, "Points by best server")


def draw_site(database: RadioRouteDatabase, site: str, path: Path) -> Path:
    """Draw the points that the sectors of one site serve best (the paper's Fig. 2)."""
    cells = [cell.id for cell in database.plan.cells if cell.site == site]
    return _draw_points(database, cells, path, f"Points served by site {site}")


def draw_track(
    database: RadioRouteDatabase, log: TrackLog, track: PositionedTrack, folder: Path
) -> tuple[Path, ...]:
    """Draw one located log: candidates thinning out (Fig. 1), the track, error over distance."""
    base, truth, drawn = _streets(database), truth_of(log), []
    if track.snapshots:
        drawn.append(folder / "candidates.png")
        plot_candidates(choose_snapshots(track.snapshots), truth, base, drawn[-1])
    drawn.append(folder / "track.png")
    plot_track(track.estimate, truth, base, drawn[-1])
    if truth is not None:
        drawn.append(folder / "error.png")
        plot_error_over_distance(track.estimate, truth, drawn[-1])
    return tuple(drawn)


def choose_snapshots(snapshots: Sequence[Snapshot]) -> list[Snapshot]:
    """Choose at most six: the first, the last, and between them even steps of the thinning out.

    Steps are even in the logarithm of the number of hypotheses, because that is how it falls.
    """
    if len(snapshots) <= MAX_PANELS:
        return list(snapshots)
    counts = np.array([max(s.hypothesis_east_m.size, 1) for s in snapshots])
    last = len(snapshots) - 1
    depth = np.log(counts[0] / counts) + 1e-9 * np.arange(len(snapshots))
    chosen = {0, last}
    for goal in np.linspace(0, depth[last], MAX_PANELS)[1:-1]:
        free = [i for i in range(1, last) if i not in chosen]
        chosen.add(free[int(np.argmin(np.abs(depth[free] - goal)))])
    return [snapshots[i] for i in sorted(chosen)]


def _draw_points(
    database: RadioRouteDatabase, cells: Sequence[str], path: Path, title: str
) -> Path:
    points = database.points()
    east_m, north_m = database.lattice.east_north(points.row, points.col)
    served = {cell: points.best_server == database.plan.index(cell) for cell in cells}
    plot_points_per_cell(
        {cell: (east_m[best], north_m[best]) for cell, best in served.items()},
        database.plan,
        _streets(database),
        path,
        title=title,
        resolution_m=database.lattice.resolution_m,
    )
    return path


def _common_window(lattice: Lattice, database: RadioRouteDatabase) -> tuple[int, int, int, int]:
    """Return the pixels of the rasters that the database covers: row, col, rows, cols."""
    west, south, east, north = database.lattice.bounds_m
    # A hair inside, so that an edge on a pixel's edge takes no pixel beyond it.
    hair_m = 1e-6 * lattice.resolution_m
    top, left = lattice.row_col(west + hair_m, north - hair_m)
    bottom, right = lattice.row_col(east - hair_m, south + hair_m)
    top, left = max(int(top), 0), max(int(left), 0)
    rows = min(int(bottom), lattice.rows - 1) - top + 1
    cols = min(int(right), lattice.cols - 1) - left + 1
    if not same_crs(lattice.crs, database.lattice.crs) or rows < 1 or cols < 1:
        expected = "rasters of the database's area and CRS"
        raise fail(InputError, str(database.path), expected, "others", "built from other rasters")
    return top, left, rows, cols


def _streets(database: RadioRouteDatabase) -> BaseMap:
    """Return the base map of a database: its points, and whose map they come from."""
    points, lattice = database.points(), database.lattice
    return BaseMap(
        lattice.bounds_m,
        points_m=np.stack(lattice.east_north(points.row, points.col), axis=-1),
        attribution=database.attribution,
        resolution_m=lattice.resolution_m,
    )
