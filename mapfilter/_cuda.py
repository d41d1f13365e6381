"""Start kernels of a graphics processor, a thread for each hypothesis.

Importing this asks for no device; a kernel is compiled when it is first started.
"""

from __future__ import annotations

from typing import Any

_THREADS = 128
"""Threads of a block: few enough for kernels that need many registers."""


def start(kernel: Any, count: int, *given: Any) -> None:
    """Start a kernel on ``count`` hypotheses, in the order of earlier ones; nothing for none."""
    if count:
        kernel[-(-count // _THREADS), _THREADS](*given)
