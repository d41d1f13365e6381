"""Local times over the hour that a clock passes twice or not at all, and zones that are found."""

from datetime import datetime
from zoneinfo import ZoneInfo

import numpy as np
import pandas as pd
import pytest

import mapfilter as mf
from mapfilter.clocks.local_times import utc_from_local_s
from mapfilter.clocks.times import parse_times
from mapfilter.errors import InputError
from mapfilter.tracks.readers import gpx
from mapfilter.tracks.readers.format import ReadOptions
from mapfilter.tracks.readers.formats import read_recording
from mapfilter.tracks.readers.texts import lines, text

BERLIN = "Europe/Berlin"
BACK_S = datetime(2026, 10, 25, 1, tzinfo=ZoneInfo("UTC")).timestamp()
FORWARD_S = datetime(2026, 3, 29, 1, tzinfo=ZoneInfo("UTC")).timestamp()


def local_s(utc_s, zone=BERLIN):
    """Local times as if their zone were UTC, by the standard library."""
    moments = [datetime.fromtimestamp(time, ZoneInfo(zone)) for time in np.asarray(utc_s).tolist()]
    return np.asarray(utc_s) + [moment.utcoffset().total_seconds() for moment in moments]


@pytest.mark.parametrize("step_s", [0.2, 1.0, 60.0, 600.0])
@pytest.mark.parametrize("change_s", [BACK_S, FORWARD_S])
@pytest.mark.parametrize(
    ("begin_s", "end_s"),
    [(-600, 600), (-6000, 9000), (-3000, 9000), (-3599, 3599), (10, 9000), (-9000, -10)],
)
def test_a_clock_that_changes_on_the_way(step_s, change_s, begin_s, end_s):
    utc_s = change_s + np.arange(begin_s, end_s, step_s)
    found = utc_from_local_s(local_s(utc_s), BERLIN)
    np.testing.assert_allclose(found, utc_s, atol=1e-6)


def test_the_first_pass_where_nothing_tells():
    """Also of a single time, and of rows with missing times between."""
    utc_s = BACK_S - 600.0 + np.arange(0.0, 500.0)
    np.testing.assert_array_equal(utc_from_local_s(local_s(utc_s), BERLIN), utc_s)
    assert utc_from_local_s(local_s([BACK_S - 600.0]), BERLIN).tolist() == [BACK_S - 600.0]
    times = np.array([np.nan, BACK_S - 60.0, np.nan, BACK_S + 60.0, np.nan])
    given = np.where(np.isfinite(times), local_s(np.nan_to_num(times)), np.nan)
    np.testing.assert_array_equal(utc_from_local_s(given, BERLIN), times)


PARTS = [(-1800, 600), (-1800, 3000), (-6000, 9000), (600, 6000), (3000, 4000)]
"""Begin and end of files; the last two begin within the second pass."""
STEP_S = 3.0
"""From row to row: fewer parts than of each second, and several within either pass still."""
NO_PASS = "passes twice"


@pytest.mark.parametrize(("begin_s", "end_s"), PARTS)
def test_parts_of_a_large_file_follow_each_other(tmp_path, monkeypatch, begin_s, end_s):
    """Parts within the second pass were an hour early, and rows lost as duplicates."""
    monkeypatch.setattr(text, "_PART_BYTES", 1 << 14)
    utc_s = BACK_S + np.arange(begin_s, end_s)
    local = pd.to_datetime(local_s(utc_s), unit="s").strftime("%Y-%m-%d %H:%M:%S")
    rows = pd.DataFrame({"time": local, "pressure_hpa": 1000.0})
    rows.to_csv(tmp_path / "phone.csv", index=False)
    found = read_recording(tmp_path / "phone.csv", options=ReadOptions(zone=BERLIN))
    np.testing.assert_array_equal(found.tables["barometer"]["time_s"], utc_s)
    assert not [note for note in found.notes if NO_PASS in note]


