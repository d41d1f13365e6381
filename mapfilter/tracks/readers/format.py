"""One row of the table of formats, and how a file is to be read."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from mapfilter.tracks.readers.recorded.reading import Reading
from mapfilter.tracks.readers.texts.text import Text


@dataclass(frozen=True)
class ReadOptions:
    """What a file does not hold about itself.

    Parameters
    ----------
    zone : str
        Zone of local times that state none, such as ``Europe/Brussels`` or ``+01:00``; "" where
        unknown.
    columns : mapping of str to str
        For plain CSV: column of each field, such as ``{"time": "Zeit", "lat_deg": "Breite"}``.
    shared : bool
        Whether these are the columns of several files: one that a file lacks is another's, and its
        field has a usual name here, or none.
    """

    zone: str = ""
    columns: Mapping[str, str] = field(default_factory=dict)
    shared: bool = False


@dataclass(frozen=True)
class Format:
    """A format of recordings.

    Parameters
    ----------
    name : str
        For ``--format``.
    title : str
        As messages name it.
    program : str
        Programs that write it.
    holds : str
        What is read.
    matches : callable
        Whether a file looks like it.
    read : callable
        Reads a text into a :class:`Reading`.
    by_rows : bool
        Whether a large file may be read part by part, each below the first line.
    """

    name: str
    title: str
    program: str
    holds: str
    matches: Callable[[Text], bool]
    read: Callable[[Text, Reading, ReadOptions], None]
    by_rows: bool = False
