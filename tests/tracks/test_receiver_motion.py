"""Motion by a receiver: steps and headings of positions, and the errors stated for them."""

import numpy as np
import pandas as pd
import pytest

from mapfilter.angles import wrap_rad
from mapfilter.tracks.joining.moved import course_errors, motion_from_course
from mapfilter.tracks.joining.position_motion import motion_from_positions
from mapfilter.tracks.pdr.vehicle import reckon_velocity


def drive(sd_m, seed=0, count=2000, speed_mps=8.0):
    """Return times and positions of a car on long straight roads, with white errors."""
    rng = np.random.default_rng(seed)
    time_s = np.arange(count, dtype=np.float64)
    heading = np.repeat(rng.uniform(-np.pi, np.pi, count // 100 + 1), 100)[:count]
    east_m = np.cumsum(speed_mps * np.cos(heading)) + rng.normal(0, sd_m, count)
    north_m = np.cumsum(speed_mps * np.sin(heading)) + rng.normal(0, sd_m, count)
    return time_s, east_m, north_m, heading


@pytest.mark.parametrize("sd_m", [0.3, 1.0, 2.0])
def test_the_errors_stated_are_those_of_steps_and_headings(sd_m):
    time_s, east_m, north_m, heading = drive(sd_m)
    motion, errors = motion_from_positions(time_s, east_m, north_m)
    assert errors.sigma_trans_m == pytest.approx(np.sqrt(2) * sd_m, rel=0.1)
    # An interval's own heading is that of its end.
    turned = np.angle(np.exp(1j * (motion["heading_rad"].to_numpy()[1:] - heading[1:])))
    assert errors.sigma_orient_deg == pytest.approx(np.degrees(np.nanstd(turned)), rel=0.2)
    assert errors.bias_sd_deg == 0


def test_standing_has_no_heading_and_a_gap_is_one_straight_step():
    time_s, east_m, north_m, _ = drive(0.5, count=300)
    east_m[100:160], north_m[100:160] = east_m[100], north_m[100]
    rng = np.random.default_rng(1)
    east_m[100:160] += rng.normal(0, 0.5, 60)
    kept = np.r_[0:200, 240:300]
    motion, _ = motion_from_positions(time_s[kept], east_m[kept], north_m[kept])
    assert motion["heading_rad"].iloc[101:160].isna().mean() > 0.8
    assert motion["heading_rad"].iloc[1:100].notna().all()
    over_m = np.hypot(east_m[240] - east_m[199], north_m[240] - north_m[199])
    assert motion["step_m"].iloc[200] == pytest.approx(over_m)


@pytest.mark.parametrize("count", [1, 2, 3])
def test_few_positions(count):
    time_s, east_m, north_m, _ = drive(0.0, count=count)
    motion, errors = motion_from_positions(time_s, east_m, north_m)
    assert len(motion) == count
    assert errors.sigma_trans_m > 0


def test_errors_of_speed_and_course_are_how_they_differ_from_positions():
    time_s, east_m, north_m, heading = drive(0.05)
    rng = np.random.default_rng(2)
    course_deg = 90 - np.degrees(heading) + rng.normal(0, 4.0, len(heading))
    rows = pd.DataFrame({"time_s": time_s, "course_deg": course_deg % 360})
    rows["speed_mps"] = 8.0 + rng.normal(0, 0.6, len(rows))
    motion = motion_from_course(rows, 0.0)
    errors = course_errors(motion, east_m, north_m)
    # The mean of two ends, of which the first is another road's at one in a hundred.
    assert errors.sigma_orient_deg == pytest.approx(4.0 / np.sqrt(2), rel=0.15)
    assert errors.sigma_trans_m == pytest.approx(0.6 / np.sqrt(2), rel=0.25)
    still = np.zeros(len(time_s))
    assert course_errors(motion, still, still) is None


@pytest.mark.parametrize("every_s", [2, 9, 12.5])
def test_ways_of_several_seconds_are_parted_into_steps_of_one(every_s):
    """Positions every 9 s, one way of 100 s among them."""
    time_s = np.r_[0:90:every_s, 190:280:every_s]
    rng = np.random.default_rng(3)
    east_m, north_m = np.cumsum(rng.uniform(60, 140, (2, len(time_s))), axis=1)
    motion, errors = motion_from_positions(time_s, east_m, north_m)
    lasted_s = np.diff(motion["time_s"])
    assert lasted_s.max() > 90
    assert np.sort(lasted_s)[-2] <= 1
    assert np.sum(lasted_s > 1) == 1
    assert set(time_s) <= set(motion["time_s"])
    # At each position the steps have come where it lies.
    along = motion[["step_m", "step_m"]].to_numpy() * np.column_stack(
        [np.cos(motion["heading_rad"]), np.sin(motion["heading_rad"])]
    )
    at = np.cumsum(np.nan_to_num(along), axis=0)[np.isin(motion["time_s"], time_s)]
    np.testing.assert_allclose(at[:, 0], east_m - east_m[0], atol=1e-6)
    np.testing.assert_allclose(at[:, 1], north_m - north_m[0], atol=1e-6)
    assert errors.scale == 0.1
    assert errors.period_s == pytest.approx(every_s / np.ceil(every_s))


def test_the_errors_of_parts_add_up_to_those_of_their_way():
    """A random walk whose steps of a second scatter by 2 m, seen every 9 s."""
    rng = np.random.default_rng(4)
    seen = np.r_[0:18000:9]
    east_m = np.cumsum(12.0 + rng.normal(0, 2.0, 18000))[seen]
    north_m = np.cumsum(rng.normal(0, 2.0, 18000))[seen]
    _, errors = motion_from_positions(seen.astype(np.float64), east_m, north_m)
    # About the line over two ways of n steps the middle scatters by 2 √(n / 2), as positions with
    # white errors of 2 √(n / 3) do: their ways have errors of √2 times that, each step of 2 √(2/3).
    assert errors.sigma_trans_m == pytest.approx(2.0 * np.sqrt(2 / 3), rel=0.1)
    assert errors.sigma_orient_deg == pytest.approx(np.degrees(errors.sigma_trans_m / 12), rel=0.1)


def by_distance(slow_s: float, far_m: float = 104.0) -> tuple[np.ndarray, np.ndarray]:
    """Return times and places every 104 m, of which one way takes longer, and may be farther."""
    lasted_s, way_m = np.full(40, 9.0), np.full(40, 104.0)
    lasted_s[20], way_m[20] = slow_s, far_m
    return np.r_[0.0, np.cumsum(lasted_s)], np.r_[0.0, np.cumsum(way_m)]


@pytest.mark.parametrize(
    ("slow_s", "far_m", "longest_s"),
    [
        pytest.param(120.0, 104.0, 1.0, id="slow traffic"),
        pytest.param(120.0, 500.0, 120.0, id="a tunnel"),
        pytest.param(400.0, 104.0, 400.0, id="parked"),
    ],
)
def test_of_positions_renewed_by_distance_slow_ways_are_parted(slow_s, far_m, longest_s):
    time_s, east_m = by_distance(slow_s, far_m)
    motion, _ = motion_from_positions(time_s, east_m, np.zeros_like(east_m))
    assert np.diff(motion["time_s"]).max() == pytest.approx(longest_s)
    assert motion["step_m"].sum() == pytest.approx(east_m[-1])
    at = motion["time_s"] <= time_s[21]
    assert motion["step_m"][at].sum() == pytest.approx(east_m[21])


def test_of_positions_renewed_by_time_a_short_way_over_a_gap_is_one_step():
    """A drive of varied speed that stops for a minute without positions."""
    rng = np.random.default_rng(5)
    lasted_s, way_m = np.full(40, 9.0), rng.uniform(20, 150, 40)
    lasted_s[20], way_m[20] = 60.0, 20.0
    time_s, east_m = np.r_[0.0, np.cumsum(lasted_s)], np.r_[0.0, np.cumsum(way_m)]
    motion, _ = motion_from_positions(time_s, east_m, np.zeros_like(east_m))
    assert np.diff(motion["time_s"]).max() == pytest.approx(60.0)


def receiver_and_gyroscope(time_s, rate_radps, second, **velocity):
    """Tables of sensors: a phone that lies flat, without what is not at ``time_s``."""
    rng = np.random.default_rng(0)
    rate = rng.normal(0, 0.001, (len(time_s), 3)) + np.outer(rate_radps, [0, 0, 1])
    force = rng.normal([0.0, 0.0, 9.81], 0.01, (len(time_s), 3))
    sensors = {
        "gyroscope": pd.DataFrame(rate, columns=["x_radps", "y_radps", "z_radps"]),
        "accelerometer": pd.DataFrame(force, columns=["x_mps2", "y_mps2", "z_mps2"]),
    }
    sensors = {name: rows.assign(time_s=time_s) for name, rows in sensors.items()}
    return sensors | {"velocity": pd.DataFrame({"time_s": second, **velocity})}


@pytest.mark.parametrize("stands_s", [60, 600])
def test_a_course_after_a_long_rest_gives_the_headings_of_a_gyroscope(stands_s):
    """With a course in a fifth of the time or less they counted from an arbitrary direction."""
    time_s = np.arange(0.0, stands_s + 100.0, 0.02)
    turning = (time_s > stands_s + 40) & (time_s < stands_s + 50)
    second = np.arange(1.0, stands_s + 99.0)
    drives = second > stands_s
    heading = np.pi / 2 + np.clip(second - stands_s - 40, 0, 10) * np.pi / 20
    course = {"speed_mps": 10.0 * drives, "heading_rad": np.where(drives, heading, np.nan)}
    sensors = receiver_and_gyroscope(time_s, turning * np.pi / 20, second, **course)
    motion, errors, _ = reckon_velocity(sensors)
    apart = wrap_rad(motion["heading_rad"].to_numpy()[1:] - (heading[1:] + heading[:-1]) / 2)
    assert np.degrees(np.abs(apart[drives[:-1]])).max() < 3
    assert errors.turns == "headings"


def test_a_gap_of_the_sensors_loses_no_motion_but_its_own():
    """All but the longest part between two gaps was lost."""
    time_s = np.arange(0.0, 300.0, 0.02)
    rate, second = 0.1 * np.sin(time_s / 20), np.arange(1.0, 299.0)
    heading = np.interp(second, time_s, np.cumsum(rate) * 0.02)
    known = ~((time_s > 99.5) & (time_s < 101.5)) & ~((time_s > 219.9) & (time_s < 221.1))
    course = {"speed_mps": 10.0, "heading_rad": heading}
    motion, errors, notes = reckon_velocity(
        receiver_and_gyroscope(time_s[known], rate[known], second, **course)
    )
    assert motion["time_s"].tolist() == [t for t in second if t not in (100, 101, 220, 221)]
    unknown = motion["step_m"].isna()
    assert motion.loc[unknown, "time_s"].tolist() == [102.0, 222.0]
    assert motion["turn_rad"].isna().equals(unknown)
    assert motion["step_m"].sum() == pytest.approx(10.0 * (297 - 6))
    middle = np.interp(motion["time_s"] - 0.5, second, heading)
    apart = wrap_rad(motion["heading_rad"].to_numpy() - middle)
    assert np.degrees(np.abs(apart)).max() < 6
    assert errors.turns == "headings"
    assert notes[-1] == "2 gaps of the sensors, over which motion is not known"


def test_steps_are_not_known_where_a_receiver_loses_its_fix_while_it_moves():
    """A tunnel was one straight step of three kilometres."""
    time_s = np.arange(0.0, 400.0, 0.02)
    second = np.concatenate([np.arange(1.0, 100.0), np.arange(301.0, 399.0)])
    course = {"speed_mps": 15.0, "heading_rad": 0.3 + 0.001 * second}
    sensors = receiver_and_gyroscope(time_s, np.full(time_s.size, 0.001), second, **course)
    motion, _, notes = reckon_velocity(sensors)
    unknown = motion["step_m"].isna()
    assert motion.loc[unknown, "time_s"].tolist() == [301.0]
    assert motion.loc[unknown, "turn_rad"].item() == pytest.approx(0.202, abs=0.02)
    assert notes[-1] == "1 gap of speeds (longest 202.0 s), over which turns alone are known"
    parked = np.where((second > 95) & (second < 305), 0.2, 15.0)
    sensors["velocity"]["speed_mps"] = parked
    motion, _, notes = reckon_velocity(sensors)
    assert motion["step_m"].notna().all()
    # What a receiver at rest states is noise, and was the speed of 200 s.
    assert motion["step_m"][motion["time_s"] == 301.0].item() == 0.0
    assert not any("gap" in note for note in notes)
