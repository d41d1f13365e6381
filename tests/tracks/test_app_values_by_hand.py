"""Values of apps' files by hand: GPX, Antennas, WiGLE, phyphox, and fixes of GnssLogger."""

import numpy as np
import pytest

from mapfilter.tracks.readers.formats import read_recording

START_S = 1_777_629_600
"""2026-05-01 10:00:00 UTC."""
NAN = np.nan


@pytest.fixture
def read(tmp_path):
    def of(name, *lines):
        (tmp_path / name).write_text("\n".join(lines) + "\n")
        return read_recording(tmp_path / name)

    return of


def gpx(*inner):
    points = [
        f'<trkpt lat="{60 + i / 1e4:.4f}" lon="24.9"><ele>-12.5</ele>'
        f"<time>2026-05-01T10:00:0{i}Z</time>{one}</trkpt>"
        for i, one in enumerate(inner)
    ]
    return ['<gpx version="1.1" creator="Made">', *points, "</gpx>"]


def test_accuracies_of_gpx_are_stated_or_by_the_dilution(read):
    """A dilution of 1 stands for 4 m; speeds are m/s, courses degrees."""
    found = read(
        "a.gpx",
        *gpx(
            "<hdop>0.8</hdop>",
            "<hdop>0.8</hdop><extensions><accuracy>7.5</accuracy></extensions>",
            "<speed>10.5</speed><course>359.5</course>",
            "<extensions><hAcc>2.5</hAcc><bearing>1</bearing></extensions>",
        ),
    ).tables["positions"]
    assert found["accuracy_m"].tolist()[:3] == pytest.approx([3.2, 7.5, NAN], abs=1e-6, nan_ok=True)
    assert found["speed_mps"].tolist()[2] == 10.5
    assert found["course_deg"].tolist()[2] == 359.5
    assert (found["time_s"] - START_S).tolist() == [0, 1, 2, 3]
    assert found["altitude_m"].tolist() == [-12.5] * 4
    assert found["lat_deg"].tolist() == pytest.approx([60, 60.0001, 60.0002, 60.0003], abs=1e-9)


def antennas(stamp, *cells, operator="24491"):
    record = f'Record, Time="{stamp}", Phone Type=GSM, Network Type=EDGE, Operator={operator}'
    return [record, *cells]


@pytest.mark.parametrize(
    ("stamp", "seconds"),
    [
        # Milliseconds are not filled up with zeros.
        ("2026-05-01 13:00:00:5 GMT+03:00", 0.005),
        ("2026-05-01 13:00:00:50 GMT+03:00", 0.05),
        ("2026-05-01 13:00:00:500 GMT+03:00", 0.5),
        ("2026-05-01 15:30:01:000 GMT+05:30", 1.0),
        ("2026-05-01 07:30:01:000 GMT-02:30", 1.0),
    ],
)
def test_milliseconds_of_antennas(read, stamp, seconds):
    cell = "ACTIVE GSM, LAC=1377, CID=36393, Signal= -52dBm"
    found = read("antennas.log", *antennas(stamp, cell)).tables["radio"]
    assert (found["time_s"] - START_S).tolist() == pytest.approx([seconds], abs=1e-6)


def test_cells_of_antennas(read):
    cells = [
        "ACTIVE GSM, LAC=1377, CID=36393, Signal= >-52dBm",
        "GSM, LAC=-1, CID=36392, Signal= -113dBm",
        "GSM, LAC=1377, CID=-1, Signal= -99dBm",
        "ACTIVE LTE, LAC=65535, CID=268435454, Signal= -120dBm",
    ]
    stamp = "2026-05-01 10:00:00:000 GMT+00:00"
    found = read("antennas.log", *antennas(stamp, *cells, operator="310410"))
    rows = found.tables["radio"]
    # -1 is a mark of Android, no bad value.
    assert found.notes == ()
    assert rows["level_dbm"].tolist() == [-52, -113, -99, -120]
    assert rows["censored"].tolist() == [1, 0, 0, 0]
    assert rows["lac"].tolist() == pytest.approx([1377, NAN, 1377, 65_535], abs=1e-6, nan_ok=True)
    assert rows["ci"].tolist() == pytest.approx(
        [36_393, 36_392, NAN, 268_435_454], abs=1e-6, nan_ok=True
    )
    assert rows["role"].tolist() == ["serving", "neighbour", "neighbour", "serving"]
    assert rows["technology"].tolist() == ["GSM", "GSM", "GSM", "LTE"]
    assert set(zip(rows["mcc"], rows["mnc"], strict=True)) == {(310, 410)}


