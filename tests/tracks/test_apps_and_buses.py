"""Tables as apps of phones and loggers of vehicles write them: what is read, and what is said."""

import numpy as np
import pandas as pd
import pytest

import mapfilter as mf
from mapfilter.errors import InputError
from mapfilter.tracks.readers.format import ReadOptions
from mapfilter.tracks.readers.formats import read_recording
from mapfilter.tracks.readers.plain.headers import likely_fields
from mapfilter.tracks.readers.texts import text

START_S = 1_778_666_400.0
TIME_S = np.arange(120.0)
SPEED_MPS = 8.0 + 3.0 * np.sin(TIME_S / 15)
COURSE_DEG = (30.0 + TIME_S) % 360
EAST_M, NORTH_M = (np.cumsum(SPEED_MPS * part(np.radians(COURSE_DEG))) for part in (np.sin, np.cos))
LAT_DEG, LON_DEG = 60.0 + NORTH_M / 111_412, 24.0 + EAST_M / 55_800
CI = 26_385_410 + np.arange(120) // 60
LEVEL_DBM = -85 - np.arange(120) % 9


def written(tmp_path, columns, name="log.csv", **options):
    path = tmp_path / name
    pd.DataFrame(columns).to_csv(path, index=False, **options)
    return path


def stamps(form):
    return pd.to_datetime(START_S + TIME_S, unit="s").strftime(form)


def gps_logger():
    """Of GPSLogger for Android, in short; its speeds have no unit in the header."""
    return {
        "time": stamps("%Y-%m-%dT%H:%M:%S.000Z"),
        "lat": LAT_DEG,
        "lon": LON_DEG,
        "elevation": 20.0,
        "accuracy": 4.0,
        "bearing": COURSE_DEG,
        "speed": SPEED_MPS,
        "satellites": 9,
        "provider": "gps",
    }


def test_a_course_without_a_speed_makes_no_motion_of_nothing(tmp_path):
    """All steps were unknown, and a note spoke of speed and course."""
    log = mf.read_log(written(tmp_path, gps_logger()), course_motion=True)
    way_m = log.motion["step_m"].sum()
    assert way_m == pytest.approx(SPEED_MPS[1:].sum(), rel=0.02)
    assert any("its positions, one to the next" in note for note in log.notes)
    assert any('(likely: columns={"speed_mps": "speed"})' in note for note in log.notes)
    named = mf.read_log(tmp_path / "log.csv", course_motion=True, columns={"speed_mps": "speed"})
    assert any("speed and course of its fixes" in note for note in named.notes)


@pytest.mark.parametrize(
    ("names", "network"),
    [
        (("mcc", "mnc"), (244, 91)),
        (("PLMN",), (244_91,)),
        (("mccmnc",), (244_91,)),
        (("MCC",), (310_410,)),
    ],
)
def test_networks_as_one_number(tmp_path, names, network):
    """A column PLMN was not used, so that cells were those of any network."""
    identity = dict(zip(names, network, strict=True)) | {"TAC": 3021, "ECI": CI}
    columns = {"time": START_S + TIME_S, **identity, "RSRP [dBm]": LEVEL_DBM, "Tech": "4G"}
    radio = read_recording(written(tmp_path, columns)).tables["radio"]
    known = (310, 410) if network[0] == 310_410 else (244, 91)
    assert set(zip(radio["mcc"], radio["mnc"], strict=True)) == {known}
    assert set(radio["ci"]) == set(CI)
    assert set(radio["technology"]) == {"LTE"}


@pytest.mark.parametrize("column", ["Signal", "signal_strength", "SignalStrength"])
def test_signals_beside_cells_are_levels_where_they_look_like_them(tmp_path, column):
    """CellMapper's signals were not used: its cells had no levels."""
    columns = {
        "Time": stamps("%Y-%m-%d %H:%M:%SZ"),
        "Latitude": LAT_DEG,
        "Longitude": LON_DEG,
        "MCC": 244,
        "MNC": 91,
        "LAC": 3021,
        "CID": CI,
        column: LEVEL_DBM,
        "PSC or PCI": 101,
    }
    found = read_recording(written(tmp_path, columns))
    np.testing.assert_array_equal(found.tables["radio"]["level_dbm"], LEVEL_DBM)
    assert set(found.tables["radio"]["bsic"]) == {101}
    assert f"{column.lower()}: taken for levels in dBm, by its values" in found.notes
    for other in (LEVEL_DBM + 140, -LEVEL_DBM % 5):
        found = read_recording(written(tmp_path, columns | {column: other}))
        assert found.tables["radio"]["level_dbm"].isna().all()
        assert any("(level_dbm?)" in name for name in found.unread)


