"""Signs of a motor vehicle in motion without headings, by motions whose signs are known."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from mapfilter.positioning.vehicle_signs import VehicleSigns, _mean_rates, vehicle_signs
from mapfilter.tracks.log import make_log

CRS = "EPSG:32635"


def signs_of(speed_mps, rate_radps, interval_s=0.1, begin_s=50.0):
    """Signs of motion by its speed and yaw rate in each interval, which end at their times."""
    speed = np.asarray(speed_mps, dtype=float)
    time_s = begin_s + interval_s * np.arange(len(speed))
    rate = np.broadcast_to(np.asarray(rate_radps, dtype=float), speed.shape)
    rows = {"time_s": time_s, "step_m": speed * interval_s, "turn_rad": rate * interval_s}
    return vehicle_signs(make_log(CRS, motion=pd.DataFrame(rows)))


@pytest.mark.parametrize(("fast_s", "top_mps"), [(100, 14.0), (30, 14.0), (10, 6.0)])
def test_the_top_speed_is_exceeded_a_tenth_of_the_time_over_ten_seconds(fast_s, top_mps):
    speed = np.full(2001, 6.0)
    speed[500 : 500 + 10 * fast_s] = 14.0
    assert signs_of(speed, 0.0).top_mps == pytest.approx(top_mps, abs=0.3)
    # Half of each ten seconds at 14 m/s are 10 m/s.
    halves = np.where(np.arange(2001) // 50 % 2 == 0, 14.0, 6.0)
    assert signs_of(halves, 0.0).top_mps == pytest.approx(10.0, abs=0.1)


def launches(gain_mps, lasts_s, count=3, interval_s=0.1):
    """Speed that grows so much within a time, again and again, and falls slowly."""
    one = np.r_[
        np.full(round(12 / interval_s), 5.0),
        np.linspace(5.0, 5.0 + gain_mps, round(lasts_s / interval_s)),
        np.full(round(12 / interval_s), 5.0 + gain_mps),
        np.linspace(5.0 + gain_mps, 5.0, round(12 / interval_s)),
    ]
    return np.tile(one, count)


@pytest.mark.parametrize(
    ("gain_mps", "lasts_s", "gains"), [(4.5, 1.0, 3), (3.5, 1.0, 0), (6.0, 8.0, 0), (8.0, 4.0, 3)]
)
def test_gains_of_speed_are_counted_once_each(gain_mps, lasts_s, gains):
    """Of 4 m/s within 3 s; a gain that lasts for longer is one."""
    assert signs_of(launches(gain_mps, lasts_s), 0.0).gains == gains


def test_gains_apart_by_more_than_three_seconds_are_two():
    speed = np.r_[np.full(20, 2.0), np.full(8, 7.0), np.full(8, 2.0), np.full(20, 7.0)]
    assert signs_of(speed, 0.0, interval_s=1.0).gains == 2


@pytest.mark.parametrize("amplitude", [0.02, 0.1])
def test_the_sway_is_the_deviation_of_the_yaw_rate_of_half_a_second(amplitude):
    """Of rates that differ from those beside them by normal numbers: √1.5 of their deviation."""
    rng = np.random.default_rng(1)
    # The turn of the first row lies before the first half second.
    rate = np.r_[0.0, np.repeat(amplitude * rng.standard_normal(4000), 5)]
    found = signs_of(np.full(rate.size, 5.0), rate).sway_radps
    assert found == pytest.approx(1.5**0.5 * amplitude, rel=0.06)
    # A circle has no sway, and what is slower than 3 m/s does not count.
    assert signs_of(np.full(3000, 5.0), 0.2).sway_radps == pytest.approx(0.0, abs=1e-6)
    assert np.isnan(signs_of(np.full(rate.size, 2.9), rate).sway_radps)
    still = np.where(np.arange(rate.size) < 10_000, 5.0, 0.0)
    mixed = signs_of(still, np.where(still > 0, 0.2, rate)).sway_radps
    assert mixed == pytest.approx(0.0, abs=1e-6)


def test_longer_intervals_tell_no_sway():
    rate = 0.1 * np.random.default_rng(2).standard_normal(600)
    assert np.isfinite(signs_of(np.full(600, 5.0), rate, interval_s=0.5).sway_radps)
    assert np.isnan(signs_of(np.full(600, 5.0), rate, interval_s=0.6).sway_radps)


def corner(turned_rad, within_m, speed_mps=2.0, back=False):
    """A straight way with a turn over some metres, perhaps the same way back after it."""
    interval_s, rate = 0.1, np.zeros(600)
    length = round(within_m / (speed_mps * interval_s))
    rate[200 : 200 + length] = turned_rad / (length * interval_s)
    if back:
        rate[200 + length : 200 + 2 * length] = -turned_rad / (length * interval_s)
    return signs_of(np.full(600, speed_mps), rate, interval_s).sharpest_rad


@pytest.mark.parametrize(("within_m", "share"), [(1.0, 1.0), (4.8, 1.0), (10.0, 0.5), (20.0, 0.25)])
@pytest.mark.parametrize("turned_rad", [1.2, -2.0])
def test_the_sharpest_turn_is_that_within_five_metres(within_m, share, turned_rad):
    found = corner(turned_rad, within_m)
    assert found == pytest.approx(abs(turned_rad) * share, rel=0.05)


def test_a_turn_that_is_undone_counts_one_way():
    assert corner(1.2, 2.0, back=True) == pytest.approx(1.2, rel=0.05)


def test_turns_at_rest_or_over_less_than_five_metres_are_none():
    rate = np.where(np.arange(400) % 100 < 50, 0.5, 0.0)
    moving = np.where(rate > 0, 0.4, 3.0)
    assert signs_of(moving, rate).sharpest_rad == 0.0
    assert signs_of(np.where(rate > 0, 0.6, 3.0), rate).sharpest_rad > 1.0
    assert signs_of(np.full(40, 1.2), 0.5).sharpest_rad == 0.0
    # A turn in one interval of more than 5 m is no sharp one.
    assert signs_of(np.full(60, 9.0), 0.3, interval_s=1.0).sharpest_rad == pytest.approx(0.0)


SIGNS = VehicleSigns(9.0, 0, np.nan, 0.5)


@pytest.mark.parametrize(
    ("changes", "fast", "vehicle"),
    [
        ({}, True, True),
        ({"top_mps": 5.0}, False, False),
        ({"top_mps": 5.01}, True, True),
        ({"sway_radps": np.radians(1.49)}, True, True),
        ({"sway_radps": np.radians(1.51)}, True, False),
        # What is faster than a cyclist, or gains speed as no cyclist does, may sway.
        ({"sway_radps": 0.1, "top_mps": 12.0}, True, False),
        ({"sway_radps": 0.1, "top_mps": 12.1}, True, True),
        ({"sway_radps": 0.1, "gains": 2}, True, False),
        ({"sway_radps": 0.1, "gains": 3}, True, True),
        # No vehicle turns about in 5 m, however fast.
        ({"sharpest_rad": np.pi / 2}, True, False),
        ({"sharpest_rad": 1.57}, True, True),
        ({"sharpest_rad": 2.0, "top_mps": 20.0, "gains": 9}, True, False),
    ],
)
def test_what_a_vehicle_is(changes, fast, vehicle):
    signs = replace(SIGNS, **changes)
    assert (signs.fast, signs.vehicle) == (fast, vehicle)


def test_signs_as_text():
    assert str(SIGNS) == "up to 9 m/s, gains of 4 m/s in 3 s: 0, turns of up to 29 deg in 5 m"
    swaying = replace(SIGNS, sway_radps=np.radians(2.04), gains=4)
    assert "gains of 4 m/s in 3 s: 4, sway of 2.0 deg/s, turns" in str(swaying)
    assert "sway of 0.0 deg/s" in str(replace(SIGNS, sway_radps=0.0))


def test_logs_with_headings_or_without_turns_have_no_signs():
    rows = pd.DataFrame({"time_s": np.arange(30.0), "step_m": 9.0, "turn_rad": 0.0})
    assert vehicle_signs(make_log(CRS, motion=rows)).top_mps == pytest.approx(9.0)
    one = rows.assign(heading_rad=np.where(np.arange(30) == 7, 0.3, np.nan))
    assert vehicle_signs(make_log(CRS, motion=one)) is None
    for turns, known in ((0, False), (1, False), (2, True)):
        some = rows.assign(turn_rad=np.where(np.arange(30) < turns, 0.1, np.nan))
        assert (vehicle_signs(make_log(CRS, motion=some)) is not None) == known
    # Rows without a length are left out.
    gaps = rows.assign(step_m=np.where(np.arange(30) % 2, np.nan, 18.0))
    assert vehicle_signs(make_log(CRS, motion=gaps)).top_mps == pytest.approx(9.0)
    none = vehicle_signs(make_log(CRS, motion=rows.assign(step_m=np.nan)))
    assert (none.top_mps, none.gains, none.sharpest_rad) == (0.0, 0, 0.0)
    assert np.isnan(none.sway_radps)


@pytest.mark.parametrize("at_rest_radps", [0.0, 1.0])
def test_the_sway_is_that_of_motion_alone(at_rest_radps):
    """Two seconds each of straight motion and of rest, at which a gyroscope may turn anything.

    Of a row at the ends of motion a fifth of half a second is at rest.
    """
    moves = np.arange(2000) // 20 % 2 == 0
    found = signs_of(np.where(moves, 5.0, 0.0), np.where(moves, 0.0, at_rest_radps))
    assert 0.0 <= found.sway_radps < 0.1


def test_limits_that_are_met_exactly():
    assert replace(SIGNS, sway_radps=np.radians(1.5)).vehicle
    # 4 m/s within 3 s are a gain, and gains 3 s apart are one.
    assert signs_of([5.0] * 9 + [9.0] * 9, 0.0, interval_s=1.0).gains == 1
    apart = [0.0] * 4 + [4.0, 0.0, 0.0, 8.0] + [0.0] * 9
    assert signs_of(apart, 0.0, interval_s=1.0).gains == 1
    assert signs_of([*apart, *apart], 0.0, interval_s=1.0).gains == 2
    # At 3 m/s nothing sways yet, and a phone of half a metre a second is at rest.
    for speed_mps, known in ((3.0, False), (3.5, True)):
        sway = signs_of(np.full(40, speed_mps), 0.1, interval_s=0.5).sway_radps
        assert np.isfinite(sway) == known
    assert signs_of(np.full(40, 0.5), 0.3, interval_s=1.0).sharpest_rad == 0.0


@pytest.mark.parametrize(
    ("step_m", "rows", "turned_rad"), [(1.0, 4, 0.0), (1.0, 5, 0.4), (1.1, 5, 0.4), (1.0, 12, 0.5)]
)
def test_rows_of_a_metre_turn_within_five_metres(step_m, rows, turned_rad):
    """By a tenth each; those of the row at which a way begins are behind it."""
    found = signs_of(np.full(rows, step_m), 0.1, interval_s=1.0).sharpest_rad
    assert found == pytest.approx(turned_rad)


def test_mean_rates_of_spans():
    found = _mean_rates(np.array([0.0, 4.0, 10.0]), np.array([0.0, 8.0, 14.0]), 2.0)
    assert found.tolist() == [2.0, 2.0, 1.0, 1.0]
    assert _mean_rates(np.zeros(0), np.zeros(0), 2.0).size == 0
    # A log that lasts for years, or has a wrong time, takes no more memory than this.
    long_s = np.array([0.0, 1000.0, 1e9])
    rates = _mean_rates(long_s, 3.0 * long_s, 0.5)
    assert rates.size == 1_000_000 - 1
    assert rates[-1] == pytest.approx(3.0)
