"""How much a fix refutes a belief: by hand against a fix anywhere in the area."""

from math import log, nan, pi, sqrt

import pytest

from mapfilter.positioning.epochs import GnssFix
from mapfilter.positioning.gnss.fixes import refutation

AREA_M2 = 800.0


def fix(var_east_m2=36.0, var_north_m2=25.0, cross_m2=nan):
    return GnssFix(0.0, 0.0, var_east_m2, var_north_m2, cross_m2)


@pytest.mark.parametrize(
    ("given", "spread_m2"),
    [
        (fix(), 30.0),
        (fix(cross_m2=18.0), sqrt(36 * 25 - 18**2)),
        # A fix is no better than a metre, and never of less than a square metre in all.
        (fix(0.01, 25.0), 5.0),
        (fix(36.0, 0.01), 6.0),
        (fix(4.0, 4.0, 4.0), 1.0),
    ],
)
def test_a_fix_at_a_narrow_belief_refutes_by_how_rare_it_is_elsewhere(given, spread_m2):
    """A normal density is 1 / (2 pi spread) in its middle, and that of any place 1 / area."""
    expected = log(2 * pi * spread_m2 / AREA_M2)
    assert -5 < expected < -1
    assert refutation(given, 0.0, AREA_M2) == pytest.approx(expected)
    assert refutation(given, expected + 0.5, AREA_M2) == pytest.approx(-0.5)


def test_what_a_wide_belief_expects_refutes_nothing():
    assert refutation(fix(), -50.0, AREA_M2) == 0.0
    # In an area smaller than the fix's spread nothing is refuted either.
    assert refutation(fix(), -1.0, 100.0) == 0.0
    assert refutation(fix(), 0.0, 100.0) == 0.0


def test_a_fix_refutes_no_more_than_a_bound_as_it_may_be_faulty():
    assert refutation(fix(), 0.0, 1e30) == refutation(fix(), -0.5, 1e40) == -5.0
