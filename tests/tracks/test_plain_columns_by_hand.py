"""Columns of a plain CSV, value by value: dates in parts, states of fixes, and attitudes."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest

from mapfilter.errors import InputError
from mapfilter.tracks.readers.plain.attitude import add_attitude
from mapfilter.tracks.readers.plain.date_parts import of_parts, parts_of_dates
from mapfilter.tracks.readers.plain.fix_states import fix_column, without_fix
from mapfilter.tracks.readers.plain.mapped import Mapped
from mapfilter.tracks.readers.recorded.reading import Reading
from mapfilter.tracks.readers.texts.columns import Columns

PARTS = ("year", "month", "day", "hour", "min", "sec")
NAN = np.nan


def columns(**given):
    """Return columns of texts, as those of a file."""
    count = len(next(iter(given.values())))
    rows = Columns(Reading(Path("a.csv")), tuple(given), 2 + np.arange(count))
    for n, values in enumerate(given.values()):
        rows._columns[n] = pa.chunked_array([pa.array([str(one) for one in values])])
    return rows


def times(rows, **more):
    """Return the whole times of rows of parts, "" for none."""
    given = dict(zip(PARTS, zip(*rows, strict=True), strict=True))
    return parts_of_dates(columns(**given, **more)).texts("hour").tolist()


def test_parts_are_the_times_that_they_are_of():
    rng = np.random.default_rng(1)
    begin = datetime(1980, 1, 1, tzinfo=UTC)
    moments = [begin + timedelta(microseconds=int(n)) for n in rng.integers(0, 3_700e12, 50)]
    moments += [
        datetime(2000, 2, 29, 23, 59, 59, 999_999, UTC),
        datetime(2099, 12, 31, 23, 59, tzinfo=UTC),
        datetime(1980, 1, 1, tzinfo=UTC),
        datetime(2026, 3, 1, tzinfo=UTC),
    ]
    rows = [
        (m.year, m.month, m.day, m.hour, m.minute, f"{m.second + m.microsecond / 1e6:.6f}")
        for m in moments
    ]
    expected = [m.strftime("%Y-%m-%dT%H:%M:%S.%f") for m in moments]
    assert times(rows) == expected


@pytest.mark.parametrize(
    ("part", "least", "most", "beyond"),
    [
        (0, 1980, 2099, (1979, 2100)),
        (1, 1, 12, (0, 13)),
        (2, 1, 31, (0, 32)),
        (3, 0, 23, (-1, 24)),
        (4, 0, 59, (-1, 60)),
        (5, 0, 60, (-0.001, 60.001)),
    ],
)
def test_each_part_has_its_range(part, least, most, beyond):
    def row(value):
        values = [2026, 5, 1, 10, 30, 15]
        values[part] = value
        return values

    found = times([row(value) for value in (least, most, *beyond, "")])
    assert [bool(one) for one in found] == [True, True, False, False, False]
    # A leap second is the next one.
    assert times([[2026, 6, 30, 23, 59, 60]]) == ["2026-07-01T00:00:00.000000"]


def test_nanoseconds_of_a_receiver_are_added_to_its_rounded_seconds():
    rows = [[2026, 5, 1, 10, 30, 15]] * 4
    nano = [-400_000_000, 1500, NAN, 0]
    found = times(rows, nano=nano, itow=[0] * 4)
    assert [one[17:] for one in found] == ["14.600000", "15.000002", "15.000000", "15.000000"]
    # Other columns of that name are none of a receiver's.
    assert times(rows, nano=nano) == ["2026-05-01T10:30:15.000000"] * 4


@pytest.mark.parametrize(
    ("names", "found"),
    [
        ((*PARTS, "lat"), ("", "", "", "time", "", "", "lat")),
        (("minute", "second", *PARTS[:4]), ("", "", "", "", "", "time")),
        ((*PARTS, "itow", "nano"), ("", "", "", "time (utc)", "", "", "", "")),
        ((*PARTS, "nano"), ("", "", "", "time", "", "", "nano")),
        # One lacks, one is there twice, or there are other times.
        (PARTS[:4], PARTS[:4]),
        # Without seconds times are whole minutes; days may be those of the year.
        (PARTS[:5], ("", "", "", "time", "")),
        (("date", "hour", "min", "lat"), ("", "time", "", "lat")),
        (("year", "doy", "sod", "lat"), ("", "", "time (utc)", "lat")),
        (("year", "doy", *PARTS[3:]), ("", "", "time", "", "")),
        (("doy", "sod"), ("doy", "sod")),
        ((*PARTS, "year"), (*PARTS, "year")),
        ((*PARTS, "timestamp"), (*PARTS, "timestamp")),
        ((*PARTS, "time [ms]"), (*PARTS, "time [ms]")),
    ],
)
def test_which_names_are_parts_of_a_time(names, found):
    assert of_parts(names) == found
    # A column that a user names for a field is no part.
    assert of_parts(names, {names[0]}) == names
    rows = columns(**{name: [1] for name in names})
    if len(set(names)) == len(names):
        assert (parts_of_dates(rows) is rows) == (found == names)


@pytest.mark.parametrize(
    ("name", "words", "none"),
    [
        # Types: 0 and 1 are none, where there is a 2 or more; else 0 alone.
        ("fix_type", ["0", "1", "2", "3", "6", ""], [1, 1, 0, 0, 0, 0]),
        ("fixtype", ["0", "1", "1"], [1, 0, 0]),
        ("gnss_fix_type", ["0", "0", "0"], [0, 0, 0]),
        ("gps_fix_type", ["No_Fix", "3D", "3D"], [1, 0, 0]),
        ("fix type", ["none", "", "2D"], [1, 0, 0]),
        # Either types, if one is 3, or qualities.
        ("fix", ["0", "1", "2", "3"], [1, 1, 0, 0]),
        ("gps_fix", ["0", "1", "2", "2"], [1, 0, 0, 0]),
        # Qualities: 6 to 8 are not measured.
        ("fix_quality", [*"0123456789"], [1, 0, 0, 0, 0, 0, 1, 1, 1, 0]),
        ("gga_quality", ["0", "", "x"], [0, 0, 0]),
        # Flags.
        ("gnssfixok", ["0", "1", ""], [1, 0, 0]),
        ("fix_valid", ["False", "TRUE", "0.0"], [1, 0, 1]),
        ("valid", ["V", "A", "n"], [1, 0, 1]),
        ("gps_valid", ["invalid", "no", "0"], [0, 0, 0]),
        ("status.status", ["-1", "0", "2"], [1, 0, 0]),
        ("field.status.status", ["-1", "-1", ""], [0, 0, 0]),
    ],
)
def test_rows_without_a_fix_by_each_kind_of_column(name, words, none):
    rows = columns(**{name: words})
    assert fix_column(rows) == name
    assert without_fix(rows, name, rows.reading).tolist() == [bool(one) for one in none]


@pytest.mark.parametrize(
    ("name", "first", "second", "none"),
    [
        ("fix_type", ["0", "3"], ["1", "1"], [1, 1]),
        ("fix_type", ["0", "1"], ["1", "0"], [0, 1]),
        ("fix_ok", ["1", "1"], ["0", "0"], [1, 1]),
        ("fix_ok", ["0", "0"], ["0", "1"], [1, 0]),
        ("fix_ok", ["0", "0"], ["0", "0"], [0, 0]),
    ],
)
def test_a_later_part_is_read_as_the_first_one_that_had_both(name, first, second, none):
    rows = columns(**{name: first})
    without_fix(rows, name, rows.reading)
    later = columns(**{name: second})
    assert without_fix(later, name, rows.reading).tolist() == [bool(one) for one in none]


def test_which_column_states_a_fix():
    assert fix_column(columns(lat=["1"])) == ""
    # Flags before types, these before qualities, and the last is what may be of the date.
    order = ("gps_valid", "gps_fix_type", "gps_fix", "gps_quality", "status.status", "valid")
    for n in range(len(order)):
        given = columns(**{name: ["1"] for name in reversed(order[n:])})
        assert fix_column(given) == order[n]
        assert fix_column(given, frozenset(order)) == ""
    assert fix_column(columns(status=["3"])) == ""
    of_ardupilot = columns(timeus=["1"], nsats=["9"], status=["3"], valid=["1"])
    assert fix_column(of_ardupilot) == "status"


def attitudes(**given):
    """Return quaternions as they are read, lines of those that are refused, and notes."""
    rows = columns(**{name: [f"{one}" for one in values] for name, values in given.items()})
    reading = rows.reading
    add_attitude(Mapped(rows, {}, {}), reading, 1.7e9 + np.arange(len(rows)))
    (found,) = reading.tables["orientation"]
    refused = [line for some in reading._refused.values() for one in some for line in one]
    names = [f"q{axis}" for axis in "xyzw"]
    return found[names].to_numpy().tolist(), refused, reading.notes


def test_quaternions_are_of_length_one_within_a_twentieth():
    size = np.array([1.0, 0.951, 1.049, 0.949, 1.051, 0.0, 1.0, 1.0])
    found, refused, notes = attitudes(qx=0.48 * size, qy=-0.6 * size, qz=0 * size, qw=0.64 * size)
    assert np.array(found) == pytest.approx(np.tile([0.48, -0.6, 0.0, 0.64], (5, 1)), abs=1e-9)
    assert refused == [5, 6, 7]
    assert notes == []
    zero = np.zeros(3)
    for qw, good in (([1.0, 2.0, 0.0], 1), ([1.0, 2.0, 2.0], 0), ([2.0, 2.0, 0.0], 0)):
        if good:
            found, refused, _ = attitudes(qx=zero, qy=zero, qz=zero, qw=qw)
            assert (found, refused) == ([[0, 0, 0, 1]], [3, 4])
        else:
            first = 3 if qw[0] == 1.0 else 2
            with pytest.raises(InputError, match=rf"row {first}, .* of length 1, found 2 "):
                attitudes(qx=zero, qy=zero, qz=zero, qw=qw)


def test_a_scalar_part_that_is_left_out_is_what_makes_it_one():
    found, refused, notes = attitudes(qx=[0.6, 0.0, 0.6], qy=[0.0, 0.0, 0.8], qz=[0.0, -1.0, 0.02])
    assert np.array(found)[:, 3] == pytest.approx([0.8, 0.0, 0.0], abs=1e-3)
    assert refused == []
    assert "not negative" in notes[0]
    assert attitudes(qx=[0.6], qy=[0.0], qz=[0.0], qw=[-0.8])[0] == [[0.6, 0.0, 0.0, -0.8]]
