"""Whole epochs of a Kalman-type filter, with numbers by hand."""

from dataclasses import replace
from math import cos, hypot, inf, nan, sin

import numpy as np
import pytest

from mapfilter.filters.contract import MotionStep, Reason, Status
from mapfilter.filters.gaussian import EKF
from mapfilter.models.state import MOVING
from mapfilter.positioning.epochs import Epoch, GnssFix, ReportRow
from mapfilter.positioning.kalman.belief import SumBelief
from mapfilter.positioning.kalman.lasting import extended_layout
from mapfilter.positioning.kalman.models import KalmanOptions, SiteModels
from mapfilter.positioning.kalman.place import belief_tail, place_of
from mapfilter.positioning.kalman.reckoning import RECKONED
from mapfilter.positioning.kalman.state import KalmanState
from mapfilter.positioning.kalman.step import KalmanStep
from mapfilter.radio.cells import Cell, CellPlan

CRS, EAST, NORTH = "EPSG:32629", 500_000.0, 4_600_000.0
PLAN = CellPlan(CRS, (Cell("A", "A", EAST, NORTH, 30.0, None, 50.0, 1800.0, "omni"),))
OPTIONS = KalmanOptions(timing_step_m=100.0, timing_sd_m=1.0, fix_lasting_share=0.0)


def begun(options=OPTIONS, *, sd_m=50.0, east_m=2000.0, layout=RECKONED, **more):
    """A filter whose belief lies east of the site, at 10 s."""
    place, known = (EAST + east_m, 3.0, NORTH, 4.0), np.ones(4)
    if layout is RECKONED:
        # Headings and lengths of steps have no errors that last.
        place, known = (EAST + east_m, NORTH, 0.0, 0.0, 0.0), np.array([1.0, 1.0, 0.0, 0.0, 0.0])
    belief = SumBelief.start(place, np.diag(known * sd_m**2))
    given = {"belief": belief, "time_s": 10.0, "moved_m": inf} | more
    return KalmanStep(SiteModels(PLAN, options), EKF, KalmanState(layout, **given))


def timed(steps, level_dbm=nan):
    return (ReportRow("serving", "A", None, None, level_dbm, 0, steps),)


@pytest.mark.parametrize(("steps", "measured_m"), [(17.0, 1750.0), (20.0, 2050.0)])
def test_a_timing_advance_stands_for_the_middle_of_its_step(steps, measured_m):
    work = begun()
    fix = work.take(Epoch(10.0, radio=timed(steps)))
    noise = 1.0 + 100.0**2 / 12
    gain = 2500.0 / (2500.0 + noise)
    assert fix.east_m - EAST == pytest.approx(2000.0 + gain * (measured_m - 2000.0))
    assert fix.north_m == pytest.approx(NORTH)
    assert (fix.reason, work.moved_m) == (Reason.USED, 0.0)
    assert fix.covariance_m2[0, 0] == pytest.approx((1 - gain) * 2500.0)


def test_a_start_by_a_timing_advance_lies_all_around_the_site():
    work = KalmanStep(SiteModels(PLAN, OPTIONS), EKF, KalmanState(RECKONED))
    fix = work.take(Epoch(0.0, radio=timed(17.0)))
    assert (fix.east_m, fix.north_m) == pytest.approx((EAST, NORTH), abs=1.0)
    # Of 18 parts, as 11 km are cut into pieces of 600 m; half of a circle's square on each axis.
    assert fix.hypotheses == 18
    assert np.diag(fix.covariance_m2) == pytest.approx([1750.0**2 / 2] * 2, rel=0.15)
    assert fix.mass_50m < 1 / 18


def test_reports_in_a_row_count_as_one():
    """An error lasts for 500 m: after 20 m the variance is 25 times as large."""
    work = begun(moved_m=20.0)
    work.take(Epoch(10.0, radio=timed(17.0)))
    gain = 2500.0 / (2500.0 + 25 * (1.0 + 100.0**2 / 12))
    assert work.belief.moments.mean[0] - EAST == pytest.approx(2000.0 - gain * 250.0)


