"""Dates as spreadsheets, phones and receivers write them: other orders, and no separators."""

import numpy as np
import pandas as pd
import pytest

import mapfilter as mf
from mapfilter.errors import InputError
from mapfilter.tracks.readers.formats import read_recording
from mapfilter.tracks.readers.texts import text

DAY_S = 86_400.0
START_S = pd.Timestamp("2026-05-13T10:00:58Z").timestamp()


def read(tmp_path, header, times, zone="+00:00"):
    rows = [f"{one},60.1{i:04d},24.9" for i, one in enumerate(times)]
    path = tmp_path / "drive.csv"
    path.write_text("\n".join([f"{header},lat,lon", *rows]) + "\n")
    return mf.read_log(path, zone=zone)


@pytest.mark.parametrize(
    "times",
    [
        "13/05/2026 {}",
        "5/13/2026 {}",
        "13-05-2026 {}",
        "13/05/2026T{}Z",
        '"13/05/2026, {}"',
        '"5/13/2026, {} AM"',
        "Wed May 13 {} GMT+00:00 2026",
        "Wed May 13 {} UTC 2026",
        "Wed May 13 {} 2026",
        '"Wed, 13 May 2026 {} GMT"',
        "Wed May 13 2026 {} GMT+0000 (Coordinated Universal Time)",
        "2026-05-13T{}+00:00[Europe/London]",
        "2026-05-13T{}+00:00[Etc/GMT+0]",
        "13/05/26 {}",
        "05/13/26 {}",
        "13-05-26 {}",
        "13.05.26 {}",
        "2026.05.13 {}",
        "2026.05.13_{}",
        "2026-05-13_{}",
        "20260513 {}",
        "20260513-{}",
        '"May 13, 2026, {} AM"',
        "Wed May 13 {} WET 2026",
        "2026-05-13 {} WET",
        "{} 13/05/2026",
        "{} 2026-05-13",
        '"13.05.2026, {}"',
        "2026/05/13-{}",
        "2026:05:13 {}",
        "2026-133T{}",
        "2026:133:{}",
        "2026年5月13日 {}",
        "13-MAY-26 {}",
        "13-May-26 {} AM",
        "2026-05-13 {} UTC+0",
        "2026-05-13 {} GMT+00:00",
    ],
)
def test_dates_that_are_of_one_order_are_read(tmp_path, times):
    """All were refused."""
    day = [times.format(clock) for clock in ("10:00:58", "10:00:59", "10:01:00")]
    log = read(tmp_path, "time", day)
    assert log.start_utc_s + log.gnss["time_s"].iloc[0] == START_S
    assert log.gnss["time_s"].tolist() == [0.0, 1.0, 2.0]


@pytest.mark.parametrize("digits", ["20260513{}", "20260513{}000", "20260513{}.0", "20260513{}Z"])
def test_times_without_separators_are_no_unix_times(tmp_path, digits):
    """They were taken for the year 2612."""
    log = read(tmp_path, "time", [digits.format(one) for one in (100058, 100059, 100100)])
    assert log.start_utc_s == START_S
    assert log.gnss["time_s"].tolist() == [0.0, 1.0, 2.0]


def test_one_time_without_separators_among_unix_times_is_left_out(tmp_path):
    """It was taken for a time, and the file's clock for a local one."""
    unix_ms = [int(1000 * START_S) + 1000 * n for n in range(5)]
    log = read(tmp_path, "time", [*unix_ms, 20260513100059], zone="Europe/Berlin")
    assert log.gnss["time_s"].tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]
    assert any("zone has no effect" in note for note in log.notes)


@pytest.mark.parametrize("begin", [19_500_000_000_000, 18_999_999_999_999])
def test_nanoseconds_of_a_phone_are_no_dates(tmp_path, begin):
    """Those of five to six hours after its start were said to be none of the usual times."""
    with pytest.raises(InputError, match="5 rows: time: not between 1980 and 2100"):
        read(tmp_path, "time", [begin + n * 1_000_000_000 for n in range(5)])


