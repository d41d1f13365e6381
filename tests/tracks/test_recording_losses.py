"""What of a recording is not used: refused where it misleads, else told in notes of the log."""

import numpy as np
import pandas as pd
import pytest
from made_recordings import MADE

import mapfilter as mf
from mapfilter.angles import azimuth_from_heading_deg
from mapfilter.errors import InputError
from mapfilter.geodesy import unproject
from mapfilter.radio.level_quantity import TENTHS
from mapfilter.tracks.readers.formats import read_recording
from mapfilter.tracks.readers.texts import text

START_UTC_S = 1_777_629_600
COUNT = 200


@pytest.fixture
def walk():
    """A walk along streets to all sides, with counted steps, a compass, positions and levels."""
    heading = np.repeat([0.2, 1.4, 0.5, -1.1, 0.2], COUNT // 5)
    east, north = (np.cumsum(1.4 * way(heading)) for way in (np.cos, np.sin))
    lon, lat = unproject("EPSG:32635", 385_900.0 + east, 6_671_900.0 + north)
    return pd.DataFrame({
        "time": START_UTC_S + np.arange(COUNT),
        "steps": 2 * np.arange(COUNT),
        "compass_deg": azimuth_from_heading_deg(heading).round(1) % 360,
        "mcc": 244, "mnc": 91, "lac": 3021, "ci": 11801,
        "level_dbm": -60 - np.arange(COUNT) % 30,
        "latitude": lat, "longitude": lon,
    })  # fmt: skip


@pytest.fixture
def read(tmp_path):
    """Write a table and read it as a log."""

    def of(table, **options):
        path = tmp_path / "phone.csv"
        table.to_csv(path, index=False)
        return mf.read_log(path, **options)

    return of


@pytest.mark.parametrize(
    ("level", "hint"),
    [
        (lambda dbm: -dbm, "a lost sign (70 for -70 dBm), or ASU"),
        (lambda dbm: -dbm + 20, "a lost sign (70 for -70 dBm))"),
        (lambda dbm: dbm + 111, "raw RXLEV (dBm = RXLEV - 110), ASU"),
        (lambda dbm: (dbm + 113) // 2, "ASU of GSM (dBm = 2 ASU - 113)"),
    ],
    ids=["sign", "sign, weak", "raw", "asu"],
)
def test_a_column_of_levels_in_another_unit_is_refused(level, hint, walk, read):
    with pytest.raises(InputError) as caught:
        read(walk.assign(level_dbm=level(walk["level_dbm"])).rename(columns={"level_dbm": "RSRP"}))
    told = str(caught.value)
    assert "phone.csv, column rsrp (level_dbm): expected dBm in -200..0, found 200 of 200" in told
    assert "in line 2" in told
    assert hint in told


def test_levels_with_a_unit_of_no_level_in_each_field_are_refused(walk, read):
    with pytest.raises(InputError, match=r"numbers, found 200 of 200 .* '-60 dB' .*a unit in"):
        read(walk.assign(level_dbm=[f"{level} dB" for level in walk["level_dbm"]]))
    log = read(walk.assign(level_dbm=[f"{level} dBm" for level in walk["level_dbm"]]))
    assert log.radio["level_dbm"].tolist() == read(walk).radio["level_dbm"].tolist()


@pytest.mark.parametrize("column", ["heading_rad", "turn_rad"])
def test_degrees_in_columns_of_radians_are_refused(column, walk, read):
    moved = walk.drop(columns=["steps", "compass_deg"]).assign(step_m=1.4)
    degrees = 20.0 + np.arange(COUNT)
    with pytest.raises(InputError, match=f"{column}: expected radians .*degrees given for radians"):
        read(moved.assign(**{column: degrees}))


def test_a_few_levels_out_of_range_and_bad_rows_are_notes_of_the_log(walk, read):
    table = walk.astype({"latitude": object, "compass_deg": object})
    table.loc[3, "level_dbm"] = 70
    table.loc[5, "latitude"] = 95.0
    table.loc[9, "compass_deg"] = "north"
    table = pd.concat([table, table.iloc[[20]]]).assign(mood=7)
    notes = read(table).notes
    for told in (
        "phone.csv: not used: 1 row: lat_deg: not degrees in -90..90",
        "phone.csv: radio, level_dbm: 1 value is not dBm in -200..0, ignored (first in line 5)",
        "phone.csv: compass_deg: 1 value is no number, taken as missing",
        "phone.csv: columns not used: mood; see columns",
        "phone.csv: radio: times go backwards in 1 place; sorted",
        "phone.csv: radio: 1 exact duplicate row dropped",
    ):
        assert any(note.startswith(told) for note in notes), told
    assert not any(note.startswith("phone.csv: ") for note in read(walk).notes)


@pytest.mark.parametrize(
    ("factor", "hint"),
    [(1e7, "degrees times 1e6 or 1e7"), (1e5, "metres for degrees"), (100.0, "NMEA")],
)
def test_positions_in_another_unit_are_named(factor, hint, walk, read):
    places = walk[["latitude", "longitude"]] * factor
    notes = read(walk.assign(**places)).notes
    assert any("not used: 200 rows: lat_deg: not degrees" in n and hint in n for n in notes)


def test_names_of_columns_that_resemble_a_field_are_told(walk, tmp_path):
    names = {"steps": "stps", "compass_deg": "compas", "latitude": "compass_rad"}
    walk.rename(columns=names).to_csv(tmp_path / "phone.csv", index=False)
    recording = read_recording(tmp_path / "phone.csv")
    assert recording.unread == (
        "stps (steps?)",
        "compas (compass_deg?)",
        "compass_rad (compass_deg?)",
    )
    assert "steps" not in recording.fields
    assert "level_dbm" in recording.fields


def test_windows_1252_is_read_and_told(walk, tmp_path):
    names = {"time": "Zeit", "latitude": "Breite", "longitude": "Länge"}
    own = {"time": "Zeit", "lat_deg": "Breite", "lon_deg": "Länge"}
    path = tmp_path / "de.csv"
    for encoding in ("cp1252", "utf-8"):
        path.write_bytes(walk.rename(columns=names).to_csv(index=False).encode(encoding))
        log = mf.read_log(path, columns=own)
        assert len(log.gnss) == COUNT
        told = any("no UTF-8 (byte" in n and "read as Windows-1252" in n for n in log.notes)
        assert told == (encoding == "cp1252")
    # A damaged byte makes no other encoding of a text in UTF-8.
    data = walk.rename(columns=names).to_csv(index=False).encode()
    path.write_bytes(data.replace(b"244", b"24\xe4", 1))
    assert any("some bytes are not UTF-8" in n for n in mf.read_log(path, columns=own).notes)


@pytest.mark.parametrize(
    ("text", "hint"),
    [("08:00:02", "a time of day without its date"), ("05/01/2026 08:00:02 AM", "month first?")],
)
def test_times_that_are_none_name_their_row(text, hint, walk, read):
    with pytest.raises(InputError) as caught:
        read(walk.assign(time=text))
    assert "phone.csv row 2, time: expected seconds" in str(caught.value)
    assert hint in str(caught.value)


def test_faults_of_the_joined_log_name_the_file(walk, read):
    table = walk.drop(columns="steps").assign(step_m=1.4 * np.arange(1, COUNT + 1))
    with pytest.raises(InputError, match=r"phone\.csv, motion, step_m: expected metres moved"):
        read(table)


@pytest.mark.parametrize(
    ("lon", "lat", "cause"),
    [
        ("latitude", "longitude", "latitude and longitude swapped"),
        ("-longitude", "latitude", "a lost sign of longitude"),
        ("longitude", "-latitude", "a lost sign of latitude"),
    ],
)
def test_mirrored_positions_are_no_fault_of_the_headings(lon, lat, cause, walk, read):
    assert not any("mirror" in note or "heading_rad" in note for note in read(walk).notes)
    notes = read(walk.assign(longitude=walk.eval(lon), latitude=walk.eval(lat))).notes
    assert any("positions are a mirror image" in note and cause in note for note in notes)
    assert not any("headings run clockwise" in note for note in notes)


def test_mirrored_positions_are_told_by_their_courses(walk, read):
    drive = walk.drop(columns="steps").rename(columns={"compass_deg": "course_deg"})
    assert not any("mirror" in note for note in read(drive).notes)
    swapped = {"latitude": "longitude", "longitude": "latitude"}
    told = "phone.csv: positions are a mirror image of the way by their courses: latitude and long"
    assert any(note.startswith(told) for note in read(drive.rename(columns=swapped)).notes)


def opencellid(change):
    """The made file of OpenCellID with other levels, by row."""
    head, *rows = MADE["opencellid"][1].splitlines()
    at = head.split(",").index("signal")
    lines = [row.split(",") for row in rows]
    for number, line in enumerate(lines):
        line[at] = str(change(number, int(line[at])))
    return "\n".join([head, *(",".join(line) for line in lines)]) + "\n"


@pytest.mark.parametrize(
    ("largest", "likely"), [(-694, True), (-2000, True), (-201, True), (-2001, False)]
)
def test_levels_in_tenths_are_told(tmp_path, largest, likely):
    path = tmp_path / "walk.csv"
    rows = "".join(f"{k},{largest if k else -780},A\n" for k in range(9))
    path.write_text(f"time_s,level_dbm,cell\n{rows}")
    with pytest.raises(InputError, match=r"expected dBm in -200\.\.0") as caught:
        read_recording(path)
    assert str(caught.value).endswith(f"(likely: {TENTHS})") == likely


def test_levels_above_the_largest_asu_have_lost_their_sign(tmp_path):
    path = tmp_path / "upload.csv"
    path.write_text(opencellid(lambda row, dbm: -dbm + 20 * (row % 5 == 0)))
    with pytest.raises(InputError) as caught:
        read_recording(path)
    assert (
        "upload.csv, column signal (level_dbm): expected dBm below 0, or ASU up to 97, found"
        in (str(caught.value))
    )
    assert "likely: a lost sign" in str(caught.value)
    # True ASU, with unknown ones.
    path.write_text(opencellid(lambda row, dbm: dbm + 140 if row % 5 else 99))
    found = read_recording(path)
    assert any("levels given as ASU, turned into dBm" in note for note in found.notes)
    true = read_recording(tmp_path / write(tmp_path, MADE["opencellid"][1]))
    both = found.tables["radio"]["level_dbm"], true.tables["radio"]["level_dbm"]
    assert both[0].isna().sum() == pytest.approx(len(both[0]) / 5, abs=1)
    assert (both[0].dropna() == both[1][both[0].notna()]).all()


def test_identities_that_a_spreadsheet_shortened_are_told(walk, read):
    walk["ci"] = [f"{number:.4E}" for number in 123_456_700 + walk["ci"]]
    told = (
        "ci: 200 values are no numbers, taken as missing (first '1.2347E+08' in line 2; shortened"
    )
    (note,) = [note for note in read(walk).notes if told in note]
    assert note.endswith("shortened by a spreadsheet: show all digits there, and export again)")


def write(folder, text):
    (folder / "true.csv").write_text(text)
    return "true.csv"


def test_what_an_early_part_of_a_large_file_lacks_is_told(walk, read, monkeypatch):
    """Beside dates, notes on it were dropped with the part after it."""
    monkeypatch.setattr(text, "_PART_BYTES", 1 << 11)
    walk["time"] = pd.to_datetime(walk["time"], unit="s", utc=True).dt.strftime("%FT%TZ")
    walk["level_dbm"] = walk["level_dbm"].astype(str)
    walk.loc[3, "level_dbm"] = "-7x"
    walk.loc[150, "lac"] = np.nan
    notes = read(walk).notes
    told = "level_dbm: 1 value is no number, taken as missing (first '-7x' in line 5)"
    assert sum(told in note for note in notes) == 1
    assert not any("time: " in note and "missing" in note for note in notes)


@pytest.mark.parametrize("separator", ["\t", ","])
def test_a_first_column_without_a_name_stays_one_in_parts(walk, tmp_path, monkeypatch, separator):
    """Its tab was taken for a blank before the header, and every row had a field too many."""
    walk.to_csv(tmp_path / "phone.csv", sep=separator)
    whole = read_recording(tmp_path / "phone.csv")
    monkeypatch.setattr(text, "_PART_BYTES", 1 << 11)
    parts = read_recording(tmp_path / "phone.csv")
    assert parts.unusable == whole.unusable == ()
    for table, rows in whole.tables.items():
        assert parts.tables[table].equals(rows), table
