"""Fixes and tracks of fixes."""

from dataclasses import fields, replace
from math import nan

import numpy as np
import pytest

from mapfilter.errors import InputError
from mapfilter.filters.contract import Reason, Status
from mapfilter.positioning.estimate import TrackEstimate, TrackEvidence
from mapfilter.positioning.step_output import Fix, StepOutput, UnusedReading


def fix(time_s, status=Status.SEARCHING, east_m=nan):
    return Fix(
        time_s, east_m, 2 * east_m, np.eye(2) * 4, np.array([1.0, 2, 3]), status,
        7, 0.5, 1 << 40, 0.25, Reason.NOT_MOVED_ENOUGH,
    )  # fmt: skip


def track(*fixes):
    return TrackEstimate.of_fixes("EPSG:32629", "candidate", fixes, start_utc_s=5.0)


def test_fixes_put_together_come_out_again():
    given = [fix(0.0), fix(1.5, Status.CONVERGED, 3.0), fix(1.5, Status.TRACKING, 4.0)]
    estimate = track(*given)
    assert len(estimate) == 3
    for index, one in enumerate(given):
        for column in fields(Fix):
            assert np.array_equal(
                getattr(estimate.fix(index), column.name),
                getattr(one, column.name),
                equal_nan=column.name not in ("status", "reason"),
            )
    assert estimate.converged_at == 1


def test_an_empty_track_has_arrays_of_its_shapes():
    estimate = track()
    assert (len(estimate), estimate.converged_at) == (0, None)
    assert (estimate.covariance_m2.shape, estimate.radii_m.shape) == ((0, 2, 2), (0, 3))


def test_columns_of_other_lengths_and_bad_times_are_told_together():
    with pytest.raises(InputError) as caught:
        replace(track(fix(0.0), fix(1.0)), status=(), time_s=np.array([1.0, nan]))
    assert [f.where for f in caught.value.faults] == ["estimate, status", "estimate, time_s"]


@pytest.mark.parametrize("times", [[1.0, 0.5], [0.0, np.inf], [nan]])
def test_times_run_forward_and_are_finite(times):
    with pytest.raises(InputError, match="time_s"):
        track(*(fix(time_s) for time_s in times))


def test_nowhere_has_no_position():
    found = Fix.nowhere(3.0, Status.LOST, Reason.NO_READING)
    assert (found.time_s, found.status, found.reason) == (3.0, Status.LOST, Reason.NO_READING)
    assert (found.hypotheses, found.way_id) == (0, 0)
    assert (found.covariance_m2.shape, found.radii_m.shape) == ((2, 2), (3,))
    numbers = [found.east_m, found.north_m, found.mass_50m, found.way_probability,
               found.radius_99_m, found.protection_m]  # fmt: skip
    assert np.isnan([*numbers, *found.radii_m, *found.covariance_m2.ravel()]).all()
    assert UnusedReading(1.0, "gnss", "", Reason.NO_READING).readings == 1


class Tail:
    """A tail whose radius is ten times the share, and whose level is as many times the risk."""

    def radius_m(self, share):
        return 10.0 * share

    def protection_m(self, risk):
        return 1e4 * risk


@pytest.mark.parametrize(("largest_m", "wide_m"), [(3.0, 9.9), (12.0, 12.0)])
def test_what_follows_from_a_tail(largest_m, wide_m):
    """A radius of 99 %, no smaller than that of 95 %, and a level for the risk."""
    given = replace(fix(1.0, east_m=5.0), radii_m=np.array([1.0, 2.0, largest_m]))
    output = StepOutput(given, (1.0,) * 5, ("unused",))
    found = output.protected(Tail(), 1e-2)
    assert (found.fix.radius_99_m, found.fix.protection_m) == (wide_m, 100.0)
    assert output.protected(Tail()).fix.protection_m == 10.0
    assert (found.evidence, found.unused, found.fix.east_m) == ((1.0,) * 5, ("unused",), 5.0)
    assert output.protected(None) is output


def two(**more):
    """Fixes whose numbers all differ."""
    first = Fix(
        1.0, 2.0, 3.0, np.array([[4.0, 5.0], [5.0, 6.0]]), np.array([7.0, 8.0, 9.0]),
        Status.TRACKING, 10, 0.11, 12, 0.13, Reason.USED, 14.0, 15.0,
    )  # fmt: skip
    fixes = [first, Fix.nowhere(16.0, Status.LOST, Reason.NO_READING)]
    return TrackEstimate.of_fixes("EPSG:32629", "bayes", fixes, **more)


def test_a_track_as_a_table():
    table = two().to_dataframe()
    assert table.iloc[0].to_dict() == {
        "time_s": 1.0, "east_m": 2.0, "north_m": 3.0, "var_east_m2": 4.0, "var_north_m2": 6.0,
        "cov_east_north_m2": 5.0, "radius_50_m": 7.0, "radius_67_m": 8.0, "radius_95_m": 9.0,
        "radius_99_m": 14.0, "protection_m": 15.0, "status": str(Status.TRACKING),
        "hypotheses": 10, "mass_50m": 0.11, "way_id": 12, "way_probability": 0.13,
        "reason": str(Reason.USED),
    }  # fmt: skip
    assert (len(table), list(table["time_s"])) == (2, [1.0, 16.0])
    kept = TrackEvidence(*(np.array([k, k + 0.5]) for k in range(5)))
    more = two(evidence=kept).to_dataframe()
    assert list(more.columns)[-5:] == [one.name for one in fields(TrackEvidence)]
    assert more["log_evidence"].tolist() == [4.0, 4.5]
    assert isinstance(two().status, tuple)
    assert isinstance(two().reason, tuple)


def test_points_are_those_of_the_epochs_with_a_position():
    points = replace(two(), east_m=np.array([nan, 2.0])).to_geodataframe()
    assert (points.crs, list(points.index), list(points["time_s"])) == ("EPSG:32629", [0], [16.0])
    assert (points.geometry[0].x, np.isnan(points.geometry[0].y)) == (2.0, True)
    assert list(points.columns) == [*two().to_dataframe().columns, "geometry"]
    (point,) = two().to_geodataframe().geometry
    assert (point.x, point.y) == (2.0, 3.0)


@pytest.mark.parametrize("name", [one.name for one in fields(TrackEstimate)[3:-2]])
def test_every_column_has_a_value_for_each_epoch(name):
    with pytest.raises(InputError, match="estimate, "):
        replace(two(), **{name: getattr(two(), name)[:1]})


def test_times_may_repeat_and_rise_and_fall_nowhere():
    assert len(track(fix(1.0), fix(1.0), fix(2.0))) == 3
    for times in ([1.0, 3.0, 2.0], [1.0, 0.5, 3.0]):
        with pytest.raises(InputError, match="ascending"):
            track(*(fix(time_s) for time_s in times))