def test_one_date_shows_the_order_of_all(tmp_path):
    log = read(tmp_path, "time", ["12/05/2026 23:59:59", "13/05/2026 00:00:00"])
    assert log.gnss["time_s"].tolist() == [0.0, 1.0]
    assert any("the day first in dates" in note for note in log.notes)
    for unclear in (["12/05/2026 23:59:59"], ["13/05/2026 10:00:00", "05/13/2026 10:00:01"]):
        with pytest.raises(InputError, match="day or month first"):
            read(tmp_path, "time", unclear)


@pytest.mark.parametrize("date", ["20260513", "130526", "260513", " 260513"])
def test_times_of_digits_follow_dates_of_digits(tmp_path, date):
    """The date was not used, and 100100 taken for 41 s after 100059."""
    log = read(tmp_path, "date,time", [f"{date},{one}" for one in (100058, 100059, "100100.0")])
    assert log.start_utc_s == START_S
    assert log.gnss["time_s"].tolist() == [0.0, 1.0, 2.0]


def test_a_spreadsheet_drops_zeros_before_digits(tmp_path):
    log = read(tmp_path, "date,time", ["10526,95959", "10526,100000"])
    assert log.start_utc_s == pd.Timestamp("2026-05-01T09:59:59Z").timestamp()
    assert log.gnss["time_s"].tolist() == [0.0, 1.0]


def test_a_date_of_two_orders_is_not_joined(tmp_path):
    log = read(tmp_path, "date,time", ["210523,95959", "210523,100000"])
    assert log.gnss["time_s"].tolist() == [0.0, 1.0]
    assert any("date: 210523: day or year first?" in note for note in log.notes)


def test_a_column_in_utc_needs_no_zone(tmp_path):
    log = read(tmp_path, "time (utc)", ["2026-05-13 10:00:58"], zone="Europe/Berlin")
    assert log.start_utc_s == START_S
    assert any("zone has no effect" in note for note in log.notes)


@pytest.mark.parametrize(
    ("header", "rows"),
    [
        # Seconds of the day beside a date.
        ("date,time", [f"20260513,{36_058 + n}" for n in range(60)]),
        # Days of a spreadsheet, and numbers that are no dates.
        ("date,time", [f"46143,{10_150 + n / 10:g}" for n in range(50)]),
        ("last_update,time", [f"260513,{10_100 + n}" for n in range(50)]),
        ("candidates,time", [f"{12_000 + n},{10_100 + n}" for n in range(50)]),
        # The index of a table, as pandas writes it.
        (",time", [f"{12_000 + n},{10_100 + n}" for n in range(50)]),
    ],
)
def test_seconds_beside_other_numbers_are_no_times_of_day(tmp_path, header, rows):
    """They were refused, or noted as times of day whose date is not clear."""
    log = read(tmp_path, header, rows)
    assert len(log.gnss) == len(rows)
    assert np.isnan(log.start_utc_s)
    assert not any("day or year first" in note or "of the day" in note for note in log.notes)


def test_a_whole_date_of_digits_may_be_of_any_year(tmp_path):
    """Before 2016 it was said to be of two orders."""
    log = read(tmp_path, "date,time", ["20150513,100058", "20150513,100059"])
    assert log.start_utc_s == pd.Timestamp("2015-05-13T10:00:58Z").timestamp()


def test_parts_of_a_file_have_one_order(tmp_path, monkeypatch):
    """The first was seconds of a day, the next ones Unix times; and 5 was no time."""
    monkeypatch.setattr(text, "_PART_BYTES", 512)
    clear = [f"130526,2359{n:02d}" for n in range(60)] + [f"140526,{n}" for n in range(60)]
    log = read(tmp_path, "date,time", clear)
    assert log.gnss["time_s"].tolist() == list(range(120))
    assert log.start_utc_s == pd.Timestamp("2026-05-13T23:59:00Z").timestamp()
    unclear = [one.replace("130526", "310526").replace("140526", "10626") for one in clear]
    log = read(tmp_path, "date,time", unclear)
    assert np.isnan(log.start_utc_s)
    assert np.ptp(log.gnss["time_s"]) < 86_400


