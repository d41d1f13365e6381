"""Every format on a made recording: found by its content, and read in full."""

import gzip

import pytest
from made_recordings import (
    COUNT,
    LAT_DEG,
    LON_DEG,
    MADE,
    START_UTC_S,
    TIMES_S,
    cell_list,
)

from mapfilter.errors import ConfigError, InputError
from mapfilter.tracks.readers.format import ReadOptions
from mapfilter.tracks.readers.formats import FORMATS, read_recording
from mapfilter.tracks.readers.texts.text import read_text

ROWS = {
    "gnettrack": {"positions": COUNT, "radio": 2 * COUNT},
    "towercollector": {"positions": COUNT, "radio": 2 * COUNT},
    "opencellid": {"positions": COUNT, "radio": COUNT},
    "opencellid/mls": {"positions": COUNT, "radio": COUNT},
    "opencellid-cells": {"cells": COUNT},
    "gpx": {"positions": COUNT},
    "nmea": {"positions": COUNT},
    "gnsslogger": {
        "positions": COUNT + 6,
        "satellites": 2 * COUNT,
        "accelerometer": COUNT,
        "gyroscope": COUNT,
    },
    "rinex-obs": {"satellites": 2 * COUNT},
    "rinex-obs/2": {"satellites": 2 * COUNT},
    "rinex-nav": {"ephemerides": 2},
    "rinex-nav/3": {"ephemerides": 3, "ionosphere": 1},
    "rtklib": {"positions": COUNT},
    "smartloc": {"truth": COUNT, "odometry": COUNT, "satellites": 2 * COUNT},
    "smartloc-raw": {"truth": COUNT, "satellites": 2 * COUNT},
    "indoor": {
        "true_places": 6,
        "radio": 2 * COUNT,
        "accelerometer": COUNT,
        "gyroscope": COUNT,
        "magnetometer": COUNT,
        "orientation": COUNT,
    },
    "phyphox": {"accelerometer": COUNT},
    "sensorlogger": {"accelerometer": COUNT},
    "antennas": {"positions": COUNT, "radio": 2 * COUNT},
    "kitti": {"poses": COUNT},
    "tum": {"poses": COUNT},
    "nemo": {"positions": COUNT, "radio": 2 * COUNT + 50},
    "tems": {"positions": COUNT, "radio": 2 * COUNT},
    "tems/lte": {"positions": COUNT, "radio": 2 * COUNT},
    "wigle": {"positions": COUNT, "radio": 2 * COUNT},
    "can": {"odometry": COUNT},
    "can/asc": {"odometry": COUNT},
    "sensorlog": {
        "positions": COUNT,
        "accelerometer": COUNT,
        "gyroscope": COUNT,
        "magnetometer": COUNT,
        "barometer": COUNT,
        "steps": COUNT,
    },
    "long": {"positions": COUNT, "odometry": COUNT},
    "long/axes": {"accelerometer": COUNT, "gyroscope": COUNT, "barometer": COUNT},
    "csv": {"positions": COUNT, "motion": COUNT, "radio": COUNT, "barometer": COUNT},
}


@pytest.mark.parametrize("name", MADE)
def test_a_format_is_found_and_read_in_full(name, written):
    recording = read_recording(written(name))
    assert recording.format == name.partition("/")[0]
    assert {table: len(rows) for table, rows in recording.tables.items()} == ROWS[name]
    assert recording.unusable == ()
    assert recording.program


@pytest.mark.parametrize("name", MADE)
def test_no_other_format_before_it_claims_a_file(name, written):
    text = read_text(written(name))
    claimed = [known.name for known in FORMATS if known.matches(text)]
    assert claimed[0] == name.partition("/")[0]


def test_every_format_has_a_made_recording():
    assert {known.name for known in FORMATS} == {name.partition("/")[0] for name in MADE}


@pytest.mark.parametrize("name", MADE)
def test_times_are_utc_where_the_clock_is_known(name, written):
    recording = read_recording(written(name), options=ReadOptions(zone="+03:00"))
    if not recording.clock.absolute:
        assert name in ("smartloc", "phyphox", "kitti", "tems/lte", "can/asc")
        return
    for table, rows in recording.tables.items():
        if "time_s" in rows:
            late_s = 18.0 if table == "ephemerides" else 0.0
            assert rows["time_s"].min() + late_s == pytest.approx(START_UTC_S, abs=1.0), table


