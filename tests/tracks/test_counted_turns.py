"""Motion of counted steps and turns: a column of turns, a yaw rate, or a gyroscope with gravity."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapfilter.tracks.joining.combine import combine
from mapfilter.tracks.open_options import CombineOptions
from mapfilter.tracks.pdr.counted import reckon_counted
from mapfilter.tracks.pdr.mounted import turning_of_mounted
from mapfilter.tracks.pdr.options import WalkOptions
from mapfilter.tracks.pdr.turns import Turning, turning_of
from mapfilter.tracks.readers.formats import read_recording
from mapfilter.tracks.sensors import read_sensors
from mapfilter.tracks.store import read_log, write_log

SECONDS = np.arange(30.0)
STEPS = pd.DataFrame({"time_s": SECONDS, "count": 2 * SECONDS})
GRAVITY = 9.8


def turns(turn=np.nan, rate=np.nan, time_s=SECONDS):
    return pd.DataFrame({"time_s": time_s, "turn_rad": turn, "yaw_rate_radps": rate})


def corner(at=5, by=np.pi / 2):
    return np.where(np.arange(30) == at, by, 0.0)


def logged(tmp_path, head, rows, *, zone="Z", **options):
    """Return the log that a phone's table becomes, its positions being the truth."""
    path = tmp_path / "phone.csv"
    lines = [f"2026-05-01T10:00:{k:02d}{zone},{row},48.0,11.0" for k, row in enumerate(rows)]
    path.write_text("\n".join([f"time,{head},latitude,longitude", *lines]) + "\n")
    walk = WalkOptions(**options)
    given = CombineOptions(truth=(path,), measured=(path,), walk=walk)
    return combine([read_recording(path)], given)


def test_turns_beside_counted_steps_are_motion():
    motion, imu, notes = reckon_counted({"steps": STEPS, "turns": turns(corner())})
    assert motion["step_m"].sum() == pytest.approx(29 * 2 * 0.7)
    assert motion["heading_rad"].isna().all()
    # Before the first row there is none.
    assert np.isnan(motion["turn_rad"][0])
    np.testing.assert_allclose(motion["turn_rad"][1:], corner()[1:])
    assert (imu.turns, imu.bias_sd_deg) == ("gyro", 0.0)
    assert imu.gyro_noise_deg_per_sqrt_s == pytest.approx(0.15)
    assert "with turns" in notes[0]
    assert any("heading at the start is unknown" in note for note in notes)
    assert not any("declination" in note for note in notes)


def test_a_gyroscope_of_zeros_alone_is_none():
    """As logs with fixed columns have of a phone without one: it was a straight way."""
    still = {f"{axis}_radps": 0.0 for axis in "xyz"}
    force = {"x_mps2": 0.0, "y_mps2": 0.0, "z_mps2": GRAVITY}
    sensors = {name: pd.DataFrame({"time_s": SECONDS, **columns})
               for name, columns in (("gyroscope", still), ("gravity", force))}  # fmt: skip
    assert turning_of(sensors) == (None, "")
    assert turning_of_mounted(sensors) == (None, ())
    sensors["gyroscope"].loc[7, "x_radps"] = 1e-3
    assert turning_of(sensors)[0] is not None


def test_turns_of_one_time_add_up():
    """Of two in each second the second one was lost."""
    turn = 0.1 + 0.001 * np.arange(60.0)
    rows = turns(turn, time_s=np.repeat(SECONDS, 2)).sample(frac=1.0, random_state=1)
    motion, _, _ = reckon_counted({"steps": STEPS, "turns": rows})
    np.testing.assert_allclose(motion["turn_rad"][1:], turn.reshape(30, 2).sum(axis=1)[1:])


@pytest.mark.parametrize("late", ["steps", "rate"])
def test_yaw_rates_in_rows_of_their_own_at_the_times_of_steps_are_joined(late):
    """Those that came second were lost, and with them the motion."""
    empty, rates = turns(), turns(rate=0.1)
    both = pd.concat([empty, rates] if late == "rate" else [rates, empty])
    motion, _, _ = reckon_counted(
        {"steps": STEPS, "turns": both.sort_values("time_s", kind="stable")}
    )
    np.testing.assert_allclose(motion["turn_rad"][1:], 0.1)