def exported(name, utc_s):
    """A drive as a program of drive tests writes it, in local times."""
    moments = pd.to_datetime(local_s(utc_s), unit="s")
    lat, lon = 52.5 + 1e-5 * np.arange(len(utc_s)), np.full(len(utc_s), 13.4)
    level, cell = -80 - np.arange(len(utc_s)) % 7, 101 + np.arange(len(utc_s)) // 50
    if name == "tems":
        head = ("Timestamp", "MS", "Message Type", "All-Latitude", "All-Longitude", "All-LAC")
        head += ("All-Cell Id", "All-BSIC (Num)", "All-ARFCN BCCH", "All-RxLev Full (dBm)")
        columns = (moments.strftime("%d/%m/%Y %H:%M:%S.000"), "MS1", "Measurement Report", lat, lon)
        columns += (3021, cell, 42, 61, level)
        return dict(zip(head, columns, strict=True)), "\t"
    if name == "gnettrack":
        head = ("Timestamp", "Longitude", "Latitude", "Speed", "Operator", "CellID", "LAC")
        head += ("NetworkTech", "NetworkMode", "Level", "ARFCN", "PSC", "Node", "CGI")
        columns = (moments.strftime("%Y.%m.%d_%H.%M.%S"), lon, lat, 8, "26201", cell, 3021)
        columns += ("2G", "GSM", level, 61, 42, 1, "x")
        return dict(zip(head, columns, strict=True)), "\t"
    stamps = moments.strftime("%Y-%m-%d %H:%M:%S")
    identity = {"mcc": 262, "mnc": 1, "lac": 3021}
    columns = {"lat": lat, "lon": lon, "measured_at": stamps}
    if name == "towercollector":
        own = {"cell_id": cell, "psc": 1, "asu": 20, "dbm": level, "ta": 1, "accuracy": 5.0}
        more = {"net_type": "GSM", "neighboring": "false", "device": "P"}
        return identity | own | columns | more, ","
    own = {"cellid": cell, "signal": level, "act": "GSM", "rating": 6.5, "speed": 8.0}
    return identity | own | columns, ","


@pytest.mark.parametrize("name", ["tems", "gnettrack", "towercollector", "opencellid"])
@pytest.mark.parametrize(("begin_s", "end_s"), PARTS)
def test_parts_of_large_drive_tests_follow_each_other(tmp_path, monkeypatch, name, begin_s, end_s):
    """Parts within the second pass were an hour early."""
    monkeypatch.setattr(text, "_PART_BYTES", 1 << 14)
    utc_s = BACK_S + np.arange(begin_s, end_s, STEP_S)
    columns, separator = exported(name, utc_s)
    pd.DataFrame(columns).to_csv(tmp_path / "drive.txt", index=False, sep=separator)
    found = read_recording(tmp_path / "drive.txt", options=ReadOptions(zone=BERLIN))
    assert found.format == name
    for table in ("positions", "radio"):
        np.testing.assert_array_equal(found.tables[table]["time_s"].unique(), utc_s)
    assert not [note for note in found.notes if NO_PASS in note]


def written_in_blocks(name, utc_s):
    """A recording whose text is read block by block, in local times."""
    moments = pd.to_datetime(local_s(utc_s), unit="s")
    if name == "nemo":
        lines = ['#START,00:00:00.000,,"25.10.2026"']
        times = moments.strftime("%H:%M:%S.000")
        return lines + [
            f"GPS,{time},,13.4,{52 + k * 1e-5:.5f},40,0,1,8,30" for k, time in enumerate(times)
        ]
    stamps = moments.strftime("%Y-%m-%dT%H:%M:%S")
    points = [
        f'<trkpt lat="{52 + k * 1e-5:.5f}" lon="13.4"><time>{stamp}</time></trkpt>'
        for k, stamp in enumerate(stamps)
    ]
    return ['<gpx version="1.1"><trk><trkseg>', *points, "</trkseg></trk></gpx>"]


