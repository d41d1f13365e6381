"""The map filter on a grid of a few pixels: its start, its motion and its bins by hand."""

from dataclasses import replace
from math import exp, nan, pi
from types import SimpleNamespace

import numpy as np
import pytest

from mapfilter.positioning.bayes.grid import StreetGrid

ON_WAY = np.array([[True, False, False], [False, False, False]])
"""Pixels of 10 m, from the north."""
MOTION = SimpleNamespace(
    bias_sd_rad=0.3, white_rad=0.2, typical_step_m=2.0, step_sd_m=0.5, scale_sd=0.1,
    stretch_m=30.0, stretch_sd=0.05, heading_m=20.0, turn_sd_rad=0.1,
    bias_drift_rad_per_sqrt_m=0.01,
)  # fmt: skip


def grid_over(on_way=ON_WAY, gains=None, compass=True, bin_rad=0.3, **motion):
    """A grid whose reports add gains to the pixels, from the north-west."""

    def weigh(cloud, log_weight, reading):
        log_weight += gains
        asked.append((cloud, reading))

    asked = []
    lattice = SimpleNamespace(rows=on_way.shape[0], resolution_m=10.0)
    model = SimpleNamespace(
        whole=SimpleNamespace(on_way=on_way, origin_m=(1000.0, 2000.0)),
        area=SimpleNamespace(lattice=lattice),
        motion=SimpleNamespace(**vars(MOTION) | motion),
        log_map=np.array([0.0, -2.0]),
        weights=SimpleNamespace(
            over=lambda m: SimpleNamespace(exponent=0.1 * m, off=0.5, leave=0.25, come_back=0.125)
        ),
        bins="bins",
        can_converge=lambda *given: ("asked", *given),
        weigh=weigh,
        asked=asked,
    )
    return StreetGrid(model, compass, bin_rad)


def prior(reading=None, east_m=nan, north_m=nan, sd_m=nan):
    return SimpleNamespace(reading=reading, east_m=east_m, north_m=north_m, sd_m=sd_m)


BIAS = np.exp(-0.5 * np.arange(-3, 4) ** 2)
"""Weights of errors of headings by their deviations."""


def test_bins_of_headings_reach_three_deviations_to_both_sides():
    np.testing.assert_allclose(grid_over().bias_rad, 0.3 * np.arange(-3, 4))
    np.testing.assert_allclose(grid_over(bin_rad=0.29).bias_rad, 0.29 * np.arange(-4, 5))
    assert grid_over(bias_sd_rad=0.0).bias_rad.tolist() == [0.0]
    usual = StreetGrid(grid_over().model)
    assert (usual.compass, usual.bin_rad) == (True, 0.04)
    around = grid_over(compass=False)
    assert around.circular
    assert not grid_over().circular
    np.testing.assert_allclose(around.bias_rad[:36], 2 * pi / 72 * np.arange(36))
    np.testing.assert_allclose(around.bias_rad[37:], 2 * pi / 72 * np.arange(-35, 0))
    assert abs(around.bias_rad[36]) == pytest.approx(pi)
    assert around.bias_rad.size == 72
    assert around.bins == "bins"


@pytest.mark.parametrize("pixels", [0, 1, 2])
def test_without_evidence_five_of_a_hundred_are_anywhere(pixels):
    """The others are on ways; without any there are no others."""
    on_way = np.arange(6).reshape(2, 3) < pixels
    on, off = grid_over(on_way).start(prior())
    assert on.dtype == off.dtype == np.float32
    bias = BIAS / BIAS.sum()
    ways = 0.95 * bias[:, None, None] * on_way / max(pixels, 1)
    anywhere = 0.05 * np.broadcast_to(bias[:, None, None], (7, 2, 3)) / 6
    total = 1.0 if pixels else 0.05
    np.testing.assert_allclose(on, ways / total, rtol=1e-6)
    np.testing.assert_allclose(off, anywhere / total, rtol=1e-6)


@pytest.mark.parametrize(("compass", "sd_rad", "count"), [(False, 0.3, 72), (True, 0.0, 1)])
def test_headings_without_a_compass_and_exact_ones(compass, sd_rad, count):
    on, off = grid_over(compass=compass, bias_sd_rad=sd_rad).start(prior())
    assert on.shape == (count, 2, 3)
    np.testing.assert_allclose(on[:, 0, 0], 0.95 / count, rtol=1e-5)
    np.testing.assert_allclose(off, 0.05 / count / 6, rtol=1e-5)


@pytest.mark.parametrize("below_nats", [0.0, 400.0])
def test_first_evidence_weighs_every_pixel(below_nats):
    """However improbable all of them are."""
    gains = np.log([[0.5, 1.0, 0.25], [0.125, 1.0, 1.0]])
    grid = grid_over(ON_WAY, (gains - below_nats).ravel(), bias_sd_rad=0.0)
    on, off = grid.start(prior("report"))
    likely = np.exp(gains)
    expected = np.stack([0.95 * ON_WAY * likely, 0.05 * likely / 6])
    np.testing.assert_allclose(np.concatenate([on, off]), expected / expected.sum(), rtol=1e-5)
    ((cloud, reading),) = grid.model.asked
    assert reading == "report"
    assert (cloud.kept.shape, cloud.kept.dtype) == ((0, 6), np.float32)
    assert cloud.state[0].tolist() == [5.0, 15.0, 25.0] * 2
    assert cloud.state[1].tolist() == [15.0] * 3 + [5.0] * 3
    assert not cloud.state[2:].any()


