"""Predicts the levels of cells, and simulates the ground truth that predictions are tested against.

The prediction of a cell is EIRP + antenna gain - path loss + shadowing, at street height; a raster
of building heights decides where there is line of sight and how high the roofs are.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from mapfilter._parallel import Progress
from mapfilter._types import Floats32
from mapfilter.errors import Faults, InputError
from mapfilter.lattice import Lattice
from mapfilter.propagation.models import GroundTruthErrors, PredictionModel
from mapfilter.propagation.shadowing import correlated_field, named_rng, site_shadowing
from mapfilter.propagation.surroundings import Antennas, Surroundings
from mapfilter.radio.cell_rules import ANTENNAS
from mapfilter.radio.cells import Cell, CellPlan

_ROUND_DB = 3.0
_BLOCK_M = 60.0


def predict(
    plan: CellPlan,
    lattice: Lattice,
    heights_m: Floats32 | None,
    model: PredictionModel,
    progress: Progress | None = None,
    *,
    antennas: Antennas | None = None,
) -> Iterator[tuple[str, Floats32]]:
    """Predict the level of every cell at every pixel's centre, one cell at a time.

    Parameters
    ----------
    plan : CellPlan
        Brought into the lattice's CRS where it is in another.
    heights_m : ndarray of float32, shape (rows, cols), or None
        Heights of buildings above ground, 0 where there is none. Without them every roof has the
        model's default height, and there is no line of sight or, with TR 38.901, the probability of
        its table.
    progress : callable, optional
        Called with (cells done, cells in all).
    antennas : mapping of str to MeasuredAntenna, optional
        The antennas that cells name, see :func:`mapfilter.radio.msi.read_antennas`.

    Yields
    ------
    (str, ndarray of float32, shape (rows, cols))
        Cell id and level in dBm, at the model's mobile height, outdoors; in the plan's order.

    Raises
    ------
    InputError
        The heights do not fit the lattice, or an antenna is not there.
    """
    plan = plan.to_crs(lattice.crs)
    _check_antennas(plan, antennas)
    surroundings = Surroundings.of(lattice, heights_m, model, antennas)
    fields = [_clutter(plan, lattice, model)]
    yield from _levels(plan, surroundings, fields, lambda cell: (cell, 1.0), 0.0, progress)


def simulate_ground_truth(
    plan: CellPlan,
    lattice: Lattice,
    heights_m: Floats32 | None,
    model: PredictionModel,
    errors: GroundTruthErrors,
    progress: Progress | None = None,
    *,
    antennas: Antennas | None = None,
) -> Iterator[tuple[str, Floats32]]:
    """Simulate the ground truth: true levels that differ from the prediction.

    A filter must not be evaluated on its own prediction. EIRP, azimuth and path-loss slope of each
    cell have uniformly drawn errors; shadowing that is independent of the prediction's is added;
    propagation model, street widths and roofs may differ. Every draw depends on the seed and on
    names only: adding a cell changes no other.

    Parameters
    ----------
    plan, lattice, heights_m, model, progress, antennas
        As for :func:`predict`, and the same as the prediction was made with.

    Yields
    ------
    (str, ndarray of float32, shape (rows, cols))
        As :func:`predict`.

    Raises
    ------
    InputError
        The heights do not fit the lattice, or an antenna is not there.
    ConfigError
        The ground truth's propagation model is not possible.
    """
    plan = plan.to_crs(lattice.crs)
    _check_antennas(plan, antennas)
    true_model = errors.truth_of(model)
    if heights_m is not None and errors.roof_error != 0:
        rng = named_rng(errors.seed, "reality", "roofs")
        factor = np.exp(correlated_field(lattice, errors.roof_error, _BLOCK_M, rng))
        heights_m = np.asarray(heights_m * factor, dtype=np.float32)
    surroundings = Surroundings.of(lattice, heights_m, true_model, antennas)
    if errors.clutter == "shared":
        clutter = _clutter(plan, lattice, model)
    else:
        clutter = _clutter(plan, lattice, replace(model, seed=errors.seed), "reality clutter")
    fields = [clutter, _shadowing(plan, lattice, errors)]

    def perturbed(cell: Cell) -> tuple[Cell, float]:
        rng = named_rng(errors.seed, "reality", "offsets", cell.id)
        eirp, azimuth, slope = rng.uniform(-1, 1, 3)
        azimuth_deg = cell.azimuth_deg
        if azimuth_deg is not None:
            azimuth_deg = (azimuth_deg + errors.azimuth_error_deg * azimuth) % 360.0
        eirp_dbm = cell.eirp_dbm + errors.eirp_error_db * eirp
        real = replace(cell, eirp_dbm=eirp_dbm, azimuth_deg=azimuth_deg)
        return real, 1.0 + errors.slope_error * slope

    yield from _levels(plan, surroundings, fields, perturbed, errors.offset_db, progress)


def _levels(
    plan: CellPlan,
    surroundings: Surroundings,
    fields: list[Iterator[Floats32]],
    perturbed: Callable[[Cell], tuple[Cell, float]],
    offset_db: float,
    progress: Progress | None,
) -> Iterator[tuple[str, Floats32]]:
    """Yield each cell's id and level: its median level and, added to it, what was drawn."""
    sights = surroundings.sights(plan)
    for done, (cell, sight, *drawn) in enumerate(
        zip(plan.cells, sights, *fields, strict=True), start=1
    ):
        level_dbm = surroundings.median_level_dbm(*perturbed(cell), sight) + offset_db
        for field_db in drawn:
            level_dbm = level_dbm + field_db
        if progress is not None:
            progress(done, len(plan))
        yield cell.id, np.asarray(level_dbm, dtype=np.float32)


def _clutter(
    plan: CellPlan, lattice: Lattice, model: PredictionModel, stream: str = "prediction"
) -> Iterator[Floats32]:
    drawn = (model.shadowing_db, model.shadowing_correlation_m, model.site_share, model.seed)
    for _, field_db in site_shadowing(plan, lattice, *drawn, stream=stream):
        yield field_db


def _shadowing(plan: CellPlan, lattice: Lattice, errors: GroundTruthErrors) -> Iterator[Floats32]:
    """Draw the ground truth's shadowing of each cell: a part that lasts, and a local one."""
    parts = (
        (1.0 - errors.local_share, errors.correlation_m, "reality"),
        (errors.local_share, errors.local_correlation_m, "reality local"),
    )
    fields = []
    for share, correlation_m, stream in parts:
        if share > 0:
            drawn = (errors.level_error_db * share**0.5, correlation_m, errors.site_share)
            fields.append(site_shadowing(plan, lattice, *drawn, errors.seed, stream=stream))
    for both in zip(*fields, strict=True):
        yield np.sum([field_db for _, field_db in both], axis=0, dtype=np.float32)


def _check_antennas(plan: CellPlan, antennas: Antennas | None) -> None:
    """Check that every antenna is there, and that those that point have an azimuth."""
    faults = Faults()
    for cell in plan.cells:
        if cell.antenna in ANTENNAS:
            continue
        where = f"cell {cell.id!r}, antenna"
        measured = (antennas or {}).get(cell.antenna)
        if measured is None:
            expected = f"{', '.join(ANTENNAS)}, or a pattern that was read"
            faults.add(where, expected, repr(cell.antenna), "misspelt, or no folder of antennas")
        elif cell.azimuth_deg is None and np.ptp(measured.horizontal_loss_db) > _ROUND_DB:
            expected = "an azimuth, as the antenna is not alike all around"
            faults.add(f"cell {cell.id!r}, azimuth_deg", expected, "nothing")
    faults.raise_if_any(InputError)