@pytest.mark.parametrize("name", ["nemo", "gpx"])
@pytest.mark.parametrize(("begin_s", "end_s"), PARTS)
def test_blocks_of_a_large_file_follow_each_other(tmp_path, monkeypatch, name, begin_s, end_s):
    """Blocks within the second pass were an hour early."""
    monkeypatch.setattr(lines, "_BLOCK_BYTES", 1 << 14)
    monkeypatch.setattr(gpx, "_PART_BYTES", 1 << 14)
    utc_s = BACK_S + np.arange(begin_s, end_s, STEP_S)
    path = tmp_path / f"drive.{name}"
    path.write_text("\n".join(written_in_blocks(name, utc_s)) + "\n")
    found = read_recording(path, options=ReadOptions(zone=BERLIN))
    assert found.format == name
    np.testing.assert_array_equal(found.tables["positions"]["time_s"], utc_s)
    assert not [note for note in found.notes if NO_PASS in note]


def test_times_with_a_zone_among_local_ones_are_no_fall():
    texts = np.array(["2026-10-25T02:50:00", "2026-10-25T00:51:00Z", "2026-10-25T02:52:00"])
    found, zoned = parse_times(texts, BERLIN)
    assert zoned
    assert (np.diff(found) / 60).tolist() == [1.0, 1.0]


