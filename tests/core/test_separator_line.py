"""Excel's first line ``sep=;``: every reader of CSV takes the next line as the header."""

import json

import pandas as pd
import pytest

import mapfilter as mf
from mapfilter._separator_line import without_separator_line
from mapfilter.errors import InputError
from mapfilter.radio.tables import read_table
from mapfilter.rasters.atoll import find_index
from mapfilter.roads.landuse import _read_table as read_classes
from mapfilter.survey.measurement_files import DIALECTS, read_csv
from mapfilter.tracks.readers.texts.text import read_text
from mapfilter.tracks.sensors import read_sensors

CRS = "EPSG:32635"
FIRST = pytest.mark.parametrize(
    "first", ["sep=;\r\n", "SEP=;\n", '"sep=;"\n', "\ufeffsep=;\r\n", "sep=;;;\n"]
)


def write(tmp_path, name, text, codec="utf-8"):
    path = tmp_path / name
    path.write_bytes(text.encode(codec))
    return path


@FIRST
@pytest.mark.parametrize("codec", ["utf-8", "utf-16"])
def test_a_cell_plan(tmp_path, first, codec):
    rows = "cell;lat;lon;height_m;eirp_dbm;frequency_mhz\nA;60,17;24,94;30;50;1800\n"
    first = first.lstrip("\ufeff") if codec == "utf-16" else first
    plan = mf.read_cell_plan(write(tmp_path, "cells.csv", first + rows, codec), CRS)
    assert [(cell.id, cell.eirp_dbm) for cell in plan.cells] == [("A", 50.0)]
    wrong = write(tmp_path, "wrong.csv", first + rows.replace(";50;", ";500;"), codec)
    with pytest.raises(InputError, match=r"wrong\.csv row 3, eirp_dbm"):
        mf.read_cell_plan(wrong, CRS)


@FIRST
def test_a_recording(tmp_path, first):
    rows = "time;lat;lon;level_dbm;cell\n" + "".join(
        f"2026-05-01 10:00:{s:02}Z;60,17{s:02};24,9400;-{70 + s};A\n" for s in range(20)
    )
    log = mf.read_log(write(tmp_path, "drive.csv", first + rows))
    same = mf.read_log(write(tmp_path, "same.csv", rows))
    pd.testing.assert_frame_equal(log.radio, same.radio)
    pd.testing.assert_frame_equal(log.gnss, same.gnss)
    assert read_text(tmp_path / "drive.csv").data.startswith(b"\ntime;")


@FIRST
def test_a_drive_test(tmp_path, first):
    text = "cell;lat;lon;level_dbm\nA;60,17;24,94;-70\nA;60,17;24,94;x\n"
    rows = read_csv(write(tmp_path, "drive.csv", first + text), DIALECTS["csv"])
    assert rows.read == 2
    assert rows.faults[0].where.endswith("row 4, level_dbm")


@FIRST
def test_a_table_of_a_log(tmp_path, first):
    write(tmp_path, "log.json", json.dumps({"crs": CRS}))
    write(tmp_path, "motion.csv", first + "time_s;step_m\n0;1,5\n1;1,5\n")
    assert mf.read_log(tmp_path).motion["step_m"].tolist() == [1.5, 1.5]
    write(tmp_path, "motion.csv", first + "time_s;step_m\n0;1,5\n1;x\n")
    with pytest.raises(InputError, match="row 4, step_m"):
        mf.read_log(tmp_path)


@FIRST
@pytest.mark.parametrize("text", ["{};count\n0;1,5\n1;2,5\n", "{}\tcount\n0\t1.5\n1\t2.5\n"])
def test_a_table_of_sensors(tmp_path, first, text):
    (tmp_path / "sensors").mkdir()
    write(tmp_path, "sensors/steps.csv", first + text.format("time_s"))
    assert read_sensors(tmp_path)["steps"]["count"].tolist() == [1.5, 2.5]
    write(tmp_path, "sensors/steps.csv", first + text.format("time"))
    with pytest.raises(InputError, match="columns time_s, count, found no time_s"):
        read_sensors(tmp_path)


@FIRST
def test_fingerprints_and_classes_of_land_use(tmp_path, first):
    text = "x;y;ap1\n1;2;-50\n3;4;-60\n"
    assert len(mf.read_fingerprint_table(write(tmp_path, "f.csv", first + text), CRS)) == 2
    text = "class;value;walkable\nstreet;1;1\nhouse;2;0\n"
    keys, _ = read_classes(write(tmp_path, "classes.csv", first + text))
    assert keys == {1: ("street", True), 2: ("house", False)}
    with pytest.raises(InputError, match="row 4, walkable"):
        read_classes(write(tmp_path, "wrong.csv", first + text.replace("2;0", "2;x")))


@FIRST
def test_an_index_of_rasters(tmp_path, first):
    text = "TX_NAME;FILE_NAME;RESOLUTION\nA;a.bil;5\n"
    path = write(tmp_path, "index.csv", first + text)
    assert find_index(tmp_path) == path
    assert read_table(path, "an index").rows == ((3, ["A", "a.bil", "5"]),)


def test_only_the_first_line_and_only_a_separator_counts():
    for text in ("sep=;a\n1;2", "a\nsep=;\n", "sep=x\n", "separator;b\n", "sep;b\n", ""):
        assert without_separator_line(text) == text
        assert without_separator_line(text.encode()) == text.encode()
    assert without_separator_line("sep=;") == ""
