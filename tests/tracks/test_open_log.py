"""Logs and recordings are opened alike: files, several of them, folders."""

import numpy as np
import pandas as pd
import pytest
from made_recordings import COUNT, LAT_DEG, LON_DEG, MADE, START_UTC_S

import mapfilter as mf
from mapfilter.errors import ConfigError, InputError
from mapfilter.geodesy import project
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.tracks.joining.recordings import read_recordings
from mapfilter.tracks.open_log import list_journeys, open_log
from mapfilter.tracks.open_options import CombineOptions, OpenOptions
from mapfilter.tracks.sensors import read_sensors
from mapfilter.tracks.store import read_log, write_log

UTM = "EPSG:32635"


@pytest.fixture
def made(tmp_path):
    def write(*names):
        paths = [tmp_path / MADE[name][0] for name in names]
        for path, name in zip(paths, names, strict=True):
            path.write_text(MADE[name][1])
        return paths

    return write


def test_a_recording_is_a_log_in_the_crs_asked_for(made):
    (path,) = made("towercollector")
    opened = open_log(path, crs="EPSG:3067")
    assert (opened.name, opened.log.crs) == ("towers", "EPSG:3067")
    assert len(opened.recordings) == 1
    east, _ = project("EPSG:3067", LON_DEG, LAT_DEG)
    assert opened.log.gnss["east_m"].to_numpy() == pytest.approx(east, abs=0.1)
    assert open_log(str(path)).log.crs == UTM


def test_several_recordings_and_their_folder_are_one_journey(made, tmp_path):
    paths = made("towercollector", "sensorlogger", "gpx")
    options = OpenOptions(combine=CombineOptions(truth=[paths[2]]))
    one = open_log(paths, options=options)
    folder = open_log(tmp_path, options=options)
    assert len(one.log.truth) == COUNT
    assert set(one.sensors) == set(folder.sensors) >= {"accelerometer"}
    for table in ("radio", "gnss", "truth"):
        assert getattr(one.log, table).equals(getattr(folder.log, table)), table
    # A truth that is named only there is read, too.
    apart = open_log(paths[:2], options=options)
    assert len(apart.log.truth) == COUNT


def test_a_track_log_is_opened_as_it_is(made, tmp_path):
    opened = open_log(made("towercollector", "sensorlogger"))
    write_log(opened.log, tmp_path / "log", sensors=opened.sensors)
    again = open_log(tmp_path / "log", crs="EPSG:3067")
    # The same metres, by another name.
    assert (again.name, again.log.crs, again.recordings) == ("log", "EPSG:3067", ())
    assert again.log.radio.equals(read_log(tmp_path / "log").radio)
    assert again.sensors.keys() == read_sensors(tmp_path / "log").keys()
    with pytest.raises(InputError, match="name it alone"):
        open_log([tmp_path / "log", tmp_path / "towers.csv"])
    with pytest.raises(InputError, match="it is used as it is, and needs no conversion"):
        read_recordings([tmp_path / "log"], OpenOptions())


@pytest.mark.parametrize(
    ("options", "named"),
    [
        (OpenOptions(), None),
        (OpenOptions(combine=CombineOptions(walk=None)), None),
        (OpenOptions(zone="+01:00"), "--zone"),
        (OpenOptions(format="csv", columns={"time": "Zeit"}), "--format, --column"),
        (
            OpenOptions(combine=CombineOptions(origin_deg=(0.0, 0.0), course_motion=True)),
            "--origin, --course-motion",
        ),
    ],
)
def test_options_that_a_track_log_does_not_use_are_noted(made, tmp_path, options, named):
    write_log(open_log(made("towercollector", "sensorlogger")).log, tmp_path / "log")
    notes = open_log(tmp_path / "log", options=options).log.notes
    found = [note.partition(": ")[2] for note in notes if "no effect" in note]
    assert found == ([] if named is None else [named])


