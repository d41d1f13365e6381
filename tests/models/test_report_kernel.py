"""The one pass by which a report is weighed, against its parts; records and their tiles."""

import numpy as np
import pytest
from numba import njit
from test_model_kernel_parts import (
    BANDS,
    BLOCK,
    SLOTS,
    WIDTH,
    Particles,
    aged,
    report_of_aged_copies,
)
from weighed_reports import weigh_by_absence, weigh_by_levels

from mapfilter.models.ageing import age, as_it_is
from mapfilter.models.fingerprint import bound_table, weigh_by_serving
from mapfilter.models.level_kernels import Prediction
from mapfilter.models.record_tiles import (
    TILE,
    gather,
    kept_in,
    new_records,
    records_of,
    scatter,
    stream,
    streamed,
)

ROW, LARGE = 2 * SLOTS + 2, 66_000
"""Row of the serving cell's fault, and so many hypotheses that records go past the caches."""


def by_parts_of_the_report(p):
    """Age, then weigh by the serving cell, by levels and by absent cells, each in its own pass."""
    _, (found, served, *heard), _ = report_of_aged_copies(p)
    age(0, p.count, found)
    kept, odds = kept_in(found.now, WIDTH), kept_in(found.now, WIDTH)[ROW].copy()
    given = served.pixel, served.level_dbm, served.cells, served.table, served.weight
    weigh_by_serving(0, p.count, *given, odds, served.other, p.log_weight)
    kept[ROW], after_serving = odds, p.log_weight.copy()
    given = heard[:3]
    weigh_by_levels(0, p.count, as_it_is(found.now), *given, 0.35, p.log_weight)
    weigh_by_absence(0, p.count, found.now, *given, bound_table(), 0.35, p.log_weight)
    return kept, p.log_weight, after_serving


@pytest.mark.parametrize("count", [1, 15, 16, 127, 128, 1000, LARGE])
def test_one_pass_is_its_parts(count):
    kernel, given, found = report_of_aged_copies(Particles(count))
    kernel(0, count, *given)
    for one, other in zip(found, by_parts_of_the_report(Particles(count)), strict=True):
        np.testing.assert_array_equal(one, other)
    # What was before stays.
    np.testing.assert_array_equal(given[0].before, Particles(count).records)


def test_parts_of_many_give_the_bytes_of_the_whole():
    cut, found = LARGE // 2 // BLOCK * BLOCK, []
    for cuts in ([], [cut]):
        kernel, given, changed = report_of_aged_copies(Particles(LARGE))
        for first, stop in zip([0, *cuts], [*cuts, LARGE], strict=True):
            kernel(first, stop, *given)
        found.append([array.tobytes() for array in changed])
    assert found[0] == found[1]


def test_records_that_do_not_begin_with_a_cache_line_are_written_too():
    p, q = Particles(LARGE), Particles(LARGE)
    there = np.empty(p.records.size + 1, np.float32)[1:].reshape(p.records.shape)
    predicted = Prediction(p.level_dbm, p.rough, BANDS, 0.3)
    found = aged(p, p.chosen)._replace(now=there)
    weigh_by_levels(0, LARGE, found, p.pixel, predicted, p.terms, 0.35, p.log_weight)
    usual = aged(q, q.chosen)
    weigh_by_levels(0, LARGE, usual, q.pixel, predicted, q.terms, 0.35, q.log_weight)
    np.testing.assert_array_equal(kept_in(there, WIDTH), kept_in(usual.now, WIDTH))


@pytest.mark.parametrize("width", [1, 13, 16, 32, 74])
@pytest.mark.parametrize("count", [1, 2, 50])
def test_records_are_found_again(width, count):
    records = new_records(count, width)
    assert records.ctypes.data % 64 == 0
    assert (records.shape[0], records.shape[1] % TILE, records.shape[1] - width < TILE) == (
        count, 0, True,
    )  # fmt: skip
    records[:] = np.arange(records.size).reshape(records.shape)
    kept = kept_in(records, width)
    assert kept.shape == (width, count)
    found = records_of(kept)
    np.testing.assert_array_equal(found[:, :width], records[:, :width])
    assert count == 1 or np.shares_memory(found, records)
    copied = records_of(np.ascontiguousarray(kept))
    np.testing.assert_array_equal(copied[:, :width], records[:, :width])
    # The last one has no room behind it.
    bare = records.reshape(-1)[: (count - 1) * records.shape[1] + width].copy()
    strides = 4 * records.shape[1], 4
    few = np.lib.stride_tricks.as_strided(bare, (count, width), strides).T
    np.testing.assert_array_equal(records_of(few)[:, :width], records[:, :width])


@njit
def _compiled(records, at, factor, usual, block, back, past):
    for d in range(0, records.shape[1], TILE):
        gather(records, at, 0, d, factor, usual, block)
        scatter(block, 0, d, back, 0)
        stream(block, 0, d, past, 0)
    streamed()


def test_compiled_tiles_are_those_of_numpy():
    rng = np.random.default_rng(5)
    records = rng.normal(0.0, 5.0, (40, 32)).astype(np.float32)
    at = rng.integers(40, size=TILE).astype(np.int32)
    factor, usual = rng.random((2, 32)).astype(np.float32)
    found, expected = [], []
    for made, run in ((found, _compiled), (expected, _compiled.py_func)):
        block = np.zeros((32, TILE), np.float32)
        back, past = new_records(TILE, 32), new_records(TILE, 32)
        run(records, at, factor, usual, block, back, past)
        made += [block, back, past]
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-5, atol=1e-5)
    np.testing.assert_array_equal(found[1], found[0].T)
    np.testing.assert_array_equal(found[2], found[0].T)
