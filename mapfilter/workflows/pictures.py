"""Which pictures a replay and a database get."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.positioning.global_positioning import PositionedTrack
from mapfilter.positioning.snapshot import Snapshot
from mapfilter.radio.rasters import RxLevRasters
from mapfilter.report.basemap import BaseMap
from mapfilter.report.candidates import MAX_PANELS, plot_candidates
from mapfilter.report.coverage import plot_level, plot_points_per_cell
from mapfilter.report.error_curve import plot_error_over_distance
from mapfilter.report.track import plot_track
from mapfilter.tracks.log import TrackLog
from mapfilter.workflows.truth import truth_of


def draw_coverage(rasters: RxLevRasters, database: RadioRouteDatabase, path: Path) -> Path:
    """Draw the level of the best server everywhere in the rasters."""
    levels_dbm = rasters.read_levels_dbm(database.plan)
    silent = np.isnan(levels_dbm).all(axis=0)
    best_dbm = np.where(silent, np.nan, np.nan_to_num(levels_dbm, nan=-np.inf).max(axis=0))
    base = BaseMap(rasters.lattice.bounds_m, attribution=database.attribution)
    plot_level(
        best_dbm, rasters.lattice, database.plan, base, path, title="Level of the best server"
    )
    return path


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


def _streets(database: RadioRouteDatabase) -> BaseMap:
    """Return the base map of a database: its points, and whose map they come from."""
    points, lattice = database.points(), database.lattice
    return BaseMap(
        lattice.bounds_m,
        points_m=np.stack(lattice.east_north(points.row, points.col), axis=-1),
        attribution=database.attribution,
        resolution_m=lattice.resolution_m,
    )
