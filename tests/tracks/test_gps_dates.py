"""Dates of GPS that were misread: weeks counted anew, seconds since 1980, seconds of the week."""

from datetime import UTC, datetime

import numpy as np
import pandas as pd
import pytest

import mapfilter as mf
from mapfilter.clocks.times import utc_from_week_s
from mapfilter.errors import InputError
from mapfilter.tracks.open_log import open_log
from mapfilter.tracks.readers.format import ReadOptions
from mapfilter.tracks.readers.formats import read_recording

COUNT = 600
UTC_S = datetime(2026, 5, 1, 10, tzinfo=UTC).timestamp()
LEAPS_S = 18
SINCE_1980_S = datetime(1980, 1, 6, tzinfo=UTC).timestamp() - LEAPS_S
"""Unix time less seconds of GPS, in 2026."""
WEEK_S, ERA_S = 604_800, 1024 * 604_800
ELAPSED_S = np.arange(float(COUNT))
WAY = {"lat": 60 + ELAPSED_S / 1e4, "lon": 25.0 + (ELAPSED_S % 60) / 1e5}


def written(path, time_s, **columns):
    pd.DataFrame({"time": time_s, **columns}).to_csv(path, index=False)
    return path


def cells(path, time_s=UTC_S, **more):
    identity = {"mcc": 244, "mnc": 5, "lac": 7, "ci": 1234, "rsrp": -90}
    return written(path, time_s + ELAPSED_S[::10], **identity, **more)


def gnss_begins_at(log):
    return log.start_utc_s + float(log.gnss["time_s"].iloc[0])


@pytest.mark.parametrize("first", ["fixes", "cells"])
@pytest.mark.parametrize(
    ("early_s", "cause"),
    [
        (ERA_S, "the date of a receiver whose week number began anew"),
        (SINCE_1980_S, "seconds of GPS time since 1980"),
    ],
)
def test_dates_that_are_early_are_those_of_the_other_files(tmp_path, early_s, cause, first):
    fixes = written(tmp_path / "fixes.csv", UTC_S - early_s + ELAPSED_S, **WAY)
    files = [fixes, cells(tmp_path / "cells.csv")]
    log = mf.read_log(files if first == "fixes" else files[::-1])
    assert gnss_begins_at(log) == UTC_S
    assert f"fixes.csv: +{early_s:.0f} s, by the other files: {cause}" in log.notes
    assert log.start_utc_s + log.radio["time_s"].iloc[0] == UTC_S


def test_recordings_of_other_years_are_left_where_they_are(tmp_path):
    """Two days beside the mistakes, and where another file has the early date, too."""
    fixes = written(tmp_path / "fixes.csv", UTC_S - ERA_S - 2 * 86_400 + ELAPSED_S, **WAY)
    with pytest.raises(mf.MapfilterError, match="tables that overlap in time"):
        mf.read_log([fixes, cells(tmp_path / "cells.csv")])
    written(fixes, UTC_S - ERA_S + ELAPSED_S, **WAY)
    log = mf.read_log([fixes, cells(tmp_path / "early.csv", UTC_S - ERA_S)])
    assert gnss_begins_at(log) == UTC_S - ERA_S


def test_the_name_of_a_file_contradicts_its_dates(tmp_path):
    for early_s, days in ((ERA_S, "2006-09-15"), (SINCE_1980_S, "2016-04-26")):
        path = written(tmp_path / "drive_2026-05-01.csv", UTC_S - early_s + ELAPSED_S, **WAY)
        (note,) = mf.read_log(path).notes
        assert f"times are of {days}, but 2026-05-01 by its name" in note
        assert f'offsets_s={{"{path.name}": {early_s:.0f}}} for 2026-05-01)' in note
    assert mf.read_log(written(path, UTC_S + ELAPSED_S, **WAY)).notes == ()
    # Another day is no mistake of GPS.
    other = written(tmp_path / "drive_20250501.csv", UTC_S - ERA_S + ELAPSED_S, **WAY)
    assert mf.read_log(other).notes == ()


