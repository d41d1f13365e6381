"""What commands and pipelines show: results on stdout, everything else on stderr."""

from __future__ import annotations

import contextlib
import errno
import json
import sys
import time
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

from mapfilter.errors import MapfilterError

if TYPE_CHECKING:
    from mapfilter._parallel import Progress


def say(text: str, kind: str = "") -> None:
    """Write lines to stderr, each with the program's name and ``kind`` before it."""
    for line in text.splitlines():
        sys.stderr.write(f"mapfilter: {kind}{line}\n")


def print_result(result: Any, as_json: bool) -> None:
    """Print a result on stdout: one JSON line, or one line for each figure."""
    from mapfilter.workflows.jsonable import text_lines, to_jsonable

    found = to_jsonable(result)
    if as_json:
        sys.stdout.write(json.dumps(found, ensure_ascii=False, allow_nan=False) + "\n")
        return
    for line in text_lines(found):
        sys.stdout.write(line + "\n")


@contextlib.contextmanager
def progress_bar(label: str) -> Iterator[Progress | None]:
    """Give a progress bar on stderr, or nothing when nobody watches."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import Progress as Bar

    with Bar(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(label)
        yield lambda done, total: bar.update(task, completed=done, total=total)


def rate_text(per_s: float, unit: str) -> str:
    """Return a rate by the second, or by the minute where that is clearer.

    Examples
    --------
    >>> rate_text(13.83, "runs"), rate_text(0.045, "sessions")
    ('13.8 runs/s', '2.7 sessions/min')
    """
    return f"{per_s:.1f} {unit}/s" if per_s >= 1 else f"{60 * per_s:.1f} {unit}/min"


@contextlib.contextmanager
def rate_bar(label: str, unit: str, every_s: float = 30.0) -> Iterator[Progress]:
    """Give a progress on stderr with rate and time left; a line now and then where nobody watches.

    Parameters
    ----------
    label, unit : str
        What is done, and what is counted.
    every_s : float
        Seconds between two lines.
    """
    began_s = told_s = time.monotonic()
    first = -1

    def rate(done: int) -> float:
        return (done - first) / max(time.monotonic() - began_s, 1e-6)

    def tell(done: int, total: int) -> None:
        nonlocal began_s, first, told_s
        if first < 0:
            began_s, first = time.monotonic(), done
        if time.monotonic() - told_s >= every_s and done > first:
            told_s = time.monotonic()
            left_s = (total - done) / rate(done)
            many = f"{done} of {total} {unit}, {rate_text(rate(done), unit)}, {left_s:.0f} s left"
            say(f"{label}: {many}")

    if not sys.stderr.isatty():
        yield tell
        return
    from rich.console import Console
    from rich.progress import Progress as Bar
    from rich.progress import TextColumn

    columns = (*Bar.get_default_columns(), TextColumn("{task.fields[rate]}"))
    # Steps may lie minutes apart; with rich's usual 30 s there would be no time left.
    with Bar(
        *columns, console=Console(stderr=True), transient=True, speed_estimate_period=86_400.0
    ) as bar:
        task = bar.add_task(label, total=None, rate="")

        def show(done: int, total: int) -> None:
            nonlocal began_s, first
            if first < 0:
                began_s, first = time.monotonic(), done
            told = rate_text(rate(done), unit)
            bar.update(task, completed=done, total=total, rate=told)

        yield show


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
