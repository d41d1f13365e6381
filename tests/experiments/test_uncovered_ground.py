"""Ground that a road raster does not cover (255) is not forbidden to the filter."""

import numpy as np
import pytest
import rasterio

from mapfilter.experiments.recorded import kitti
from mapfilter.experiments.recorded.locating import OpenMap
from mapfilter.models.street_motion import EAST, NORTH, OFF, interpolate, weigh_by_map
from mapfilter.positioning.bayes.options import BayesFilter

WEST, NORTH_EDGE, SIZE = 455_000.0, 5_430_000.0, 400
CRS = "EPSG:32632"


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
    """The log weight of a hypothesis that drives on beyond the road's end."""
    kitti.prepare(folder, tmp_path)
    options = BayesFilter(vehicle=True)
    model = OpenMap.open(tmp_path / "map").filter_of(options, alone=False).model
    state = np.zeros((8, 1), dtype=np.float32)
    log_map, weight = model.log_map, np.zeros(1)
    rows, step = model.area.lattice.rows, model.area.lattice.resolution_m
    for along_m in np.arange(100.0, last_m, 5.0):
        state[EAST], state[NORTH] = along_m, SIZE - 200.5
        found = interpolate(state, log_map, step / 2, (rows - 0.5) * step, 1 / step)
        state[OFF] = 1 - (1 - state[OFF]) * np.exp(-model.weights.leave_per_m * 5.0)
        weigh_by_map(found, state[OFF], model.weights.over(5.0), weight)
    return float(-weight[0])


@pytest.mark.parametrize("rest", [255, 0])
def test_a_hypothesis_lives_on_beyond_the_covered_ground(tmp_path, rest):
    folder = _raster(tmp_path / "data", rest)
    on_road = _cost_nats(folder, tmp_path / "near", 195.0)
    beyond = _cost_nats(folder, tmp_path / "far", 330.0)
    # 135 m off at 0.15 nats a metre, and once the odds of leaving the map.
    assert on_road < 0.5
    assert 15.0 < beyond < 35.0
