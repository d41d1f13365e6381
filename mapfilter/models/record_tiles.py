"""Records of hypotheses in memory, and rows of a block of them in the cache: tiles of 16 x 16.

What a hypothesis keeps is a *record*: numbers that follow each other, as many as tiles go into.
Resampling copies whole records, and a pass over them reads and writes memory from its beginning to
its end. Arithmetic wants rows, the same number of many hypotheses, for which a loop is vectorised.
A tile is 16 numbers of 16 records, which exchange halves, quarters and so on in four rounds: what
is loaded and stored are vectors, and none of their elements by itself.

The compiled functions are vector instructions of LLVM, for any processor. In plain Python each is
the assignment that its docstring has.
"""

# What stands for a function in compiled code has its arguments' names.
# ruff: noqa: ARG001

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils as _cgutils
from numba.extending import intrinsic, overload

from mapfilter._types import Floats32, Ints32

TILE = 16
"""Numbers of a tile's side: a cache line holds as many."""
_LINE_BYTES = 64

_INDEX = ir.IntType(32)
_VECTOR = ir.VectorType(ir.FloatType(), TILE)
_LANES = ir.VectorType(_INDEX, TILE)
_build: Any = _cgutils
_ROUNDED = ("contract",)
"""A product and a sum may be rounded once, as in the loops of kernels."""


