"""Fixes and tracks of fixes."""

from dataclasses import fields, replace
from math import nan

import numpy as np
import pytest

from mapfilter.errors import InputError
from mapfilter.filters.contract import Reason, Status
from mapfilter.positioning.estimate import Fix, TrackEstimate


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
