"""Small parts of positioning by hand: fixes, radii, headings, ways, static fixes, the grid."""

from dataclasses import dataclass, replace
from math import cos, exp, hypot, inf, nan, pi, radians, sin, sqrt

import numpy as np
import pytest
import scalar_oracle as oracle
import small_area
from fusion_world import MOVING_3D
from scipy.special import ndtr, ndtri

from mapfilter.errors import InputError
from mapfilter.filters.contract import MotionStep
from mapfilter.models.motion import random_walk
from mapfilter.models.ranging import pseudoranges, timing_advances
from mapfilter.models.state import POSITION, POSITION_CLOCK_3D
from mapfilter.models.street_motion import MotionErrors
from mapfilter.models.way_map import MapWeights
from mapfilter.positioning.bayes.beliefs.first_hypotheses import Start
from mapfilter.positioning.bayes.beliefs.model import BayesModel
from mapfilter.positioning.bayes.grid import StreetGrid
from mapfilter.positioning.bayes.state import BayesState, DeadReckoning
from mapfilter.positioning.epochs import Epoch, GnssFix, ReportRow, headed
from mapfilter.positioning.gnss.fixes import FixTerm, refutation, widened
from mapfilter.positioning.kalman.place import gaussian_radii_m, share_within
from mapfilter.positioning.kalman.static_fix import (
    BAD_GEOMETRY,
    TOO_FEW,
    StaticFix,
    filter_fixes,
    static_fix,
)


def fix_at(dx, dy, **variances):
    """Log-likelihood of a place that lies (dx, dy) from a fix."""
    fix = GnssFix(510.0, 720.0, **variances)
    state = np.array([[10.0 + dx], [20.0 + dy], [0.0]], dtype=np.float32)
    return FixTerm(fix, (500.0, 700.0)).log_likelihood(state)[0]


def test_a_fix_is_a_clipped_gaussian():
    told = {"var_east_m2": 16.0, "var_north_m2": 25.0}
    assert fix_at(4.0, 0.0, **told) == pytest.approx(-0.5)
    assert fix_at(0.0, 10.0, **told) == pytest.approx(-2.0)
    assert fix_at(4.0, 5.0, **told) == pytest.approx(-1.0)
    inverse = np.linalg.inv([[16.0, 8.0], [8.0, 25.0]])
    off = np.array([3.0, -4.0])
    assert fix_at(*off, **told, cov_east_north_m2=8.0) == pytest.approx(-0.5 * off @ inverse @ off)
    # Without variances, or with one of them, 10 m are usual.
    assert fix_at(10.0, 0.0) == fix_at(0.0, -10.0) == pytest.approx(-0.5)
    assert fix_at(10.0, 0.0, var_east_m2=1.0) == pytest.approx(-0.5)
    # A metre is the least.
    assert fix_at(1.0, 0.0, var_east_m2=0.01, var_north_m2=0.01) == pytest.approx(-0.5)
    assert fix_at(0.0, 1.0, var_east_m2=0.01, var_north_m2=0.01) == pytest.approx(-0.5)
    # Five deviations are the most that counts.
    assert fix_at(49.0, 0.0) == pytest.approx(-0.5 * 4.9**2, rel=1e-6)
    assert fix_at(500.0, 0.0) == pytest.approx(-12.5)
    # A correlation of one is taken for 0.99.
    line = fix_at(4.0, 5.0, **told, cov_east_north_m2=30.0)
    assert line == pytest.approx(-1 / 1.99, rel=1e-5)
    line = fix_at(4.0, -5.0, **told, cov_east_north_m2=-30.0)
    assert line == pytest.approx(-1 / 1.99, rel=1e-5)


def test_a_widened_fix():
    wide = widened(GnssFix(1.0, 2.0, 4.0, 9.0, 1.5), 3.0)
    assert wide == GnssFix(1.0, 2.0, 12.0, 27.0, 4.5)
    for one in (GnssFix(1.0, 2.0), GnssFix(1.0, 2.0, 4.0), GnssFix(1.0, 2.0, nan, 4.0, 1.0)):
        assert widened(one, 3.0) == GnssFix(1.0, 2.0, 300.0, 300.0, 0.0)