def new_records(count: int, width: int) -> Floats32:
    """Return room for records of ``width`` numbers and more, (count, P), that fill cache lines."""
    size = -(-width // TILE) * TILE
    room = np.empty(count * size + TILE, dtype=np.float32)
    first = -_address(room) % _LINE_BYTES // 4
    return room[first : first + count * size].reshape(count, size)


def kept_in(records: Floats32, width: int) -> Floats32:
    """Return what hypotheses keep (W, N): a view of their records (N, P)."""
    return records[:, :width].T


def records_of(kept: Floats32) -> Floats32:
    """Return the records (N, P) that what hypotheses keep (W, N) is a view of, or new ones.

    Examples
    --------
    >>> records = new_records(3, 20)
    >>> found = records_of(kept_in(records, 20))
    >>> (found.shape, np.shares_memory(found, records))
    ((3, 32), True)
    >>> records_of(np.ones((20, 3), dtype=np.float32))[:, :20].sum()
    np.float32(60.0)
    """
    width, count = kept.shape
    size = -(-width // TILE) * TILE
    if kept.strides == (4, 4 * size):
        if size == width:
            return kept.T
        # They are there, unless the last record has no room behind it.
        owner = kept.base
        if isinstance(owner, np.ndarray) and owner.dtype == np.float32 and owner.ndim == 1:
            first = (_address(kept) - _address(owner)) // 4
            found = owner[first : first + count * size]
            if found.size == count * size and found.flags.c_contiguous:
                return found.reshape(count, size)
    records = new_records(count, width)
    records[:, :width] = kept.T
    return records


def _address(array: Floats32) -> int:
    address: int = array.__array_interface__["data"][0]
    return address


def gather(
    records: Floats32,
    at: Ints32,
    first: int,
    row: int,
    factor: Floats32,
    usual: Floats32,
    block: Floats32,
) -> None:
    """Fill a tile of a block's rows with numbers of chosen records, brought closer to usual ones.

    ``block[rows, first:first+16] = usual + (records[at[first:first+16], rows].T - usual) * factor``
    where ``rows`` are ``row`` to ``row + 16``.
    """
    rows, columns = slice(row, row + TILE), slice(first, first + TILE)
    u, f = usual[rows, None], factor[rows, None]
    block[rows, columns] = u + (records[at[columns], rows].T - u) * f


def scatter(block: Floats32, first: int, row: int, records: Floats32, to: int) -> None:
    """Write a tile back: ``records[to:to+16, rows] = block[rows, first:first+16].T``."""
    records[to : to + TILE, row : row + TILE] = block[row : row + TILE, first : first + TILE].T


def stream(block: Floats32, first: int, row: int, records: Floats32, to: int) -> None:
    """Do what :func:`scatter` does past the caches, to records that begin with cache lines.

    They are not read before, and replace nothing. :func:`streamed` is due once all are written.
    """
    scatter(block, first, row, records, to)


def streamed() -> None:
    """Let other threads see what :func:`stream` has written."""


def fetch(records: Floats32, at: int) -> None:
    """Begin to read a record, so that it is in the cache when it is needed."""


def _instruction(function: Callable[..., Any]) -> Callable[..., Any]:
    made: Callable[..., Any] = intrinsic(function)
    return made


def _shuffled(builder: Any, one: Any, other: Any, lanes: list[int]) -> Any:
    return builder.shuffle_vector(one, other, ir.Constant(_LANES, lanes))


def _transposed(builder: Any, rows: list[Any]) -> list[Any]:
    """Return the columns of 16 vectors: pairs exchange 1, 2, 4 and 8 lanes."""
    for step in (1, 2, 4, 8):
        lower = [(i ^ step) + TILE if i & step else i for i in range(TILE)]
        upper = [i + TILE if i & step else i ^ step for i in range(TILE)]
        for r in range(TILE):
            if not r & step:
                one, other = rows[r], rows[r | step]
                rows[r] = _shuffled(builder, one, other, lower)
                rows[r | step] = _shuffled(builder, one, other, upper)
    return rows


class _Arguments:
    """Arguments of an intrinsic: elements of arrays, and whole numbers."""

    def __init__(self, context: Any, builder: Any, types_: Any, values: Any) -> None:
        self._context, self._builder, self._types = context, builder, types_
        self._values = values

    def index(self, k: int) -> Any:
        """Return an argument as an index."""
        return self._context.cast(self._builder, self._values[k], self._types[k], types.intp)

    def pointer(self, k: int, *at: Any) -> Any:
        """Return the address of an array's element."""
        kind = self._types[k]
        array = self._context.make_array(kind)(self._context, self._builder, self._values[k])
        return _build.get_item_pointer(
            self._context, self._builder, kind, array, at, wraparound=False
        )

    def load(self, k: int, *at: Any) -> Any:
        """Return 16 numbers that follow each other."""
        place = self._builder.bitcast(self.pointer(k, *at), _VECTOR.as_pointer())
        return self._builder.load(place, align=4)

    def store(self, value: Any, align: int, k: int, *at: Any) -> Any:
        """Write 16 numbers that follow each other."""
        place = self._builder.bitcast(self.pointer(k, *at), _VECTOR.as_pointer())
        return self._builder.store(value, place, align=align)

    def spread(self, k: int, at: Any) -> Any:
        """Return 16 times the same number."""
        nothing = ir.Constant(_VECTOR, ir.Undefined)
        value = self._builder.load(self.pointer(k, at))
        one = self._builder.insert_element(nothing, value, ir.Constant(_INDEX, 0))
        return _shuffled(self._builder, one, nothing, [0] * TILE)

    def plus(self, index: Any, more: int) -> Any:
        """Return an index and more."""
        return self._builder.add(index, ir.Constant(index.type, more))


@_instruction
def _gather(
    typing: Any, records: Any, at: Any, first: Any, row: Any, factor: Any, usual: Any, block: Any
) -> Any:
    def made(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        given = _Arguments(context, builder, signature.args, values)
        column, top = given.index(2), given.index(3)
        found = []
        for k in range(TILE):
            own = builder.load(given.pointer(1, given.plus(column, k)))
            found.append(given.load(0, builder.zext(own, top.type), top))
        for k, vector in enumerate(_transposed(builder, found)):
            d = given.plus(top, k)
            middle = given.spread(5, d)
            off = builder.fsub(vector, middle, flags=_ROUNDED)
            off = builder.fmul(off, given.spread(4, d), flags=_ROUNDED)
            given.store(builder.fadd(off, middle, flags=_ROUNDED), 4, 6, d, column)
        return context.get_dummy_value()

    return types.void(records, at, first, row, factor, usual, block), made


def _written_back(align: int, hint: bool) -> Callable[..., Any]:
    def made(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        given = _Arguments(context, builder, signature.args, values)
        column, top, to = given.index(1), given.index(2), given.index(4)
        found = [given.load(0, given.plus(top, k), column) for k in range(TILE)]
        for k, vector in enumerate(_transposed(builder, found)):
            stored = given.store(vector, align, 3, given.plus(to, k), top)
            if hint:
                once = builder.module.add_metadata([ir.Constant(_INDEX, 1)])
                stored.set_metadata("nontemporal", once)
        return context.get_dummy_value()

    return made


@_instruction
def _scatter(typing: Any, block: Any, first: Any, row: Any, records: Any, to: Any) -> Any:
    return types.void(block, first, row, records, to), _written_back(4, False)


@_instruction
def _stream(typing: Any, block: Any, first: Any, row: Any, records: Any, to: Any) -> Any:
    return types.void(block, first, row, records, to), _written_back(_LINE_BYTES, True)


@_instruction
def _streamed(typing: Any) -> Any:
    def made(context: Any, builder: Any, *_: Any) -> Any:
        builder.fence("seq_cst")
        return context.get_dummy_value()

    return types.void(), made


@_instruction
def _fetch(typing: Any, records: Any, at: Any, row: Any) -> Any:
    def made(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        given = _Arguments(context, builder, signature.args, values)
        byte = ir.IntType(8).as_pointer()
        place = builder.bitcast(given.pointer(0, given.index(1), given.index(2)), byte)
        kind = ir.FunctionType(ir.VoidType(), [byte, _INDEX, _INDEX, _INDEX])
        hint = _build.get_or_insert_function(builder.module, kind, "llvm.prefetch.p0")
        # For reading, into the second cache, of data.
        builder.call(hint, [place, *(ir.Constant(_INDEX, value) for value in (0, 2, 1))])
        return context.get_dummy_value()

    return types.void(records, at, row), made


@overload(gather, inline="always", strict=False)
def _compiled_gather(
    records: Any, at: Any, first: Any, row: Any, factor: Any, usual: Any, block: Any
) -> Any:
    return lambda records, at, first, row, factor, usual, block: _gather(
        records, at, first, row, factor, usual, block
    )


@overload(scatter, inline="always", strict=False)
def _compiled_scatter(block: Any, first: Any, row: Any, records: Any, to: Any) -> Any:
    return lambda block, first, row, records, to: _scatter(block, first, row, records, to)


@overload(stream, inline="always", strict=False)
def _compiled_stream(block: Any, first: Any, row: Any, records: Any, to: Any) -> Any:
    return lambda block, first, row, records, to: _stream(block, first, row, records, to)


@overload(streamed, inline="always", strict=False)
def _compiled_streamed() -> Any:
    return lambda: _streamed()


@overload(fetch, inline="always", strict=False)
def _compiled_fetch(records: Any, at: Any) -> Any:
    def read(records: Any, at: Any) -> None:
        for row in range(0, records.shape[1], TILE):
            _fetch(records, at, row)

    return read