@pytest.mark.parametrize(("step_m", "sampling_m2"), [(4.0, 9.0), (-4.0, 9.0), (0.0, 0.0)])
def test_the_sampling_of_steps_widens_a_belief(step_m, sampling_m2):
    work = begun()
    work.take(Epoch(10.0, (MotionStep(step_m, 0.5, sampling_sd_m=3.0),)))
    along, across = np.array([cos(0.5), sin(0.5)]), np.array([-sin(0.5), cos(0.5)])
    expected = (2500.0 + sampling_m2) * np.eye(2) + 0.09 * np.outer(along, along)
    expected += (0.2 * step_m) ** 2 * np.outer(across, across)
    np.testing.assert_allclose(work.belief.covariances[0, :2, :2], expected)
    np.testing.assert_allclose(work.belief.means[0, :2], [EAST + 2000.0, NORTH] + step_m * along)


def test_where_errors_of_fixes_last_their_place_is_a_part_of_the_state():
    lasting = replace(OPTIONS, fix_lasting_m=6.0, start_sd_m=100.0)
    state = KalmanState(extended_layout(RECKONED))
    work = KalmanStep(SiteModels(PLAN, lasting), EKF, state)
    fix = work.take(Epoch(0.0, gnss=GnssFix(EAST, NORTH, 100.0, 100.0, 0.0)))
    assert work.belief.means.shape == (1, 7)
    # 64 of the fix's 100 m² are white, the rest lasts; a start is known to 100 m.
    place_m2 = 10_000.0 + 36.0
    gain = 10_000.0 / (place_m2 + 64.0)
    assert fix.covariance_m2[0, 0] == pytest.approx(10_000.0 - gain * 10_000.0)
    # It is white with a time of 30 s: 15 s later a part of exp(-1/2) is left.
    work.take(Epoch(15.0))
    kept = np.exp(-0.5)
    before = KalmanStep(SiteModels(PLAN, lasting), EKF, state)
    before.take(Epoch(0.0, gnss=GnssFix(EAST, NORTH, 100.0, 100.0, 0.0)))
    old = before.belief.covariances[0]
    off_m2 = old[5, 5] - 2 * old[0, 5] + old[0, 0]
    new = work.belief.covariances[0]
    assert new[5, 5] - 2 * new[0, 5] + new[0, 0] == pytest.approx(
        kept**2 * off_m2 + (1 - kept**2) * 36.0
    )


@pytest.mark.parametrize("seconds", [0.0, -4.0, 4.0])
def test_without_dead_reckoning_a_belief_goes_on_at_its_speed(seconds):
    work = begun(layout=MOVING, moved_m=7.0)
    fix = work.take(Epoch(10.0 + seconds))
    gone_s = max(seconds, 0.0)
    assert fix.east_m - EAST == pytest.approx(2000.0 + 3.0 * gone_s)
    assert fix.north_m - NORTH == pytest.approx(4.0 * gone_s)
    assert (work.moved_m, work.time_s) == (pytest.approx(7.0 + 5.0 * gone_s), 10.0 + seconds)
    assert fix.reason is Reason.NO_READING
    assert work.motion[0].shape == (4, 4)


def test_with_a_velocity_a_fix_that_repeats_itself_shows_a_standstill():
    same = GnssFix(EAST + 2000.0, NORTH, 25.0, 25.0, 0.0)
    for layout, used in ((MOVING, True), (RECKONED, False)):
        work = begun(layout=layout, last_fix=same)
        fix = work.take(Epoch(10.0, gnss=same))
        assert (fix.reason is Reason.USED) is used
        assert [one.reason for one in work.unused] == ([] if used else [Reason.REPEATED_FIX])
        assert work.last_fix is same


@pytest.mark.parametrize(
    ("radio", "reason"),
    [((), Reason.NO_READING), (timed(nan), Reason.UNKNOWN_CELL),
     ((ReportRow("serving", "Z", None, None, -70.0, 0),), Reason.UNKNOWN_CELL)],
)  # fmt: skip
def test_epochs_without_a_measurement(radio, reason):
    work = begun()
    assert work.take(Epoch(10.0, radio=radio)).reason is reason
    assert work.moved_m == inf


@pytest.mark.parametrize(("before", "status"), [(Status.SEARCHING, Status.CONVERGED),
                                               (Status.CONVERGED, Status.TRACKING)])  # fmt: skip
def test_a_narrow_belief_has_converged(before, status):
    work = begun(status=before)
    fix = work.take(Epoch(10.0))
    assert (fix.status, work.state.status, fix.hypotheses) == (status, status, 1)
    wide = begun(sd_m=500.0, status=before).take(Epoch(10.0))
    assert wide.status is (Status.SEARCHING if before is Status.SEARCHING else Status.UNCERTAIN)


