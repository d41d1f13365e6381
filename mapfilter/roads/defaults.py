"""What readers of maps take where nothing is given; a module of its own for configurations."""

from __future__ import annotations

from typing import Final

STOREY_HEIGHT_M: Final = 3.2
DEFAULT_HEIGHT_M: Final = 12.0
"""Of buildings without a height of their own, or a number of storeys."""

MAX_ACCURACY_M: Final = 50.0
MAX_GAP_M: Final = 100.0
"""Of positions that ways are made from: worse ones are left out, and longer gaps end a way."""
