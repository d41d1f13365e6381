"""Seconds of the GPS week and of the day in tables, at the ends of both, by hand."""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest

from mapfilter.tracks.readers.plain.mapped import Mapped
from mapfilter.tracks.readers.plain.weeks import (
    over_days,
    over_stuck_weeks,
    over_weeks,
    week_column,
    weeks_of,
)
from mapfilter.tracks.readers.recorded.reading import Reading
from mapfilter.tracks.readers.texts.columns import Columns

WEEK_S, DAY_S = 604_800.0, 86_400.0
NAN = np.nan


def weeks(names, *columns):
    """Return columns of numbers as of a plain CSV."""
    reading = Reading(Path("made.csv"))
    rows = Columns(reading, names, 2 + np.arange(len(columns[0])))
    texts = (pa.chunked_array([pa.array([str(one) for one in of])]) for of in columns)
    rows._columns.update(enumerate(texts))
    return Mapped(rows, {}, {}), reading


@pytest.mark.parametrize(
    ("name", "week", "second", "known"),
    [
        ("gps_week", 0, 0, True),
        ("gps_week", 4095, 604_800, True),
        ("gps_week", 4096, 1, False),
        ("gps_week", 2416, 604_800.5, False),
        ("gps_week", 2416, -0.5, False),
        ("gps_week", 2416.5, 1, False),
        # Weeks of a year are 53 at most.
        ("week", 53, 1, False),
        ("week", 54, 1, True),
    ],
)
def test_weeks_of_gps_beside_seconds(name, week, second, known):
    mapped, _ = weeks(("time", name), [second], [week])
    assert week_column(mapped) == (name if known else "")


@pytest.mark.parametrize(("week", "counted"), [(1023, 3071), (368, 2416), (1024, 1024)])
def test_weeks_below_1024_are_of_the_third_count(week, counted):
    mapped, reading = weeks(("week",), [week, week])
    assert weeks_of(mapped.rows, "week", reading).tolist() == [counted] * 2
    assert bool(reading.notes) == (week < 1024)


def test_seconds_of_the_week_go_on_where_it_begins_anew():
    second = np.array([604_799.0, NAN, 0.0, 1.0])
    found = over_weeks(Reading(Path("a.csv")), second).tolist()
    assert found == pytest.approx([604_799, NAN, 604_800, 604_801], abs=1e-6, nan_ok=True)
    # Farther than an hour from the end of the week, or its beginning, is no such fall.
    assert over_weeks(Reading(Path("a.csv")), np.array([601_200.0, 3600.0]))[1] == WEEK_S + 3600
    for rest in ([601_199.0, 1.0], [604_799.0, 3601.0]):
        reading = Reading(Path("a.csv"))
        assert over_weeks(reading, np.array(rest)).tolist() == rest
        assert reading.notes == []
    # A part after one that ended in the second week.
    reading = Reading(Path("a.csv"), last_s=WEEK_S + 5)
    assert over_weeks(reading, np.array([6.0, 7.0])).tolist() == [WEEK_S + 6, WEEK_S + 7]
    for beyond in ([-1.0, 5.0], [604_801.0, 5.0]):
        assert over_weeks(Reading(Path("a.csv")), np.array(beyond)).tolist() == beyond


def test_a_week_that_stays_goes_on_after_a_fall_of_nearly_a_week():
    reading = Reading(Path("a.csv"))
    near_s = np.array([WEEK_S - 1.0, 3598.0, 3599.0])
    assert over_stuck_weeks(reading, near_s, "week").tolist() == [
        WEEK_S - 1, WEEK_S + 3598, WEEK_S + 3599
    ]  # fmt: skip
    assert reading.notes == ["week: stays where seconds of the GPS week begin anew: times go on"]
    far_s = np.array([WEEK_S - 1.0, 3599.0, 3600.0])
    assert over_stuck_weeks(Reading(Path("a.csv")), far_s, "week").tolist() == far_s.tolist()


def test_seconds_of_the_day_go_on_after_a_pause_of_ten_minutes_at_most():
    for pause_s, goes_on in ((600.0, True), (600.5, False)):
        reading = Reading(Path("a.csv"))
        second = np.array([DAY_S - 100, NAN, pause_s - 100])
        found = over_days(reading, second).tolist()
        last = DAY_S + pause_s - 100 if goes_on else pause_s - 100
        assert found == pytest.approx([DAY_S - 100, NAN, last], abs=1e-6, nan_ok=True)
        assert bool(reading.notes) == goes_on
    beyond = np.array([DAY_S + 1, 5.0])
    assert over_days(Reading(Path("a.csv")), beyond).tolist() == beyond.tolist()
