"""Lasting errors of pseudoranges: a state for each satellite, against Gaussian formulas."""

from dataclasses import replace
from math import nan

import numpy as np
import pytest

from mapfilter.models.street_motion import STATES
from mapfilter.positioning.gnss.biases import MOST, Biases, kept_share, reflection_deviations_m
from mapfilter.positioning.gnss.options import GnssOptions
from mapfilter.positioning.gnss.receiver import (
    LINEAR,
    agreement,
    begun,
    begun_anew,
    carried,
    centred,
    moved,
    weighed,
    with_satellites,
)
from mapfilter.positioning.gnss.sky import Sky

OPTIONS = GnssOptions(
    echo_m=3.0, echo_memory_m=50.0, echo_memory_s=60.0, reflection_m=5.0, lateness=0.5, slope=0.0,
    height_sd_m=0.0,
)  # fmt: skip
UNIT = np.array([[0.3, 0.5, 0.9], [-0.8, 0.1, 0.7], [0.6, -0.6, 0.5]])
UNIT /= np.linalg.norm(UNIT, axis=1)[:, None]
PLACES = np.array([[0.0, 40.0, -20.0, 55.0], [0.0, 30.0, 25.0, -60.0]], dtype=np.float32)
SIGMA_M = np.array([4.0, 6.0, 5.0])
CLOCK_SD_M = 7.0


def sky_of(names=("G01", "G02", "G03"), late_m=(0.0, 0.0, 0.0)):
    unit = UNIT[: len(names)]
    return Sky(
        tuple(names), 2.2e7 * unit, np.arcsin(unit[:, 2]),
        np.full(len(names), 2.2e7) + np.array(late_m[: len(names)]), np.full(len(names), nan),
        (0.0, 0.0), np.eye(2),
    )  # fmt: skip


def receiver_of(sky, options=OPTIONS):
    """A receiver that knows its clock and rate to some metres, and nothing of the satellites."""
    receiver = replace(begun(options, 0.0, 0.0), covariance=np.diag([CLOCK_SD_M**2, 0.0, 0.0]))
    return with_satellites(options, receiver, np.zeros((LINEAR, PLACES.shape[1])), sky)


def distances(sky):
    there = np.vstack([PLACES, np.zeros(PLACES.shape[1])]).T.astype(float)
    return np.linalg.norm(sky.satellites_m[:, None] - there[None], axis=2)


def log_densities(off_m, covariance):
    nats = -0.5 * np.sum(off_m * np.linalg.solve(covariance, off_m), axis=0)
    return nats - np.log(np.mean(np.exp(nats)))


def test_sizes_of_reflections():
    """By elevation, or by the receiver's deviations: weak signals are the reflected ones."""
    elevation = np.radians([90.0, 45.0, 20.0, 2.0])
    plain = reflection_deviations_m(OPTIONS, elevation, np.full(4, nan))
    np.testing.assert_allclose(
        plain, [0.0, 5.0, 5.0 / np.tan(elevation[2]), 5.0 / np.tan(np.radians(10.0))], atol=1e-9
    )
    options = replace(OPTIONS, reflection_times=2.0)
    stated = reflection_deviations_m(options, elevation, np.array([5.0, 10.0, nan, 40.0]))
    # Twice the deviation, times its ratio to the least, which counts as three at most.
    np.testing.assert_allclose(stated, [10.0, 40.0, plain[2], 240.0])
    alike = reflection_deviations_m(options, elevation, np.full(4, 6.0))
    np.testing.assert_allclose(alike, 12.0)


def test_an_error_begins_unknown_and_late_and_goes_on_as_a_gauss_markov_process():
    sky = sky_of()
    receiver, rows = receiver_of(sky)
    size_m = 5.0 / np.tan(sky.elevation_rad)
    np.testing.assert_allclose(receiver.mean[LINEAR:], 0.5 * size_m)
    np.testing.assert_allclose(np.diag(receiver.covariance)[LINEAR:], 9.0 + size_m**2)
    known = receiver.covariance.copy()
    known[LINEAR, LINEAR] = 1.0
    known[0, LINEAR] = known[LINEAR, 0] = 2.0
    mean = receiver.mean.copy()
    mean[LINEAR] = 20.0
    rows[LINEAR] = [1.0, -1.0, 2.0, -2.0]
    before = replace(receiver, mean=mean, covariance=known)
    after, later = moved(OPTIONS, before, rows, 6.0, 10.0)
    keep = np.exp(-10.0 / 50.0 - 6.0 / 60.0)
    assert kept_share(OPTIONS, 10.0, 6.0) == pytest.approx(keep)
    usual = 0.5 * size_m[0]
    assert after.mean[LINEAR] == pytest.approx(usual + keep * (20.0 - usual))
    np.testing.assert_allclose(after.mean[LINEAR + 1 :], 0.5 * size_m[1:])
    np.testing.assert_allclose(later[LINEAR], keep * rows[LINEAR])
    variance = keep**2 + (1 - keep**2) * (9.0 + size_m[0] ** 2)
    assert after.covariance[LINEAR, LINEAR] == pytest.approx(variance)
    assert after.covariance[0, LINEAR] == pytest.approx(2.0 * keep)
    np.testing.assert_allclose(np.diag(after.covariance)[LINEAR + 1 :], 9.0 + size_m[1:] ** 2)


