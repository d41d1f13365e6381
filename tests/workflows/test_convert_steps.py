"""Sensors of a phone become motion: by ``convert``, by a configuration, and from Python."""

import json

import numpy as np
import pandas as pd
import pytest
from command_line import mapfilter
from made_phone import Leg, walk_sensors

import mapfilter as mf
from mapfilter.config.load import load_config
from mapfilter.geodesy import project
from mapfilter.lattice import Lattice
from mapfilter.tracks.sensors import read_sensors
from mapfilter.workflows.inputs.logs import open_journey

START_UTC_S = 1_777_629_600
NAMES = {
    "accelerometer": "TotalAcceleration",
    "gyroscope": "Gyroscope",
    "magnetometer": "MagnetometerUncalibrated",
}
PLACE = ("--crs", "EPSG:32635", "--origin", "60.17,24.94")


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """The export of Sensor Logger of a walk of 75 steps: north-east, then south."""
    folder = tmp_path_factory.mktemp("walk")
    sensors, _, _ = walk_sensors((Leg(35, np.pi / 4, 3.0), Leg(40, -np.pi / 2)), start_s=0.0)
    for sensor, file in NAMES.items():
        rows = sensors[sensor]
        columns = {"time": ((START_UTC_S + rows["time_s"]) * 1e9).round().astype("int64")}
        columns["seconds_elapsed"] = rows["time_s"]
        columns |= {axis: rows.iloc[:, "xyz".index(axis) + 1] for axis in "zyx"}
        pd.DataFrame(columns).to_csv(folder / f"{file}.csv", index=False)
    pressure = pd.DataFrame({"time": columns["time"], "seconds_elapsed": rows["time_s"]})
    pressure.assign(relativeAltitude=0.0, pressure=1013.0).iloc[::10].to_csv(
        folder / "Barometer.csv", index=False
    )
    return folder


def headings_deg(log):
    rows = log.motion[log.motion["step_m"] > 0]
    return np.degrees(rows["heading_rad"].to_numpy())


def test_steps_of_an_app_are_in_the_log(recording, tmp_path):
    out = tmp_path / "log"
    done = mapfilter("convert", recording, *PLACE, "--declination", "10", "--out", out)
    assert done.code == 0
    assert "motion: 75 steps" in done.out
    assert "errors of motion: step" in done.out
    log = mf.read_log(out)
    # Headings are of the grid: the compass 10 degrees off, and its convergence of -1.8 there.
    first, last = np.median(headings_deg(log)[:35]), np.median(headings_deg(log)[35:])
    assert first == pytest.approx(45 - 10 - 1.8, abs=2)
    assert last == pytest.approx(-90 - 10 - 1.8, abs=2)
    assert log.imu.bias_sd_deg < 15
    assert json.loads((out / "log.json").read_text())["imu"]["scale"] == log.imu.scale
    reckoning = read_sensors(out)["reckoning"]
    assert len(reckoning) == len(log.motion)
    assert (reckoning["climb"] == 0).all()
    assert reckoning["height_m"].abs().max() < 0.1


def test_an_unknown_declination_is_an_error_of_headings(recording, tmp_path):
    outs = {}
    for name, args in (("unknown", ()), ("known", ("--declination", "0"))):
        done = mapfilter("convert", recording, *PLACE, *args, "--out", tmp_path / name)
        assert ("magnetic north taken for true north" in done.out) == (name == "unknown")
        outs[name] = mf.read_log(tmp_path / name)
    np.testing.assert_allclose(headings_deg(outs["unknown"]), headings_deg(outs["known"]))
    known_sd = outs["known"].imu.bias_sd_deg
    assert outs["unknown"].imu.bias_sd_deg == pytest.approx(np.hypot(known_sd, 8.0))


def test_sensors_stay_sensors_without_steps(recording, tmp_path):
    done = mapfilter("convert", recording, *PLACE, "--no-steps", "--out", tmp_path / "log")
    assert done.code == 0
    log = mf.read_log(tmp_path / "log")
    assert log.motion.empty
    assert log.imu is None
    assert "reckoning" not in read_sensors(tmp_path / "log")


def test_a_wrong_declination_or_pose_is_refused(recording, tmp_path):
    for args, said in (
        (("--declination", "400"), "degrees in -180..180, found 400"),
        (("--declination", "nan"), "degrees in -180..180"),
        (("--pose", "pocket"), "pocket"),
    ):
        done = mapfilter("convert", recording, *args, "--out", tmp_path / "log")
        assert done.code == 2, args
        assert said in done.err
        assert not (tmp_path / "log").exists()