def test_networks_of_wigle(read):
    """MCC and MNC of five or six digits, LAC or TAC, and the cell; 0 dBm was not measured."""
    head = "MAC,SSID,AuthMode,FirstSeen,Channel,RSSI,CurrentLatitude,CurrentLongitude,"
    head += "AltitudeMeters,AccuracyMeters,Type"
    keys = [
        "24491_3021_1170250",
        "310410_0_7",
        "2449_3021_7",
        "3104101_3021_7",
        "24405_1_68719476734",
    ]
    types = ["LTE", "GSM", "LTE", "LTE", "NR"]
    lines = [
        f"{key},Op,LTE,2026-05-01 10:00:0{i},1300,{-90 * (i != 1)},60.{i},24.9,21.5,3.9,{kind}"
        for i, (key, kind) in enumerate(zip(keys, types, strict=True))
    ]
    found = read("a.csv", "WigleWifi-1.4,appRelease=2.26", head, *lines)
    rows = found.tables["radio"]
    assert rows["cell"].tolist() == ["244-91-3021-1170250", "310-410-0-7", "244-5-1-68719476734"]
    assert rows["level_dbm"].tolist() == pytest.approx([-90, NAN, -90], abs=1e-6, nan_ok=True)
    assert [one.lines for one in found.unusable] == [(5, 6)]
    positions = found.tables["positions"]
    assert positions["accuracy_m"].tolist() == [3.9] * 5
    assert positions["altitude_m"].tolist() == [21.5] * 5


def test_sensors_of_phyphox_by_their_units(read):
    rows = [f"{i},1.5,-2.5,{9.8 + i}" for i in range(3)]
    for name, unit, table, field in (
        ("Acceleration", "m/s^2", "accelerometer", "mps2"),
        ("Linear Acceleration", "m/s^2", "linear_acceleration", "mps2"),
        ("Gyroscope", "rad/s", "gyroscope", "radps"),
        ("Magnetic field", "µT", "magnetometer", "ut"),
    ):
        head = "Time (s)," + ",".join(f"{name} {axis} ({unit})" for axis in "xyz")
        found = read("Raw Data.csv", head, *rows)
        assert list(found.tables) == [table]
        axes = [f"{axis}_{field}" for axis in "xyz"]
        assert found.tables[table][axes].to_numpy().tolist() == [
            [1.5, -2.5, 9.8],
            [1.5, -2.5, 10.8],
            [1.5, -2.5, 11.8],
        ]
        assert found.tables[table]["time_s"].tolist() == [0, 1, 2]


def test_times_of_phyphox_go_on_after_a_pause(tmp_path):
    """``meta/time.csv`` has the system's time at each start and pause."""
    (tmp_path / "meta").mkdir()
    (tmp_path / "meta" / "time.csv").write_text(
        '"event","experiment time","system time"\n'
        f'"START",0.0,{START_S}.5\n"PAUSE",2.5,{START_S + 3}.0\n"START",2.5,{START_S + 100}.0\n'
    )
    head = "Time (s)," + ",".join(f"Gyroscope {axis} (rad/s)" for axis in "xyz")
    lines = [f"{second},0.1,0.2,0.3" for second in (0.0, 2.0, 2.5, 3.0)]
    (tmp_path / "Gyroscope.csv").write_text("\n".join([head, *lines]) + "\n")
    found = read_recording(tmp_path / "Gyroscope.csv").tables["gyroscope"]
    assert (found["time_s"] - START_S).tolist() == pytest.approx([0.5, 2.5, 100, 100.5])


def test_fixes_of_gnsslogger(read):
    head = "# Fix,Provider,LatitudeDegrees,LongitudeDegrees,AltitudeMeters,SpeedMps,"
    head += "AccuracyMeters,BearingDegrees,UnixTimeMillis"
    fixes = [f"Fix,GPS,-60.5,-24.25,12.5,2.25,4.5,30.5,{START_S}500"]
    fixes += [f"Fix,NLP,60.5,24.25,,,25.0,,{START_S + 1}000"]
    first, second = read("log.txt", head, *fixes).tables["positions"].to_dict("records")
    assert (first["lat_deg"], first["lon_deg"], first["altitude_m"]) == (-60.5, -24.25, 12.5)
    assert (first["speed_mps"], first["accuracy_m"], first["course_deg"]) == (2.25, 4.5, 30.5)
    assert (first["provider"], first["time_s"]) == ("GPS", START_S + 0.5)
    assert (second["provider"], second["accuracy_m"]) == ("NLP", 25.0)
    assert np.isnan(second["altitude_m"])
    assert np.isnan(second["speed_mps"])
