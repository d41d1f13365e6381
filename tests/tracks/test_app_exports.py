"""Exports of apps and buses with a reader of their own: WiGLE, SensorLog, frames of a CAN bus."""

import numpy as np
import pandas as pd
import pytest
from made_recordings import COUNT, LEVEL_DBM, MADE, START_UTC_S, STEP_S

import mapfilter as mf
from mapfilter.errors import InputError
from mapfilter.tracks.readers.format import ReadOptions
from mapfilter.tracks.readers.formats import read_recording


def written(tmp_path, name, text):
    path = tmp_path / name
    path.write_text(text)
    return path


def test_cells_and_access_points_of_wigle(tmp_path):
    """It was refused, with a recipe by which its cells had no levels."""
    path = written(tmp_path, *MADE["wigle"])
    found = read_recording(path, options=ReadOptions(zone="+03:00"))
    assert found.program == "WiGLE 2.86"
    radio = found.tables["radio"]
    cells = radio[radio["technology"] == "LTE"]
    np.testing.assert_array_equal(cells["level_dbm"], LEVEL_DBM)
    assert set(cells["role"]) == {"serving"}
    assert cells["cell"].iloc[0] == "244-91-3021-1170250"
    np.testing.assert_allclose(
        cells["time_s"], START_UTC_S + STEP_S * np.arange(COUNT), rtol=0, atol=1e-6
    )
    points = radio[radio["technology"] == "WIFI"]
    assert set(points["role"]) == {"neighbour"}
    assert points["cell"].iloc[1] == "1a:9f:ee:5c:71:01"
    assert str(read_recording(path).clock) == "local time (zone unknown)"


def test_wigle_without_its_first_line_and_as_of_old(tmp_path):
    _, text = MADE["wigle"]
    whole = read_recording(written(tmp_path, "a.csv", text))
    _, rest = text.split("\n", 1)
    bare = read_recording(written(tmp_path, "b.csv", rest))
    table = pd.read_csv(tmp_path / "b.csv").drop(columns=["Frequency", "RCOIs", "MfgrId"])
    old = read_recording(written(tmp_path, "c.csv", "WigleWifi-1.4\n" + table.to_csv(index=False)))
    for other in (bare, old):
        for name, rows in whole.tables.items():
            pd.testing.assert_frame_equal(other.tables[name], rows)


def test_rows_of_wigle_that_are_not_used_are_named(tmp_path):
    name, text = MADE["wigle"]
    lines = text.splitlines()
    lines[2] = lines[2].replace("24491_3021_1170250", "0c:aa:bb:cc:dd:ee").replace(",LTE", ",BT")
    lines[4] = lines[4].replace("24491_3021_1170250", "31_4_1")
    lines[6] = lines[6].replace(f",{LEVEL_DBM[2]},", ",0,")
    found = read_recording(written(tmp_path, name, "\n".join(lines)))
    assert "1 row of type BT left out" in found.ignored
    (bad,) = found.unusable
    assert (bad.reason, bad.lines) == ("radio: the MAC of a cell is no MCCMNC_LAC_CI", (5,))
    assert found.tables["radio"]["level_dbm"].isna().sum() == 1
    lost = "\n".join(line.replace(",-", ",") for line in text.splitlines())
    with pytest.raises(InputError, match=r"rssi \(level_dbm\).*lost sign"):
        read_recording(written(tmp_path, name, lost))


def test_types_of_a_damaged_wigle_are_few(tmp_path):
    """Each of thousands of types was a note, and a pass over all rows."""
    name, text = MADE["wigle"]
    lines = text.splitlines()
    bad = [lines[3].replace(",WIFI", f",T{i:05d}") for i in range(20_000)]
    found = read_recording(written(tmp_path, name, "\n".join([*lines, *bad])))
    assert found.ignored[-2:] == (
        "1 row of type T00007 left out",
        "19992 rows of other types left out",
    )


def test_forces_of_sensorlog_have_the_sign_of_all_others(tmp_path):
    """Apple's accelerations at rest point down, and are in g; a gyroscope turned the wrong way."""
    found = read_recording(written(tmp_path, *MADE["sensorlog"]))
    z = found.tables["accelerometer"]["z_mps2"]
    np.testing.assert_allclose(z.iloc[:3], 9.80665 * np.array([1.0, 1.1, 1.2]))
    assert found.tables["positions"]["course_deg"].isna().all()
    assert set(found.tables["barometer"]["pressure_hpa"]) == {1013.0}
    log = mf.read_log(tmp_path)
    turned = log.motion["turn_rad"].sum()
    assert turned == pytest.approx(0.03 * STEP_S * (COUNT - 1), abs=0.05)


