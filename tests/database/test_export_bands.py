"""Best servers, their levels and margins as a GeoTIFF: at points, and nothing beside them."""

import json

import numpy as np
import rasterio
from small_world import IDS, LATTICE

from mapfilter.database import export
from mapfilter.database.export import export_cog
from mapfilter.database.exported import CELLS_TAG


def test_the_bands_hold_the_values_of_the_points(database, tmp_path, monkeypatch):
    """Window by window: of 16 pixels, which divide neither side of the lattice."""
    monkeypatch.setattr(export, "_TILE_PX", 16)
    export_cog(database, tmp_path / "servers.tif")
    points = database.points()
    with rasterio.open(tmp_path / "servers.tif") as source:
        found, tags = source.read(), source.tags()
        assert (source.width, source.height) == (LATTICE.cols, LATTICE.rows)
        assert source.transform.to_gdal() == LATTICE.gdal_transform
    assert tuple(json.loads(tags[CELLS_TAG])) == IDS
    expected = np.full((3, LATTICE.rows, LATTICE.cols), np.nan)
    for band, values in enumerate((points.best_server, points.best_level_dbm, points.margin_db)):
        expected[band, points.row, points.col] = values
    np.testing.assert_allclose(found, expected, atol=1e-4)
    assert len(np.unique(points.best_server)) == 3
