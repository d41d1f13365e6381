"""Odometry as vehicles log it: speeds and yaw rates in rows of their own, and rows that miss."""

import numpy as np
import pandas as pd
import pytest

from mapfilter.tracks.joining.moved import motion_from_odometry, odometry_gaps
from mapfilter.tracks.open_log import open_log
from mapfilter.tracks.open_options import CombineOptions, OpenOptions
from mapfilter.tracks.pdr.vehicle import reckon_odometry

UTM = OpenOptions(combine=CombineOptions(crs="EPSG:32629"))
TIME_S = np.arange(0.0, 60.0, 0.1)
SPEED_MPS = 8.0 + 2.0 * np.sin(TIME_S / 9)
RATE_RADPS = 0.2 * np.sin(TIME_S / 7)


def written(path, rows):
    """A CSV whose empty fields are values that a row lacks."""
    pd.DataFrame(rows).to_csv(path, index=False)
    return path


def test_speeds_and_yaw_rates_in_rows_of_their_own_are_joined(tmp_path):
    """As a bus sends them: of the true turns nothing is lost."""
    odd = np.arange(TIME_S.size) % 2 == 1
    rows = {
        "time": TIME_S,
        "wheel_speed_mps": np.where(odd, SPEED_MPS, np.nan),
        "yaw_rate_radps": np.where(odd, np.nan, RATE_RADPS),
    }
    log = open_log([written(tmp_path / "bus.csv", rows)], options=UTM).log
    whole = motion_from_odometry(
        pd.DataFrame({"time_s": TIME_S, "speed_mps": SPEED_MPS, "yaw_rate_radps": RATE_RADPS})
    )
    assert len(log.motion) == odd.sum()
    assert log.motion["step_m"].sum() == pytest.approx(whole["step_m"].sum(), rel=0.01)
    turned = np.cumsum(whole["turn_rad"].to_numpy())[odd]
    np.testing.assert_allclose(np.cumsum(log.motion["turn_rad"]), turned, atol=0.02)
    assert any("300 yaw rates taken from rows beside" in note for note in log.notes)


@pytest.mark.parametrize("late", ["speed", "direction"])
@pytest.mark.parametrize("field", ["yaw_rate_radps", "compass_deg"])
def test_rows_of_their_own_at_the_same_time_are_joined(tmp_path, field, late):
    """Of those that came second all was lost, or reading failed."""
    value = RATE_RADPS if field == "yaw_rate_radps" else 90.0 + np.degrees(RATE_RADPS)
    whole = pd.DataFrame({"time": TIME_S, "wheel_speed_mps": SPEED_MPS, field: value})
    speeds, others = whole.drop(columns=field), whole.drop(columns="wheel_speed_mps")
    order = [speeds, others] if late == "direction" else [others, speeds]
    apart = pd.concat(order).sort_values("time", kind="stable")
    read = {
        name: open_log([written(tmp_path / f"{name}.csv", rows)], options=UTM).log.motion
        for name, rows in (("whole", whole), ("apart", apart[whole.columns]))
    }
    assert np.nansum(read["whole"]["step_m"]) == pytest.approx(8.0 * 60, rel=0.05)
    pd.testing.assert_frame_equal(read["apart"], read["whole"])


def test_a_course_in_rows_of_its_own_gives_headings_but_at_rest(tmp_path):
    speed = np.where(TIME_S < 10, 0.0, SPEED_MPS)
    apart = {
        "time": np.concatenate([TIME_S, TIME_S + 0.05]),
        "speed_mps": np.concatenate([speed, np.full(TIME_S.size, np.nan)]),
        "course_deg": np.concatenate([np.full(TIME_S.size, np.nan), np.full(TIME_S.size, 90.0)]),
    }
    motion = open_log([written(tmp_path / "bus.csv", apart)], options=UTM).log.motion
    drives = motion["time_s"].between(10.5, 59.5)
    np.testing.assert_allclose(motion.loc[drives, "heading_rad"], 0.0, atol=0.1)
    assert motion.loc[motion["time_s"] < 8, "heading_rad"].isna().all()


def test_yaw_rates_far_from_speeds_are_not_taken(tmp_path):
    early = TIME_S < 20.0
    rows = {
        "time": np.concatenate([TIME_S, TIME_S[early] + 0.05]),
        "wheel_speed_mps": np.concatenate([SPEED_MPS, np.full(early.sum(), np.nan)]),
        "yaw_rate_radps": np.concatenate([np.full(TIME_S.size, np.nan), RATE_RADPS[early]]),
    }
    motion = open_log([written(tmp_path / "bus.csv", rows)], options=UTM).log.motion
    known = motion["turn_rad"].notna().to_numpy()
    # The yaw rates end at 20 s, and each is taken for a second more.
    assert known[1:200].all()
    assert not known[215:].any()


