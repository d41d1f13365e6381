"""Reading measurements: every dialect, and bad rows that lose nothing but themselves."""

import math
from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
import pytest
from fuzz import fuzz

from mapfilter.errors import InputError
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.survey.antennas_log import read_antennas_log
from mapfilter.survey.measurement_files import DIALECTS, read_csv
from mapfilter.survey.measurements import named_after
from mapfilter.survey.read_measurements import read_measurements

OPENCELLID = """\
mcc,mnc,lac,cellid,lat,lon,signal,measured_at,rating,speed,direction,act,ta,psc,tac,pci,sid,nid,bid
302,720,29100,8302920,45.4110995,-75.7054742,-73,1599319703000,50.9,0.33,317.3,LTE+,0,,29100,449,,,
302,720,29100,8302920,45.4111200,-75.7054900,-75,1599319709000,12.5,0.33,317.3,LTE+,1,,29100,449,,,
302,720,,8302871,45.4121200,-75.7064900,-91,1599319715000,9.5,1.33,317.3,LTE+,1,,29100,457,,,
302,720,29100,8302871,45.4122200,-75.7065900,49,1599319721000,9.5,1.33,317.3,LTE,1,,29100,457,,,
"""
TOWER_COLLECTOR = """\
mcc,mnc,lac,cell_id,psc,asu,dbm,ta,lat,lon,accuracy,speed,bearing,altitude,measured_at,net_type,\
neighboring,device\r
260,2,39030,55321,-1,14,-85,3,52.2296756,21.0122287,8.5,1.2,90,110,"2020-09-05T11:49:30.250Z",GSM,\
false,"Acme, One"\r
260,2,39030,55322,-1,10,-93,,52.2296756,21.0122287,8.5,1.2,90,110,"2020-09-05T11:49:30.250Z",GSM,\
true,"Acme, One"\r
,,,,200,20,-73,,52.2296756,21.0122287,8.5,1.2,90,110,"2020-09-05T11:49:30.250Z",UMTS,true,"Acme"\r
"""
ANTENNAS = """\
BEGIN,2014-09-24 19:30:37:883 GMT+05:30
Antennas,  Build=0105, API=2

Record, Time="2014-09-24 19:30:40:62 GMT+05:30", Phone Type=GSM, Country=in, Operator=40492
ACTIVE GSM, LAC=1377, CID=3532, Signal= -67dBm
GSM, LAC=1377, CID=3514, PSC=-1, TYP=1, Signal= -77dBm
GSM, LAC=-1, CID=-1, PSC=-1, TYP=1, Signal= -79dBm
Network Location, Provider=N, Lat=19.132124, Lon=72.906728
Best Location, Provider=N, Lat=19.132124, Lon=72.906728

Record, Time="2014-09-24 19:30:43:923 GMT+05:30", Phone Type=GSM, Country=in, Operator=40492
ACTIVE GSM, LAC=1377, CID=3532, Signal= >-52dBm
Best Location, Provider=N, Lat=19.132224, Lon=72.906828
"""
NOON_S = datetime(2014, 9, 24, 14, 0, 40, 62_000, UTC).timestamp()
PLAIN = "cell,lat,lon,level_dbm,time,accuracy_m\n" + "".join(
    f"A,60.17{i:02d},24.94{i:02d},-{70 + i},{1_600_000_000 + 5 * i},10\n" for i in range(20)
)


def write(folder, text, name="drive.csv"):
    path = folder / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def refused(path, **kwargs):
    with pytest.raises(InputError) as error:
        read_measurements([path], **kwargs)
    return str(error.value)


def test_opencellid_upload(tmp_path):
    found = read_measurements([write(tmp_path, OPENCELLID)])
    assert found.crs == "EPSG:32618"
    assert found.cell_ids == ("302-720-29100-8302871", "302-720-29100-8302920")
    assert found.identities["302-720-29100-8302871"] == (302, 720, 29100, 8302871)
    np.testing.assert_array_equal(found.level_dbm, [-73, -75, -91, 49 - 140])
    np.testing.assert_array_equal(found.cell, [1, 1, 0, 0])
    np.testing.assert_allclose(np.diff(found.time_s), 6)
    assert found.time_s[0] == 1599319703
    assert found.accuracy_m[0] == 50.9
    assert found.notes == ("drive.csv: 1 level given as ASU (turned into dBm)",)
    assert len(found.accurate(50.0)) == 3


