"""An executor of a Dask cluster, which says what went wrong where the cluster is lost."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError, Executor, Future
from typing import Any, ParamSpec, TypeVar

from mapfilter._code import code_digest
from mapfilter._workers import LARGE_BLOCK_BYTES, worker_died
from mapfilter.errors import Faults, MapfilterError, fail

_CONNECT_S = 10
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
            yield ClusterExecutor(client, place), max(workers, 1)
        except KilledWorker as error:
            raise worker_died("one that died several times (out of memory?)") from error
        except _lost_errors() as error:
            raise _scheduler_lost(place) from error


class ClusterExecutor(Executor):
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
