"""The ground truth is drawn apart from the prediction, even when both have the same seed."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from mapfilter.lattice import Lattice
from mapfilter.propagation.models import GroundTruthErrors, PredictionModel
from mapfilter.propagation.predict import predict, simulate_ground_truth
from mapfilter.radio.cells import Cell, CellPlan

LATTICE = Lattice("EPSG:32635", 385000.0, 6673000.0, 10.0, 80, 80)
PLAN = CellPlan(
    "EPSG:32635",
    tuple(
        Cell(f"{site}{i}", site, 385400.0, 6672600.0, 30.0, None, 50.0, 1800.0, "omni")
        for site in "AB"
        for i in range(2)
    ),
)
SEEDS = range(25)
MODEL = PredictionModel(model="cost231_hata", shadowing_db=6.0, shadowing_correlation_m=50.0)
ERRORS = GroundTruthErrors(
    level_error_db=7.0,
    eirp_error_db=0.0,
    azimuth_error_deg=0.0,
    slope_error=0.0,
    clutter="shared",
)

Fields = NDArray[np.float64]


@pytest.fixture(scope="module")
def fields() -> tuple[Fields, Fields]:
    """Clutter of the prediction and error of the ground truth, shape (seeds, cells, rows, cols)."""
    plain = dict(predict(PLAN, LATTICE, None, replace(MODEL, shadowing_db=0.0)))
    clutter, error = [], []
    for seed in SEEDS:
        model, errors = replace(MODEL, seed=seed), replace(ERRORS, seed=seed)
        predicted = dict(predict(PLAN, LATTICE, None, model))
        real = dict(simulate_ground_truth(PLAN, LATTICE, None, model, errors))
        clutter.append([predicted[cell] - plain[cell] for cell in PLAN.ids])
        error.append([real[cell] - predicted[cell] for cell in PLAN.ids])
    return np.array(clutter, dtype=np.float64), np.array(error, dtype=np.float64)


def _interval(samples: Fields) -> tuple[float, float]:
    """Return the mean and four of its standard errors."""
    return float(samples.mean()), 4.0 * float(samples.std(ddof=1)) / np.sqrt(samples.size)


def test_the_error_has_the_stated_deviation(fields: tuple[Fields, Fields]) -> None:
    _, error = fields
    mean, off = _interval((error**2).mean(axis=(1, 2, 3)))
    assert abs(mean - 7.0**2) < off
    assert off < 7.0


def test_the_error_is_not_correlated_with_the_predictions_clutter(
    fields: tuple[Fields, Fields],
) -> None:
    clutter, error = fields
    mean, off = _interval((clutter * error).mean(axis=(1, 2, 3)) / (6.0 * 7.0))
    assert abs(mean) < off
    assert off < 0.1