@pytest.mark.parametrize("name", MADE)
def test_positions_are_those_that_were_written(name, written):
    tables = read_recording(written(name)).tables
    rows = tables.get("positions", tables.get("truth"))
    if rows is None or name == "smartloc":
        return
    if "provider" in rows:
        rows = rows[rows["provider"] != "NLP"]
    assert rows["lat_deg"].to_numpy() == pytest.approx(LAT_DEG, abs=1.1e-5)
    assert rows["lon_deg"].to_numpy() == pytest.approx(LON_DEG, abs=1.1e-5)


@pytest.mark.parametrize("wrap", ["utf-8-sig", "utf-16", "utf-16-le", "utf-16-be"])
@pytest.mark.parametrize("name", MADE)
def test_encodings_change_nothing(name, wrap, written):
    plain = read_recording(written(name))
    other = read_recording(written(name, MADE[name][1].encode(wrap)))
    assert list(other.tables) == list(plain.tables)
    for table, rows in plain.tables.items():
        assert other.tables[table].equals(rows), table


@pytest.mark.parametrize("name", MADE)
def test_gzip_and_line_ends_change_nothing(name, written):
    plain = read_recording(written(name))
    lines = MADE[name][1].splitlines()
    mixed = "".join(line + ("\r\n", "\n", "\r")[i % 3] for i, line in enumerate(lines))
    for data in (gzip.compress(MADE[name][1].encode()), mixed.encode()):
        other = read_recording(written(name, data))
        for table, rows in plain.tables.items():
            assert other.tables[table].equals(rows), table


def test_one_bad_row_loses_nothing_else(written):
    head, *rows = MADE["opencellid"][1].splitlines()
    rows[3] = rows[3].replace("60.170120", "160.170120")
    rows[5] = rows[5].rpartition(",")[0]
    rows[8] = rows[8].replace("60.170320", "sixty")
    recording = read_recording(written("opencellid", "\n".join([head, *rows])))
    assert len(recording.tables["positions"]) == COUNT - 3
    found = {u.reason: (u.count, u.lines) for u in recording.unusable}
    reason = "lat_deg: not degrees in -90..90 (likely: latitude and longitude swapped)"
    assert found[reason] == (1, (5,))
    assert found["lat_deg: missing, or no number"] == (1, (10,))
    assert any("fewer fields" in why and where == (1, (7,)) for why, where in found.items())


def test_times_that_jump_years_are_left_out(written):
    text = MADE["opencellid"][1].replace(f"{int(TIMES_S[4])}000", "946684800000")
    text = text.replace(f"{int(TIMES_S[6])}000", "-5")
    recording = read_recording(written("opencellid", text))
    assert len(recording.tables["positions"]) == COUNT - 2
    reasons = [u.reason for u in recording.unusable]
    assert "time: more than a day away from all other rows" in reasons
    assert "time_s: missing, or no number" in reasons


def test_a_row_with_several_cells_goes_backwards_once(written):
    """Its cells are added one by one: the serving one, then each neighbour."""
    head, *rows = MADE["gnettrack"][1].splitlines()
    rows[10], rows[11] = rows[11], rows[10]
    notes = read_recording(written("gnettrack", "\n".join([head, *rows]))).notes
    assert "radio: times go backwards in 1 place; sorted" in notes


def test_duplicate_epochs_and_times_going_backwards(written):
    head, *rows = MADE["opencellid"][1].splitlines()
    text = "\n".join([head, *rows[:10], rows[9], rows[12], rows[11], rows[10], *rows[13:]])
    recording = read_recording(written("opencellid", text))
    plain = read_recording(written("opencellid"))
    for table, expected in plain.tables.items():
        assert recording.tables[table].equals(expected), table
    assert any("go backwards" in note for note in recording.notes)
    assert any("duplicate" in note for note in recording.notes)


def test_a_file_without_a_usable_row_is_refused_with_the_reasons(written):
    text = MADE["gpx"][1].replace('lat="60.', 'lat="160.')
    with pytest.raises(InputError, match=r"none in 30 rows: 30 rows: .*longitude swapped"):
        read_recording(written("gpx", text))


