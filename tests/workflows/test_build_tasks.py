"""How many tiles make a task for a worker on a cluster."""

import numpy as np

from mapfilter.geodesy import Lattice
from mapfilter.rasters.geotiff import write_rasters
from mapfilter.rasters.raster_set import open_rasters
from mapfilter.workflows.build import MOST_TILES_A_TASK, PIXELS_A_TASK, tiles_a_task

WHOLE = Lattice("EPSG:32632", 400_000.0, 5_600_000.0, 5.0, 64, 64)


def _rasters(folder, windows):
    folder.mkdir()
    for number, window in enumerate(windows):
        cell, part = f"C{number}", WHOLE.window(*window)
        level = np.full((part.rows, part.cols), -80.0)
        write_rasters(folder / f"{cell}.tif", part, [(cell, level)], [cell])
    return open_rasters(folder)


def test_cells_elsewhere_do_not_make_tasks_smaller(tmp_path):
    """Four cells with a quarter of the area each are read as one that covers all of it."""
    quarters = [(row, col, 32, 32) for row in (0, 32) for col in (0, 32)]
    apart = _rasters(tmp_path / "apart", quarters)
    whole = _rasters(tmp_path / "whole", [(0, 0, 64, 64)])
    tile_px = int((PIXELS_A_TASK / 10.5) ** 0.5)
    assert tiles_a_task(apart, tile_px) == tiles_a_task(whole, tile_px) == 10


def test_more_cells_at_each_place_make_tasks_smaller(tmp_path):
    rasters = _rasters(tmp_path / "four", [(0, 0, 64, 64)] * 4)
    tile_px = int((PIXELS_A_TASK / 10.5) ** 0.5)
    assert tiles_a_task(rasters, tile_px) == 2


def test_tasks_hold_a_tile_at_least_and_not_too_many(tmp_path):
    rasters = _rasters(tmp_path / "one", [(0, 0, 64, 64)])
    assert tiles_a_task(rasters, 100_000) == 1
    assert tiles_a_task(rasters, 8) == MOST_TILES_A_TASK
