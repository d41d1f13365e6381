"""Steps and turns that contradict the positions of their log are named; errors of sensors are not.

Drives are made along a grid of streets: corners of 90 degrees, stops, and rows of any length.
"""

import numpy as np
import pandas as pd
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

import mapfilter as mf
from mapfilter.geodesy import unproject
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.log_options import fitted_to_log
from mapfilter.tracks.checks.motion_fault import fault_notes
from mapfilter.tracks.checks.motion_faults import motion_faults, step_fault
from mapfilter.tracks.checks.turn_faults import turn_fault
from mapfilter.tracks.motion_factors import scaled_motion

FOOT_M = 0.3048


def drive(seed=0, *, row_s=0.2, speed_mps=8.0, corners=14, drift_degps=0.0, scale=1.0):
    """Return motion and truth: straight ways, right angles to both sides over 6 m, and stops."""
    rng = np.random.default_rng(seed)
    length_m = rng.uniform(70.0, 150.0, corners + 1)
    sides = rng.choice([-1.0, 1.0], corners)
    at_m = np.cumsum(length_m)[:-1]
    moving_s = length_m.sum() / speed_mps
    time_s = np.arange(0.0, moving_s + 60.0, row_s)
    # Three stops of 20 s each.
    stops_s = np.sort(rng.uniform(0.1, 0.9, 3)) * moving_s
    stood_s = sum(np.clip(time_s - stop_s - 20 * i, 0, 20.0) for i, stop_s in enumerate(stops_s))
    along_m = np.clip(speed_mps * (time_s - stood_s), 0, length_m.sum())
    fine_m = np.arange(0.0, length_m.sum(), 0.25)
    heading = sum(
        side * np.pi / 2 * np.clip((fine_m - m) / 6 + 0.5, 0, 1)
        for side, m in zip(sides, at_m, strict=True)
    )
    east, north = (np.cumsum(0.25 * f(heading)) for f in (np.cos, np.sin))
    turn = np.diff(np.interp(along_m, fine_m, heading), prepend=np.nan)
    motion = pd.DataFrame(
        {
            "time_s": time_s,
            "step_m": scale * np.diff(along_m, prepend=0.0),
            "heading_rad": np.nan,
            "turn_rad": turn + np.radians(drift_degps) * row_s,
        }
    )
    places = {"east_m": 385_900.0 + np.interp(along_m, fine_m, east)}
    places["north_m"] = 6_671_900.0 + np.interp(along_m, fine_m, north)
    return motion, pd.DataFrame({"time_s": time_s, **places})


def fixes(truth, sd_m, seed=0, period_s=1.0):
    """Return fixes a second apart, whose errors last 20 s or so, with white noise besides."""
    rng = np.random.default_rng(seed)
    time_s = np.arange(0.0, truth["time_s"].iloc[-1], period_s)
    lasting, white = rng.standard_normal((2, len(time_s), 2))
    keep = np.exp(-period_s / 20.0)
    for i in range(1, len(time_s)):
        lasting[i] = keep * lasting[i - 1] + np.sqrt(1 - keep**2) * lasting[i]
    off_m = sd_m * (lasting + white / 2)
    names = ("east_m", "north_m")
    there = {
        name: np.interp(time_s, truth["time_s"], truth[name]) + off_m[:, i]
        for i, name in enumerate(names)
    }
    return pd.DataFrame({"time_s": time_s, **there})


@settings(max_examples=40, deadline=None)
@given(
    seed=st.integers(0, 10_000),
    row_s=st.sampled_from([0.1, 0.5, 1.0, 2.0]),
    speed_mps=st.sampled_from([1.3, 6.0, 14.0]),
    drift_degps=st.floats(-0.08, 0.08),
    scale=st.floats(0.8, 1.25),
    sd_m=st.sampled_from([0.0, 3.0, 5.0]),
)
def test_errors_of_sensors_and_receivers_are_no_faults(
    seed, row_s, speed_mps, drift_degps, scale, sd_m
):
    made = {"row_s": row_s, "speed_mps": speed_mps, "drift_degps": drift_degps, "scale": scale}
    motion, truth = drive(seed, **made)
    assert motion_faults(motion, fixes(truth, sd_m, seed) if sd_m else truth) == {}


