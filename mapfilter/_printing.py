"""Text for a terminal: what a file holds may be shown there, but not act on it.

A name or a note may hold sequences that move the cursor, rename the window or hide text; and a
terminal may lack the letters of a result, which is no reason to lose the result.
"""

from __future__ import annotations

import re
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