def test_another_format_is_named(written):
    with pytest.raises(InputError, match="this is a GPX file; use --format gpx"):
        read_recording(written("gpx"), "nmea")
    with pytest.raises(ConfigError, match=r"one of .*gnettrack"):
        read_recording(written("gpx"), "gpxx")


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"", "an empty file"),
        (b"\n \r\n", "an empty file"),
        (b"PK\x03\x04abc", "ZIP archive"),
        (b"\x89PNG\r\n\x1a\n", "PNG"),
        (bytes(range(256)) * 20, "binary"),
        (b"hello\nworld\n", "none of them"),
        (b"lat,lon\n60.1,24.9\n", "without a column of times.* such as time=COLUMN"),
        (b"time,lat,Laenge\n1,60.1,24.9\n", "likely: a CSV with other names of columns: --column"),
        (
            b"cell,lat,lon,azimuth_deg,eirp_dbm\nA,60,24,0,55\n",
            "likely: a list of cells, no journey",
        ),
        (b"Transmitter;X;Y;Height (m);Antenna\nA;1;2;3;a\n", "likely: a list of cells, no journey"),
        (b"lat,lon,azimuth,height\n60,24,9,1\n", "likely: a CSV without a column of times"),
        (gzip.compress(b"", mtime=0), "an empty file"),
    ],
)
def test_what_is_no_recording_is_said(data, said, tmp_path):
    path = tmp_path / "file"
    path.write_bytes(data)
    with pytest.raises(InputError, match=said):
        read_recording(path)
    with pytest.raises(InputError):
        read_recording(tmp_path / "absent")
    with pytest.raises(InputError, match="a folder"):
        read_recording(tmp_path)


def test_times_of_a_measurement_are_found(tmp_path):
    path = tmp_path / "own.csv"
    stamps = [f"2026-05-01T08:00:0{i}Z,60.1{i},24.9" for i in range(5)]
    path.write_text("\n".join(["measured_at,lat,lon", *stamps]))
    assert len(read_recording(path).tables["positions"]) == 5


def test_a_column_map_names_columns(tmp_path):
    path = tmp_path / "own.csv"
    path.write_text("Zeit;Breite;Laenge;Pegel;CGI\n01.05.2026;1;2;3;4\n")
    rows = [f"{int(TIMES_S[i])};{LAT_DEG[i]};{LON_DEG[i]};-80,5;244-91-3021-77" for i in range(5)]
    path.write_text("\n".join(["Zeit;Breite;Laenge;Pegel;CGI", *rows]))
    own = {"time": "Zeit", "lat_deg": "Breite", "lon_deg": "Laenge", "level_dbm": "Pegel"}
    recording = read_recording(path, options=ReadOptions(columns=own))
    assert recording.tables["radio"]["cell"].unique().tolist() == ["244-91-3021-77"]
    assert recording.tables["radio"]["level_dbm"].unique().tolist() == [-80.5]
    with pytest.raises(InputError, match="a column Hoehe for altitude_m"):
        read_recording(path, options=ReadOptions(columns={**own, "altitude_m": "Hoehe"}))
    with pytest.raises(InputError, match="likely: lat_deg"):
        read_recording(path, options=ReadOptions(columns={**own, "lat_dg": "Breite"}))


def test_local_times_take_the_zone(written):
    local = read_recording(written("gnettrack"))
    zoned = read_recording(written("gnettrack"), options=ReadOptions(zone="Europe/Helsinki"))
    assert not local.clock.absolute
    assert zoned.clock.absolute
    difference = local.tables["positions"]["time_s"] - zoned.tables["positions"]["time_s"]
    assert difference.unique().tolist() == [3 * 3600.0]
    with pytest.raises(ConfigError, match="Europe/Brussels"):
        read_recording(written("gnettrack"), options=ReadOptions(zone="Mars/Olympus"))


def test_phyphox_times_come_from_the_file_beside(tmp_path, written):
    path = written("phyphox")
    (tmp_path / "meta").mkdir()
    (tmp_path / "meta" / "time.csv").write_text(
        '"event","experiment time","system time","system time text"\n'
        f'"START",0.0,{START_UTC_S}.5,"x"\n"PAUSE",20.0,{START_UTC_S + 20}.5,"x"\n'
        f'"START",20.0,{START_UTC_S + 100}.5,"x"\n'
    )
    recording = read_recording(path)
    time_s = recording.tables["accelerometer"]["time_s"] - START_UTC_S
    assert recording.clock.kind == "utc"
    assert time_s.iloc[[0, 9, 10, 11]].tolist() == pytest.approx([0.5, 18.5, 100.5, 102.5])


def test_a_cell_list_is_no_journey_but_is_named(tmp_path):
    path = tmp_path / "cells.csv"
    path.write_text(cell_list())
    assert set(read_recording(path).tables) == {"cells"}
