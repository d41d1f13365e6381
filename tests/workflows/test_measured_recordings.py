"""Recordings of other programs as measurements of a survey."""

import zipfile

import numpy as np
import pytest
from command_line import assert_done, assert_refused, mapfilter
from made_recordings import COUNT, LEVEL_DBM, MADE

from mapfilter.errors import InputError
from mapfilter.geodesy import project
from mapfilter.survey.measurement_rows import most_frequent
from mapfilter.survey.read_measurements import read_measurements
from mapfilter.tracks.open_options import CombineOptions, OpenOptions
from mapfilter.workflows.convert import run_convert
from mapfilter.workflows.inputs.measured import recorded_rows

UTM = OpenOptions(combine=CombineOptions(crs="EPSG:32635"))


@pytest.fixture
def made(tmp_path):
    def write(name, text=None):
        path = tmp_path / MADE[name][0]
        path.write_text(MADE[name][1] if text is None else text)
        return path

    return write


def read(*paths):
    return read_measurements(paths, "EPSG:32635", recorded=recorded_rows)


def test_a_drive_test_of_gnettrack(made):
    found = read(made("gnettrack"))
    assert found.cell_ids == ("244-91-2124-102764173",)
    assert found.identities == {"244-91-2124-102764173": (244, 91, 2124, 102764173)}
    assert found.technologies == {"244-91-2124-102764173": "LTE"}
    assert found.level_dbm.tolist() == np.asarray(LEVEL_DBM, dtype=float).tolist()
    assert len(np.unique(found.session)) == 1
    assert any(f"{COUNT} levels of cells without identity" in note for note in found.notes)


def test_both_readers_give_the_same_measurements(made):
    path = made("towercollector")
    own = read_measurements([path], "EPSG:32635")
    rows = recorded_rows(path)
    ids = list(rows.cells)
    assert set(ids) == set(own.cell_ids)
    order = np.argsort(rows.columns[0], kind="stable")
    for mine, theirs in zip(
        rows.columns[[0, 3, 4]], (own.time_s, own.level_dbm, own.accuracy_m), strict=True
    ):
        assert np.allclose(mine[order], theirs[np.argsort(own.time_s, kind="stable")])
    assert [ids[i] for i in rows.cell] == [own.cell_ids[i] for i in own.cell]


def test_columns_of_other_names_without_a_technology(tmp_path):
    path = tmp_path / "mini.csv"
    rows = [f"{1_777_629_600 + k},60.17,24.94,S1A,{-80 - k}" for k in range(4)]
    path.write_text("\n".join(["time,Latitude,Longitude,Cell,RSRP", *rows]))
    found = read(path)
    assert (found.cell_ids, found.technologies) == (("S1A",), {})
    assert found.level_dbm.tolist() == [-80.0, -81.0, -82.0, -83.0]


def test_levels_lie_between_the_positions_before_and_after(made):
    text = (
        "time,lat,lon,mcc,mnc,lac,ci,rsrp,technology\n"
        "1777629600,60.17,24.94,,,,,,\n"
        "1777629601,,,244,91,1,7,-80,LTE\n"
        "1777629604,60.18,24.94,,,,,,\n"
        "1777629610,,,244,91,1,7,-90,LTE\n"
        "1777629620,60.18,24.95,,,,,,\n"
        "1777629630,,,244,91,1,7,-95,LTE\n"
    )
    rows = recorded_rows(made("csv", text))
    assert rows.columns[1] == pytest.approx([60.1725])
    assert rows.columns[3].tolist() == [-80.0]
    assert rows.aside["levels without a position within 10 s"] == 2


def test_a_track_log_is_measured_as_its_recording(made, tmp_path):
    """By hand from the recording: levels at their own times, and where the fixes are."""
    path = made("towercollector")
    run_convert([path], tmp_path / "logs" / "one", UTM)
    whole = read(path)
    for given in (tmp_path / "logs" / "one", tmp_path / "logs"):
        found = read(given)
        assert found.cell_ids == whole.cell_ids
        assert found.identities == whole.identities
        for mine, theirs in (
            (found.east_m, whole.east_m),
            (found.north_m, whole.north_m),
            (found.level_dbm, whole.level_dbm),
            (found.time_s, whole.time_s),
        ):
            order, other = (
                np.lexsort((found.cell, found.time_s)),
                np.lexsort((whole.cell, whole.time_s)),
            )
            assert np.allclose(mine[order], theirs[other], atol=1e-3)
    config = tmp_path / "survey.toml"
    config.write_text(
        '[area]\nmap = "none"\n[prediction]\nmodel = "survey"\n'
        '[prediction.survey]\nfiles = ["logs"]\n[roads.tracks]\nfiles = ["logs"]\n'
    )
    assert mapfilter("check", "-c", config).code == 0


