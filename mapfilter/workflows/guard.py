"""What a user can mend is told in one message and an exit code, never as a traceback."""

from __future__ import annotations

import errno
from collections.abc import Callable

from mapfilter.errors import MapfilterError
from mapfilter.workflows.terminal import say

WRONG = 2
"""Exit code: the input or the command is wrong, or the machine too small for it."""

_NO_SPACE = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


def guarded(run: Callable[[], int | None]) -> int:
    """Run a command and return its exit code, 0 for none; a user's error is told on stderr.

    Parameters
    ----------
    run : callable
    """
    try:
        return run() or 0
    except MapfilterError as error:
        say(str(error), "error: ")
    except MemoryError:
        hint = "too large an area, too fine a resolution, or a value in the wrong unit"
        say(f"memory: expected enough of it, found none left (likely: {hint})", "error: ")
    except OSError as error:
        if error.errno not in _NO_SPACE:
            raise
        where = error.filename or "the output"
        say(f"{where}: expected space on the disk, found none left", "error: ")
    return WRONG
