"""Clock, height and errors of a satellite receiver, by formulas of their own."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm

from mapfilter.filters.contract import Reason
from mapfilter.geodesy import project
from mapfilter.gnss.sky import GridFrame, ecef_from_lonlat
from mapfilter.models.motion import clock_noise
from mapfilter.models.street_motion import STATES
from mapfilter.positioning.epochs import Epoch, Pseudorange
from mapfilter.positioning.gnss.options import GnssOptions
from mapfilter.positioning.gnss.receiver import (
    Receiver,
    agreement,
    begun,
    carried,
    centred,
    clock_reset,
    moved,
    near_clock,
    weighed,
)
from mapfilter.positioning.gnss.sky import Sky, range_sigma_m, sky_over

CRS = "EPSG:32632"
OPTIONS = GnssOptions(slope=0.4, height_m=80.0)
PLACES = np.array([[12.0, 40.0, -20.0, 55.0], [-7.0, 30.0, 25.0, -60.0]], dtype=np.float32)
UNIT = np.array([[0.3, 0.5, 0.9], [-0.8, 0.1, 0.7], [0.6, -0.6, 0.5], [0.1, 0.9, 0.4]])
UNIT /= np.linalg.norm(UNIT, axis=1)[:, None]
SIGMA_M = np.array([8.0, 12.0, 20.0, 15.0])
TURN = np.array([[np.cos(0.03), -np.sin(0.03)], [np.sin(0.03), np.cos(0.03)]])
ORIGIN_M = 5.0, -9.0
P_2 = np.array([[400.0, 30.0, -20.0], [30.0, 9.0, 1.0], [-20.0, 1.0, 100.0]])
"""Covariance of clock error, rate and height."""


def sky_of(count=4, offset_m=(4.0, -6.0, 9.0, 2.0)):
    """Satellites over a turned frame, received at its origin with errors."""
    satellites = 2.2e7 * UNIT[:count]
    return Sky(
        tuple(f"G{k:02d}" for k in range(count)), satellites, np.arcsin(UNIT[:count, 2]),
        np.full(count, 2.2e7) + 1000.0 + np.array(offset_m[:count]),
        np.full(count, np.nan), ORIGIN_M, TURN,
    )  # fmt: skip


def innovations(sky, mean, rows):
    """Measured less expected pseudoranges, (m, N): distance, clock, and a higher antenna nearer."""
    flat = TURN @ (PLACES.astype(float) - np.array(ORIGIN_M)[:, None])
    there = np.vstack([flat, np.zeros(flat.shape[1])]).T
    away_m = np.linalg.norm(sky.satellites_m[:, None] - there[None], axis=2)
    lower = np.sin(sky.elevation_rad)[:, None]
    return sky.range_m[:, None] - away_m - (mean[0] + rows[0]) + lower * (mean[2] + rows[2])


ROWS = np.array([[3.0, -4.0, 6.0, 0.0], [0.1, 0.2, 0.3, 0.4], [2.0, -5.0, 1.0, 3.0]])
MEAN = np.array([990.0, 2.0, 15.0])


def receiver_of(covariance=P_2):
    return Receiver(10.0, 50.0, MEAN, covariance)


@pytest.mark.parametrize("free", [0, 1, 3, 9])
@pytest.mark.parametrize("count", [2, 4])
def test_the_agreement_is_half_the_degrees_of_freedom_less_the_innovation(count, free):
    sky, weight = sky_of(count), np.array([0.1, 0.4, 0.3, 0.2])
    off = innovations(sky, MEAN, ROWS)
    slope = np.column_stack([np.ones(count), np.zeros(count), -np.sin(sky.elevation_rad)])
    covariance = np.cov(off, aweights=weight, ddof=0) + slope @ P_2 @ slope.T
    covariance += np.diag(SIGMA_M[:count] ** 2)
    mean = off @ weight
    square = mean @ np.linalg.inv(covariance) @ mean
    found = agreement(sky, SIGMA_M[:count], receiver_of(), PLACES, weight, ROWS, free)
    assert found == pytest.approx(0.5 * (max(count - free, 0) - square), rel=1e-6)
    assert abs(square) > 0.05
    if not free:
        usual = agreement(sky, SIGMA_M[:count], receiver_of(), PLACES, weight, ROWS)
        assert usual == found


@pytest.mark.parametrize("free", [0, 1, 9])
def test_the_score_of_a_belief_is_its_likelihood_less_the_usual(free):
    """Of all hypotheses together, by their weights; weights need not sum to one."""
    sky, share = sky_of(), np.array([0.1, 0.4, 0.3, 0.2])
    found = weighed(sky, SIGMA_M, receiver_of(), PLACES, np.log(share) - 3.0, ROWS, free)
    slope = np.column_stack([np.ones(4), np.zeros(4), -np.sin(sky.elevation_rad)])
    covariance = slope @ P_2 @ slope.T + np.diag(SIGMA_M**2)
    off = innovations(sky, MEAN, ROWS)
    nats = -0.5 * np.sum(off * np.linalg.solve(covariance, off), axis=0)
    total = np.log(share @ np.exp(nats))
    np.testing.assert_allclose(found.gain, nats - total, atol=1e-6)
    assert found.score == pytest.approx(total + 0.5 * max(4 - free, 0), abs=1e-6)
    usual = weighed(sky, SIGMA_M, receiver_of(), PLACES, np.log(share), ROWS)
    assert usual.score == pytest.approx(total + 2.0, abs=1e-6)
    # Clock and height afterwards are those of Kalman's update.
    gain = P_2 @ slope.T @ np.linalg.inv(covariance)
    np.testing.assert_allclose(found.covariance, P_2 - gain @ slope @ P_2, atol=1e-7)
    np.testing.assert_allclose(found.rows, ROWS + gain @ off, atol=1e-6)


def test_pseudoranges_that_no_hypothesis_can_have_are_far_below_the_usual():
    sky = sky_of()
    far = replace(sky, range_m=sky.range_m + np.array([0.0, 500.0, 0.0, -400.0]))
    scores = [
        weighed(one, SIGMA_M, receiver_of(), PLACES, np.zeros(4), ROWS).score for one in (sky, far)
    ]
    assert scores[0] > -5
    assert scores[1] < -100


def test_pseudoranges_beyond_all_numbers_are_no_usual_ones():
    """Their squares are infinite: no hypothesis keeps any weight."""
    sky = replace(sky_of(), range_m=np.full(4, 1e200))
    found = weighed(sky, SIGMA_M, receiver_of(), PLACES, np.zeros(4), ROWS)
    assert found.score == -np.inf
    np.testing.assert_array_equal(found.gain, 0.0)


def test_a_hypothesis_without_weight_counts_as_one_of_700_nats_less():
    """It is 5 km nearer to where the satellites say than the other, whose weight is all."""
    places = np.array([[5000.0 + 5.0, 5.0], [-9.0, -9.0]], dtype=np.float32)
    sky, rows, clock = sky_of(), np.zeros((3, 2)), receiver_of(np.diag([1e4, 1.0, 1e4]))
    nats = [
        weighed(sky, np.full(4, 40.0), clock, places[:, [k]], np.zeros(1), rows[:, [k]]).score - 2.0
        for k in range(2)
    ]
    assert nats[0] < -1000
    assert nats[1] > -10
    found = weighed(sky, np.full(4, 40.0), clock, places, np.array([0.0, -np.inf]), rows)
    total = np.logaddexp(nats[0], nats[1] - 700.0)
    np.testing.assert_allclose(found.gain, np.array(nats) - total, rtol=1e-6)


@pytest.mark.parametrize("elapsed_s", [0.5, 4.0])
@pytest.mark.parametrize("gone_m", [0.0, 30.0])
def test_clock_and_height_go_on_as_random_walks(elapsed_s, gone_m):
    """A rate that walks, and the clock error that it leads on: by the matrix exponential."""
    bias, rate = np.diag(clock_noise(1.0))
    leads = np.zeros((2, 2))
    leads[0, 1] = 1.0
    block = np.zeros((4, 4))
    block[:2, :2], block[:2, 2:], block[2:, 2:] = -leads, np.diag([bias, rate]), leads.T
    whole = expm(block * elapsed_s)
    noise = whole[2:, 2:].T @ whole[:2, 2:]
    run = np.eye(3)
    run[0, 1] = elapsed_s
    expected = run @ P_2 @ run.T
    expected[:2, :2] += noise
    expected[2, 2] += 0.4**2 * gone_m
    after, rows = moved(OPTIONS, receiver_of(), ROWS, 10.0 + elapsed_s, 50.0 + gone_m)
    np.testing.assert_allclose(after.covariance, expected, rtol=1e-10)
    np.testing.assert_array_equal(after.covariance, after.covariance.T)
    np.testing.assert_allclose(after.mean, [990.0 + 2.0 * elapsed_s, 2.0, 15.0])
    np.testing.assert_allclose(rows, [ROWS[0] + elapsed_s * ROWS[1], ROWS[1], ROWS[2]])
    assert (after.time_s, after.travelled_m) == (10.0 + elapsed_s, 50.0 + gone_m)
    np.testing.assert_array_equal(ROWS[0], [3.0, -4.0, 6.0, 0.0])


def test_an_unknown_clock_leaves_rate_and_height():
    after = clock_reset(OPTIONS, receiver_of())
    expected = P_2.copy()
    expected[0], expected[:, 0] = 0.0, 0.0
    expected[0, 0] = OPTIONS.clock_sd_m**2
    np.testing.assert_array_equal(after.covariance, expected)
    np.testing.assert_array_equal(after.mean, MEAN)
    assert P_2[0, 1] == 30.0


def test_an_unknown_clock_is_set_by_the_median_satellite():
    sky = sky_of(3, (4.0, -600.0, 9.0))
    after = near_clock(sky, receiver_of())
    np.testing.assert_allclose(after.mean, [1004.0, 2.0, 15.0])
    np.testing.assert_array_equal(MEAN, [990.0, 2.0, 15.0])


def test_a_new_receiver_was_never_used():
    found = begun(OPTIONS, 3.0, 7.0)
    assert (found.time_s, found.travelled_m, found.used_at_m) == (3.0, 7.0, -np.inf)
    deviations = OPTIONS.clock_sd_m, OPTIONS.drift_sd_mps, OPTIONS.height_sd_m
    np.testing.assert_array_equal(found.covariance, np.diag(np.square(deviations)))
    np.testing.assert_array_equal(found.mean, 0.0)


def test_hypotheses_carry_what_is_left_beside_the_mean():
    rng = np.random.default_rng(3)
    state = rng.standard_normal((STATES, 4)).astype(np.float32)
    rows = rng.standard_normal((3, 4)) + 1e6
    for given in (state, np.vstack([state, np.ones((3, 4), dtype=np.float32)])):
        receiver, carrying = centred(receiver_of(), rows, given)
        assert carrying.dtype == np.float32
        np.testing.assert_array_equal(carrying[:STATES], state)
        np.testing.assert_allclose(carrying[STATES:], rows - rows.mean(axis=1)[:, None], atol=1e-6)
        np.testing.assert_allclose(receiver.mean, MEAN + rows.mean(axis=1))


def test_a_large_belief_keeps_its_hypotheses():
    """Of a size at which memory is new, and holds none of them by chance."""
    state = np.random.default_rng(4).random((STATES, 100_000), dtype=np.float32)
    _, carrying = centred(receiver_of(), np.zeros((3, 100_000)), state)
    np.testing.assert_array_equal(carrying[:STATES], state)


def test_hypotheses_without_a_receiver_carry_nothing():
    state = np.arange(11 * 4, dtype=np.float32).reshape(11, 4)
    np.testing.assert_array_equal(carried(state), state[8:])
    np.testing.assert_array_equal(carried(state[:10]), np.zeros((3, 4)))
    # Nor do those that began beside a receiver of other satellites.
    np.testing.assert_array_equal(carried(state, 5), np.zeros((5, 4)))


def test_some_of_the_satellites():
    sky = replace(sky_of(), sigma_m=np.arange(4.0))
    found = sky.only(np.array([True, False, False, True]))
    assert found.names == ("G00", "G03")
    assert found.sigma_m.tolist() == [0.0, 3.0]
    for name in ("satellites_m", "elevation_rad", "range_m"):
        np.testing.assert_array_equal(getattr(found, name), getattr(sky, name)[[0, 3]])
    assert found.origin_m == ORIGIN_M


def test_white_noise_of_pseudoranges():
    """By elevation or as reported, and the spacing; what lasts is no white noise."""
    options = GnssOptions(zenith_m=3.0, echo_m=5.0)
    elevation = np.radians([90.0, 30.0, 10.0])
    sky = replace(sky_of(3), elevation_rad=elevation, sigma_m=np.array([np.nan, np.nan, 7.0]))
    white = np.array([3.0, 6.0, 7.0])
    np.testing.assert_allclose(range_sigma_m(options, sky, 0.0), white)
    beside = 8.0 * np.cos(elevation)
    np.testing.assert_allclose(range_sigma_m(options, sky, 8.0), np.hypot(white, beside))


LON_DEG, LAT_DEG, HEIGHT_M = 9.3, 48.5, 250.0


def satellite(azimuth_deg, elevation_deg, away_m=2.1e7):
    """Earth-centred place of a satellite as seen from the place."""
    lon, lat = np.radians([LON_DEG, LAT_DEG])
    east = np.array([-np.sin(lon), np.cos(lon), 0.0])
    up = np.array([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)])
    north = np.cross(up, east)
    azimuth, elevation = np.radians([azimuth_deg, elevation_deg])
    flat = np.sin(azimuth) * east + np.cos(azimuth) * north
    unit = np.cos(elevation) * flat + np.sin(elevation) * up
    return tuple((ecef_from_lonlat(LON_DEG, LAT_DEG, HEIGHT_M) + away_m * unit).tolist())


def test_the_satellites_of_an_epoch_over_a_place():
    """In true directions from the place at the assumed height; what is left out has its reason."""
    east_m, north_m = (float(one) for one in project(CRS, LON_DEG, LAT_DEG))
    options = GnssOptions(height_m=HEIGHT_M, mask_deg=15.0)
    nowhere = (np.nan, 0.0, 0.0)
    rows = (
        Pseudorange("G01", 2.1e7 + 5, 3.0, satellite(90.0, 40.0)),
        Pseudorange("G02", 2.1e7 - 7, np.nan, satellite(200.0, 16.0)),
        Pseudorange("G01", 9.9e6, 3.0, satellite(10.0, 40.0)),
        Pseudorange("G03", 2.2e7, 3.0, satellite(0.0, 14.0)),
        Pseudorange("G04", 2.2e7, 3.0, nowhere),
        Pseudorange("G05", np.nan, 3.0, satellite(0.0, 60.0)),
    )
    origin_m = east_m - 400.0, north_m - 300.0
    epoch = Epoch(0.0, (), pseudoranges=rows)
    sky, unused = sky_over(options, CRS, origin_m, epoch, (400.0, 300.0))
    assert sky.names == ("G01", "G02")
    assert set(unused) == {
        ("pseudorange", "G01", Reason.SECOND_READING),
        ("pseudorange", "G04", Reason.UNKNOWN_SATELLITE),
        ("pseudorange", "G03", Reason.BELOW_HORIZON),
    }
    np.testing.assert_allclose(np.degrees(sky.elevation_rad), [40.0, 16.0], atol=1e-6)
    np.testing.assert_array_equal(sky.range_m, [2.1e7 + 5, 2.1e7 - 7])
    np.testing.assert_array_equal(sky.sigma_m, [3.0, np.nan])
    assert sky.origin_m == (400.0, 300.0)
    unit = np.array([[1.0, 0.0], [np.sin(np.radians(200.0)), np.cos(np.radians(200.0))]])
    flat = 2.1e7 * np.cos(np.radians([40.0, 16.0]))[:, None] * unit
    np.testing.assert_allclose(sky.satellites_m[:, :2], flat, atol=0.05)
    up_m = 2.1e7 * np.sin(np.radians([40.0, 16.0]))
    np.testing.assert_allclose(sky.satellites_m[:, 2], up_m, atol=0.05)
    frame = GridFrame(CRS, east_m, north_m, HEIGHT_M)
    np.testing.assert_array_equal(sky.true_from_grid, frame.true_from_grid)
    low = replace(epoch, pseudoranges=rows[3:4])
    assert sky_over(options, CRS, origin_m, low, (400.0, 300.0)) == (
        None, (("pseudorange", "G03", Reason.BELOW_HORIZON),),
    )  # fmt: skip
    assert sky_over(options, CRS, origin_m, replace(epoch, pseudoranges=()), (0.0, 0.0)) == (
        None,
        (),
    )