def test_tower_collector_export(tmp_path):
    found = read_measurements([write(tmp_path, TOWER_COLLECTOR)])
    assert found.cell_ids == ("260-2-39030-55321", "260-2-39030-55322")
    np.testing.assert_array_equal(found.level_dbm, [-85, -93])
    assert found.time_s[0] == pytest.approx(1599306570.25, abs=1e-6)
    assert found.notes == ("drive.csv: 1 row of cells without identity",)


def test_antennas_log(tmp_path):
    found = read_measurements([write(tmp_path, ANTENNAS, "walk.log")])
    assert found.cell_ids == ("404-92-1377-3514", "404-92-1377-3532")
    np.testing.assert_array_equal(found.level_dbm, [-67, -77])
    assert found.time_s[0] == pytest.approx(NOON_S, abs=1e-6)
    assert set(found.notes) == {
        "walk.log: 1 row of cells without identity",
        "walk.log: 1 level given only as bounds (>)",
    }


def test_a_log_without_its_last_position_refuses_only_that_record(tmp_path):
    cut = ANTENNAS[: ANTENNAS.rindex("Best Location")]
    found = read_measurements([write(tmp_path, cut, "walk.log")])
    assert len(found) == 2
    assert any("1 of 4 rows left out: " in n and "Best Location" in n for n in found.notes)


def test_column_map_semicolons_and_decimal_commas(tmp_path):
    text = "Zeit;Breite;Laenge;RSRP;Zelle;Fahrt\n" + "".join(
        f"2024-05-0{d}T10:00:0{s};50,11{s};8,68{s};-8{s},5;Z1;Tag {d}\n"
        for d in (1, 2)
        for s in range(3)
    )
    columns = {
        "lat": "Breite",
        "lon": "Laenge",
        "level_dbm": "RSRP",
        "cell": "Zelle",
        "time": "Zeit",
        "session": "Fahrt",
    }
    found = read_measurements([write(tmp_path, text)], columns=columns)
    np.testing.assert_array_equal(found.level_dbm, [-80.5, -81.5, -82.5] * 2)
    assert len(found.sessions) == 2
    np.testing.assert_array_equal(found.session, [0, 0, 0, 1, 1, 1])


@pytest.mark.parametrize(
    ("row", "told"),
    [
        ("A,60.1,24.9,-70,1600000000", "fields: expected 6, found 5 (likely: a line cut off)"),
        ("A,60.1,24.9,-70,1600000000,10,7", "found 7 (likely: a separator in a field)"),
        ("A,sixty,24.9,-70,,", "lat: expected a number, found 'sixty'"),
        ("A,60.1,,-70,,", "lon: expected a number, found nothing"),
        ("A,60.1,24.9,nan,,", "level_dbm: expected a number"),
        ("A,60.1,24.9,1e999,,", "level_dbm: expected a number"),
        ("A,60.1,24.9,31,,", "(likely: RXLEV or ASU given for dBm)"),
        ("A,60.1,24.9,2147483647,,", "the marker of a level that was not available"),
        ("A,60.1,24.9,-400,,", "level_dbm: expected dBm in -170..-10"),
        ("A,124.9,60.1,-70,,", "(likely: longitude and latitude swapped)"),
        ("A,6673000,385000,-70,,", "(likely: metres given for degrees)"),
        ("A,0,0,-70,,", "(likely: no fix yet)"),
        ("../x,60.1,24.9,-70,,", "row 12, cell: expected an id"),
        ('"A,60.1,24.9,-70,,', "fields: expected 6, found 1"),
        ("x" * 70_000, "line: expected at most 65536 characters"),
        ("A,60.1\0,24.9,-70,,", "lat: expected a number"),
        ("A,60.1\udcff,24.9,-70,,", "lat: expected a number"),
    ],
)
def test_one_bad_row_is_counted_located_told_and_loses_nothing_else(tmp_path, row, told):
    lines = PLAIN.splitlines()
    lines.insert(11, row)
    text = "\n".join(lines).encode(errors="surrogateescape")
    found = read_measurements([write(tmp_path, text)])
    assert len(found) == 20
    (note,) = found.notes
    assert note.startswith("drive.csv: 1 of 21 rows left out: ")
    assert "row 12, " in note
    assert told in note