@pytest.mark.parametrize(
    ("head", "value"),
    [
        ("steps,turn_rad", "{turn}"),
        ("steps,turn_deg", "{turn_deg}"),
        # A rate of a second before the row and of one after it.
        ("steps,yaw_rate_radps", "{rate}"),
        ("steps,yaw_rate_degps", "{rate_deg}"),
        ("steps,speed_mps,yaw_rate", "1.4,{rate}"),
    ],
)
def test_a_table_with_steps_and_turns_has_motion(head, value, tmp_path):
    rows = []
    for k in range(30):
        turn, rate = (1.5 if k == 5 else 0.0), (0.75 if k in (4, 5) else 0.0)
        degrees = {"turn_deg": np.degrees(turn), "rate_deg": np.degrees(rate)}
        rows.append(f"{2 * k},{value.format(turn=turn, rate=rate, **degrees)}")
    combined = logged(tmp_path, head, rows, step_m=0.8)
    motion = combined.log.motion
    assert motion["step_m"].sum() == pytest.approx(29 * 2 * 0.8)
    assert motion["heading_rad"].isna().all()
    assert motion["turn_rad"].sum() == pytest.approx(1.5)
    assert motion["turn_rad"][4:7].abs().sum() == pytest.approx(1.5)
    assert combined.log.imu.turns == "gyro"
    assert not any("not used" in note for note in combined.notes)
    write_log(combined.log, tmp_path / "log", sensors=combined.sensors)
    pd.testing.assert_frame_equal(
        read_sensors(tmp_path / "log")["turns"], combined.sensors["turns"]
    )
    assert read_log(tmp_path / "log").imu == combined.log.imu


@pytest.mark.parametrize("up", [(0, 0, 1), (0, 0, -1), (1, 0, 0), (0, -0.6, 0.8)])
@pytest.mark.parametrize("force", ["accelerometer", "gravity"])
def test_a_gyroscope_turns_about_the_vertical_however_the_phone_lies(up, force):
    up = np.array(up, dtype=float)
    # It also swings about an axis across, which is no turn.
    across = np.cross(up, [0.3, 0.5, 0.2])
    rate = 0.1 * up + np.sin(SECONDS)[:, None] * across
    gyroscope = pd.DataFrame({"time_s": SECONDS, **dict(zip(AXES_RADPS, rate.T, strict=True))})
    axes = dict(zip(AXES_MPS2, GRAVITY * up, strict=True))
    sensors = {"steps": STEPS, "gyroscope": gyroscope}
    sensors[force] = pd.DataFrame({"time_s": SECONDS, **axes})
    motion, _, notes = reckon_counted(sensors)
    np.testing.assert_allclose(motion["turn_rad"][1:], 0.1, atol=1e-9)
    assert "with a gyroscope" in notes[0]


AXES_RADPS = ("x_radps", "y_radps", "z_radps")
AXES_MPS2 = ("x_mps2", "y_mps2", "z_mps2")


@pytest.mark.parametrize("has_force", [False, True])
def test_without_gravity_a_gyroscope_shows_no_turns(has_force):
    rng = np.random.default_rng(5)
    gyroscope = pd.DataFrame({"time_s": SECONDS, **dict.fromkeys(AXES_RADPS, 0.1)})
    sensors = {"steps": STEPS, "gyroscope": gyroscope}
    if has_force:
        # Linear acceleration, ten rows a second: it vanishes in the mean.
        time_s = np.arange(0, 29, 0.1)
        moved = rng.normal(0, 3.0, (3, len(time_s)))
        axes = dict(zip(AXES_MPS2, moved, strict=True))
        sensors["accelerometer"] = pd.DataFrame({"time_s": time_s, **axes})
    motion, imu, notes = reckon_counted(sensors)
    assert motion is None
    assert imu is None
    assert len(notes) == 1
    assert "which way is up" in notes[0]
    assert "--column yaw_rate_radps=" in notes[0]


def test_a_compass_is_preferred_to_turns():
    compass = pd.DataFrame({"time_s": SECONDS, "magnetic_deg": 90.0})
    sensors = {"steps": STEPS, "compass": compass, "turns": turns(corner())}
    motion, imu, notes = reckon_counted(sensors)
    assert motion["turn_rad"].isna().all()
    assert motion["heading_rad"].notna().all()
    assert imu.turns == "headings"
    assert "turns are not used beside the compass" in notes


def test_rates_far_apart_make_no_turns():
    few_s = np.arange(0.0, 30.0, 3.0)
    motion, _, notes = reckon_counted({"steps": STEPS, "turns": turns(rate=0.1, time_s=few_s)})
    assert motion is None
    assert "rates lie more than 2 s apart" in notes[0]


