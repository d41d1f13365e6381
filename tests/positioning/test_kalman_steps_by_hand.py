"""Where a Kalman-type filter begins at a vague fix, and the way beside which fixes are compared."""

from dataclasses import replace
from math import cos, nan, sin

import numpy as np
import pytest

from mapfilter.filters.contract import MotionStep, Status
from mapfilter.filters.gaussian import EKF
from mapfilter.models.state import MOVING
from mapfilter.positioning.epochs import Epoch, GnssFix
from mapfilter.positioning.gnss.wander import Way
from mapfilter.positioning.kalman.belief import SumBelief
from mapfilter.positioning.kalman.models import KalmanOptions, SiteModels
from mapfilter.positioning.kalman.readings import SiteReadings
from mapfilter.positioning.kalman.reckoning import RECKONED
from mapfilter.positioning.kalman.start import first_belief
from mapfilter.positioning.kalman.state import KalmanState
from mapfilter.positioning.kalman.step import KalmanStep
from mapfilter.radio.cells import Cell, CellPlan

CRS, EAST, NORTH = "EPSG:32629", 500_000.0, 4_600_000.0
PLAN = CellPlan(CRS, (Cell("A", "A", EAST, NORTH, 30.0, None, 50.0, 1800.0, "omni"),))
NOTHING = SiteReadings((), (), (), (), ())


def first(fix, *, plan=PLAN, layout=MOVING, **options):
    return first_belief(SiteModels(plan, KalmanOptions(**options)), layout, fix, NOTHING)


@pytest.mark.parametrize(
    ("sd_m", "across", "apart_m"),
    [
        # Three deviations to each side, in parts of 600 m at most; but no more than 21.
        (601.0, 8, 6 * 601.0 / 7),
        (1500.0, 16, 600.0),
        (1501.0, 17, 6 * 1501.0 / 16),
        (8000.0, 21, 2400.0),
    ],
)
def test_a_vague_fix_is_a_square_of_equal_parts(sd_m, across, apart_m):
    # The variance along one axis is the mean of both.
    given = GnssFix(EAST + 70.0, NORTH - 40.0, 0.5 * sd_m**2, 1.5 * sd_m**2)
    belief = first(given)
    assert belief.weights.tolist() == [1 / across**2] * across**2
    steps_m = apart_m * (np.arange(across) - (across - 1) / 2)
    east_m, north_m = (belief.means[:, axis].reshape(across, across) for axis in (0, 2))
    np.testing.assert_allclose(east_m, np.tile(EAST + 70.0 + steps_m, (across, 1)))
    np.testing.assert_allclose(north_m, np.tile(NORTH - 40.0 + steps_m, (across, 1)).T)
    assert not belief.means[:, [1, 3]].any()
    own = np.diag([apart_m / 1.6, 8.0, apart_m / 1.6, 8.0]) ** 2
    np.testing.assert_allclose(belief.covariances, np.tile(own, (across**2, 1, 1)))


@pytest.mark.parametrize(
    ("sd_m", "plan", "wide_m"),
    [
        (600.0, PLAN, 6000.0), (150.0, PLAN, 1500.0), (151.0, PLAN, 1510.0), (3.0, PLAN, 1500.0),
        # No range is bent where there are no sites.
        (8000.0, CellPlan(CRS, ()), 80_000.0),
    ],
)  # fmt: skip
def test_about_another_fix_a_belief_is_wide(sd_m, plan, wide_m):
    belief = first(GnssFix(EAST, NORTH, sd_m**2, sd_m**2), plan=plan)
    assert belief.means.tolist() == [[EAST, 0.0, NORTH, 0.0]]
    np.testing.assert_allclose(belief.covariances[0], np.diag([wide_m, 8.0, wide_m, 8.0]) ** 2)


def test_how_many_parts_a_vague_fix_has_is_an_option():
    vague = GnssFix(EAST, NORTH, 8000.0**2, 8000.0**2)
    assert first(vague, start_parts=2).weights.size == 4
    assert first(vague, start_parts=1).weights.size == 1
    assert first(vague, layout=RECKONED, start_parts=2).means.shape == (4, 5)