def test_lasting_errors_are_integrated_out():
    sky = sky_of(late_m=(4.0, -6.0, 9.0))
    receiver, rows = receiver_of(sky)
    size_m = 5.0 / np.tan(sky.elevation_rad)
    whole = np.diag(SIGMA_M**2 + 9.0 + size_m**2) + CLOCK_SD_M**2
    off = sky.range_m[:, None] - distances(sky) - 0.5 * size_m[:, None]
    found = weighed(sky, SIGMA_M, receiver, PLACES, np.zeros(4), rows)
    np.testing.assert_allclose(found.gain, log_densities(off, whole), atol=1e-6)
    weight = np.full(4, 0.25, dtype=np.float32)
    mean = off @ weight
    spread = np.cov(off, ddof=0) + whole
    expected = 0.5 * (3 - mean @ np.linalg.solve(spread, mean))
    assert agreement(sky, SIGMA_M, receiver, PLACES, weight, rows) == pytest.approx(expected)


def test_ten_readings_in_one_place_are_not_ten_independent_ones():
    """Together they are what Gaussian errors with a common part make of them, and no more."""
    sky = sky_of(late_m=(25.0, 0.0, 0.0))
    receiver, rows = receiver_of(sky)
    total, log_weight = np.zeros(4), np.zeros(4)
    for _ in range(10):
        found = weighed(sky, SIGMA_M, receiver, PLACES, log_weight, rows)
        total, log_weight = total + found.gain, log_weight + found.gain
        receiver, rows = replace(receiver, covariance=found.covariance), found.rows
    size_m = 5.0 / np.tan(sky.elevation_rad)
    common = np.diag(9.0 + size_m**2) + CLOCK_SD_M**2
    off = sky.range_m[:, None] - distances(sky) - 0.5 * size_m[:, None]
    together = log_densities(off, common + np.diag(SIGMA_M**2) / 10)
    np.testing.assert_allclose(np.diff(total), np.diff(together), atol=1e-5)
    once = log_densities(off, common + np.diag(SIGMA_M**2))
    assert np.ptp(once) < np.ptp(total) < 3 * np.ptp(once)


def test_a_satellite_that_comes_back_soon_is_the_same_and_later_a_new_one():
    first, other = sky_of(), sky_of(("G05",))
    receiver, rows = receiver_of(first)
    found = weighed(first, SIGMA_M, receiver, PLACES, np.zeros(4), rows)
    receiver = replace(receiver, covariance=found.covariance)
    for gone_m, names in ((10.0, ("G01", "G02", "G03", "G05")), (500.0, ("G05",))):
        later, moved_rows = moved(OPTIONS, receiver, found.rows, 1.0, gone_m)
        after, kept = with_satellites(OPTIONS, later, moved_rows, other)
        assert after.biases.names == names
        assert after.mean.shape == (LINEAR + len(names),)
        assert kept.shape == (LINEAR + len(names), 4)
        np.testing.assert_array_equal(kept[:LINEAR], moved_rows[:LINEAR])
        np.testing.assert_array_equal(kept[-1], 0.0)
    near, _ = moved(OPTIONS, receiver, found.rows, 1.0, 10.0)
    again, _ = with_satellites(OPTIONS, near, found.rows, sky_of(("G02", "G07")))
    assert again.biases.names == ("G01", "G02", "G03", "G07")
    old = again.covariance[LINEAR + 1, LINEAR + 1]
    assert old == near.covariance[LINEAR + 1, LINEAR + 1] < again.covariance[-1, -1]
    assert again.covariance[0, LINEAR + 1] == near.covariance[0, LINEAR + 1] != 0
    np.testing.assert_array_equal(again.covariance[-1, :-1], 0.0)


def test_never_more_satellites_than_can_be_held():
    sky = sky_of()
    receiver, rows = receiver_of(sky)
    known = receiver.covariance.copy()
    known[LINEAR:, LINEAR:] = 0.5 * known[LINEAR:, LINEAR:]
    receiver = replace(receiver, covariance=known)
    many = tuple(f"E{k:02d}" for k in range(MOST))
    after, _ = with_satellites(OPTIONS, receiver, rows, crowd_of(many))
    assert after.biases.names == many


def crowd_of(names):
    unit = np.tile(UNIT[:1], (len(names), 1))
    return replace(
        sky_of(), names=tuple(names), satellites_m=2.2e7 * unit,
        elevation_rad=np.arcsin(unit[:, 2]), range_m=np.full(len(names), 2.2e7),
        sigma_m=np.full(len(names), nan),
    )  # fmt: skip


