"""A phone's raw gyroscope beside the speeds of a vehicle: turns about the vertical."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mapfilter.errors import InputError

START_S = 1_778_666_400.0
TIME_S = np.arange(0.0, 400.0, 0.02)
AXES = "xyz"


def made_drive():
    """Speeds with rests, and quarter turns of 6 s at 6 m/s: yaw rates and headings."""
    phase = TIME_S % 40
    speed = np.interp(phase, [0, 6, 12, 20, 30, 36, 40], [0, 6, 6, 13, 13, 0, 0])
    side = np.where(np.floor(TIME_S / 40) % 3 < 2, 1.0, -1.0)
    rate = np.where((phase >= 6) & (phase < 12), side * np.pi / 12, 0.0)
    rate = np.convolve(rate, np.ones(25) / 25, "same")
    return speed, rate, np.append(0.0, np.cumsum(0.01 * (rate[1:] + rate[:-1])))


def phone(pose, *, speed, rate, seed=0):
    """Return what gyroscope and accelerometer of a phone read that lies as ``pose`` says."""
    rng = np.random.default_rng(seed)
    moving = (speed > 0)[:, None]
    force = np.stack([np.gradient(speed, TIME_S), speed * rate, np.full(rate.size, 9.81)], axis=1)
    force += moving * rng.normal(0, 0.3, force.shape)
    turning = np.stack([np.zeros(rate.size), np.zeros(rate.size), rate], axis=1)
    turning[:, :2] += moving * rng.normal(0, 0.02, (rate.size, 2))
    back = Rotation.from_euler("xyz", pose, degrees=True).inv()
    noise = rng.normal([0.004, -0.006, 0.005], 0.003, turning.shape)
    return back.apply(turning) + noise, back.apply(force)


def table(gyroscope, force, *, gyroscope_names="gyro_{}"):
    columns = {"time": START_S + TIME_S}
    columns |= {gyroscope_names.format(a): gyroscope[:, i] for i, a in enumerate(AXES)}
    return columns | {f"acc_{a}": force[:, i] for i, a in enumerate(AXES)}


def obd(speed, every):
    kmh = np.round(3.6 * speed[::every])
    return {"time": START_S + TIME_S[::every], "Speed (OBD) [km/h]": kmh}


def heading_error_deg(log, heading):
    turned = np.cumsum(log.motion["turn_rad"].fillna(0.0).to_numpy())
    true = np.interp(log.motion["time_s"], TIME_S, heading)
    return np.degrees(turned - true)


@pytest.mark.parametrize("pose", [(0, 0, 0), (20, -55, 130), (180, 0, 40), (90, 10, 0)])
@pytest.mark.parametrize("every", [10, 50])
def test_turns_are_those_about_the_vertical(pose, every, read):
    """They were not used: directions were unknown."""
    speed, rate, heading = made_drive()
    log = read(obd=obd(speed, every), phone=table(*phone(pose, speed=speed, rate=rate)))
    assert log.vehicle
    assert log.imu.turns == "gyro"
    # Biases of 0.004 to 0.006 rad/s about each axis are 100 degrees and more after 400 s.
    assert np.abs(heading_error_deg(log, heading)).max() < 6
    assert log.motion["step_m"].isna().sum() == 0
    source = "odometry: turns are those of a gyroscope, about the vertical of its accelerometer"
    assert source in log.notes
    assert any(note.startswith("yaw rate: bias ") for note in log.notes)


def test_speeds_and_sensors_may_be_columns_of_one_file(read):
    speed, rate, heading = made_drive()
    columns = table(*phone((0, -70, 0), speed=speed, rate=rate))
    columns["wheel_speed_mps"] = np.where(np.arange(TIME_S.size) % 10 == 0, speed, np.nan)
    log = read(drive=columns)
    assert len(log.motion) == TIME_S.size // 10
    assert np.abs(heading_error_deg(log, heading)).max() < 6


def test_while_the_phone_is_moved_turns_are_unknown(read):
    """It is lifted out of its mount at 214 s, while driving, and laid flat at 218 s."""
    speed, rate, heading = made_drive()
    before, after = (phone(pose, speed=speed, rate=rate) for pose in ((0, -70, 0), (5, 0, 90)))
    is_late = (TIME_S > 216)[:, None]
    gyroscope, force = (np.where(is_late, b, a) for a, b in zip(before, after, strict=True))
    handled = (TIME_S > 214) & (TIME_S < 218)
    gyroscope[handled] += [0.0, 1.2, 0.7]
    log = read(obd=obd(speed, 10), phone=table(gyroscope, force))
    time_s = log.motion["time_s"].to_numpy()
    unknown = log.motion["turn_rad"].isna().to_numpy()
    assert unknown[(time_s > 214.3) & (time_s < 217.9)].all()
    assert not unknown[(time_s < 210) | (time_s > 222)].any()
    assert log.motion["step_m"][unknown].isna().all()
    error = heading_error_deg(log, heading)
    assert np.abs(error[time_s < 210]).max() < 6
    # Turns go on from what they were; what the car turned by meanwhile is lost.
    late = error[time_s > 222]
    assert np.ptp(late) < 6
    assert any("moved in the vehicle, turns are unknown" in note for note in log.notes)


def test_degrees_per_second_are_refused_and_converted_where_the_header_states_them(read):
    speed, rate, heading = made_drive()
    gyroscope, force = phone((20, -55, 130), speed=speed, rate=rate)
    with pytest.raises(InputError, match=r"gyroscope.*tyres.*degrees for radians per second"):
        read(obd=obd(speed, 10), phone=table(np.degrees(gyroscope), force))
    stated = table(np.degrees(gyroscope), force, gyroscope_names="gyro_{} (deg/s)")
    log = read(obd=obd(speed, 10), phone=stated)
    assert np.abs(heading_error_deg(log, heading)).max() < 6


@pytest.mark.parametrize("without_gravity", [False, True])
def test_without_a_vertical_it_is_said_what_is_missing(without_gravity, read):
    speed, rate, _ = made_drive()
    gyroscope, force = phone((0, 0, 0), speed=speed, rate=rate)
    columns = table(gyroscope, force - [0, 0, 9.81])
    if not without_gravity:
        columns = {name: values for name, values in columns.items() if "acc" not in name}
    log = read(obd=obd(speed, 10), phone=columns)
    assert log.motion["turn_rad"].iloc[1:].isna().all()
    assert any("does not show which way is up" in note for note in log.notes)


def test_yaw_rates_of_the_vehicle_go_first(read):
    speed, rate, heading = made_drive()
    own = obd(speed, 10) | {"yaw_rate_radps": rate[::10]}
    log = read(obd=own, phone=table(*phone((0, 0, 0), speed=speed, rate=-rate)))
    assert np.abs(heading_error_deg(log, heading)).max() < 6
    assert not any("turns are those of a gyroscope" in note for note in log.notes)


@pytest.mark.parametrize("shift_s", [-4.0, 2.0, 7.0])
@pytest.mark.parametrize("pose", [(0, 0, 0), (20, -55, 130)])
def test_a_phone_whose_clock_is_seconds_off_turns_when_its_vehicle_does(pose, shift_s, read):
    """Turns came seconds after their corners: a drive was 1.8 km off within 0.9 km."""
    speed, rate, heading = made_drive()
    columns = table(*phone(pose, speed=speed, rate=rate))
    columns["time"] = columns["time"] + shift_s
    log = read(obd=obd(speed, 50), phone=columns)
    (note,) = [note for note in log.notes if "accelerations agree" in note]
    assert note.startswith("phone.csv: accelerations agree with the speeds of obd.csv best ")
    assert float(note.partition(" best ")[2].split()[0]) == pytest.approx(-shift_s, abs=0.5)
    turned = np.cumsum(log.motion["turn_rad"].fillna(0.0).to_numpy())
    at_s = log.motion["time_s"].to_numpy() + log.start_utc_s - START_S
    error = np.degrees(turned - np.interp(at_s, TIME_S, heading))
    # Turns of an end that only one of both recorded are not known.
    assert np.ptp(error[30:370]) < 12


@pytest.mark.parametrize("every", [10, 50])
def test_a_common_clock_needs_no_shift(every, read):
    speed, rate, _ = made_drive()
    log = read(obd=obd(speed, every), phone=table(*phone((20, -55, 130), speed=speed, rate=rate)))
    assert not any("accelerations agree" in note for note in log.notes)
