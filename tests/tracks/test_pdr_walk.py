"""Dead reckoning of simulated walkers: steps, headings, and what hinders them."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_phone import Leg, Phone, walk_sensors
from scipy.spatial.transform import Rotation

from mapfilter.tracks.log import make_log
from mapfilter.tracks.pdr.options import WalkOptions
from mapfilter.tracks.pdr.walk import reckon_walk
from mapfilter.tracks.store import read_log, write_log

LEGS = (Leg(20, 0.3, 3), Leg(15, 1.8), Leg(30, -2.0), Leg(12, 3.0, 4))
WITHOUT_NOISE = {"force_noise_mps2": 0.0, "rate_noise_radps": 0.0, "field_noise_ut": 0.0}
POSES = st.integers(0, 10_000).map(lambda seed: Rotation.random(random_state=seed).as_matrix())


def reckoned(sensors, **options):
    found, notes = reckon_walk(sensors, WalkOptions(**options))
    assert found is not None, notes
    return found


def stepped(found):
    return found.motion[found.motion["step_m"] > 0]


def apart_deg(a, b):
    return np.degrees(np.abs((np.asarray(a) - np.asarray(b) + np.pi) % (2 * np.pi) - np.pi))


@pytest.mark.parametrize("cadence_hz", [1.3, 1.8, 2.3])
def test_every_step_is_found_when_it_happens(cadence_hz):
    phone = Phone(cadence_hz=cadence_hz, seed=int(10 * cadence_hz))
    sensors, true_s, true_rad = walk_sensors(LEGS, phone)
    rows = stepped(reckoned(sensors))
    assert len(rows) == len(true_s)
    assert np.abs(rows["time_s"].to_numpy() - true_s).max() < 0.1
    assert apart_deg(rows["heading_rad"], true_rad).max() < 3


@pytest.mark.parametrize("cadence_hz", [1.3, 1.8, 2.3])
@pytest.mark.parametrize("rise_mps2", [1.5, 6.0])
def test_soft_and_hard_steps_are_counted_within_five_percent(cadence_hz, rise_mps2):
    phone = Phone(cadence_hz=cadence_hz, rise_mps2=rise_mps2, seed=int(10 * cadence_hz))
    sensors, true_s, _ = walk_sensors(LEGS, phone)
    rows = stepped(reckoned(sensors))
    # At the ends of a leg a weak step may be missed, and a hard one may ring on once.
    apart_s = np.abs(rows["time_s"].to_numpy()[:, None] - true_s)
    missed, added = (apart_s.min(axis=0) > 0.1).sum(), (apart_s.min(axis=1) > 0.1).sum()
    assert missed <= len(LEGS)
    assert added <= len(LEGS)
    assert missed + added <= 0.055 * len(true_s)


def test_options_of_a_walk_change_what_they_name():
    """The mean length of steps, and where north is; all else is that of the sensors."""
    sensors, _, _ = walk_sensors((Leg(12, 0.3, 2), Leg(10, 1.8)), Phone(seed=5))
    usual = reckoned(sensors)
    note = "no magnetic declination given: magnetic north taken for true north"
    assert note in usual.notes
    turned, _ = reckon_walk(sensors, WalkOptions(declination_deg=7.0, step_m=0.9), 0.05)
    assert note not in turned.notes
    lengths = stepped(turned)["step_m"].to_numpy()
    assert lengths.mean() == pytest.approx(0.9)
    np.testing.assert_allclose(
        lengths / lengths[0], stepped(usual)["step_m"] / stepped(usual)["step_m"].iloc[0]
    )
    later_rad = turned.motion["heading_rad"] - usual.motion["heading_rad"]
    expected_rad = 0.05 - np.radians(7.0)
    assert apart_deg(later_rad, expected_rad).max() == pytest.approx(0.0, abs=1e-6)
    pd.testing.assert_series_equal(turned.motion["turn_rad"], usual.motion["turn_rad"])
    pd.testing.assert_series_equal(turned.motion["time_s"], usual.motion["time_s"])
    assert turned.steps == usual.steps == len(lengths)
    # A declination that is not known is an error of 8 degrees of all headings.
    more_deg = np.sqrt(usual.imu.bias_sd_deg**2 - turned.imu.bias_sd_deg**2)
    assert more_deg == pytest.approx(8.0)


@settings(max_examples=12)
@given(POSES, st.sampled_from([0.3, 0.8, 1.2]))
def test_the_pose_of_the_phone_does_not_matter(pose, lead_rad):
    plain, _, true_rad = walk_sensors(LEGS, Phone(lead_rad=lead_rad, **WITHOUT_NOISE))
    turned, _, _ = walk_sensors(LEGS, Phone(lead_rad=lead_rad, pose=pose, **WITHOUT_NOISE))
    one, other = reckoned(plain, pose="any"), reckoned(turned, pose="any")
    assert one.steps == other.steps
    np.testing.assert_allclose(one.motion["step_m"], other.motion["step_m"], atol=1e-3)
    np.testing.assert_allclose(one.motion["turn_rad"], other.motion["turn_rad"], atol=5e-3)
    assert apart_deg(one.motion["heading_rad"], other.motion["heading_rad"]).max() < 0.5
    assert apart_deg(stepped(other)["heading_rad"], true_rad).max() < 5
    assert other.imu.bias_sd_deg > 20 > reckoned(plain).imu.bias_sd_deg


def test_headings_follow_the_axis_of_a_phone_held_across_the_walk():
    across = Rotation.from_euler("z", 90, degrees=True).as_matrix()
    sensors, _, true_rad = walk_sensors(LEGS, Phone(pose=across))
    by_steps, by_axis = reckoned(sensors), reckoned(sensors, pose="device")
    assert apart_deg(stepped(by_steps)["heading_rad"], true_rad).max() < 5
    assert apart_deg(stepped(by_axis)["heading_rad"], true_rad).min() > 85


@pytest.mark.parametrize("tilt_deg", [0, 30, 60, 90])
def test_a_phone_held_before_the_face_points_forward(tilt_deg):
    pose = Rotation.from_euler("x", tilt_deg, degrees=True).as_matrix()
    sensors, _, true_rad = walk_sensors(LEGS, Phone(pose=pose, push_mps2=0.0))
    found = reckoned(sensors, pose="device")
    assert apart_deg(stepped(found)["heading_rad"], true_rad).max() < 3


def test_declination_and_convergence_turn_headings():
    sensors, _, _ = walk_sensors(LEGS)
    plain = reckoned(sensors)
    turned, _ = reckon_walk(sensors, WalkOptions(declination_deg=10.0), np.radians(4.0))
    # The compass points 10 degrees east of north: headings, counter-clockwise, are 10 less.
    change = turned.motion["heading_rad"] - plain.motion["heading_rad"]
    np.testing.assert_allclose(np.degrees(np.sin(change)), np.degrees(np.sin(np.radians(-6.0))))


def test_nothing_is_walked_at_rest_or_by_a_single_jolt():
    sensors, _, _ = walk_sensors((Leg(0, 0.4, 40.0),))
    jolt = sensors["accelerometer"]["time_s"].between(1020.0, 1020.3)
    sensors["accelerometer"].loc[jolt, "z_mps2"] += 8.0
    found, notes = reckon_walk(sensors)
    assert found is None
    assert notes == ("no steps found",)


def test_time_goes_on_while_standing():
    sensors, _, _ = walk_sensors((Leg(10, 0.0), Leg(10, 0.0, 20.0)))
    found = reckoned(sensors)
    assert np.diff(found.motion["time_s"]).max() < 2.0
    still = found.motion[found.motion["time_s"].between(1010.0, 1026.0)]
    assert len(still) > 10
    assert still["step_m"].sum() == 0


def test_strong_iron_is_flagged_and_does_not_turn_the_walk():
    legs = (Leg(60, 0.5), Leg(60, 0.5, 0.0), Leg(60, 0.5, 0.0))
    sensors, true_s, true_rad = walk_sensors(legs)
    field = sensors["magnetometer"]
    near = field["time_s"].between(true_s[60], true_s[90])
    field.loc[near, ["x_ut", "y_ut"]] += [35.0, -20.0]
    found = reckoned(sensors)
    rows = stepped(found)
    assert apart_deg(rows["heading_rad"], true_rad).max() < 4
    flags = found.reckoning["disturbed"].to_numpy()
    inside = found.reckoning["time_s"].between(true_s[62], true_s[88]).to_numpy()
    outside = ~found.reckoning["time_s"].between(true_s[57], true_s[93]).to_numpy()
    assert flags[inside].all()
    assert flags[outside].mean() < 0.05
    assert any("compass disturbed" in note for note in found.notes)


def test_a_field_of_usual_size_that_contradicts_the_gyroscope_is_flagged():
    sensors, true_s, true_rad = walk_sensors((Leg(150, 0.5),))
    field = sensors["magnetometer"]
    near = field["time_s"].between(true_s[60], true_s[90])
    # The horizontal field is turned by 80 degrees: size and dip stay as they are.
    turned = (
        field[["x_ut", "y_ut"]].to_numpy()
        @ Rotation.from_euler("z", -80, degrees=True).as_matrix()[:2, :2]
    )
    field.loc[near, ["x_ut", "y_ut"]] = turned[near]
    found = reckoned(sensors)
    inside = found.reckoning["time_s"].between(true_s[62], true_s[88]).to_numpy()
    assert found.reckoning["disturbed"].to_numpy()[inside].all()
    assert apart_deg(stepped(found)["heading_rad"], true_rad).max() < 5


def test_the_gyroscopes_bias_is_learnt_while_it_lies_still():
    bias = np.radians([0.3, -0.4, 0.5])
    legs = (Leg(0, 0.0, 20.0), Leg(100, 0.0), Leg(0, 0.0, 5.0))
    turns = {}
    for learnt, name in ((True, "learnt"), (False, "unknown")):
        # A phone that does not sway has no axis but the vertical one for its turns.
        sensors, _, _ = walk_sensors(
            legs if learnt else (Leg(150, 0.0, 0.0),),
            Phone(bias_radps=tuple(bias), sway_rad=0.04 if learnt else 0.0),
        )
        del sensors["magnetometer"]
        found = reckoned(sensors)
        lasted_s = np.ptp(found.motion["time_s"])
        turns[name] = np.degrees(found.motion["turn_rad"].sum()) / lasted_s
        assert found.motion["heading_rad"].isna().all()
        assert found.imu.turns == "gyro"
        turns[name + " sd"] = found.imu.gyro_bias_deg_per_s
    assert abs(turns["learnt"]) < 3 * turns["learnt sd"] < 0.15
    assert turns["unknown"] == pytest.approx(0.5, abs=0.05)


def test_turns_without_a_compass_are_those_of_the_walk():
    sensors, _, true_rad = walk_sensors(LEGS)
    del sensors["magnetometer"]
    turn = reckoned(sensors).motion["turn_rad"].sum()
    true = true_rad[-1] - true_rad[0]
    assert apart_deg(turn, true) < 3


def test_headings_by_the_compass_alone():
    sensors, true_s, true_rad = walk_sensors(LEGS)
    del sensors["gyroscope"]
    found = reckoned(sensors)
    rows = stepped(found)
    assert len(rows) == len(true_s)
    assert np.median(apart_deg(rows["heading_rad"], true_rad)) < 5
    assert any("no gyroscope" in note for note in found.notes)


def test_gravity_and_linear_acceleration_are_as_good_as_an_accelerometer():
    sensors, true_s, _ = walk_sensors(LEGS)
    force = sensors.pop("accelerometer")
    axes = ["x_mps2", "y_mps2", "z_mps2"]
    gravity = force.assign(**dict.fromkeys(axes, 0.0)).assign(z_mps2=9.80665)
    sensors["gravity"] = gravity.iloc[::2]
    sensors["linear_acceleration"] = force.assign(z_mps2=force["z_mps2"] - 9.80665)
    assert reckoned(sensors).steps == len(true_s)


def test_motion_is_unknown_in_a_gap_of_the_sensors():
    sensors, true_s, true_rad = walk_sensors((Leg(60, 0.2), Leg(60, 1.2)))
    cut = {
        name: rows[~rows["time_s"].between(true_s[40], true_s[45])]
        for name, rows in sensors.items()
    }
    found = reckoned(cut)
    unknown = found.motion[found.motion["step_m"].isna()]
    assert len(unknown) == 1
    assert true_s[45] <= unknown["time_s"].iloc[0] <= true_s[47]
    assert found.steps == pytest.approx(114, abs=3)
    last = found.motion.iloc[-30:-1]
    assert apart_deg(last["heading_rad"], true_rad[-1]).max() < 4


def test_jolts_of_a_car_are_no_steps():
    sensors, true_s, _ = walk_sensors((Leg(30, 0.0), Leg(60, 0.0), Leg(20, 0.0)))
    time = np.arange(1000.0, sensors["gyroscope"]["time_s"].iloc[-1])
    drives = (time > true_s[30] - 1) & (time < true_s[89] + 1)
    speed = np.where(drives, 12.0, 1.3)
    sensors["velocity"] = pd.DataFrame({"time_s": time, "speed_mps": speed, "heading_rad": 0.0})
    assert reckoned(sensors).steps == 50


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda rows: rows.iloc[::10], "10 Hz; steps need 15 Hz"),
        (lambda rows: rows * [1, *3 * [1 / 9.80665]], "g given for m/s²"),
        (lambda rows: rows - [0, 0, 0, 9.80665], "gravity left out"),
        (lambda rows: rows.iloc[:2], "0 Hz"),
    ],
)
def test_why_there_are_no_steps(change, said):
    sensors, _, _ = walk_sensors(LEGS)
    sensors["accelerometer"] = change(sensors["accelerometer"])
    found, notes = reckon_walk(sensors)
    assert found is None
    assert any(said in note for note in notes)


def test_sensors_that_are_missing_damaged_or_still():
    assert reckon_walk({}) == (None, ())
    sensors, _, _ = walk_sensors(LEGS)
    alone = {"accelerometer": sensors["accelerometer"]}
    assert reckon_walk(alone)[0] is None
    stuck = {
        name: rows.assign(**dict.fromkeys(rows.columns[1:], 0.0)) for name, rows in sensors.items()
    }
    assert reckon_walk(stuck)[0] is None
    empty = {name: rows.iloc[:0] for name, rows in sensors.items()}
    assert reckon_walk(empty)[0] is None
    missing = dict(sensors)
    missing["magnetometer"] = sensors["magnetometer"].assign(x_ut=np.nan)
    missing["velocity"] = pd.DataFrame(
        {"time_s": [], "speed_mps": [], "heading_rad": []}, dtype=float
    )
    missing["barometer"] = pd.DataFrame({"time_s": [], "pressure_hpa": []}, dtype=float)
    assert reckoned(missing).imu.turns == "gyro"


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=25)
def test_wild_sensors_do_not_stop_it(seed):
    rng = np.random.default_rng(seed)
    sensors, _, _ = walk_sensors((Leg(12, 0.3),))
    for name, rows in sensors.items():
        values = rows.to_numpy(copy=True)
        hit = rng.random(values.shape) < rng.choice([0.0, 0.01, 0.3])
        values[hit] = rng.choice([np.nan, np.inf, 0.0, 1e6, -300.0], hit.sum())
        keep = rng.random(len(values)) < rng.choice([0.2, 0.9, 1.0])
        wild = pd.DataFrame(values[keep], columns=rows.columns)
        sensors[name] = wild[np.isfinite(wild["time_s"]) & wild["time_s"].between(0, 1e5)]
    found, _ = reckon_walk(sensors)
    if found is not None:
        rows = found.motion
        assert (np.diff(rows["time_s"]) > 0).all()
        assert np.isfinite(rows["step_m"].iloc[1:].dropna()).all()
        assert (rows["step_m"].dropna() >= 0).all()
        assert rows["heading_rad"].dropna().between(-np.pi, np.pi).all()


def test_errors_stated_are_those_made():
    """The lasting error of headings, over many walks past iron, is as large as stated."""
    errors, stated = [], []
    rng = np.random.default_rng(5)
    for seed in range(12):
        leg = Leg(60, rng.uniform(-3, 3))
        sensors, _, true_rad = walk_sensors((leg,), Phone(seed=seed))
        field = sensors["magnetometer"]
        # Iron along the way: it turns the compass by 15 degrees or so, for about 5 m at a time.
        iron = np.repeat(rng.normal(0, 9, (20, 2)), 200, axis=0)[: len(field)]
        field[["x_ut", "y_ut"]] += np.pad(iron, ((0, len(field) - len(iron)), (0, 0)), "edge")
        found = reckoned(sensors)
        rows = stepped(found)
        sine = np.sin(rows["heading_rad"].to_numpy() - true_rad[: len(rows)])
        errors.append(np.degrees(np.mean(sine)))
        stated.append(found.imu.bias_sd_deg)
    assert np.std(errors) < np.mean(stated)
    assert np.mean(stated) < 20


def test_the_log_of_a_walk_is_read_as_it_was_written(tmp_path):
    sensors, _, _ = walk_sensors(LEGS, start_s=0.0)
    found = reckoned(sensors)
    log = make_log("EPSG:32635", motion=found.motion, imu=found.imu)
    write_log(log, tmp_path / "log", sensors={"reckoning": found.reckoning})
    back = read_log(tmp_path / "log")
    assert back.imu == found.imu
    pd.testing.assert_frame_equal(back.motion, log.motion)


def moved(sensors, moves_s, turned):
    """Return the sensors of a phone that is turned to another pose in 1 s."""
    time_s = sensors["gyroscope"]["time_s"].to_numpy()
    pose = Rotation.from_rotvec(np.outer(np.clip(time_s - moves_s, 0, 1), turned))
    turning = (pose[:-1].inv() * pose[1:]).as_rotvec() * 100.0
    found = {}
    for name, rows in sensors.items():
        values = pose.inv().apply(rows.iloc[:, 1:].to_numpy(copy=True))
        if name == "gyroscope":
            values += np.concatenate([turning, [[0, 0, 0]]])
        found[name] = pd.DataFrame(np.column_stack([time_s, values]), columns=rows.columns)
    return found


def test_a_phone_raised_after_a_turn_still_points_forward():
    sensors, true_s, true_rad = walk_sensors((Leg(30, 0.5), Leg(60, 2.5)), Phone(push_mps2=0.0))
    raised = moved(sensors, true_s[50], np.radians([85.0, 0.0, 0.0]))
    rows = stepped(reckoned(raised, pose="device"))
    nearest = np.abs(rows["time_s"].to_numpy()[:, None] - true_s).argmin(axis=1)
    away = np.abs(rows["time_s"].to_numpy() - true_s[50] - 0.5) > 2
    assert apart_deg(rows["heading_rad"], true_rad[nearest])[away].max() < 6


def test_a_phone_put_into_a_pocket_while_walking():
    """From the hand to a pocket in 1 s, turned there by 110 degrees about an oblique axis."""
    sensors, true_s, true_rad = walk_sensors((Leg(60, 0.5), Leg(60, -1.2, 0.0)))
    moves_s = true_s[30]
    axis = np.array([0.2, 0.9, 0.4]) / np.linalg.norm([0.2, 0.9, 0.4])
    found = reckoned(moved(sensors, moves_s, np.radians(110) * axis))
    rows = stepped(found)
    assert len(rows) == pytest.approx(120, abs=3)
    settled = np.abs(rows["time_s"].to_numpy() - moves_s - 0.5) > 2
    nearest = np.abs(rows["time_s"].to_numpy()[:, None] - true_s).argmin(axis=1)
    apart = apart_deg(rows["heading_rad"], true_rad[nearest])
    turned = np.abs(rows["time_s"].to_numpy() - true_s[60]) < 2
    assert apart[settled & ~turned].max() < 15
    before = found.reckoning["time_s"] < moves_s - 1
    sds = found.reckoning["heading_sd_rad"]
    assert sds[~before].mean() > sds[before].mean()


def test_stairs_shorten_steps_and_lifts_have_none():
    legs = (Leg(40, 0.0), Leg(40, 0.0, 0.0), Leg(40, 0.0), Leg(0, 0.0, 20.0), Leg(40, 0.0, 0.0))
    sensors, true_s, _ = walk_sensors(legs)
    time_s = sensors["accelerometer"]["time_s"].to_numpy()
    ride_s = (true_s[119] + 3.0, true_s[119] + 19.0)
    heights = [(0, 0), (true_s[40], 0), (true_s[79], 7), (ride_s[0], 7), (ride_s[1], 27), (1e4, 27)]
    height = np.interp(time_s, *np.array(heights).T)
    pressure = 1013.25 * (1 - height / 44330.77) ** (1 / 0.190263)
    barometer = pd.DataFrame({"time_s": time_s, "pressure_hpa": pressure}).iloc[::10]
    force = sensors["accelerometer"]
    # The lift jolts at its start and its end, three times each.
    for at_s in (ride_s[0] + 1, ride_s[1] - 3):
        for k in range(3):
            hit = force["time_s"].between(at_s + 0.6 * k, at_s + 0.6 * k + 0.25)
            force.loc[hit, "z_mps2"] += 5.0
    jolted = reckoned(sensors)
    found = reckoned(sensors | {"barometer": barometer})
    climb = found.reckoning["climb"].to_numpy()
    rows = found.motion
    assert [one.kind for one in found.climbs] == ["stairs", "lift"]
    assert rows["step_m"][climb == 1].max() <= 0.3
    assert (climb == 1).sum() > 30
    assert rows["step_m"][climb == 2].sum() == 0
    inside = jolted.motion["time_s"].between(*ride_s)
    assert jolted.motion["step_m"][inside].sum() > 0.5
    assert found.reckoning["height_m"].iloc[-1] == pytest.approx(27, abs=0.3)
    assert any(note.startswith("stairs: +") for note in found.notes)
