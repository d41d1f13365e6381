"""Readers on the real recordings that lie beside the checkout."""

import tarfile

import numpy as np
import pytest

from mapfilter.geodesy import project, utm_crs
from mapfilter.gnss.broadcast import place_by_broadcast
from mapfilter.tracks.open_options import CombineOptions, OpenOptions
from mapfilter.tracks.readers.formats import read_recording
from mapfilter.tracks.store import read_log
from mapfilter.workflows.convert import run_convert

FOUND = {
    "cell-belgium-lte/walks/*.txt": ("gnettrack", {"positions", "radio"}),
    "cell-belgium-lte/watch/*.gpx.gz": ("gpx", {"positions"}),
    "cell-ottawa-lte/*/*.csv": ("opencellid", {"positions", "radio"}),
    "gnss-android-vehicle/*a.gz": ("nmea", {"positions"}),
    "gnss-android-vehicle/*n": ("rinex-nav", {"ephemerides", "ionosphere"}),
    "gnss-android-vehicle/pseudoranges*.gz": ("gnsslogger", {"positions", "satellites"}),
    "gnss-android-vehicle/parser-samples/*logger.txt.gz": (
        "gnsslogger",
        {"positions", "satellites", "accelerometer", "gyroscope", "magnetometer"},
    ),
    "gnss-android-vehicle/parser-samples/*o.gz": ("rinex-obs", {"satellites"}),
    "gnss-odometry-smartloc/*Input.txt.gz": ("smartloc", {"odometry", "satellites"}),
    "gnss-odometry-smartloc/*GT.txt.gz": ("smartloc", {"truth"}),
    "gnss-odometry-smartloc/*.csv": ("smartloc-raw", {"truth", "satellites"}),
    "gsm-antennas-log/*.log": ("antennas", {"positions", "radio"}),
    "kitti-osm/odometry/*.csv": ("csv", {"motion"}),
    "kitti-osm/truth/*.csv": ("csv", {"places"}),
}


@pytest.mark.parametrize("pattern", FOUND)
def test_real_recordings_are_read(pattern, shared_data):
    name, tables = FOUND[pattern]
    paths = sorted(shared_data.glob(pattern))
    assert paths
    for path in paths:
        recording = read_recording(path)
        assert recording.format == name
        assert set(recording.tables) == tables


def test_indoor_walks(shared_data, tmp_path):
    with tarfile.open(shared_data / "imu-wifi-indoor-mall/site1_F4_paths.tar.xz") as archive:
        member = next(m for m in archive if m.isfile() and m.name.endswith(".txt"))
        member.name = "path.txt"
        archive.extract(member, tmp_path, filter="data")
    recording = read_recording(tmp_path / "path.txt")
    assert recording.format == "indoor"
    acceleration = recording.tables["accelerometer"]
    rate_hz = 1 / np.median(np.diff(acceleration["time_s"]))
    assert 45 < rate_hz < 55
    assert {"true_places", "gyroscope", "magnetometer", "orientation"} <= set(recording.tables)


def test_cork_traces(shared_data, tmp_path):
    with tarfile.open(shared_data / "cell-cork-5g/driving.tar.xz") as archive:
        member = next(m for m in archive if m.isfile() and m.name.endswith(".csv"))
        member.name = "drive.csv"
        archive.extract(member, tmp_path, filter="data")
    recording = read_recording(tmp_path / "drive.csv")
    assert recording.format == "gnettrack"
    # The logger renews the position every 9 s only.
    assert len(recording.tables["positions"]) < len(recording.tables["radio"]) / 5
    assert recording.tables["radio"]["ci"].notna().all()


def test_the_frozen_radio_of_g_net_track_is_left_out(shared_data):
    walks = sorted((shared_data / "cell-belgium-lte/walks").glob("*.txt"))
    for path in walks:
        recording = read_recording(path)
        frozen = [u for u in recording.unusable if "not renewed" in u.reason]
        assert frozen[0].count > 0.4 * recording.rows


def test_the_watch_tells_the_zone_of_the_phone(shared_data, tmp_path):
    folder = shared_data / "cell-belgium-lte"
    for name in ("lln_2", "waha_3", "ixelle_5"):
        watch = folder / "watch" / f"{name}.gpx.gz"
        options = OpenOptions(combine=CombineOptions(truth=[watch]))
        result = run_convert([folder / "walks" / f"{name}.txt"], tmp_path / name, options)
        assert any("UTC+01:00 (by positions" in note for note in result.notes)


def test_a_receiver_agrees_with_its_reference(shared_data, tmp_path):
    folder = shared_data / "gnss-android-vehicle"
    receiver, reference = next(folder.glob("*.nmea.gz")), next(folder.glob("*.gga.gz"))
    options = OpenOptions(combine=CombineOptions(truth=[reference]))
    result = run_convert([receiver], tmp_path / "log", options)
    assert any("agree within 0.5 m" in note for note in result.notes)
    log = read_log(tmp_path / "log")
    assert len(log.gnss) == 1653
    assert log.truth_length_m == pytest.approx(8700, rel=0.02)


def least_squares_place(places_m, ranges_m, sigma_m):
    """Return the position of one epoch, with a plain model of the troposphere."""
    state = np.array([-2.7e6, -4.3e6, 3.85e6, 0.0])
    for _ in range(8):
        away = np.linalg.norm(places_m - state[:3], axis=1)
        line = (places_m - state[:3]) / away[:, None]
        up = line @ (state[:3] / np.linalg.norm(state[:3]))
        delay = 2.4 / np.maximum(up, 0.1) + 5.0 / np.maximum(up, 0.2)
        design = np.c_[-line, np.ones(len(away))] / sigma_m[:, None]
        residual = (ranges_m - away - state[3] - delay) / sigma_m
        state = state + np.linalg.lstsq(design, residual, rcond=None)[0]
    return state[:3]


@pytest.mark.parametrize(
    ("log", "orbits"),
    [
        ("pseudoranges_log_2016_06_30_21_26_07.txt.gz", "hour1820.16n"),
        ("pseudoranges_log_2016_08_22_14_45_50.txt.gz", "hour2350.16n"),
    ],
)
def test_pseudoranges_and_ephemerides_give_the_phone_s_place(log, orbits, shared_data):
    from pyproj import Transformer

    folder = shared_data / "gnss-android-vehicle"
    recording = read_recording(folder / log)
    rows = recording.tables["satellites"]
    rows = rows[(rows["sigma_m"] < 100) & rows["satellite"].astype(str).str.startswith("G")]
    ephemerides = read_recording(folder / orbits).tables["ephemerides"]
    placed, _ = place_by_broadcast(rows, ephemerides)
    found = [
        least_squares_place(
            epoch[["x_m", "y_m", "z_m"]].to_numpy(),
            epoch["pseudorange_m"].to_numpy(),
            np.maximum(epoch["sigma_m"].to_numpy(), 3.0),
        )
        for _, epoch in placed.dropna(subset="x_m").groupby("time_s")
        if len(epoch) >= 5
    ]
    lon, lat, _ = Transformer.from_crs(4978, 4979, always_xy=True).transform(*np.array(found).T)
    fix = recording.tables["positions"][["lon_deg", "lat_deg"]].median()
    crs = utm_crs(fix["lon_deg"], fix["lat_deg"])
    here, there = project(crs, lon, lat), project(crs, fix["lon_deg"], fix["lat_deg"])
    error_m = np.hypot(here[0] - there[0], here[1] - there[1])
    assert len(error_m) >= 200
    assert np.median(error_m) < 10.0
