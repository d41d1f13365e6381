"""What the titles of pictures say."""

import numpy as np
import pytest
from matplotlib.axes import Axes

from mapfilter.evaluation.truth import Truth
from mapfilter.filters.contract import Reason, Status
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.positioning.positioned_track import Snapshot
from mapfilter.positioning.step_output import Fix
from mapfilter.report.basemap import BaseMap
from mapfilter.report.saving import save
from mapfilter.report.snapshots import plot_candidates
from mapfilter.report.track import plot_track

CRS = "EPSG:32635"
EAST_M, NORTH_M = 385_000.0, 6_672_000.0
BASE = BaseMap((EAST_M, NORTH_M - 100, EAST_M + 300, NORTH_M + 100))
TRUTH = Truth(np.array([0.0, 200.0]), EAST_M + np.array([0.0, 280.0]), np.full(2, NORTH_M))
NOTHING = Truth(np.empty(0), np.empty(0), np.empty(0))


@pytest.fixture
def titles(monkeypatch):
    """Titles in the order in which they are set."""
    found, own = [], Axes.set_title

    def set_title(self, label, *args, **kwargs):
        found.append(label)
        return own(self, label, *args, **kwargs)

    monkeypatch.setattr(Axes, "set_title", set_title)
    return found


def track(*statuses, error_m=0.0):
    fixes = []
    for index, status in enumerate(statuses):
        time_s = 50.0 * index
        on = status in (Status.CONVERGED, Status.TRACKING)
        east_m = EAST_M + 1.4 * time_s if on else np.nan
        north_m = NORTH_M + error_m if on else np.nan
        fixes.append(
            Fix(
                time_s, east_m, north_m, np.full((2, 2), np.nan), np.full(3, np.nan), status,
                1, np.nan, 0, np.nan, Reason.USED,
            )
        )  # fmt: skip
    return TrackEstimate.of_fixes(CRS, "candidate", fixes)


SEARCHING, CONVERGED, TRACKING, UNCERTAIN, LOST, OUTSIDE = Status


@pytest.mark.parametrize(
    ("estimate", "truth", "title"),
    [
        (track(SEARCHING, SEARCHING), TRUTH, "did not converge"),
        (track(SEARCHING, LOST), TRUTH, "did not converge; lost at the end"),
        (track(SEARCHING, OUTSIDE), TRUTH, "did not converge; outside at the end"),
        (track(SEARCHING, CONVERGED), None, "converged after 50 s"),
        (track(SEARCHING, CONVERGED), NOTHING, "converged after 50 s"),
        (
            track(CONVERGED, TRACKING, error_m=7.2),
            TRUTH,
            "converged after 0 s, 7 m off; mean error then 7.2 m",
        ),
        (
            track(CONVERGED, LOST, error_m=80.0),
            TRUTH,
            "converged after 0 s, 80 m off (wrong); mean error then 80.0 m; lost at the end",
        ),
        (track(*[SEARCHING] * 5, CONVERGED), TRUTH, "converged after 250 s"),
        (track(), TRUTH, "did not converge"),
    ],
)
def test_a_track_says_what_came_of_it(estimate, truth, title, titles, tmp_path):
    save(plot_track(estimate, truth, BASE), tmp_path / "track.png")
    assert titles == [f"candidate filter: {title}"]


@pytest.mark.parametrize(
    ("truth", "title"),
    [
        (TRUTH, "140 m travelled, 2 candidates"),
        (None, "153 m by dead reckoning, 2 candidates"),
        (NOTHING, "153 m by dead reckoning, 2 candidates"),
    ],
)
def test_panels_say_true_metres_where_they_are_known(truth, title, titles, tmp_path):
    east_m, north_m = EAST_M + np.array([10.0, 20.0]), np.full(2, NORTH_M)
    seen = Snapshot(
        100.0, 153.0, east_m, north_m, np.full(2, 0.5), np.nan, np.nan, Status.SEARCHING
    )
    save(plot_candidates([seen], truth, BASE), tmp_path / "candidates.png")
    assert titles == [title]