def test_counted_steps_of_a_csv_have_the_length_that_is_given(tmp_path):
    rows = [f"2026-05-01T10:00:{k:02d}Z,{2 * k},80,60.17,24.94" for k in range(40)]
    path = tmp_path / "phone.csv"
    path.write_text("\n".join(["time,steps,compass_deg,latitude,longitude", *rows]) + "\n")
    given = ("--declination", "10", "--step-length", "0.8")
    done = mapfilter("convert", path, *given, "--out", tmp_path / "log")
    assert done.code == 0
    assert "motion: 78 steps of 0.8 m by a counter, with a compass" in done.out
    log = mf.read_log(tmp_path / "log")
    assert log.motion["step_m"].sum() == pytest.approx(78 * 0.8)
    np.testing.assert_allclose(headings_deg(log), 0 - 1.8, atol=0.2)
    assert read_sensors(tmp_path / "log")["compass"]["magnetic_deg"].unique().tolist() == [80.0]
    refused = mapfilter("convert", path, "--step-length", "80", "--out", tmp_path / "other")
    assert refused.code == 2
    assert "metres above 0 and below 3, found 80" in refused.err
    assert not (tmp_path / "other").exists()


COUNTED = [f"2026-05-01T10:00:{k:02d}Z,{2 * k},80,0.0,60.17,24.94" for k in range(40)]
OPTIONS = ("--pose", "any", "--declination", "10", "--step-length", "0.8")


def written(path, columns):
    """Write some columns of a phone's table of counted steps."""
    names = ["time", "steps", "compass_deg", "turn_rad", "latitude", "longitude"]
    kept = [names.index(name) for name in columns]
    rows = [",".join(row.split(",")[i] for i in kept) for row in COUNTED]
    path.write_text("\n".join([",".join(columns), *rows]) + "\n")
    return path


def told(notes):
    """Return the options that notes call without effect."""
    found = [note.split("no effect")[0] for note in notes if "has no effect: " in note]
    return [one.split("(")[1].split(")")[0] for one in found]


@pytest.mark.parametrize(
    ("columns", "without"),
    [
        (("steps", "compass_deg"), ["--pose"]),
        (("steps", "turn_rad"), ["--pose", "--declination"]),
        ((), ["--pose", "--declination", "--step-length"]),
    ],
)
def test_options_without_effect_are_noted(columns, without, tmp_path):
    path = written(tmp_path / "phone.csv", ("time", *columns, "latitude", "longitude"))
    done = mapfilter("convert", path, *OPTIONS, "--out", tmp_path / "log", "--json")
    assert done.code == 0
    assert told(done.json["notes"]) == without
    plain = mapfilter("convert", path, "--out", tmp_path / "plain", "--json")
    assert told(plain.json["notes"]) == []


def test_a_length_of_steps_is_the_mean_of_those_by_the_accelerometer(recording, tmp_path):
    done = mapfilter("convert", recording, *PLACE, *OPTIONS, "--out", tmp_path / "log", "--json")
    assert told(done.json["notes"]) == []
    step_m = mf.read_log(tmp_path / "log").motion["step_m"]
    given_m = float(OPTIONS[OPTIONS.index("--step-length") + 1])
    assert step_m[step_m > 0].mean() == pytest.approx(given_m)
    assert step_m[step_m > 0].std() > 0
    plain = mapfilter("convert", recording, *PLACE, "--out", tmp_path / "plain", "--json")
    assert plain.code == 0
    own_m = mf.read_log(tmp_path / "plain").motion["step_m"]
    assert own_m[own_m > 0].mean() != pytest.approx(given_m, rel=0.01)
    ratio = step_m[step_m > 0] / own_m[own_m > 0]
    assert ratio.to_numpy() == pytest.approx(ratio.iloc[0])


def test_motion_that_a_file_holds_takes_no_options(tmp_path):
    rows = [f"{k},0.7,{3 * k},48.0,11.0" for k in range(40)]
    path = tmp_path / "steps.csv"
    path.write_text("\n".join(["time_s,step_m,compass_deg,latitude,longitude", *rows]) + "\n")
    done = mapfilter("convert", path, *OPTIONS, "--out", tmp_path / "log", "--json")
    assert told(done.json["notes"]) == ["--pose", "--declination", "--step-length"]
    assert any("steps.csv, whose compass_deg counts from true" in n for n in done.json["notes"])


def test_a_track_log_takes_no_options_of_walks(tmp_path):
    path = written(
        tmp_path / "phone.csv", ("time", "steps", "compass_deg", "latitude", "longitude")
    )
    assert mapfilter("convert", path, *OPTIONS, "--out", tmp_path / "log").code == 0
    walk = mf.WalkOptions(declination_deg=10.0, step_m=0.8)
    notes = mf.read_log(tmp_path / "log", walk=walk).notes[-2:]
    assert [note.split(" has no effect: ")[0] for note in notes] == [
        "declination_deg = 10 (walk=WalkOptions(declination_deg=…))",
        "step_m = 0.8 (walk=WalkOptions(step_m=…))",
    ]
    assert mf.read_log(tmp_path / "log").notes == mf.read_log(tmp_path / "log", walk=None).notes