def test_cells_with_signals_and_nothing_else_are_read(tmp_path):
    columns = {"time": TIME_S, "MCC": 244, "MNC": 91, "LAC": 3021, "CID": CI, "signal": LEVEL_DBM}
    found = read_recording(written(tmp_path, columns))
    np.testing.assert_array_equal(found.tables["radio"]["level_dbm"], LEVEL_DBM)
    assert "signal: taken for levels in dBm, by its values" in found.notes
    with pytest.raises(InputError, match="a recording in a known format"):
        read_recording(written(tmp_path, {"time": TIME_S, "signal": LEVEL_DBM}))


NETWORK_SURVEY = {
    "LTE": ("tac", "eci", "earfcn", "pci", "rsrp", 1300),
    "NR": ("tac", "nci", "narfcn", "pci", "ssRsrp", 640_000),
    "UMTS": ("lac", "cid", "uarfcn", "psc", "rscp", 10_700),
}


@pytest.mark.parametrize("family", NETWORK_SURVEY)
def test_network_survey_states_serving_cells_and_technologies_by_columns(tmp_path, family):
    """The app for Android writes a file for each technology, with a row for each cell."""
    area, identity, carrier, code, level, number = NETWORK_SURVEY[family]
    shared = {"deviceTime": stamps("%Y-%m-%dT%H:%M:%S.123Z"), "latitude": LAT_DEG}
    shared |= {"longitude": LON_DEG, "speed": 1.2, "accuracy": 8.5, "groupNumber": 1 + TIME_S}
    network = {"mcc": 244, "mnc": 91, area: 500}
    serving = {**shared, **network, identity: CI, carrier: number, code: 101, level: LEVEL_DBM}
    other = {**serving, **dict.fromkeys([*network, identity], ""), code: 102, level: LEVEL_DBM - 9}
    named = {**serving, identity: CI + 1, code: 103, level: LEVEL_DBM - 5}
    tables = [(serving, "true"), (other, "false"), (named, "false")]
    rows = pd.concat([pd.DataFrame(rows).assign(servingCell=served) for rows, served in tables])
    path = tmp_path / "log.csv"
    path.write_text("# CSV Version=0.4.0\n" + rows.to_csv(index=False))
    found = read_recording(path)
    radio = found.tables["radio"]
    assert radio["role"].value_counts().to_dict() == {"neighbour": 240, "serving": 120}
    assert set(radio["technology"]) == {family}
    assert set(radio["arfcn"]) == {number}
    served = radio[radio["role"] == "serving"]
    np.testing.assert_array_equal(served["ci"], CI)
    np.testing.assert_array_equal(served["level_dbm"], LEVEL_DBM)
    assert set(radio[radio["bsic"] == 103]["ci"]) == set(CI + 1)
    assert not any("servingcell" in name for name in found.unread)


@pytest.mark.parametrize(
    ("columns", "family"),
    [
        ({"arfcn": 1300, "cid": 77}, None),
        ({"earfcn": 1300, "nci": 77}, None),
        ({"enodeb": 300, "cid": 7}, "LTE"),
        ({"earfcn": 1300, "tech": "3G"}, "UMTS"),
        ({"earfcn": "", "cid": 7}, None),
        ({"enodeb": "", "cid": 7}, None),
    ],
)
def test_a_technology_is_that_of_its_columns(tmp_path, columns, family):
    table = {"time": START_S + TIME_S, "pci": 7, "rsrp": LEVEL_DBM, **columns}
    radio = read_recording(written(tmp_path, table)).tables["radio"]
    stated = radio["technology"].tolist() if "technology" in radio else [None]
    assert {None if pd.isna(one) else one for one in stated} == {family}


def test_signals_without_cells_are_those_of_something_else(tmp_path):
    columns = gps_logger() | {"signal": -70}
    assert "radio" not in read_recording(written(tmp_path, columns)).tables


