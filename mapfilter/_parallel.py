"""The executor seam: tiles and batches go to any ``concurrent.futures.Executor``.

One worker is this process, more are local processes. Results come back in the order of the tasks,
so the number of workers never changes them.
"""

from __future__ import annotations

import contextlib
import itertools
import multiprocessing
import signal
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sized
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor
from typing import Any, ParamSpec, TypeVar

import numpy as np

from mapfilter.errors import MapfilterError, fail

_CONNECT_S = 10
_MOST_WORKERS = 256
# Just under the size from which on glibc adapts no more.
_LARGE_BLOCK_BYTES = 31 << 20

# By default workers are watched a hundred times a second, and give freed memory back at once.
_QUICK_WORKERS = {
    "distributed.worker.profile.enabled": False,
    "distributed.nanny.pre-spawn-environ.MALLOC_TRIM_THRESHOLD_": 2 * _LARGE_BLOCK_BYTES,
}

P = ParamSpec("P")
T = TypeVar("T")

Progress = Callable[[int, int], None]
"""Called with (tasks done, tasks in all)."""


class SerialExecutor(Executor):
    """Runs each task at once, in the calling thread."""

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """Run ``fn`` now and return its finished future."""
        future: Future[T] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future


@contextlib.contextmanager
def local_executor(workers: int) -> Iterator[Executor]:
    """Give an executor of ``workers`` local processes, or of this one when ``workers`` is 1."""
    if workers <= 1:
        yield SerialExecutor()
        return
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(workers, context, initializer=_start_worker) as pool:
        try:
            yield pool
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


@contextlib.contextmanager
def cluster_executor(address: str) -> Iterator[tuple[Executor, int]]:
    """Give an executor of a Dask cluster, and its number of worker threads.

    A worker that dies costs only time: its tasks are repeated by the others. The address is that of
    a scheduler, such as "tcp://10.0.0.5:8786"; or "local:4" for four workers on this machine.

    Raises
    ------
    MapfilterError
        Dask is not installed, the address is malformed, no scheduler answers there, or workers die
        repeatedly.
    """
    try:
        import dask.config
        from distributed import Client, LocalCluster
        from distributed.scheduler import KilledWorker
    except ImportError as error:
        hint = "install it by: pip install 'mapfilter[cluster]'"
        raise fail(MapfilterError, "cluster", "the package distributed", "none", hint) from error
    with contextlib.ExitStack() as stack:
        place = address
        if address.startswith("local:"):
            count = address.removeprefix("local:")
            if not (count.isascii() and count.isdigit() and 1 <= int(count) <= _MOST_WORKERS):
                expected = f"local:N with N in 1..{_MOST_WORKERS}"
                raise fail(MapfilterError, "cluster", expected, address)
            stack.enter_context(dask.config.set(_QUICK_WORKERS))
            sizes = {"n_workers": int(count), "threads_per_worker": 1, "dashboard_address": None}
            place = stack.enter_context(LocalCluster(**sizes))  # type: ignore[no-untyped-call]
        try:
            client: Any = Client(place, timeout=_CONNECT_S)  # type: ignore[no-untyped-call]
            stack.enter_context(client)
        except (OSError, ValueError) as error:
            expected = "a Dask scheduler such as tcp://10.0.0.5:8786, or local:N"
            hint = "the scheduler is not running, or another port"
            raise fail(MapfilterError, "cluster", expected, address, hint) from error
        workers = sum(client.nthreads().values())
        try:
            yield client.get_executor(), max(workers, 1)
        except KilledWorker as error:
            raise _died() from error


@contextlib.contextmanager
def executor_of(workers: int, cluster: str | None = None) -> Iterator[tuple[Executor, int]]:
    """Give an executor of local processes or a cluster, and its number of concurrent tasks."""
    if cluster is not None:
        with cluster_executor(cluster) as (executor, threads):
            yield executor, threads
        return
    with local_executor(workers) as executor:
        yield executor, workers


def ordered_results(
    executor: Executor,
    function: Callable[[Any], T],
    tasks: Iterable[Any],
    *,
    in_flight: int = 8,
    progress: Progress | None = None,
) -> Iterator[T]:
    """Yield ``function(task)`` for every task, in order, with at most ``in_flight`` submitted.

    Tasks are taken as they are needed, so memory stays bounded however many there are; four times
    the number of workers keeps all of them busy. Only for progress they are counted first. Raises
    MapfilterError where a worker process died.
    """
    if progress is not None and not isinstance(tasks, Sized):
        tasks = list(tasks)
    total = len(tasks) if isinstance(tasks, Sized) else 0
    if isinstance(executor, SerialExecutor):
        # A task is done as it is handed in: none ahead of its turn.
        in_flight = 1
    todo = iter(tasks)
    waiting: deque[Future[T]] = deque()
    done = 0
    while True:
        try:
            for task in itertools.islice(todo, in_flight - len(waiting)):
                waiting.append(executor.submit(function, task))
            if not waiting:
                return
            result = waiting.popleft().result()
        except BrokenExecutor as error:
            raise _died() from error
        done += 1
        if progress is not None:
            progress(done, total)
        yield result


def _start_worker() -> None:
    # The main process ends its workers on Ctrl-C.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # After a large freed block glibc keeps twice its size. Otherwise a worker returns the arrays of
    # each task to the system, and spends a third of its time on new pages.
    np.empty(_LARGE_BLOCK_BYTES, np.uint8)


def _died() -> MapfilterError:
    got = "one that died (out of memory?)"
    hint = "too many workers or too large a tile_px; finished work is kept for --resume"
    return fail(MapfilterError, "worker processes", "all of them running", got, hint)


def part_of(progress: Progress | None, part: int, parts: int) -> Progress | None:
    """Return a progress that counts one of several equal parts of the work."""
    if progress is None:
        return None
    return lambda done, total: progress(part * total + done, parts * total)