def test_positions_that_sensorlog_repeats_count_once(tmp_path):
    name, text = MADE["sensorlog"]
    head, *rows = text.splitlines()
    first = rows[0].split(",")
    for i in range(1, 4):
        cells = rows[i].split(",")
        rows[i] = ",".join([cells[0], *first[1:8], *cells[8:]])
    rows[8] = rows[8].replace(f",{START_UTC_S + 16}.000,", f",{START_UTC_S - 3600}.000,")
    found = read_recording(written(tmp_path, name, "\n".join([head, *rows])))
    places = found.tables["positions"]
    assert len(places) == COUNT - 4
    assert places["time_s"].min() == START_UTC_S
    (bad,) = found.unusable
    assert bad.lines == (10,)
    assert "more than 10 s before" in bad.reason


def test_speeds_of_obd_among_the_frames_of_a_bus(tmp_path):
    """Such a file was refused, also where a tool had asked for the speed."""
    path = written(tmp_path, *MADE["can"])
    found = read_recording(path)
    rows = found.tables["odometry"]
    np.testing.assert_allclose(rows["speed_mps"], (20 + np.arange(COUNT) % 5) / 3.6)
    np.testing.assert_allclose(
        rows["time_s"], START_UTC_S + STEP_S * np.arange(COUNT) + 0.01, rtol=0, atol=1e-6
    )
    assert found.clock.absolute
    assert any("60 lines of other frames not used" in note for note in found.ignored)
    assert mf.read_log(path).motion["step_m"].notna().all()


@pytest.mark.parametrize(
    "line",
    [
        " ({:.6f})  can0  7E8   [8]  03 41 0D {:02X} 00 00 00 00",
        " ({:.6f})  can0  RX - -  7E8   [8]  03 41 0D {:02X} AA AA AA AA",
        "({:.6f}) vcan1 18DAF110#03410d{:02x}55555555",
        "({:.6f}) can0 7E8#06410D{:02X}0C1AF800 R",
    ],
)
def test_forms_of_candump(tmp_path, line):
    text = "".join(line.format(1e9 + i, 40 + i) + "\n" for i in range(20))
    rows = read_recording(written(tmp_path, "bus.log", text)).tables["odometry"]
    np.testing.assert_allclose(rows["speed_mps"], (40 + np.arange(20)) / 3.6)


def test_asc_in_decimal_and_relative(tmp_path):
    name, text = MADE["can/asc"]
    hexadecimal = read_recording(written(tmp_path, name, text)).tables["odometry"]
    lines = [
        line.replace("7E8 ", "2024").replace("03 41 0D", "3  65 13").replace("AA", "170")
        for line in text.splitlines()
    ]
    lines[3:] = [
        f"{line[: line.index(' 13 ') + 4]}{20 + i % 5:3d} 170 170 170 170"
        for i, line in enumerate(lines[3:])
    ]
    decimal = "\n".join(lines).replace("base hex", "base dec")
    found = read_recording(written(tmp_path, name, decimal)).tables["odometry"]
    pd.testing.assert_frame_equal(found, hexadecimal)
    with pytest.raises(InputError, match="export with absolute timestamps"):
        read_recording(written(tmp_path, name, text.replace("absolute", "relative")))


def test_times_since_the_frame_before_are_refused(tmp_path):
    """Candump -td: 60 s of a drive were read as some milliseconds."""
    delta_s = np.random.default_rng(3).uniform(0.001, 1.0, 60)
    rows = [f" ({one:010.6f})  can0  7E8   [8]  03 41 0D 20 00 00 00 00" for one in delta_s]
    with pytest.raises(InputError, match=r"absolute timestamps, found times that go backwards in"):
        read_recording(written(tmp_path, "bus.log", "\n".join(rows)))


@pytest.mark.parametrize("line", ["Base December survey", "base hex", "base decimal,1,2"])
def test_a_title_that_begins_as_a_line_of_asc_makes_no_frames(tmp_path, line):
    """Such a table was refused as raw frames of a bus."""
    rows = "".join(f"{START_UTC_S + i},{60 + i / 1e4},24.9\n" for i in range(20))
    found = read_recording(written(tmp_path, "a.csv", f"{line}\ntime,lat,lon\n{rows}"))
    assert (found.format, len(found.tables["positions"])) == ("csv", 20)


def test_positions_that_sensorlog_repeats_count_once_where_times_have_no_zone(tmp_path):
    name, text = MADE["sensorlog"]
    head, *rows = text.replace(" +0300", "").splitlines()
    first = rows[0].split(",")
    rows[1:9] = [
        ",".join([row.split(",")[0], *first[1:8], *row.split(",")[8:]]) for row in rows[1:9]
    ]
    found = read_recording(written(tmp_path, name, "\n".join([head, *rows])))
    assert len(found.tables["positions"]) == COUNT - 8
    assert not any("positions" in note for note in found.ignored)


