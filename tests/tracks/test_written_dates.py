"""Dates as spreadsheets, phones and receivers write them: other orders, and no separators."""

import pandas as pd
import pytest

import mapfilter as mf
from mapfilter.errors import InputError

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
        "Wed May 13 {} GMT+00:00 2026",
        "Wed May 13 {} UTC 2026",
        "Wed May 13 {} 2026",
        '"Wed, 13 May 2026 {} GMT"',
        "2026-05-13T{}+00:00[Europe/London]",
    ],
)
def test_dates_that_are_of_one_order_are_read(tmp_path, times):
    """All were refused."""
    day = [times.format(clock) for clock in ("10:00:58", "10:00:59", "10:01:00")]
    log = read(tmp_path, "time", day)
    assert log.start_utc_s + log.gnss["time_s"].iloc[0] == START_S
    assert log.gnss["time_s"].tolist() == [0.0, 1.0, 2.0]


@pytest.mark.parametrize("digits", ["20260513{}", "20260513{}000"])
def test_times_without_separators_are_no_unix_times(tmp_path, digits):
    """They were taken for the year 2612."""
    log = read(tmp_path, "time", [digits.format(one) for one in (100058, 100059, 100100)])
    assert log.start_utc_s == START_S
    assert log.gnss["time_s"].tolist() == [0.0, 1.0, 2.0]


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
