"""Text for a terminal: what a file holds may be shown there, but not act on it.

A name or a note may hold sequences that move the cursor, rename the window or hide text; and a
terminal may lack the letters of a result, which is no reason to lose the result.
"""

from __future__ import annotations

import contextlib
import re
import sys
from collections.abc import Iterator
from types import TracebackType
from typing import TextIO

_LONGEST_LINE = 2000
# Control characters, marks that turn the direction of writing, line ends of Unicode, surrogates.
_ACTING = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]"
)


def printable(text: str, longest: int = _LONGEST_LINE) -> str:
    r"""Return text in which nothing acts on a terminal; each line is cut at a sensible length.

    Examples
    --------
    >>> print(printable("cell \x1b[31mA\x00"))
    cell \x1b[31mA\x00
    >>> print(printable("A" * 12, longest=10))
    AAAAAAAAAA… (2 more characters)
    """
    lines = (_cut(line, longest) for line in text.split("\n"))
    return _ACTING.sub(_escaped, "\n".join(lines))


def printable_json(text: str) -> str:
    r"""Return JSON with the same values, in which nothing acts on a terminal.

    Examples
    --------
    >>> print(printable_json('["\x9b2J"]'))
    ["\u009b2J"]
    """
    return _ACTING.sub(lambda found: f"\\u{ord(found[0]):04x}", text)


def write(stream: TextIO, text: str) -> None:
    """Write text; letters that the stream cannot show are written as their codes."""
    encoding = stream.encoding or "utf-8"
    stream.write(text.encode(encoding, "backslashreplace").decode(encoding))


def _cut(line: str, longest: int) -> str:
    more = len(line) - longest
    return line if more <= 0 else f"{line[:longest]}… ({more} more characters)"


def _escaped(found: re.Match[str]) -> str:
    code = ord(found[0])
    return f"\\x{code:02x}" if code < 256 else f"\\u{code:04x}"


@contextlib.contextmanager
def quiet_callbacks() -> Iterator[None]:
    """Print no traceback within the block where a library's callback cannot decode a message.

    GDAL's messages cite bytes of damaged files; rasterio decodes them where nobody can catch the
    error, and Python would print it. What GDAL found wrong is raised in any case.
    """
    before = sys.excepthook, sys.unraisablehook

    def hook(kind: type[BaseException], error: BaseException, where: TracebackType | None) -> None:
        if not isinstance(error, UnicodeDecodeError):
            before[0](kind, error, where)

    def unraisable(lost: sys.UnraisableHookArgs) -> None:
        if not isinstance(lost.exc_value, UnicodeDecodeError):
            before[1](lost)

    sys.excepthook, sys.unraisablehook = hook, unraisable
    try:
        yield
    finally:
        sys.excepthook, sys.unraisablehook = before
