"""Ageing of what hypotheses keep, read through the numbers of chosen ones, against NumPy."""

import tracemalloc

import numpy as np
import pytest

from mapfilter.filters.copies import Copies, columns_of, copies_of
from mapfilter.models.ageing import Ageing, age, as_it_is
from mapfilter.models.record_tiles import kept_in, new_records, records_of

WIDTH, MEANS, COUNT = 5, 3, 1500
DECAY = np.array([0.9, 0.5, 1.0], dtype=np.float32)
KEEP, USUAL = 0.7, -2.75


@pytest.fixture
def before():
    return np.random.default_rng(3).normal(0, 5, (WIDTH, 40)).astype(np.float32)


def aged(kept):
    """The same by NumPy, of columns that were copied before."""
    means = DECAY[:, None] * kept[:MEANS]
    faults = np.float32(USUAL) + (kept[MEANS:] - np.float32(USUAL)) * np.float32(KEEP)
    return np.vstack([means, faults])


def ageing(kept):
    now, (of, chosen) = new_records(kept.shape[1], WIDTH), columns_of(kept)
    now[:] = np.nan
    return Ageing(records_of(of), chosen, DECAY, KEEP, USUAL, True, now)


def test_copies_are_aged_as_the_columns_that_they_are_of(before):
    chosen = np.random.default_rng(4).integers(0, 40, COUNT).astype(np.int32)
    found = ageing(copies_of(before, chosen))
    untouched = before.copy()
    for first, stop in ((0, 700), (700, 701), (701, COUNT)):
        age(first, stop, found)
    now = kept_in(found.now, WIDTH)
    np.testing.assert_allclose(now, aged(before[:, chosen]), rtol=1e-6, atol=1e-6)
    np.testing.assert_array_equal(before, untouched)
    # Copies of copies are those of the first ones.
    again = np.array([5, 5, 1499], dtype=np.int32)
    twice = copies_of(Copies(before, chosen), again)
    np.testing.assert_array_equal(twice.made(), before[:, chosen][:, again])


def test_copies_of_a_few_records_take_no_room_for_all():
    records, chosen = new_records(20_000, WIDTH), np.array([7, 7, 19_999], dtype=np.int32)
    records[:] = np.arange(20_000)[:, None]
    few = Copies(kept_in(records, WIDTH), chosen)
    tracemalloc.start()
    try:
        made, (_, peak_bytes) = few.made(), tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    np.testing.assert_array_equal(made, np.tile(chosen, (WIDTH, 1)))
    assert peak_bytes < records.nbytes / 10


def test_what_has_columns_of_its_own_is_aged_in_their_order(before):
    found = ageing(before)
    age(0, 40, found)
    np.testing.assert_allclose(kept_in(found.now, WIDTH), aged(before), rtol=1e-6, atol=1e-6)


def test_what_is_as_it_should_be_stays(before):
    records = records_of(before)
    found = as_it_is(records)
    age(0, 40, found)
    assert found.now is records
    np.testing.assert_array_equal(kept_in(records, WIDTH), before)