def test_a_truth_and_offsets_beside_a_track_log_are_noted(made, tmp_path):
    write_log(open_log(made("towercollector", "sensorlogger")).log, tmp_path / "log")
    (truth,) = made("gpx")
    log = mf.read_log(tmp_path / "log", truth=truth, offsets_s={truth.name: 3.0})
    assert log.truth.empty
    said = "options of recordings have no effect on a track log: truth, offsets_s"
    assert said in log.notes


def test_a_plan_names_the_cells(made):
    (path,) = made("towercollector")
    cells = tuple(
        Cell(f"C{i}", "S", 385_000.0, 6_672_000.0, 30.0, None, 50.0, 1800.0, "omni")
        for i in range(2)
    )
    log = open_log(path).log
    ci = sorted(log.radio["ci"].dropna().unique())
    named = [
        Cell(**{**{f: getattr(c, f) for f in c.__slots__}, "mcc": 244, "mnc": 91, "ci": int(one)})
        for c, one in zip(cells, ci, strict=False)
    ]
    radio = open_log(path, plan=CellPlan(UTM, tuple(named))).log.radio
    for cell in named:
        rows = radio[radio["ci"] == cell.ci]
        assert len(rows)
        assert (rows["cell"] == cell.id).all()


def test_faults_of_all_files_come_together(made, tmp_path):
    (path,) = made("towercollector")
    (tmp_path / "a.bin").write_bytes(b"\0\1\2" * 99)
    (tmp_path / "b.csv").write_text("x,y\n1,2\n")
    with pytest.raises(InputError) as caught:
        open_log([path, tmp_path / "a.bin", tmp_path / "b.csv", tmp_path / "none.csv"])
    wheres = [fault.where for fault in caught.value.faults]
    assert [any(name in where for where in wheres) for name in ("a.bin", "b.csv", "none.csv")] == [
        True
    ] * 3
    with pytest.raises(ConfigError, match="Mars"):
        open_log(path, options=OpenOptions(zone="Mars"))


def test_journeys_of_a_path(made, tmp_path):
    (path,) = made("towercollector")
    assert list_journeys(path) == [path]
    assert list_journeys(tmp_path) == [tmp_path]
    log = open_log(path).log
    for name in ("b", "a"):
        write_log(log, tmp_path / "logs" / name)
    assert list_journeys(tmp_path / "logs") == [tmp_path / "logs" / "a", tmp_path / "logs" / "b"]
    assert list_journeys(tmp_path / "logs" / "a") == [tmp_path / "logs" / "a"]
    for wrong in ("none", "logs/a/radio.parquet", "logs/a/log.json"):
        with pytest.raises(InputError):
            list_journeys(tmp_path / wrong)
    for absent in ("none", "none.csv"):
        with pytest.raises(InputError, match=r"found nothing .*mistyped path"):
            list_journeys(tmp_path / absent)
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match="a folder without any"):
        list_journeys(tmp_path / "empty")
    write_log(log, tmp_path / "out" / "journeys" / "a")
    with pytest.raises(InputError, match=rf"the logs are in {tmp_path / 'out' / 'journeys'}\)"):
        list_journeys(tmp_path / "out")
    (tmp_path / "empty" / "points.parquet").touch()
    with pytest.raises(InputError, match="a radio-route database, which --db names"):
        list_journeys(tmp_path / "empty")
    hand = tmp_path / "hand"
    hand.mkdir()
    (hand / "motion.csv").write_text("time_s,step_m\n0,1\n")
    with pytest.raises(InputError, match=r"without a log\.json"):
        list_journeys(hand)
    with pytest.raises(InputError, match=r"log\.json"):
        open_log(hand)
    # Outside such a folder a file of that name is a recording.
    (tmp_path / "truth.csv").write_text("time_s,lat,lon\n0,60.17,24.94\n1,60.171,24.94\n")
    assert len(open_log(tmp_path / "truth.csv").log.gnss) == 2