@pytest.mark.parametrize("gone_s", [4.0, 30.0])
def test_what_happened_while_rows_are_missing_is_not_known(gone_s):
    """The rows at both ends tell nothing of what was between: no step, no turn."""
    kept = (TIME_S < 25.0) | (25.0 + gone_s <= TIME_S)
    rows = pd.DataFrame({"time_s": TIME_S, "speed_mps": SPEED_MPS, "yaw_rate_radps": RATE_RADPS})
    whole, motion = motion_from_odometry(rows), motion_from_odometry(rows[kept])
    unknown = motion["step_m"].isna().to_numpy()
    assert motion["time_s"].to_numpy()[unknown].tolist() == pytest.approx([25.0 + gone_s])
    assert np.isnan(motion["turn_rad"].to_numpy()[unknown]).all()
    others = whole[kept][~unknown]
    np.testing.assert_allclose(motion["step_m"][~unknown], others["step_m"])
    _, _, notes = reckon_odometry(rows[kept])
    assert any(f"1 gap (longest {gone_s + 0.1:.1f} s)" in note for note in notes)


def test_rests_and_slow_rows_are_no_gaps():
    assert not odometry_gaps(np.array([0.0, 1.0, 60.0, 61.0]), np.zeros(4)).any()
    assert not odometry_gaps(np.arange(0.0, 100.0, 5.0), np.full(20, 9.0)).any()
    assert not odometry_gaps(np.array([0.0, 0.1, 2.9, 3.0]), np.full(4, 9.0)).any()
    # Rows stop at a rest and go on once the vehicle moves: it moved in between.
    moved = odometry_gaps(np.array([0.0, 0.1, 30.0, 30.1]), np.array([0.0, 0.0, 9.0, 9.0]))
    assert moved.tolist() == [False, False, True, False]
    assert not odometry_gaps(np.array([0.0]), np.array([9.0])).any()


def test_who_stands_before_and_after_a_gap_has_not_turned():
    """Half a degree a second of a gyroscope's bias would be 15° in 30 s."""
    time_s = np.r_[np.arange(0.0, 10.0, 0.1), np.arange(40.0, 50.0, 0.1)]
    rows = pd.DataFrame({"time_s": time_s, "speed_mps": 0.0, "yaw_rate_radps": 0.009})
    motion = motion_from_odometry(rows)
    assert motion["turn_rad"].to_numpy()[100] == 0.0
    assert motion["step_m"].to_numpy()[100] == 0.0
    np.testing.assert_allclose(np.delete(motion["turn_rad"].to_numpy(), [0, 100]), 0.0009)


def test_a_turn_in_a_gap_is_no_fault_of_the_log(tmp_path):
    """Seven radians in 25 s at the rate of the next row were refused as degrees."""
    kept = (TIME_S < 10.0) | (TIME_S >= 35.0)
    rate = np.where(TIME_S < 10.0, 0.0, 0.6)
    rows = {"time": TIME_S, "wheel_speed_mps": SPEED_MPS, "yaw_rate_radps": rate}
    path = written(tmp_path / "gap.csv", pd.DataFrame(rows)[kept])
    assert len(open_log([path], options=UTM).log.motion) == kept.sum()


def test_where_a_vehicle_drives_without_a_yaw_rate_is_not_known():
    """Steps without a direction were followed to all sides, each on its own: a rest, in the sum."""
    blind = (TIME_S > 20.0) & (TIME_S < 30.0)
    rate = np.where(blind, np.nan, RATE_RADPS)
    rows = pd.DataFrame({"time_s": TIME_S, "speed_mps": SPEED_MPS, "yaw_rate_radps": rate})
    motion, _, notes = reckon_odometry(rows)
    unknown = motion["step_m"].isna().to_numpy()
    # The interval that begins with the last of them has no turn, either.
    assert np.array_equal(unknown, blind | (np.abs(TIME_S - 30.0) < 0.05))
    assert any("no yaw rate over 10.0 s of driving" in note for note in notes)
    standing = rows.assign(speed_mps=np.where(blind, 0.0, SPEED_MPS))
    assert reckon_odometry(standing)[0]["step_m"].isna().sum() <= 2