def test_a_log_in_metres_of_its_own_has_to_be_placed(made, tmp_path):
    path = made("indoor")
    told = r"with --origin LAT,LON, and name the log"
    with pytest.raises(InputError, match=told):
        read(path)
    run_convert([path], tmp_path / "log")
    with pytest.raises(InputError, match="log, crs: expected a CRS, found a local frame"):
        read(tmp_path / "log")
    placed = OpenOptions(combine=CombineOptions(origin_deg=(60.17, 24.94)))
    run_convert([path], tmp_path / "placed", placed)
    found = read(tmp_path / "placed")
    # The first waypoint is 100 m east and 50 m north of the origin.
    east_m, north_m = project("EPSG:32635", [24.94 + 100 / 55_400], [60.17 + 50 / 111_400])
    assert np.hypot(found.east_m[0] - east_m, found.north_m[0] - north_m) < 5
    run_convert([made("kitti")], tmp_path / "drive")
    with pytest.raises(InputError, match=r"a local frame|found a log of motion"):
        read(tmp_path / "drive")


def test_files_without_cells_or_positions_are_told(made, tmp_path):
    with pytest.raises(InputError, match="levels of cells, and positions, found a GPX"):
        read(made("gpx"))
    other = tmp_path / "other.txt"
    other.write_text("nothing that anybody knows\n")
    assert recorded_rows(other) is None
    with pytest.raises(InputError, match=r"other\.txt"):
        read(other)


def test_recordings_without_cells_of_a_folder_are_left_out(made, tmp_path):
    made("gnettrack")
    alone = read(tmp_path)
    stray = made("gpx").rename(tmp_path / "watch.txt")
    run_convert([stray], tmp_path / "track", UTM)
    found = read(tmp_path)
    assert len(found) == len(alone)
    assert found.notes[0] == "2 files without a drive test left out: track, watch.txt"


UNKNOWN_LEVEL = "time,lat_deg,lon_deg,cell_name,rx_dbm\n" + "".join(
    f"2026-05-01T10:00:{second:02d}Z,60.1,24.9{second},A,-70\n" for second in range(20)
)


@pytest.mark.parametrize("text", [MADE["indoor"][1], UNKNOWN_LEVEL])
def test_recorded_drives_with_a_fault_are_not_left_out(made, tmp_path, text):
    """Levels without positions, and in a column that is not known."""
    made("gnettrack")
    (tmp_path / "other.csv").write_text(text)
    with pytest.raises(InputError, match=r"other\.csv"):
        read(tmp_path)


def test_a_map_of_a_recorded_drive(made, tmp_path):
    made("gnettrack")
    config = tmp_path / "survey.toml"
    config.write_text(
        '[area]\nmap = "none"\n[prediction]\nmodel = "survey"\n[prediction.survey]\n'
        'files = ["walk.txt"]\ncross_validate = false\n[output]\ndir = "out"\npictures = "none"\n'
    )
    done = assert_done(mapfilter("predict", "-c", config, "--json")).json
    assert done["cells"] == 1
    assert done["measurements"] == COUNT
    (tmp_path / "walk.txt").write_text(MADE["gpx"][1])
    assert_refused(mapfilter("predict", "-c", config), "walk.txt: expected levels of cells")


def test_a_column_of_cells_of_another_name_is_named_as_the_mistake(tmp_path):
    path = tmp_path / "drive.csv"
    path.write_text("Timestamp,Latitude,Longitude,CellName,RSRP\n" + "".join(
        f"{1_700_000_000 + n},60.17{n:02},24.94,A,-8{n % 10}\n" for n in range(20)
    ))  # fmt: skip
    with pytest.raises(
        InputError, match=r"20 levels of cells without identity .*survey\.columns\.cell"
    ):
        read(path)
    columns = {"cell": "CellName", "lat": "Latitude", "lon": "Longitude", "level_dbm": "RSRP"}
    assert read_measurements([path], "EPSG:32635", columns=columns).cell_ids == ("A",)


def coded(made, *neighbours):
    """Return the rows of a drive that is served by 7 and 8, with neighbours of a place and code."""
    served = [
        *(f"{1777629600 + k},{60.17 + k * 1e-4},24.94,244,91,1,7,-80,1300,101" for k in range(5)),
        *(f"{1777629605 + k},60.171,24.94,244,91,1,8,-82,1300,102" for k in range(5)),
    ]
    others = [f"{1777629610 + k},{at},,,,,-95,{code}" for k, (at, code) in enumerate(neighbours)]
    header = "time,lat,lon,mcc,mnc,lac,eci,rsrp,earfcn,pci"
    return recorded_rows(made("csv", "\n".join([header, *served, *others]) + "\n"))


