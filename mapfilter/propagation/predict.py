"""Predicts how every cell is received, and simulates the ground truth that it is tested against.

The prediction of a cell is EIRP + antenna gain - path loss + shadowing, at street height; where a
raster of building heights is given it decides who sees the antenna and how high the roofs are.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from mapfilter._parallel import Progress
from mapfilter._types import Floats32
from mapfilter.errors import Faults, InputError
from mapfilter.geodesy import Lattice
from mapfilter.propagation.line_of_sight import Surroundings, views_of
from mapfilter.propagation.models import (
    GroundTruthErrors,
    PredictionModel,
    outside_published_range,
    shortest_distance_m,
)
from mapfilter.propagation.shadowing import correlated_field, named_rng, site_shadowing
from mapfilter.radio.antenna import MeasuredAntenna
from mapfilter.radio.cell_rules import ANTENNAS
from mapfilter.radio.cells import Cell, CellPlan

__all__ = [
    "GroundTruthErrors",
    "PredictionModel",
    "off_frequency",
    "outside_validity",
    "predict",
    "predict_cell",
    "realise",
]

Antennas = Mapping[str, MeasuredAntenna]

_MOST_NAMED = 3
_ROUND_DB = 3.0
_NEAR_FREQUENCY = 0.2
_BLOCK_M = 60.0


def predict_cell(
    cell: Cell,
    lattice: Lattice,
    heights_m: Floats32 | None,
    model: PredictionModel,
    *,
    slope_factor: float = 1.0,
    antennas: Antennas | None = None,
) -> Floats32:
    """Predict the level of one cell at every pixel's centre.

    Parameters
    ----------
    cell : Cell
        With its position in the lattice's CRS.
    lattice : Lattice
    heights_m : ndarray of float32, shape (rows, cols), or None
        Heights of buildings above ground, 0 where there is none. Without them every roof has the
        model's default height, and nobody sees an antenna or, with TR 38.901, as probably as its
        table says.
    model : PredictionModel
    slope_factor : float
        Multiplies the path loss per decade of distance; the loss at 100 m stays.
    antennas : mapping of str to MeasuredAntenna, optional
        The antennas that cells name, see :func:`mapfilter.radio.msi.read_antennas`.

    Returns
    -------
    ndarray of float32, shape (rows, cols)
        dBm, at the model's mobile height, outdoors.

    Raises
    ------
    InputError
        The heights do not fit the lattice, or the cell's antenna is not there.
    """
    plan = CellPlan(lattice.crs, (cell,))
    _check_antennas(plan, antennas)
    surroundings = Surroundings.of(lattice, heights_m, model, antennas)
    ((_, clutter_db),) = _clutter(plan, lattice, model)
    level_dbm = surroundings.median_level_dbm(cell, surroundings.sight(cell), slope_factor)
    return np.asarray(level_dbm + clutter_db, dtype=np.float32)


def predict(
    plan: CellPlan,
    lattice: Lattice,
    heights_m: Floats32 | None,
    model: PredictionModel,
    progress: Progress | None = None,
    *,
    antennas: Antennas | None = None,
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
    antennas : mapping of str to MeasuredAntenna, optional
        The antennas that cells name.

    Yields
    ------
    (str, ndarray of float32, shape (rows, cols))
        Cell id and level in dBm, in the plan's order.

    Raises
    ------
    InputError
        The heights do not fit the lattice, or an antenna is not there.
    """
    plan = plan.to_crs(lattice.crs)
    _check_antennas(plan, antennas)
    surroundings = Surroundings.of(lattice, heights_m, model, antennas)
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
    errors: GroundTruthErrors,
    progress: Progress | None = None,
    *,
    antennas: Antennas | None = None,
) -> Iterator[tuple[str, Floats32]]:
    """Simulate the ground truth: how the cells of a prediction are really received.

    No filter is to be judged on its own prediction. EIRP, azimuth and path-loss slope of each cell
    are off by uniformly drawn amounts; shadowing that is independent of the prediction's is added;
    propagation model, street widths and roofs may differ. Every draw depends on the seed and on
    names only: adding a cell changes no other.

    Parameters
    ----------
    plan, lattice, heights_m, model, progress, antennas
        As for :func:`predict`, and the same as the prediction was made with.
    errors : GroundTruthErrors

    Yields
    ------
    (str, ndarray of float32, shape (rows, cols))
        Cell id and level in dBm, in the plan's order.

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
    true_heights_m = _true_heights_m(heights_m, lattice, errors)
    surroundings = Surroundings.of(lattice, true_heights_m, true_model, antennas)
    views = views_of(plan, surroundings)
    shared = errors.clutter == "shared"
    stream = "prediction" if shared else "reality clutter"
    clutter_of = model if shared else replace(model, seed=errors.seed)
    clutter = _clutter(plan, lattice, clutter_of, stream)
    wrong = _shadowing(plan, lattice, errors)
    for done, (cell, seen, (cell_id, clutter_db), error_db) in enumerate(
        zip(plan.cells, views, clutter, wrong, strict=True), start=1
    ):
        real, slope_factor = _perturbed(cell, errors)
        level_dbm = surroundings.median_level_dbm(real, seen, slope_factor) + errors.offset_db
        if progress is not None:
            progress(done, len(plan))
        yield cell_id, np.asarray(level_dbm + clutter_db + error_db, dtype=np.float32)


def _shadowing(plan: CellPlan, lattice: Lattice, errors: GroundTruthErrors) -> Iterator[Floats32]:
    """Draw the ground truth's shadowing of each cell: a part that lasts, and a local one."""
    parts = (
        (1.0 - errors.local_share, errors.correlation_m, "reality"),
        (errors.local_share, errors.local_correlation_m, "reality local"),
    )
    fields = [
        site_shadowing(
            plan, lattice, errors.level_error_db * share**0.5, correlation_m, errors.site_share,
            errors.seed, stream=stream,
        )
        for share, correlation_m, stream in parts
        if share > 0
    ]  # fmt: skip
    for drawn in zip(*fields, strict=True):
        yield np.sum([field_db for _, field_db in drawn], axis=0, dtype=np.float32)


