"""Which pictures a replay gets."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.positioning.global_positioning import PositionedTrack
from mapfilter.positioning.snapshot import Snapshot
from mapfilter.report.candidates import MAX_PANELS, plot_candidates
from mapfilter.report.error_curve import plot_error_over_distance
from mapfilter.report.track import plot_track
from mapfilter.tracks.log import TrackLog
from mapfilter.workflows.network_pictures import street_map
from mapfilter.workflows.served import served_points
from mapfilter.workflows.truth import truth_of


def draw_track(
    database: RadioRouteDatabase, log: TrackLog, track: PositionedTrack, folder: Path
) -> tuple[Path, ...]:
    """Draw one located log: candidates thinning out (Fig. 1), the track, error over distance."""
    base, truth = street_map(database, served_points(database)), truth_of(log)
    drawn = []
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
