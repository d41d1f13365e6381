"""Lines that a program writes above the header of a table: its name, the time of the export."""

from __future__ import annotations

from collections.abc import Callable

from mapfilter._words import number_of
from mapfilter.tracks.readers.texts.text import Text

_MOST_LINES = 30


def below_title(text: Text, is_header: Callable[[Text], bool]) -> Text | None:
    """Return a text from the first line on that is a header; None where there is none below.

    Parameters
    ----------
    text : Text
    is_header : callable
        Whether a text of one line is the header of a table.

    Examples
    --------
    >>> from pathlib import Path
    >>> text = Text(Path("log.csv"), b"# by an app" + bytes([10]) + b"time,lat" + bytes([10]))
    >>> below_title(text, lambda line: line.first_line.startswith("time")).line
    2
    """
    begin = 0
    for number, line in enumerate(text.head[:_MOST_LINES]):
        if number and is_header(Text(text.path, line.encode())):
            note = f"{number_of(number, 'line')} above the header left out"
            return Text(text.path, text.data[begin:], (*text.notes, note), text.line + number)
        begin = text.data.find(b"\n", begin) + 1
        if not begin:
            break
    return None