def _true_heights_m(
    heights_m: Floats32 | None, lattice: Lattice, errors: GroundTruthErrors
) -> Floats32 | None:
    if heights_m is None or errors.roof_error == 0:
        return heights_m
    rng = named_rng(errors.seed, "reality", "roofs")
    factor = np.exp(correlated_field(lattice, errors.roof_error, _BLOCK_M, rng))
    return np.asarray(heights_m * factor, dtype=np.float32)


def outside_validity(plan: CellPlan, lattice: Lattice, model: PredictionModel) -> tuple[str, ...]:
    """Tell what of a prediction lies outside the model's published range, and for which cells."""
    alike: dict[tuple[float, float], list[Cell]] = defaultdict(list)
    for cell in plan.to_crs(lattice.crs).cells:
        alike[cell.frequency_mhz, cell.height_m].append(cell)
    ids: dict[str, list[str]] = defaultdict(list)
    for (frequency_mhz, height_m), cells in alike.items():
        reach = np.array([_distances_m(cell, lattice) for cell in cells])
        notes = outside_published_range(
            model.model,
            frequency_mhz=frequency_mhz,
            base_height_m=height_m,
            mobile_height_m=model.mobile_height_m,
            longest_distance_m=round(reach[:, 1].max()),
            nearest_distance_m=max(round(reach[:, 0].min()), shortest_distance_m(model)),
        )
        for note in notes:
            ids[note].extend(cell.id for cell in cells)
    return tuple(f"{_named(names)}: {note}" for note, names in ids.items())


def off_frequency(plan: CellPlan, antennas: Antennas) -> tuple[str, ...]:
    """Tell which cells send far from the frequency at which their antenna was measured."""
    ids: dict[str, list[str]] = defaultdict(list)
    for cell in plan.cells:
        measured = antennas.get(cell.antenna)
        if measured is None or measured.frequency_mhz is None:
            continue
        if abs(cell.frequency_mhz / measured.frequency_mhz - 1) > _NEAR_FREQUENCY:
            ids[f"antenna {cell.antenna!r} was measured at {measured.frequency_mhz:g} MHz"].append(
                cell.id
            )
    return tuple(f"{_named(names)}: {note}" for note, names in ids.items())


def _distances_m(cell: Cell, lattice: Lattice) -> tuple[float, float]:
    """Return how far the nearest and the farthest place of a lattice are from a cell."""
    west, south, east, north = lattice.bounds_m
    beside_m = max(west - cell.east_m, 0.0, cell.east_m - east)
    below_m = max(south - cell.north_m, 0.0, cell.north_m - north)
    across_m = max(abs(cell.east_m - west), abs(cell.east_m - east))
    along_m = max(abs(cell.north_m - south), abs(cell.north_m - north))
    return float(np.hypot(beside_m, below_m)), float(np.hypot(across_m, along_m))


def _named(ids: list[str]) -> str:
    if len(ids) == 1:
        return f"cell {ids[0]!r}"
    shown = ", ".join(repr(name) for name in ids[:_MOST_NAMED])
    return f"{len(ids)} cells ({shown}{', …' if len(ids) > _MOST_NAMED else ''})"


def _check_antennas(plan: CellPlan, antennas: Antennas | None) -> None:
    """See that every antenna is there, and that those that point have an azimuth."""
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


def _perturbed(cell: Cell, errors: GroundTruthErrors) -> tuple[Cell, float]:
    eirp, azimuth, slope = named_rng(errors.seed, "reality", "offsets", cell.id).uniform(-1, 1, 3)
    azimuth_deg = cell.azimuth_deg
    if azimuth_deg is not None:
        azimuth_deg = (azimuth_deg + errors.azimuth_error_deg * azimuth) % 360.0
    real = replace(
        cell, eirp_dbm=cell.eirp_dbm + errors.eirp_error_db * eirp, azimuth_deg=azimuth_deg
    )
    return real, 1.0 + errors.slope_error * slope


def _clutter(
    plan: CellPlan, lattice: Lattice, model: PredictionModel, stream: str = "prediction"
) -> Iterator[tuple[str, Floats32]]:
    return site_shadowing(
        plan, lattice, model.shadowing_db, model.shadowing_correlation_m, model.site_share,
        model.seed, stream=stream,
    )  # fmt: skip
