"""Ground that a road raster does not cover (255) is not forbidden to the filter."""

from dataclasses import replace

import numpy as np
import pytest
import rasterio

from mapfilter.experiments.recorded import kitti
from mapfilter.experiments.recorded.locating import OpenMap
from mapfilter.filters.contract import MotionStep
from mapfilter.models.street_motion import EAST, NORTH, STATES
from mapfilter.positioning.bayes.options import BayesFilter

WEST, NORTH_EDGE, SIZE = 455_000.0, 5_430_000.0, 400
CRS = "EPSG:32632"
STEP_M = 5.0


def _raster(folder, rest):
    """A road from west to east that ends in the middle of a square; the rest is of one value."""
    values = np.zeros((SIZE, SIZE), dtype=np.uint8)
    values[200, :200] = 1
    values[:, 230:] = rest
    (folder / "truth").mkdir(parents=True)
    profile = {
        "driver": "GTiff",
        "height": SIZE,
        "width": SIZE,
        "count": 1,
        "dtype": "uint8",
        "crs": CRS,
        "transform": rasterio.Affine(1, 0, WEST, 0, -1, NORTH_EDGE),
    }
    with rasterio.open(folder / "roads.tif", "w", **profile) as target:
        target.write(values, 1)
    return folder


def _cost_nats(folder, tmp_path, last_m):
    """The log weight of a hypothesis that drives on, without errors, beyond the road's end."""
    kitti.prepare(folder, tmp_path)
    options = BayesFilter(vehicle=True)
    model = OpenMap.open(tmp_path / "map").filter_of(options, alone=False).model
    names = ("step_sd_m", "heading_sd_rad", "stretch_sd", "disturbances_per_m")
    drifts = ("bias_drift_rad_per_sqrt_m", "scale_drift_per_sqrt_m", "rate_rad_per_m")
    exact = replace(model.motion, **dict.fromkeys((*names, *drifts), 0.0))
    model = replace(model, motion=exact)
    state, log_weight = np.zeros((STATES, 1), dtype=np.float32), np.zeros(1)
    state[EAST], state[NORTH] = 100.0, SIZE - 200.5
    for key in range(int((last_m - 100.0) / STEP_M)):
        step = MotionStep(STEP_M, 0.0, np.nan)
        state, log_weight = model.move(state, log_weight, step, np.uint64(key))
    assert state[EAST, 0] == pytest.approx(last_m, abs=STEP_M)
    return float(-log_weight[0])


@pytest.mark.parametrize("rest", [255, 0])
def test_a_hypothesis_lives_on_beyond_the_covered_ground(tmp_path, rest):
    folder = _raster(tmp_path / "data", rest)
    on_road = _cost_nats(folder, tmp_path / "near", 195.0)
    beyond = _cost_nats(folder, tmp_path / "far", 330.0)
    # 135 m off at 0.15 nats a metre, and once the odds of leaving the map.
    assert on_road < 0.5
    assert 15.0 < beyond < 35.0
