"""One raster file of a set, whatever its format, and the numbers that it may hold."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from mapfilter._inputs import open_input
from mapfilter._types import Bools, Floats32
from mapfilter.errors import InputError, fail
from mapfilter.lattice import Lattice

Window = tuple[int, int, int, int]
"""Row, column, rows, columns."""
Quantity = Literal["level", "loss", "deviation"]

_PLAUSIBLE: dict[Quantity, tuple[float, float, str]] = {
    "level": (-300.0, 60.0, "path losses, or raw RXLEV, given for levels; or a sign lost"),
    "loss": (0.0, 400.0, "levels given for path losses"),
    "deviation": (0.0, 100.0, "levels or path losses given for deviations"),
}
SIGN_NOT_READ = "negative numbers read as unsigned ones: PIXELTYPE SIGNEDINT in the .hdr"
"""The likely mistake where numbers are levels of which the highest bit is no sign."""

POWERS = "powers in W or mW given for levels: dBm = 10 log10(P / 1 mW)"
_LARGEST_POWER = 0.1
"""Levels are whole decibels at least; a phone receives less than this in mW."""
_LEAST_LOSS_DB = 20.0
_LEAST_NODATA = 250.0


@dataclass(frozen=True, slots=True)
class Declared:
    """Properties given by the user for files that do not state them.

    Parameters
    ----------
    crs : str or None
        Projected CRS.
    nodata : float or None
        A number that means no data, besides the files' own.
    factor : float
        By which all numbers are multiplied; 1 of files that state scales of their own.
    header : (str, mapping of str to str) or None
        Row of an index of raw pixels, and the keys and values of a header; used where the pixels
        have none, or one without the place.
    """

    crs: str | None = None
    nodata: float | None = None
    factor: float = 1.0
    header: tuple[str, Mapping[str, str]] | None = None


@dataclass(frozen=True, slots=True)
class RasterFile(ABC):
    """One file, with one band or several, whose pixels stay in it until they are read.

    Parameters
    ----------
    cell_ids : tuple of str
        One per band.
    nodata : tuple of float
        Stored numbers that mean no data, besides those that the driver masks.
    parts : tuple of Path
        The file, and those beside it: header, CRS.
    quantity : {"level", "loss", "deviation"} or None
        As the file states it.
    tagged : bool
        Whether it states the quantity by mapfilter's tag.
    described : bool
        Whether the cell ids are band descriptions of the file, not its name.
    bits : int or None
        Size of a pixel, where an index of rasters repeats it.
    """

    path: Path
    cell_ids: tuple[str, ...]
    lattice: Lattice
    nodata: tuple[float, ...]
    parts: tuple[Path, ...]
    quantity: Quantity | None = None
    tagged: bool = False
    described: bool = False
    bits: int | None = None

    @abstractmethod
    def read(self, bands: Sequence[int], window: Window) -> Floats32:
        """Read bands, counted from 0, in a window on the file's lattice.

        Returns
        -------
        ndarray of float32, shape (bands, rows, cols)
            Numbers as stored, apart from the file's own scales; NaN without data.

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


def check_file(path: Path) -> None:
    """Check that there is a file with something in it."""
    if path.is_dir():
        raise fail(InputError, str(path), "a raster file", "a folder")
    with open_input(path) as stream:
        empty = not stream.read(1)
    if empty:
        raise fail(InputError, str(path), "a raster file", "an empty file")


def as_stored(number: float, factor: float) -> str:
    """Return the stored number that a factor made another, as settings and messages have it.

    Examples
    --------
    >>> as_stored(-624.9375, 0.0625), as_stored(np.float32(-999.9), 0.1), as_stored(-60.1, 1.0)
    ('-9999', '-9999', '-60.1')
    >>> as_stored(-9999.5, 1.0), as_stored(np.float32(-6000.55), 1.0), as_stored(-0.0, 0.1)
    ('-9999.5', '-6000.55', '0')
    """
    exact = float(number) / factor
    # Single precision has rounded it; adding 0 turns -0 into 0.
    whole = float(round(exact)) + 0.0
    is_whole = abs(exact - whole) < 1e-6 * max(1.0, abs(exact))
    return f"{whole:.10g}" if is_whole else str(np.float32(exact))


def are_bytes_without_sign(values: Floats32, factor: float) -> bool:
    """Return whether numbers are what bytes with a sign, all negative, are if read without it.

    Examples
    --------
    >>> are_bytes_without_sign(np.float32([128, 171, np.nan]), 1.0)
    True
    >>> are_bytes_without_sign(np.float32([98, 171]), 1.0)
    False
    """
    stored = values[~np.isnan(values)] / factor
    whole = np.abs(stored - np.round(stored)) < 1e-3
    return bool(stored.size and stored.min() >= 128 and stored.max() <= 255 and whole.all())


def are_powers(values: Floats32) -> bool:
    """Return whether numbers are those of received powers in W or mW; NaN is ignored.

    Examples
    --------
    >>> are_powers(np.float32([1e-9, 3e-12])), are_powers(np.float32([0.0, 1e-9]))
    (True, False)
    """
    lowest, highest = np.fmin.reduce(values, axis=None), np.fmax.reduce(values, axis=None)
    return bool(lowest > 0 and highest < _LARGEST_POWER)


def check_plausible(values: Floats32, quantity: Quantity, path: Path, factor: float = 1.0) -> None:
    """Check that numbers, multiplied by a factor, can be levels, losses or deviations.

    NaN is ignored.
    """
    lowest, highest = (extreme.reduce(values, axis=None) for extreme in (np.fmin, np.fmax))
    if np.isnan(lowest):
        return
    where, got = f"{path} pixels", f"{lowest:g}..{highest:g}"
    low, high, hint = _PLAUSIBLE[quantity]
    if not (low <= lowest and highest <= high):
        unit = "dBm" if quantity == "level" else "dB"
        known = values[~np.isnan(values)]
        wrong = known[(known < low) | (known > high)]
        alike = wrong.size < known.size and (wrong == wrong[0]).all()
        if alike and abs(wrong[0]) >= _LEAST_NODATA:
            stored = as_stored(wrong[0], factor)
            hint = f"{stored} means no data, and the file does not state it; set nodata"
        elif np.abs(wrong).max() > 1000:
            hint = "factor left out, or the wrong byte order"
            if quantity == "level" and low + 65536 <= lowest:
                hint = SIGN_NOT_READ
        elif quantity == "level" and are_bytes_without_sign(values, factor):
            hint = f"{SIGN_NOT_READ}; or path losses"
        raise fail(InputError, where, f"a {quantity} in {low:g}..{high:g} {unit}", got, hint)
    if quantity == "level" and highest >= 0 and _most(values >= 0, values):
        got = f"{got}, mostly 0 and above"
        hint = POWERS if are_powers(values) else hint
        raise fail(InputError, where, "levels in dBm, mostly below 0", got, hint)
    if quantity == "loss" and lowest < _LEAST_LOSS_DB and _most(values < _LEAST_LOSS_DB, values):
        expected = f"path losses, mostly above {_LEAST_LOSS_DB:g} dB"
        raise fail(InputError, where, expected, got, "a factor that is not the file's, or RXLEV")


def _most(chosen: Bools, values: Floats32) -> bool:
    return bool(2 * np.count_nonzero(chosen) > np.count_nonzero(~np.isnan(values)))
