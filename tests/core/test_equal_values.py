"""Values of epochs are equal where all that they hold is, whichever NaN that is."""

import pytest

from mapfilter.filters.contract import MotionStep
from mapfilter.positioning.epochs import Difference, Epoch, GnssFix, Pseudorange, ReportRow


def unknown():
    """Return a NaN of its own: comparing by identity does not find it equal."""
    return float("nan")


def epoch(level_dbm=-70.0):
    return Epoch(
        1.0,
        (MotionStep(0.7, unknown(), 0.1),),
        (ReportRow("serving", "A", None, None, level_dbm, 0, unknown()),),
        GnssFix(1.0, 2.0, unknown(), unknown(), unknown()),
        (Pseudorange("G01", 2e7, unknown(), (unknown(), unknown(), unknown())),),
        (Difference("A", "B", unknown(), unknown(), unknown()),),
    )


def values(one):
    return [one, *one.motion, *one.radio, one.fix, *one.ranges, *one.differences]


def test_what_is_unknown_in_both_is_equal_and_has_one_hash():
    for one, other in zip(values(epoch()), values(epoch()), strict=True):
        assert one == other
        assert hash(one) == hash(other)
        assert len({one, other}) == 1


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (epoch(), epoch(level_dbm=-71.0)),
        (epoch(), epoch(level_dbm=unknown())),
        (MotionStep(0.7, unknown()), MotionStep(0.7, 0.0)),
        (GnssFix(1.0, 2.0), GnssFix(1.0, 2.0, 9.0)),
        (GnssFix(1.0, 2.0), (1.0, 2.0)),
    ],
)
def test_what_differs_in_one_value_or_kind_does_not(one, other):
    assert one != other
    assert not one == other  # noqa: SIM201  both operators are asked


def test_a_fix_repeats_one_with_the_same_unknown_errors():
    assert GnssFix(1.0, 2.0, unknown()).repeats(GnssFix(1.0, 2.0, unknown()))
    assert not GnssFix(1.0, 2.0, unknown()).repeats(GnssFix(1.0, 2.0, 4.0))
    assert not GnssFix(1.0, 2.0).repeats(None)
