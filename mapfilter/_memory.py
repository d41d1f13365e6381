"""Memory that is freed and soon needed again, and the search for what can be freed."""

from __future__ import annotations

import atexit
import ctypes
import gc
import sys

_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3
"""Parameters of glibc's ``mallopt``."""
_KEPT_BYTES, _LEAST_BYTES = 256 * 2**20, 32 * 2**20

_FIRST_OBJECTS, _NEW_OBJECTS = 500_000, 5_000


def search_cycles_rarely() -> None:
    """Search for cycles of objects when there are 500 000, then each 5 000 new ones, not each 700.

    A command makes hundreds of thousands while it imports modules, and keeps nearly all of them:
    searching takes a tenth of a short command, which now ends before the first one. The search at
    its end takes as long, and is left out: the memory is given back then anyway.
    """

    def search_oftener(*_: object) -> None:
        gc.callbacks.remove(search_oftener)
        gc.set_threshold(_NEW_OBJECTS)

    gc.callbacks.append(search_oftener)
    gc.set_threshold(_FIRST_OBJECTS)
    atexit.register(gc.freeze)


def keep_freed_memory() -> bool:
    """Let this process keep up to 256 MiB that it has freed, and return whether it does.

    By default glibc gives large arrays back to the system when they are freed. A filter of many
    hypotheses frees and asks for the same arrays each step, and fresh ones are filled in page by
    page, which takes longer than the arithmetic. Other libraries of C have no such setting.
    """
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None) if sys.platform == "linux" else None
    if mallopt is None:
        return False
    mallopt.argtypes, mallopt.restype = (ctypes.c_int, ctypes.c_int), ctypes.c_int
    # Older versions take no threshold above 32 MiB.
    large = any(mallopt(_MMAP_THRESHOLD, size) for size in (_KEPT_BYTES, _LEAST_BYTES))
    return bool(large and mallopt(_TRIM_THRESHOLD, _KEPT_BYTES))