@pytest.mark.parametrize("drift_degps", [-2.5, -1.7, -1.2, 1.2, 1.7, 2.5])
def test_turns_of_a_gyroscope_with_a_large_bias_are_not_counted_twice(drift_degps):
    """Half of them would fit corners to one side, but no straight way."""
    blamed = 0
    for seed in range(200, 240):
        motion, truth = drive(seed, speed_mps=1.3, row_s=1.0, corners=6, drift_degps=drift_degps)
        blamed += turn_fault(motion, fixes(truth, 3.0, seed)) is not None
    assert blamed <= 1


@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(0, 10_000),
    speed_mps=st.sampled_from([1.3, 8.0]),
    sd_m=st.sampled_from([0.0, 3.0]),
    clockwise=st.booleans(),
)
def test_turns_the_other_way_round_or_in_another_unit(seed, speed_mps, sd_m, clockwise):
    motion, truth = drive(seed, speed_mps=speed_mps, drift_degps=0.03)
    places = fixes(truth, sd_m, seed) if sd_m else truth
    sign, words = (-1.0, "run clockwise") if clockwise else (1.0, "")
    turn = sign * motion["turn_rad"]
    by = "by the course of the positions; expected radians counter-clockwise"

    def told(turn):
        fault = turn_fault(motion.assign(turn_rad=turn), places)
        mended = motion.assign(turn_rad=fault.factor * turn)
        assert turn_fault(mended, places) is None
        return str(fault)

    if clockwise:
        assert told(turn) == (
            f"turns run clockwise {by}, or latitude and longitude of the positions are swapped "
            "(--factor turn_rad=-1 mends it)"
        )
    more, minus = (f" and {words}", "-") if words else ("", "")
    mends = f"(--factor turn_rad={minus}"
    assert told(np.degrees(turn)) == f"turns are degrees{more} {by} {mends}0.01745 mends it)"
    rates = f"turns are rates (rad/s) in rows 0.2 s apart{more} {by} {mends}0.2 mends it)"
    assert told(turn / 0.2) == rates
    radians = (
        f"turns are radians taken for degrees (rad/s for deg/s){more} {by} {mends}57.3 mends it)"
    )
    assert told(np.radians(turn)) == radians


@pytest.mark.parametrize("speed_mps", [1.3, 8.0])
@pytest.mark.parametrize(("sign", "words"), [(1, ""), (-1, " and run clockwise")])
def test_turns_of_half_the_size(speed_mps, sign, words):
    """Of 3 000 made drives with positions 3 m off 7 were not told: hence fixed ones."""
    for seed in range(5):
        motion, truth = drive(seed, speed_mps=speed_mps, drift_degps=0.03)
        places, half = fixes(truth, 3.0, seed), motion["turn_rad"] / 2 * sign
        found = turn_fault(motion.assign(turn_rad=half), places)
        assert str(found) == (
            f"turns are half as large as they should be{words} by the course of the positions; "
            f"expected radians counter-clockwise (--factor turn_rad={2 * sign} mends it)"
        )
        assert turn_fault(motion.assign(turn_rad=found.factor * half), places) is None


@example(seed=5355, speed_mps=1.3, sd_m=0.0, of=(3.6, "km/h for m/s"))
@example(seed=5400, speed_mps=1.3, sd_m=0.0, of=(3.6, "km/h for m/s"))
@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(0, 10_000),
    speed_mps=st.sampled_from([1.3, 8.0]),
    sd_m=st.sampled_from([0.0, 3.0, 5.0]),
    of=st.sampled_from(
        [
            (3.6, "km/h for m/s"),
            (1 / 3.6, "m/s taken for km/h"),
            (1 / FOOT_M, "feet for metres"),
            (FOOT_M, "metres taken for feet"),
            (100.0, "centimetres for metres"),
            (1 / 0.2, "speeds in m/s, rows 0.2 s apart"),
            (3.6 / 0.2, "speeds in km/h, rows 0.2 s apart"),
        ]
    ),
)
def test_steps_in_another_unit(seed, speed_mps, sd_m, of):
    factor, mistake = of
    motion, truth = drive(seed, speed_mps=speed_mps, scale=1.02)
    places = fixes(truth, sd_m, seed) if sd_m else truth
    fault = step_fault(motion.assign(step_m=factor * motion["step_m"]), places)
    found = str(fault)
    assert mistake in found
    assert found.startswith("steps are ")
    times = float(found.split()[2])
    assert times == pytest.approx(factor, rel=0.1)
    assert fault.factor == pytest.approx(1 / factor, rel=0.15)
    assert found.endswith(f" (--factor step_m={fault.factor:.4g} mends it)")


