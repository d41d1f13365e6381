"""Folders and ZIPs that are no recordings of one journey: what is said of each."""

from __future__ import annotations

import zipfile

import pandas as pd
import pytest
from made_recordings import MADE

from mapfilter.errors import InputError
from mapfilter.tracks.joining.recordings import read_recordings, with_measured, with_remarks
from mapfilter.tracks.log import make_log
from mapfilter.tracks.open_options import CombineOptions, OpenOptions
from mapfilter.tracks.readers.formats import read_recording
from mapfilter.tracks.store import write_log

GPX = MADE["gpx"][1]
CRS = "EPSG:32635"
PLACES = pd.DataFrame({"time_s": [0.0, 1.0], "east_m": 5e5, "north_m": [6.67e6, 6.67e6 + 1]})


def read(*paths, **options):
    found, notes = read_recordings(list(paths), OpenOptions(**options))
    return [one.path.name for one in found], notes


def told(*paths, **options):
    with pytest.raises(InputError) as caught:
        read(*paths, **options)
    (fault,) = caught.value.faults
    return fault.expected, fault.got, fault.hint


@pytest.fixture
def folder(tmp_path):
    inner = tmp_path / "walks"
    inner.mkdir()
    return inner


NONE = ("recordings in the folder", "none in a known format")


def test_a_folder_without_recordings(folder):
    assert told(folder) == (*NONE, "")
    (folder / "a.txt").write_text("words")
    (folder / ".track.gpx").write_text(GPX)
    assert told(folder) == (*NONE, "")


def test_a_folder_of_journeys_is_told_to_hold_them(folder):
    for name in ("monday", ".hidden", "empty"):
        (folder / name).mkdir()
    for name in ("monday", ".hidden"):
        (folder / name / "track.gpx").write_text(GPX)
    hint = f"they are in folders in it, each of a journey: name {folder / 'monday'}"
    assert told(folder) == (*NONE, hint)


def test_a_folder_of_track_logs_is_told_to_hold_them(folder):
    for name in ("b", "a"):
        write_log(make_log(CRS, truth=PLACES), folder / name)
    (folder / "other").mkdir()
    expected = ("recordings in the folder", "track logs", "name one of them: a, b")
    assert told(folder) == expected


def test_a_track_log_is_no_recording(folder, tmp_path):
    log = folder / "log"
    write_log(make_log(CRS, truth=PLACES), log)
    expected = ("recordings of other programs", "a track log")
    assert told(log) == (*expected, "it is used as it is, and needs no conversion")
    (tmp_path / "track.gpx").write_text(GPX)
    for paths in ((log, tmp_path / "track.gpx"), (tmp_path / "track.gpx", log)):
        assert told(*paths) == (*expected, "name it alone; recordings cannot be added to it")


def test_files_of_a_folder_that_are_none_are_noted(folder):
    (folder / "track.gpx").write_text(GPX)
    assert read(folder) == (["track.gpx"], ())
    for number in range(40):
        (folder / f"{number:02}.txt").write_text("words")
    names, (note,) = read(folder)
    assert names == ["track.gpx"]
    # The first two hundred letters.
    begin, end = "walks: 00.txt, 01.txt, ", " left out, no recordings"
    assert note.startswith(begin)
    assert note.endswith(end)
    assert len(note) == len("walks: ") + 200 + len(end)


def test_a_zip_without_recordings(tmp_path):
    path = tmp_path / "walk.zip"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("a.txt", "words")
    assert told(path) == ("recordings in the ZIP", "none in a known format", "")


def test_each_recording_is_read_once(folder):
    path = folder / "track.gpx"
    path.write_text(GPX)
    assert read(path, folder, path) == (["track.gpx"], ())
    assert read(folder, combine=CombineOptions(truth=[path])) == (["track.gpx"], ())
    other = folder.parent / "truth.gpx"
    other.write_text(GPX)
    assert read(folder, combine=CombineOptions(truth=[other]))[0] == ["track.gpx", "truth.gpx"]


def test_columns_of_several_files_are_those_of_any(folder):
    (folder / "track.gpx").write_text(GPX)
    table = PLACES.assign(Zeit=1_777_629_600 + PLACES["time_s"]).drop(columns="time_s")
    table.to_csv(folder / "own.csv", index=False)
    files = folder / "own.csv", folder / "track.gpx"
    assert read(*files, columns={"time": "Zeit"})[0] == ["own.csv", "track.gpx"]
    expected = "a column Pegel for level_dbm in a plain CSV among them"
    hint = "misspelt; files of other formats need no columns"
    assert told(*files, columns={"time": "Zeit", "level_dbm": "Pegel"}) == (expected, "none", hint)


def test_a_zone_that_no_recording_needs_is_noted(folder):
    path = folder / "track.gpx"
    path.write_text(GPX)
    assert read(path, zone="Europe/Berlin")[1] == (
        "--zone has no effect: no times are local without a zone (track.gpx UTC)",
    )
    path.write_text(GPX.replace("Z</time>", "</time>"))
    assert read(path, zone="Europe/Berlin")[1] == ()


def test_what_is_truth_and_log_at_once_is_measured(tmp_path):
    one, other = tmp_path / "a.gpx", tmp_path / "b.gpx"
    options = CombineOptions(truth=[one, other])
    assert list(with_measured(options, [other]).measured) == [other]
    assert list(with_measured(options, []).measured) == []


def test_notes_of_files_come_before_those_of_the_log_each_once(folder):
    path = folder / "track.gpx"
    path.write_text(GPX.replace("<gpx", "<!-- a note -->\n<gpx"))
    recording = read_recording(path)
    log = make_log(CRS, truth=PLACES, notes=("of the log", "first"))
    found = with_remarks(log, ("first", "second"), [recording])
    assert found.notes == (*("first", "second"), *recording.remarks, "of the log")
