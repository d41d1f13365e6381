"""Queries of map elements, boxes in degrees, and versions of map files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

BoxDeg = tuple[float, float, float, float]
"""West, south, east, north in degrees."""

CUT_OFF = "cut off, or another format under this name"
"""What is likely where a file cannot be read."""

_LARGEST_KEPT_BYTES = 4 << 20


@dataclass(frozen=True, slots=True)
class Query:
    """Elements of a map, and the tags to read of them.

    Elements have one of the keys in ``wanted``, with one of its values (without values: any).
    """

    wanted: Mapping[str, tuple[str, ...]]
    tags: tuple[str, ...]


class Version(NamedTuple):
    """What changes when a file is written or replaced."""

    size_bytes: int
    written_ns: int
    changed_ns: int
    device: int
    inode: int

    @classmethod
    def of(cls, path: Path) -> Version:
        """Return the version of a file."""
        file = path.stat()
        of_disk = file.st_dev, file.st_ino
        return cls(file.st_size, file.st_mtime_ns, file.st_ctime_ns, *of_disk)

    @property
    def is_small(self) -> bool:
        """Whether what is read of the file is kept for those who read it again."""
        return self.size_bytes <= _LARGEST_KEPT_BYTES
