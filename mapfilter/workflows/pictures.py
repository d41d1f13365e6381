"""Which pictures a replay gets."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.evaluation.accuracy import Truth
from mapfilter.positioning.estimate import PositionedTrack, Snapshot
from mapfilter.report.belief import MAX_PANELS, plot_belief, plot_candidates
from mapfilter.report.canvas import save
from mapfilter.report.errors import plot_error_over_distance, plot_evidence
from mapfilter.report.track import plot_track
from mapfilter.tracks.log import TrackLog
from mapfilter.workflows.network_pictures import street_map
from mapfilter.workflows.served import served_points

_SQUARE_M = 5.0


def draw_track(
    database: RadioRouteDatabase, log: TrackLog, track: PositionedTrack, folder: Path
) -> tuple[Path, ...]:
    """Draw one located log: its belief at a few moments, the track, error and evidence.

    Of the candidate filter these are candidates thinning out (Fig. 1 of the paper).
    """
    base, truth = street_map(database, served_points(database)), Truth.of_table(log.truth)
    drawn = []
    estimate, evidence = track.estimate, track.estimate.evidence
    if track.snapshots and evidence is None:
        chosen = choose_snapshots(track.snapshots, _candidates)
        drawn.append(save(plot_candidates(chosen, truth, base), folder / "candidates.png"))
    elif track.snapshots:
        chosen = choose_snapshots(track.snapshots, _places)
        drawn.append(save(plot_belief(chosen, truth, base), folder / "belief.png"))
    drawn.append(save(plot_track(estimate, truth, base), folder / "track.png"))
    if truth is not None:
        drawn.append(save(plot_error_over_distance(estimate, truth), folder / "error.png"))
    if evidence is not None and len(estimate):
        drawn.append(save(plot_evidence(estimate, truth), folder / "evidence.png"))
    return tuple(drawn)


def choose_snapshots(
    snapshots: Sequence[Snapshot], spread: Callable[[Snapshot], float]
) -> list[Snapshot]:
    """Choose at most six: the first, the last, and between them even steps of the thinning out.

    Steps are even in the logarithm of ``spread``, the number of places that a belief is spread
    over, because that is how it falls.
    """
    if len(snapshots) <= MAX_PANELS:
        return list(snapshots)
    counts = np.array([max(spread(s), 1.0) for s in snapshots])
    last = len(snapshots) - 1
    depth = np.log(counts[0] / counts) + 1e-9 * np.arange(len(snapshots))
    chosen = {0, last}
    for goal in np.linspace(0, depth[last], MAX_PANELS)[1:-1]:
        free = [i for i in range(1, last) if i not in chosen]
        chosen.add(free[int(np.argmin(np.abs(depth[free] - goal)))])
    return [snapshots[i] for i in sorted(chosen)]


def _candidates(snapshot: Snapshot) -> float:
    return float(snapshot.hypothesis_east_m.size)


def _places(snapshot: Snapshot) -> float:
    """Return the effective number of squares that a belief of probabilities is spread over."""
    if not snapshot.weight.size:
        return 0.0
    at_m = np.array([snapshot.hypothesis_east_m, snapshot.hypothesis_north_m])
    _, square = np.unique(np.round(at_m / _SQUARE_M), axis=1, return_inverse=True)
    mass = np.bincount(square.ravel(), snapshot.weight)
    mass = mass[mass > 0]
    return float(np.exp(-np.sum(mass * np.log(mass))))