def test_pixels_that_are_out_of_the_question_hold_nothing():
    gains = np.array([-900.0, 0.0, -900.0, 0.0, 0.0, -900.0])
    on, off = grid_over(ON_WAY, gains, bias_sd_rad=0.0).start(prior("report"))
    assert not on.any()
    np.testing.assert_allclose(off.ravel(), np.array([0, 1, 0, 1, 1, 0]) / 3, rtol=1e-6)


def test_about_a_known_start_ways_make_no_difference():
    """15 m east and 5 m north of the corner, to 10 m."""
    on, off = grid_over(bias_sd_rad=0.0).start(prior(None, 1015.0, 2005.0, 10.0))
    near = np.exp(-0.5 * np.array([[2.0, 1.0, 2.0], [1.0, 0.0, 1.0]]))
    near /= near.sum()
    np.testing.assert_allclose(on[0], 0.95 * near, rtol=1e-5)
    np.testing.assert_allclose(off[0], 0.05 * near, rtol=1e-5)


@pytest.mark.parametrize("sd_m", [0.0, 1e-30, 1e-3])
@pytest.mark.parametrize("east_m", [1015.0, 1018.0])
def test_an_exact_start_is_the_nearest_pixel(east_m, sd_m):
    on, off = grid_over(bias_sd_rad=0.0).start(prior(None, east_m, 2005.0, sd_m))
    nearest = np.array([[0, 0, 0], [0, 1, 0]])
    np.testing.assert_allclose(on[0], 0.95 * nearest, rtol=1e-6)
    np.testing.assert_allclose(off[0], 0.05 * nearest, rtol=1e-6)


def test_pixels_as_states():
    row, col = np.array([0, 1]), np.array([2, 0])
    errors, off = np.array([0.25, -0.5], dtype="f4"), np.array([1.0, 0.0], dtype="f4")
    state = grid_over().states(row, col, errors, off)
    assert state.dtype == np.float32
    assert state[:2].tolist() == [[25.0, 5.0], [15.0, 5.0]]
    rows = state[2:].tolist()
    assert rows.count([0.25, -0.5]) == 1
    assert rows.count([1.0, 0.0]) == 1
    assert rows.count([0.0, 0.0]) == len(rows) - 2


@pytest.mark.parametrize("compass", [True, False])
def test_mass_is_moved_by_the_way_as_each_error_turns_it(compass):
    """5 m to (3, 4), also turned by a quarter to both sides; white noise shortens it by 2 %."""
    grid = grid_over(compass=compass, bin_rad=pi / 2, bias_sd_rad=0.5)
    at = {0.0: 0, pi / 2: 18, -pi / 2: 54} if not compass else {-pi / 2: 0, 0.0: 1, pi / 2: 2}
    way = grid.transport(3.0, 4.0, 5.0, 2.0)
    # 2.5 steps of 0.5 m, a scale of a tenth, and stretches of 5 % over 60 m; headings of 0.2 rad at
    # each step of 2 m, and of 0.1 rad over 40 m.
    along, across = 2.5 * 0.25 + 0.25 + 60.0 * 5.0 * 0.0025, 2.5 * 0.16 + 40.0 * 5.0 * 0.01
    for turned_rad, (east_m, north_m) in ((0.0, (3, 4)), (pi / 2, (-4, 3)), (-pi / 2, (4, -3))):
        k = at[turned_rad]
        longer = exp(0.5 * 0.04)
        assert 10 * way.right_px[k] == pytest.approx(longer * east_m)
        assert 10 * way.down_px[k] == pytest.approx(-longer * north_m)
        by_east, by_north = (east_m / 5) ** 2, (north_m / 5) ** 2
        east_var = along * by_east + across * by_north + 2.0
        north_var = along * by_north + across * by_east + 2.0
        assert 10 * way.sd_right_px[k] == pytest.approx(east_var**0.5)
        assert 10 * way.sd_down_px[k] == pytest.approx(north_var**0.5)
    width_rad = pi / 2 if compass else 2 * pi / 72
    assert way.turned_bins == pytest.approx(0.01 * 5**0.5 / width_rad)
    np.testing.assert_allclose(way.on, [1.0, exp(-1.0)])
    assert (way.off, way.leave, way.come_back) == (0.5, 0.25, 0.125)


def test_reports_are_weighed_on_the_device():
    grid, log_weight = grid_over(gains=np.ones(3)), np.zeros(3)
    grid.weigh("cloud", log_weight, "report")
    assert log_weight.tolist() == [1.0] * 3
    other = replace(grid, device=SimpleNamespace(is_host=False))
    other.__dict__["_on_device"] = SimpleNamespace(weigh=lambda *given: ("there", *given))
    assert other.weigh("cloud", log_weight, "report") == ("there", "cloud", log_weight, "report")
    assert grid.can_converge("summary", "report") == ("asked", "summary", "report")


def test_a_grid_is_placed_on_another_device_only():
    grid = grid_over()
    assert grid.placed(grid.device) is grid
    other = SimpleNamespace(name="other")
    assert grid.placed(other).device is other
    assert grid.placed(other).model is grid.model
    _ = grid.bias_rad
    assert set(grid.__getstate__()) == {"model", "compass", "bin_rad", "device"}
