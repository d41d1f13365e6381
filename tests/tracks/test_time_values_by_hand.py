"""Units, days, zones and leap seconds of recorded times, by hand."""

from datetime import UTC, datetime, timedelta

import numpy as np
import pandas as pd
import pyarrow as pa
import pytest

from mapfilter.clocks.local_times import (
    change_notes,
    is_beside_change,
    parse_zone,
    utc_from_local_s,
)
from mapfilter.clocks.plain_times import plain_times
from mapfilter.clocks.times import (
    are_days,
    in_days,
    parse_times,
    seconds_of_day,
    unix_seconds,
    utc_from_gps_s,
    utc_from_week_s,
    without_midnights,
)
from mapfilter.errors import ConfigError
from mapfilter.tracks.readers.formats import read_recording
from mapfilter.tracks.readers.nmea_stamps import _stamp_s, stamped_dates

DAY_S = 86_400.0
NAN = np.nan
BERLIN = "Europe/Berlin"


def utc_s(*moment):
    return datetime(*moment, tzinfo=UTC).timestamp()


# IERS Bulletin C: GPS time is ahead of UTC by so many seconds from these dates on.
@pytest.mark.parametrize(
    ("date", "ahead_s"),
    [
        *(((1980, 1, 6), 0), ((1981, 7, 1), 1), ((1982, 7, 1), 2), ((1983, 7, 1), 3)),
        *(((1985, 7, 1), 4), ((1988, 1, 1), 5), ((1990, 1, 1), 6), ((1991, 1, 1), 7)),
        *(((1992, 7, 1), 8), ((1993, 7, 1), 9), ((1994, 7, 1), 10), ((1996, 1, 1), 11)),
        *(((1997, 7, 1), 12), ((1999, 1, 1), 13), ((2006, 1, 1), 14), ((2009, 1, 1), 15)),
        *(((2012, 7, 1), 16), ((2015, 7, 1), 17), ((2017, 1, 1), 18), ((2026, 5, 1), 18)),
    ],
)
def test_gps_time_is_ahead_by_the_leap_seconds_of_its_date(date, ahead_s):
    elapsed_s = utc_s(*date) - utc_s(1980, 1, 6) + ahead_s
    assert float(utc_from_gps_s(elapsed_s)) == utc_s(*date)
    assert float(utc_from_gps_s(elapsed_s + 3600.25)) == utc_s(*date) + 3600.25
    if date[1:] != (6,) and date[:2] in ((1981, 7), (2017, 1)):
        # The leap second is counted as the first of the next day, and that before it as the last.
        assert float(utc_from_gps_s(elapsed_s - 1)) == utc_s(*date)
        assert float(utc_from_gps_s(elapsed_s - 1.5)) == utc_s(*date) - 0.5


def test_weeks_of_gps_count_from_1980():
    # Week 1024 began on 22 August 1999, week 2048 on 7 April 2019, week 2416 on 26 April 2026.
    dates = [utc_s(1999, 8, 22), utc_s(2019, 4, 7), utc_s(2026, 4, 26)]
    assert utc_from_week_s([1024, 2048, 2416], [13.0, 18.0, 18.0]).tolist() == dates


@pytest.mark.parametrize(
    ("number", "seconds"),
    [
        (1e11, 1e11),
        (1.00001e11, 1.00001e8),
        (1e14, 1e11),
        (1.00001e14, 1.00001e8),
        (1e17, 1e11),
        (1.00001e17, 1.00001e8),
        (-1.00001e11, -1.00001e8),
        (1_777_629_600_250.0, 1_777_629_600.25),
    ],
)
def test_units_of_unix_times_by_their_size(number, seconds):
    assert unix_seconds([number])[0] == pytest.approx(seconds, rel=1e-15)


def test_days_of_a_spreadsheet_are_of_this_century():
    """36526 is 1 January 2000, and 73050 is 31 December 2099."""
    assert [in_days(np.array([day])) for day in (36_525.9, 36_526.0, 73_050.0, 73_050.1)] == [
        *(False, True, True, False),
    ]
    near = 46_143 + np.arange(60) * 0.000_99
    assert [are_days(near), are_days(46_143 + np.arange(60) * 0.001_01)] == [True, False]


def test_times_of_a_spreadsheet_are_utc_where_the_zone_is(tmp_path):
    """46143 is 1 May 2026."""
    days = 46_143 + 10 / 24 + np.arange(30) * 2 / DAY_S
    table = pd.DataFrame({"time": days, "lat": 60 + np.arange(30) / 1e4, "lon": 24.9})
    table.to_csv(tmp_path / "days.csv", index=False)
    found = read_recording(tmp_path / "days.csv")
    expected = utc_s(2026, 5, 1, 10) + 2.0 * np.arange(30)
    assert found.tables["positions"]["time_s"].tolist() == pytest.approx(expected, abs=1e-3)
    assert found.clock.kind == "local"


