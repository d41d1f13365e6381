"""What one file recorded: checked tables, its clock, and the rows that cannot be used."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import pandas as pd

from mapfilter.tracks.readers.recorded.unusable import Unusable

ClockKind = Literal["utc", "gps", "local", "monotonic"]


@dataclass(frozen=True)
class Clock:
    """The clock by which a file counts time.

    Parameters
    ----------
    kind : {"utc", "gps", "local", "monotonic"}
        Times of ``utc`` and ``gps`` are in the tables as UTC seconds (Unix time). Those of
        ``local`` without a zone are seconds as if the zone were UTC; ``monotonic`` ones count from
        an unknown start.
    zone : str
        Zone by which local times were turned into UTC; "" where unknown.
    from_midnight : bool
        Whether the unknown start of ``monotonic`` ones is a midnight.
    """

    kind: ClockKind
    zone: str = ""
    from_midnight: bool = False

    @property
    def absolute(self) -> bool:
        """Whether times in the tables are UTC seconds."""
        return self.kind in ("utc", "gps") or (self.kind == "local" and bool(self.zone))

    def __str__(self) -> str:
        if self.kind == "local":
            return f"local time ({self.zone or 'zone unknown'})"
        return {"utc": "UTC", "gps": "GPS time"}.get(self.kind, "seconds from an unknown start")


@dataclass(frozen=True, eq=False)
class Recording:
    """The content of one recording of another program.

    Parameters
    ----------
    path : Path
    format : str
        Name in the table of formats.
    program : str
        The program that wrote it, with its version where the file has it.
    clock : Clock
    tables : mapping of str to pandas.DataFrame
        Those of :data:`mapfilter.tracks.readers.recorded.tables.RECORDED` that hold something,
        sorted by ``time_s``.
    rows : int
        Rows read, usable or not.
    unusable : tuple of Unusable
        Rows left out, by reason.
    notes : tuple of str
        What was ignored, changed or is remarkable.
    crs : str
        Projected CRS of positions in metres; "" for a frame of the file's own.
    ignored : tuple of str
        Those of the notes that are on values left out.
    fields, unread : tuple of str
        Of a plain CSV: the fields that it has, and columns that were not used, each with the field
        that its name resembles.
    named : tuple of str
        Of a plain CSV: the fields of a column map whose columns it has.
    by_zone : bool
        Whether local times were turned into UTC by a zone that was given.
    name : str
        In messages: that of the file, with its folder where others of the journey have it, too.
    """

    path: Path
    format: str
    program: str
    clock: Clock
    tables: Mapping[str, pd.DataFrame]
    rows: int
    unusable: tuple[Unusable, ...] = ()
    notes: tuple[str, ...] = ()
    crs: str = ""
    ignored: tuple[str, ...] = ()
    fields: tuple[str, ...] = ()
    unread: tuple[str, ...] = ()
    named: tuple[str, ...] = ()
    by_zone: bool = False
    name: str = ""

    def __post_init__(self) -> None:
        if not self.name:
            object.__setattr__(self, "name", self.path.name)

    @property
    def losses(self) -> tuple[str, ...]:
        """What of the file is not used, rows and values, with its name."""
        rows = (f"not used: {found}" for found in self.unusable)
        return tuple(f"{self.name}: {text}" for text in (*rows, *self.ignored))

    @property
    def remarks(self) -> tuple[str, ...]:
        """Losses and all other notes, with the file's name."""
        others = (f"{self.name}: {note}" for note in self.notes if note not in self.ignored)
        return (*self.losses, *others)

    @property
    def unusable_rows(self) -> int:
        """Number of rows left out."""
        return sum(found.count for found in self.unusable)