def test_a_bad_time_or_accuracy_costs_only_itself(tmp_path):
    text = PLAIN + "A,60.18,24.95,-80,yesterday,10\nA,60.181,24.951,-81,-5,wide\n"
    found = read_measurements([write(tmp_path, text)])
    assert len(found) == 22
    assert np.isnan(found.time_s[-2:]).all()
    assert math.isnan(found.accuracy_m[-1])
    (note,) = found.notes
    assert note.startswith(
        "drive.csv: 2 times not understood (levels kept), such as 'yesterday' in"
    )
    assert "expected ISO 8601" in note


def test_one_odd_time_in_each_of_many_files_is_told_with_an_example(tmp_path):
    text = "cell,lat,lon,level_dbm,time\nA,60.18,24.95,-80,yesterday\n"
    files = [tmp_path / f"drive-{number}.csv" for number in range(4)]
    for number, file in enumerate(files):
        file.write_text(text.replace("60.18", f"60.18{number}"))
    (note,) = read_measurements(files).notes
    assert note.startswith("4 times not understood (levels kept) in 4 files (drive-0.csv")
    assert "such as 'yesterday' in line 2; expected ISO 8601" in note


def test_repetitions_are_left_out_and_told(tmp_path):
    lines = PLAIN.splitlines(keepends=True)
    found = read_measurements([write(tmp_path, "".join([*lines, lines[3], lines[3]]))])
    assert len(found) == 20
    assert found.notes == ("2 rows left out: given twice",)


def test_equal_rows_without_a_time_are_two_readings(tmp_path):
    text = "cell,lat,lon,level_dbm\n" + "A,60.17,24.94,-70\n" * 3
    assert len(read_measurements([write(tmp_path, text)])) == 3


def test_the_only_cell_of_its_time_serves_however_often_it_is_given(tmp_path):
    once = PLAIN.splitlines(keepends=True)
    second = once[2].replace("-71", "-75")
    neighbour = once[3].replace("A,", "B,").replace("-72", "-90")
    path = write(tmp_path, "".join([*once, second, *once[1:4], neighbour]))
    found = read_measurements([path])
    assert found.notes == ("3 rows left out: given twice",)
    at = found.time_s - found.time_s[0]
    np.testing.assert_array_equal(found.serving, at != 10)
    assert ((at == 5).sum(), (at == 10).sum()) == (2, 2)


def test_files_gaps_and_folders_make_sessions(tmp_path):
    late = PLAIN + "A,60.18,24.95,-80,1600009000,10\n"
    write(tmp_path, late, "a.csv")
    write(tmp_path, PLAIN, "b.csv")
    write(tmp_path, "no measurements", "LICENSE.txt")
    found = read_measurements([tmp_path])
    assert found.sessions == ("a#1", "a#2", "b")
    np.testing.assert_array_equal(np.bincount(found.session), [20, 1, 20])
    joined = read_measurements([tmp_path], session_gap_s=1e5)
    assert joined.sessions == ("a", "b")


def test_a_track_log_in_a_folder_is_passed_over(tmp_path):
    write(tmp_path, PLAIN)
    (tmp_path / "walk").mkdir()
    write(tmp_path / "walk", "{}", "log.json")
    assert len(read_measurements([tmp_path])) == 20


def test_files_without_any_good_row_are_refused_together(tmp_path):
    asu = write(tmp_path, "cell,lat,lon,level_dbm\nA,60.1,24.9,20\nA,60.1,24.9,21\n", "asu.csv")
    nothing = write(tmp_path, "cell,lat,lon,level_dbm\n", "nothing.csv")
    with pytest.raises(InputError) as error:
        read_measurements([asu, nothing, tmp_path / "absent.csv"])
    text = str(error.value)
    assert f"{asu} row 2, level_dbm" in text
    assert f"{asu} row 3, level_dbm" in text
    assert "RXLEV or ASU given for dBm" in text
    assert f"{nothing}: expected at least one level with cell and position, found 0 rows" in text
    assert "absent.csv: expected a readable file" in text