def test_radii_of_round_and_of_narrow_beliefs():
    radii, share = gaussian_radii_m(49.0 * np.eye(2), 20.0)
    np.testing.assert_allclose(radii, 7 * np.sqrt(-2 * np.log([0.5, 0.33, 0.05])), rtol=1e-6)
    assert share == pytest.approx(1 - exp(-0.5 * (20 / 7) ** 2), rel=1e-9)
    # Ten times as long as wide: over the length, what lies within on the width.
    radii, share = gaussian_radii_m(np.diag([0.25, 25.0]), 5.0)
    x = np.linspace(-5.0, 5.0, 100_001)
    for radius, held in ((5.0, share), *zip(radii, (0.5, 0.67, 0.95), strict=True)):
        along = x * radius / 5.0
        # At both ends along may be rounded to beyond the radius.
        width = 2 * ndtr(np.sqrt(np.maximum(radius**2 - along**2, 0.0)) / 0.5) - 1
        total = np.sum(width * np.exp(-0.5 * (along / 5.0) ** 2)) * (along[1] - along[0])
        assert total / (5.0 * sqrt(2 * pi)) == pytest.approx(held, abs=1e-4)
    # A line: the quantiles of a normal number.
    radii, share = gaussian_radii_m(np.diag([1e-4, 100.0]), 0.0)
    np.testing.assert_allclose(radii, 10 * ndtri([0.75, 0.835, 0.975]), rtol=1e-5)
    assert share == pytest.approx(0.0, abs=1e-12)
    # Between: against many draws.
    covariance = np.array([[100.0, 30.0], [30.0, 40.0]])
    drawn = np.random.default_rng(1).multivariate_normal([0, 0], covariance, 400_000)
    away = np.hypot(*drawn.T)
    radii, share = gaussian_radii_m(covariance, 9.0)
    np.testing.assert_allclose(radii, np.quantile(away, [0.5, 0.67, 0.95]), rtol=0.006)
    assert share == share_within(covariance, 9.0) == pytest.approx((away < 9).mean(), abs=0.004)
    assert gaussian_radii_m(np.zeros((2, 2)), 1.0)[1] == pytest.approx(1.0)
    assert gaussian_radii_m(np.zeros((2, 2)), 1.0)[0].max() < 0.01


def test_headings_of_a_phone_without_a_compass():
    step = MotionStep(3.0, 0.4, 0.1)
    assert headed(step, 2.0) == (step, 0.4)
    turned, heading = headed(MotionStep(3.0, nan, 0.1), 2.0)
    assert (turned, heading) == (MotionStep(3.0, 2.1, 0.1), 2.1)
    assert headed(MotionStep(3.0, nan, 0.1), nan) == (MotionStep(3.0, 0.1, 0.1), 0.1)
    first, heading = headed(MotionStep(3.0, nan), nan)
    assert (first.step_m, first.heading_rad, heading) == (3.0, 0.0, 0.0)
    unknown = MotionStep(3.0, nan)
    assert headed(unknown, 2.0) == (unknown, 2.0)


def test_dead_reckoning_adds_up():
    start = DeadReckoning(10.0, 1.0, 2.0)
    assert start.moved(MotionStep(0.0, nan)) is start
    # Whose length, direction or both are not known: from there on the displacement is another.
    assert start.moved(MotionStep(nan, 0.0)) == replace(start, gaps=1)
    spread = replace(start, sampling_m2=3.0**2 / 2, gaps=1)
    assert start.moved(MotionStep(0.0, nan, spread_m=3.0)) == spread
    moved = start.moved(MotionStep(-2.0, pi / 2))
    assert moved.travelled_m == 12.0
    assert (moved.east_m, moved.north_m) == pytest.approx((1.0, 0.0))
    # Without a heading the displacement stays, with an error to each side.
    unknown = DeadReckoning(12.0, 1.0, 2.0, sampling_m2=2.0 * 10.0 / 2, gaps=1)
    assert start.moved(MotionStep(2.0, nan)) == unknown
    assert start.moved(MotionStep(-2.0, nan)) == unknown


