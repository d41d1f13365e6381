"""The small world and the database built of it, made once."""

import numpy as np
import pytest
from small_world import FLOOR_DBM, LATTICE, World, levels_of, make_plan, make_routes

from mapfilter.database.build import build
from mapfilter.radio.rasters import open_rasters, write_rasters


@pytest.fixture(scope="session")
def world(tmp_path_factory):
    plan = make_plan()
    path = tmp_path_factory.mktemp("rasters") / "rxlev.tif"
    items = list(levels_of(plan))
    write_rasters(path, LATTICE, iter(items), plan.ids)
    levels_dbm = np.stack([values for _, values in items])
    return World(plan, make_routes(), open_rasters(path), levels_dbm)


@pytest.fixture(scope="session")
def database(world, tmp_path_factory):
    out = tmp_path_factory.mktemp("built") / "database"
    return build(world.rasters, world.plan, world.routes, out, floor_dbm=FLOOR_DBM, tile_px=16)
