"""Progress of long work on stderr: bars on a terminal, or a line now and then."""

from __future__ import annotations

import contextlib
import sys
import time
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

from mapfilter.workflows.outputs.terminal import print_message

if TYPE_CHECKING:
    from mapfilter._parallel import Progress


@contextlib.contextmanager
def progress_bar(label: str) -> Iterator[Progress | None]:
    """Show a progress bar on stderr, if that is a terminal."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import Progress as Bar

    with Bar(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(label)
        yield lambda done, total: bar.update(task, completed=done, total=total)


@contextlib.contextmanager
def stage_bar(label: str) -> Iterator[Callable[[int, int, str], None]]:
    """Show a bar on stderr with the name of each stage, if that is a terminal."""
    if not sys.stderr.isatty():
        yield lambda done, total, what: None  # noqa: ARG005
        return
    from rich.console import Console
    from rich.progress import Progress as Bar

    with Bar(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(label)

        def show(done: int, total: int, what: str) -> None:
            bar.update(task, completed=done, total=total, description=f"{done + 1}/{total} {what}")

        yield show


def rate_text(per_s: float, unit: str) -> str:
    """Format a rate per second, or per minute below one per second.

    Examples
    --------
    >>> rate_text(13.83, "runs"), rate_text(0.045, "sessions")
    ('13.8 runs/s', '2.7 sessions/min')
    """
    return f"{per_s:.1f} {unit}/s" if per_s >= 1 else f"{60 * per_s:.1f} {unit}/min"


@contextlib.contextmanager
def rate_bar(label: str, unit: str, every_s: float = 30.0) -> Iterator[Progress]:
    """Show progress, rate and time left on stderr: a bar, or without terminal a line now and then.

    ``unit`` is what is counted; ``every_s`` the seconds between two lines.
    """
    bar: Any = None
    task: Any = None
    began_s = printed_s = time.monotonic()
    first = -1

    def show(done: int, total: int) -> None:
        nonlocal began_s, first, printed_s
        now_s = time.monotonic()
        if first < 0:
            began_s, first = now_s, done
        per_s = (done - first) / max(now_s - began_s, 1e-6)
        if bar is not None:
            bar.update(task, completed=done, total=total, rate=rate_text(per_s, unit))
        elif now_s - printed_s >= every_s and done > first:
            printed_s = now_s
            left_s = (total - done) / per_s
            many = f"{done} of {total} {unit}, {rate_text(per_s, unit)}, {left_s:.0f} s left"
            print_message(f"{label}: {many}")

    if not sys.stderr.isatty():
        yield show
        return
    from rich.console import Console
    from rich.progress import Progress as Bar
    from rich.progress import TextColumn

    columns = (*Bar.get_default_columns(), TextColumn("{task.fields[rate]}"))
    # Steps may lie minutes apart; with rich's usual 30 s there would be no time left.
    console = Console(stderr=True)
    bar = Bar(*columns, console=console, transient=True, speed_estimate_period=86_400.0)
    with bar:
        task = bar.add_task(label, total=None, rate="")
        yield show
