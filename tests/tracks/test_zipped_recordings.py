"""Recordings in a ZIP are read as those in a folder; a ZIP reaches nothing else."""

import zipfile

import pandas as pd
import pytest
from made_recordings import MADE, START_UTC_S

from mapfilter.errors import InputError
from mapfilter.tracks.joining.recordings import read_recordings
from mapfilter.tracks.open_log import open_log
from mapfilter.tracks.open_options import OpenOptions
from mapfilter.tracks.readers.formats import read_recording
from mapfilter.tracks.readers.texts import zipped
from mapfilter.workflows.convert import report_lines, run_convert
from mapfilter.workflows.info import run_info

GPX, PHYPHOX, CELLS = (MADE[name][1] for name in ("gpx", "phyphox", "towercollector"))
TIMES = f'"event","experiment time","system time"\n"START",0.0,{START_UTC_S}.5\n'


@pytest.fixture
def packed(tmp_path):
    """Return a function that writes a ZIP of named texts."""

    def write(name="walk.zip", **texts):
        path = tmp_path / name
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            for inner, text in texts.items():
                archive.writestr(inner, text)
        return path

    return write


def notes_and_tables(path):
    recordings, notes = read_recordings([path], OpenOptions())
    return notes, {
        (one.path.name, name): rows for one in recordings for name, rows in one.tables.items()
    }


@pytest.mark.parametrize("inside", ["", "a walk/", "shared/2026-05-01/"])
def test_a_zip_is_read_as_the_folder_that_it_holds(packed, tmp_path, inside):
    texts = {"track.gpx": GPX, "Accelerometer.csv": PHYPHOX, "meta/time.csv": TIMES, "a.txt": "?"}
    folder = tmp_path / "walk"
    (folder / "meta").mkdir(parents=True)
    for name, text in texts.items():
        (folder / name).write_text(text)
    hidden = {"__MACOSX/._track.gpx": "\0", ".DS_Store": "\0"}
    path = packed(**{inside + name: text for name, text in texts.items()}, **hidden)
    notes, tables = notes_and_tables(path)
    of_folder, expected = notes_and_tables(folder)
    assert notes == ("walk.zip: a.txt left out, no recordings",)
    assert of_folder == ("walk: a.txt left out, no recordings",)
    assert tables.keys() == expected.keys()
    for key in expected:
        pd.testing.assert_frame_equal(tables[key], expected[key])
    # The times of the sensors are those of the file beside them.
    assert tables["Accelerometer.csv", "accelerometer"]["time_s"].iloc[0] == START_UTC_S + 0.5


def test_a_journey_may_be_a_zip_or_a_file_in_it(packed):
    path = packed(**{"track.gpx": GPX, "cells.csv": CELLS})
    whole = open_log(path).log
    assert len(whole.radio)
    assert len(open_log(path / "track.gpx").log.gnss) == len(
        read_recording(path / "track.gpx").tables["positions"]
    )
    info = run_info(path)
    assert (info["kind"], info["formats"]) == ("recordings", {"gpx": 1, "towercollector": 1})


def test_a_zip_is_converted_and_named(packed, tmp_path):
    result = run_convert([packed(**{"track.gpx": GPX})], tmp_path / "log")
    assert report_lines(result)[0].startswith("track.gpx: ")
    assert result.files[0].file.endswith("walk.zip/track.gpx")


def _several(packed):
    return packed(**{"monday/track.gpx": GPX, "tuesday/track.gpx": GPX})


def _without(packed):
    return packed(**{"a.txt": "?", "b.txt": "?"})


def _cut_off(packed):
    path = packed(**{"track.gpx": GPX})
    path.write_bytes(path.read_bytes()[:-40])
    return path


def _damaged(packed):
    path = packed(**{"track.gpx": GPX})
    data = bytearray(path.read_bytes())
    data[60:200] = bytes(140)
    path.write_bytes(bytes(data))
    return path


def _locked(packed):
    path = packed(**{"track.gpx": GPX})
    data = path.read_bytes()
    central = data.index(b"PK\x01\x02")
    path.write_bytes(data[:6] + b"\x01" + data[7 : central + 8] + b"\x01" + data[central + 9 :])
    return path


