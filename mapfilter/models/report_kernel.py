"""The pass over hypotheses by which a report is weighed, compiled.

Each block of hypotheses is copied, aged, weighed by the serving cell, by levels and by absent
cells, and written, before the next: what a hypothesis keeps is read once and written once.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from mapfilter._types import Floats, Floats32, Ints32
from mapfilter.models.ageing import Ageing, factors
from mapfilter.models.fingerprint import ServingBands, weigh_by_serving
from mapfilter.models.level_kernels import (
    BLOCK,
    LevelTerms,
    Prediction,
    add_absence,
    add_levels,
    gain_of_sums,
    in_fours,
)
from mapfilter.models.record_tiles import TILE, gather, scatter, stream, streamed

_F = np.float32
_LARGE_BYTES = 4 * 2**20
"""Records that take more leave the caches of a core before they are read again."""
_LINE_BYTES = 64
_NO_INTS: Ints32 = np.empty(0, dtype=np.int32)
_NO_FLOATS: Floats32 = np.empty(0, dtype=np.float32)


class Served(NamedTuple):
    """The serving cell of a report, with arguments of :func:`fingerprint.weigh_by_serving`.

    ``row`` is the number of a record with the log odds of its fault; -1 for no serving cell.
    """

    pixel: Ints32
    level_dbm: Floats32
    cells: ServingBands
    table: Floats32
    weight: float
    row: int
    other: float


class Heard(NamedTuple):
    """Levels of a report, or cells that are absent from it: none where there are no terms.

    ``pixel`` (N,) are those of hypotheses in the prediction. Kernels are given its parts, as numba
    takes five times as long to unpack a named tuple of named tuples.
    """

    pixel: Ints32
    predicted: Prediction
    terms: LevelTerms


NOT_SERVED = Served(_NO_INTS, _NO_FLOATS, ServingBands(0, 0, 0, 0), _NO_FLOATS, 0.0, -1, 0.0)
NOT_HEARD = Heard(
    _NO_INTS,
    Prediction(_NO_FLOATS, np.empty(0, dtype=np.uint8), 0, 0.0),
    LevelTerms(
        _NO_INTS,
        _NO_INTS,
        _NO_FLOATS,
        np.empty((0, 1), dtype=np.float32),
        _NO_FLOATS,
        _NO_FLOATS,
    ),
)


@njit(error_model="numpy", fastmath={"contract"}, cache=True, nogil=True)
def weigh_by_report(
    begin: int,
    stop: int,
    ageing: Ageing,
    served: Served,
    pixel: Ints32,
    predicted: Prediction,
    terms: LevelTerms,
    absent_pixel: Ints32,
    absent_predicted: Prediction,
    absent_terms: LevelTerms,
    table: Floats32,
    weight: float,
    log_weight: Floats,
    after_serving: Floats,
) -> None:
    """Age what hypotheses keep, add the log-likelihood of a report to weights, and update both.

    That is done for hypotheses ``begin`` to ``stop``. Levels and absent cells, each the parts of a
    :class:`Heard`, count by ``weight``.

    Parameters
    ----------
    table : ndarray of float32
        That of :func:`mapfilter.models.fingerprint.bound_table`.
    log_weight : ndarray, shape (N,)
        Changed in place.
    after_serving : ndarray, shape (N,) or (0,)
        Filled with the weights before levels, where it is not empty.
    """
    both, now, w = factors(ageing), ageing.now, _F(weight)
    rows, chosen = np.empty((now.shape[1], BLOCK), np.float32), ageing.chosen.size > 0
    gain, upon = in_fours(terms.gain), gain_of_sums(terms)
    absent_gain, absent_upon = in_fours(absent_terms.gain), gain_of_sums(absent_terms)
    steps = np.zeros((gain.shape[0], BLOCK), np.float32)
    absent_steps = np.zeros((absent_gain.shape[0], BLOCK), np.float32)
    one, other = np.empty(BLOCK, np.float32), np.empty(BLOCK, np.float32)
    total, place = np.empty(BLOCK, np.float32), np.empty(BLOCK, np.int32)
    at = np.empty(2 * BLOCK, np.int32)
    large = (now.size * 4 >= _LARGE_BYTES) & (now.ctypes.data % _LINE_BYTES == 0)
    for first in range(begin, stop, BLOCK):
        count, into = min(BLOCK, stop - first), log_weight[first:]
        # This block's records, and those of the next that are fetched meanwhile.
        known = min(2 * BLOCK if large else BLOCK, stop - first)
        for j in range(known):
            at[j] = ageing.chosen[first + j] if chosen else first + j
        ahead = at[count:known]
        _read(ageing.before, at, count, both[0], both[1], rows)
        if served.row >= 0:
            weigh_by_serving(
                0,
                count,
                served.pixel[first:],
                served.level_dbm,
                served.cells,
                served.table,
                served.weight,
                rows[served.row],
                served.other,
                into,
            )
        if after_serving.size > 0:
            for j in range(count):
                after_serving[first + j] = into[j]
        if terms.cell.size > 0:
            add_levels(
                rows, count, pixel[first:], predicted, terms, gain, upon,
                steps, one, other, total, w, into, ageing.before, ahead,
            )  # fmt: skip
        if absent_terms.cell.size > 0:
            add_absence(
                rows, count, absent_pixel[first:], absent_predicted, absent_terms, absent_gain,
                absent_upon, table, absent_steps, one, other, total, place, w, into,
            )  # fmt: skip
        _write(rows, count, now, first, large)
    if large:
        streamed()


@njit(inline="always")
def _read(
    before: Floats32, at: Ints32, count: int, factor: Floats32, usual: Floats32, rows: Floats32
) -> None:
    """Fill the rows of a block with aged numbers of chosen records."""
    whole = count // TILE * TILE
    for j in range(0, whole, TILE):
        for d in range(0, rows.shape[0], TILE):
            gather(before, at, j, d, factor, usual, rows)
    for j in range(whole, count):
        for d in range(rows.shape[0]):
            rows[d, j] = usual[d] + (before[at[j], d] - usual[d]) * factor[d]


@njit(inline="always")
def _write(rows: Floats32, count: int, now: Floats32, first: int, large: bool) -> None:
    """Write the rows of a block as records."""
    whole = count // TILE * TILE
    if large:
        for j in range(0, whole, TILE):
            for d in range(0, rows.shape[0], TILE):
                stream(rows, j, d, now, first + j)
    else:
        for j in range(0, whole, TILE):
            for d in range(0, rows.shape[0], TILE):
                scatter(rows, j, d, now, first + j)
    for j in range(whole, count):
        for d in range(rows.shape[0]):
            now[first + j, d] = rows[d, j]
