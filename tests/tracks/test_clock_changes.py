"""Local times about a change of the clock, and the names of zones, row by row by hand."""

from datetime import UTC, datetime, timedelta, timezone
from math import nan

import numpy as np
import pytest

from mapfilter.clocks.local_times import (
    change_notes,
    is_beside_change,
    parse_zone,
    utc_from_local_s,
)
from mapfilter.errors import ConfigError

BERLIN, HOWE, JOHNS = "Europe/Berlin", "Australia/Lord_Howe", "America/St_Johns"


def seconds(day, clock):
    """Return a time of a day of 2026 as if it were UTC."""
    parts = [int(part) for part in clock.split(":")]
    hour, minute, second = [*parts, 0, 0][:3]
    return datetime(2026, *day, hour, minute, second, tzinfo=UTC).timestamp()


BACK, FORWARD, HOWE_BACK = (10, 25), (3, 29), (4, 5)
"""Days: at 3:00 back to 2:00, at 2:00 forward to 3:00; at 2:00 back to 1:30."""


def utc_of(*clocks, day=BACK, zone=BERLIN, after=None):
    """Return UTC times of the day for local ones."""
    after_s = nan if after is None else seconds(day, after)
    found = utc_from_local_s([seconds(day, one) for one in clocks], zone, after_s)
    return [f"{datetime.fromtimestamp(one, UTC):%H:%M:%S}".removesuffix(":00") for one in found]


def test_from_the_row_on_at_which_times_fall_it_is_the_second_pass():
    assert utc_of("2:50", "2:19:59", "2:40") == ["00:50", "01:19:59", "01:40"]
    assert utc_of("1:55", "2:10", "2:50", "2:05", "2:55", "3:05") == [
        "23:55", "00:10", "00:50", "01:05", "01:55", "02:05",
    ]  # fmt: skip
    # Half an hour is no fall yet.
    assert utc_of("2:50", "2:20") == ["00:50", "00:20"]
    # Nor is one elsewhere.
    assert utc_of("2:10", "2:50", "1:50") == ["00:10", "00:50", "23:50"]
    assert utc_of("2:50", "2:10", "2:05")[1:] == ["01:10", "01:05"]


def test_the_second_pass_is_that_which_goes_on_without_a_gap_and_comes_from_none():
    assert utc_of("2:10", "2:50", "3:05") == ["01:10", "01:50", "02:05"]
    assert utc_of("2:10", "2:50", "3:05:01") == ["00:10", "00:50", "02:05:01"]
    assert utc_of("1:44:59", "2:00", "2:50", "3:00") == ["23:44:59", "01:00", "01:50", "02:00"]
    assert utc_of("1:45", "2:00", "2:50", "3:00") == ["23:45", "00:00", "00:50", "02:00"]
    # What comes after in the table, but before in time, is no going on.
    assert utc_of("2:10", "2:50", "1:10") == ["00:10", "00:50", "23:10"]
    assert utc_of("2:59", "2:59", "2:59")[0] == "00:59"


def test_rows_follow_those_of_an_earlier_part():
    # They would be 31 minutes, or 119, before the last row of it.
    assert utc_of("2:10", "2:20", after="0:41") == ["01:10", "01:20"]
    assert utc_of("2:10", "2:20", after="2:09") == ["01:10", "01:20"]
    assert utc_of("2:10", "2:20", after="0:40") == ["00:10", "00:20"]
    assert utc_of("2:10", "2:20", after="2:10") == ["00:10", "00:20"]
    # All of them, also where times fall by much.
    assert utc_of("2:50", "2:05", after="1:45") == ["01:50", "01:05"]
    # One alone does, too, and the last of its hour.
    assert utc_of("2:10", after="0:45") == ["01:10"]
    assert utc_of("2:50", "3:10", after="1:45") == ["01:50", "02:10"]
    # Only the first of them follows.
    assert utc_of("1:50", "2:10", "2:20", after="0:30") == ["23:50", "00:10", "00:20"]


def test_rows_may_come_several_times_a_second():
    local_s = seconds(BACK, "3:00") + np.array([-0.4, -0.2, 0.0, 0.2])
    assert (local_s - utc_from_local_s(local_s, BERLIN)).tolist() == [3600.0] * 4
    local_s -= 3600.0
    assert (local_s - utc_from_local_s(local_s, BERLIN)).tolist() == [7200.0] * 4


def test_half_an_hour_that_comes_twice():
    assert utc_of("1:10", "1:35", day=HOWE_BACK, zone=HOWE) == ["14:10", "14:35"]
    found = utc_of("1:45", "1:29", "1:50", "1:34:59", "1:59", day=HOWE_BACK, zone=HOWE)
    assert found == ["14:45", "14:29", "14:50", "15:04:59", "15:29"]
    # A quarter of an hour is no fall of it.
    assert utc_of("1:50", "1:35", day=HOWE_BACK, zone=HOWE) == ["14:50", "14:35"]