def test_times_of_day_pass_midnights_by_half_a_day_and_no_less():
    times_s = np.array([86_399.0, 1.0, 43_200.0, 0.5, NAN, 86_399.5])
    counted = [86_399, 86_401, 129_600, 86_400.5, NAN, 86_399.5]
    assert without_midnights(times_s).tolist() == pytest.approx(counted, abs=1e-6, nan_ok=True)
    assert without_midnights(np.array([5.0]), before_s=2 * DAY_S - 5).tolist() == [2 * DAY_S + 5]
    assert without_midnights(np.array([5.0]), before_s=100.0).tolist() == [5.0]


def test_seconds_of_the_day_of_other_forms():
    texts = ["00:00:00", "23:59:59.999", "9:08:07", "12:00:60", "24:00:00", "12:60:00", "12:00:61"]
    found = seconds_of_day(pa.array(texts)).tolist()
    assert found == pytest.approx(
        [0, 86_399.999, 32_887, 43_260, NAN, NAN, NAN], abs=1e-6, nan_ok=True
    )


@pytest.mark.parametrize(
    ("text", "moment"),
    [
        ("31.12.2026 23:59:58", (2026, 12, 31, 23, 59, 58)),
        ("1.2.2026 03:04:05", (2026, 2, 1, 3, 4, 5)),
        ("05-Jan-2026 00:00:00", (2026, 1, 5)),
        ("5 December 2026 10:00:00", (2026, 12, 5, 10)),
        ("2026-05-01 12:00:00 AM", (2026, 5, 1)),
        ("2026-05-01 12:00:00 PM", (2026, 5, 1, 12)),
        ("2026-05-01 1:00:00 pm", (2026, 5, 1, 13)),
        ("2026-05-01 11:59:00 p.m.", (2026, 5, 1, 23, 59)),
        ("2026-05-01T10:00:00:250", (2026, 5, 1, 10, 0, 0, 250_000)),
        ("2026-05-01T10:00:00,5Z", (2026, 5, 1, 10, 0, 0, 500_000)),
        ("2026-05-01T10:00:00-03:30", (2026, 5, 1, 13, 30)),
        ("2026-05-01 10:00:00 UTC", (2026, 5, 1, 10)),
        ("2016-12-31T23:59:60Z", (2017, 1, 1)),
    ],
)
def test_dates_and_times_of_many_forms(text, moment):
    found, _ = parse_times(np.array([text], dtype=object))
    assert found.tolist() == [utc_s(*moment)]


def test_numbers_above_1e8_are_unix_times_and_others_are_none():
    texts = np.array(["100000001", "100000000", "1777629600000"], dtype=object)
    found, zoned = parse_times(texts)
    assert found.tolist() == pytest.approx([100_000_001, NAN, 1_777_629_600], abs=1e-6, nan_ok=True)
    assert zoned


def test_plain_times_are_of_1900_to_2099():
    texts = ["1899-12-31 23:59:59", "1900-01-01 00:00:00", "2099-12-31 23:59:59"]
    column = pa.chunked_array([pa.array([*texts, "2100-01-01 00:00:00"])])
    time_s, zoned = plain_times(column, "", "ISO8601", NAN)
    expected = [NAN, utc_s(1900, 1, 1), utc_s(2099, 12, 31, 23, 59, 59), NAN]
    assert time_s.tolist() == pytest.approx(expected, abs=1e-6, nan_ok=True)
    assert not zoned


@pytest.mark.parametrize(
    ("zone", "hours"),
    [
        ("+01:00", 1),
        ("-03:30", -3.5),
        ("UTC+2", 2),
        ("GMT-0130", -1.5),
        ("+15", 15),
        ("-15:00", -15),
    ],
)
def test_offsets_of_zones(zone, hours):
    assert parse_zone(zone).utcoffset(None) == timedelta(hours=hours)
    noon_s = utc_s(2026, 5, 1, 12)
    assert utc_from_local_s(noon_s, zone).tolist() == noon_s - 3600 * hours


@pytest.mark.parametrize("zone", ["+15:01", "-16", "+99", "Europe/Nowhere", ""])
def test_offsets_of_no_zone_are_refused(zone):
    with pytest.raises(ConfigError, match="a zone such as"):
        parse_zone(zone)