@pytest.mark.parametrize(
    "text",
    [
        "Drives of May, by car: level, rsrp and cell of each second.\n\nThe phone lay on it.\n",
        "",
        "time,driver,remark\n2024-05-01,AB,rain\n",
        PLAIN.splitlines(keepends=True)[0],
    ],
)
def test_other_texts_of_a_folder_are_named_and_left_out(tmp_path, text):
    """One such file stopped the read of all."""
    write(tmp_path, PLAIN)
    stray = write(tmp_path, text, "remarks.csv")
    found = read_measurements([tmp_path])
    assert len(found) == 20
    assert found.notes == ("1 file without a drive test left out: remarks.csv",)
    assert "remarks.csv" in refused(stray)
    (tmp_path / "drive.csv").unlink()
    assert "remarks.csv" in refused(tmp_path)


@pytest.mark.parametrize(
    "text",
    [
        PLAIN.replace("level_dbm", "strength"),
        PLAIN.replace(PLAIN.splitlines()[0], "Zelle,Breite,L\u00e4nge,Pegel,Zeit,Fehler"),
        PLAIN.replace(PLAIN.splitlines()[0], "serving,gps_lat,gps_lon,lte_rsrp,time,fix"),
        "Drive of Monday\n" + PLAIN,
        PLAIN.replace(",-", ","),
        PLAIN.encode("utf-16"),
        ANTENNAS[: ANTENNAS.index("Best")],
    ],
)
def test_drive_tests_with_faults_are_not_left_out(tmp_path, text):
    write(tmp_path, PLAIN)
    write(tmp_path, text, "other.csv")
    assert "other.csv" in refused(tmp_path)


def test_headers_that_do_not_fit_say_which_column_is_meant(tmp_path):
    path = write(tmp_path, "cell,lat,lng,rsrp_dbm\nA,60.1,24.9,-70\n")
    text = refused(path)
    assert "header: expected a column lon, found none" in text
    assert "header: expected a column level_dbm, found none" in text
    text = refused(path, columns={"lon": "lng", "level_dbm": "rsrp", "session": "drive"})
    assert "expected a column rsrp for level_dbm, found none (likely: rsrp_dbm meant)" in text
    assert "expected a column drive for session" in text
    assert text.count("for level_dbm") == 1
    text = refused(path, format="opencellid")
    for column in ("mcc", "cellid", "signal"):
        assert f"expected a column {column}" in text
    stray = write(tmp_path, "device;serial;battery\nP7;123;98\n", "devices.csv")
    assert "meant" not in refused(stray, columns={"lat": "latitude"})
    twice = write(tmp_path, "cell,lat,lon,lon,level_dbm\nA,60.1,24.9,24.9,-70\n", "twice.csv")
    assert "expected one column lon, found 2" in refused(twice)


@pytest.mark.parametrize(
    ("data", "told"),
    [
        (b"", "an empty file"),
        (b"\n \n", "a header line and rows"),
        ("cell,lat".encode("utf-16"), "UTF-16"),
        (b"\x1f\x8b\x08", "gzip"),
        (b"\x89PNG\r\n\x1a\n" + bytes(range(256)) * 30, "a column lat"),
        (b"x" * 200_000, "a header line and rows"),
    ],
)
def test_files_that_are_no_measurements(tmp_path, data, told):
    assert told in refused(write(tmp_path, data))


def test_folders_without_measurements_and_no_files_at_all(tmp_path):
    with pytest.raises(InputError, match=r"files \.csv, \.log, \.tsv"):
        read_measurements([tmp_path])
    with pytest.raises(InputError, match="at least one file"):
        read_measurements([])


def test_places_that_a_crs_does_not_have_are_left_out(tmp_path):
    text = PLAIN + "A,-89.999999,-65,-70,1600001000,10\n"
    found = read_measurements([write(tmp_path, text)], "EPSG:3857")
    assert np.isfinite(found.north_m).all()


def test_identity_gives_cells_the_names_of_the_plan(tmp_path):
    found = read_measurements([write(tmp_path, OPENCELLID)])
    known = Cell(
        "West 1",
        "W",
        444_800.0,
        5_029_000.0,
        30.0,
        None,
        50.0,
        1800.0,
        "omni",
        mcc=302,
        mnc=720,
        lac=29100,
        ci=8302920,
    )
    named = named_after(found, CellPlan(found.crs, (known,)))
    assert named.cell_ids == ("302-720-29100-8302871", "West 1")
    assert [named.cell_ids[i] for i in named.cell] == [
        {"302-720-29100-8302920": "West 1"}.get(found.cell_ids[i], found.cell_ids[i])
        for i in found.cell
    ]
    assert named.identities["West 1"] == (302, 720, 29100, 8302920)


