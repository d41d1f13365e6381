"""The door for rasters: GDAL opens GeoTIFFs only, and these lead to no other file.

Not only virtual rasters name files elsewhere, or addresses in the network: a GeoTIFF does so by its
metadata, and GDAL opens the overviews and the mask beside it whatever they are.
"""

from __future__ import annotations

import os
import stat
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import rasterio
from rasterio.errors import NotGeoreferencedWarning, RasterioError

from mapfilter._inputs import check_file, open_input
from mapfilter._words import likely_of_no_file
from mapfilter.errors import InputError, MapfilterError, fail

# Little and big endian, each also as BigTIFF.
_TIFF = (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")
_BESIDE = (".ovr", ".msk")
"""Files beside a raster that GDAL opens as rasters."""
_READ_BESIDE = (
    *(".tfw", ".tifw", ".tiffw", ".wld", ".tab", ".prj", ".aux", ".rrd", ".imd", ".rpb"),
    *(".xml", ".txt", ".rpc", ".pvl", ".pass", ".dim"),
)
"""Ends of names that GDAL reads beside a raster: georeference, and what the operator of a satellite
says of an image, some under names of their own."""
_OVERVIEWS = "OVERVIEWS"
"""Domain of metadata by which GDAL finds overviews, wherever they are."""
_LARGEST_SIDECAR_BYTES = 16 << 20
_LEAST_BLOCK_BYTES = 64 << 20
_ELSEWHERE = "a raster that holds its data itself"


@contextmanager
def open_raster(path: Path, *, quiet: bool = True) -> Iterator[Any]:
    """Open a GeoTIFF for reading; ``quiet`` ignores that it lacks a place.

    Yields
    ------
    rasterio.io.DatasetReader

    Raises
    ------
    InputError
        There is no such file, it is a pipe or a device, no TIFF, leads to other files, or its
        blocks are larger than the file can fill.
    rasterio.errors.RasterioError
        It is damaged; while it is open, too.
    """
    _check_sidecars(path)
    try:
        with _unreadable_messages_unheard(), warnings.catch_warnings():
            if quiet:
                warnings.simplefilter("ignore", NotGeoreferencedWarning)
            # The absolute path, as GDAL takes a name such as "GTIFF_DIR:1:a.tif" for a command.
            source = rasterio.open(path.absolute(), driver="GTiff")
        with source:
            _check_inside(path, source)
            check_blocks(path, source)
            yield source
    except UnicodeDecodeError as error:
        raise RasterioError(f"names or notes in no UTF-8 ({error.reason})") from error


def reason_of(error: Exception) -> str:
    """Return the first line of GDAL's message."""
    text = str(error.__cause__ or error).strip()
    return text.splitlines()[0] if text else type(error).__name__


@contextmanager
def _unreadable_messages_unheard() -> Iterator[None]:
    """Let nothing be printed where GDAL complains in bytes that are no text.

    Rasterio hands on GDAL's messages. Where one quotes such bytes of the file, it can raise nothing
    and has Python print a traceback of its own, through both hooks.
    """
    raised, unraisable = sys.excepthook, sys.unraisablehook
    # Another thread opens a raster: it puts back what was there before.
    if isinstance(raised, _Hook):
        yield
        return
    sys.excepthook = _Hook(raised)
    sys.unraisablehook = _Hook(unraisable)
    try:
        yield
    finally:
        sys.excepthook, sys.unraisablehook = raised, unraisable


class _Hook:
    """A hook for exceptions that is not called for bytes that are no text."""

    def __init__(self, before: Callable[..., None]) -> None:
        self._before = before

    def __call__(self, *given: Any) -> None:
        error = given[1] if len(given) > 1 else given[0].exc_value
        if not isinstance(error, UnicodeDecodeError):
            self._before(*given)


def _check_sidecars(path: Path) -> None:
    """Check a raster and what GDAL would read beside it."""
    name = str(path)
    _check_is_tiff(path)
    folder = path.absolute().parent
    for strange in _no_files_in(folder, folder.stat().st_mtime_ns):
        check_file(folder / strange)
    settings = Path(f"{name}.aux.xml")
    if settings.exists():
        size = check_file(settings)
        if size > _LARGEST_SIDECAR_BYTES:
            raise fail(InputError, str(settings), "at most 16 MiB", f"{size >> 20} MiB")
    for suffix in _BESIDE:
        beside = Path(f"{name}{suffix}")
        if beside.exists():
            try:
                with open_raster(beside):
                    pass
            except (MapfilterError, RasterioError, UnicodeDecodeError) as error:
                if not isinstance(error, MapfilterError):
                    got = str(error).splitlines()[0]
                    raise fail(InputError, str(beside), "a TIFF", got, "damaged") from error
                raise


@lru_cache(maxsize=16)
def _no_files_in(folder: Path, _changed_ns: int) -> tuple[str, ...]:
    """Return what lies in a folder under a name that GDAL may read, and is a pipe or a device."""
    try:
        named = [one for one in os.scandir(folder) if one.name.lower().endswith(_READ_BESIDE)]
    except OSError:
        # A folder that may not be listed; what it holds is then not looked for either.
        return ()
    return tuple(one.name for one in named if _is_strange(one))


def _is_strange(entry: os.DirEntry[str]) -> bool:
    """Tell whether there is something that is neither a file nor a folder."""
    try:
        mode = entry.stat().st_mode
    except OSError:
        # A link that leads nowhere, or to itself: GDAL cannot open it either.
        return False
    return not (stat.S_ISREG(mode) or stat.S_ISDIR(mode))


def _check_is_tiff(path: Path) -> None:
    if not path.exists():
        raise fail(InputError, str(path), "a raster file", "no such file", likely_of_no_file(path))
    with open_input(path) as stream:
        head = stream.read(64)
    if head.startswith(_TIFF):
        return
    if head.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"<"):
        hint = "a virtual raster or an address; gdal_translate FROM TO.tif copies its pixels"
        raise fail(InputError, str(path), _ELSEWHERE, "text that may lead to other places", hint)
    got = "an empty file" if not head else "no TIFF"
    hint = "cut off, or no raster; gdal_translate FROM TO.tif converts other formats"
    raise fail(InputError, str(path), "a raster that GDAL can read (GeoTIFF)", got, hint)


def _check_inside(path: Path, source: Any) -> None:
    """Check what an open raster refers to, before any of it is followed."""
    if tags := source.tags(ns=_OVERVIEWS):
        named = ", ".join(map(str, tags.values()))
        got = f"overviews elsewhere: {named}"
        hint = "gdal_translate FROM TO.tif makes a copy without them"
        raise fail(InputError, str(path), _ELSEWHERE, got, hint)


def check_blocks(path: Path, source: Any) -> None:
    """Refuse a raster whose blocks need far more memory than the file holds bytes.

    Raises
    ------
    InputError
        A block is larger than 64 MiB and than the file.
    """
    rows_px, cols_px = source.block_shapes[0]
    by_band = str(source.interleaving).lower().endswith("band")
    pixel_bytes = max(np.dtype(kind).itemsize for kind in source.dtypes)
    block_bytes = rows_px * cols_px * pixel_bytes * (1 if by_band else source.count)
    if block_bytes > max(path.stat().st_size, _LEAST_BLOCK_BYTES):
        got = f"{rows_px} x {cols_px} pixels of {pixel_bytes} bytes"
        hint = "not tiled, or a damaged header"
        raise fail(InputError, f"{path}, blocks", "blocks under 64 MiB", got, hint)
