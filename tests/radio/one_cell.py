"""The prediction of a single cell."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from mapfilter.lattice import Lattice
from mapfilter.propagation.models import PredictionModel
from mapfilter.propagation.predict import predict
from mapfilter.propagation.surroundings import Surroundings
from mapfilter.radio.antenna import MeasuredAntenna
from mapfilter.radio.cells import Cell, CellPlan


def predict_cell(
    cell: Cell,
    lattice: Lattice,
    heights_m: NDArray[np.float32] | None,
    model: PredictionModel,
    antennas: Mapping[str, MeasuredAntenna] | None = None,
) -> NDArray[np.float32]:
    """Predict the level of one cell."""
    plan = CellPlan(lattice.crs, (cell,))
    ((_, level_dbm),) = predict(plan, lattice, heights_m, model, antennas=antennas)
    return level_dbm


def predict_steep_cell(
    cell: Cell,
    lattice: Lattice,
    heights_m: NDArray[np.float32] | None,
    model: PredictionModel,
    slope_factor: float,
) -> NDArray[np.float32]:
    """Predict one cell without shadowing, whose loss per decade of distance is multiplied."""
    surroundings = Surroundings.of(lattice, heights_m, model)
    sight = surroundings.sight((cell.east_m, cell.north_m, cell.height_m))
    return surroundings.median_level_dbm(cell, slope_factor, sight).astype(np.float32)