def test_missing_times_are_left_out():
    found = utc_from_local_s([nan, seconds(BACK, "2:50"), nan, seconds(BACK, "2:10")], BERLIN)
    assert np.isnan(found).tolist() == [True, False, True, False]
    assert found[3] - found[1] == 20 * 60
    assert np.isnan(utc_from_local_s([nan], BERLIN)).all()
    table = np.array([[seconds(BACK, "1:00"), nan]])
    assert utc_from_local_s(table, BERLIN).shape == (1, 2)
    # Years that no calendar has do not end it.
    assert np.isfinite(utc_from_local_s([9e10, -9e10, 1e300], "UTC")).all()


def notes_of(*clocks, day, zone, after_s=nan):
    local = np.array([nan, *(seconds(day, one) for one in clocks)])
    return change_notes(local, utc_from_local_s(local, zone, after_s), zone, after_s)


def test_times_that_a_zone_has_not_are_noted():
    (note,) = notes_of("1:50", "2:00", "2:59:59", "3:00", day=FORWARD, zone=BERLIN)
    assert note.startswith("time: 2 times are not of Europe/Berlin, from 2026-03-29 02:00 on,")
    assert "taken for UTC+01:00 (likely: a clock that was not set, --zone +01:00;" in note
    (note,) = notes_of("2:30", day=(3, 8), zone=JOHNS)
    assert note.startswith("time: 1 time is not of America/St_Johns, from 2026-03-08 02:30 on,")
    assert "taken for UTC-03:30" in note
    assert notes_of("1:59:59", "3:00", day=FORWARD, zone=BERLIN) == []
    assert notes_of(day=FORWARD, zone=BERLIN) == []


def test_times_that_a_zone_has_twice_are_noted_where_nothing_tells_them_apart():
    (note,) = notes_of("2:00", "2:30", "2:59", day=BACK, zone=BERLIN)
    assert note.startswith("time: all times, from 2026-10-25 02:00 on, lie in the hour that a ")
    assert "first time, UTC+02:00 (the second one: --zone +01:00, or times with" in note
    assert notes_of("2:00", "2:30", "3:00", day=BACK, zone=BERLIN) == []
    assert notes_of("2:50", "2:10", day=BACK, zone=BERLIN) == []
    assert notes_of("2:00", "2:30", day=BACK, zone=BERLIN, after_s=0.0) == []


@pytest.mark.parametrize(
    ("clock", "beside"),
    [("23:59:59", False), ("0:00", True), ("1:00", True), ("1:59:59", True), ("2:00", False)],
)
def test_what_is_within_an_hour_of_a_change(clock, beside):
    """It is at 1:00 UTC."""
    day = (10, 24) if clock == "23:59:59" else BACK
    time_s = np.array([nan, seconds(day, clock)])
    assert is_beside_change(time_s, BERLIN) is beside
    assert not is_beside_change(time_s, "+01:00")
    assert not is_beside_change(time_s[:1], BERLIN)
    # So are times on both sides of it, however far.
    assert is_beside_change(seconds(BACK, "1:00") + np.array([-1e6, 1e6]), BERLIN)
    assert not is_beside_change(np.array([1e300, -1e300]), "UTC")


@pytest.mark.parametrize(
    ("text", "minutes"),
    [("+05:30", 330), ("-3:30", -210), ("UTC+2", 120), ("GMT-11", -660), (" +0545 ", 345),
     ("+15:00", 900), ("-15", -900), ("+00:00", 0)],
)  # fmt: skip
def test_offsets_are_zones(text, minutes):
    assert parse_zone(text) == timezone(timedelta(minutes=minutes))


@pytest.mark.parametrize("text", ["+15:01", "-16", "Europe/Nowhere", "", "+5:60", "../zone"])
def test_what_is_no_zone_is_refused(text):
    with pytest.raises(ConfigError, match=r"--zone: expected a zone such as Europe/Brussels or"):
        parse_zone(text)


def test_names_are_zones():
    assert str(parse_zone(" Europe/Berlin ")) == BERLIN


@pytest.mark.parametrize(
    ("text", "hint"),
    [("Helsinki", "Europe/Helsinki"), ("new york", "America/New_York"), ("Nowhere", "")],
)
def test_a_city_alone_names_its_zone(text, hint):
    with pytest.raises(ConfigError) as error:
        parse_zone(text)
    assert error.value.faults[0].hint == hint
