"""Kernels over particles, divided among threads of this process.

A kernel takes the first particle of its part and the end of it, then its other arguments. It reads
and writes what particles of this part have, and is compiled with ``nogil``. Each particle goes
through the same arithmetic whatever the number of threads is. Sums over particles, of which the
order counts, are left to one thread, or taken by blocks of 1 024 and joined in order.
"""

from __future__ import annotations

import multiprocessing
import os
from _thread import start_new_thread
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache
from queue import SimpleQueue
from threading import Lock, current_thread, get_ident
from typing import Any

LEAST_PARTICLES = 32_768
"""Fewer particles than this are not divided: beginning and awaiting the parts of a step would take
a tenth of its time."""
_DEPTH = 4
"""Number of loops around the one that waits for parts. What a signal raises comes after calls, at
the beginning of functions and where loops jump back. What comes at a loop's own jump back is caught
by the loop around it alone, so that several in a row need several loops."""
_BLOCK = 1024
"""Parts begin at multiples of it, at which the vectorised loops of kernels come out even."""

Call = tuple[Any, ...]
"""A kernel, and its arguments behind the first particle and the end of a part."""


@dataclass(frozen=True, slots=True)
class Threads:
    """A number of threads among which kernels are divided.

    Results are the same for every number. Worker processes divide nothing: there are as many of
    them as processors already. Threads are started when they are first needed in a process, are
    shared by its callers, and end with it.

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

        An error or an interrupt is raised once no part is under way, and parts that have not begun
        are left out: an interrupt, or else the error of the calling thread, or else that of the
        first part that has one.
        """
        if not self.divide(size):
            _make(0, size, calls)
            return
        (first, stop), *others = self.parts(size)
        parts = [_Part(begin, end, calls) for begin, end in others]
        caught: list[BaseException | None] = [None]
        try:
            _hand_over(parts)
            _make(first, stop, calls)
            _make_what_has_not_begun(parts)
        except BaseException as error:
            caught[0] = error
        # The loops of `_await` begin with a call, after which an interrupt may come: it is caught
        # here, and a further one at the jump back of the inner loop by the outer one.
        is_awaited = False
        while not is_awaited:
            try:
                while not is_awaited:
                    try:
                        _await(parts, caught)
                        is_awaited = True
                    except BaseException as error:
                        caught[0] = error
            except BaseException as error:
                caught[0] = error
        errors: list[BaseException | None] = []
        failure: BaseException | None = None
        try:
            errors = [caught[0], *(part.taken_error() for part in parts)]
            failure = next((error for error in errors if error is not None), None)
            if failure is not None:
                raise failure
        finally:
            # Its traceback has this frame and those of `_await`: circles would keep arrays.
            caught[0] = None
            del failure, errors


ONE = Threads()
"""The calling thread alone."""

_CALLER, _HELPER = "caller", "helper"


class _Part:
    """Calls for a part of the particles, which are made once: by a helper or by the caller.

    An interrupt may be raised in the caller after each of its steps. So it can repeat all of them,
    and never waits for a part that no helper has begun.
    """

    def __init__(self, first: int, stop: int, calls: tuple[Call, ...]) -> None:
        self.first, self.stop, self.calls = first, stop, calls
        self.error: BaseException | None = None
        self._taken_by: dict[str, str] = {}
        self._is_done, self._done = False, Lock()
        self._done.acquire()

    def take(self, who: str) -> bool:
        """Return whether the part is the caller's or a helper's: of the first of them to ask."""
        # A single call that is not divided, with the same answer each time.
        return self._taken_by.setdefault("", who) == who

    def work(self) -> None:
        """Make the calls in a helper's thread, where no signal raises anything."""
        if not self.take(_HELPER):
            return
        try:
            _make(self.first, self.stop, self.calls)
        except BaseException as error:
            self.error = error
        # Arrays are the caller's alone again.
        self.calls = ()
        self._is_done = True
        self._done.release()

    def taken_error(self) -> BaseException | None:
        """Take the error out, whose traceback has the arrays and this part."""
        error, self.error = self.error, None
        return error

    def wait(self) -> None:
        """Wait until no helper is at work, or ever will be."""
        if self.take(_CALLER):
            return
        while not self._is_done:
            self._done.acquire()


@dataclass(frozen=True, slots=True)
class _Pool:
    """Parts that are due, and the threads of a process that help, by number."""

    due: SimpleQueue[_Part] = field(default_factory=SimpleQueue)
    helpers: dict[int, int] = field(default_factory=dict)


def _make(first: int, stop: int, calls: tuple[Call, ...]) -> None:
    for kernel, *arguments in calls:
        kernel(first, stop, *arguments)


def _hand_over(parts: Sequence[_Part]) -> None:
    pool = _pool(os.getpid())
    for number, part in enumerate(parts):
        if number not in pool.helpers:
            # One call: an interrupt amid those of `Thread.start` becomes another error.
            helper = start_new_thread(_help, (pool, number))
            pool.helpers.setdefault(number, helper)
        pool.due.put(part)


def _make_what_has_not_begun(parts: Sequence[_Part]) -> None:
    for part in parts:
        if part.take(_CALLER):
            _make(part.first, part.stop, part.calls)


def _await(parts: Sequence[_Part], caught: list[BaseException | None], depth: int = _DEPTH) -> None:
    """Wait for parts whatever is raised meanwhile; the last of it is kept in ``caught``."""
    while True:
        try:
            if depth:
                return _await(parts, caught, depth - 1)
            for part in parts:
                part.wait()
            return None
        except BaseException as error:
            caught[0] = error


def _help(pool: _Pool, number: int) -> None:
    current_thread().name = "mapfilter-part"
    # Two callers may have started one at the same time.
    while pool.helpers.setdefault(number, get_ident()) == get_ident():
        # Without a name for the part, whose error would be kept until the next one comes.
        pool.due.get().work()


@cache
def _pool(process: int) -> _Pool:  # noqa: ARG001
    """Return the helpers of a process; a forked process has none of its parent's."""
    return _Pool()