@pytest.fixture
def journey(tmp_path):
    """Fixes in UTC, and odometry in local times that lasts longer."""

    def of(begin_s, zone, *, from_s, until_s, steady=False):
        rng = np.random.default_rng(4)
        time_s = begin_s + np.arange(2400.0)
        knots = rng.uniform(0, 14, len(time_s) // 20 + 2)
        speed = np.interp(np.arange(len(time_s)) / 20, np.arange(len(knots)), knots)
        speed = np.full(len(time_s), 8.0) if steady else speed
        lat = 52.5 + np.cumsum(speed) / 111_195.0
        fixes = pd.DataFrame({"time": time_s, "lat": lat, "lon": 13.4})[from_s:until_s]
        local = pd.to_datetime(local_s(time_s, zone), unit="s").strftime("%Y-%m-%d %H:%M:%S")
        wheels = pd.DataFrame({"time": local, "wheel_speed_mps": speed, "yaw_rate_radps": 0.0})
        fixes.to_csv(tmp_path / "fixes.csv", index=False)
        wheels.to_csv(tmp_path / "wheels.csv", index=False)
        return [tmp_path / "fixes.csv", tmp_path / "wheels.csv"]

    return of


def found_zone(log):
    (note,) = [note for note in log.notes if "local time is" in note]
    return note.partition("local time is ")[2]


@pytest.mark.parametrize("from_s", [0, 1000, 1900])
@pytest.mark.parametrize("zone", [BERLIN, "Asia/Kathmandu", "America/St_Johns"])
def test_speeds_tell_the_zone_of_a_recording_that_lasts_longer(journey, zone, from_s):
    """Quarters of an hour were taken that no zone has: all of them overlap as well."""
    paths = journey(BACK_S - 1e6, zone, from_s=from_s, until_s=from_s + 450)
    hours = datetime.fromtimestamp(BACK_S - 1e6, ZoneInfo(zone)).strftime("%z")
    assert found_zone(mf.read_log(paths)) == f"UTC{hours[:3]}:{hours[3:]} (by speeds)"


def test_without_speeds_that_differ_other_zones_are_named(journey):
    paths = journey(BACK_S - 1e6, BERLIN, from_s=0, until_s=300, steady=True)
    assert found_zone(mf.read_log(paths)) == "UTC+02:00 (by the overlap of times)"
    paths = journey(BACK_S - 1e6, BERLIN, from_s=300, until_s=2300, steady=True)
    wheels = pd.read_csv(paths[1])
    earlier = pd.to_datetime(wheels["time"]) - pd.Timedelta(hours=2)
    more = wheels.assign(time=earlier.dt.strftime("%Y-%m-%d %H:%M:%S"))
    beside = pd.concat([more[::2400], wheels]).rename(columns={"wheel_speed_mps": "pressure_hpa"})
    beside.assign(pressure_hpa=1000.0)[["time", "pressure_hpa"]].to_csv(paths[1], index=False)
    found = found_zone(mf.read_log(paths))
    assert found.startswith("UTC+02:00 (by the overlap of times; UTC+")
    assert found.endswith("would do as well: zone)")


def test_a_drive_on_which_the_clock_is_set_back(journey):
    paths = journey(BACK_S - 1200.0, BERLIN, from_s=0, until_s=900)
    log = mf.read_log(paths, zone=BERLIN)
    assert log.duration_s == 2399.0
    assert not [note for note in log.notes if "backwards" in note]
    likely = "times go backwards in 1 place; sorted (likely: a clock that was set back by an hour"
    assert any(likely in note for note in mf.read_log(paths).notes)


def test_a_drive_on_which_the_clock_is_set_forward(journey):
    paths = journey(FORWARD_S - 1200.0, BERLIN, from_s=0, until_s=900)
    assert mf.read_log(paths, zone=BERLIN).duration_s == 2399.0
    with pytest.raises(InputError, match=r"2026-03-29 00:59:59 .*set forward for summer: zone"):
        mf.read_log(paths)


def notes_of(path, utc_or_local_s, zone=BERLIN, suffix=""):
    """Return the notes on times of a CSV that are written as they are."""
    times = pd.to_datetime(utc_or_local_s, unit="s").strftime("%Y-%m-%d %H:%M:%S") + suffix
    pd.DataFrame({"time": times, "pressure_hpa": 1000.0}).to_csv(path / "phone.csv", index=False)
    return read_recording(path / "phone.csv", options=ReadOptions(zone=zone)).notes


@pytest.mark.parametrize("begin_s", [-3000, 600, 1800])
def test_a_walk_within_the_hour_that_comes_twice_is_noted(tmp_path, begin_s):
    """Nothing tells its pass: it was an hour early without a word in the second one."""
    (note,) = notes_of(tmp_path, local_s(BACK_S + begin_s + np.arange(300.0)))
    assert "a clock of Europe/Berlin passes twice; taken for the first time, UTC+02:00" in note
    assert "--zone +01:00, or times with their offset" in note


def test_parts_that_all_are_within_that_hour_are_noted(tmp_path, monkeypatch):
    monkeypatch.setattr(text, "_PART_BYTES", 1 << 12)
    (note,) = notes_of(tmp_path, local_s(BACK_S - 2000 + np.arange(1000.0)))
    assert NO_PASS in note


@pytest.mark.parametrize(("begin_s", "end_s"), [(-6000, -3300), (-600, 600), (3000, 4200)])
def test_a_walk_that_leaves_or_repeats_that_hour_is_not(tmp_path, begin_s, end_s):
    assert not notes_of(tmp_path, local_s(BACK_S + np.arange(begin_s, end_s)))


@pytest.mark.parametrize("begin_s", [-300, 0, 1800, 3300])
def test_times_that_a_clock_set_forward_leaves_out_are_noted(tmp_path, begin_s):
    times_s = FORWARD_S + 3600 + begin_s + np.arange(600.0)
    (note,) = (one for one in notes_of(tmp_path, times_s) if "sorted" not in one)
    count = int(np.sum((times_s >= FORWARD_S + 3600) & (times_s < FORWARD_S + 7200)))
    assert note.startswith(f"time: {count} times are not of Europe/Berlin, from 2026-03-29 02:")
    assert "taken for UTC+01:00 (likely: a clock that was not set, --zone +01:00" in note
    days = times_s / 86_400 + 25_569
    pd.DataFrame({"time": days, "pressure_hpa": 1000.0}).to_csv(tmp_path / "d.csv", index=False)
    found = read_recording(tmp_path / "d.csv", options=ReadOptions(zone=BERLIN))
    assert any("times are not of Europe/Berlin" in one for one in found.notes)


@pytest.mark.parametrize("change_s", [BACK_S, FORWARD_S])
@pytest.mark.parametrize("suffix", ["Z", "+02:00"])
def test_times_with_their_offset_are_of_no_such_hour(tmp_path, change_s, suffix):
    assert not notes_of(tmp_path, change_s + np.arange(5400.0), suffix=suffix)
    assert not notes_of(tmp_path, change_s + np.arange(5400.0), zone="+01:00")
