"""What commands and pipelines print: results on stdout, everything else on stderr."""

from __future__ import annotations

import contextlib
import json
import sys
from typing import Any

from mapfilter._printing import printable, printable_json, write
from mapfilter.workflows.outputs.result_text import text_lines, to_jsonable


def print_message(text: str, kind: str = "") -> None:
    """Write lines to stderr, each with the program's name and ``kind`` before it."""
    for line in text.split("\n"):
        # A message that cannot be shown is no reason to fail otherwise than by the exit code.
        with contextlib.suppress(OSError):
            write(sys.stderr, f"mapfilter: {kind}{printable(line)}\n")


def print_text(text: str) -> None:
    """Write lines to stdout."""
    write(sys.stdout, printable(text) + "\n")


def print_result(result: Any, as_json: bool) -> None:
    """Print a result on stdout: one JSON line, or one line for each figure."""
    found = to_jsonable(result)
    if as_json:
        ascii_only = not (sys.stdout.encoding or "utf-8").lower().startswith("utf")
        text = json.dumps(found, ensure_ascii=ascii_only, allow_nan=False)
        write(sys.stdout, printable_json(text) + "\n")
        return
    for line in text_lines(found):
        print_text(line)
