"""Start kernels of a graphics processor, a thread for each hypothesis.

Importing this asks for no device; a kernel is compiled when it is first started.
"""

from __future__ import annotations

import warnings
from threading import Lock
from typing import Any

_CONFIGURING = Lock()
_THREADS = 128
"""Threads of a block: few enough for kernels that need many registers."""


def start(kernel: Any, count: int, *given: Any) -> None:
    """Start a kernel on ``count`` hypotheses, in the order of earlier ones; nothing for none."""
    if not count:
        return
    # A narrow belief does not fill a device, of which numba warns. Filters of warnings belong to
    # the whole process, so they are put back at once, and by one thread at a time.
    with _CONFIGURING, warnings.catch_warnings():
        # numba puts a colour before the text where it can.
        warnings.filterwarnings("ignore", message=r"(\x1b\[[0-9;]*m)*Grid size")
        configured = kernel[-(-count // _THREADS), _THREADS]
    configured(*given)