def test_the_way_that_holds_the_largest_share():
    area = small_area.make_area()
    ids = np.array(area.way_id)
    row, col = 4, 5
    east, north = (
        small_area.PIXEL_M * (np.array([col, 0, 8]) + 0.5),
        small_area.PIXEL_M * (small_area.ROWS - np.array([row, 0, 6]) - 0.5),
    )
    weight = np.array([0.6, 0.3, 0.1], dtype=np.float32)
    mass = {}
    for r, c, w in zip((row, 0, 6), (col, 0, 8), weight, strict=True):
        mass[ids[r, c]] = mass.get(ids[r, c], 0.0) + w
    best = max(mass, key=mass.get)
    found = area.matched_way(east.astype("f4"), north.astype("f4"), weight)
    assert found == (best, pytest.approx(min(mass[best], 1.0)))
    # Beyond the edges those of the edge.
    for place, at in (((-50.0, 999.0), (0, 0)), ((999.0, -50.0), (6, 8)), ((-1.0, -1.0), (6, 0))):
        one = area.matched_way(*np.array([[place[0]], [place[1]]], "f4"), np.ones(1, "f4"))
        assert one == (ids[at], 1.0)


def test_what_lies_at_the_edge_of_an_area():
    small = small_area.make_area()
    # A twentieth of the shorter side of 70 m.
    for place, expected in (
        ((45.0, 35.0), False), ((3.6, 35.0), False), ((3.4, 35.0), True), ((45.0, 66.6), True),
        ((86.4, 66.4), False), ((86.6, 35.0), True), ((45.0, -9.0), True), ((120.0, 35.0), True),
    ):  # fmt: skip
        assert small.at_edge(np.array([*place, 0.3, 0.0])) is expected
    # At most 60 m.
    wide = replace(small, lattice=replace(small.lattice, resolution_m=500.0))
    assert wide.at_edge(np.array([59.9, 1700.0]))
    assert not wide.at_edge(np.array([60.1, 1700.0]))


def test_an_area_holds_a_belief_of_which_more_than_half_lies_inside():
    small = small_area.make_area()
    east, north = (
        np.array([45.0, -1.0, 90.5, 45.0, 45.0], "f4"),
        np.array([35, 35, 35, -1, 71], "f4"),
    )
    for beyond in range(1, 5):
        for inside, expected in ((0.51, True), (0.49, False)):
            weight = np.zeros(5, "f4")
            weight[[0, beyond]] = inside, 1 - inside
            assert small.holds(east, north, weight) is expected
    corners = np.array([0.0, 90.0], "f4"), np.array([0.0, 70.0], "f4")
    assert small.holds(*corners, np.array([0.5, 0.5], "f4"))


def test_names_of_rows_and_the_spacing_before_the_start():
    assert ReportRow("serving", "A", 60, 1, -70.0, 0).name == "A"
    assert ReportRow("neighbour", None, 60, 1, -70.0, 0).name == "ARFCN 60, BSIC 1"
    assert ReportRow("neighbour", None, 60, None, -70.0, 0).name == "ARFCN 60, BSIC unknown"
    assert ReportRow("neighbour", None, None, None, -70.0, 0).name == ""
    assert BayesState().particle_spacing_m == 5.0


SITES = np.array([[0.0, 0.0], [1000.0, 0.0], [0.0, 1000.0]])


