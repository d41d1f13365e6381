"""Weights and systematic choice over arrays of any device, by their definitions."""

from fractions import Fraction
from math import ceil

import numpy as np
import pytest
import strict_arrays
from hypothesis import given
from hypothesis import strategies as st

from mapfilter.filters.array_resampling import normalise_arrays, systematic_arrays

eighths = st.lists(st.integers(0, 16), min_size=1, max_size=12).filter(any)


@given(st.lists(st.floats(-40.0, 40.0), min_size=1, max_size=40), st.floats(-900.0, 900.0))
def test_weights_sum_to_one_and_the_log_weights_are_theirs(logs, shift):
    given_log = np.array(logs) + shift
    log_weight = given_log.copy()
    weight, log_total, effective = normalise_arrays(log_weight)
    share = np.exp(np.array(logs) - max(logs))
    assert weight.dtype == np.float32
    np.testing.assert_allclose(weight, share / share.sum(), rtol=1e-5, atol=1e-30)
    expected = max(logs) + shift + np.log(share.sum())
    assert log_total == pytest.approx(expected, rel=1e-6, abs=1e-6)
    np.testing.assert_allclose(log_weight, given_log - log_total, rtol=0, atol=1e-9)
    assert effective == pytest.approx(share.sum() ** 2 / (share**2).sum(), rel=1e-5)


@pytest.mark.parametrize("nothing", [-np.inf, np.nan])
def test_no_weight_is_left(nothing):
    weight, log_total, effective = normalise_arrays(np.full(5, nothing))
    assert weight.tolist() == [0.0] * 5
    assert (weight.dtype, log_total, effective) == (np.float32, -np.inf, 0.0)


def test_particles_without_weight_stay_without():
    log_weight = np.array([-np.inf, -3.0, -3.0, -np.inf])
    weight, log_total, effective = normalise_arrays(log_weight)
    assert weight.tolist() == [0.0, 0.5, 0.5, 0.0]
    assert (log_total, effective) == (pytest.approx(np.log(2) - 3.0), pytest.approx(2.0))
    np.testing.assert_allclose(log_weight, [-np.inf, -np.log(2), -np.log(2), -np.inf], rtol=1e-6)


@given(eighths, st.integers(0, 15), st.integers(1, 40))
def test_copies_are_those_of_places_at_equal_distances(counts, sixteenth, wanted):
    """A place, (k + offset) / M, copies the first particle up to which more weight lies."""
    total = sum(counts)
    # Weights that floating point holds exactly: of a power of two, the last has what is missing.
    power = 1 << ceil(np.log2(total)) if total > 1 else 1
    counts = [*counts, power - total]
    weight, offset = np.float32(np.array(counts) / power), sixteenth / 16
    upto = [Fraction(sum(counts[: n + 1]), power) for n in range(len(counts))]
    expected = []
    for k in range(wanted):
        place = Fraction(k * 16 + sixteenth, 16 * wanted)
        expected.append(next(n for n, mass in enumerate(upto) if mass > place))
    found = systematic_arrays(weight, offset, wanted)
    assert found.dtype == np.int32
    assert found.tolist() == expected


def test_arrays_of_a_device_stay_there():
    log_weight = np.log([0.25, 0.5, 0.25])
    there = strict_arrays.asarray(log_weight.copy())
    weight, log_total, effective = normalise_arrays(there)
    here, *same = normalise_arrays(log_weight)
    assert [log_total, effective] == pytest.approx(same)
    np.testing.assert_array_equal(strict_arrays.asnumpy(weight), here)
    chosen = systematic_arrays(weight, 0.25, 7)
    np.testing.assert_array_equal(strict_arrays.asnumpy(chosen), systematic_arrays(here, 0.25, 7))
