"""Levels at the points of several windows, for which each file is opened once."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mapfilter._types import Floats32, Ints
from mapfilter.radio.cells import CellPlan
from mapfilter.rasters.files import RasterFile, Window, check_plausible
from mapfilter.rasters.raster_set import RxLevRasters
from mapfilter.rasters.resampling import read_on
from mapfilter.rasters.undeclared import check_nodata_stated

_BANDS_AT_A_TIME, _MOST_BYTES = 128, 1 << 32
_MOST_UNUSED = 2.0
"""Pixels of a box about windows, over those of the windows, up to which it is read whole."""


@dataclass(frozen=True, slots=True, eq=False)
class Places:
    """N points in a window of a set of rasters.

    Parameters
    ----------
    rasters : RxLevRasters
        The set, or the part of it that reaches the window.
    plan : CellPlan
        Holds the cells of the rasters.
    cells : tuple of str
        Cells whose levels are asked for.
    window : (row, col, rows, cols)
        On the rasters' lattice.
    row, col : ndarray of int, shape (N,)
        Within the window.
    """

    rasters: RxLevRasters
    plan: CellPlan
    cells: tuple[str, ...]
    window: Window
    row: Ints
    col: Ints


def levels_at(places: Sequence[Places]) -> list[Floats32]:
    """Return the levels (dBm) at the points of some windows of one set of rasters.

    Windows near each other share most of their files, and the compressed blocks of these. A file
    with few bands is read once, in the box about all windows that it reaches; one with many, window
    by window, so that no more is held than for a single window.

    Returns
    -------
    list of ndarray of float32, shape (cells, N)
        For each window; NaN where there is no data.

    Raises
    ------
    InputError
        As :meth:`mapfilter.rasters.raster_set.RxLevRasters.read_levels_dbm`.
    """
    found = [np.full((len(one.cells), one.row.size), np.nan, np.float32) for one in places]
    # An index may name one file for several cells.
    of_file: dict[tuple[Path, tuple[str, ...]], tuple[RasterFile, list[int]]] = {}
    for number, one in enumerate(places):
        if one.row.size and one.cells:
            one.rasters.check_holds_levels()
            for file in one.rasters.files:
                own = of_file.setdefault((file.path, file.cell_ids), (file, []))
                own[1].append(number)
    rows = [{cell: n for n, cell in enumerate(one.cells)} for one in places]
    for file, numbers in of_file.values():
        bands = [n for n, cell in enumerate(file.cell_ids) if any(cell in rows[i] for i in numbers)]
        # Of many bands and large windows some at a time, so that what is read fits into memory.
        largest = max(places[i].window[2] * places[i].window[3] for i in numbers)
        most = min(_BANDS_AT_A_TIME, max(_MOST_BYTES // (4 * largest), 1))
        for first in range(0, len(bands), most):
            some = bands[first : first + most]
            for together in _together(places, numbers, len(some)):
                _read(file, some, places, together, rows, found)
    return found


def _together(places: Sequence[Places], numbers: list[int], bands: int) -> Iterator[list[int]]:
    """Yield the windows to read at a time: all of them, or one by one."""
    windows = [places[number].window for number in numbers]
    _, _, height, width = _box(windows)
    single = max(rows * cols for _, _, rows, cols in windows)
    used = sum(rows * cols for _, _, rows, cols in windows)
    fits = bands * height * width <= _BANDS_AT_A_TIME * single
    if fits and height * width <= _MOST_UNUSED * used:
        yield numbers
    else:
        yield from ([number] for number in numbers)


def _read(
    file: RasterFile,
    bands: list[int],
    places: Sequence[Places],
    numbers: list[int],
    rows: list[dict[str, int]],
    found: list[Floats32],
) -> None:
    """Read bands of a file in the box about some windows, and take the values at their points."""
    rasters = places[numbers[0]].rasters
    box = _box([places[number].window for number in numbers])
    values = read_on(file, bands, rasters.lattice, box, rasters.resampling)
    stored = values
    if rasters.resampling != "nearest":
        # A number that means no data is one no longer where it was weighed with its neighbours.
        stored = read_on(file, bands, rasters.lattice, box, "nearest")
    if rasters.factor != 1.0:
        values, stored = (one * np.float32(rasters.factor) for one in (values, stored))
    ids = [file.cell_ids[band] for band in bands]
    for number in numbers:
        one = places[number]
        top, left, height, width = one.window
        inside, held = (
            all_of[:, top - box[0] :, left - box[1] :][:, :height, :width]
            for all_of in (values, stored)
        )
        check_nodata_stated(held, ids, rasters.quantity, rasters.factor, file.path)
        for band in inside:
            check_plausible(band, rasters.quantity, file.path, rasters.factor)
        wanted = [n for n, cell in enumerate(ids) if cell in rows[number]]
        taken = [ids[n] for n in wanted]
        at_points = inside[np.array(wanted, np.intp)[:, None], one.row, one.col]
        found[number][[rows[number][cell] for cell in taken]] = rasters.levels_dbm(
            at_points, one.plan, taken
        )


def _box(windows: Sequence[Window]) -> Window:
    corners = np.array(windows)
    low, high = corners[:, :2].min(axis=0), (corners[:, :2] + corners[:, 2:]).max(axis=0)
    top, left, bottom, right = (int(one) for one in (*low, *high))
    return top, left, bottom - top, right - left
