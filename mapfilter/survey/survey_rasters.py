"""A survey on a lattice: rasters of mean and deviation, the plan of its cells, and calibration."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from mapfilter._parallel import Progress
from mapfilter._types import Floats, Floats32, Ints
from mapfilter.errors import InputError, fail
from mapfilter.lattice import Lattice
from mapfilter.radio.cell_rules import RANGES, technology_faults
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.radio.identities import LIMITS
from mapfilter.rasters.geotiff_writer import write_rasters
from mapfilter.rasters.raster_set import RxLevRasters
from mapfilter.rasters.undeclared import check_nodata_stated
from mapfilter.survey.level_trend import Covariate
from mapfilter.survey.measured_map import Survey, SurveyedCell
from mapfilter.survey.measurement_rows import Code, Identity
from mapfilter.survey.weakest_reported import WeakestReported, mean_below, scale_of

_FIELD_LENGTHS = 4.0
_LARGEST_WINDOW_PX = 1_000_000
_STRONGEST = 0.25
_BOUNDED_BEYOND_M = 500.0
"""Nearer to readings of a cell another one may serve although this one is as strong."""


def write_survey(
    survey: Survey,
    lattice: Lattice,
    mean_path: Path,
    deviation_path: Path,
    *,
    predicted: Mapping[str, Covariate] | None = None,
    fill: bool = False,
    deviation_factor: float = 1.0,
    tags: Mapping[str, str] | None = None,
    progress: Progress | None = None,
) -> tuple[str, ...]:
    """Write the mean levels and their deviations, one band per cell, and return the cells' ids.

    Pixels farther from every reading of a cell than the survey's reach are NaN in both files; with
    ``fill`` the first has the trend (the calibrated prediction) there where that holds so far
    (:meth:`~mapfilter.survey.measured_map.Survey.can_fill`), and the NaN of the second still marks
    them. Farther than 500 m from every reading, a trend that is not about a given antenna or
    prediction is bounded by the reports of its technology without it
    (:class:`~mapfilter.survey.weakest_reported.WeakestReported`). Cells not measured on the
    lattice, in the survey's CRS, are left out; with ``fill`` those of ``predicted``, which the
    survey calibrates, are kept with the offset that it expects.
    ``deviation_factor`` multiplies the deviations.

    Raises
    ------
    InputError
        No cell was measured on the lattice.
    """
    ids: list[str] = []
    bounds_dbm = {
        kind: _bound_dbm(weakest, lattice, survey.options.reach_m)
        for kind, weakest in (survey.weakest.items() if fill else ())
    }
    unmeasured = survey.expected if fill and predicted is not None else {}
    everyone = sorted((*survey.cells, *unmeasured))
    measured = False
    with tempfile.TemporaryFile() as spool:
        for done, cell_id in enumerate(everyone, start=1):
            if predicted is not None and cell_id in unmeasured:
                offset_db = unmeasured[cell_id].offset_db
                found = _expected_on_lattice(predicted[cell_id], offset_db, lattice)
            else:
                cell = survey.cells[cell_id]
                filled = fill and survey.can_fill(cell)
                kind = scale_of(survey.technologies.get(cell_id))
                bound = bounds_dbm[kind] if filled and not cell.has_given_trend else None
                found = _on_lattice(survey, cell, lattice, filled, bound)
                measured = measured or found is not None
            if found is not None:
                ids.append(cell_id)
                pixels, levels = found
                levels[1] *= deviation_factor
                np.save(spool, pixels)
                np.save(spool, levels.astype(np.float32))
            if progress is not None:
                progress(done, len(everyone))
        if not measured:
            bounds = ", ".join(f"{value:.0f}" for value in lattice.bounds_m)
            raise fail(InputError, "measurements", f"some in the area {bounds}", "none")
        for path, row, quantity in ((mean_path, 0, "level"), (deviation_path, 1, "deviation")):
            bands = _bands(spool, ids, row, lattice)
            write_rasters(path, lattice, bands, ids, tags, quantity=quantity)  # type: ignore[arg-type]
    return tuple(ids)


def surveyed_plan(
    survey: Survey,
    ids: Sequence[str],
    identities: Mapping[str, Identity],
    plan: CellPlan | None,
    *,
    height_m: float,
    eirp_dbm: float,
    frequency_mhz: float,
    technologies: Mapping[str, str] | None = None,
    codes: Mapping[str, Code] | None = None,
) -> CellPlan:
    """Return a plan of surveyed cells: as given, else with the antenna where it was located.

    An antenna that could not be located is put amid the strongest quarter of its readings. What
    is known of a cell, its identity, technology, carrier and code, is in the plan.
    """
    families = _families(identities, technologies or {}, codes or {})
    known = plan.to_crs(survey.crs) if plan is not None else None
    cells = []
    for cell_id in ids:
        if known is not None and cell_id in known:
            cells.append(known[cell_id])
            continue
        place = survey.cells[cell_id].antenna or _amid_strongest(survey.cells[cell_id])
        mcc, mnc, lac, ci = identities.get(cell_id, (None, None, None, None))
        cell = Cell(cell_id, cell_id, *place, height_m, None, eirp_dbm, frequency_mhz, "omni")
        cell = replace(cell, mcc=mcc, mnc=mnc, lac=lac, ci=ci)
        arfcn, bsic = (codes or {}).get(cell_id, (None, None))
        told = replace(cell, arfcn=arfcn, bsic=bsic, technology=families.get(cell_id))
        # What no plan may state would make this one unreadable.
        odd = {name for name, *_ in technology_faults(told.technology, partial(getattr, told))}
        odd |= {
            name
            for name, value in (("arfcn", arfcn), ("bsic", bsic))
            if value is not None and not RANGES[name].holds(value)
        }
        if odd & {"arfcn", "bsic"}:
            told = replace(told, arfcn=None, bsic=None)
        cells.append(replace(told, technology=None) if odd - {"arfcn", "bsic"} else told)
    return CellPlan(survey.crs, tuple(cells))


def _families(
    identities: Mapping[str, Identity], technologies: Mapping[str, str], codes: Mapping[str, Code]
) -> Mapping[str, str]:
    """Return the technologies of cells: GSM where none is stated, and all have what GSM has.

    A CI of 16 bits beside ARFCN and BSIC; in LTE identities are longer, and most codes larger.
    """
    unknown = [name for name in codes if name not in technologies and name in identities]
    most = LIMITS["GSM"]
    fits = all(
        max(identities[name][2:]) <= most["ci"]
        and codes[name][0] <= most["arfcn"]
        and codes[name][1] <= most["bsic"]
        for name in unknown
    )
    return {**technologies, **dict.fromkeys(unknown, "GSM")} if fits else technologies


def predicted_levels(rasters: RxLevRasters, plan: CellPlan | None) -> dict[str, Covariate]:
    """Return each cell's predicted level as a function of place, for a survey to calibrate.

    The plan is needed for losses only. The functions raise InputError where a number that means no
    data would be taken for a level.

    Raises
    ------
    InputError
        The rasters hold deviations.
    """
    rasters.check_holds_levels()
    return {cell_id: partial(_predicted, rasters, plan, cell_id) for cell_id in rasters.cell_ids}


def _predicted(
    rasters: RxLevRasters, plan: CellPlan | None, cell_id: str, east_m: Floats, north_m: Floats
) -> Floats:
    """Return a cell's predicted level at places in the rasters' CRS; NaN beyond the rasters."""
    row, col = rasters.lattice.row_col(east_m, north_m)
    on = np.asarray(rasters.lattice.contains(row, col))
    level_dbm = np.full(len(row), np.nan)
    if on.any():
        top, left = int(row[on].min()), int(col[on].min())
        window = (top, left, int(row[on].max()) - top + 1, int(col[on].max()) - left + 1)
        values = rasters.read(window, (cell_id,))
        check_nodata_stated(values, (cell_id,), rasters.quantity, rasters.factor, rasters.path)
        if plan is not None and rasters.quantity != "level":
            values = rasters.levels_dbm(values, plan, (cell_id,))
        level_dbm[on] = values[0, row[on] - top, col[on] - left]
    return level_dbm


def _on_lattice(
    survey: Survey, cell: SurveyedCell, lattice: Lattice, fill: bool, bound_dbm: Floats32 | None
) -> tuple[Ints, Floats] | None:
    """Return the pixels with a value, and mean and deviation there; None if none was measured.

    Levels far from every reading are less than ``bound_dbm``, a value for each pixel.
    """
    reach_m = survey.options.reach_m
    field_m = max(reach_m, _FIELD_LENGTHS * survey.shadowing.correlation_m) if fill else reach_m
    pixels, levels, measured = [], [], False
    for row, col, rows, cols in _windows(cell, lattice, reach_m, fill):
        grid = np.mgrid[row : row + rows, col : col + cols].reshape(2, -1)
        east_m, north_m = lattice.east_north(grid[0], grid[1])
        distance_m = cell.distance_m(east_m, north_m, max(field_m, _BOUNDED_BEYOND_M))
        level = np.full((2, len(east_m)), np.nan)
        near = distance_m <= field_m
        level[:, near] = cell.predict(east_m[near], north_m[near])
        if fill:
            level[0, ~near] = cell.trend.level_dbm(east_m[~near], north_m[~near])
        if bound_dbm is not None:
            far = distance_m > max(reach_m, _BOUNDED_BEYOND_M)
            bound = bound_dbm[grid[0][far], grid[1][far]]
            level[0, far] = mean_below(level[0, far], bound, survey.shadowing.variance_db2**0.5)
        level[1, distance_m > reach_m] = np.nan
        some = np.isfinite(level[0])
        measured = measured or bool(np.isfinite(level[1]).any())
        pixels.append((grid[0] * lattice.cols + grid[1])[some])
        levels.append(level[:, some])
    if not measured:
        return None
    return np.concatenate(pixels), np.concatenate(levels, axis=1)


def _expected_on_lattice(
    predicted: Covariate, offset_db: float, lattice: Lattice
) -> tuple[Ints, Floats] | None:
    """Return what :func:`_on_lattice` does for a cell that was not measured: no deviations."""
    pixels, levels = [], []
    for row, rows in _strips(lattice.rows, lattice.cols):
        grid = np.mgrid[row : row + rows, : lattice.cols].reshape(2, -1)
        level_dbm = predicted(*lattice.east_north(grid[0], grid[1])) + offset_db
        some = np.isfinite(level_dbm)
        pixels.append((grid[0] * lattice.cols + grid[1])[some])
        levels.append(level_dbm[some])
    mean_dbm = np.concatenate(levels)
    if not mean_dbm.size:
        return None
    return np.concatenate(pixels), np.stack([mean_dbm, np.full_like(mean_dbm, np.nan)])


def _strips(rows: int, cols: int) -> Iterator[tuple[int, int]]:
    """Yield first row and number of rows of strips that are not too large."""
    step = max(_LARGEST_WINDOW_PX // cols, 1)
    for row in range(0, rows, step):
        yield row, min(step, rows - row)


def _bound_dbm(weakest: WeakestReported, lattice: Lattice, within_m: float) -> Floats32:
    """Return the bound of what was not reported at each pixel, infinite without reports."""
    bound_dbm = np.empty((lattice.rows, lattice.cols), dtype=np.float32)
    for row, rows in _strips(lattice.rows, lattice.cols):
        strip = bound_dbm[row : row + rows]
        grid = np.mgrid[row : row + rows, : lattice.cols].reshape(2, -1)
        east_m, north_m = lattice.east_north(grid[0], grid[1])
        strip[:] = weakest.bound_dbm(east_m, north_m, within_m).reshape(strip.shape)
    return bound_dbm


def _windows(
    cell: SurveyedCell, lattice: Lattice, reach_m: float, fill: bool
) -> Iterator[tuple[int, int, int, int]]:
    """Yield strips of the lattice that hold every pixel in reach of a cell's readings."""
    top, left, bottom, right = 0, 0, lattice.rows - 1, lattice.cols - 1
    if not fill:
        west, south = cell.points.measured_at.min(axis=0) - reach_m
        east, north = cell.points.measured_at.max(axis=0) + reach_m
        first_row, first_col = lattice.row_col(west, north)
        last_row, last_col = lattice.row_col(east, south)
        top, left = max(top, first_row), max(left, first_col)
        bottom, right = min(bottom, last_row), min(right, last_col)
    cols = right - left + 1
    if cols < 1:
        return
    for row, rows in _strips(bottom + 1 - top, cols):
        yield top + row, left, rows, cols


def _bands(
    spool: IO[bytes], ids: Sequence[str], which: int, lattice: Lattice
) -> Iterator[tuple[str, NDArray[Any]]]:
    spool.seek(0)
    for cell_id in ids:
        pixels, levels = np.load(spool), np.load(spool)
        band = np.full(lattice.rows * lattice.cols, np.nan, dtype=np.float32)
        band[pixels] = levels[which]
        yield cell_id, band.reshape(lattice.rows, lattice.cols)


def _amid_strongest(cell: SurveyedCell) -> tuple[float, float]:
    points = cell.points
    strongest = np.argsort(-points.level_dbm, kind="stable")
    east_m, north_m = points.places[strongest[: max(int(len(points) * _STRONGEST), 1)]].mean(axis=0)
    return float(east_m), float(north_m)