def test_read_log_of_the_front_door(made, tmp_path):
    tower, gpx = made("towercollector", "gpx")
    log = mf.read_log([tower], truth=[gpx])
    assert log.start_utc_s == START_UTC_S
    assert len(log.truth) == COUNT
    mf.write_log(log, tmp_path / "log")
    assert len(mf.read_log(tmp_path / "log").truth) == COUNT
    table = pd.DataFrame({"Zeit": np.arange(3.0), "Breite": 60.17, "Laenge": 24.94})
    table.to_csv(tmp_path / "zeit.csv", index=False)
    names = {"time": "Zeit", "lat_deg": "Breite", "lon_deg": "Laenge"}
    assert len(mf.read_log(tmp_path / "zeit.csv", columns=names).gnss) == 3
    with pytest.raises(InputError, match="known format"):
        mf.read_log(tmp_path / "zeit.csv")


def test_speed_and_course_of_the_truth_make_motion_on_request(made):
    (path,) = made("opencellid")
    combine = CombineOptions(truth=[path], course_motion=True)
    log = open_log(path, options=OpenOptions(combine=combine)).log
    assert (len(log.truth), len(log.gnss)) == (COUNT, 0)
    assert log.motion["step_m"].sum() == pytest.approx(2.2 * 2 * (COUNT - 1), rel=0.01)
    # Positions without a course are motion from each to the next.
    (alone,) = made("gpx")
    combine = CombineOptions(truth=[alone], course_motion=True)
    log = open_log(alone, options=OpenOptions(combine=combine)).log
    assert log.motion["step_m"].sum() == pytest.approx(log.truth_length_m)
    assert any("motion comes from GNSS: its positions" in note for note in log.notes)


@pytest.fixture
def steps_and_places(tmp_path):
    """A recording of steps, compass, sensors and positions."""
    table = pd.DataFrame({"time": START_UTC_S + np.arange(20.0), "lat": 60.17, "lon": 24.94})
    table = table.assign(step_m=1.4, compass_deg=90.0, pressure_hpa=1000.0)
    table["lon"] += 1.4 * np.arange(20) / 55_400
    table.to_csv(tmp_path / "walk.csv", index=False)
    return tmp_path / "walk.csv"


def test_a_recording_that_is_log_and_truth_keeps_its_motion_and_sensors(steps_and_places):
    path = steps_and_places
    options = OpenOptions(combine=CombineOptions(truth=[path]))
    opened = open_log(path, options=options)
    assert (len(opened.log.motion), len(opened.log.truth), len(opened.log.gnss)) == (20, 20, 0)
    assert "barometer" in opened.sensors


def test_a_recording_that_is_truth_alone_gives_no_motion(steps_and_places, made):
    (gpx,) = made("gpx")
    options = OpenOptions(combine=CombineOptions(truth=[steps_and_places]))
    for given in (gpx, gpx.parent):
        log = open_log(given, options=options).log
        assert (len(log.motion), len(log.truth)) == (0, 20)
        assert len(log.gnss) == COUNT


def test_azimuths_are_turned_to_the_grid_of_positions_in_metres(tmp_path):
    time_s = START_UTC_S + np.arange(50.0)
    east, north = project(UTM, np.full(50, 24.5), 60 + np.arange(50) / 5000)
    pd.DataFrame({"time": time_s, "wheel_speed_mps": 10.0, "compass_deg": 0.0}).to_csv(
        tmp_path / "drive.csv"
    )
    pd.DataFrame({"time": time_s, "east_m": east, "north_m": north}).to_csv(tmp_path / "places.csv")
    motion = mf.read_log([tmp_path / "drive.csv", tmp_path / "places.csv"], crs=UTM).motion
    course = np.arctan2(north[-1] - north[0], east[-1] - east[0])
    assert motion["heading_rad"].iloc[5] == pytest.approx(course, abs=1e-4)
    assert course < np.radians(88)
