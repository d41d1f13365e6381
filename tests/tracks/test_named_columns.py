"""Named columns of several files of a journey count in those that have them."""

import numpy as np
import pandas as pd
import pytest

import mapfilter as mf
from mapfilter._words import number_of
from mapfilter.errors import InputError
from mapfilter.geodesy import unproject
from mapfilter.tracks.joining.recordings import read_recordings
from mapfilter.tracks.open_options import OpenOptions
from mapfilter.tracks.readers.formats import read_recording

TIME_S = 1_777_629_600 + np.arange(60)


@pytest.fixture
def files(tmp_path):
    """A track with German names, an odometer with usual ones, and a GPX file."""
    east_m = 385_900.0 + np.arange(60)
    lon, lat = unproject("EPSG:32635", east_m, np.full(60, 6_671_900.0))
    track, wheel, gpx = (tmp_path / name for name in ("track.csv", "wheel.csv", "track.gpx"))
    pd.DataFrame({"Zeit": TIME_S, "Breite": lat, "Laenge": lon}).to_csv(track, index=False)
    speeds = {"time": TIME_S, "wheel_speed_mps": 1.0, "yaw_rate_radps": 0.0, "tempo": 7.2}
    pd.DataFrame(speeds).to_csv(wheel, index=False)
    points = "".join(
        f'<trkpt lat="{y}" lon="{x}"><time>{pd.Timestamp(t, unit="s").isoformat()}Z</time></trkpt>'
        for t, x, y in zip(TIME_S, lon, lat, strict=True)
    )
    gpx.write_text(f'<gpx version="1.1"><trk><trkseg>{points}</trkseg></trk></gpx>')
    return track, wheel, gpx


NAMED = {"time": "Zeit", "lat_deg": "Breite", "lon_deg": "Laenge"}


def test_a_file_that_lacks_a_named_column_is_read_by_usual_names(files):
    recordings, _ = read_recordings(files, OpenOptions(columns=NAMED))
    assert [sorted(one.tables) for one in recordings] == [
        ["positions"], ["odometry"], ["positions"],
    ]  # fmt: skip
    assert [one.named for one in recordings] == [tuple(NAMED), (), ()]
    assert all(len(rows) == 60 for one in recordings for rows in one.tables.values())


def test_each_file_may_have_some_of_the_columns(files):
    named = {**NAMED, "wheel_speed_kmh": "tempo"}
    _, wheel, _ = read_recordings(files, OpenOptions(columns=named))[0]
    assert wheel.named == ("wheel_speed_kmh",)
    assert wheel.tables["odometry"]["speed_mps"].to_numpy() == pytest.approx(2.0)


def test_a_column_that_no_file_has_is_an_error(files):
    named = {**NAMED, "level_dbm": "Pegel", "cell": "Zelle"}
    with pytest.raises(InputError) as caught:
        read_recordings(files, OpenOptions(columns=named))
    assert [str(fault) for fault in caught.value.faults] == [
        f"track.csv, wheel.csv, track.gpx: expected a column {column} for {name} in a plain CSV "
        "among them, found none (likely: misspelt; files of other formats need no columns)"
        for name, column in (("level_dbm", "Pegel"), ("cell", "Zelle"))
    ]


def test_a_single_file_has_to_have_every_column(files):
    with pytest.raises(InputError, match=r"wheel\.csv header: expected a column Zeit for"):
        read_recordings(files[1:2], OpenOptions(columns=NAMED))


def test_a_file_with_none_of_the_columns_is_no_plain_table(files, tmp_path):
    (tmp_path / "notes.txt").write_text("a;b\n1;2\n")
    with pytest.raises(InputError, match=r"notes.txt: expected a recording in a known format"):
        read_recordings([*files, tmp_path / "notes.txt"], OpenOptions(columns=NAMED))


@pytest.mark.parametrize("name", ["walk.jsonl", "walk.json", "walk.log"])
@pytest.mark.parametrize("start", ['{"time": 1.0, "note": 2}', '[{"time": 1.0, "note": 0.7},'])
def test_json_is_named(tmp_path, name, start):
    """Its keys were read as a header: a time that is none, or columns that are not used."""
    (tmp_path / name).write_text(f"{start}\n" * 3)
    with pytest.raises(InputError, match=r"begins with .* \(likely: JSON without records of"):
        mf.read_log(tmp_path / name)


@pytest.mark.parametrize("name", ["walk.jsonl", "walk.json", "walk.log"])
@pytest.mark.parametrize(
    ("start", "rows"), [('{"time": 1.0, "steps": 2}', 3), ('[{"time": 1.0, "step_m": 0.7},', 1)]
)
def test_json_of_motion_is_read(tmp_path, name, start, rows):
    (tmp_path / name).write_text(f"{start}\n" * 3)
    found = read_recording(tmp_path / name)
    assert any(f"JSON read as a table of {number_of(rows, 'row')}" in one for one in found.notes)
    assert {"steps", "motion"} & set(found.tables)


@pytest.mark.parametrize(
    ("name", "data", "hint"),
    [
        (
            "ride.tcx",
            b'<?xml version="1.0"?>\n<TrainingCenterDatabase/>\n',
            "recorded indoors, or an activity without a track",
        ),
        ("flight.igc", b"AXXXABC\nHFDTE010526\n", "an IGC file; export GPX"),
        ("survey.gpkg", b"SQLite format 3\0\x10\0", "no GeoPackage; export its table as CSV"),
        ("car.ubx", b"\xb5b\x01\x07\x5c\n\0\0" * 9, "u-blox receiver; export NMEA, or RINEX"),
    ],
)
def test_files_of_formats_that_are_not_read_are_named(tmp_path, name, data, hint):
    (tmp_path / name).write_bytes(data)
    with pytest.raises(InputError, match=hint):
        mf.read_log(tmp_path / name)


def test_columns_of_another_language_are_named_by_their_units(tmp_path):
    """The columns of positions were proposed, of which the file has none."""
    head = "time;Vitesse (km/h);Vitesse de lacet (deg/s);Niveau [dBm];Remarque"
    (tmp_path / "trajet.csv").write_text(f"{head}\n1778666400;3,6;0,1;-80;x\n")
    options = (
        r"such as 'wheel_speed_kmh=vitesse \(km/h\)' and 'yaw_rate_degps=vitesse de lacet "
        r"\(deg/s\)' and 'level_dbm=niveau \[dbm\]'\)"
    )
    with pytest.raises(InputError, match=options):
        mf.read_log(tmp_path / "trajet.csv")
