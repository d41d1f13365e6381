"""A reading of a cell whose prediction may be wrong: the mixture by Bayes' rule, and its bounds."""

from math import exp, log

import pytest

from mapfilter.models.cell_faults import MOST_KEPT, MOST_READING, mixed

plain = mixed.py_func


@pytest.mark.parametrize("before", [-6.0, -2.7, 0.0, 3.0])
@pytest.mark.parametrize(("other", "right"), [(-4.0, -1.0), (-4.0, -9.0), (-3.0, -3.0)])
def test_a_reading_is_mixed_by_bayes(before, other, right):
    wrong = exp(before) / (1 + exp(before))
    likelihood = wrong * exp(other) + (1 - wrong) * exp(right)
    fine, gained, after = (float(one) for one in plain(before, other, right))
    assert fine == pytest.approx((1 - wrong) * exp(right) / likelihood, rel=1e-4)
    assert gained == pytest.approx(log(likelihood), abs=1e-4)
    # What is kept is bounded.
    assert after == pytest.approx(max(before + other - right, -MOST_KEPT), abs=1e-4)


def test_bounds_of_the_log_odds():
    assert (MOST_READING, MOST_KEPT) == (20.0, 8.0)
    # A reading that fits not at all: the likelihood is that of a fault, which may end.
    fine, gained, after = (float(one) for one in plain(-2.0, -4.0, -300.0))
    assert fine == pytest.approx(exp(-20), rel=1e-3)
    assert gained == pytest.approx(-4.0 + log(exp(-2.0) / (1 + exp(-2.0))), abs=1e-3)
    assert after == 8.0
    # One that fits very well: a fault stays possible.
    fine, gained, after = (float(one) for one in plain(-2.0, -60.0, -1.0))
    assert fine == pytest.approx(1.0, abs=1e-6)
    assert gained == pytest.approx(-1.0 - log(1 + exp(-2.0)), abs=1e-4)
    assert after == -8.0
    # Faults that are next to impossible from the start stay so, and become no rarer.
    assert float(plain(-50.0, -4.0, -1.0)[2]) == -50.0
    assert float(plain(-50.0, -4.0, -30.0)[2]) == pytest.approx(-24.0)
