"""The end of a command: its exit code, errors of input, and signals that stop it."""

from __future__ import annotations

import contextlib
import errno
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

from mapfilter._printing import quiet_callbacks
from mapfilter.errors import MapfilterError, Stopped, notes_of
from mapfilter.workflows.outputs.terminal import print_message

WRONG = 2
"""Exit code: the input or the command is wrong, or the machine too small for it."""

_AGAIN_S = 0.05
_NO_SPACE = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
_STOPS = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
)


@contextlib.contextmanager
def stop_signals() -> Iterator[None]:
    """Raise Stopped within the block when a signal asks the process to end; a second one ends it.

    So what is half-written is removed, and workers are ended. Where a signal arrives in a library's
    callback, nobody can catch what is raised there: it is raised again a moment later.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def stop(number: int, _: object) -> None:
        for one in _STOPS:
            signal.signal(one, signal.SIG_DFL)
        raise Stopped(number)

    def unraisable(lost: sys.UnraisableHookArgs) -> None:
        error = lost.exc_value
        if not isinstance(error, Stopped):
            hook(lost)
            return
        signal.signal(error.signal_number, stop)
        again = threading.Timer(_AGAIN_S, signal.raise_signal, (error.signal_number,))
        again.daemon = True
        again.start()

    hook = sys.unraisablehook
    before = {one: signal.getsignal(one) for one in _STOPS}
    sys.unraisablehook = unraisable
    for one, handler in before.items():
        if handler is not signal.SIG_IGN:
            signal.signal(one, stop)
    try:
        yield
    finally:
        sys.unraisablehook = hook
        for one, handler in before.items():
            signal.signal(one, handler)


def stopped_text(error: BaseException) -> str:
    """Return what is kept when a command was stopped, and how to go on."""
    number = error.signal_number if isinstance(error, Stopped) else signal.SIGINT
    kept = notes_of(error) or [
        "nothing half-written is left, older results are as they were; run the command again"
    ]
    return f"stopped by {signal.Signals(number).name}: {'; '.join(dict.fromkeys(kept))}"


def guarded(run: Callable[[], int | None]) -> int:
    """Run a command and return its exit code, 0 for none; errors of input go to stderr.

    Notes that an error has come first.

    When a signal stops it, stderr gets what is kept, and the code is 128 and the signal's number.
    """
    _open_closed_outputs()
    try:
        with quiet_callbacks(), stop_signals():
            return run() or 0
    except Stopped as error:
        print_message(stopped_text(error))
        return 128 + error.signal_number
    except MapfilterError as error:
        for note in notes_of(error):
            print_message(note, "note: ")
        print_message(str(error), "error: ")
    except MemoryError:
        hint = "too large an area, too fine a resolution, or a value in the wrong unit"
        print_message(f"memory: expected enough of it, found none left (likely: {hint})", "error: ")
    except OSError as error:
        if error.errno not in _NO_SPACE:
            raise
        where = error.filename or "the output"
        print_message(f"{where}: expected space on the disk, found none left", "error: ")
    return WRONG


def _open_closed_outputs() -> None:
    """Let what goes to an output that the caller closed go nowhere.

    Without it a file that is opened later would take the output's number, and get the text.
    """
    for name in ("stdin", "stdout", "stderr"):
        if getattr(sys, name) is None:
            mode = "r" if name == "stdin" else "w"
            setattr(sys, name, Path(os.devnull).open(mode, encoding="utf-8"))  # noqa: SIM115