def test_a_static_fix_minimises_the_weighted_squares():
    model = timing_advances(POSITION, SITES, [10.0, 20.0, 30.0])
    truth = np.array([300.0, 400.0])
    exact = static_fix(model, model.mean(truth), [500.0, 500.0])
    np.testing.assert_allclose(exact.state, truth, atol=1e-6)
    assert (exact.ok, exact.problem) == (True, "")
    assert 2 <= exact.iterations < 12
    slope = model.jacobian(truth)
    expected = np.linalg.inv(slope.T @ np.diag([1e-2, 1 / 400, 1 / 900]) @ slope)
    np.testing.assert_allclose(exact.covariance, expected, rtol=1e-6)
    part = static_fix(model, [*model.mean(truth)[:2], nan], [500.0, 500.0])
    np.testing.assert_allclose(part.state, truth, atol=1e-5)
    one = static_fix(model, model.mean(truth), [500.0, 400.0], unknowns=[0])
    np.testing.assert_allclose(one.state, truth, atol=1e-5)
    assert one.covariance.shape == (1, 1)


def test_where_there_is_no_static_fix():
    model = timing_advances(POSITION, SITES, 10.0)
    few = static_fix(model, [500.0, nan, nan], [1.0, 1.0])
    assert (few.ok, few.problem, few.iterations) == (False, TOO_FEW, 0)
    assert np.isnan(few.state).all()
    assert few.covariance.shape == (2, 2)
    assert np.isnan(few.covariance).all()
    # Two sites in line with the start tell one direction only.
    line = timing_advances(POSITION, SITES[:2], 10.0)
    bad = static_fix(line, [500.0, 700.0], [300.0, 0.0])
    assert (bad.ok, bad.problem, bad.iterations) == (False, BAD_GEOMETRY, 1)
    truth = np.array([300.0, 400.0])
    good = static_fix(model, model.mean(truth), [500.0, 500.0])
    widest = sqrt(np.linalg.eigvalsh(good.covariance)[-1])
    start = [500.0, 500.0]
    assert static_fix(model, model.mean(truth), start, None, 1.001 * widest).ok
    worse = static_fix(model, model.mean(truth), start, None, 0.999 * widest)
    assert (worse.ok, worse.problem) == (False, BAD_GEOMETRY)
    with pytest.raises(InputError, match="infinity"):
        static_fix(model, [1.0, 2.0, inf], start)


def test_fixes_are_filtered_by_their_own_covariance():
    sky = pseudoranges(POSITION_CLOCK_3D, [[0.0, 0.0, 2e7]], 1.0)
    assert sky.size == 1
    fix = StaticFix(np.array([10.0, 20.0, 30.0, 5.0]), np.diag([1.0, 3.0, 2.0, 9.0]), True, 1)
    none = StaticFix(np.full(4, nan), np.full((4, 4), nan), False, 0)
    track = filter_fixes(POSITION, random_walk(1.0, 2.0), [0.0, 0.0], np.zeros((2, 2)), [fix, none])
    # Four square metres of motion against one and three of the fix.
    np.testing.assert_allclose(track.means, [[8.0, 20 * 4 / 7]] * 2)
    np.testing.assert_allclose(track.covariances[0], np.diag([0.8, 12 / 7]))
    np.testing.assert_allclose(track.covariances[1], np.diag([4.8, 12 / 7 + 4]))
    assert track.used.tolist() == [True, False]
    with pytest.raises(InputError, match="fix: expected 3 components"):
        filter_fixes(MOVING_3D, random_walk(1.0, 2.0, 6), np.zeros(6), np.eye(6),
                     [StaticFix(np.zeros(2), np.eye(2), True, 1)])  # fmt: skip
    for mean, motion in (([0.0] * 3, random_walk(1.0, 1.0)), ([0.0] * 2, random_walk(1.0, 1.0, 3))):
        with pytest.raises(InputError, match="PKF: expected a start and a motion of 2"):
            filter_fixes(POSITION, motion, mean, np.eye(len(mean)), [])