@pytest.mark.parametrize(
    "parts",
    [
        {"lac": 7, "technology": "LTE"},
        {"lac": None},
        {"mcc": None, "mnc": None},
        {"id": "302-720-29100-8302920", "mcc": None, "mnc": None, "lac": None, "ci": None},
    ],
)
def test_measured_cells_are_named_as_those_of_logs_are(tmp_path, parts):
    found = read_measurements([write(tmp_path, OPENCELLID)])
    found = replace(found, technologies=dict.fromkeys(found.cell_ids, "LTE"))
    cell = Cell("West 1", "W", 444_800.0, 5_029_000.0, 30.0, None, 50.0, 1800.0, "omni")
    whole = {"mcc": 302, "mnc": 720, "lac": 29100, "ci": 8302920}
    cell = replace(cell, **{**whole, **parts})
    assert cell.id in named_after(found, CellPlan(found.crs, (cell,))).cell_ids
    # A cell of another network is another one.
    other = replace(cell, id="West 2", **{**whole, "mnc": 610})
    named = named_after(found, CellPlan(found.crs, (other,)))
    assert named.cell_ids == found.cell_ids


@pytest.mark.parametrize(
    ("sample", "read"),
    [
        (OPENCELLID, lambda path: read_csv(path, DIALECTS["opencellid"]).columns[3]),
        (TOWER_COLLECTOR, lambda path: read_csv(path, DIALECTS["towercollector"]).columns[3]),
        (PLAIN, lambda path: read_csv(path, DIALECTS["csv"]).columns[3]),
        (ANTENNAS, lambda path: read_antennas_log(path).columns[3]),
        (OPENCELLID, lambda path: read_measurements([path]).level_dbm),
    ],
    ids=["opencellid", "towercollector", "csv", "antennas", "auto"],
)
def test_mutated_files_are_read_or_refused(tmp_path, mutation_count, sample, read):
    path = tmp_path / "mutated.csv"

    def feed(data):
        path.write_bytes(data)
        levels = read(path)
        assert np.isfinite(levels).all()
        assert np.all((levels <= -10) & (levels >= -170))

    tally = fuzz(sample.encode(), feed, mutation_count)
    assert tally.read > mutation_count / 10


def test_positive_levels_above_the_largest_asu_have_lost_their_sign(tmp_path):
    head, *rows = OPENCELLID.splitlines()
    level = head.split(",").index("signal")

    def upload(levels):
        lines = [row.split(",") for row in rows]
        for line, value in zip(lines, levels, strict=True):
            line[level] = value
        path = tmp_path / "upload.csv"
        path.write_text("\n".join([head, *map(",".join, lines)]) + "\n")
        return read_measurements([path])

    with pytest.raises(InputError) as caught:
        upload(["73", "75", "108", "91"])
    told = "column signal: expected dBm below 0, or ASU up to 97, found 4 of 4 positive, 1 of them "
    assert f"{told}above 97 (first 108 in line 4)" in str(caught.value)
    assert "a lost sign (70 for -70 dBm)" in str(caught.value)
    # 99 and 255 are units of an unknown level; one odd level among dBm costs its row only.
    assert len(upload(["73", "75", "99", "255"])) == 2
    assert len(upload(["-73", "-75", "108", "-91"])) == 3


def test_a_survey_in_windows_1252_can_be_mapped(tmp_path):
    path = tmp_path / "messung.csv"
    text = PLAIN.replace("lat,lon", "Breite,Länge", 1)
    path.write_bytes(text.encode("cp1252"))
    found = read_measurements([path], columns={"lat": "Breite", "lon": "Länge"})
    assert len(found) == 20
    assert found.notes == ("messung.csv: no UTF-8; read as Windows-1252",)


@pytest.mark.parametrize("rows_before", [0, 5000])
@pytest.mark.parametrize("encoding", ["utf-8", "cp1252"])
def test_cells_of_a_survey_keep_their_letters_in_windows_1252(encoding, rows_before, tmp_path):
    path = tmp_path / "messung.csv"
    names = ["A"] * rows_before + ["Köln_1", "Île-2", "A"] * 20
    rows = (f"60.1{n:04d},24.94,-80,{name},{1_700_000_000 + n}\n" for n, name in enumerate(names))
    path.write_bytes(("lat,lon,level_dbm,cell,time\n" + "".join(rows)).encode(encoding))
    found = read_measurements([path])
    assert {*found.cell_ids} == {"A", "Köln_1", "Île-2"}
    noted = "messung.csv: no UTF-8; read as Windows-1252"
    assert (noted in found.notes) == (encoding == "cp1252")


