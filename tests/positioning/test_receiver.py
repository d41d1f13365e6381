"""Pseudoranges with the clock integrated out, against brute force."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad

from mapfilter.errors import ConfigError
from mapfilter.models.street_motion import STATES
from mapfilter.positioning.gnss.options import GnssOptions, TimingOptions
from mapfilter.positioning.gnss.receiver import (
    begun,
    carried,
    centred,
    clock_reset,
    moved,
    near_clock,
    weighed,
)
from mapfilter.positioning.gnss.sky import Sky

OPTIONS = GnssOptions(height_sd_m=0.0)
PLACES = np.array([[0.0, 40.0, -200.0, 350.0], [0.0, 90.0, 30.0, -80.0]], dtype=np.float32)
AXES = np.array([[0.3, 0.5, 0.9], [-0.8, 0.1, 0.7], [0.6, -0.6, 0.5]])


def sky_of(range_m, count=3, axes=AXES):
    unit = axes[:count] / np.linalg.norm(axes[:count], axis=1)[:, None]
    return Sky(
        tuple(f"G{index + 1:02d}" for index in range(count)),
        2.2e7 * unit,
        np.arcsin(unit[:, 2]),
        np.asarray(range_m, dtype=float)[:count],
        np.full(count, np.nan),
        (0.0, 0.0),
        np.eye(2),
    )


def distances(sky, places=PLACES):
    there = np.vstack([places, np.zeros(places.shape[1])]).T.astype(float)
    return np.linalg.norm(sky.satellites_m[:, None] - there[None], axis=2)


def truth_ranges(count=3, clock_m=0.0, noise=(3.0, -2.0, 1.0)):
    blank = sky_of(np.zeros(3), count)
    return sky_of(distances(blank)[:, 0] + clock_m + np.array(noise)[:count], count)


def gains_by_brute_force(sky, sigma_m, prior_mean_m, prior_sd_m):
    """Integrate the clock out of each place's likelihood, by quadrature."""
    expected = distances(sky)
    found = []
    for k in range(PLACES.shape[1]):
        off = sky.range_m - expected[:, k]

        def density(clock_m, off=off, mean_m=prior_mean_m[k]):
            square = np.sum(((off - clock_m) / sigma_m) ** 2)
            return np.exp(-0.5 * square - 0.5 * ((clock_m - mean_m) / prior_sd_m) ** 2)

        middle = float(np.mean(off))
        points = sorted({middle, float(prior_mean_m[k])})
        wide = 12 * max(prior_sd_m, float(np.max(sigma_m)))
        total, _ = quad(density, points[0] - wide, points[-1] + wide, points=points, limit=400)
        found.append(np.log(total))
    gain = np.array(found)
    return gain - np.log(np.mean(np.exp(gain)))


@pytest.mark.parametrize("count", [1, 2, 3])
def test_the_clock_is_integrated_out_exactly(count):
    sky, sigma = truth_ranges(count), np.array([30.0, 45.0, 60.0])[:count]
    receiver = begun(OPTIONS, 0.0, 0.0)
    covariance = receiver.covariance.copy()
    covariance[0, 0] = 50.0**2
    rows = np.zeros((3, 4))
    rows[0] = [5.0, -20.0, 10.0, 0.0]
    receiver = replace(receiver, covariance=covariance, mean=np.array([8.0, 0.0, 0.0]))
    found = weighed(sky, sigma, receiver, PLACES, np.zeros(4), rows)
    expected = gains_by_brute_force(sky, sigma, 8.0 + rows[0], 50.0)
    np.testing.assert_allclose(found.gain, expected, atol=5e-5)
    # Posterior of the clock: information adds up.
    information = 1 / 50.0**2 + np.sum(1 / sigma**2)
    off = sky.range_m[:, None] - distances(sky)
    mean = ((8.0 + rows[0]) / 50.0**2 + np.sum(off / sigma[:, None] ** 2, axis=0)) / information
    np.testing.assert_allclose(8.0 + found.rows[0], mean, atol=1e-6)
    assert found.covariance[0, 0] == pytest.approx(1 / information)


def test_one_satellite_at_first_tells_nothing_of_places():
    sky = truth_ranges(1, clock_m=123_456.0)
    receiver = near_clock(sky, begun(OPTIONS, 0.0, 0.0))
    found = weighed(sky, np.array([5.0]), receiver, PLACES, np.zeros(4), np.zeros((3, 4)))
    np.testing.assert_allclose(found.gain, 0.0, atol=2e-6)
    # But each place now knows which clock it must have.
    clock_m = receiver.mean[0] + found.rows[0]
    np.testing.assert_allclose(clock_m, sky.range_m[0] - distances(sky)[0], atol=1e-3)


def test_once_the_clock_is_known_one_satellite_tells_places_apart():
    first, second = truth_ranges(1, noise=(0.0,)), truth_ranges(2, noise=(0.0, 0.0))
    other = second.only(np.array([False, True]))
    receiver = near_clock(first, begun(OPTIONS, 0.0, 0.0))
    told = weighed(first, np.array([5.0]), receiver, PLACES, np.zeros(4), np.zeros((3, 4)))
    receiver = replace(receiver, covariance=told.covariance)
    found = weighed(other, np.array([5.0]), receiver, PLACES, np.zeros(4), told.rows)
    both = distances(second)
    across = (both[1] - both[0]) - (both[1, 0] - both[0, 0])
    expected = -0.5 * across**2 / 50.0
    expected -= np.log(np.mean(np.exp(expected)))
    np.testing.assert_allclose(found.gain, np.maximum(expected, expected.min()), rtol=1e-4)