@pytest.mark.parametrize(
    "times",
    [
        ["13/05/2026 10.00.58", "13/05/2026 10.00.59"],
        ["2026:133:36058", "2026:133:36059"],
        ['"2026-05-13 10:00:58,000"', '"2026-05-13 10:00:59,000"'],
        ["13-MAY-26 10.00.58.000000 AM", "13-MAY-26 10.00.59.000000 AM"],
        ["2026-05-13 12:00:58 UTC+2", "2026-05-13 12:00:59 UTC+2"],
        ["2026-05-13 05:00:58 GMT-5", "2026-05-13 05:00:59 GMT-5"],
        ["2026-05-13 15:30:58 UTC+05:30", "2026-05-13 15:30:59 UTC+05:30"],
    ],
)
def test_times_of_day_and_offsets_of_other_layouts(tmp_path, times):
    log = read(tmp_path, "time", times)
    assert log.start_utc_s == START_S
    assert log.gnss["time_s"].tolist() == [0.0, 1.0]


@pytest.mark.parametrize("day", ["2026-366", "2026-000", "2026-999"])
def test_days_that_a_year_has_not_are_no_times(tmp_path, day):
    with pytest.raises(InputError, match="expected seconds, Unix time, or ISO 8601"):
        read(tmp_path, "time", [f"{day}T10:00:00"])
    log = read(tmp_path, "time", ["2024-366T23:59:59", "2025-001T00:00:00"])
    assert log.gnss["time_s"].tolist() == [0.0, 1.0]


@pytest.mark.parametrize("clocks", [("10.00.58", "10.00.59"), ("10-00-58", "10-00-59")])
def test_times_as_names_of_files_have_them(tmp_path, clocks):
    for date in ("2026.05.13_{}", "2026-05-13_{}", "2026-05-13 {}"):
        log = read(tmp_path, "time", [date.format(one) for one in clocks])
        assert log.start_utc_s == START_S, date


@pytest.mark.parametrize(
    "unclear",
    [
        ["11/05/26 10:00:00"],  # the 11th of May, of 2026, or the 5th of November
        ["20/05/26 10:00:00"],  # 2026, or 2020-05-26
        ["13/05/26 10:00:00", "05/13/26 10:00:00"],
        ["13/05/99 10:00:00"],
    ],
)
def test_short_years_that_may_be_read_in_several_orders_are_refused(tmp_path, unclear):
    with pytest.raises(InputError, match="the day, the month, the year\\? Write 2026-05-13"):
        read(tmp_path, "time", unclear)


def test_a_guess_of_the_order_is_noted(tmp_path):
    log = read(tmp_path, "time", ["13/05/26 10:00:00", "13/05/26 10:00:01"])
    assert any("the day first in dates with a short year" in note for note in log.notes)
    # Numbers of a single digit have no short year before them.
    log = read(tmp_path, "time", ["13/5/26 23:59:59", "14/5/26 00:00:00"])
    assert log.gnss["time_s"].tolist() == [0.0, 1.0]


def test_dates_and_minutes_without_separators(tmp_path):
    """They were taken for milliseconds since a phone was started."""
    log = read(tmp_path, "time", ["202605131000", "202605131001", "202605131100"])
    assert log.start_utc_s == START_S - 58
    assert log.gnss["time_s"].tolist() == [0.0, 60.0, 3600.0]


