"""Tallies of unusable values by hand: what counts, when a column is refused, and its cause."""

from pathlib import Path

import numpy as np
import pytest

from mapfilter.errors import InputError
from mapfilter.tracks.readers.recorded.reading import Reading
from mapfilter.tracks.readers.recorded.recorded_field import Field
from mapfilter.tracks.readers.recorded.tables import RECORDED
from mapfilter.tracks.readers.recorded.tallies import Tallies

NAN = np.nan
PATH = Path("a.csv")
SPEED = Field("speed_mps", -100.0, 100.0, "m/s in -100..100", vital=True)
NO_LOST_SIGN = "a lost sign (70 for -70 dBm)"


def counted(known, *parts, tallies=None):
    """Return tallies of a column's values, in lines 2, 3 and so on; NaN is none."""
    tallies, line = tallies or Tallies(), 2
    for values in parts:
        values = np.array(values, dtype=float)
        outside = (values < known.low) | (values > known.high)
        given = int(np.count_nonzero(~np.isnan(values)))
        tallies.add_values("odometry", known, values, given, outside, line + np.arange(len(values)))
        line += len(values)
    return tallies


def refused(tallies, known):
    """Return the message of what is refused; "" for none."""
    try:
        tallies.check(PATH, {"odometry": (known,)})
    except InputError as error:
        return str(error)
    return ""


@pytest.mark.parametrize(
    ("parts", "got"),
    [
        # More than half of those given.
        ([[1, 2, 200, 300]], ""),
        ([[1, 200, 300]], "2 of 3 values outside, 200 to 300 (first 200 in line 3)"),
        ([[1, NAN, -300, 200]], "2 of 3 values outside, -300 to 200 (first -300 in line 4)"),
        ([[1, 300], [200, 2, 400]], "3 of 5 values outside, 200 to 400 (first 300 in line 3)"),
        ([[1, 2], [300, 200], [3]], ""),
        # One and the same number is a mark of missing values, also over parts.
        ([[1, 200, 200, 200]], ""),
        ([[200, 200], [1, 200]], ""),
        ([[200, 200], [1, 201]], "3 of 4 values outside, 200 to 201 (first 200 in line 2)"),
        # So are these, of either sign, which are no values at all.
        *(([[1, 2, 3, 200, 300, m, -m]], "") for m in (999, 9999, 99999, 999999, 32767, 32768)),
        ([[1, 200, 300, 65535, 2e9, -3e9]], "2 of 3 values outside, 200 to 300"),
        ([[1, 200, 1.9e9]], "2 of 3 values outside, 200 to 1.9e+09"),
        ([[1, 999, 999, 999, 201, 200]], "2 of 3 values outside, 200 to 201 (first 201 in line 6)"),
        ([[999, -999, 9999]], ""),
    ],
)
def test_a_column_is_refused_of_which_most_values_are_out_of_range(parts, got):
    found = refused(counted(SPEED, *parts), SPEED)
    assert found.startswith(f"a.csv, speed_mps: expected m/s in -100..100, found {got}" * bool(got))
    assert bool(found) == bool(got)


@pytest.mark.parametrize(
    ("values", "marks", "mostly", "is_refused"),
    [
        # Up to so many different ones are marks.
        ([1, 200, 201, 202], 3, 0.5, False),
        ([1, 200, 201, 202, 203], 3, 0.5, True),
        ([1, 200, 201, 202], 2, 0.5, True),
        # A smaller share of some quantities.
        ([1] * 8 + [200, 201], 1, 0.2, False),
        ([1] * 7 + [200, 201], 1, 0.2, True),
    ],
)
def test_marks_and_shares_are_those_of_the_field(values, marks, mostly, is_refused):
    known = Field("speed_mps", -100.0, 100.0, "m/s", vital=True, marks=marks, mostly=mostly)
    assert bool(refused(counted(known, values), known)) == is_refused


def test_the_likely_mistake_is_by_the_largest_of_either_sign():
    hints = ((100.0, 400.0, "km/h"), (400.0, 1e4, "mm/s"))
    known = Field("speed_mps", -100.0, 100.0, "m/s", vital=True, hints=hints)
    assert refused(counted(known, [200, 300]), known).endswith("(likely: km/h)")
    assert refused(counted(known, [-700, 300]), known).endswith("(likely: mm/s)")
    assert refused(counted(known, [2e4, 300]), known).endswith("in line 2)")


def test_columns_are_named_as_in_the_file():
    tallies = counted(SPEED, [200, 300], tallies=Tallies({"speed_mps": "Tempo"}))
    assert refused(tallies, SPEED).startswith("a.csv, column Tempo (speed_mps): expected m/s")
    tallies = counted(SPEED, [200, 300], tallies=Tallies({"speed_mps": "speed_mps"}))
    assert refused(tallies, SPEED).startswith("a.csv, speed_mps: expected m/s")


LEVEL = next(field for field in RECORDED["radio"] if field.name == "level_dbm")