def walking(mean=(0.0, 0.0, 0.0, 0.0, 0.0), variance=1e-12):
    """Return a walk that is known all but exactly, at 10 s."""
    sites = SiteModels(CellPlan(CRS, ()), KalmanOptions(fix_lasting_share=0.0))
    made = KalmanStep(sites, EKF, KalmanState(RECKONED))
    made.belief = SumBelief.start(np.array(mean), variance * np.eye(5))
    made.time_s, made.status, made.moved_m = 10.0, Status.TRACKING, 0.0
    return made


@pytest.mark.parametrize(
    ("turned_rad", "scale"), [(0.0, 0.0), (0.4, 0.0), (0.0, 0.1), (-2.0, 0.05)]
)
def test_the_way_of_steps_is_by_headings_as_measured(turned_rad, scale):
    """And by lengths as they are known to be."""
    made = walking((100.0, 200.0, turned_rad, scale, 0.0))
    made.fixes = made.fixes._replace(way=Way(7.0, -3.0, 2))
    made.take(Epoch(11.0, (MotionStep(2.0, 0.3), MotionStep(3.0, 1.2))))
    long = 1 + scale
    assert made.fixes.way.east_m == pytest.approx(7.0 + long * (2 * cos(0.3) + 3 * cos(1.2)))
    assert made.fixes.way.north_m == pytest.approx(-3.0 + long * (2 * sin(0.3) + 3 * sin(1.2)))
    assert made.fixes.way.gaps == 2
    # Where one is goes by both.
    ways = [one + turned_rad for one in (0.3, 1.2)]
    at = made.belief.moments.mean[:2]
    expected = [2 * cos(ways[0]) + 3 * cos(ways[1]), 2 * sin(ways[0]) + 3 * sin(ways[1])]
    np.testing.assert_allclose(at, [100.0, 200.0] + long * np.array(expected), atol=1e-6)
    assert made.moved_m == 5.0


@pytest.mark.parametrize(
    ("steps", "gaps", "moved_m"),
    [
        ((MotionStep(2.0, 0.3),), 0, 2.0),
        ((MotionStep(-2.0, 0.3), MotionStep(1.0, 0.3)), 0, 3.0),
        # No direction, no length, or a way that is known by its spread alone.
        ((MotionStep(2.0, nan), MotionStep(1.0, 0.1)), 1, 3.0),
        ((MotionStep(nan, 0.3),), 1, 0.0),
        ((MotionStep(2.0, 0.3, nan, 4.0), MotionStep(2.0, 0.3, nan, 4.0)), 2, 4.0),
        ((), 0, 0.0),
    ],
)
def test_what_is_not_measured_of_a_way_is_a_gap(steps, gaps, moved_m):
    made = walking()
    made.take(Epoch(11.0, steps))
    assert made.fixes.way.gaps == gaps
    assert made.moved_m == moved_m


def test_a_fix_is_compared_with_the_way_until_it():
    made = walking(variance=1.0)
    made.take(Epoch(11.0, (MotionStep(6.0, 0.0),)))
    assert made.fixes.gone_m == pytest.approx(6.0)
    made.take(Epoch(12.0, (MotionStep(7.0, np.pi / 2),)))
    assert made.fixes.gone_m == pytest.approx(85**0.5)
    made.take(Epoch(13.0, (MotionStep(1.0, np.pi / 2),), gnss=GnssFix(6.0, 8.0, 25.0, 25.0)))
    assert made.fixes.gone_m == 0.0
    (row,) = made.fixes.wander.rows
    assert (row.time_s, row.sd_m, row.gaps) == (13.0, 5.0, 0)
    assert (row.way_east_m, row.way_north_m) == pytest.approx((6.0, 8.0))
    assert (row.east_m, row.north_m) == (6.0, 8.0)


def test_a_fix_that_repeats_the_last_is_none_beside_steps():
    made = walking(variance=1.0)
    fix = GnssFix(0.5, 0.0, 25.0, 25.0)
    other = replace(fix, north_m=1.0)
    for time_s, given, count in ((11.0, fix, 1), (17.0, fix, 1), (23.0, other, 2)):
        made.take(Epoch(time_s, (MotionStep(0.9, 0.0),), gnss=given))
        assert len(made.fixes.wander.rows) == count