def test_a_satellite_missing_for_an_epoch_is_remembered_in_a_crowd():
    """Satellites that are received again count once: as many as can be held are, and no more."""
    names = [f"E{k:02d}" for k in range(MOST)]
    for count, new, remembered in ((MOST, 0, True), (40, 24, True), (40, 25, False)):
        receiver, rows = receiver_of(crowd_of(names[:count]))
        known = receiver.covariance.copy()
        known[LINEAR:, LINEAR:] = 0.5 * known[LINEAR:, LINEAR:]
        receiver = replace(receiver, covariance=known)
        others = [f"G{k:02d}" for k in range(new)]
        after, _ = with_satellites(OPTIONS, receiver, rows, crowd_of(names[1:count] + others))
        assert (names[0] in after.biases.names) is remembered
        assert len(after.biases.names) == count + new - (not remembered)


def test_a_receiver_beside_another_belief_knows_its_clock_only_roughly():
    receiver, rows = receiver_of(sky_of())
    mean = np.array([5e4, 3.0, 8.0, 1.0, 2.0, 3.0])
    receiver = replace(receiver, time_s=7.0, travelled_m=90.0, used_at_m=80.0, mean=mean)
    found, new = begun_anew(OPTIONS, receiver), begun(OPTIONS, 7.0, 90.0)
    np.testing.assert_array_equal(found.mean, [5e4, 3.0, 0.0])
    np.testing.assert_array_equal(found.covariance, new.covariance)
    assert (found.time_s, found.travelled_m, found.used_at_m) == (7.0, 90.0, 80.0)
    assert found.biases.names == ()
    assert mean[2] == 8.0
    # Hypotheses that carry errors beside the receiver before have none of them beside this one.
    _, carrying = centred(receiver, rows + 4.0 * np.arange(4), np.zeros((STATES, 4), "f4"))
    np.testing.assert_array_equal(carried(carrying, found.mean.size), 0.0)


def test_hypotheses_carry_lasting_errors():
    receiver, rows = receiver_of(sky_of())
    rows[LINEAR] = [1.0, 2.0, 3.0, 6.0]
    state = np.zeros((STATES, 4), dtype=np.float32)
    after, carrying = centred(receiver, rows, state)
    assert carrying.shape == (STATES + LINEAR + 3, 4)
    np.testing.assert_allclose(carried(carrying, after.mean.size)[LINEAR], [-2, -1, 0, 3])
    assert after.mean[LINEAR] == pytest.approx(receiver.mean[LINEAR] + 3.0)


def test_a_satellite_that_is_hidden_keeps_the_error_that_it_had_when_it_was_received():
    """It is known to 1 m; another one, of which nothing was found out, is left out."""
    old = Biases(("G07", "G08", "G02"), np.array([31.0, 32.0, 33.0]))
    receiver = replace(
        begun(OPTIONS, 0.0, 0.0), mean=np.array([990.0, 2.0, 15.0, 7.0, 8.0, 9.0]), biases=old,
        covariance=np.diag([9.0, 9.0, 9.0, 1.0, 3.0**2 + 32.0**2, 4.0]),
    )  # fmt: skip
    sky, rows = sky_of(), np.arange(24.0).reshape(6, 4)
    found, carrying = with_satellites(OPTIONS, receiver, rows, sky)
    assert found.biases.names == ("G07", "G02", "G01", "G03")
    # Those of the epoch have what it says: 5 m times the cotangent of the elevation.
    expected = 5.0 / np.tan(sky.elevation_rad)
    np.testing.assert_allclose(found.biases.reflection_m, [31.0, *expected[[1, 0, 2]]])
    # The mean of a new one is half of it.
    np.testing.assert_allclose(found.mean, [990.0, 2.0, 15.0, 7.0, 9.0, *0.5 * expected[[0, 2]]])
    new_m2 = 9.0 + expected[[0, 2]] ** 2
    np.testing.assert_allclose(found.covariance, np.diag([9.0, 9.0, 9.0, 1.0, 4.0, *new_m2]))
    np.testing.assert_array_equal(carrying, [*rows[[0, 1, 2, 3, 5]], *np.zeros((2, 4))])


def test_an_error_is_known_below_95_hundredths_of_its_first_variance():
    first_m2 = 3.0**2 + np.array([2.0, 4.0, 6.0]) ** 2
    held = Biases(("G01", "G02", "G03"), np.array([2.0, 4.0, 6.0]))
    found = held.known(OPTIONS, np.array([0.94, 0.95, 0.96]) * first_m2)
    assert found.tolist() == [True, False, False]
    assert Biases().means_m(OPTIONS).size == Biases().variances_m2(OPTIONS).size == 0


def test_no_stated_deviation_counts_as_less_than_a_millionth_of_a_millimetre():
    """The ratio to the least one of 0 would be none: here it is 1.5, of 1e-9 m."""
    stated = np.array([0.0, 1.5e-9])
    found = reflection_deviations_m(OPTIONS, np.radians([40.0, 50.0]), stated)
    np.testing.assert_allclose(found, [0.0, OPTIONS.reflection_times * 1.5e-9 * 1.5])