MOTION = MotionErrors(
    step_sd_m=0.4, typical_step_m=1.6, heading_sd_rad=0.25, white_share=0.64, heading_m=18.0,
    bias_sd_rad=0.1, bias_drift_rad_per_sqrt_m=0.03, scale_sd=0.05, stretch_sd=0.07, stretch_m=12.0,
)  # fmt: skip
WEIGHTS = MapWeights(sd_m=6.0, weight_per_m=0.05, off_cost_per_m=0.02, leave_per_m=4e-3,
                     return_per_m=0.03)  # fmt: skip


@pytest.mark.parametrize("compass", [True, False])
def test_what_a_stretch_of_dead_reckoning_does_on_the_grid(compass):
    area = small_area.make_area()
    grid = StreetGrid(BayesModel(area, MOTION, WEIGHTS), compass)
    assert StreetGrid(grid.model).bin_rad == 0.04
    assert grid.circular is not compass
    if compass:
        # Three deviations of 0.1 in bins of 0.04: eight to both sides.
        np.testing.assert_allclose(grid.bias_rad, 0.04 * np.arange(-8, 9))
    else:
        assert grid.bias_rad.size == 72
        np.testing.assert_allclose(np.diff(np.unwrap(grid.bias_rad)), radians(5))
    east_m, north_m, length_m = 12.0, -5.0, 16.0
    step = grid.transport(east_m, north_m, length_m, 7.0)
    stretch, way = exp(0.02), hypot(east_m, north_m)
    for b, bias in enumerate(grid.bias_rad):
        angle = np.arctan2(north_m, east_m) + bias
        right, up = stretch * way * cos(angle) / 10, stretch * way * sin(angle) / 10
        assert (step.right_px[b], -step.down_px[b]) == pytest.approx((right, up), abs=1e-9)
        # Ten steps of 1.6 m; the scale errs by 5 % of the whole way. Deviations of 7 % and 0.15
        # over twice their length count as white noise.
        along = 10 * 0.16 + (0.05 * 16) ** 2 + 24 * 16 * 0.07**2
        across = 10 * (1.6 * 0.2) ** 2 + 36 * 16 * 0.15**2
        axis = np.array([cos(angle), sin(angle)])
        side = np.array([-axis[1], axis[0]])
        spread = along * np.outer(axis, axis) + across * np.outer(side, side)
        found = (10 * step.sd_right_px[b]) ** 2, (10 * step.sd_down_px[b]) ** 2
        assert found == pytest.approx(np.diagonal(spread) + 7.0, rel=1e-9)
    width = 0.04 if compass else radians(5)
    assert step.turned_bins == pytest.approx(0.03 * 4 / width)
    told = [[exp(0.05 * 16 * oracle.map_log_likelihood(float(d), 6.0)) for d in row]
            for row in area.distance_m]  # fmt: skip
    np.testing.assert_allclose(step.on, told, rtol=1e-5)
    rest = step.off, step.leave, step.come_back
    assert rest == pytest.approx((exp(-0.32), 1 - exp(-0.064), 1 - exp(-0.48)))


def test_where_a_grid_starts():
    area = small_area.make_area()
    grid = StreetGrid(BayesModel(area, MOTION, WEIGHTS))
    on, off = grid.start(Start(None))
    assert on.shape == off.shape == (17, small_area.ROWS, small_area.COLS)
    assert (on.sum(), off.sum()) == pytest.approx((0.95, 0.05), rel=1e-5)
    assert not on[:, ~small_area.ON_WAY].any()
    np.testing.assert_allclose(on[:, 4, 5] / on[8, 4, 5],
                               np.exp(-0.5 * (grid.bias_rad / 0.1) ** 2), rtol=1e-5)  # fmt: skip
    np.testing.assert_allclose(on[8, small_area.ON_WAY], on[8, 4, 5], rtol=1e-5)
    np.testing.assert_allclose(off[8], off[8, 0, 0], rtol=1e-5)
    # About a place that is known to 8 m.
    known = Start(
        None, east_m=small_area.WEST_M + 35.0, north_m=small_area.SOUTH_M + 45.0, sd_m=8.0
    )
    on, _ = grid.start(known)
    shares = on.sum(axis=0) / on.sum(axis=0)[2, 3]
    for row, col in ((2, 3), (2, 4), (4, 3), (0, 8)):
        away2 = (10 * (col - 3)) ** 2 + (10 * (row - 2)) ** 2
        assert shares[row, col] == pytest.approx(exp(-away2 / 128), rel=1e-4, abs=1e-12)
    exact = StreetGrid(BayesModel(area, replace(MOTION, bias_sd_rad=0.0), WEIGHTS))
    assert exact.bias_rad.tolist() == [0.0]
    assert sum(part.sum() for part in exact.start(Start(None))) == pytest.approx(1.0)
    free, _ = StreetGrid(grid.model, compass=False).start(Start(None, compass=False))
    np.testing.assert_allclose(free[0], free[35], rtol=1e-6)
    place = np.array([0, 6]), np.array([2, 8])
    state = grid.states(*place, np.array([0.1, -0.2], "f4"), np.array([0.05, 0.7], "f4"))
    rows = [[25, 85], [65, 5], [0.1, -0.2], [0, 0], [0.05, 0.7], *[[0, 0]] * 3]
    np.testing.assert_allclose(state, rows, rtol=1e-6)


