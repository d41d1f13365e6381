"""Kernels over particles, divided among threads of this process.

A kernel takes the first particle of its part and the end of it, then its other arguments. It reads
and writes what particles of this part have, and is compiled with ``nogil``. Each particle goes
through the same arithmetic whatever the number of threads is. Sums over particles, of which the
order counts, are left to one thread.
"""

from __future__ import annotations

import multiprocessing
import os
from collections import deque
from dataclasses import dataclass
from functools import cache
from threading import Lock, Thread
from typing import Any

LEAST_PARTICLES = 32_768
"""Fewer particles than this are not divided: beginning and awaiting the parts of a step would take
a tenth of its time."""
_BLOCK = 1024
"""Parts begin at multiples of it, at which the vectorised loops of kernels come out even."""

Call = tuple[Any, ...]
"""A kernel, and its arguments behind the first particle and the end of a part."""


@dataclass(frozen=True, slots=True)
class Threads:
    """A number of threads among which kernels are divided.

    Results are the same for every number. Worker processes divide nothing: there are as many of
    them as processors already. Threads are started when they are first needed in a process, and
    end with it.

    Parameters
    ----------
    count : int
        1 for the calling thread alone.
    least : int
        Least number of particles that is divided.
    """

    count: int = 1
    least: int = LEAST_PARTICLES

    def divide(self, size: int) -> bool:
        """Return whether so many particles are divided."""
        return self.count > 1 and size >= self.least and multiprocessing.parent_process() is None

    def parts(self, size: int) -> list[tuple[int, int]]:
        """Return the first particle and the end of each part.

        Examples
        --------
        >>> Threads(2, least=0).parts(5000)
        [(0, 2048), (2048, 5000)]
        >>> Threads(2).parts(5000)
        [(0, 5000)]
        """
        blocks = -(-size // _BLOCK)
        count = min(self.count, blocks) if self.divide(size) else 1
        ends = [blocks * k // count * _BLOCK for k in range(1, count)]
        return list(zip([0, *ends], [*ends, size], strict=True))

    def over(self, size: int, *calls: Call) -> None:
        """Make calls one after another for each part of so many particles, and await them.

        An error in a part is raised once no other part is under way: that of the calling thread, or
        else of the first part that has one.
        """
        if not self.divide(size):
            _make(0, size, calls)
            return
        (first, stop), *others = self.parts(size)
        helpers: list[_Helper] = []
        try:
            for begin, end in others:
                helpers.append(_idle_helper())
                helpers[-1].begin(begin, end, calls)
            _make(first, stop, calls)
        finally:
            errors = [helper.end() for helper in helpers]
            _idle(os.getpid()).extend(helpers)
        for error in errors:
            if error is not None:
                raise error


ONE = Threads()
"""The calling thread alone."""


class _Helper:
    """A thread that makes calls for one part after another.

    Two bare locks begin a part 25 to 45 µs sooner than futures of an executor.
    """

    def __init__(self) -> None:
        self._due, self._done, self._is_done = Lock(), Lock(), True
        self._part: tuple[int, int, tuple[Call, ...]] = 0, 0, ()
        self._error: BaseException | None = None
        self._due.acquire()
        Thread(target=self._work, name="mapfilter-part", daemon=True).start()

    def begin(self, first: int, stop: int, calls: tuple[Call, ...]) -> None:
        """Begin a part; the one before has ended."""
        self._part, self._error, self._is_done = (first, stop, calls), None, False
        self._done.acquire(blocking=False)
        self._due.release()

    def end(self) -> BaseException | None:
        """Wait for the end of the part, and return its error, or an interrupt meanwhile."""
        interrupt: BaseException | None = None
        while not self._is_done:
            try:
                self._done.acquire()
            except KeyboardInterrupt as error:
                # The part goes on with the caller's arrays.
                interrupt = error
        return interrupt or self._error

    def _work(self) -> None:
        while True:
            self._due.acquire()
            try:
                _make(*self._part)
            except BaseException as error:
                self._error = error
            # Arrays are the caller's alone again.
            self._part, self._is_done = (0, 0, ()), True
            if self._done.locked():
                self._done.release()


def _make(first: int, stop: int, calls: tuple[Call, ...]) -> None:
    for kernel, *arguments in calls:
        kernel(first, stop, *arguments)


def _idle_helper() -> _Helper:
    try:
        return _idle(os.getpid()).pop()
    except IndexError:
        return _Helper()


@cache
def _idle(process: int) -> deque[_Helper]:  # noqa: ARG001
    """Return the helpers that wait; a forked process has none of its parent's."""
    return deque()