def test_neighbours_have_the_cell_that_their_carrier_and_code_have_elsewhere_in_the_file(made):
    rows = coded(
        made,
        ("60.171,24.94", "1300,101"),
        # Within 2 km of where 7 serves, 60.17 to 60.1704, and beyond; to the east, too.
        ("60.1883,24.94", "1300,101"),
        ("60.1885,24.94", "1300,101"),
        ("60.1521,24.94", "1300,101"),
        ("60.1519,24.94", "1300,101"),
        ("60.171,24.976", "1300,101"),
        ("60.171,24.977", "1300,101"),
        # Of another carrier, or of no known code, or without a carrier.
        ("60.171,24.94", "1301,101"),
        ("60.171,24.94", "1300,103"),
        ("60.171,24.94", ",101"),
    )
    ids = list(rows.cells)
    named = [
        ids[cell] for cell, serving in zip(rows.cell, rows.columns[6], strict=True) if not serving
    ]
    assert named == ["244-91-1-7"] * 4
    assert rows.remarks == ["4 neighbours named by carrier and code"]
    assert rows.aside["levels of cells without identity"] == 6
    codes = {"244-91-1-7": (1300, 101), "244-91-1-8": (1300, 102)}
    assert most_frequent([rows.codes]) == codes
    assert most_frequent([rows.technologies]) == dict.fromkeys(ids, "LTE")


def test_a_code_of_two_cells_names_none(made):
    text = "time,lat,lon,mcc,mnc,lac,eci,rsrp,earfcn,pci\n" + "".join(
        f"{1777629600 + k},60.17,24.94,244,91,1,{7 + k % 2},-80,1300,101\n" for k in range(6)
    )
    rows = recorded_rows(made("csv", text + "1777629610,60.17,24.94,,,,,-95,1300,101\n"))
    assert rows.aside["levels of cells without identity"] == 1
    assert rows.remarks == []


def test_own_formats_state_carriers_and_codes(tmp_path):
    path = tmp_path / "own.csv"
    head = "time,lat,lon,mcc,mnc,lac,ci,level_dbm,earfcn,pci\n"
    path.write_text(head + "1777629600,60.17,24.94,244,91,1,7,-80,1300,101\n"
                    "1777629601,60.17,24.94,244,91,1,8,-80,1300,\n")  # fmt: skip
    found = read(path)
    assert found.codes == {"244-91-1-7": (1300, 101)}
    assert found.technologies == dict.fromkeys(found.cell_ids, "LTE")
    path.write_text(
        head.replace("earfcn", "arfcn") + "1777629600,60.17,24.94,244,91,1,7,-80,60,9\n"
    )
    assert (read(path).codes, read(path).technologies) == ({"244-91-1-7": (60, 9)}, {})


def test_what_a_column_states_of_a_row_counts_and_dbm_are_no_asu(tmp_path):
    path = tmp_path / "own.csv"
    path.write_text(
        "time,lat,lon,mcc,mnc,lac,ci,technology,level_dbm,earfcn,pci\n"
        "1777629600,60.17,24.94,244,91,1,7,GSM,-80,,\n"
        "1777629601,60.17,24.94,244,91,1,8,,-80,,\n"
        "1777629602,60.17,24.94,244,91,1,9,GSM,20,,\n"
    )
    found = read(path)
    assert found.cell_ids == ("244-91-1-7", "244-91-1-8")
    assert found.technologies["244-91-1-7"] == "GSM"
    assert "244-91-1-8" not in found.technologies


def test_what_most_rows_state_counts_in_whatever_order_files_come(tmp_path):
    head = "time,lat,lon,mcc,mnc,lac,ci,technology,level_dbm,arfcn,pci\n"
    row = "1777629600,60.17,24.94,244,91,1,7,{},-80,{},{}\n"
    old, new = tmp_path / "old.csv", tmp_path / "new.csv"
    old.write_text(head + row.format("LTE", 1300, 101) * 2)
    new.write_text(head + row.format("NR", 504_990, 700) + row.format("LTE", 6300, 102) * 3)
    either = [read_measurements(files, "EPSG:32635") for files in ((old, new), (new, old))]
    for found in either:
        assert found.technologies == {"244-91-1-7": "LTE"}
        assert found.codes == {"244-91-1-7": (6300, 102)}


def test_a_code_that_is_not_possible_hides_no_others(tmp_path):
    path = tmp_path / "own.csv"
    row = "17776296{:02d},60.17,24.94,244,91,1,7,LTE,-80,1300,{}\n"
    path.write_text(
        "time,lat,lon,mcc,mnc,lac,ci,technology,level_dbm,earfcn,pci\n"
        + "".join(row.format(k, 65535 if k < 3 else 101) for k in range(5))
    )
    found = read(path)
    assert len(found) == 5
    assert found.codes == {"244-91-1-7": (1300, 101)}
    assert any("3 carriers or codes that are not possible" in note for note in found.notes)


def test_a_zip_of_drive_tests_is_refused_with_what_to_do(tmp_path):
    path = tmp_path / "drive.zip"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("drive.csv", "lat,lon,level_dbm,cell\n60,24,-80,A\n")
    for named in (path, tmp_path):
        with pytest.raises(InputError, match="unpack") as caught:
            read(named)
        assert len(caught.value.faults) == 1