def test_replies_that_are_no_speed_of_the_vehicle(tmp_path):
    """Requests, other PIDs, frames of others, a second unit, and the mark of no value."""
    rows = []
    for i in range(12):
        rows += [
            f"({i}.0) can0 7E8#03410D{10 + i:02X}AAAAAAAA",
            f"({i}.1) can0 7E0#03410D7FAAAAAAAA",
            f"({i}.2) can0 7E8#04410C0DFFAAAAAA",
            f"({i}.3) can0 1A6#03410D7FAAAAAAAA",
            f"({i}.4) can0 7E8#1008410D7F0C1AF8",
        ]
    rows += ["(12.0) can0 7E9#03410D7FAAAAAAAA", "(13.0) can0 7E8#03410DFFAAAAAAAA"]
    found = read_recording(written(tmp_path, "bus.log", "\n".join(rows)))
    speeds = found.tables["odometry"]["speed_mps"]
    np.testing.assert_allclose(speeds, (10 + np.arange(12)) / 3.6)
    assert "1 speed by other control units not used" in found.ignored
    (bad,) = found.unusable
    assert bad.lines == (len(rows),)


def test_milliseconds_after_a_colon_and_headers_of_androsensor(tmp_path):
    count = 40
    table = {
        "ACCELEROMETER X (m/s²)": 0.1,
        "ACCELEROMETER Y (m/s²)": 0.2,
        "ACCELEROMETER Z (m/s²)": 9.8 + np.arange(count) % 3 / 10,
        "LOCATION Latitude : ": 60.17 + 1e-5 * np.arange(count),
        "LOCATION Longitude : ": 24.94,
        "LOCATION Speed ( Kmh)": 3.6,
        "LOCATION Accuracy ( m)": 4.0,
        "LOCATION ORIENTATION (°)": 10.0,
        "Time since start in ms ": 500 * np.arange(count),
        "YYYY-MO-DD HH-MI-SS_SSS": [
            f"2026-05-13 10:00:{i // 2:02d}:{500 * (i % 2) + 7:03d}" for i in range(count)
        ],
    }
    pd.DataFrame(table).to_csv(tmp_path / "a.csv", index=False, sep=";")
    found = read_recording(tmp_path / "a.csv", options=ReadOptions(zone="UTC"))
    np.testing.assert_allclose(np.diff(found.tables["accelerometer"]["time_s"]), 0.5)
    places = found.tables["positions"]
    assert places["time_s"].iloc[0] % 1 == pytest.approx(0.007, abs=1e-6)
    assert (set(places["speed_mps"]), set(places["course_deg"])) == ({1.0}, {10.0})


def test_forces_of_physics_toolbox_are_in_g(tmp_path):
    columns = {"time": np.arange(9.0), "gFx": 0.0, "gFy": 0.1, "gFz": 1 + np.arange(9) / 10}
    columns |= {"Bx": 1.0, "By": 20.0, "Bz": -43.0, "p": 1013.2}
    pd.DataFrame(columns).to_csv(tmp_path / "a.csv", index=False)
    found = read_recording(tmp_path / "a.csv")
    assert found.tables["accelerometer"]["z_mps2"].iloc[1] == pytest.approx(1.1 * 9.80665)
    assert set(found.tables) == {"accelerometer", "magnetometer", "barometer"}
    own = ReadOptions(columns={f"acc_{axis}": f"gF{axis}" for axis in "xyz"})
    named = read_recording(tmp_path / "a.csv", options=own)
    assert named.tables["accelerometer"]["z_mps2"].iloc[1] == pytest.approx(1.1)


@pytest.mark.parametrize("none", ["", "0.0"])
@pytest.mark.parametrize("raw", [False, True])
def test_sensors_of_sensorlog_whose_columns_hold_nothing_leave_it_to_the_others(
    tmp_path, raw, none
):
    """Empty columns of Core Motion took the place of the gyroscope, and those of raw ones its."""
    sensors = {
        "accelerometerAcceleration": ("0", "0", "-1") if raw else (none,) * 3,
        "motionGravity": (none,) * 3 if raw else ("0", "0", "-1"),
        "motionUserAcceleration": (none,) * 3 if raw else ("0", "0", "0"),
        "gyroRotation": ("0.1", "0.2", "0.3") if raw else (none,) * 3,
        "motionRotationRate": (none,) * 3 if raw else ("0.1", "0.2", "0.3"),
    }
    names = [f"{sensor}{axis}" for sensor in sensors for axis in "XYZ"]
    values = ",".join(value for axes in sensors.values() for value in axes)
    rows = [f"2026-05-01T10:00:0{i}.000+00:00,{values}" for i in range(5)]
    path = tmp_path / "log.csv"
    path.write_text("\n".join([",".join(["loggingTime(txt)", *names]), *rows]) + "\n")
    tables = read_recording(path).tables
    rates = tables["gyroscope"][["x_radps", "y_radps", "z_radps"]]
    assert rates.to_numpy().tolist() == [[0.1, 0.2, 0.3]] * 5
    assert tables["accelerometer"]["z_mps2"].tolist() == pytest.approx([9.80665] * 5)
