"""Where a Kalman-type filter begins at a site, and how far fixes may be ahead of it, by hand."""

from math import cos, inf, nan, pi, radians, sin

import numpy as np
import pytest

from mapfilter.filters.contract import MotionStep, Reason
from mapfilter.models.state import MOVING
from mapfilter.positioning.epochs import Epoch, GnssFix
from mapfilter.positioning.kalman.models import KalmanOptions, SiteModels
from mapfilter.positioning.kalman.readings import SiteReadings
from mapfilter.positioning.kalman.reckoning import RECKONED, Reckoning
from mapfilter.positioning.kalman.start import first_belief
from mapfilter.positioning.sensors.unmeasured import common_way_m2
from mapfilter.positioning.step_output import UnusedReading
from mapfilter.radio.cells import Cell, CellPlan

EAST, NORTH = 500_000.0, 4_600_000.0
PLAN = CellPlan("EPSG:32629", tuple(
    Cell(name, name, EAST + off_m, NORTH - off_m, 30.0, None, 50.0, 1800.0, "omni")
    for name, off_m in (("A", 0.0), ("B", 900.0))
))  # fmt: skip


def first(timed=(), steps=(), cells=("A",), layout=MOVING, **options):
    given = SiteReadings(cells, (-70.0,) * len(cells), timed, steps, ())
    sites = SiteModels(PLAN, KalmanOptions(**options))
    return first_belief(sites, layout, None, given)


@pytest.mark.parametrize(
    ("steps", "step_m", "radius_m", "count"),
    [
        # A part each 600 m of the circle: eight at least, and 64 at most.
        (0, 550.0, 275.0, 8), (2, 550.0, 1375.0, 14), (2, 600.0, 1500.0, 16),
        (30, 550.0, 16_775.0, 64),
    ],
)  # fmt: skip
def test_a_timing_advance_begins_a_circle_of_equal_parts(steps, step_m, radius_m, count):
    belief = first(("B", "A"), (steps, 9), timing_step_m=step_m)
    assert belief.weights.tolist() == [1 / count] * count
    east_m, north_m = belief.means[:, 0] - EAST - 900.0, belief.means[:, 2] - NORTH + 900.0
    np.testing.assert_allclose(np.hypot(east_m, north_m), radius_m, rtol=1e-6)
    angles = np.unwrap(np.arctan2(north_m, east_m))
    np.testing.assert_allclose(angles, 2 * pi * np.arange(count) / count, atol=1e-6)
    wide_m = max(600.0, 0.7 * 2 * pi * radius_m / count)
    np.testing.assert_allclose(
        belief.covariances[0], np.diag([wide_m**2, 64.0, wide_m**2, 64.0]), rtol=1e-9
    )
    assert not belief.means[:, [1, 3]].any()


def test_a_cell_alone_begins_about_its_site():
    belief = first(cells=("B", "A"), start_sd_m=1200.0, start_parts=3)
    assert belief.weights.size == 9
    mean, covariance = belief.moments.mean, belief.moments.covariance
    np.testing.assert_allclose(mean, [EAST + 900.0, 0.0, NORTH - 900.0, 0.0], atol=1e-3)
    np.testing.assert_allclose(np.diag(covariance)[[0, 2]], 1200.0**2, rtol=0.05)
    one = first(cells=("A",), layout=RECKONED, start_parts=1)
    assert one.means.tolist() == [[EAST, NORTH, 0.0, 0.0, 0.0]]


WAY = Reckoning(headless_m=30.0, before_m=90.0, origin=(100.0, 200.0, 40.0))
"""80 m of a way without headings since its first fix."""


@pytest.mark.parametrize(
    ("east_m", "north_m", "sd_m", "lags"),
    # One and a half of the way, and four deviations of the fix.
    [(100.0, 359.9, 10.0, True), (100.0, 360.1, 10.0, False), (340.1, 200.0, 30.0, False),
     (339.9, 200.0, 30.0, True), (172.0, 296.0, 0.01, True), (172.1, 296.1, 0.01, False)],
)  # fmt: skip
def test_how_far_ahead_a_fix_may_be_on_a_way_without_headings(east_m, north_m, sd_m, lags):
    found = WAY.astray_m2(GnssFix(east_m, north_m), sd_m**2)
    assert found == (common_way_m2(30.0, 90.0) if lags else 0.0)


def test_where_turns_are_measured_nothing_lags_behind():
    fix = GnssFix(100.0, 200.0)
    assert WAY.astray_m2(fix, 1.0) > 0
    for reckoning in (
        Reckoning(headless_m=30.0, before_m=90.0),
        Reckoning(headless_m=30.0, before_m=90.0, origin=(100.0, 200.0, 40.0), turned_s=5.0),
    ):
        assert reckoning.astray_m2(fix, 1.0) == 0.0


def test_a_fix_that_is_used_counts_the_way_before_it():
    after = WAY.positioned(9.0)
    assert (after.headless_m, after.before_m, after.fixed_s) == (0.0, 120.0, 9.0)
    assert after.origin == WAY.origin
    anew = WAY.begun()
    assert (anew.headless_m, anew.before_m, anew.origin, anew.fixed_s) == (0.0, 0.0, None, -inf)


def test_what_a_step_adds_along_and_across():
    """Of four rows of 0.2 m, 3 m at 0.5 rad, by a belief with 0.1 rad and a fifth more."""
    step = MotionStep(3.0, 0.5, sampling_sd_m=0.3, rows=4.0)
    options = KalmanOptions(step_sd_m=0.2, heading_sd_deg=6.0, drift_deg_per_sqrt_m=0.4)
    errors = np.array([0.1, 0.2, 0.0])
    after, (transition, noise, shift), why = WAY.moved(step, 7.0, options, errors)
    assert why is Reason.USED
    # A direction ends the way without one.
    assert (after.headless_m, after.before_m, after.origin) == (0.0, 0.0, None)
    along = np.array([cos(0.6), sin(0.6)])
    across = np.array([-sin(0.6), cos(0.6)])
    cross_m2 = (3.0 * radians(6.0)) ** 2 / 4
    expected = 4 * 0.04 * np.outer(along, along) + cross_m2 * np.outer(across, across)
    np.testing.assert_allclose(noise[:2, :2], expected + 0.09 * np.eye(2))
    assert noise[2, 2] == pytest.approx(radians(0.4) ** 2 * 3.0)
    np.testing.assert_allclose(transition[:2, 2], 3.6 * across)
    np.testing.assert_allclose(transition[:2, 3], 3.0 * along)
    mean = np.array([0.0, 0.0, *errors])
    np.testing.assert_allclose((transition @ mean + shift)[:2], 3.6 * along)


def test_motion_that_was_not_measured_is_said_and_still_turns():
    row = MotionStep(nan, nan, 0.3)
    after, epoch, unused = Reckoning().watched(Epoch(4.0, (row,)))
    assert unused == [UnusedReading(4.0, "motion", "", Reason.NO_STEP)]
    assert after.watch.times.epoch_s == 4.0
    assert (0.0, 0.3) in [(one.step_m, one.turn_rad) for one in epoch.motion]
    assert Reckoning().watched(Epoch(4.0, (MotionStep(1.4, 0.3),)))[2] == []