def test_two_satellites_at_once_are_their_difference():
    sky, sigma = truth_ranges(2), np.array([40.0, 30.0])
    receiver = near_clock(sky, begun(OPTIONS, 0.0, 0.0))
    found = weighed(sky, sigma, receiver, PLACES, np.zeros(4), np.zeros((3, 4)), free=1)
    off = sky.range_m[:, None] - distances(sky)
    expected = -0.5 * (off[0] - off[1]) ** 2 / np.sum(sigma**2)
    np.testing.assert_allclose(found.gain, expected - np.log(np.mean(np.exp(expected))), atol=1e-5)


def test_an_unknown_height_is_integrated_out_too():
    sky, sigma, sd_m = truth_ranges(3), np.array([30.0, 45.0, 60.0]), 25.0
    receiver = begun(GnssOptions(height_sd_m=sd_m), 0.0, 0.0)
    covariance = np.diag([50.0**2, 0.0, sd_m**2])
    receiver = replace(receiver, covariance=covariance)
    found = weighed(sky, sigma, receiver, PLACES, np.zeros(4), np.zeros((3, 4)))
    up = np.sin(sky.elevation_rad)
    whole = np.diag(sigma**2) + 50.0**2 + sd_m**2 * np.outer(up, up)
    off = sky.range_m[:, None] - distances(sky)
    expected = -0.5 * np.sum(off * np.linalg.solve(whole, off), axis=0)
    np.testing.assert_allclose(found.gain, expected - np.log(np.mean(np.exp(expected))), atol=1e-9)


def test_weights_go_in_as_they_are():
    sky, sigma = truth_ranges(3), np.array([30.0, 45.0, 60.0])
    receiver = near_clock(sky, begun(OPTIONS, 0.0, 0.0))
    log_weight = np.log([0.1, 0.2, 0.3, 0.4]) - 7.0
    found = weighed(sky, sigma, receiver, PLACES, log_weight, np.zeros((3, 4)))
    share = np.exp(log_weight + 7.0)
    assert np.sum(share * np.exp(found.gain)) == pytest.approx(1.0, abs=1e-6)
    none = np.where(np.arange(4) == 2, -np.inf, log_weight)
    assert np.isfinite(weighed(sky, sigma, receiver, PLACES, none, np.zeros((3, 4))).gain).all()


def test_the_clock_runs_on_and_a_jump_forgets_it():
    receiver = begun(OPTIONS, 10.0, 5.0)
    rows = np.array([[1.0, 2.0], [0.5, -0.5], [0.0, 0.0]])
    receiver = replace(receiver, mean=np.array([100.0, 3.0, 7.0]))
    after, moved_rows = moved(OPTIONS, receiver, rows, 14.0, 25.0)
    np.testing.assert_allclose(after.mean, [112.0, 3.0, 7.0])
    np.testing.assert_allclose(moved_rows[0], [3.0, 0.0])
    assert after.covariance[2, 2] == pytest.approx(OPTIONS.slope**2 * 20.0)
    assert after.covariance[0, 0] > receiver.covariance[0, 0] + 16 * 100.0**2 - 1
    jumped = clock_reset(OPTIONS, after)
    assert jumped.covariance[0].tolist() == [OPTIONS.clock_sd_m**2, 0.0, 0.0]
    # Time that stands still or goes back changes nothing.
    still, same = moved(OPTIONS, receiver, rows, 9.0, 5.0)
    np.testing.assert_array_equal(same, rows)
    np.testing.assert_array_equal(still.covariance, receiver.covariance)


def test_hypotheses_carry_small_numbers_only():
    rows = np.array([[250_000.25, 250_010.25], [3.0, 3.0], [10.0, 12.0]])
    state = np.zeros((STATES, 2), dtype=np.float32)
    receiver, carrying = centred(begun(OPTIONS, 0.0, 0.0), rows, state)
    assert carrying.shape == (STATES + 3, 2)
    np.testing.assert_allclose(carried(carrying)[0], [-5.0, 5.0])
    np.testing.assert_allclose(receiver.mean, [250_005.25, 3.0, 11.0])
    np.testing.assert_array_equal(carried(state), 0.0)


@pytest.mark.parametrize(
    ("wrong", "told"),
    [({"zenith_m": -1.0}, "zenith_m"), ({"outliers": 1.0}, "outliers"),
     ({"mask_deg": 90.0}, "mask"),
     ({"clock_sd_m": 0.0}, "clock_sd_m"), ({"height_m": np.nan}, "height_m")],
)  # fmt: skip
def test_options_that_make_no_sense(wrong, told):
    with pytest.raises(ConfigError, match=told):
        GnssOptions(**wrong)
    with pytest.raises(ConfigError, match="step_m"):
        TimingOptions(step_m=0.0)
