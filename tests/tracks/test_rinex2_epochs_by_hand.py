"""Epochs of RINEX 2 by hand: their times, numbers of satellites, and the lines of each."""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest

from mapfilter.tracks.readers.recorded.reading import Reading
from mapfilter.tracks.readers.rinex2_epochs import _epochs, _gps_s, read_epochs2
from mapfilter.tracks.readers.rinex_epochs import Wanted, _seconds

START_S = 1_461_664_800
"""2026-05-01 10:00:00, in seconds since 6 January 1980: 46 years and 115.4 days."""
AT = " 26  5  1 10  0  0.0000000"


@pytest.mark.parametrize(
    ("stamp", "seconds"),
    [
        (" 26  5  1 10  0  0.0000000", START_S),
        ("2026 05 01 10 00 30.25", START_S + 30.25),
        # Years of two digits are those from 1980 to 2079.
        (" 80  1  6  0  0  0.0000000", 0),
        (" 79  1  6  0  0  0.0000000", (99 * 365 + 25) * 86_400),
        (" 99  1  6  0  0  0.0000000", (19 * 365 + 5) * 86_400),
        ("  0  1  6  0  0  0.0000000", (20 * 365 + 5) * 86_400),
        # A leap second is the 60th.
        (" 26  5  1 10  0 60.5000000", START_S + 60.5),
        (" 26  5  1 10  0 61.0000000", None),
        (" 26 13  1 10  0  0.0000000", None),
        (" 26  2 29 10  0  0.0000000", None),
        (" 26  5  1 24  0  0.0000000", None),
        (" 26  5  1 10 60  0.0000000", None),
        (" 26  5  1 10  0", None),
        ("", None),
    ],
)
def test_seconds_since_1980(stamp, seconds):
    found = _gps_s(stamp.encode())
    assert (None if np.isnan(found) else found) == seconds


def epochs(*lines, lines_of_one=1, last=True):
    return _epochs([line.encode() for line in lines], lines_of_one, last=last)


def names(count):
    return "".join(f"G{i + 1:02d}" for i in range(count))


@pytest.mark.parametrize(("count", "more"), [(1, 0), (12, 0), (13, 1), (24, 1), (25, 2), (36, 2)])
@pytest.mark.parametrize("lines_of_one", [1, 2])
def test_a_line_has_twelve_names(count, more, lines_of_one):
    every = names(count)
    head = [f"{AT}  0{count:3d}{every[:36]}"]
    head += [" " * 32 + every[36 * i : 36 * i + 36] for i in range(1, more + 1)]
    found = epochs("", *head, *["1.0"] * (count * lines_of_one), lines_of_one=lines_of_one)
    assert found.count == [count]
    assert found.names == [every.encode()]
    assert found.first == [2 + more]
    assert found.gps_s == [START_S]
    assert (found.rows, found.no_epoch, found.no_names) == (1, [], [])
    assert found.end == 2 + more + count * lines_of_one


@pytest.mark.parametrize("flag", ["0", "1", " "])
def test_epochs_that_were_measured(flag):
    """After a power failure, too."""
    found = epochs(f"{AT}  {flag}  1G07", "1.0", f"{AT}  0  2G08G09", "1.0", "2.0")
    assert (found.first, found.count, found.rows) == ([1, 3], [1, 2], 2)


@pytest.mark.parametrize(
    ("lines", "first"),
    [
        # As many lines as are stated follow an event; slips of cycles are written as values are.
        (["4  2", "a", "b"], 3),
        (["2  0"], 1),
        (["5"], 1),
        (["3  1", "a"], 2),
        (["6  1G07", "1", "2"], 3),
    ],
)
def test_events_and_their_lines(lines, first):
    body = [f"{AT}  {lines[0]}", *lines[1:], f"{AT}  0  1G07", "1", "2"]
    found = epochs(*body, lines_of_one=2)
    assert found.first == [first + 1]
    assert (found.rows, found.no_epoch) == (2, [])
    # Without a time, too.
    body[0] = " " * 28 + lines[0]
    assert epochs(*body, lines_of_one=2).first == [first + 1]


@pytest.mark.parametrize(
    "line",
    [
        f"{AT}  0  0",
        f"{AT}  0 xx",
        f"{' ' * 26}  0  1G07",
        "of another program",
        f"{AT}  9  0",
        f"{AT[:-5]}x0000  4  1",
        f"{' ' * 28}7  0",
        "1.0",
    ],
)
def test_lines_that_are_no_epoch(line):
    found = epochs(line, f"{AT}  0  1G07", "1.0")
    assert (found.no_epoch, found.first, found.rows) == ([0], [2], 2)


