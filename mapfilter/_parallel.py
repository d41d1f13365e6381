"""The executor seam: tiles and batches go to whatever ``concurrent.futures.Executor`` is handed in.

With one worker the work is done in this process; with more, in local processes. Results come back
in the order of the tasks, so the number of workers never changes them.
"""

from __future__ import annotations

import contextlib
import multiprocessing
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor
from typing import Any, ParamSpec, TypeVar

from mapfilter.errors import MapfilterError, fail

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
    with ProcessPoolExecutor(max_workers=workers, mp_context=context) as pool:
        try:
            yield pool
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def ordered_results(
    executor: Executor,
    function: Callable[[Any], T],
    tasks: Iterable[Any],
    *,
    in_flight: int = 8,
    progress: Progress | None = None,
) -> Iterator[T]:
    """Yield ``function(task)`` for every task, in order, with at most ``in_flight`` waiting.

    Memory stays bounded by ``in_flight`` results, however many tasks there are; twice the number
    of workers keeps all of them busy.

    Raises
    ------
    MapfilterError
        A worker process died.
    """
    todo = list(tasks)
    waiting: list[Future[T]] = []
    submitted = 0
    for done in range(len(todo)):
        try:
            while submitted < len(todo) and submitted - done < in_flight:
                waiting.append(executor.submit(function, todo[submitted]))
                submitted += 1
            result = waiting.pop(0).result()
        except BrokenExecutor as error:
            hint = "out of memory: take fewer workers or a smaller tile_px"
            raise fail(
                MapfilterError, "worker processes", "all of them at work", "one that died", hint
            ) from error
        if progress is not None:
            progress(done + 1, len(todo))
        yield result
