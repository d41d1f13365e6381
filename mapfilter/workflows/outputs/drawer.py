"""The process that draws pictures beside a command.

It takes about as long to import what it needs as the command itself does, so it is started before
the command imports anything: this module needs little.
"""

from __future__ import annotations

import multiprocessing
import os
import sys
from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from functools import partial
from importlib import import_module

from mapfilter._memory import keep_freed_memory
from mapfilter._parallel import SerialExecutor, begun, spare_processes

DRAWING_LIBRARY = "matplotlib"
_READY = "mapfilter.workflows.outputs.track_pictures", "get_ready_to_draw"
"""Module and function, which only the other process imports."""


@contextmanager
def drawer_process(library: str = DRAWING_LIBRARY) -> Iterator[Executor]:
    """Give what draws pictures while the block runs: another process, which gets ready at once.

    It is this process, and each picture is drawn when it is handed out, on a single processor, in a
    worker, where the ``library`` that draws is imported already, as in a notebook, and where the
    system starts no process.
    """
    is_worker = multiprocessing.parent_process() is not None
    if (os.cpu_count() or 1) == 1 or is_worker or library in sys.modules:
        yield SerialExecutor()
        return
    # One: a second would import as long as it saves by drawing.
    with spare_processes(1) as drawer:
        begun(drawer, partial(_call, *_READY))
        yield drawer


def _call(module: str, name: str) -> None:
    # Each picture needs as much for its pixels, several times.
    keep_freed_memory()
    getattr(import_module(module), name)()
