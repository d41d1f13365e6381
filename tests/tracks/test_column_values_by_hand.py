"""Speeds, turns, times and levels of a plain CSV by hand: units, neighbours and ends of ranges."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from mapfilter.tracks.checks.clock_steps import clock_steps
from mapfilter.tracks.readers.formats import read_recording
from mapfilter.tracks.readers.plain.odometry import _at_speeds
from mapfilter.tracks.readers.plain.times import _without_digits
from mapfilter.tracks.readers.recorded.reading import Reading

START_S = 1_777_629_600.0
NAN = np.nan


@pytest.fixture
def read(tmp_path):
    def of(**columns):
        table = pd.DataFrame(columns)
        if "time" not in table:
            table.insert(0, "time", START_S + np.arange(len(table)))
        table.to_csv(tmp_path / "drive.csv", index=False)
        return read_recording(tmp_path / "drive.csv").tables

    return of


@pytest.mark.parametrize(
    ("column", "factor"),
    [("wheel_speed_kmh", 3.6), ("wheel_speed_mps", 1.0), ("Wheel speed [km/h]", 3.6)],
)
def test_speeds_of_wheels_are_in_their_unit(read, column, factor):
    speed = np.array([0.0, 10.0, -2.0, 33.25])
    rate = np.array([0.0, 0.5, -0.5, 3.49])
    found = read(**{column: factor * speed, "yaw_rate_degps": np.degrees(rate)})["odometry"]
    assert found["speed_mps"].to_numpy() == pytest.approx(speed)
    assert found["yaw_rate_radps"].to_numpy() == pytest.approx(rate)
    assert (found["time_s"] - START_S).tolist() == [0, 1, 2, 3]


@pytest.mark.parametrize(("apart_s", "rate"), [(1.0, 0.2), (1.01, NAN)])
def test_rates_of_rows_a_second_away_are_those_of_speeds(apart_s, rate):
    time_s = np.array([0.0, 10 - apart_s, 10.0, 10 + apart_s])
    speed = np.array([NAN, NAN, 20.0, NAN])
    yaw = np.array([NAN, 0.1, NAN, 0.3])
    found = _at_speeds(Reading(Path("a.csv")), time_s, speed, yaw).tolist()
    assert found == pytest.approx([NAN, 0.1, rate, 0.3], nan_ok=True)
    # The nearest row counts, and after the last one its own rate.
    later = _at_speeds(
        Reading(Path("a.csv")), np.array([0.0, 1.0]), np.array([NAN, 20.0]), np.array([0.1, NAN])
    )
    assert later.tolist() == [0.1, 0.1]


def test_rates_that_no_vehicle_turns_by_are_not_taken():
    reading = Reading(Path("a.csv"))
    time_s, speed = np.array([0.0, 0.5, 1.0]), np.array([NAN, 20.0, NAN])
    found = _at_speeds(reading, time_s, speed, np.array([3.5, NAN, 3.6])).tolist()
    assert found == [3.5, 3.5, 3.6]
    assert len(reading.notes) == 2


def test_a_course_of_less_than_1_mps_is_noise(read):
    found = read(speed_mps=[0.99, 1.0, -1.0, 5.0], course_deg=[10.0, 20.0, 30.0, 359.0])["odometry"]
    assert found["compass_deg"].tolist() == pytest.approx([NAN, 20, 30, 359], nan_ok=True)


def test_times_of_day_in_one_number_jump_by_40_at_each_minute():
    """9:56:58 to 10:00:01, of which 3 minutes begin: 95659 is followed by 95700."""
    second = np.arange(9 * 3600 + 56 * 60 + 58, 10 * 3600 + 2 * 60 + 2.0)
    number = 10_000 * (second // 3600) + 100 * (second % 3600 // 60) + second % 60
    assert number[[0, -1]].tolist() == [95_658, 100_201]
    found = _without_digits(Reading(Path("a.csv")), np.append(number, NAN))
    assert found.tolist() == pytest.approx([*second, NAN], nan_ok=True)
    # Two minutes alone, or numbers that end in 60 and more, are seconds.
    for other in (number[:100], number + 40, np.arange(95_658.0, 96_058.0)):
        reading = Reading(Path("a.csv"))
        assert _without_digits(reading, other).tolist() == other.tolist()
        assert reading.notes == []


def test_three_minutes_begin_in_times_of_day_in_one_number():
    second = np.arange(9 * 3600 + 56 * 60 + 1, 9 * 3600 + 59 * 60 + 59.0)
    number = 90_000 + 100 * (second % 3600 // 60) + second % 60
    assert _without_digits(Reading(Path("a.csv")), number).tolist() == second.tolist()
    # 60 minutes are none.
    later = number + 100
    assert later[-1] == 96_058
    assert _without_digits(Reading(Path("a.csv")), later).tolist() == later.tolist()


def test_hours_of_a_time_of_day_are_24():
    second = np.arange(23 * 3600 + 50 * 60, 24 * 3600.0)
    number = 10_000 * (second // 3600) + 100 * (second % 3600 // 60) + second % 60
    assert _without_digits(Reading(Path("a.csv")), number).tolist() == second.tolist()
    later = number + 10_000
    assert _without_digits(Reading(Path("a.csv")), later).tolist() == later.tolist()


def test_levels_of_rssi_are_those_of_gsm_alone(read):
    rows = read(cid=[1, 2, 3, 4], technology=["GSM", "LTE", "GSM", "LTE"], rsrp=["", "", -90, -95],
                rssi=[-70, -60, -71, -61])["radio"]  # fmt: skip
    assert rows["level_dbm"].tolist() == pytest.approx([-70, NAN, -90, -95], nan_ok=True)


def test_the_only_technology_whose_columns_hold_something(read):
    rows = read(earfcn=[1300, "", 1300, -1], uarfcn=["", 10_588, 10_588, 10_612],
                cid=[1, 2, 3, 4], level_dbm=-80)["radio"]  # fmt: skip
    assert [one if isinstance(one, str) else None for one in rows["technology"]] == [
        *("LTE", "UMTS", None, "UMTS"),
    ]


@pytest.mark.parametrize(("back_s", "found"), [(3.0, True), (2.0, True), (1.0, False)])
def test_a_clock_that_is_set_back_repeats_three_times_and_more(back_s, found):
    """Of the second before the fall and those after it 4 and 3 are the same, but 2 are too few."""
    time_s = np.concatenate([np.arange(40.0), np.arange(40 - 1 - back_s, 60.0)])
    (*steps,) = clock_steps(time_s)
    assert bool(steps) == found
    if found:
        (step,) = steps
        assert (step.row, step.at_s, step.back_s, step.late_s) == (40, 39, back_s, back_s + 1)


def test_four_steps_and_few_times_are_none_of_a_clock():
    part = np.arange(30.0)
    for count, found in ((1, True), (3, True), (4, False)):
        time_s = np.concatenate([part + 25 * k for k in range(count + 1)])
        assert bool(clock_steps(time_s)) == found, count
    # 30 rises are enough, 29 are not.
    assert clock_steps(np.concatenate([np.arange(16.0), np.arange(10.0, 26.0)]))
    assert not clock_steps(np.concatenate([np.arange(16.0), np.arange(10.0, 25.0)]))