def test_blanks_in_names_are_underscores(tmp_path):
    columns = {
        "Date": stamps("%Y-%m-%d"),
        "Time": stamps("%H:%M:%S"),
        "Latitude": LAT_DEG,
        "Longitude": LON_DEG,
        "Serving RSRP (dBm)": LEVEL_DBM,
        "eNodeB ID": CI // 256,
        "Cell ID": CI % 256,
        "Network type": "LTE",
    }
    found = read_recording(written(tmp_path, columns))
    np.testing.assert_array_equal(found.tables["radio"]["ci"], CI)
    np.testing.assert_array_equal(found.tables["radio"]["level_dbm"], LEVEL_DBM)
    assert not found.unread


def test_headers_that_are_repeated_are_left_out(tmp_path):
    """As by Torque, where its adapter was connected anew; each column had a note."""
    columns = {
        "Device Time": stamps("%d-%b-%Y %H:%M:%S.000"),
        " Longitude": LON_DEG,
        " Latitude": LAT_DEG,
        " Speed (OBD)(km/h)": 3.6 * SPEED_MPS,
    }
    path = written(tmp_path, columns)
    lines = path.read_text().splitlines()
    plain = read_recording(path)
    path.write_text(
        "\n".join([*lines[:40], lines[0], lines[0], *lines[40:80], lines[0], *lines[80:]])
    )
    found = read_recording(path)
    for table, rows in plain.tables.items():
        pd.testing.assert_frame_equal(found.tables[table], rows)
    assert "3 lines repeat the header, left out" in found.notes
    assert not any("no number" in note for note in found.notes)


def test_names_of_a_bus_export(tmp_path):
    columns = {
        "timestamps": START_S + TIME_S,
        "VehicleSpeed [km/h]": 3.6 * SPEED_MPS,
        "YawRate [deg/s]": -1.0,
    }
    found = read_recording(written(tmp_path, columns)).tables["odometry"]
    np.testing.assert_allclose(found["speed_mps"], SPEED_MPS)
    np.testing.assert_allclose(found["yaw_rate_radps"], -np.pi / 180)


@pytest.mark.parametrize("column", ["vehicle_slope", "vehicle_type", "vehicle_lane"])
def test_one_word_in_common_is_no_likeness(column):
    assert likely_fields(column, ("time",)) == []


def test_a_simulators_vehicle_by_named_columns(tmp_path):
    """Of SUMO; the message proposed vehicle_slope as a speed."""
    columns = {
        "timestep_time": TIME_S,
        "vehicle_angle": COURSE_DEG,
        "vehicle_id": "car",
        "vehicle_slope": 0.0,
        "vehicle_speed": SPEED_MPS,
        "vehicle_type": "DEFAULT",
    }
    path = written(tmp_path, columns, sep=";")
    with pytest.raises(InputError) as caught:
        read_recording(path)
    assert "wheel_speed_mps=vehicle_speed for m/s" in str(caught.value)
    assert "=vehicle_slope" not in str(caught.value)
    named = {"wheel_speed_mps": "vehicle_speed", "compass_deg": "vehicle_angle"}
    log = mf.read_log(path, columns=named)
    heading = np.unwrap(log.motion["heading_rad"])
    assert np.degrees(heading[-1] - heading[0]) == pytest.approx(-119, abs=1)


WHEELS = {f"wheel_speed_{wheel}_kmh": 3.6 * SPEED_MPS for wheel in ("fl", "fr", "rl", "rr")}


@pytest.mark.parametrize(
    ("name", "columns", "said"),
    [
        ("a.csv", {"time": TIME_S} | WHEELS, "wheel_speed_kmh= one of wheel_speed_fl_kmh, wheel"),
        ("a.ntm", {"4G": ["4G"], "244": [244], "91": [91]}, "list of cells of NetMonster"),
        ("a.csv", {"X (m/s²)": [1.0], "Latitude : ": [60.0]}, "without a column of times"),
    ],
)
def test_what_is_refused_is_named(tmp_path, name, columns, said):
    sep = ";" if "Latitude : " in columns else ","
    with pytest.raises(InputError) as caught:
        read_recording(written(tmp_path, columns, name, sep=sep))
    assert said in str(caught.value)
    assert "blanks where tabs should be" not in str(caught.value)


