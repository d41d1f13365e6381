"""One network in several forms makes one database: files, numbers, and the order of cells."""

import numpy as np
import pandas as pd
import pytest
import rasterio
from small_world import FLOOR_DBM, IDS, LATTICE, levels_of, make_plan

from mapfilter.database.build import build
from mapfilter.rasters.geotiff_writer import write_rasters
from mapfilter.rasters.opening import open_rasters


def built(world, rasters, folder, plan=None):
    return build(
        rasters, plan or world.plan, world.routes, folder / "db", floor_dbm=FLOOR_DBM, tile_px=16
    )


def parts_of(database):
    """All bytes but those of the manifest, which tells of the inputs."""
    files = database.path.rglob("*.parquet")
    return {path.relative_to(database.path): path.read_bytes() for path in files}


def a_file_for_each_cell(world, folder):
    for values, cell in zip(world.levels_dbm, IDS, strict=True):
        write_rasters(folder / f"{cell}.tif", LATTICE, iter([(cell, values)]), [cell])
    return open_rasters(folder)


def text_of_planners(world, folder):
    west, south, _, _ = LATTICE.bounds_m
    head = f"ncols {LATTICE.cols}\nnrows {LATTICE.rows}\nxllcorner {west}\nyllcorner {south}\n"
    for values, cell in zip(world.levels_dbm, IDS, strict=True):
        rows = np.where(np.isnan(values), -9999, values)
        lines = "\n".join(" ".join(f"{one:.2f}" for one in row) for row in rows)
        text = f"{head}cellsize 5\nNODATA_value -9999\n{lines}\n"
        (folder / f"{cell}.asc").write_text(text)
    return open_rasters(folder, "level", crs=LATTICE.crs)


def hundredths(world, folder):
    stored = np.where(np.isnan(world.levels_dbm), -32768, np.round(world.levels_dbm * 100))
    with rasterio.open(world.rasters.path) as file:
        profile = {"crs": file.crs, "transform": file.transform}
    shape = {"count": len(IDS), "height": LATTICE.rows, "width": LATTICE.cols}
    path = folder / "hundredths.tif"
    with rasterio.open(path, "w", **profile, **shape, dtype="int16", nodata=-32768) as file:
        file.write(stored.astype(np.int16))
        file.descriptions = IDS
    return open_rasters(path, "level", factor=0.01)


@pytest.mark.parametrize("form", [a_file_for_each_cell, text_of_planners, hundredths])
def test_rasters_of_any_form_make_the_same_bytes(world, database, tmp_path, form):
    (tmp_path / "in").mkdir()
    found = built(world, form(world, tmp_path / "in"), tmp_path)
    assert parts_of(found) == parts_of(database)


@pytest.mark.parametrize("order", [(2, 0, 1), (2, 1, 0)])
def test_the_order_of_cells_changes_no_point(world, database, tmp_path, order):
    plan = make_plan()
    turned = type(plan)(plan.crs, tuple(plan.cells[i] for i in order))
    items = list(levels_of(plan))
    names = [IDS[i] for i in order]
    write_rasters(tmp_path / "rxlev.tif", LATTICE, iter(items[i] for i in order), names)
    found = built(world, open_rasters(tmp_path / "rxlev.tif"), tmp_path, turned)
    assert found.plan.ids == tuple(names)
    for cell in IDS:
        for one, other in zip(found.cell_points(cell), database.cell_points(cell), strict=True):
            np.testing.assert_array_equal(one, other)
    points = [pd.read_parquet(one.path / "points.parquet") for one in (found, database)]
    pd.testing.assert_frame_equal(*points, check_exact=True, check_categorical=False)
