"""Predicts how every cell is heard, and plays the reality that a prediction is tested against.

The prediction of a cell is EIRP + antenna gain - path loss + shadowing, at street height; where a
raster of building heights is given it decides who sees the antenna and how high the roofs are.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mapfilter._parallel import Progress
from mapfilter.geodesy import Lattice
from mapfilter.radio._models import PredictionModel, RealityErrors
from mapfilter.radio._surroundings import Surroundings, views_of
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.radio.pathloss import outside_published_range
from mapfilter.radio.shadowing import named_rng, site_shadowing

__all__ = [
    "PredictionModel",
    "RealityErrors",
    "outside_validity",
    "predict",
    "predict_cell",
    "realise",
]

Floats32 = NDArray[np.float32]


def predict_cell(
    cell: Cell,
    lattice: Lattice,
    heights_m: Floats32 | None,
    model: PredictionModel,
    *,
    slope_factor: float = 1.0,
) -> Floats32:
    """Predict the level of one cell at every pixel's centre.

    Parameters
    ----------
    cell : Cell
        With its position in the lattice's CRS.
    lattice : Lattice
    heights_m : ndarray of float32, shape (rows, cols), or None
        Heights of buildings above ground, 0 where there is none. Without them nobody sees an
        antenna, and every roof has the model's default height.
    model : PredictionModel
    slope_factor : float
        Multiplies the path loss per decade of distance; the loss at 100 m stays.

    Returns
    -------
    ndarray of float32, shape (rows, cols)
        dBm, at the model's mobile height, outdoors.

    Raises
    ------
    InputError
        The heights do not fit the lattice.
    """
    surroundings = Surroundings.of(lattice, heights_m, model)
    ((_, clutter_db),) = _clutter(CellPlan(lattice.crs, (cell,)), lattice, model)
    level_dbm = surroundings.median_level_dbm(cell, surroundings.seen(cell), slope_factor)
    return np.asarray(level_dbm + clutter_db, dtype=np.float32)


def predict(
    plan: CellPlan,
    lattice: Lattice,
    heights_m: Floats32 | None,
    model: PredictionModel,
    progress: Progress | None = None,
) -> Iterator[tuple[str, Floats32]]:
    """Predict every cell of a plan, as :func:`predict_cell` does, one at a time.

    Parameters
    ----------
    plan : CellPlan
        Brought into the lattice's CRS where it is in another.
    lattice : Lattice
    heights_m : ndarray of float32, shape (rows, cols), or None
    model : PredictionModel
    progress : callable, optional
        Called with (cells done, cells in all).

    Yields
    ------
    (str, ndarray of float32, shape (rows, cols))
        Cell id and level in dBm, in the plan's order.

    Raises
    ------
    InputError
        The heights do not fit the lattice.
    """
    plan = plan.to_crs(lattice.crs)
    surroundings = Surroundings.of(lattice, heights_m, model)
    views = views_of(plan, surroundings)
    clutter = _clutter(plan, lattice, model)
    for done, (cell, seen, (cell_id, clutter_db)) in enumerate(
        zip(plan.cells, views, clutter, strict=True), start=1
    ):
        level_dbm = surroundings.median_level_dbm(cell, seen, 1.0)
        if progress is not None:
            progress(done, len(plan))
        yield cell_id, np.asarray(level_dbm + clutter_db, dtype=np.float32)


def realise(
    plan: CellPlan,
    lattice: Lattice,
    heights_m: Floats32 | None,
    model: PredictionModel,
    errors: RealityErrors,
    progress: Progress | None = None,
) -> Iterator[tuple[str, Floats32]]:
    """Play reality: the prediction of each cell, wrong in the ways that predictions are.

    It plays reality so that no filter is judged on its own prediction. EIRP, azimuth and path-loss
    slope of each cell are off by uniformly drawn amounts, and a correlated shadowing field that is
    independent of the prediction's is added. Every draw depends on the seed and on names only:
    adding a cell changes no other.

    Parameters
    ----------
    plan, lattice, heights_m, model, progress
        As for :func:`predict`, and the same as the prediction was made with.
    errors : RealityErrors

    Yields
    ------
    (str, ndarray of float32, shape (rows, cols))
        Cell id and level in dBm, in the plan's order.

    Raises
    ------
    InputError
        The heights do not fit the lattice.
    """
    plan = plan.to_crs(lattice.crs)
    surroundings = Surroundings.of(lattice, heights_m, model)
    views = views_of(plan, surroundings)
    clutter = _clutter(plan, lattice, model)
    wrong = site_shadowing(
        plan, lattice, errors.level_error_db, errors.correlation_m, errors.site_share, errors.seed,
        stream="reality",
    )  # fmt: skip
    for done, (cell, seen, (cell_id, clutter_db), (_, error_db)) in enumerate(
        zip(plan.cells, views, clutter, wrong, strict=True), start=1
    ):
        real, slope_factor = _perturbed(cell, errors)
        level_dbm = surroundings.median_level_dbm(real, seen, slope_factor)
        if progress is not None:
            progress(done, len(plan))
        yield cell_id, np.asarray(level_dbm + clutter_db + error_db, dtype=np.float32)


def outside_validity(plan: CellPlan, lattice: Lattice, model: PredictionModel) -> tuple[str, ...]:
    """Tell, cell by cell, what of a prediction lies outside the model's published range."""
    plan = plan.to_crs(lattice.crs)
    west, south, east, north = lattice.bounds_m
    notes: list[str] = []
    for cell in plan.cells:
        farthest_m = np.hypot(
            max(abs(cell.east_m - west), abs(cell.east_m - east)),
            max(abs(cell.north_m - south), abs(cell.north_m - north)),
        )
        found = outside_published_range(
            model.model,
            frequency_mhz=cell.frequency_mhz,
            base_height_m=cell.height_m,
            mobile_height_m=model.mobile_height_m,
            longest_distance_m=float(farthest_m),
        )
        notes.extend(f"cell {cell.id!r}: {note}" for note in found)
    return tuple(notes)


def _perturbed(cell: Cell, errors: RealityErrors) -> tuple[Cell, float]:
    eirp, azimuth, slope = named_rng(errors.seed, "reality", "offsets", cell.id).uniform(-1, 1, 3)
    azimuth_deg = cell.azimuth_deg
    if azimuth_deg is not None:
        azimuth_deg = (azimuth_deg + errors.azimuth_error_deg * azimuth) % 360.0
    real = replace(
        cell, eirp_dbm=cell.eirp_dbm + errors.eirp_error_db * eirp, azimuth_deg=azimuth_deg
    )
    return real, 1.0 + errors.slope_error * slope


def _clutter(
    plan: CellPlan, lattice: Lattice, model: PredictionModel
) -> Iterator[tuple[str, Floats32]]:
    return site_shadowing(
        plan, lattice, model.shadowing_db, model.shadowing_correlation_m, model.site_share,
        model.seed, stream="prediction",
    )  # fmt: skip
