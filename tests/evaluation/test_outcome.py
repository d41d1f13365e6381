"""What is told of a track without its truth, by hand."""

from dataclasses import astuple
from math import nan

import numpy as np
import pytest

from mapfilter.evaluation.outcome import outcome, pauses_s
from mapfilter.filters.contract import Reason, Status
from mapfilter.geodesy import project
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.positioning.step_output import Fix, UnusedReading

CRS = "EPSG:32635"


def estimate(*epochs, unused=()):
    fixes = [
        Fix(
            float(time_s), east_m, north_m, np.full((2, 2), nan), np.full(3, nan), status,
            1, nan, 0, nan, Reason.USED,
        )
        for time_s, (status, east_m, north_m) in enumerate(epochs)
    ]  # fmt: skip
    return TrackEstimate.of_fixes(CRS, "candidate", fixes, unused=unused)


def test_a_track_that_is_found_and_lost():
    places = project(CRS, [24.94, 24.95], [60.17, 60.18])
    (east_a, east_b), (north_a, north_b) = places
    unused = [
        UnusedReading(0.0, "serving", "X", Reason.UNKNOWN_CELL),
        UnusedReading(1.0, "serving", "Y", Reason.UNKNOWN_CELL),
        UnusedReading(2.0, "serving", "X", Reason.UNKNOWN_CELL),
        UnusedReading(2.0, "motion", "", Reason.NO_STEP),
        UnusedReading(0.0, "pseudorange", "", Reason.NOT_USED_BY_FILTER, 20_038),
    ]
    found = outcome(
        estimate(
            (Status.SEARCHING, nan, nan),
            (Status.CONVERGED, east_a, north_a),
            (Status.TRACKING, east_b, north_b),
            (Status.LOST, nan, nan),
            unused=unused,
        )
    )
    assert (found.final_status, found.switched, found.switch_time_s) == ("LOST", True, 1.0)
    assert found.epochs == 4
    assert found.epochs_by_status == {"SEARCHING": 1, "CONVERGED": 1, "TRACKING": 1, "LOST": 1}
    assert (found.last_lon_deg, found.last_lat_deg) == pytest.approx((24.95, 60.18), abs=1e-9)
    assert found.last_time_s == 2.0
    assert found.unused == {"no_step": 1, "not_used_by_filter": 20_038, "unknown_cell": 3}
    assert found.unknown_cells == {"X": 2, "Y": 1}
    assert found.seconds_by_status == {
        "SEARCHING": 1.0, "CONVERGED": 1.0, "TRACKING": 1.0, "LOST": 0.0,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("every_s", "pause_s", "missing_s"), [(1.0, 31.0, 31.0), (1.0, 30.0, 0.0), (20.0, 150.0, 0.0),
                                          (20.0, 201.0, 201.0)]
)  # fmt: skip
def test_pauses_belong_to_no_status(every_s, pause_s, missing_s):
    """They were counted for the status before them."""
    track = estimate(*((Status.TRACKING, 0.0, 0.0) for _ in range(9)))
    track.time_s[:] = np.arange(9.0) * every_s + np.where(np.arange(9) >= 5, pause_s - every_s, 0)
    found = outcome(track)
    whole_s = float(np.ptp(track.time_s))
    assert found.seconds_without_epochs == missing_s
    assert found.seconds_by_status == {"TRACKING": whole_s - missing_s}
    assert len(pauses_s(track)) == (missing_s > 0)
    assert pauses_s(track).sum() == (missing_s > 0) * (2 * 4 * every_s + pause_s)


def test_radii_are_those_of_located_epochs_and_of_the_last_position():
    statuses = (Status.SEARCHING, Status.CONVERGED, Status.TRACKING, Status.UNCERTAIN, Status.LOST)
    track = estimate(*((status, 0.0, 0.0) for status in statuses))
    track.radii_m[:, -1] = [900.0, 30.0, 20.0, 400.0, 500.0]
    found = outcome(track)
    assert found.radius_95_median_m == 30.0
    # Of a position that is lost nothing is claimed.
    assert np.isnan(found.radius_95_last_m)
    before = estimate(*((status, 0.0, 0.0) for status in statuses[:-1]))
    before.radii_m[:, -1] = track.radii_m[:-1, -1]
    assert outcome(before).radius_95_last_m == 400.0
    track.radii_m[:, -1] = nan
    assert np.isnan(outcome(track).radius_95_median_m)


@pytest.mark.parametrize("epochs", [(), ((Status.SEARCHING, nan, nan),)])
def test_a_track_that_is_nowhere(epochs):
    found = outcome(estimate(*epochs))
    assert found.final_status == ("SEARCHING" if epochs else "")
    assert not found.switched
    assert np.isnan([found.switch_time_s, found.last_lon_deg, found.last_lat_deg]).all()
    assert np.isnan([found.radius_95_median_m, found.radius_95_last_m]).all()
    assert found.seconds_by_status == ({"SEARCHING": 0.0} if epochs else {})
    assert astuple(found)[-2:] == ({}, {})