def test_the_hour_that_is_passed_twice_and_the_one_that_is_not():
    """Berlin 2026: to UTC+2 on 29 March at 2, back to UTC+1 on 25 October at 3 o'clock."""
    local = [(3, 29, 1, 59, 59), (3, 29, 3, 0, 0), (10, 25, 1, 59, 59), (10, 25, 3, 0, 0)]
    local_s = [utc_s(2026, *one) for one in local]
    ahead_s = np.array(local_s) - [float(utc_from_local_s([one], BERLIN)[0]) for one in local_s]
    assert ahead_s.tolist() == [3600, 7200, 7200, 3600]
    # An hour that is left out is taken as of before the change.
    missing_s = utc_s(2026, 3, 29, 2, 30)
    assert utc_from_local_s([missing_s], BERLIN).tolist() == [missing_s - 3600]
    twice_s = utc_s(2026, 10, 25, 2, 30)
    assert utc_from_local_s([twice_s], BERLIN).tolist() == [twice_s - 7200]
    (note,) = change_notes(np.array([twice_s]), np.array([twice_s - 7200]), BERLIN)
    assert "taken for the first time, UTC+02:00 (the second one: --zone +01:00" in note
    (note,) = change_notes(np.array([missing_s]), np.array([missing_s - 3600]), BERLIN)
    assert "from 2026-03-29 02:30 on" in note
    assert "taken for UTC+01:00" in note


def test_rows_without_a_gap_of_a_quarter_of_an_hour_tell_which_hour_it_is():
    """Rows at 2:50 go on at 3:00 or 3:05 within 15 minutes: they are of the second 2:50."""
    first_s = utc_s(2026, 10, 25, 2, 50)
    near = utc_from_local_s([first_s, first_s + 900], BERLIN)
    assert near.tolist() == [first_s - 3600, first_s + 900 - 3600]
    far = utc_from_local_s([first_s, first_s + 901], BERLIN)
    assert far.tolist() == [first_s - 7200, first_s + 901 - 3600]
    # Rows that come from before the hour are of its first pass until they fall back by half of it.
    before_s = utc_s(2026, 10, 25, 1, 55)
    steps_s = before_s + np.array([0.0, 600, 600 + 1799, 600 + 1799 - 1801, 900])
    late = utc_from_local_s(steps_s, BERLIN) - steps_s
    assert late.tolist() == [-7200, -7200, -7200, -3600, -3600]


@pytest.mark.parametrize(
    ("minutes", "beside"), [(-61, False), (-60, True), (59, True), (60, False)]
)
def test_times_within_an_hour_of_a_change_are_beside_it(minutes, beside):
    change_s = utc_s(2026, 10, 25, 1)
    assert is_beside_change(np.array([change_s + 60 * minutes]), BERLIN) == beside


@pytest.mark.parametrize(
    ("stamp", "moment"),
    [
        (b"1777629600,", (2026, 5, 1)),
        (b"1777629600000 ", (2026, 5, 1)),
        (b"1777629600000000;", (2026, 5, 1)),
        (b"1777629600000000000,", (2026, 5, 1)),
        (b"2026/05/01,10:00:00.5 ", (2026, 5, 1)),
        # 23:30 of the day before in UTC-10:30, and midnight of the next day in UTC+14.
        (b"2026-04-30T23:30:00-10:30 ", (2026, 5, 1)),
        (b"2026-05-02 00:00:00+1400 ", (2026, 5, 1)),
        # Local times without a zone: nearer than half a day.
        (b"2026-05-01 21:59:00 ", (2026, 5, 1)),
        (b"2026-05-01 22:01:00 ", (2026, 5, 2)),
    ],
)
def test_dates_of_stamps_before_sentences(stamp, moment):
    data = stamp + b"$GPGGA,100000.00,"
    dates = stamped_dates(data, np.array([1]), np.array([36_000.0]))
    assert dates["midnight_s"].tolist() == [utc_s(*moment)]


@pytest.mark.parametrize(
    ("stamp", "seconds"),
    [
        (b"2026-05-01T15:30:00+05:30 ", 0.0),
        (b"2026-05-01 06:31:02.75-0330 ", 62.0),
        (b"2026-05-01 10:00:01Z ", 1.0),
        (b"1777629600.25,", 0.25),
        (b"1777629600250,", 0.25),
        (b"177762960025,", NAN),
        (b"2026-05-32 10:00:01Z ", NAN),
    ],
)
def test_moments_of_stamps_before_sentences(stamp, seconds):
    found = _stamp_s(stamp + b"$GPGGA,100000.00,", 0)
    assert found == pytest.approx(utc_s(2026, 5, 1, 10) + seconds, abs=1e-6, nan_ok=True)