def test_place_and_tail_are_those_of_east_and_north():
    covariance = np.diag([100.0, 1.0, 100.0, 1.0])
    means = np.array([[10.0, 1.0, 20.0, 2.0], [30.0, 1.0, 40.0, 2.0]])
    belief = SumBelief(np.array([0.75, 0.25]), means, np.array([covariance] * 2), np.arange(2))
    tail = belief_tail(belief, [0, 2])
    np.testing.assert_allclose(tail.offsets_m, [[-5.0, -5.0], [15.0, 15.0]])
    np.testing.assert_allclose(tail.covariances_m2, [100.0 * np.eye(2)] * 2)
    found = place_of(belief.leading, [0, 2])
    assert (found["east_m"], found["north_m"], found["way_id"]) == (10.0, 20.0, 0)
    np.testing.assert_allclose(found["radii_m"], 10.0 * np.sqrt(-2 * np.log([0.5, 0.33, 0.05])))
    assert found["mass_50m"] == pytest.approx(1 - np.exp(-12.5))
    # Of several parts it is that about the leading one.
    places, known = np.pad(means[:, [0, 2]], ((0, 0), (0, 3))), np.diag([100.0, 100.0, *[1e-6] * 3])
    work = begun(belief=replace(belief, means=places, covariances=np.array([known] * 2)))
    assert work.take(Epoch(10.0)).mass_50m == pytest.approx(0.75 * (1 - np.exp(-12.5)))
    assert hypot(*work.belief.moments.mean[:2]) == pytest.approx(hypot(15.0, 25.0))


def fixed(fix, **more):
    """The variances and the covariance of east and north after a fix, of a belief of 50 m."""
    work = begun(**more)
    work.take(Epoch(10.0, gnss=fix))
    return work.belief.covariances[0, :2, :2]


def joined(noise_m2):
    """Kalman's: the inverses of the covariances of belief and fix add up."""
    return np.linalg.inv(np.eye(2) / 2500.0 + np.linalg.inv(noise_m2))


def test_errors_of_a_fix_of_less_than_a_metre_are_believed():
    """Half a metre to each side, whatever the option says of fixes that state nothing."""
    found = fixed(GnssFix(EAST + 2000.0, NORTH, 0.25, 0.25, 0.0))
    np.testing.assert_allclose(found, joined(0.25 * np.eye(2)), rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize(
    "stated",
    [(100.0, 100.0, 100.0), (0.0, 4.0, 0.0), (-4.0, -4.0, 0.0), (4.0, nan, 0.0), (4.0, 1.0, 3.0)],
)
def test_errors_of_a_fix_that_no_law_has_are_those_of_one_without(stated):
    """Such as errors along a line alone: the determinant is 0. The option says 7 m."""
    options = replace(OPTIONS, fix_sd_m=7.0)
    found = fixed(GnssFix(EAST + 2000.0, NORTH, *stated), options=options)
    np.testing.assert_allclose(found, joined(49.0 * np.eye(2)), rtol=1e-6, atol=1e-6)


def test_errors_of_fixes_last_however_small_they_are():
    """Of 4 m², which a fix states, a quarter lasts: 0.5 m on each axis, squared."""
    options = replace(OPTIONS, fix_lasting_m=0.5)
    work = KalmanStep(SiteModels(PLAN, options), EKF, KalmanState(extended_layout(RECKONED)))
    work.take(Epoch(0.0, gnss=GnssFix(EAST, NORTH, 4.0, 4.0, 0.0)))
    assert work.belief.means.shape == (1, 7)


def test_before_the_first_measurement_there_is_no_tail():
    work = KalmanStep(SiteModels(PLAN, OPTIONS), EKF, KalmanState(RECKONED))
    work.take(Epoch(0.0))
    assert work.tail is None
    assert begun().tail is not None


def test_without_a_time_before_no_time_has_passed():
    """So the belief, of 50 m, has not become wider by a random walk."""
    work = begun(time_s=nan)
    work.take(Epoch(10.0))
    np.testing.assert_allclose(work.belief.covariances[0, :2, :2], 2500.0 * np.eye(2))


def test_levels_that_are_not_used_are_told():
    work = begun()
    work.take(Epoch(10.0, radio=(ReportRow("serving", "Z", None, None, -70.0, 0),)))
    assert [(one.time_s, one.kind, one.what, one.reason) for one in work.unused] == [
        (10.0, "serving", "Z", Reason.UNKNOWN_CELL)
    ]
