"""Weights that sum to one, and resampling that is fair."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapfilter._kernels import draw_key
from mapfilter._threads import ONE, Threads
from mapfilter.filters.copies import array_of, copies_of
from mapfilter.filters.resampling import (
    copy_with_jitter,
    log_sum,
    normalise,
    normalise_by,
    systematic,
    systematic_by,
)


def test_log_weights_are_brought_to_sum_to_one():
    log_weight = np.log(np.array([1.0, 2.0, 5.0])) - 1000.0
    weight = np.empty(3, dtype=np.float32)
    log_total, effective = normalise(log_weight, weight)
    np.testing.assert_allclose(weight, [0.125, 0.25, 0.625], rtol=1e-5)
    np.testing.assert_allclose(np.exp(log_weight), weight, rtol=1e-5)
    assert log_total == pytest.approx(np.log(8.0) - 1000.0, abs=1e-5)
    assert effective == pytest.approx(1 / (0.125**2 + 0.25**2 + 0.625**2), rel=1e-5)


@pytest.mark.parametrize("count", [1, 1024, 1025, 5000])
def test_weights_and_choice_are_the_same_to_the_byte_for_any_number_of_threads(count):
    given_, found = np.random.default_rng(count).normal(-800.0, 30.0, count), []
    given_[:: max(count // 3, 2)] = -np.inf
    for threads in (ONE, *(Threads(n, least=0) for n in (2, 3, 7))):
        log_weight, weight = given_.copy(), np.empty(count, dtype=np.float32)
        sums = normalise_by(threads, log_weight, weight)
        chosen = np.full(2 * count // 3 + 1, -1, dtype=np.int32)
        systematic_by(threads, weight, 0.4, chosen)
        found.append((sums, *(one.tobytes() for one in (log_weight, weight, chosen))))
    assert found == [found[0]] * 4
    # A block without any weight, and one whose largest is negligible, take part.
    exact = np.exp(given_ - given_.max()) if count > 1 else np.ones(1)
    if count > 1:
        np.testing.assert_allclose(weight, exact / exact.sum(), rtol=1e-5, atol=1e-30)


def test_no_weight_is_told():
    assert normalise(np.full(3, -np.inf), np.empty(3, dtype=np.float32)) == (-np.inf, 0.0)
    for threads in (ONE, Threads(2, least=0)):
        nothing = np.full(3000, -np.inf), np.empty(3000, dtype=np.float32)
        assert normalise_by(threads, *nothing) == (-np.inf, 0.0)


def test_a_block_without_weight_has_none():
    log_weight, weight = np.full(2048, -np.inf), np.empty(2048, dtype=np.float32)
    log_weight[1024:] = 5.0
    assert normalise(log_weight, weight) == pytest.approx((5.0 + np.log(1024), 1024.0))
    np.testing.assert_allclose(weight, np.repeat([0.0, 1 / 1024], 1024), rtol=1e-6)
    chosen = np.empty(300, dtype=np.int32)
    systematic(weight, 0.0, chosen)
    assert chosen.min() >= 1024


@pytest.mark.parametrize("heavy", [0, 700, 1023, 1024, 2999])
def test_one_particle_may_have_all_copies(heavy):
    weight, chosen = np.zeros(3000, dtype=np.float32), np.empty(2500, dtype=np.int32)
    weight[heavy] = 1.0
    systematic(weight, 0.7, chosen)
    assert chosen.tolist() == [heavy] * 2500


@given(
    st.lists(st.floats(0.01, 1.0), min_size=1, max_size=30),
    st.floats(0, 1, exclude_max=True),
    st.integers(1, 60),
)
@settings(max_examples=200, deadline=None)
def test_copies_differ_by_less_than_one_from_their_due(shares, offset, count):
    weight = np.array(shares, dtype=np.float32)
    weight /= weight.sum()
    chosen = np.empty(count, dtype=np.int32)
    systematic(weight, offset, chosen)
    copies = np.bincount(chosen, minlength=weight.size)
    assert np.all(np.abs(copies - count * weight.astype(np.float64)) < 1 + 1e-3)
    assert np.all(np.diff(chosen) >= 0)


def one_after_another(weight, offset, count):
    """Systematic resampling as it is defined: each place is looked up in the sums of weights."""
    found, passed, i = [], float(weight[0]), 0
    for j in range(count):
        while passed <= (j + offset) / count and i < weight.size - 1:
            i += 1
            passed += float(weight[i])
        found.append(i)
    return found


@given(
    st.lists(st.sampled_from([0.0, 1e-6, 0.03, 0.5, 1.0]), min_size=1, max_size=40),
    st.floats(0, 1, exclude_max=True),
    st.integers(0, 70),
)
@settings(max_examples=300, deadline=None)
def test_copies_are_those_of_a_search_for_each(shares, offset, count):
    weight = np.array([*shares, 0.25], dtype=np.float32)
    weight /= weight.sum()
    # Away from ties, which rounding decides.
    offset = round(offset, 3) + 1.7e-4
    chosen = np.empty(count, dtype=np.int32)
    systematic(weight, offset, chosen)
    assert chosen.tolist() == one_after_another(weight, offset, count)


@pytest.mark.parametrize(("rows", "count"), [(0, 5), (1, 3), (4, 2500), (7, 1024), (31, 1025)])
def test_copies_of_what_is_kept_are_the_chosen_columns(rows, count):
    rng = np.random.default_rng(rows)
    kept = rng.standard_normal((rows, 900)).astype(np.float32)
    chosen = np.sort(rng.integers(900, size=count)).astype(np.int32)
    copies = copies_of(kept, chosen)
    assert copies.shape == (rows, count)
    np.testing.assert_array_equal(copies.made(), kept[:, chosen])
    again = np.sort(rng.integers(count, size=count + 3)).astype(np.int32)
    twice = copies_of(copies, again)
    assert twice.of is kept
    np.testing.assert_array_equal(array_of(twice), kept[:, chosen][:, again])
    assert array_of(kept) is kept


def test_resampling_is_unbiased():
    weight, chosen = np.array([0.4, 0.3, 0.2, 0.1], dtype=np.float32), np.empty(4, dtype=np.int32)
    rng, runs = np.random.default_rng(1), 20_000
    copies = np.zeros(4)
    for _ in range(runs):
        systematic(weight, rng.random(), chosen)
        copies += np.bincount(chosen, minlength=4)
    # Each count is off by less than one: five standard errors are 5 · 0.5 / √20 000 at most.
    np.testing.assert_allclose(copies / runs, 4 * weight, atol=0.018)


def test_copies_part_by_the_jitter():
    state = np.array([[1.0, 2.0], [10.0, 20.0], [7.0, 7.0], [1.0, 1.0], [5.0, 6.0]], np.float32)
    chosen = np.zeros(50_000, dtype=np.int32)
    copies = np.empty((5, chosen.size), dtype=np.float32)
    jitter = np.array([2.0, 0.5, 0.0, 1.0, 3.0], dtype=np.float32)
    copy_with_jitter(
        0, chosen.size, state, chosen, jitter, draw_key(np.random.default_rng(0)), copies
    )
    np.testing.assert_allclose(copies.mean(axis=1), [1.0, 10.0, 7.0, 1.0, 5.0], atol=0.06)
    np.testing.assert_allclose(copies.std(axis=1), [2.0, 0.5, 0.0, 1.0, 3.0], rtol=0.02)
    noise = np.corrcoef(copies[[0, 1, 3, 4]]) - np.eye(4)
    assert np.abs(noise).max() < 0.02


def test_rows_beyond_the_jitter_are_copied_as_they_are():
    state = np.arange(24.0, dtype=np.float32).reshape(8, 3)
    chosen = np.array([2, 0, 0, 1], dtype=np.int32)
    copies = np.empty((8, chosen.size), dtype=np.float32)
    # What lies behind it in memory is no jitter.
    jitter = np.full(8, 100.0, dtype=np.float32)[:5]
    copy_with_jitter(
        0, chosen.size, state, chosen, jitter, draw_key(np.random.default_rng(0)), copies
    )
    np.testing.assert_array_equal(copies[5:], state[5:, chosen])
    assert not np.any(copies[:5] == state[:5, chosen])


def test_a_log_sum_is_that_of_each_after_the_other():
    log_weight = np.random.default_rng(3).normal(-900.0, 4.0, 3000)
    assert log_sum(log_weight) == pytest.approx(np.logaddexp.reduce(log_weight), abs=1e-9)
    log_weight[5] = -np.inf
    assert log_sum(log_weight) == pytest.approx(np.logaddexp.reduce(log_weight), abs=1e-9)
    assert log_sum(np.full(3, -np.inf)) == -np.inf
    assert log_sum(np.empty(0)) == -np.inf
