"""Whether check names a number that fills large parts of rasters, and nothing in its stead."""

import numpy as np
import pytest
from check_world import make_world
from command_line import mapfilter, settings

from mapfilter.check.fills import filling_number


@pytest.fixture
def world(tmp_path, levels):
    world = make_world(tmp_path, levels)
    world.landuse = None
    return world


def found_in(world, *given):
    world.write()
    return mapfilter("check", "-c", world.toml, "--json", *given).json["findings"]


def without_data(values, number):
    """A number beyond the middle of the raster, as beyond the radius of a prediction."""
    rows, cols = np.indices(values.shape)
    far = np.hypot(rows - values.shape[0] / 2, cols - values.shape[1] / 2) > 75
    return np.where(far, number, values)


@pytest.mark.parametrize(
    ("number", "severity"), [(-60.0, "error"), (-103.0, "error"), (-140.0, "note")]
)
def test_a_level_for_no_data(number, severity, world):
    world.each(lambda v: without_data(v, number))
    (finding,) = found_in(world)
    assert (finding["code"], finding["severity"]) == ("nodata-as-level", severity)
    assert finding["evidence"].startswith(f"{number:g} dBm fills up to 3")
    assert "of 10 of 10 rasters" in finding["evidence"]
    assert finding["remedy"].startswith(f"Set rasters.nodata = {number:g}, ")
    assert found_in(world, f"--set=rasters.nodata={number}") == []


def test_a_loss_for_no_data(world):
    eirp = {row["cell"]: float(row["eirp_dbm"]) for row in world.rows}
    world.levels = {i: without_data(eirp[i] - v, 100.0) for i, v in world.levels.items()}
    world.quantity = "loss"
    (finding,) = found_in(world)
    assert (finding["code"], finding["severity"]) == ("nodata-as-level", "error")
    assert "Set rasters.nodata = 100," in finding["remedy"]


def test_levels_that_end_at_a_weak_one(world):
    world.each(lambda v: np.maximum(v, -102.0))
    world.each(lambda v: np.where(v < np.quantile(v, 0.3), -102.0, v))
    (finding,) = found_in(world, *settings(database__floor_dbm=-110.0))
    assert finding["severity"] == "warning"
    assert "cut off" in finding["evidence"]
    assert "without a lower limit" in finding["remedy"]
    (finding,) = found_in(world)
    assert finding["severity"] == "warning"
    (finding,) = found_in(world, *settings(database__floor_dbm=-100.0))
    assert finding["severity"] == "note"


@pytest.mark.parametrize("decimals", [0, 1])
def test_rounded_levels_are_left_alone(decimals, world):
    world.each(lambda v: np.round(v, decimals))
    assert found_in(world) == []


def test_a_few_rasters_are_not_most(world):
    world.levels["S1A"] = without_data(world.levels["S1A"], -85.0)
    assert "nodata-as-level" not in {f["code"] for f in found_in(world)}


def test_of_few_pixels_or_one_number_nothing_is_told():
    assert filling_number(np.full(1000, -60, np.float32)) is None
    assert filling_number(np.repeat(np.float32([-60, -61]), [300, 50])) is None
    assert filling_number(np.repeat(np.float32([-60, -61]), [900, 100])) == (-60.0, 0.9)
