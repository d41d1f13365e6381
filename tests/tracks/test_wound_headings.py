"""Which headings beyond a turn are unwrapped ones, part by part of a file, by hand."""

from math import isnan, nan, pi

import numpy as np
import pytest

from mapfilter.tracks.readers.recorded.wound import TURN_DEG, TURN_RAD, Winding


def unwound(winding, *headings, outside=None):
    heading = np.array(headings)
    beyond = np.abs(heading) > winding.turn if outside is None else np.array(outside)
    return winding.unwound(heading, beyond).tolist()


def test_headings_in_radians_that_go_on_are_wrapped():
    winding = Winding()
    assert unwound(winding, 5.5, 8.25, 9.0) == pytest.approx([5.5, 8.25 - 2 * pi, 9.0 - 2 * pi])
    assert (winding.rows, winding.jumps, winding.last) == (3, 0, 9.0)
    assert (winding.wound, winding.whole) == (True, False)
    # The next part follows the last row of the one before.
    assert unwound(winding, 11.5, 14.0) == pytest.approx([11.5 - 4 * pi, 14.0 - 4 * pi])
    assert (winding.rows, winding.jumps) == (5, 0)
    assert unwound(winding, 17.5, 18.5) == [17.5, 18.5]
    assert (winding.rows, winding.jumps, winding.wound) == (7, 1, False)
    # Once they are none they stay so.
    assert unwound(winding, 19.5, 20.5) == [19.5, 20.5]


def test_half_a_turn_from_row_to_row_is_the_most():
    winding = Winding(TURN_DEG)
    assert unwound(winding, 350.5, 530.5, 350.5, 530.5) == [350.5, 170.5, 350.5, 170.5]
    assert (winding.rows, winding.jumps, winding.wound) == (4, 0, True)
    other = Winding(TURN_DEG)
    assert unwound(other, 350.5, 530.75, 350.25) == [350.5, 530.75, 350.25]
    assert (other.rows, other.jumps, other.wound) == (3, 2, False)


@pytest.mark.parametrize(
    ("turn", "first", "wound"),
    [(TURN_RAD, TURN_RAD, True), (TURN_RAD, 6.5, False), (TURN_RAD, -TURN_RAD, True),
     (TURN_RAD, -6.5, False), (TURN_DEG, 730.5, True)],
)  # fmt: skip
def test_those_in_radians_begin_within_a_turn(turn, first, wound):
    winding = Winding(turn)
    found = unwound(winding, first, first + 0.5, outside=(True, True))
    assert winding.wound is wound
    turns = round(first / turn) if wound else 0
    assert found == pytest.approx([first - turns * turn, first + 0.5 - turns * turn])


def test_ten_turns_to_one_side_are_the_most():
    rising = [*np.arange(0.5, 62.0, 3.0), 10 * TURN_RAD]
    winding = Winding()
    assert max(np.abs(unwound(winding, *rising, outside=np.ones(22, bool)))) < pi
    assert winding.wound
    assert unwound(winding, 10 * TURN_RAD + 0.5) == [10 * TURN_RAD + 0.5]
    assert not winding.wound
    beyond, rising = Winding(), np.arange(0.5, 66.0, 3.0).tolist()
    assert unwound(beyond, *rising) == rising
    assert not beyond.wound
    # Degrees beyond them are none, and left out: those around are wrapped.
    found = unwound(Winding(TURN_DEG), 3500.5, 3600.0, 3600.25, 3550.25)
    assert found == [-99.5, 0.0, 3600.25, -49.75]


def test_numbers_that_are_no_headings_are_left_out():
    winding = Winding()
    assert unwound(winding, 5.5, 361.0, 8.5) == pytest.approx([5.5, 361.0, 8.5 - 2 * pi])
    assert (winding.rows, winding.last) == (2, 8.5)
    assert unwound(winding, 8.5, 360.0) == [8.5, 360.0]
    assert (winding.rows, winding.jumps, winding.wound) == (4, 1, False)
    nothing = Winding()
    assert isnan(unwound(nothing, nan, 361.0)[0])
    assert isnan(nothing.last)
    assert nothing == Winding(last=nothing.last)


def test_whole_numbers_are_degrees():
    winding = Winding(TURN_DEG)
    assert unwound(winding, 350.0, 365.0, 380.0) == [350.0, 365.0, 380.0]
    assert (winding.whole, winding.wound) == (True, True)
    assert unwound(winding, 385.0, 390.5) == [25.0, 30.5]
    assert not winding.whole
    assert unwound(winding, 395.0) == [35.0]


def test_only_what_is_out_of_range_is_wrapped():
    winding = Winding(TURN_DEG)
    heading = np.array([350.5, 340.5])
    assert winding.unwound(heading, np.array([False, False])) is heading
    assert unwound(winding, 350.5, 365.5, -200.5, outside=(False, True, False)) == [
        350.5, 365.5, -200.5,
    ]  # fmt: skip
    assert unwound(Winding(TURN_DEG), 350.5, 365.5, outside=(False, True)) == [350.5, 5.5]


@pytest.mark.parametrize(
    ("turn", "rows", "jumps", "whole", "doubtful"),
    [
        (TURN_RAD, 2, 0, False, True),
        (TURN_RAD, 2, 2, True, True),
        (TURN_RAD, 3, 0, True, False),
        (TURN_RAD, 3, 0, False, True),
        (TURN_RAD, 3, 2, False, True),
        (TURN_RAD, 3, 3, False, False),
        (TURN_RAD, 60, 3, False, False),
        (TURN_RAD, 61, 3, False, True),
        (TURN_RAD, 100, 5, False, False),
        (TURN_DEG, 2, 0, False, False),
    ],
)
def test_headings_that_hardly_jump_may_be_radians(turn, rows, jumps, whole, doubtful):
    winding = Winding(turn, rows=rows, jumps=jumps, whole=whole)
    assert winding.doubtful is doubtful
