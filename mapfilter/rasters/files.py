"""What one raster file is to a set of them, whatever its format."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Literal, Protocol

import numpy as np

from mapfilter._types import Bools, Floats32
from mapfilter.errors import InputError, fail
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


Quantity = Literal["level", "loss", "deviation"]

QUANTITY_TAG = "MAPFILTER_QUANTITY"
"""Tag of a file that says which quantity its bands hold."""
_PLAUSIBLE: dict[Quantity, tuple[float, float, str]] = {
    "level": (-300.0, 60.0, "path losses, or raw RXLEV, given for levels"),
    "loss": (0.0, 400.0, "levels given for path losses"),
    "deviation": (0.0, 100.0, "levels or path losses given for deviations"),
}
_LEAST_LOSS_DB = 20.0
_LEAST_NODATA = 250.0


def reason(error: Exception) -> str:
    """Return the first line of what GDAL said."""
    text = str(error.__cause__ or error).strip()
    return text.splitlines()[0] if text else type(error).__name__


def check_file(path: Path) -> None:
    """See that there is a file with something in it.

    Raises
    ------
    InputError
        It is missing, empty or a folder.
    """
    try:
        size = path.stat().st_size
    except OSError as error:
        raise fail(InputError, str(path), "a readable file", error.strerror or error) from error
    if path.is_dir():
        raise fail(InputError, str(path), "a raster file", "a folder")
    if size == 0:
        raise fail(InputError, str(path), "a raster file", "an empty file")


def check_plausible(values: Floats32, quantity: Quantity, path: Path) -> None:
    """See that numbers can be levels, losses or deviations; NaN is passed over.

    Raises
    ------
    InputError
        They cannot; the likely mistake is told.
    """
    lowest, highest = (extreme.reduce(values, axis=None) for extreme in (np.fmin, np.fmax))
    if np.isnan(lowest):
        return
    where = f"{path} pixels"
    low, high, hint = _PLAUSIBLE[quantity]
    got = f"{lowest:g}..{highest:g}"
    if not (low <= lowest and highest <= high):
        unit = "dBm" if quantity == "level" else "dB"
        expected = f"a {quantity} in {low:g}..{high:g} {unit}"
        known = values[~np.isnan(values)]
        raise fail(InputError, where, expected, got, _hint(known, low, high) or hint)
    if quantity == "level" and highest >= 0 and _most(values >= 0, values):
        got = f"{got}, mostly 0 and above"
        raise fail(InputError, where, "levels in dBm, mostly below 0", got, hint)
    if quantity == "loss" and lowest < _LEAST_LOSS_DB and _most(values < _LEAST_LOSS_DB, values):
        expected = f"path losses, mostly above {_LEAST_LOSS_DB:g} dB"
        raise fail(InputError, where, expected, got, "a factor that is not the file's, or RXLEV")


def _most(chosen: Bools, values: Floats32) -> bool:
    """Tell whether more than half of the known values are chosen."""
    return bool(2 * np.count_nonzero(chosen) > np.count_nonzero(~np.isnan(values)))


def _hint(known: Floats32, low: float, high: float) -> str:
    """Return a hint for numbers far beyond what is possible, or nothing."""
    wrong = known[(known < low) | (known > high)]
    alike = wrong.size < known.size and (wrong == wrong[0]).all()
    if alike and abs(wrong[0]) >= _LEAST_NODATA:
        return f"{wrong[0]:g} means no data, and the file does not say so; say nodata"
    return "factor left out, or the wrong byte order" if np.abs(wrong).max() > 1000 else ""