@pytest.mark.parametrize("gone", ["empty", "mark", "stuck", "rows"])
def test_turns_while_speeds_are_missing_are_known(tmp_path, gone):
    """The way is not known, its turns are: a bus that lacks speeds for eight seconds."""
    lost = (TIME_S > 20.0) & (TIME_S < 28.0)
    rows = {"time": TIME_S, "wheel_speed_mps": SPEED_MPS, "yaw_rate_radps": RATE_RADPS}
    missing = {"empty": np.nan, "mark": 182.04, "stuck": 71.1, "rows": np.nan}[gone]
    rows["wheel_speed_mps"] = np.where(lost, missing, SPEED_MPS)
    if gone == "rows":
        # Yaw rates in rows of their own, ten times in a second.
        rows = {"time": np.r_[TIME_S, TIME_S + 0.05]}
        rows["wheel_speed_mps"] = np.r_[np.where(lost, np.nan, SPEED_MPS), np.full(600, np.nan)]
        rows["yaw_rate_radps"] = np.r_[np.full(600, np.nan), RATE_RADPS]
    log = open_log([written(tmp_path / "bus.csv", rows)], options=UTM).log
    time_s, steps_m = log.motion["time_s"].to_numpy(), log.motion["step_m"].to_numpy()
    unknown = np.isnan(steps_m)
    assert time_s[unknown].min() == pytest.approx(20.1, abs=0.06)
    assert time_s[unknown].max() == pytest.approx(28.0, abs=0.06)
    assert unknown.sum() >= 80
    way_m = np.trapezoid(SPEED_MPS, TIME_S) - np.trapezoid(SPEED_MPS[200:281], TIME_S[200:281])
    assert np.nansum(steps_m) == pytest.approx(way_m, rel=2e-3)
    whole = motion_from_odometry(
        pd.DataFrame({"time_s": TIME_S, "speed_mps": SPEED_MPS, "yaw_rate_radps": RATE_RADPS})
    )
    turned = np.interp(time_s, TIME_S, np.cumsum(whole["turn_rad"]))
    np.testing.assert_allclose(np.cumsum(log.motion["turn_rad"]), turned, atol=0.02)
    assert any("1 gap (longest 8.0 s), over which turns alone are known" in n for n in log.notes)


def test_short_lacks_of_speeds_are_no_gaps():
    """Rows without a speed between others close by are joined over, as before."""
    speed = np.where(np.arange(TIME_S.size) % 3 == 1, np.nan, SPEED_MPS)
    rows = pd.DataFrame({"time_s": TIME_S, "speed_mps": speed, "yaw_rate_radps": RATE_RADPS})
    motion, _, notes = reckon_odometry(rows)
    assert len(motion) == 400
    assert motion["step_m"].notna().all()
    assert not any("gap" in note for note in notes)


def test_a_bus_without_any_speed_turns_nevertheless():
    rows = pd.DataFrame({"time_s": TIME_S, "speed_mps": np.nan, "yaw_rate_radps": RATE_RADPS})
    motion, _, _ = reckon_odometry(rows)
    assert motion["step_m"].iloc[1:].isna().all()
    assert motion["turn_rad"].sum() == pytest.approx(np.trapezoid(RATE_RADPS, TIME_S), abs=1e-9)


def test_the_bias_of_a_gyroscope_does_not_turn_who_stands_without_rows():
    """With the ignition off for 20 minutes: 0.12 deg/s were -142°."""
    time_s = np.r_[np.arange(0.0, 60.0, 0.1), np.arange(1260.0, 1320.0, 0.1)]
    speed = np.where((time_s > 50.0) & (time_s < 1270.0), 0.0, 8.0)
    rows = {"time_s": time_s, "speed_mps": speed, "yaw_rate_radps": np.radians(0.12)}
    motion, _, notes = reckon_odometry(pd.DataFrame(rows))
    assert motion["turn_rad"].to_numpy()[600] == 0.0
    assert motion["step_m"].to_numpy()[600] == 0.0
    assert motion["turn_rad"].sum() == pytest.approx(0.0, abs=0.01)
    assert any("1 pause (longest 1200.1 s) between rests, taken as rests" in one for one in notes)


@pytest.mark.parametrize("corner", [False, True])
def test_a_bus_that_lacks_speeds_between_rests_has_moved_if_it_turned(corner):
    lost = (TIME_S > 20.0) & (TIME_S < 50.0)
    speed = np.where((TIME_S > 15.0) & (TIME_S < 52.0), 0.0, SPEED_MPS)
    rate = np.where((TIME_S > 30.0) & (TIME_S < 38.0), 0.2 * corner, 0.0)
    rows = {"time_s": TIME_S, "speed_mps": np.where(lost, np.nan, speed), "yaw_rate_radps": rate}
    motion, _, notes = reckon_odometry(pd.DataFrame(rows))
    assert motion["step_m"].isna().any() == corner
    assert motion["turn_rad"].sum() == pytest.approx(1.58 * corner, abs=0.02)
    assert any("turns alone are known" in one for one in notes) == corner


def test_turns_after_the_last_speed_are_known():
    speed = np.where(TIME_S < 30.0, SPEED_MPS, np.nan)
    rows = {"time_s": TIME_S, "speed_mps": speed, "yaw_rate_radps": RATE_RADPS}
    motion, _, _ = reckon_odometry(pd.DataFrame(rows))
    assert len(motion) == TIME_S.size
    assert motion["step_m"].isna().to_numpy()[300:].all()
    assert motion["turn_rad"].sum() == pytest.approx(np.trapezoid(RATE_RADPS, TIME_S), abs=1e-6)
