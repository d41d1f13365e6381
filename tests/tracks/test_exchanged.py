"""Exchanged columns of speeds, turns and courses, and speeds whose unit no header states."""

import numpy as np
import pandas as pd
import pytest

import mapfilter as mf
from mapfilter.errors import InputError
from mapfilter.tracks.readers.formats import read_recording

COUNT = 600
TIME_S = 1.78e9 + np.arange(float(COUNT))
METRES_PER_DEGREE = 111_195.0
KNOT_MPS, MPH_MPS = 1852 / 3600, 0.44704


@pytest.fixture
def drive():
    """A drive with corners to both sides: speed, rate of turning, azimuth and positions."""
    rng = np.random.default_rng(2)
    side = rng.choice([-1.0, 1.0], COUNT // 30)[np.arange(COUNT) // 30]
    rate = np.where(np.arange(COUNT) % 30 >= 24, np.pi / 12, 0.0) * side
    speed = np.where(rate != 0, 6.0, 11.0)
    heading = np.cumsum(rate) - rate / 2
    east_m, north_m = np.cumsum(speed * np.cos(heading)), np.cumsum(speed * np.sin(heading))
    return pd.DataFrame(
        {
            "time": TIME_S,
            "latitude": 60 + north_m / METRES_PER_DEGREE,
            "longitude": 25 + 2 * east_m / METRES_PER_DEGREE,
            "speed": speed + rng.normal(0, 0.1, COUNT),
            "rate": rate + rng.normal(0, 0.003, COUNT),
            "azimuth": np.degrees(np.pi / 2 - heading) % 360,
        }
    )


@pytest.fixture
def read(tmp_path):
    def of(**columns):
        pd.DataFrame({"time": TIME_S, **columns}).to_csv(tmp_path / "drive.csv", index=False)
        return mf.read_log(tmp_path / "drive.csv")

    return of


def test_speeds_and_turns_that_are_exchanged_are_refused(drive, read):
    assert not any("likely" in note for note in read(**odometry(drive)).notes)
    with pytest.raises(InputError, match="speed_mps and yaw_rate_radps are exchanged"):
        read(wheel_speed_mps=np.degrees(drive["rate"]), yaw_rate_degps=drive["speed"])
    with pytest.raises(InputError, match="step_m and turn_rad are exchanged"):
        read(step_m=drive["rate"], turn_rad=0.1 * drive["speed"])


def odometry(drive):
    return {"wheel_speed_mps": drive["speed"], "yaw_rate_radps": drive["rate"]}


def test_accelerations_for_speeds_are_noted(drive, read):
    scatter = np.random.default_rng(1).normal(0, 0.5, COUNT)
    columns = odometry(drive)
    (note,) = [n for n in read(**columns | {"wheel_speed_mps": scatter}).notes if "likely" in n]
    assert note.startswith("drive.csv: odometry, speed_mps: ")
    assert "negative, now and then (likely: another quantity" in note
    # A shuttle goes there and back.
    shuttle = np.where(np.arange(COUNT) // 60 % 2, -1, 1) * drive["speed"]
    notes = read(**columns | {"wheel_speed_mps": shuttle}).notes
    assert not any("negative" in note for note in notes)


def test_rates_in_degrees_that_no_tyre_holds_are_refused(drive, read):
    """Few of them lie beyond 3.5 rad/s."""
    gentle = np.degrees(drive["rate"]) / 5
    assert np.abs(gentle).max() < 3.5
    with pytest.raises(InputError, match=r'sideways .* columns=\{"yaw_rate_degps": "COLUMN"\}'):
        read(wheel_speed_mps=3 * drive["speed"], yaw_rate=gentle)


def test_speeds_of_no_vehicle_are_noted(drive, read):
    notes = read(**odometry(drive) | {"wheel_speed_mps": 8 * drive["speed"]}).notes
    assert any("m/s or more in 5 % of the rows (likely: km/h for m/s" in note for note in notes)


def test_speed_and_course_of_a_receiver_that_are_exchanged_are_refused(drive, read):
    places = {name: drive[name] for name in ("latitude", "longitude")}
    read(**places, speed_mps=drive["speed"], course_deg=drive["azimuth"])
    with pytest.raises(InputError, match="the columns of speed and course are exchanged"):
        read(**places, speed_mps=drive["azimuth"], course_deg=drive["speed"])


@pytest.mark.parametrize("course", [None, 90.0])
def test_a_walk_straight_to_the_north_is_no_exchange(read, course):
    """Its speeds, taken for degrees, are nearly its course."""
    places = {"latitude": 60 + np.arange(COUNT) * 1e-5, "longitude": 25.0}
    read(**places, speed_mps=1.1, course_deg=course)


def test_speeds_of_a_receiver_that_are_another_quantity_are_left_out(drive, read, tmp_path):
    places = {name: drive[name] for name in ("latitude", "longitude")}
    read(**places, speed_mps=drive["rate"])
    found = read_recording(tmp_path / "drive.csv")
    assert found.tables["positions"]["speed_mps"].isna().all()
    (note,) = found.ignored
    assert "exchanged columns; the whole column" in note
    # One mark of missing values is none.
    read(**places, speed_mps=drive["speed"].where(drive.index % 3 > 0, -1.0))
    assert read_recording(tmp_path / "drive.csv").tables["positions"]["speed_mps"].notna().any()


def test_noise_of_speeds_at_rest_leaves_the_speeds(drive, read, tmp_path):
    places = {name: drive[name] for name in ("latitude", "longitude")}
    noise = np.random.default_rng(3).normal(0, 0.02, COUNT)
    speed = np.where(np.arange(COUNT) // 60 % 2, 0.0, 10.0) + noise
    below = int(np.sum(speed < 0))
    assert below > 100
    read(**places, speed_mps=speed)
    found = read_recording(tmp_path / "drive.csv")
    np.testing.assert_allclose(found.tables["positions"]["speed_mps"], np.maximum(speed, 0))
    assert found.notes == (f"positions, speed_mps: {below} values just below 0, taken for 0",)


def test_speeds_of_a_receiver_in_another_unit_are_noted(drive, read):
    places = {name: drive[name] for name in ("latitude", "longitude")}
    assert not any("speeds" in note for note in read(**places, speed_mps=drive["speed"]).notes)
    notes = read(**places, speed_mps=3.6 * drive["speed"]).notes
    told = "drive.csv: positions, speed_mps: speeds are 3.6"
    (note,) = [note for note in notes if note.startswith(told)]
    assert note.endswith("?); expected m/s")
    assert "speeds are 3.6 times those between positions (km/h for m/s" in note


@pytest.mark.parametrize(
    ("unit", "told"),
    [
        (1.0, "velocity (speed_mps?)"),
        (1 / 3.6, "velocity (speed_kmh?)"),
        (MPH_MPS, "velocity (in mph by the positions: call it velocity [mph])"),
        (KNOT_MPS, "velocity (in knots by the positions: call it velocity [knots])"),
    ],
)
def test_a_unit_that_no_header_states_is_found_by_positions(drive, tmp_path, unit, told):
    rows = drive[["time", "latitude", "longitude"]].assign(velocity=drive["speed"] / unit)
    rows.to_csv(tmp_path / "drive.csv", index=False)
    assert read_recording(tmp_path / "drive.csv").unread == (told,)


@pytest.mark.parametrize(
    ("speed", "told"),
    [
        (20.0, "(likely: --column speed_mps=velocity for m/s, or --column speed_kmh=velocity for "),
        (90.0, "(likely: --column speed_kmh=velocity)"),
    ],
)
def test_a_unit_that_nothing_states_is_asked_for(tmp_path, speed, told):
    rows = pd.DataFrame({"time": TIME_S, "pressure_hpa": 1000.0, "velocity": speed})
    rows.to_csv(tmp_path / "drive.csv", index=False)
    (note,) = read_recording(tmp_path / "drive.csv").ignored
    assert told in note


@pytest.fixture
def walk():
    rng = np.random.default_rng(4)
    count = 15_000 + np.cumsum(rng.integers(1, 3, COUNT))
    azimuth = (90 + 60 * np.sin(np.arange(COUNT) / 50) + rng.normal(0, 5, COUNT)) % 360
    return {"steps": count, "compass_deg": azimuth}


def test_steps_and_azimuths_that_are_exchanged_name_both_columns(walk, tmp_path):
    path = tmp_path / "walk.csv"
    rows = pd.DataFrame({"time": TIME_S, "step_count": walk["compass_deg"]})
    rows.assign(azimuth_deg=walk["steps"]).to_csv(path, index=False)
    with pytest.raises(InputError) as error:
        read_recording(path)
    (fault,) = error.value.faults
    assert fault.where == f"{path}, column azimuth_deg (magnetic_deg)"
    assert fault.hint == "a step counter: the columns of steps and it are exchanged"


@pytest.mark.parametrize("whole", [True, False])
def test_azimuths_for_steps_are_refused(walk, read, whole):
    read(**walk)
    azimuth = walk["compass_deg"].round() if whole else walk["compass_deg"]
    with pytest.raises(InputError) as error:
        read(steps=azimuth, compass_deg=walk["steps"] % 350)
    (fault,) = error.value.faults
    assert "falling in" in fault.got
    assert fault.hint == "the columns of steps and compass_deg are exchanged"
    with pytest.raises(InputError, match=r"another quantity, such as an azimuth \(compass_deg\)"):
        read(steps=azimuth, turn_rad=0.0)


def test_steps_of_each_row_may_fall(walk, read):
    log = read(**walk | {"steps": np.diff(walk["steps"], prepend=15_000)})
    assert log.motion["step_m"].sum() > 500


def test_steps_of_a_batch_are_read(walk, read):
    batches = np.where(np.arange(COUNT) % 5 == 0, 9, 0)
    assert read(**walk | {"steps": batches}).motion["step_m"].sum() > 0.69 * batches.sum()


def test_usual_names_without_a_unit_say_what_they_are_taken_for(drive, tmp_path):
    path = tmp_path / "drive.csv"
    rows = pd.DataFrame({"time": TIME_S, "wheel_speed": drive["speed"], "yaw_rate": drive["rate"]})
    rows.to_csv(path, index=False)
    notes = read_recording(path).notes
    assert notes == (
        "wheel_speed: no unit in its name, taken for m/s; for km/h --column "
        "wheel_speed_kmh=wheel_speed",
        "yaw_rate: no unit in its name, taken for rad/s; for deg/s --column "
        "yaw_rate_degps=yaw_rate",
    )
    pd.DataFrame({"time": TIME_S, **odometry(drive)}).to_csv(path, index=False)
    assert read_recording(path).notes == ()
