"""What one raster file is to a set of them, whatever its format."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Protocol

import numpy as np

from mapfilter._types import Floats32
from mapfilter.geodesy import Lattice

Window = tuple[int, int, int, int]
"""Row, column, rows, columns."""


class RasterFile(Protocol):
    """One file, with one band or several, whose pixels stay in it until they are read."""

    @property
    def path(self) -> Path:
        """The file with the pixels."""

    @property
    def cell_ids(self) -> tuple[str, ...]:
        """One per band."""

    @property
    def lattice(self) -> Lattice:
        """Where the pixels lie."""

    @property
    def parts(self) -> tuple[Path, ...]:
        """The file, and those beside it that say what it means."""

    def read(self, bands: Sequence[int], window: Window) -> Floats32:
        """Read bands, counted from 0, in a window on the file's lattice.

        Returns
        -------
        ndarray of float32, shape (bands, rows, cols)
            Numbers as stored, apart from scales that the file itself tells; NaN without data.

        Raises
        ------
        InputError
            The file is cut off or damaged.
        """


def without_nodata(values: Floats32, nodata: Sequence[float]) -> Floats32:
    """Put NaN in place of the numbers that mean no data, and of infinite ones."""
    for number in nodata:
        values[values == np.float32(number)] = np.nan
    values[~np.isfinite(values)] = np.nan
    return values


def existing(*paths: Path | None) -> tuple[Path, ...]:
    """Return the paths at which there is a file."""
    return tuple(path for path in paths if path is not None and path.is_file())
