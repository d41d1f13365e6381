"""Times that fall back, stray, or lie in an hour that comes twice: each limit on both sides."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from pathlib import Path
from zoneinfo import ZoneInfo

import numpy as np
import pandas as pd
import pytest

from mapfilter.clocks.local_times import utc_from_local_s
from mapfilter.errors import Faults
from mapfilter.tracks.joining.named_files import check_origin, offsets_by_path
from mapfilter.tracks.readers.clocks.local_parts import note_changes
from mapfilter.tracks.readers.clocks.set_back import set_back_by
from mapfilter.tracks.readers.clocks.stray_times import stray_times
from mapfilter.tracks.readers.recorded.reading import Reading
from mapfilter.tracks.readers.recorded.recording import Clock
from mapfilter.tracks.readers.recorded.remarks import CountedNotes, Remarks

UTC_CLOCK, LOCAL, ZONED = Clock("utc"), Clock("local"), Clock("local", "Europe/Berlin")
HOUR, TWELVE = "a clock that was set back by an hour", "hours of 1 to 12 without AM or PM"


@pytest.mark.parametrize(
    ("fall_s", "clock", "cause"),
    [
        # Half an hour to one, as the clock went on meanwhile; only where local times stay such.
        (1800, LOCAL, ""),
        (1801, LOCAL, HOUR),
        (3600, LOCAL, HOUR),
        (3601, LOCAL, ""),
        (3599, ZONED, ""),
        (3599, UTC_CLOCK, ""),
        (3599, Clock("monotonic"), ""),
        # Up to ten minutes less than half a day.
        (42_600, LOCAL, ""),
        (42_601, LOCAL, TWELVE),
        (42_601, ZONED, TWELVE),
        (42_601, UTC_CLOCK, TWELVE),
        (43_200, UTC_CLOCK, TWELVE),
        (43_201, UTC_CLOCK, ""),
        (43_199, Clock("gps"), ""),
        (43_199, Clock("monotonic"), ""),
    ],
)
def test_why_times_fall_back(fall_s, clock, cause):
    assert set_back_by(np.array([float(fall_s)]), clock).partition(":")[0].startswith(cause)
    assert bool(set_back_by(np.array([float(fall_s)]), clock)) == bool(cause)
    # Of a clock that is set there is one step.
    assert set_back_by(np.array([float(fall_s)] * 2), clock) == ""
    assert set_back_by(np.zeros(0), clock) == ""


def strays(time_s, clock=UTC_CLOCK, good=None):
    time_s = np.asarray(time_s, dtype=float)
    good = np.ones(len(time_s), dtype=bool) if good is None else np.array(good, dtype=bool)
    return [(np.flatnonzero(of).tolist(), why) for of, why in stray_times(clock, time_s, good)]


FAR, NO_DATE = (
    "time: more than a day away from all other rows",
    "time: not between 1980 and 2100",
)
SINCE_1980_S = datetime(1980, 1, 6, tzinfo=UTC).timestamp()
UNTIL_2100_S = datetime(2100, 1, 1, tzinfo=UTC).timestamp()
NOW_S = 1.7e9


def test_times_that_are_no_dates():
    assert strays([SINCE_1980_S, UNTIL_2100_S]) == []
    for wrong_s in (SINCE_1980_S - 1, UNTIL_2100_S + 1):
        assert strays([NOW_S, wrong_s, NOW_S]) == [([1], NO_DATE)]
        assert strays([NOW_S, wrong_s, NOW_S], Clock("monotonic")) == [([1], FAR)]
        # Rows that do not count are never named.
        assert strays([NOW_S, wrong_s, NOW_S], good=[1, 0, 1]) == []
    (found,) = strays([5.0, 6.0, 7.0])
    assert found[0] == [0, 1, 2]
    assert found[1].startswith(f"{NO_DATE} (likely: ticks since a phone was started")
    # One that is a date is enough for the others to be none, and one that is too late.
    for other_s in (NOW_S, UNTIL_2100_S + 1):
        assert strays([5.0, 6.0, other_s])[0][1] == NO_DATE
    assert strays([5.0, 6.0, NOW_S], good=[1, 1, 0])[0][1] != NO_DATE


def test_times_days_away_from_all_others():
    day_s = 86_400.0
    group_s = NOW_S + np.arange(21.0)
    after_s = float(group_s[-1])
    for clock in (UTC_CLOCK, Clock("monotonic")):
        assert strays([*group_s, after_s + day_s], clock) == []
        assert strays([*group_s, after_s + day_s + 1], clock) == [([21], FAR)]
        assert strays([NOW_S - day_s - 1, *group_s], clock) == [([0], FAR)]
    # A single row, or fewer than a tenth of the largest group; two of twenty are another day.
    two_s = [after_s + 2 * day_s, after_s + 2 * day_s + 1]
    assert strays([*group_s[:20], *two_s]) == []
    assert strays([*group_s, *two_s]) == [([21, 22], FAR)]
    # In any order of rows.
    assert strays([two_s[0], *group_s[::-1], two_s[1]]) == [([0, 22], FAR)]
    # Where each is away from each none is that of the others, and of two none is.
    assert strays([NOW_S, NOW_S + 2 * day_s, NOW_S + 4 * day_s]) == []
    assert strays([NOW_S, NOW_S + 2 * day_s]) == []
    assert strays([NOW_S, NOW_S, NOW_S + 2 * day_s]) == [([2], FAR)]
    # Those that are no dates are no others.
    assert strays([NOW_S, NOW_S, 5.0]) == [([2], NO_DATE)]


@pytest.mark.parametrize(
    ("zone", "change"),
    [
        ("Europe/Berlin", datetime(2026, 10, 25, 1, tzinfo=UTC)),
        ("Europe/Berlin", datetime(2026, 3, 29, 1, tzinfo=UTC)),
        ("America/New_York", datetime(2026, 11, 1, 6, tzinfo=UTC)),
        # By half an hour.
        ("Australia/Lord_Howe", datetime(2026, 4, 4, 15, tzinfo=UTC)),
        ("Asia/Kathmandu", datetime(2026, 5, 1, tzinfo=UTC)),
    ],
)
@pytest.mark.parametrize("minutes", [1, 7, 14])
def test_local_times_over_a_change_of_the_clock_become_utc(zone, change, minutes):
    """Those of a log without gaps, as zoneinfo has them, whichever part of it is read."""
    begin = change - timedelta(hours=3)
    moments = [begin + timedelta(minutes=minutes * n) for n in range(360 // minutes)]
    utc_s = np.array([one.timestamp() for one in moments])
    walls = [one.astimezone(ZoneInfo(zone)).replace(tzinfo=UTC) for one in moments]
    local_s = np.array([one.timestamp() for one in walls])
    np.testing.assert_array_equal(utc_from_local_s(local_s, zone), utc_s)
    for cut in range(1, len(utc_s), max(1, 30 // minutes)):
        found = utc_from_local_s(local_s[cut:], zone, utc_s[cut - 1])
        np.testing.assert_array_equal(found, utc_s[cut:])


ZONE = "Europe/Berlin"
TWICE_S = datetime(2026, 10, 25, 2, 30, tzinfo=UTC).timestamp()
"""Local time, which is 0:30 and 1:30 UTC."""


def read_by_parts(*parts_s):
    """Return the UTC times of rows, and notes, of a file in parts of local times."""
    reading, after_s = Reading(Path("a.csv"), clock=ZONED), np.nan
    for local_s in parts_s:
        local_s = np.array(local_s, dtype=float)
        utc_s = utc_from_local_s(local_s, ZONE, after_s)
        note_changes(reading, local_s, utc_s, ZONE, after_s)
        known_s = utc_s[np.isfinite(utc_s)]
        if known_s.size:
            lines = np.arange(known_s.size)
            reading.add("positions", {"time_s": known_s, "lat_deg": 52.0, "lon_deg": 13.0}, lines)
            after_s = known_s[-1]
    tables = reading.tables.get("positions", [])
    times_s = np.concatenate([part["time_s"] for part in tables]) if tables else np.zeros(0)
    return (times_s - TWICE_S).tolist(), [note for note in reading.notes if "twice" in note]


def test_a_later_part_tells_which_hour_an_earlier_one_is_of():
    first, second = -7200.0, -3600.0
    begin_s, next_s = TWICE_S + np.array([0.0, 600.0]), TWICE_S + 1800.0
    # Nothing tells: the first hour, with a note.
    times, notes = read_by_parts(begin_s)
    assert times == [first, first + 600]
    assert len(notes) == 1
    # It goes on at three without a gap, up to a quarter of an hour: it was the second hour.
    for gap_s, was in ((1.0, second), (900.0, second), (901.0, first)):
        early_s = [TWICE_S + 900.0, next_s - 1.0]
        times, notes = read_by_parts(early_s, [next_s - 1.0 + gap_s, next_s + 3600.0])
        assert times[:2] == [was + 900, was + 1799]
        assert notes == []
    # A part without times changes nothing.
    times, notes = read_by_parts(begin_s, [np.nan], [next_s, next_s + 60])
    assert times[:2] == [first, first + 600]
    times, notes = read_by_parts([next_s - 60.0], [np.nan], [next_s, next_s + 60])
    assert times == [second + 1740, second + 1800, second + 1860]
    assert notes == []
    # Times that fall back after it were those of the first hour.
    times, notes = read_by_parts([TWICE_S - 1740.0, TWICE_S + 1740.0], [TWICE_S - 1740.0, TWICE_S])
    assert times == [first - 1740, first + 1740, second - 1740, second]
    assert notes == []


def test_rows_so_far_are_shifted_with_those_that_are_kept():
    reading = Reading(Path("a.csv"))
    reading.add("positions", {"time_s": [NOW_S], "lat_deg": [52.0], "lon_deg": [13.0]}, [2])
    reading.keep(pd.DataFrame({"time_s": [NOW_S + 1]}), lambda _: None)
    reading.shift(3600.0)
    assert reading.tables["positions"][0]["time_s"].tolist() == [NOW_S + 3600]
    assert reading.kept[0]["time_s"].tolist() == [NOW_S + 3601]


class Noted(Remarks):
    def __init__(self):
        self.notes, self.ignored, self.counted = [], [], CountedNotes()


def left_out(count, of=None):
    return f"{count} left out" if of is None else f"{count} of {of} left out"


def test_numbers_of_notes_grow_in_their_place():
    noted = Noted()
    noted.note("first")
    noted.count(left_out, 3)
    noted.ignore("last")
    noted.count(left_out, 4)
    assert (noted.notes, noted.ignored) == (["first", "7 left out", "last"], ["last"])
    noted.count(left_out, 1, 5, ignored=True)
    noted.count(left_out, 2, 5, ignored=True)
    assert noted.ignored == ["last", "3 of 10 left out"]
    assert noted.notes == ["first", "7 left out", "last", "3 of 10 left out"]
    # By a key of its own, and each source once.
    for source in (1, 2, 1, None):
        noted.count(left_out, 10, key="other", source=source)
    assert noted.notes[-1] == "30 left out"
    assert len(noted.notes) == 5
    noted.note("first")
    noted.ignore("first")
    assert (noted.notes.count("first"), noted.ignored[-1]) == (1, "first")


def test_offsets_are_those_of_paths_and_names(tmp_path):
    folder = tmp_path / "drive"
    folder.mkdir()
    paths = [tmp_path / "a.csv", folder / "b.csv", folder / "a.csv"]
    for path in paths:
        path.write_text("time\n")
    given, faults = [paths[0], folder], Faults()
    assert offsets_by_path({}, given, "--offset", faults) == {}
    found = offsets_by_path({"b.csv": 2, str(paths[0]): -1.5}, given, "--offset", faults)
    assert found == {paths[1]: 2.0, paths[0]: -1.5}
    # A name is that of all files of it.
    assert offsets_by_path({"a.csv": 1e10}, given, "--offset", faults) == {
        paths[0]: 1e10,
        paths[2]: 1e10,
    }
    assert not faults.found
    for name, seconds in (("c.csv", 1.0), ("drive", 1.0), ("b.csv", 1.1e10), ("b.csv", np.inf)):
        faults = Faults()
        offsets_by_path({name: seconds}, given, "--offset", faults)
        (fault,) = faults.found
        assert fault.where == ("--offset b.csv" if name == "b.csv" else "--offset")
        if name != "b.csv":
            assert (fault.got, fault.expected) == (
                repr(name),
                "the name of one of the recordings (a.csv, a.csv, b.csv)",
            )


@pytest.mark.parametrize(
    ("origin_deg", "hint"),
    [
        ((90.0, 180.0), None),
        ((-90.0, -180.0), None),
        ((60.0, 24.9), None),
        ((90.1, 24.9), "longitude and latitude swapped"),
        ((-120.5, 37.2), "longitude and latitude swapped"),
        ((180.0, -90.0), "longitude and latitude swapped"),
        ((180.1, 60.0), ""),
        ((91.0, 90.1), ""),
        ((60.0, 180.1), ""),
    ],
)
def test_an_origin_is_a_latitude_and_a_longitude(origin_deg, hint):
    faults = Faults()
    check_origin(origin_deg, "--origin", faults)
    assert [(fault.where, fault.hint) for fault in faults.found] == [
        ("--origin", hint) for _ in range(hint is not None)
    ]