@pytest.mark.parametrize(
    ("technology", "time_s", "offsets"),
    [
        ("LTE", UTC_S - ERA_S, [f"{ERA_S} for 2026-05-01", "315964783 for 2016-09-19"]),
        ("NR", UTC_S - SINCE_1980_S, [f"{ERA_S} for 2035-12-1", "315964782 for 2026-05-01"]),
        ("NR", UTC_S, []),
        ("GSM", UTC_S - ERA_S, []),
    ],
)
def test_no_phone_used_a_network_before_it_was_opened(tmp_path, technology, time_s, offsets):
    path = cells(tmp_path / "cells.csv", time_s, technology=technology, lat=60.0, lon=25.0)
    notes = [note for note in mf.read_log(path).notes if "times are of" in note]
    assert len(notes) == bool(offsets)
    for offset in offsets:
        assert f'offsets_s={{"cells.csv": {offset.replace(" for", "} for")}' in notes[0]


def test_seconds_of_the_week_get_the_week_of_the_other_file(tmp_path):
    """Also over the end of a week, where they begin anew."""
    elapsed_s = (UTC_S - SINCE_1980_S) % WEEK_S
    for begin_s in (UTC_S, UTC_S + WEEK_S - elapsed_s - COUNT / 2):
        tow_s = (begin_s - SINCE_1980_S + ELAPSED_S) % WEEK_S
        fixes = written(tmp_path / "fixes.csv", tow_s, **WAY)
        log = mf.read_log([fixes, cells(tmp_path / "cells.csv", begin_s)])
        assert gnss_begins_at(log) == begin_s
        assert np.ptp(log.gnss["time_s"]) == COUNT - 1
        assert any("as seconds of the GPS week" in note for note in log.notes)
        anew = any("of the GPS week begin anew" in note for note in log.notes)
        assert anew == (begin_s != UTC_S)


def test_elapsed_seconds_are_none_of_a_week(tmp_path):
    fixes = written(tmp_path / "fixes.csv", ELAPSED_S, **WAY)
    sunday_s = UTC_S - (UTC_S - SINCE_1980_S) % WEEK_S
    with pytest.raises(mf.MapfilterError, match="expected positions or speeds in common"):
        mf.read_log([fixes, cells(tmp_path / "cells.csv", sunday_s)])


def test_times_of_day_are_no_seconds_of_a_week(tmp_path):
    """On a Sunday, with which weeks of GPS begin."""
    sunday_s = UTC_S + 2 * 86_400
    place = "6010.2000,N,02456.1000,E,1,08,1.0,20.0,M,18.0,M,,"
    lines = [f"$GPGGA,{100_000 + k // 60 * 100 + k % 60},{place}" for k in range(COUNT)]
    (tmp_path / "fixes.nmea").write_text("\n".join(lines))
    digits = 100_000 + ELAPSED_S // 60 * 100 + ELAPSED_S % 60
    for fixes in (tmp_path / "fixes.nmea", written(tmp_path / "fixes.csv", digits, **WAY)):
        with pytest.raises(mf.MapfilterError, match="expected positions or speeds in common"):
            mf.read_log([fixes, cells(tmp_path / "cells.csv", sunday_s)])


