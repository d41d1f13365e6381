"""Values of epochs are equal where all that they hold is, whichever NaN that is."""

import ast
from dataclasses import dataclass, field
from pathlib import Path

import pytest

import mapfilter
from mapfilter._same import EqualByValue
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
    return [one, *one.motion, *one.radio, one.gnss, *one.pseudoranges, *one.tdoa]


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


@dataclass(frozen=True, eq=False)
class Timed(EqualByValue):
    east_m: float
    took_s: float = field(compare=False)


def test_what_is_not_compared_has_no_part_in_the_hash():
    assert Timed(1.0, 2.0) == Timed(1.0, 3.0)
    assert len({Timed(1.0, 2.0), Timed(1.0, 3.0)}) == 1


def test_a_fix_repeats_one_with_the_same_unknown_errors():
    assert GnssFix(1.0, 2.0, unknown()).repeats(GnssFix(1.0, 2.0, unknown()))
    assert not GnssFix(1.0, 2.0, unknown()).repeats(GnssFix(1.0, 2.0, 4.0))
    assert not GnssFix(1.0, 2.0).repeats(None)


def compared_field_by_field(source):
    """Return the names of frozen dataclasses that hold NaN by default and compare as usual."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.ClassDef):
            made_by = " ".join(map(ast.unparse, node.decorator_list))
            usual = "dataclass(frozen=True" in made_by and "eq=False" not in made_by
            values = (one.value for one in node.body if isinstance(one, ast.AnnAssign))
            unknown = {"nan", "float('nan')"} & {ast.unparse(one) for one in values if one}
            if usual and unknown:
                yield node.name


def test_no_value_that_may_be_unknown_is_compared_field_by_field():
    """Python 3.13 compares dataclasses field by field, by which NaN differs from itself."""
    assert list(compared_field_by_field("@dataclass(frozen=True)\nclass A:\n    b: float = nan"))
    for path in Path(mapfilter.__file__).parent.rglob("*.py"):
        source = path.read_text(encoding="utf-8")
        if "= nan" in source or 'float("nan")' in source:
            assert not list(compared_field_by_field(source)), path