@dataclass(frozen=True, slots=True)
class PressureEpoch(Epoch):
    pressure_hpa: float = nan


@pytest.mark.parametrize(
    ("measured", "epoch"),
    [
        (False, Epoch(0.0, (MotionStep(1.0, 0.0),))),
        (False, PressureEpoch(0.0)),
        (True, PressureEpoch(0.0, pressure_hpa=0.0)),
        (True, Epoch(0.0, radio=(ReportRow("serving", "A", None, None, nan, 0),))),
        (True, Epoch(0.0, gnss=GnssFix(nan, nan))),
    ],
)
def test_whether_an_epoch_holds_a_measurement(measured, epoch):
    assert epoch.measured is measured


@pytest.mark.parametrize("sd_m", [10.0, 30.0, 100.0, 2000.0])
def test_a_fix_refutes_nothing_but_by_agreeing_with_a_narrow_belief(sd_m):
    """A belief as wide as the area expects any fix; one of 20 m is right by no chance."""
    side_m, middle_m = 1000.0, 500.0
    axis = np.arange(2.5, side_m, 5.0)
    wide = np.stack(np.meshgrid(axis, axis)).reshape(2, -1).astype(np.float32)
    angle = np.linspace(0, 2 * np.pi, 40)
    narrow = (middle_m + 20 * np.stack([np.cos(angle), np.sin(angle)])).astype(np.float32)
    fix = GnssFix(middle_m, middle_m, sd_m**2, sd_m**2, 0.0)

    def refuted(places):
        gain = FixTerm(fix, (0.0, 0.0)).log_likelihood(places)
        return refutation(fix, float(np.log(np.mean(np.exp(gain)))), side_m**2)

    assert refuted(wide) == pytest.approx(0.0, abs=0.1)
    # Uniform over the area, and Gaussian about the narrow belief; at most 5 nats.
    expected = np.log(2 * np.pi * sd_m**2 / side_m**2) + 0.5 * (20 / sd_m) ** 2
    assert refuted(narrow) == pytest.approx(min(max(expected, -5.0), 0.0), abs=0.01)
    assert refuted(narrow) < -2.0 or sd_m >= 100.0


def test_hypotheses_that_are_clear_of_the_edge_have_their_mean_there():
    small = small_area.make_area()
    clear = np.array([[45.0, 30.0], [35.0, 20.0]], dtype=np.float32)
    assert small.clear_of_edge(clear)
    # One of them within the 3.5 m of the edge and a metre for rounding.
    for place in ((4.4, 35.0), (85.6, 35.0), (45.0, 4.4), (45.0, 65.6), (np.nan, 35.0)):
        near = np.column_stack([clear, np.array(place, dtype=np.float32)]).astype(np.float32)
        assert not small.clear_of_edge(near)
        assert small.clear_of_edge(clear)