def test_an_epoch_with_fewer_names_than_stated():
    found = epochs(f"{AT}  0  3G07G08", f"{AT}  0  2G07G08", "1.0", "2.0")
    assert (found.no_names, found.no_epoch) == ([0], [])
    assert (found.first, found.count, found.rows) == ([2], [2], 2)
    # The last one may lack its blank.
    assert epochs(f"{AT}  0  2G07 08", "1.0", "2.0").names == [b"G07 08"]


def test_an_epoch_that_goes_on_in_the_next_block():
    lines = [f"{AT}  0  1G07", "1.0", f"{AT}  0  2G07G08", "1.0"]
    found = epochs(*lines, last=False)
    assert (found.first, found.rows, found.end) == ([1], 1, 2)
    found = epochs(*lines)
    assert (found.first, found.rows, found.end) == ([1, 3], 2, 4)
    assert epochs(*lines, "2.0", last=False).first == [1, 3]


def observed(types, *lines, codes=("C1",)):
    reading = Reading(Path("a.26o"))
    wanted = Wanted({"G": types}, {"G": codes})
    data = "\n".join([*lines, ""]).encode()
    return list(read_epochs2(memoryview(data), 5, types, wanted, reading)), reading


def line_of(*numbers):
    return "".join(f"{number:14.3f}  " for number in numbers)


@pytest.mark.parametrize("count", [5, 6, 10, 11])
def test_a_line_has_five_values(count):
    """The code range is the last of so many, with its level as the first."""
    types = ["S1", *(f"L{i}" for i in range(count - 2)), "C1"]
    lines = [f"{AT}  0  2G07 08"]
    for base in (100.0, 200.0):
        numbers = base + np.arange(count)
        lines += [line_of(*numbers[i : i + 5]) for i in range(0, count, 5)]
    (found,), reading = observed(types, *lines)
    assert found.satellite.tolist() == ["G07", "G08"]
    assert found.pseudorange_m.tolist() == [100 + count - 1, 200 + count - 1]
    assert found.cn0_dbhz.tolist() == [100, 200]
    assert found.gps_s.tolist() == [START_S, START_S]
    # The header has four lines.
    assert found.line.tolist() == [6, 6 + -(-count // 5)]
    assert reading.rows == 3


def test_lines_are_those_of_the_file():
    bad = [f"{AT}  0  2G07", "x"]
    good = [f"{AT}  0  1G09", line_of(300.0)]
    (found,), reading = observed(["C1"], *good, *bad, *good)
    assert found.line.tolist() == [6, 10]
    assert found.signal.tolist() == ["C1", "C1"]
    assert {reason: lines[0].tolist() for reason, lines in reading._refused.items()} == {
        "epoch: fewer satellites than their number": [7],
        "epoch: no date, time and number of satellites": [8],
    }


@pytest.mark.parametrize(
    ("stamp", "seconds"),
    [
        ("2026 05 01 10 00 30.2500000", START_S + 30.25),
        (" 2026  5  1 23 59 59.0 ", START_S + 13 * 3600 + 3599),
        ("2026 05 01 10 00 60.5000000", START_S + 60.5),
        ("1980 01 06 00 00  0.0", 0),
        ("2261 12 31 00 00  0.0", (281 * 365 + 69 + 359) * 86_400),
        *((stamp, None) for stamp in ("2026 05 01 24 00 00.0", "2026 05 01 10 60 00.0")),
        *((stamp, None) for stamp in ("2026 05 01 10 00 61.0", "1979 12 31 23 00 00.0")),
        *((stamp, None) for stamp in ("2262 01 01 00 00 00.0", "2026 02 29 10 00 00.0")),
        *((stamp, None) for stamp in ("2026 13 01 10 00 00.0", "26 05 01 10 00 00.0", "")),
    ],
)
def test_seconds_of_version_3(stamp, seconds):
    """Of the years from 1980 to 2261 69 are leap years: 2100 and 2200 are none."""
    found = _seconds(pa.array(["2026 05 01 10 00 00", stamp])).tolist()
    assert found == pytest.approx([START_S, np.nan if seconds is None else seconds], nan_ok=True)
