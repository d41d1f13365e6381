"""Rasters beside those of the cells: of terrain, of clutter."""

import numpy as np
import pytest
from check_world import make_world
from command_line import assert_refused, mapfilter


@pytest.fixture
def world(tmp_path, levels):
    world = make_world(tmp_path, levels)
    world.landuse = None
    height_m = np.random.default_rng(0).normal(140, 5, next(iter(levels.values())).shape)
    world.levels["dtm"] = np.round(height_m).astype(np.float32)
    world.levels["clutter"] = np.round(height_m).astype(np.float32) % 11 + 1
    world.write()
    return world


def test_they_are_told_as_such_and_not_by_their_numbers(world):
    """Heights are no path losses, and classes no RXLEV."""
    (finding,) = mapfilter("check", "-c", world.toml, "--json").json["findings"]
    assert finding["code"] == "raster-without-cell"
    assert "dtm" in finding["evidence"]
    assert "clutter" in finding["evidence"]
    assert "terrain or clutter" in finding["remedy"]


def test_a_build_says_what_to_do_with_them(world):
    outcome = mapfilter("build", "-c", world.toml)
    assert_refused(outcome, "found 'dtm', 'clutter'", "rasters of terrain or clutter: move these")


def test_where_no_raster_has_the_name_of_a_cell_all_are_judged(world):
    world.rename({name: f"{name}_level" for name in world.levels})
    world.write()
    found = mapfilter("check", "-c", world.toml, "--json").json["findings"]
    assert {"raster-without-cell", "loss-as-level"} <= {one["code"] for one in found}