def test_speeds_in_rows_of_different_length():
    """Their factor is another one on each way; that by which speeds are too long is not."""
    motion, truth = drive(3, row_s=0.5, corners=30)
    # Of one minute each row is kept, of the next one each eighth.
    at = np.arange(len(motion))
    kept = np.flatnonzero((at // 120 % 2 == 0) | (at % 8 == 0))
    rows = motion.iloc[kept].reset_index(drop=True)
    for name in ("step_m", "turn_rad"):
        rows[name] = np.diff(np.nancumsum(motion[name])[kept], prepend=0.0)
    assert motion_faults(rows, truth) == {}
    lasted_s = rows["time_s"].diff()
    speeds = rows.assign(step_m=(rows["step_m"] / lasted_s).fillna(0.0))
    assert "speeds in m/s, rows 0.5 s apart?)" in str(step_fault(speeds, truth))


def test_a_factor_without_a_unit_is_told_without_a_guess():
    motion, truth = drive(1)
    found = step_fault(motion.assign(step_m=7.0 * motion["step_m"]), truth)
    assert not found.option
    assert str(found).endswith("times as long as the way between positions; expected metres")


@settings(max_examples=40, deadline=None)
@given(
    seed=st.integers(0, 10_000),
    kind=st.sampled_from(["frozen", "led away", "scattered", "elsewhere"]),
    share=st.floats(0.05, 0.4),
    speed_mps=st.sampled_from([1.3, 8.0]),
)
def test_positions_that_are_wrong_for_a_part_of_the_log_blame_no_motion(
    seed, kind, share, speed_mps
):
    motion, truth = drive(seed, speed_mps=speed_mps)
    places = fixes(truth, 3.0, seed)
    rng = np.random.default_rng(seed)
    count = int(share * len(places))
    first = rng.integers(0, len(places) - count)
    part = slice(first, first + count)
    for name in ("east_m", "north_m"):
        place = places[name].to_numpy(copy=True)
        if kind == "frozen":
            place[part] = place[first]
        elif kind == "led away":
            place[part] += rng.normal(0, 10) * np.arange(count)
        elif kind == "scattered":
            place[part] += rng.normal(0, 100, count)
        else:
            place[part] += rng.normal(0, 1000)
        places[name] = place
    assert motion_faults(motion, places) == {}


@pytest.mark.parametrize(("sd_m", "white"), [(40.0, True), (80.0, False)])
def test_positions_that_scatter_more_than_the_phone_moves_tell_nothing(sd_m, white):
    """Lines between them are noise, of which some happen to be straight and of one length."""
    for seed in range(50):
        motion, truth = drive(seed)
        places = fixes(truth, 0.0 if white else sd_m, seed)
        if white:
            off_m = np.random.default_rng(seed).normal(0, sd_m, (2, len(places)))
            places["east_m"] += off_m[0]
            places["north_m"] += off_m[1]
        assert motion_faults(motion, places) == {}


def test_a_drive_of_two_thousand_kilometres_is_checked_like_a_short_one():
    time_s = np.arange(200_000.0)
    turn = np.where(time_s % 10 == 5, np.pi / 2, 0.0) * np.where(time_s // 10 % 2 == 1, 1, -1)
    heading = np.cumsum(turn)
    east, north = (np.cumsum(10.0 * f(heading - turn / 2)) for f in (np.cos, np.sin))
    truth = pd.DataFrame({"time_s": time_s, "east_m": east, "north_m": north})
    motion = pd.DataFrame({"time_s": time_s, "step_m": 10.0, "heading_rad": np.nan})
    assert motion_faults(motion.assign(turn_rad=turn), truth) == {}
    wrong = motion.assign(turn_rad=-turn, step_m=36.0)
    assert set(motion_faults(wrong, truth)) == {"turn_rad", "step_m"}


@pytest.mark.parametrize("value", [0.0, np.nan])
@pytest.mark.parametrize("period_s", [20.0, 400.0])
def test_steps_of_a_dead_sensor_have_no_unit(value, period_s):
    """Half of the time it counts nothing, in turn with times in which it counts."""
    motion, truth = drive(5, speed_mps=1.3)
    dead = (motion["time_s"] // (period_s / 2)) % 2 == 1
    steps = motion.assign(step_m=motion["step_m"].where(~dead, value))
    assert step_fault(steps, truth) is None


def test_turns_back_and_straight_ways_tell_no_sense_of_rotation():
    time_s = np.arange(800.0)
    heading = np.pi * (time_s // 100)
    motion = pd.DataFrame({"time_s": time_s, "step_m": 5.0, "heading_rad": np.nan})
    motion["turn_rad"] = np.diff(heading, prepend=0.0)
    mean = heading - motion["turn_rad"] / 2
    east, north = (np.cumsum(5.0 * f(mean)) for f in (np.cos, np.sin))
    truth = pd.DataFrame({"time_s": time_s, "east_m": east, "north_m": north})
    for factor in (1.0, -1.0, 2.0):
        turned = motion.assign(turn_rad=factor * motion["turn_rad"])
        assert motion_faults(turned, fixes(truth, 3.0)) == {}


def test_a_car_that_reverses_has_negative_steps():
    motion, truth = drive(6)
    # The car looks back all the way: steps are negative, turns the same.
    assert motion_faults(motion.assign(step_m=-motion["step_m"]), truth) == {}
    back = motion["time_s"].between(60, 90)
    assert motion_faults(motion.assign(step_m=motion["step_m"].where(~back, 0.0)), truth) == {}


def test_too_few_positions_or_rows_tell_nothing():
    motion, truth = drive(7)
    wrong = motion.assign(step_m=10 * motion["step_m"], turn_rad=-motion["turn_rad"])
    assert set(motion_faults(wrong, truth)) == {"turn_rad", "step_m"}
    assert motion_faults(wrong, truth.iloc[::400]) == {}
    assert motion_faults(wrong.iloc[:300], truth) == {}
    assert motion_faults(wrong.iloc[:1], truth) == {}
    assert motion_faults(wrong.iloc[:0], truth) == {}
    assert motion_faults(wrong, truth.assign(east_m=np.nan)) == {}
    assert motion_faults(wrong.assign(time_s=5.0), truth) == {}
    assert motion_faults(wrong.assign(step_m=0.0), truth) == {}


def test_a_log_has_notes_on_its_motion():
    motion, truth = drive(8)
    wrong = motion.assign(step_m=motion["step_m"] / FOOT_M, turn_rad=-motion["turn_rad"])
    assert mf.make_log("EPSG:32635", motion=motion, truth=truth).notes == ()
    log = mf.make_log("EPSG:32635", motion=wrong, gnss=fixes(truth, 3.0))
    (of_turns,), (of_steps,) = (fault_notes(log.notes, name) for name in ("turn_rad", "step_m"))
    assert of_turns.startswith("motion, turn_rad: turns run clockwise by the course")
    assert of_steps.startswith("motion, step_m: steps are 3.")
    assert "feet for metres" in of_steps
    assert log.notes == (of_turns, of_steps)
    names = {"motion": "walk.csv"}
    named = mf.make_log("EPSG:32635", motion=wrong, gnss=fixes(truth, 3.0), names=names)
    assert named.notes[0].startswith("walk.csv, turn_rad: turns run clockwise")


@pytest.mark.parametrize("count", [1, 4])
def test_a_ground_truth_of_a_few_points_leaves_the_comparison_to_fixes(count):
    motion, truth = drive(8)
    wrong = motion.assign(step_m=motion["step_m"] / FOOT_M)
    points = truth.iloc[:: len(truth) // count][:count]
    log = mf.make_log("EPSG:32635", motion=wrong, gnss=fixes(truth, 3.0), truth=points)
    assert len(fault_notes(log.notes, "step_m")) == 1
    assert mf.make_log("EPSG:32635", motion=wrong, truth=points).notes == ()


def test_a_speed_that_is_no_walkers_is_not_blamed_on_feet_where_positions_say_otherwise():
    motion, truth = drive(9, speed_mps=1.3)
    heading = np.nancumsum(motion["turn_rad"])
    heading = np.angle(np.exp(1j * heading))
    walk = motion.assign(heading_rad=heading, turn_rad=np.nan, step_m=3.6 * motion["step_m"])
    log = mf.make_log("EPSG:32635", motion=walk)
    assert any("lengths in feet" in note for note in fitted_to_log(BayesFilter(), log)[1])
    log = mf.make_log("EPSG:32635", motion=walk, truth=truth)
    assert "(km/h for m/s" in log.notes[0]
    assert not any("a walker" in note for note in fitted_to_log(BayesFilter(), log)[1])


def test_a_log_that_is_written_and_read_has_its_notes_once(tmp_path):
    motion, truth = drive(8)
    log = mf.make_log("EPSG:32635", motion=motion.assign(turn_rad=-motion["turn_rad"]), truth=truth)
    mf.write_log(log, tmp_path / "drive")
    assert mf.read_log(tmp_path / "drive").notes == log.notes


def test_positions_that_are_mirrored_do_not_blame_the_turns(tmp_path):
    motion, truth = drive(10)
    lon, lat = unproject("EPSG:32635", truth["east_m"], truth["north_m"])
    rows = motion[["step_m", "turn_rad"]].fillna(0.0)
    rows.insert(0, "time", 1_777_629_600 + motion["time_s"])
    rows["course_deg"] = np.degrees(np.pi / 2 - np.nancumsum(motion["turn_rad"])) % 360
    path = tmp_path / "drive.csv"

    def told(**changes):
        rows.assign(**changes).to_csv(path, index=False)
        notes = mf.read_log(path).notes
        clockwise = any("turn_rad: turns run clockwise" in note for note in notes)
        return clockwise, any("mirror image of the way by their courses" in note for note in notes)

    assert told(latitude=lat, longitude=lon) == (False, False)
    assert told(latitude=lat, longitude=lon, turn_rad=-rows["turn_rad"]) == (True, False)
    assert told(latitude=lon, longitude=lat) == (False, True)


def test_rows_of_which_three_have_one_time_have_a_factor():
    """Rows 0 s apart: a traceback, and a factor of 0 for turns."""
    time_s, of_row = np.arange(300.0), np.repeat(np.arange(300), 3)
    heading = np.where((time_s // 60) % 2 == 0, 0.0, np.pi / 2)
    east_m, north_m = (np.cumsum(10 * f(heading)) for f in (np.cos, np.sin))
    truth = pd.DataFrame({"time_s": time_s, "east_m": east_m, "north_m": north_m})
    rows = pd.DataFrame({"time_s": time_s[of_row], "step_m": 10.0, "heading_rad": heading[of_row]})
    fault = step_fault(rows.assign(turn_rad=np.nan), truth)
    assert "speeds in m/s, rows 0.33 s apart" in fault.found
    assert fault.factor == pytest.approx(1 / 3, rel=0.01)
    rates = np.diff(heading, prepend=0.0)[of_row]
    turned = turn_fault(rows.assign(step_m=10 / 3, turn_rad=rates), truth)
    assert turned.factor == pytest.approx(1 / 3, rel=0.01)


def test_a_factor_of_steps_is_that_of_their_errors_too():
    motion = pd.DataFrame({"step_m": [4.0, 5.0], "turn_rad": 0.1, "sampling_sd_m": [1.0, np.nan]})
    scaled, _ = scaled_motion(motion, {"step_m": -FOOT_M, "turn_rad": 2.0}, "log")
    assert scaled["sampling_sd_m"].fillna(0.0).tolist() == [FOOT_M, 0.0]
    kept, _ = scaled_motion(motion, {"turn_rad": 2.0}, "log")
    assert kept["sampling_sd_m"].equals(motion["sampling_sd_m"])
