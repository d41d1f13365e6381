"""The executor seam: tiles and batches go to any ``concurrent.futures.Executor``.

One worker is this process, more are local processes. Results come back in the order of the tasks,
so the number of workers never changes them.
"""

from __future__ import annotations

import contextlib
import itertools
import logging
import platform
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sized
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future
from functools import partial
from typing import Any, ParamSpec, TypeVar

from mapfilter._code import code_digest
from mapfilter._workers import LARGE_BLOCK_BYTES, LocalWorkers, NoProcessError
from mapfilter.errors import Faults, MapfilterError, fail

_CONNECT_S = 10
_LOOK_S = 1.0
_MOST_WORKERS = 256

# By default workers are watched a hundred times a second, and give freed memory back at once. With
# one of these two limits set, the other stays at 128 KiB, and each larger array is of new pages.
_QUICK_WORKERS = {
    "distributed.worker.profile.enabled": False,
    "distributed.nanny.pre-spawn-environ.MALLOC_MMAP_THRESHOLD_": LARGE_BLOCK_BYTES,
    "distributed.nanny.pre-spawn-environ.MALLOC_TRIM_THRESHOLD_": 2 * LARGE_BLOCK_BYTES,
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
    """Give an executor of ``workers`` local processes, or of this one when ``workers`` is 1.

    The workers end with the block, or with this process, whatever ends it.
    """
    if workers <= 1:
        yield SerialExecutor()
        return
    with worker_processes(workers) as pool:
        yield pool


@contextlib.contextmanager
def worker_processes(count: int) -> Iterator[Executor]:
    """Give an executor of local processes, even if it is one; they end as in ``local_executor``."""
    with LocalWorkers(count) as pool:
        try:
            yield pool
        except BaseException:
            # Nobody waits for tasks in the midst of which this one is left.
            pool.end_workers()
            pool.shutdown(wait=False, cancel_futures=True)
            raise


@contextlib.contextmanager
def spare_processes(count: int) -> Iterator[Executor]:
    """Give an executor of local processes, or of this one where no process can be started."""
    with contextlib.ExitStack() as stack:
        pool: Executor
        try:
            pool = stack.enter_context(worker_processes(count))
        except NoProcessError:
            pool = SerialExecutor()
        yield pool


def warmed(workers: Executor, count: int, task: Callable[..., Any]) -> None:
    """Have workers start, and import what a task needs, while nothing waits for them.

    What goes wrong is left to those who hand in tasks.
    """
    made_ready(workers, count, partial(callable, task))


def made_ready(workers: Executor, count: int, ready: Callable[[], Any]) -> None:
    """Have workers start, and do what each does once, while nothing waits for them.

    This process, if it is the only one, does it when it comes to it. What goes wrong is left to
    those who hand in tasks.
    """
    if isinstance(workers, SerialExecutor):
        return
    with contextlib.suppress(BrokenExecutor, NoProcessError):
        for _ in range(count):
            workers.submit(ready)


def begun(workers: Executor, task: Callable[[], T]) -> Callable[[], T]:
    """Hand out a task; what is returned waits for its result, and does it where workers died."""
    try:
        begun = workers.submit(task)
    except (BrokenExecutor, NoProcessError):
        return task

    def result() -> T:
        try:
            return begun.result()
        except BrokenExecutor:
            return task()

    return result


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
        # Closing a client that tries to connect again has it log this with its traceback.
        stack.enter_context(_quiet("distributed.utils", "distributed.client"))
        # Results come from the workers themselves where these can be reached, not by the scheduler.
        direct = True if place is not address else None
        try:
            client: Any = Client(  # type: ignore[no-untyped-call]
                place, timeout=_CONNECT_S, direct_to_workers=direct
            )
            stack.enter_context(client)
        except (OSError, ValueError) as error:
            expected = "a Dask scheduler such as tcp://10.0.0.5:8786, or local:N"
            hint = "the scheduler is not running, or another port"
            raise fail(MapfilterError, "cluster", expected, address, hint) from error
        workers = sum(client.nthreads().values())
        _check_hosts(client)
        try:
            yield _ClusterExecutor(client, place), max(workers, 1)
        except KilledWorker as error:
            raise _died("one that died several times (out of memory?)") from error
        except _lost_errors() as error:
            raise _scheduler_lost(place) from error


class _ClusterExecutor(Executor):
    """Hands tasks to a cluster, as long as its scheduler is there."""

    def __init__(self, client: Any, place: Any) -> None:
        self._client, self._place = client, place
        # Else Dask compares tasks by all that is in them: a tenth of the time of a build.
        self._inner = client.get_executor(pure=False)

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """Hand in a task; MapfilterError where the connection is lost."""
        # What is handed in while the client connects again would never be done.
        self.check()
        future: Future[T] = self._inner.submit(fn, *args, **kwargs)
        return future

    def check(self) -> None:
        """Raise MapfilterError where the connection to the scheduler is lost."""
        if self._client.status != "running":
            raise _scheduler_lost(self._place)


def _check_hosts(client: Any) -> None:
    """Check that the workers of a cluster have the same code as this process."""
    digests = client.run(code_digest, on_error="return")
    expected = "the mapfilter, Python and libraries of this host"
    faults = Faults()
    for worker, found in sorted(digests.items()):
        if found != code_digest():
            got = "other versions" if isinstance(found, str) else f"no mapfilter ({found})"
            faults.add(f"worker {worker}", expected, got, "install the same on all hosts")
    faults.raise_if_any(MapfilterError)


def _lost_errors() -> tuple[type[BaseException], ...]:
    from distributed.client import FutureCancelledError
    from distributed.comm.core import CommClosedError

    return (CancelledError, FutureCancelledError, CommClosedError)


@contextlib.contextmanager
def _quiet(*names: str) -> Iterator[None]:
    """Leave it to the errors that are raised to say what happened."""
    loggers = {name: logging.getLogger(name) for name in names}
    levels = {name: logger.level for name, logger in loggers.items()}
    for logger in loggers.values():
        logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for name, logger in loggers.items():
            logger.setLevel(levels[name])


def _scheduler_lost(place: Any) -> MapfilterError:
    hint = "it ended, or the network failed; finished work is kept for --resume"
    where = place if isinstance(place, str) else "local"
    return fail(MapfilterError, f"cluster {where}", "a running Dask scheduler", "none", hint)


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
    call: Callable[[Any], T] = function
    if isinstance(executor, SerialExecutor):
        # A task is done as it is handed in: none ahead of its turn.
        in_flight = 1
    else:
        call = partial(_on_worker, function, code_digest())
    todo = iter(tasks)
    waiting: deque[Future[T]] = deque()
    done = 0
    while True:
        try:
            for task in itertools.islice(todo, in_flight - len(waiting)):
                waiting.append(executor.submit(call, task))
            if not waiting:
                return
            result = _result_of(waiting.popleft(), executor)
        except BrokenExecutor as error:
            reason = executor.reason() if isinstance(executor, LocalWorkers) else ""
            raise _died(reason or "one that died (out of memory?)") from error
        except MemoryError as error:
            if isinstance(executor, SerialExecutor):
                raise
            raise _died("one that ran out of memory") from error
        done += 1
        if progress is not None:
            progress(done, total)
        yield result


def _result_of(future: Future[T], executor: Executor) -> T:
    if not isinstance(executor, _ClusterExecutor):
        return future.result()
    while True:
        try:
            return future.result(timeout=_LOOK_S)
        except TimeoutError:
            if future.done():
                raise
            executor.check()


def _on_worker(function: Callable[[Any], T], code: str, task: Any) -> T:
    """Run a task, unless this worker has other code than who sent it."""
    if code_digest() != code:
        where, hint = f"worker on {platform.node()}", "install the same on all hosts"
        expected = "the mapfilter, Python and libraries of the one that sends the work"
        raise fail(MapfilterError, where, expected, "other versions", hint)
    return function(task)


def _died(got: str) -> MapfilterError:
    hint = "too many workers or too large a tile_px; finished work is kept for --resume"
    return fail(MapfilterError, "worker processes", "all of them running", got, hint)


def part_of(progress: Progress | None, part: int, parts: int) -> Progress | None:
    """Return a progress that counts one of several equal parts of the work."""
    if progress is None:
        return None
    return lambda done, total: progress(part * total + done, parts * total)
