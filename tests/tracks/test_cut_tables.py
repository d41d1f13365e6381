"""Tables of surveys, raw sensors and fingerprints that were cut off while they were copied."""

import json

import numpy as np
import pytest

import mapfilter as mf
from mapfilter.positioning.fingerprints.tables import read_fingerprint_table
from mapfilter.survey.read_measurements import read_measurements
from mapfilter.tracks.open_log import open_log
from mapfilter.tracks.sensors import read_sensors

ROWS = 30


def sensors(folder, end):
    (folder / "sensors").mkdir()
    rows = [f"{n / 10:.1f},0.100,0.200,{9.8 + n / 1000:.3f}" for n in range(ROWS)]
    text = "\n".join(["time_s,x_mps2,y_mps2,z_mps2", *rows]) + end
    (folder / "sensors" / "accelerometer.csv").write_bytes(text.encode())
    (folder / "log.json").write_text(json.dumps({"crs": "EPSG:32635"}))
    (folder / "motion.csv").write_text("time_s,step_m,heading_rad\n0,0,0\n1,1,0\n")
    return folder


def fingerprints(folder, end):
    rows = [f"{10 + n},{20 + n},{-60 - n % 30}" for n in range(ROWS)]
    path = folder / "table.csv"
    path.write_bytes(("\n".join(["x,y,AP1", *rows]) + end).encode())
    return path


def survey(folder, end, rows=ROWS):
    lines = [f"A,60.{n % 90:02d},24.5,{-60 - n % 30}" for n in range(rows)]
    path = folder / "drive.csv"
    path.write_bytes(("\n".join(["cell,lat,lon,level_dbm", *lines]) + end).encode())
    return path


@pytest.mark.parametrize(
    ("end", "note"),
    [
        ("\n3.0,0.100,0.200,9.", " row 32: cut off within its last number (9., without a line"),
        ("\n3.0,0.100", " row 32: cut off within the row (without a line end), left out"),
        ("\n3.0,0.1\0\0\0", ": 3 zero bytes at the end (line 32) left out, with the unfinished"),
        ("\n\0\0\0", ": 3 zero bytes at the end (line 32) left out"),
        ("", ""),
        ("\n", ""),
    ],
)
def test_sensors_of_a_log(tmp_path, end, note):
    folder = sensors(tmp_path, end)
    opened = open_log(folder)
    assert len(opened.sensors["accelerometer"]) == ROWS
    assert read_sensors(folder)["accelerometer"].equals(opened.sensors["accelerometer"])
    path = folder / "sensors" / "accelerometer.csv"
    assert [one for one in opened.log.notes if one.startswith(f"{path}{note}")][: bool(note)] == [
        one for one in opened.log.notes if str(path) in one
    ]
    assert bool(note) == any(str(path) in one for one in mf.read_log(folder).notes)


@pytest.mark.parametrize(
    ("end", "note"),
    [
        (
            "\n40,50,-7",
            " row 32: cut off within its last number (-7, without a line end), left out",
        ),
        ("\n40,5", " row 32: cut off within the row (without a line end), left out"),
        ("\n40,50,-70\n\0\0", ": 2 zero bytes at the end (line 33) left out"),
        ("\n40,50,-70", ""),
        ("\n40,50,-70\n", ""),
    ],
)
def test_fingerprints(tmp_path, end, note):
    reports = read_fingerprint_table(fingerprints(tmp_path, end), "EPSG:32635")
    assert reports.level_dbm.size == ROWS + ("-70" in end)
    assert [one for one in reports.notes if "table.csv" in one] == [f"table.csv{note}"][
        : bool(note)
    ]


@pytest.mark.parametrize("rows", [ROWS, 20_000])
@pytest.mark.parametrize(
    ("end", "told"),
    [
        ("\nA,60.5,24.5,-7", "one cut off within its last number (-7, without a line end)"),
        ("\nA,60.5", "one cut off within the row (without a line end)"),
        ("\nA,60.55,24.5,-70", ""),
        ("\nA,60.55,24.5,-70\n\n", ""),
    ],
)
def test_surveys(tmp_path, rows, end, told):
    path = survey(tmp_path, end, rows)
    table = read_measurements([path], crs="EPSG:32635")
    assert not np.any(table.level_dbm > -50)
    notes = [note for note in table.notes if "left out" in note and "drive.csv" in note]
    if told:
        line = f"1 of {rows + 1} rows left out: {path} row {rows + 2}, line: expected a whole row"
        assert notes == [f"drive.csv: {line}, found {told}"]
    else:
        assert not notes