def test_names_of_zones_that_have_one_offset_are_read(tmp_path):
    """They were refused, without a remedy."""
    log = read(tmp_path, "time", ["2026-05-13 12:00:58 CEST", "2026-05-13 12:00:59 CEST"], zone="")
    assert log.start_utc_s == START_S
    assert any("CEST taken for UTC+02:00" in note for note in log.notes)
    log = read(tmp_path, "time", ["2026-10-25 02:59:59 CEST", "2026-10-25 02:00:00 CET"], zone="")
    assert log.gnss["time_s"].tolist() == [0.0, 1.0]
    log = read(tmp_path, "time", ["Wed May 13 12:00:58 CEST 2026"], zone="")
    assert log.start_utc_s == START_S


def test_names_of_several_zones_are_those_of_the_zone_that_is_given(tmp_path):
    times = ["2026-01-13 10:00:58 EST", "2026-01-13 10:00:59 EST"]
    with pytest.raises(InputError, match="EST is of several zones; zone America/New_York"):
        read(tmp_path, "time", times, zone="")
    with pytest.raises(InputError, match="write the offset"):
        read(tmp_path, "time", times, zone="Europe/Berlin")
    log = read(tmp_path, "time", times, zone="America/New_York")
    assert log.start_utc_s == pd.Timestamp("2026-01-13T15:00:58Z").timestamp()
    with pytest.raises(InputError, match="XYZ is no known zone"):
        read(tmp_path, "time", ["2026-01-13 10:00:58 XYZ"], zone="")


@pytest.mark.parametrize(
    ("header", "layout", "days"),
    [
        ("time", "{:02d}/05/2026 10:00:00", 27),
        ("date,time", "{:02d}/05/2026,10:00:00", 27),
        ("date,hour,min", "{:02d}/05/2026,10,00", 27),
        ("time", "{:02d}/05/26 10:00:00", 15),
    ],
)
def test_a_later_part_of_a_file_shows_the_order_of_dates(
    tmp_path, monkeypatch, header, layout, days
):
    """A file whose first part has only days up to 12 was refused."""
    monkeypatch.setattr(text, "_PART_BYTES", 100)
    path = tmp_path / "drive.csv"
    rows = [f"{layout.format(day)},60.1,24.{day}" for day in range(1, days + 1)]
    path.write_text("\n".join([f"{header},lat,lon", *rows]) + "\n")
    found = read_recording(path)
    assert np.diff(found.tables["positions"]["time_s"]).tolist() == [DAY_S] * (days - 1)
    assert sum("the day first in dates" in note for note in found.notes) == 1
    path.write_text("\n".join([f"{header},lat,lon", *rows[:12]]) + "\n")
    with pytest.raises(InputError, match=r"day or month first|which number is the day"):
        read_recording(path)


def test_a_date_with_hours_and_minutes_is_no_midnight(tmp_path):
    """All rows had the time of midnight."""
    log = read(tmp_path, "date,hour,min", ["2026-05-13,10,0", "2026-05-13,10,1"])
    assert log.start_utc_s == START_S - 58
    assert log.gnss["time_s"].tolist() == [0.0, 60.0]
    assert any("whole minutes" in note for note in log.notes)


def test_days_of_a_year_and_seconds_of_the_day(tmp_path):
    """They were refused, as without times."""
    log = read(tmp_path, "year,doy,sod", ["2026,133,36058.0", "2026,133,36058.5"], zone="")
    assert log.start_utc_s == START_S
    assert log.gnss["time_s"].tolist() == [0.0, 0.5]
    assert any("if it is GPS time, 18 s ahead of it" in note for note in log.notes)
    log = read(tmp_path, "year,doy,hour,min,sec", ["2026,133,10,0,58", "2026,134,0,0,0"])
    assert log.start_utc_s == START_S


@pytest.mark.parametrize("text", ["2026-05-01-02:00", "2026-05-01-05"])
def test_a_date_of_xml_with_its_offset_is_no_time(tmp_path, text):
    """The offset was taken for a time of day."""
    with pytest.raises(InputError, match="row 2, time: expected"):
        read(tmp_path, "time", [text])