@pytest.mark.parametrize(("family", "levels"), [("LTE", range(20, 60)), ("NR", range(58, 98))])
def test_a_few_values_above_the_largest_asu_lose_their_rows_only(family, levels, tmp_path):
    head = "mcc,mnc,lac,cellid,lat,lon,signal,measured_at,rating,act,ta"
    strays = [127] if family == "LTE" else [100, 110, 120]
    rows = [
        f"302,720,29100,8302920,45.411,-75.705,{level},15993197{at:02d}000,9,{family},0"
        for at, level in enumerate([*levels, *strays])
    ]
    path = tmp_path / "upload.csv"
    path.write_text("\n".join([head, *rows]) + "\n")
    found = read_measurements([path])
    assert sorted(found.level_dbm) == [level - 140.0 for level in levels]
    assert any(f"{len(strays)} of {len(rows)} rows left out" in note for note in found.notes)


def test_days_with_dots_are_read(tmp_path):
    text = PLAIN + "A,60.18,24.95,-80,27.11.2026 10:00:05,10\nA,60.181,24.951,-81,27.11.2026,9\n"
    found = read_measurements([write(tmp_path, text)])
    assert found.time_s[-2] == datetime(2026, 11, 27, 10, 0, 5, tzinfo=UTC).timestamp()
    # A day alone is no time.
    assert np.isnan(found.time_s[-1])
    (note,) = found.notes
    assert "1 time not understood (levels kept), such as '27.11.2026' in" in note
    assert "31.12.2026 10:00:00" in note


def qualities(column):
    rows = [f"A,60.1{i:02d},24.9,{-3.5 - i / 2},," for i in range(20)]
    return "\n".join([f"cell,lat,lon,{column},time,accuracy_m", *rows])


def test_qualities_are_no_levels(tmp_path):
    """RSRQ was taken for RSRP: levels of -3 to -13 dBm everywhere."""
    path = write(tmp_path, qualities("rsrq"))
    told = (
        r"column rsrq: expected levels in dBm, such as RSRP in -140..-44 or RxLev in -110..-47, "
        r"found 20 of 20 values from -13 to -3.5 \(likely: a quality in dB, such as RSRQ"
    )
    with pytest.raises(InputError, match=told):
        read_measurements([path], columns={"level_dbm": "rsrq"})


@pytest.mark.parametrize(
    ("column", "told"),
    [
        ("RSRQ [dB]", r"expected dBm for level_dbm, found dB in rsrq \[db\] \(likely: a quality"),
        ("RSSI [dBuV]", r"expected dBm for level_dbm, found dbuv in"),
    ],
)
def test_units_of_levels_are_looked_at(tmp_path, column, told):
    path = write(tmp_path, qualities(column))
    with pytest.raises(InputError, match=f"(?i){told}"):
        read_measurements([path], columns={"level_dbm": column})


def test_strong_levels_are_levels(tmp_path):
    """A scanner beside an antenna."""
    rows = [f"A,60.1{i:02d},24.9,{-20 - 2 * i},," for i in range(30)]
    text = "\n".join(["cell,lat,lon,RSRP [dBm],time,accuracy_m", *rows])
    columns = {"level_dbm": "RSRP [dBm]"}
    assert len(read_measurements([write(tmp_path, text)], columns=columns)) == 30


def test_the_zone_of_a_drive_across_180_degrees_is_of_one_side(tmp_path):
    """The middle of 179.99 and -179.99 was 0: zone 31, on the other side of the earth."""
    rows = [f"A,-17.0,{lon},-80" for lon in (179.97, 179.98, 179.99, -179.99, -179.98, -179.97)]
    file = write(tmp_path, "cell,lat,lon,level_dbm\n" + "\n".join(rows) + "\n")
    found = read_measurements([file])
    assert found.crs in ("EPSG:32760", "EPSG:32701")
    assert np.ptp(found.east_m) == pytest.approx(6390, rel=0.01)
