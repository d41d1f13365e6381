"""What commands and pipelines show: results on stdout, everything else on stderr."""

from __future__ import annotations

import contextlib
import json
import sys
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mapfilter._parallel import Progress


def say(text: str, kind: str = "") -> None:
    """Write lines to stderr, each with the program's name and ``kind`` before it."""
    for line in text.splitlines():
        sys.stderr.write(f"mapfilter: {kind}{line}\n")


def print_result(result: Any, as_json: bool) -> None:
    """Print a result on stdout: one JSON line, or one line for each figure."""
    from mapfilter.workflows.facts import facts, text_lines

    found = facts(result)
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