@pytest.mark.parametrize("given", [OPTIONS[:2], OPTIONS[2:4], OPTIONS[4:], ("--pose", "auto")])
def test_options_of_walks_are_refused_without_steps(given, tmp_path):
    path = written(tmp_path / "phone.csv", ("time", "steps", "latitude", "longitude"))
    done = mapfilter("convert", path, "--no-steps", *given, "--out", tmp_path / "log")
    assert done.code == 2
    assert f"{given[0]}: expected nothing, as --no-steps takes none" in done.err
    assert not (tmp_path / "log").exists()


def test_a_configuration_and_python_take_the_same_options(recording, tmp_path):
    text = f"""
    [track]
    path = "{recording}"
    origin = [24.94, 60.17]
    walk = {{declination_deg = 10, step_factor = 0.5}}
    """
    (tmp_path / "walk.toml").write_text(text)
    config = load_config(tmp_path / "walk.toml")
    east, north = map(float, project("EPSG:32635", 24.94, 60.17))
    area = Lattice("EPSG:32635", east - 500.0, north + 500.0, 5.0, 200, 200)
    opened = open_journey(config, recording, area)
    options = mf.WalkOptions(declination_deg=10.0, step_factor=0.5)
    log = mf.read_log(recording, crs="EPSG:32635", walk=options)
    assert log.imu == opened.log.imu
    np.testing.assert_allclose(log.motion["step_m"], opened.log.motion["step_m"])
    # Without an origin the place, and with it the convergence, is unknown.
    apart = (headings_deg(opened.log) - headings_deg(log) + 180) % 360 - 180
    np.testing.assert_allclose(apart, -1.8, atol=0.1)
    # That of an area is known.
    text = text.replace("origin = [24.94, 60.17]", "")
    (tmp_path / "walk.toml").write_text(text)
    placed = open_journey(load_config(tmp_path / "walk.toml"), recording, area)
    np.testing.assert_allclose(headings_deg(placed.log), headings_deg(opened.log), atol=1e-6)
    without = load_config(tmp_path / "walk.toml", ["track.steps=false"])
    assert open_journey(without, recording, area).log.motion.empty
    assert mf.read_log(recording, walk=None).motion.empty


@pytest.mark.parametrize(
    ("header", "why"),
    [
        ("time,steps,compass_deg,latitude,longitude", ""),
        ("time,step_m,compass_deg,latitude,longitude", "motion is made of no phone's sensors anyw"),
        ("time,other,more,latitude,longitude", "there are no sensors of a phone to make steps of"),
    ],
)
def test_no_steps_is_noted_where_there_were_none(header, why, tmp_path):
    rows = [f"2026-05-01T10:00:{k:02d}Z,{1 + k % 2},80,60.17,24.94" for k in range(40)]
    (tmp_path / "phone.csv").write_text("\n".join([header, *rows, ""]))
    given = ("convert", tmp_path / "phone.csv", "--json", "--out", tmp_path / "log")
    notes = mapfilter(*given, "--no-steps").json["notes"]
    found = [note for note in notes if note.startswith("--no-steps has no effect: ")]
    assert len(found) == bool(why)
    assert all(why in note for note in found)
    assert not any("--no-steps" in note for note in mapfilter(*given).json["notes"])


@pytest.mark.parametrize(
    ("time", "told"),
    [
        ("2026-05-01T10:00:{:02d}Z", "phone.csv UTC"),
        ("2026-05-01T10:00:{:02d}+02:00", "phone.csv UTC"),
        ("2026-05-01 10:00:{:02d}", ""),
    ],
)
def test_a_zone_is_noted_where_no_time_is_local(time, told, tmp_path):
    rows = [f"{time.format(k)},60.17,24.94" for k in range(40)]
    (tmp_path / "phone.csv").write_text("\n".join(["time,latitude,longitude", *rows, ""]))
    given = ("convert", tmp_path / "phone.csv", "--json", "--out", tmp_path / "log")
    notes = mapfilter(*given, "--zone", "+02:00").json["notes"]
    found = [note for note in notes if note.startswith("--zone has no effect: ")]
    wanted = f"--zone has no effect: no times are local without a zone ({told})"
    assert found == ([wanted] if told else [])
    log = mf.read_log(tmp_path / "phone.csv", zone="+02:00")
    assert any(note.startswith("zone has no effect: ") for note in log.notes) == bool(told)
