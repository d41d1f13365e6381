"""Copies of what particles keep, made when they are first read.

After resampling most models read what particles keep once, at the next report, and write something
else. They do so through the numbers of the chosen particles, without the copies.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from mapfilter._types import Floats32, Ints32

_NONE: Ints32 = np.empty(0, dtype=np.int32)


@dataclass(frozen=True, eq=False, slots=True)
class Copies:
    """Columns that resampling has chosen of what particles keep.

    Parameters
    ----------
    of : ndarray of float32, shape (W, M)
        What particles kept before.
    chosen : ndarray of int32, shape (N,)
        The column of each particle.
    """

    of: Floats32
    chosen: Ints32

    @property
    def shape(self) -> tuple[int, int]:
        """Numbers that each particle keeps, and particles: (W, N)."""
        return self.of.shape[0], self.chosen.size

    def made(self) -> Floats32:
        """Return what each particle keeps, shape (W, N)."""
        # As they lie in memory: what a particle keeps follows each other there, or rows do.
        if self.of.flags.c_contiguous:
            return np.take(self.of, self.chosen, axis=1)
        # np.take would copy all records first: numbers that fill their last tile lie in between.
        return self.of.T[self.chosen].T


def copies_of(kept: Floats32 | Copies, chosen: Ints32) -> Copies:
    """Return the copies of chosen particles (N,), of particles that may be copies themselves.

    Examples
    --------
    >>> kept = np.arange(5, dtype=np.float32)[None, :]
    >>> some = copies_of(kept, np.array([0, 3, 3, 4], dtype=np.int32))
    >>> copies_of(some, np.array([1, 3], dtype=np.int32)).made().tolist()
    [[3.0, 4.0]]
    """
    if isinstance(kept, Copies):
        return Copies(kept.of, np.take(kept.chosen, chosen))
    return Copies(kept, chosen)


def columns_of(kept: Floats32 | Copies) -> tuple[Floats32, Ints32]:
    """Return an array, and the column of each particle in it; none if each has its own."""
    return (kept.of, kept.chosen) if isinstance(kept, Copies) else (kept, _NONE)


def array_of(kept: Floats32 | Copies) -> Floats32:
    """Return what each particle keeps, shape (W, N): copies are made anew."""
    return kept.made() if isinstance(kept, Copies) else kept


class MadeWhenRead:
    """A field of a belief that may be set to copies, which the first to read it finds made."""

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    def __get__(self, belief: Any, owner: type) -> Floats32:
        if belief is None:
            # A field without a default.
            raise AttributeError(self._name)
        kept: Floats32 | Copies = belief.__dict__[self._name]
        if isinstance(kept, Copies):
            kept = belief.__dict__[self._name] = kept.made()
        return kept

    def __set__(self, belief: Any, kept: Floats32 | Copies) -> None:
        belief.__dict__[self._name] = kept


MADE_WHEN_READ = MadeWhenRead()
if TYPE_CHECKING:
    Kept = MadeWhenRead
else:
    # What is found where the field is read, for those who ask for its type.
    Kept = Floats32
