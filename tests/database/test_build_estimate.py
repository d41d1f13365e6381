"""Estimates of builds against the builds, on two made worlds of many tiles."""

import numpy as np
import pytest
import shapely

from mapfilter.database.build import build
from mapfilter.database.estimate import dry_run, peak_memory_bytes
from mapfilter.database.sources import LayerRoutes
from mapfilter.database.store import info
from mapfilter.lattice import Lattice
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.rasters.geotiff_writer import write_rasters
from mapfilter.rasters.opening import open_rasters
from mapfilter.roads.route_points import RouteSource
from mapfilter.roads.ways import Squares, Ways

CRS = "EPSG:32629"
TOLERANCE = 0.3


def rasters_and_plan(folder, size_px, cells, seed):
    lattice = Lattice(CRS, 500_000.0, 4_600_000.0, 5.0, size_px, size_px)
    rng = np.random.default_rng(seed)
    west, south, east, north = lattice.bounds_m
    places = rng.uniform((west, south), (east, north), (cells, 2))
    plan = CellPlan(
        CRS,
        tuple(
            Cell(f"C{n}", "S", x, y, 30.0, None, 50.0, 1800.0, antenna="omni")
            for n, (x, y) in enumerate(places.tolist())
        ),
    )
    centre = (np.arange(size_px) + 0.5) * 5.0
    items = []
    for cell in plan.cells:
        away = np.hypot(west + centre[None] - cell.east_m, (north - centre - cell.north_m)[:, None])
        noise = rng.normal(0, 3, away.shape)
        items.append((cell.id, -20 - 32 * np.log10(away + 10) + noise))
    write_rasters(folder / "r.tif", lattice, iter(items), plan.ids)
    return open_rasters(folder / "r.tif"), plan


def town(lattice, seed):
    """Streets that are dense in one corner and rare elsewhere, and a few squares."""
    rng = np.random.default_rng(seed)
    west, south, east, north = lattice.bounds_m
    spread = np.array([east - west, north - south])
    starts = (west, south) + spread * rng.beta(1, 3, (250, 2))
    lines = shapely.linestrings(np.stack([starts, starts + rng.normal(0, 150, (250, 2))], axis=1))
    middle = (west, south) + spread * rng.uniform(0.1, 0.9, (6, 2))
    squares = np.array([shapely.Point(*place).buffer(40) for place in middle])
    count = np.arange(len(lines))
    ways = Ways(
        CRS, count + 1, np.zeros(len(lines), np.int16), ("residential",), lines,
        np.zeros(len(lines), bool), np.zeros(len(lines), np.int8),
    )  # fmt: skip
    return RouteSource.of(ways, Squares(CRS, np.arange(6) + 1, squares))


@pytest.mark.parametrize(
    ("size_px", "cells", "seed", "floor_dbm"), [(600, 8, 1, -104), (700, 10, 2, -95)]
)
def test_an_estimate_is_within_30_percent_of_the_build(tmp_path, size_px, cells, seed, floor_dbm):
    rasters, plan = rasters_and_plan(tmp_path, size_px, cells, seed)
    routes = LayerRoutes(town(rasters.lattice, seed), rasters.lattice)
    options = {"tile_px": 64, "floor_dbm": floor_dbm}
    estimate = dry_run(rasters, plan, routes, **options)
    found = info(build(rasters, plan, routes, tmp_path / "db", **options))
    counts = found["counts"]
    points = sum(counts[name] for name in ("points", "points_below_floor", "points_without_level"))
    assert points > 5000
    assert estimate.points == pytest.approx(points, rel=TOLERANCE)
    assert estimate.levels == pytest.approx(found["levels"], rel=TOLERANCE)
    assert estimate.bytes == pytest.approx(found["bytes"], rel=TOLERANCE)
    assert estimate.memory_bytes >= peak_memory_bytes() * (1 - TOLERANCE)