@pytest.mark.parametrize(
    ("values", "mistake"),
    [
        # In tenths down to -200 dBm.
        ([-780, -850, -2000], "tenths of a dB (-780 for -78 dBm); divide by 10"),
        ([-780, -850, -2001], ""),
        # ASU, RXLEV and bars are whole numbers, and no levels are weaker than -200 dBm.
        ([3, 4], "signal bars; name the column bars"),
        ([20, 12], "ASU of GSM (dBm = 2 ASU - 113), or raw RXLEV (dBm = RXLEV - 110)"),
        ([20.5, 12], NO_LOST_SIGN),
        ([70.5, 200], NO_LOST_SIGN),
        ([70.5, 201], ""),
        ([-201, -300.5], "tenths of a dB (-780 for -78 dBm); divide by 10"),
        ([-201.5, 60], "ASU"),
        ([64, 97], "a lost sign (70 for -70 dBm), or ASU (LTE: dBm = ASU - 140)"),
        ([98, 120], NO_LOST_SIGN),
    ],
)
def test_likely_mistakes_of_levels(values, mistake):
    found = refused(counted(LEVEL, values), LEVEL)
    if mistake == "ASU":
        # The weakest says that they are none.
        assert found.endswith(")")
        assert "likely" not in found
    else:
        assert found.endswith(f" (likely: {mistake})" if mistake else "in line 2)")


def test_levels_that_are_qualities():
    """Nine of ten or more between -30 and 0 dB."""
    good = [-10.0 - i for i in range(9)]
    found = refused(counted(LEVEL, [*good, -80.0]), LEVEL)
    assert found == (
        "a.csv, level_dbm: expected levels in dBm, such as RSRP in -140..-44 or RxLev in "
        "-110..-47, found 9 of 10 values from -18 to -10 (likely: a quality in dB, such as RSRQ "
        "(-20 to -3))"
    )
    assert refused(counted(LEVEL, [*good, -80.0, -80.0]), LEVEL) == ""
    assert refused(counted(LEVEL, good), LEVEL) == ""
    # Of levels alone.
    other = Field("heading_rad", -100.0, 100.0, vital=True)
    assert refused(counted(other, [*good, -80.0]), other) == ""


def test_levels_without_their_sign():
    tallies = Tallies({"level_dbm": "Level"})
    tallies.signs.add(np.array([70.0, 82.0, 95.0, 104.0, -60.0]))
    found = refused(tallies, LEVEL)
    assert found == (
        "a.csv, column Level (level_dbm): expected dBm below 0, or ASU up to 97, found 4 of 5 "
        f"positive, 1 of them above 97 (likely: {NO_LOST_SIGN})"
    )
    # One fault of a column is enough.
    found = refused(counted(SPEED, [200, 300], tallies=tallies), SPEED)
    assert "positive" not in found


@pytest.mark.parametrize(
    ("values", "is_refused"),
    [
        # Few rows, or headings that hardly jump: they may be unwrapped, or begin beyond a turn.
        ([10.5, 11.5, 12.5, 13.5, 14.5], False),
        ([10.5, 90.5], False),
        # Degrees jump at corners, and may be whole.
        ([10.5, 90.5, 180.5, 270.5], True),
        ([10, 11, 12], True),
    ],
)
def test_headings_that_may_be_unwrapped_are_not_refused(values, is_refused):
    known = next(field for field in RECORDED["motion"] if field.name == "heading_rad")
    tallies = counted(known, values)
    values = np.array(values)
    tallies.winding("odometry", known).unwound(values, np.abs(values) > known.high)
    assert bool(refused(tallies, known)) == is_refused
    assert tallies.winding("odometry", known) is tallies.winding("odometry", known)


@pytest.mark.parametrize(
    ("parts", "got"),
    [
        # Of each part how many have digits, how many of them are no numbers, and two examples.
        ([(4, 2, ("1 m", "2 m"))], ""),
        ([(4, 3, ("1 m", "2 m"))], "3 of 4 values that are none, such as '1 m'"),
        ([(4, 3, ("1 m",))], ""),
        ([(2, 1, ("1 m",)), (3, 2, ("1 m", "3 m"))], "3 of 5 values that are none, such as '1 m'"),
        ([(2, 2, ("1 m",)), (3, 3, ("1 m",))], ""),
        ([(2, 2, ("1 m",)), (3, 3, ("2 m",))], "5 of 5 values that are none, such as '1 m'"),
        ([(2, 2, (50 * "1", "2 m"))], f"2 of 2 values that are none, such as '{40 * '1'}'"),
    ],
)
def test_a_column_is_refused_of_which_most_texts_are_no_numbers(parts, got):
    tallies = Tallies({"step_m": "Step"})
    for part, (given, bad, examples) in enumerate(parts):
        # Each part counts once, as it is read several times.
        tallies.add_texts("step", part, 99, 99, ("a 1", "b 2"))
        tallies.add_texts("step", part, given, bad, examples)
        tallies.add_texts("other", part, 9, 9, ("c 1", "d 2"))
    where = "a.csv, column Step (step_m): expected numbers, found "
    assert refused(tallies, SPEED) == (
        f"{where}{got} (likely: a unit in each field)" if got else ""
    )


def test_columns_without_any_number_in_all_parts():
    tallies = Tallies()
    for column, part, given in (("a", 1, 0), ("a", 5, 2), ("b", 1, 0), ("b", 5, 0), ("c", 1, 1)):
        tallies.add_texts(column, part, given)
    assert tallies.empty == ("b",)


def test_unwrapped_headings_are_wrapped():
    """Those that go on beyond a turn by 6.3 rad, in the table that is kept."""
    reading = Reading(PATH)
    headings = [5.0, 6.1, 7.2, 8.3]
    reading.add(
        "motion",
        {"time_s": 1.78e9 + np.arange(4.0), "step_m": 1.0, "heading_rad": headings},
        range(4),
    )
    found = reading.tables["motion"][0]["heading_rad"].tolist()
    assert found == pytest.approx([5.0, 6.1, 7.2 - 2 * np.pi, 8.3 - 2 * np.pi])
    assert reading.notes == [
        "motion, heading_rad: 2 values beyond a turn, wrapped (unwrapped)",
    ]
