"""Local worker processes that end with the process that started them, whatever ends it."""

from __future__ import annotations

import contextlib
import ctypes
import multiprocessing
import multiprocessing.connection
import os
import signal
import sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnContext
from threading import Thread
from typing import Any

import numpy as np

from mapfilter._memory import search_cycles_rarely

# Just under the size from which on glibc adapts no more.
LARGE_BLOCK_BYTES = 31 << 20

_PR_SET_PDEATHSIG = 1
_ENDED_BY_US = (None, 0, -signal.SIGTERM)
_WORKER_LEFT = 77


class LocalWorkers(ProcessPoolExecutor):
    """A pool of local processes.

    Workers see that the other end of a pipe is closed, when this process ends or
    :meth:`end_workers` is called, and end at once; under Linux the kernel ends them, too. They
    inherit neither input nor outputs, so that nobody who reads these waits for a worker.
    """

    def __init__(self, workers: int) -> None:
        self._context = _Context()
        watched, self._held = multiprocessing.Pipe(duplex=False)
        # Spawned workers get a copy of one end only.
        self._watched = watched
        super().__init__(
            workers, self._context, initializer=_start_worker, initargs=(os.getpid(), watched)
        )

    def __exit__(self, *error: Any) -> None:
        super().__exit__(*error)
        self.end_workers()

    def end_workers(self) -> None:
        """End all workers now, in the midst of their tasks."""
        self._held.close()
        self._watched.close()

    def reason(self) -> str:
        """Return what ended a worker of a broken pool, or an empty text where it is unknown."""
        self.shutdown(wait=True)
        codes = [code for code in (one.exitcode for one in self._context.started) if code]
        deaths = [code for code in codes if code not in _ENDED_BY_US and code != _WORKER_LEFT]
        if -signal.SIGKILL in deaths:
            return "one that was killed (signal 9), as the system does when memory runs out"
        if any(code < 0 for code in deaths):
            number = -next(code for code in deaths if code < 0)
            return f"one that crashed ({signal.Signals(number).name}; out of memory?)"
        return f"one that ended with exit code {deaths[0]} (out of memory?)" if deaths else ""


class _Context(SpawnContext):
    """Starts workers, and remembers them for their exit codes."""

    def __init__(self) -> None:
        super().__init__()
        self.started: list[Any] = []

    def Process(self, *args: Any, **kwargs: Any) -> Any:  # type: ignore[override]  # noqa: N802
        process = SpawnContext.Process(*args, **kwargs)
        self.started.append(process)
        return process


def _start_worker(parent: int, watched: Connection) -> None:
    search_cycles_rarely()
    # The main process ends its workers on Ctrl-C.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if sys.platform == "linux":
        with contextlib.suppress(OSError, AttributeError):
            ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != parent:
            os._exit(_WORKER_LEFT)
    Thread(target=_end_with, args=(watched,), daemon=True).start()
    null = os.open(os.devnull, os.O_RDWR)
    for stream in (0, 1, 2):
        os.dup2(null, stream)
    os.close(null)
    # After a large freed block glibc keeps twice its size. Otherwise a worker returns the arrays of
    # each task to the system, and spends a third of its time on new pages.
    np.empty(LARGE_BLOCK_BYTES, np.uint8)


def _end_with(watched: Connection) -> None:
    multiprocessing.connection.wait([watched])
    os._exit(_WORKER_LEFT)