def test_extensions_of_gpx(tmp_path):
    points = "".join(
        f'<trkpt lat="{lat:.7f}" lon="{lon:.7f}"><time>{time}</time><hdop>9</hdop><extensions>'
        f"<osmand:speed>{speed:.2f}</osmand:speed><osmand:bearing>{course:.1f}</osmand:bearing>"
        "<accuracy>4.5</accuracy></extensions></trkpt>"
        for lat, lon, time, speed, course in zip(
            *(LAT_DEG, LON_DEG, stamps("%Y-%m-%dT%H:%M:%SZ"), SPEED_MPS, COURSE_DEG), strict=True
        )
    )
    head = '<gpx version="1.1" creator="A" xmlns:osmand="https://osmand.net"><trk><trkseg>'
    (tmp_path / "walk.gpx").write_text(f"{head}{points}</trkseg></trk></gpx>")
    places = read_recording(tmp_path / "walk.gpx").tables["positions"]
    np.testing.assert_allclose(places["course_deg"], COURSE_DEG, atol=0.06)
    np.testing.assert_allclose(places["speed_mps"], SPEED_MPS, atol=0.006)
    assert set(places["accuracy_m"]) == {4.5}


def test_rates_of_physics_toolbox(tmp_path):
    columns = {"time": TIME_S, "gFz": 1.0, "wx": 0.1, "wy": 0.2, "wz": 0.3}
    found = read_recording(written(tmp_path, columns)).tables["gyroscope"]
    np.testing.assert_array_equal(found[["x_radps", "y_radps", "z_radps"]].iloc[0], [0.1, 0.2, 0.3])


@pytest.mark.parametrize("parts", [False, True])
@pytest.mark.parametrize("named", [False, True])
def test_lines_above_a_header_are_left_out(tmp_path, monkeypatch, named, parts):
    """As by RaceChrono and OBDLink, also in a folder; the file was refused by its first line."""
    speed = "tempo" if named else "Vehicle speed (km/h)"
    path = written(tmp_path, {"Time (sec)": TIME_S, speed: 3.6 * SPEED_MPS, "deg": "x"})
    title = "This file was written by an app.\nFormat,3\n# StartTime = 05/13/2026 10:00:00 AM\n\n"
    rows = path.read_text().splitlines()
    rows[100] = "99.0,17.5"
    path.write_text(title + "\n".join(rows))
    if parts:
        monkeypatch.setattr(text, "_PART_BYTES", 512)
    columns = {"wheel_speed_kmh": speed, "time": "Time (sec)"} if named else {}
    found = read_recording(path, options=ReadOptions(columns=columns))
    kept = np.arange(120) != 99
    np.testing.assert_allclose(found.tables["odometry"]["speed_mps"], SPEED_MPS[kept])
    assert "4 lines above the header left out" in found.notes
    (bad,) = found.unusable
    assert bad.lines == (105,)
    assert named or len(mf.read_log(tmp_path).motion) == 119


def test_raw_frames_of_a_bus_are_named(tmp_path):
    candump = "".join(f"(1778666400.{k:06d}) can0 1A0#0011223344556677\n" for k in range(50))
    css = (
        "TimestampEpoch;BusChannel;ID;IDE;DLC;DataBytes\n1778666400.1;1;1A0;0;8;0011223344556677\n"
    )
    asc = "date Mon\nbase hex  timestamps absolute\n 0.1 1 1A0 Rx"
    for name, content in (("a.log", candump), ("b.csv", css), ("c.asc", asc)):
        (tmp_path / name).write_text(content)
        with pytest.raises(InputError, match=r"raw frames of a bus; decode them by its DBC"):
            read_recording(tmp_path / name)


def test_a_compass_of_sensor_logger_gives_steps_a_direction(tmp_path):
    """Its file was left out, and steps had no direction."""
    ns = ((START_S + TIME_S) * 1e9).astype(np.int64)
    common = {"time": ns, "seconds_elapsed": TIME_S}
    written(tmp_path, common | {"magneticBearing": COURSE_DEG}, "Compass.csv")
    written(tmp_path, common | {"steps": (1.8 * TIME_S).astype(int)}, "Pedometer.csv")
    log = mf.read_log(tmp_path)
    assert log.motion["heading_rad"].notna().all()
    assert log.motion["step_m"].sum() == pytest.approx(0.7 * 214, abs=1)