def _workbook(packed):
    return packed(**{"[Content_Types].xml": "<Types/>", "xl/workbook.xml": "<workbook/>"})


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (_several, "recordings of one journey, found monday, tuesday"),
        (_without, "recordings in the ZIP, found none in a known format"),
        (_cut_off, "a ZIP that can be read"),
        (_damaged, "a ZIP that can be read"),
        (_locked, "a file without a password"),
        (_workbook, "a ZIP archive (or an Excel file)"),
        (
            lambda packed: packed(**{".DS_Store": "?"}),
            "a ZIP with at most 1000 files, found 0 files",
        ),
    ],
)
def test_a_zip_that_cannot_be_read_is_one_message(packed, make, said):
    with pytest.raises(InputError) as caught:
        read_recordings([make(packed)], OpenOptions())
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (_damaged, "a ZIP that can be read"),
        (_locked, "a file without a password"),
        (lambda packed: packed(**{"a.gpx": GPX}), "a file in the ZIP, found no such file"),
    ],
)
def test_a_file_in_a_zip_that_cannot_be_read_is_named(packed, make, said):
    path = make(packed)
    with pytest.raises(InputError, match=said) as caught:
        read_recording(path / "track.gpx")
    assert "walk.zip" in str(caught.value)


def test_what_unpacks_to_more_than_is_read_is_refused(packed):
    path = packed(**{"a.csv": "time,acc_x\n" + "0,0\n" * 300_000})
    assert path.stat().st_size < 10_000
    with pytest.raises(InputError, match="possible decompression bomb"):
        zipped.read_zipped(path / "a.csv", path, -1, 1_000_000)
    assert len(zipped.read_zipped(path / "a.csv", path, 100, 1_000_000)) == 100


def test_names_in_a_zip_reach_no_other_file(packed, tmp_path):
    (tmp_path / "secret.gpx").write_text(GPX)
    for name in ("../secret.gpx", str(tmp_path / "secret.gpx"), "..\\secret.gpx"):
        with pytest.raises(InputError, match="names within the ZIP"):
            read_recordings([packed(**{name: GPX, "track.gpx": GPX})], OpenOptions())
    path = packed(**{"track.gpx": GPX})
    for inner in ("../secret.gpx", "x/../../secret.gpx"):
        with pytest.raises(InputError):
            read_recording(path / inner)


def test_a_zip_of_too_many_files_is_refused(packed):
    path = packed(**{f"{k}.csv": "" for k in range(1001)})
    with pytest.raises(InputError, match="at most 1000 files, found 1001 files"):
        read_recordings([path], OpenOptions())


def test_files_and_folders_that_are_none_are_no_zip(packed, tmp_path):
    assert not zipped.is_zip(tmp_path)
    assert not zipped.is_zip(tmp_path / "nothing")
    (tmp_path / "a.csv").write_text("time,lat")
    assert not zipped.is_zip(tmp_path / "a.csv")
    assert zipped.is_zip(packed(**{"a.csv": "x"}))


def test_hidden_files_and_folders_are_left_out_and_a_thousand_files_are_not_too_many(packed):
    path = packed(**{"_x/a.gpx": GPX, "b/.c/d.gpx": GPX, "b/track.gpx": GPX, "b/.hidden": GPX})
    assert zipped.files_in_zip(path) == [path / "b" / "track.gpx"]
    many = packed(**{f"{k}.csv": "" for k in range(1000)})
    assert len(zipped.files_in_zip(many)) == 1000


def test_names_are_those_of_paths_and_methods_but_deflate_are_refused(tmp_path):
    """bzip2 and LZMA would unpack a whole block, however little is asked for."""
    path = tmp_path / "walk.zip"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("./track.gpx", GPX)
    _, tables = notes_and_tables(path)
    assert ("track.gpx", "positions") in tables
    with zipfile.ZipFile(path, "w", zipfile.ZIP_BZIP2) as archive:
        archive.writestr("track.gpx", GPX)
    with pytest.raises(InputError, match="a file compressed by deflate, found method 12"):
        read_recordings([path], OpenOptions())