def test_a_turn_that_is_missing_is_unknown_and_told():
    turn = corner()
    turn[9] = np.nan
    motion, _, notes = reckon_counted({"steps": STEPS, "turns": turns(turn)})
    assert np.flatnonzero(motion["turn_rad"].isna()).tolist() == [0, 9]
    assert any("no turn known in 1 row with steps" in note for note in notes)


def test_turns_in_rows_of_their_own_between_steps_are_known(tmp_path):
    """They were taken for missing ones, and there was no motion."""
    path = tmp_path / "phone.csv"
    rows = [f"{k},{2 * k},\n{k + 0.3:.1f},,{6 if k == 9 else 0}" for k in range(30)]
    path.write_text("\n".join(["time,steps,turn_deg", *rows]) + "\n")
    motion = combine([read_recording(path)], CombineOptions(walk=WalkOptions())).log.motion
    assert motion["step_m"].sum() == pytest.approx(29 * 2 * 0.7)
    assert np.degrees(motion["turn_rad"].sum()) == pytest.approx(6.0)
    assert motion["turn_rad"].isna().sum() == 2


def test_rows_of_reports_between_rows_of_motion_have_no_turn(tmp_path):
    # Every third row is a report alone.
    rows = [f"{2 * k},{0.1},," if k % 3 else ",,-80,7" for k in range(30)]
    motion = logged(tmp_path, "steps,turn_rad,level_dbm,ci", rows).log.motion
    assert len(motion) == 20
    np.testing.assert_allclose(motion["turn_rad"][1:], 0.1)


def test_a_swaying_yaw_rate_of_seldom_rows_is_uncertain():
    rng = np.random.default_rng(7)
    rate = rng.normal(0, 0.2, 3000)
    time_s = np.arange(3000.0)
    steps = pd.DataFrame({"time_s": time_s, "count": 2 * time_s})
    _, imu, _ = reckon_counted({"steps": steps, "turns": turns(rate=rate, time_s=time_s)})
    # Of white rates the sum grows by their size and the root of the time.
    assert imu.gyro_noise_deg_per_sqrt_s == pytest.approx(np.degrees(0.2), rel=0.1)


@given(
    st.lists(st.floats(-3, 3), min_size=3, max_size=30),
    st.lists(st.integers(0, 29), min_size=2, max_size=9, unique=True),
)
def test_turns_between_some_rows_add_up_to_all(turn, chosen):
    turning = Turning(np.arange(len(turn), dtype=float), np.array(turn), 0.0, "")
    at = np.unique(np.clip([0, *chosen, len(turn) - 1], 0, len(turn) - 1)).astype(float)
    found = turning.between(at)
    assert np.isnan(found[0])
    assert found[1:].sum() == pytest.approx(sum(turn[1:]), abs=1e-9)


def test_nothing_turns_without_sensors():
    assert turning_of({"steps": STEPS}) == (None, "")


def constant_turn():
    """A phone upright that turns by 0.1 rad/s for 10 s."""
    time_s = np.arange(0.0, 10.0, 0.5)
    zero = np.zeros(time_s.size)
    force = pd.DataFrame({"time_s": time_s, "x_mps2": zero, "y_mps2": zero, "z_mps2": zero + 9.8})
    rate = pd.DataFrame({"time_s": time_s, "x_radps": 0.0, "y_radps": 0.0, "z_radps": 0.1})
    return force, rate


def test_a_hole_in_the_force_leaves_the_vertical():
    force, rate = constant_turn()
    force.loc[3, "z_mps2"] = np.nan
    turning, reason = turning_of({"accelerometer": force, "gyroscope": rate})
    assert reason == ""
    assert turning.between(np.array([0.0, 2.0, 8.0]))[1:] == pytest.approx([0.2, 0.6])
    force["z_mps2"] = np.nan
    assert turning_of({"accelerometer": force, "gyroscope": rate})[0] is None


def test_a_single_turn_hides_no_yaw_rate():
    _, rate = constant_turn()
    turns = pd.DataFrame({"time_s": rate["time_s"], "turn_rad": np.nan, "yaw_rate_radps": 0.1})
    turns.loc[1, "turn_rad"] = 0.0
    turning, _ = turning_of({"turns": turns})
    assert turning.source == "a yaw rate"
    assert turning.between(np.array([0.0, 2.0, 8.0]))[1:] == pytest.approx([0.2, 0.6])
    turns["turn_rad"] = 0.3
    assert turning_of({"turns": turns})[0].source == "turns"
