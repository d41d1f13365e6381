"""The executor seam: tiles and batches go to any ``concurrent.futures.Executor``.

One worker is this process, more are local processes. Results come back in the order of the tasks,
so the number of workers never changes them.
"""

from __future__ import annotations

import contextlib
import itertools
import platform
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sized
from concurrent.futures import BrokenExecutor, Executor, Future
from functools import partial
from typing import Any, ParamSpec, TypeVar

from mapfilter._cluster import ClusterExecutor, cluster_executor
from mapfilter._code import code_digest
from mapfilter._workers import LocalWorkers, NoProcessError, worker_died
from mapfilter.errors import MapfilterError, fail

_LOOK_S = 1.0

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
            pool.abandon()
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
            raise worker_died(reason or "one that died (out of memory?)") from error
        except MemoryError as error:
            if isinstance(executor, SerialExecutor):
                raise
            raise worker_died("one that ran out of memory") from error
        done += 1
        if progress is not None:
            progress(done, total)
        yield result


def _result_of(future: Future[T], executor: Executor) -> T:
    if not isinstance(executor, ClusterExecutor):
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


def part_of(progress: Progress | None, part: int, parts: int) -> Progress | None:
    """Return a progress that counts one of several equal parts of the work."""
    if progress is None:
        return None
    return lambda done, total: progress(part * total + done, parts * total)


def rest_of(progress: Progress | None, before: int, total: int) -> Progress:
    """Return a progress that counts what is left of the work; what was done before is counted."""

    def report(done: int, _: int = 0) -> None:
        if progress is not None:
            progress(before + done, total)

    report(0)
    return report