@pytest.mark.parametrize(
    ("name", "counted", "told"),
    [
        ("week", 0, ""),
        ("gps_week", 0, ""),
        ("gps_week", 2048, "gps_week: weeks counted modulo 1024, taken for those since 2019-04-07"),
    ],
)
def test_a_column_of_weeks_dates_seconds_of_the_week(tmp_path, name, counted, told):
    of_gps_s = UTC_S - SINCE_1980_S + ELAPSED_S
    week = (of_gps_s // WEEK_S).astype(int) - counted
    path = tmp_path / "fixes.csv"
    pd.DataFrame({name: week, "tow": of_gps_s % WEEK_S, **WAY}).to_csv(path, index=False)
    recording = read_recording(path)
    assert recording.clock.kind == "gps"
    assert recording.tables["positions"]["time_s"].tolist() == (UTC_S + ELAPSED_S).tolist()
    notes = [f"time: seconds of the GPS week in column {name}", *([told] if told else [])]
    assert list(recording.notes) == notes


def test_weeks_of_a_year_are_none_of_gps(tmp_path):
    path = written(tmp_path / "fixes.csv", ELAPSED_S, week=18, **WAY)
    assert read_recording(path).clock.kind == "monotonic"


def test_weeks_begin_anew_between_parts_of_a_file(tmp_path, monkeypatch):
    """A large file is read by parts, of which the later ones go on."""
    monkeypatch.setattr("mapfilter.tracks.readers.texts.text._PART_BYTES", 1 << 12)
    tow_s = (WEEK_S - 100 + ELAPSED_S) % WEEK_S
    path = written(tmp_path / "fixes.csv", tow_s, **WAY)
    rows = read_recording(path, options=ReadOptions()).tables["positions"]
    assert rows["time_s"].tolist() == (WEEK_S - 100 + ELAPSED_S).tolist()


def weeks_and_seconds(week, begin_tow_s, count, stays):
    """Return weeks and seconds of them; the week stays so many rows after its end, or for good."""
    total_s = begin_tow_s + np.arange(count, dtype=float)
    over = np.flatnonzero(total_s >= WEEK_S)[0]
    weeks = np.full(count, week)
    weeks[over + stays if stays is not None else count :] += 1
    return weeks, total_s % WEEK_S


@pytest.mark.parametrize("stays", [0, 1, 37, None])
@pytest.mark.parametrize("part_bytes", [1 << 24, 1000])
def test_a_week_that_stays_when_its_seconds_begin_anew(tmp_path, monkeypatch, stays, part_bytes):
    monkeypatch.setattr("mapfilter.tracks.readers.texts.text._PART_BYTES", part_bytes)
    lines = 300
    weeks, tow_s = weeks_and_seconds(2416, WEEK_S - 102, lines, stays)
    rows = {"week": weeks, "tow": tow_s, "latitude": 60 + 1e-6 * np.arange(lines)}
    pd.DataFrame({**rows, "longitude": 25.0}).to_csv(tmp_path / "walk.csv", index=False)
    log = open_log([tmp_path / "walk.csv"]).log
    np.testing.assert_array_equal(log.gnss["time_s"], np.arange(lines))
    assert log.start_utc_s == utc_from_week_s(2416, WEEK_S - 102)
    told = [note for note in log.notes if "week: stays where" in note]
    assert len(told) == (stays != 0)
    assert not any("sorted" in note for note in log.notes)


def test_a_pause_of_a_week_stays_one(tmp_path):
    tow_s = np.tile(np.arange(1000.0, 1100.0), 2)
    rows = {"week": np.repeat([2416, 2417], 100), "tow": tow_s, "latitude": 60.0}
    table = pd.DataFrame({**rows, "longitude": 25 + 1e-5 * np.arange(200)})
    table.to_csv(tmp_path / "walk.csv", index=False)
    log = open_log([tmp_path / "walk.csv"]).log
    assert np.diff(log.gnss["time_s"]).max() == WEEK_S - 99


@pytest.mark.parametrize(("fall_s", "named"), [(43_199, True), (43_200, True), (40_000, False)])
def test_hours_of_1_to_12_without_am_and_pm_are_named(tmp_path, fall_s, named):
    seconds = np.arange(300) + np.where(np.arange(300) < 120, 0, -fall_s)
    times = pd.to_datetime(1_777_640_280 + seconds, unit="s").strftime("%Y-%m-%d %H:%M:%S")
    rows = {"time": times, "latitude": 60 + 1e-6 * np.arange(300), "longitude": 25.0}
    pd.DataFrame(rows).to_csv(tmp_path / "walk.csv", index=False)
    notes = open_log([tmp_path / "walk.csv"]).log.notes
    assert any("sorted" in note for note in notes)
    assert any("hours of 1 to 12 without AM or PM" in note for note in notes) == named


@pytest.mark.parametrize(
    ("name", "times"), [("tow_ms", 1000), ("gps_tow_ms", 1000), ("tow [s]", 1)]
)
def test_seconds_of_the_week_in_another_unit(tmp_path, name, times):
    tow_s = 468_018 + np.arange(300)
    rows = {"gps_week": 2416, name: times * tow_s, "latitude": 60 + 1e-6 * np.arange(300)}
    pd.DataFrame({**rows, "longitude": 25.0}).to_csv(tmp_path / "walk.csv", index=False)
    log = open_log([tmp_path / "walk.csv"]).log
    assert log.start_utc_s == utc_from_week_s(2416, 468_018)
    assert log.duration_s == 299.0


@pytest.mark.parametrize("year", [2106, 2150, 1979])
def test_years_that_are_not_read_are_named(tmp_path, year):
    times = [f"{year}-02-07T06:27:{second:02d}Z" for second in range(60)]
    rows = {"time": times, "latitude": 60 + 1e-6 * np.arange(60), "longitude": 25.0}
    pd.DataFrame(rows).to_csv(tmp_path / "walk.csv", index=False)
    with pytest.raises(InputError, match=r"1980 (to 2099 are read|and 2100)"):
        open_log([tmp_path / "walk.csv"])
