"""Local worker processes that end with the process that started them, whatever ends it."""

from __future__ import annotations

import atexit
import contextlib
import ctypes
import multiprocessing
import multiprocessing.connection
import os
import signal
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnContext, SpawnProcess
from threading import Lock, Thread
from typing import Any, ParamSpec, TypeVar

import numpy as np

from mapfilter._memory import search_cycles_rarely
from mapfilter.errors import MapfilterError, fail

# Just under the size from which on glibc adapts no more.
LARGE_BLOCK_BYTES = 31 << 20

_PR_SET_PDEATHSIG = 1
_ENDED_BY_US = (None, 0, -signal.SIGTERM)
_WORKER_LEFT = 77
_SOON_S, _LATEST_S = 0.01, 2.0
_BROKEN = "a worker process ended in the midst of its tasks"

P = ParamSpec("P")
T = TypeVar("T")


class NoProcessError(MapfilterError):
    """The system starts no process beside this one."""


def worker_died(got: str) -> MapfilterError:
    """Return the error for a worker process that ended; ``got`` is what was found."""
    hint = "too many workers or too large a tile_px; finished work is kept for --resume"
    return fail(MapfilterError, "worker processes", "all of them running", got, hint)


class LocalWorkers(ProcessPoolExecutor):
    """A pool of local processes.

    Workers see that the other end of a pipe is closed, when this process ends or
    :meth:`end_workers` is called, and end at once; under Linux the kernel ends them, too. They
    inherit neither input nor outputs, so that nobody who reads these waits for a worker.

    A worker that ends in the midst of sending a result leaves half a message. The pool would wait
    for the rest for ever, as this process could write to the same pipe; so each worker is watched,
    and with one that ended unasked all end, and this process closes its end of that pipe.

    Raises
    ------
    NoProcessError
        The system lets this process make no pool; in ``submit`` also, start no worker.
    """

    def __init__(self, workers: int) -> None:
        self._context = _Context()
        # Of all pipes that more than one thread closes here, so that none is closed twice.
        self._ending, self._seen = Lock(), 0
        with _or_no_process():
            watched, self._held = multiprocessing.Pipe(duplex=False)
            # Spawned workers get a copy of one end only.
            self._watched = watched
            super().__init__(
                workers, self._context, initializer=_start_worker, initargs=(os.getpid(), watched)
            )
        # The pool forgets it when it is shut down, and closes it then.
        results: Any = self._result_queue
        results.close = self._close_results
        self._results = results

    def __exit__(self, *error: Any) -> None:
        super().__exit__(*error)
        self.end_workers()

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """Hand a task to a worker, and watch those that were started for it."""
        with _or_no_process():
            future = super().submit(fn, *args, **kwargs)
        with self._ending:
            started = self._context.started
            new, self._seen = started[self._seen :], len(started)
        for one in new:
            Thread(target=self._end_after, args=(one,), daemon=True).start()
        return future

    def end_workers(self) -> None:
        """End all workers now, in the midst of their tasks."""
        with self._ending:
            self._held.close()
            self._watched.close()

    def abandon(self) -> None:
        """End all workers now, and cancel what they have not begun."""
        overseer: Any = self._executor_manager_thread
        self.end_workers()
        self.shutdown(wait=False, cancel_futures=True)
        if overseer is not None:
            # An interpreter that ends while this thread closes its pipe prints a traceback.
            overseer.join(_LATEST_S)

    def _close_results(self) -> None:
        with self._ending:
            self._results._reader.close()
            self._results._writer.close()

    def _end_after(self, one: Any) -> None:
        """Wait until a worker ended; where nobody asked it to, see that the pool notices."""
        multiprocessing.connection.wait([one.sentinel])
        until_s = time.monotonic() + _LATEST_S
        # Another thread is about to say it, unless the program has the system forget its children.
        while (code := one.exitcode) is None and time.monotonic() < until_s:
            time.sleep(_SOON_S)
        if not code and not self._pending_work_items:
            return
        self.end_workers()
        with self._shutdown_lock:
            # From here on the pool starts no worker, and hands none the pipe.
            self._broken = self._broken or _BROKEN  # type: ignore[assignment]
            others = self._context.started
        for other in others:
            multiprocessing.connection.wait([other.sentinel])
        with self._ending:
            self._results._writer.close()

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


class _Worker(SpawnProcess):
    """A process that ends at once when it is done, as one that is forked does.

    Python would take apart all modules before, while the main process waits.
    """

    def run(self) -> None:
        """Work until there is nothing left to do; a worker that fails ends as any process."""
        super().run()
        atexit._run_exitfuncs()
        os._exit(0)


class _Context(SpawnContext):
    """Starts workers, and remembers them for their exit codes."""

    def __init__(self) -> None:
        super().__init__()
        self._made: list[Any] = []

    @property
    def started(self) -> list[Any]:
        """The workers that the system did start, in this order."""
        return [one for one in self._made if one.pid is not None]

    def Process(self, *args: Any, **kwargs: Any) -> Any:  # type: ignore[override]  # noqa: N802
        process = _Worker(*args, **kwargs)
        self._made.append(process)
        return process


@contextlib.contextmanager
def _or_no_process() -> Iterator[None]:
    # Without room for another process, without semaphores, without either in a sandbox.
    try:
        yield
    except (OSError, NotImplementedError, ImportError) as error:
        hint = "the system has no room or no leave for them; use one worker"
        expected = "processes beside this one"
        raise fail(NoProcessError, "worker processes", expected, error, hint) from error


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
