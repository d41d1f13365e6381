"""Which pictures a replay and a database get."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.positioning.global_positioning import PositionedTrack
from mapfilter.positioning.snapshot import Snapshot
from mapfilter.report.basemap import BaseMap
from mapfilter.report.candidates import MAX_PANELS, plot_candidates
from mapfilter.report.coverage import plot_points_per_cell
from mapfilter.report.error_curve import plot_error_over_distance
from mapfilter.report.track import plot_track
from mapfilter.tracks.log import TrackLog
from mapfilter.workflows.truth import truth_of


def draw_database(database: RadioRouteDatabase, path: Path, *, attribution: str = "") -> Path:
    """Draw all points grouped by the cell that serves them best (the paper's Fig. 4)."""
    points = database.points()
    east_m, north_m = database.lattice.east_north(points.row, points.col)
    groups = {
        cell_id: (east_m[points.best_server == index], north_m[points.best_server == index])
        for index, cell_id in enumerate(database.cell_ids)
    }
    plot_points_per_cell(
        groups,
        database.plan,
        BaseMap(database.lattice.bounds_m, attribution=attribution),
        path,
        title="Points by best server",
        resolution_m=database.lattice.resolution_m,
    )
    return path


def draw_site(
    database: RadioRouteDatabase, site: str, path: Path, *, attribution: str = ""
) -> Path:
    """Draw the points that the sectors of one site serve best (the paper's Fig. 2)."""
    points = database.points()
    east_m, north_m = database.lattice.east_north(points.row, points.col)
    groups = {
        cell.id: (east_m[points.best_server == index], north_m[points.best_server == index])
        for index, cell in enumerate(database.plan.cells)
        if cell.site == site
    }
    base = BaseMap(
        database.lattice.bounds_m,
        points_m=np.stack([east_m, north_m], axis=-1),
        attribution=attribution,
    )
    plot_points_per_cell(
        groups,
        database.plan,
        base,
        path,
        title=f"Points served by site {site}",
        resolution_m=database.lattice.resolution_m,
    )
    return path


def draw_track(
    database: RadioRouteDatabase,
    log: TrackLog,
    track: PositionedTrack,
    folder: Path,
    *,
    attribution: str = "",
) -> tuple[Path, ...]:
    """Draw one located log: candidates thinning out (Fig. 1), the track, error over distance."""
    points = database.points()
    east_m, north_m = database.lattice.east_north(points.row, points.col)
    base = BaseMap(
        database.lattice.bounds_m,
        points_m=np.stack([east_m, north_m], axis=-1),
        attribution=attribution,
    )
    truth, drawn = truth_of(log), []
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
