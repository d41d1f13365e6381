"""Layers of an exported database: points, cells, and the levels of some cells."""

import geopandas
import numpy as np
import pandas as pd
import pyogrio
import pytest
import shapely
from small_world import CRS, IDS, LATTICE

from mapfilter.database.export import export_geopackage, write_layers
from mapfilter.errors import InputError, OutputError


@pytest.fixture(scope="module")
def layers(database, tmp_path_factory):
    path = tmp_path_factory.mktemp("export") / "db.gpkg"
    export_geopackage(database, path, cells=IDS[:2])
    names = [name for name, _ in pyogrio.list_layers(path)]
    return {name: geopandas.read_file(path, layer=name) for name in names}


def test_layers_and_their_names(layers):
    assert list(layers) == ["points", "cells", f"cell {IDS[0]}", f"cell {IDS[1]}"]
    assert {frame.crs.to_string() for frame in layers.values()} == {CRS}


def test_points_are_in_order_with_all_that_is_known_of_them(database, layers):
    frame, points = layers["points"], database.points()
    for name in ("point", "row", "col", "way_id", "on_square", "distance_to_way_m"):
        np.testing.assert_array_equal(frame[name], getattr(points, name))
    for name in ("best_level_dbm", "margin_db"):
        np.testing.assert_array_equal(frame[name].astype("f4"), getattr(points, name))
    codes, classes = points.way_class
    assert frame["way_class"].tolist() == [classes[code] for code in codes]
    assert frame["best_server"].tolist() == [IDS[number] for number in points.best_server]
    east, north = LATTICE.east_north(points.row, points.col)
    np.testing.assert_array_equal(shapely.get_coordinates(frame.geometry), np.c_[east, north])


def test_cells_have_their_places_and_no_empty_columns(database, layers):
    frame = layers["cells"]
    assert frame["id"].tolist() == list(IDS)
    places = [(cell.east_m, cell.north_m) for cell in database.plan.cells]
    np.testing.assert_array_equal(shapely.get_coordinates(frame.geometry), places)
    # No cell of the plan has an azimuth: a column without a value is left out.
    assert "azimuth_deg" not in frame.columns
    assert frame["frequency_mhz"].tolist() == [1800.0] * 3


@pytest.mark.parametrize("cell", IDS[:2])
def test_levels_of_a_cell_are_those_within_the_margin(database, layers, cell):
    frame = layers[f"cell {cell}"]
    row, col, level_dbm = database.cell_points(cell)
    np.testing.assert_array_equal(frame["row"], row)
    np.testing.assert_array_equal(frame["col"], col)
    np.testing.assert_array_equal(frame["level_dbm"].astype("f4"), level_dbm)
    expected = np.c_[LATTICE.east_north(row, col)]
    np.testing.assert_array_equal(shapely.get_coordinates(frame.geometry), expected)
    assert len(row) < len(database.cell_points(cell, np.inf)[0])


def test_names_and_cells_that_cannot_be_exported(database, tmp_path):
    with pytest.raises(OutputError, match=r"ends in .gpkg, found no suffix"):
        export_geopackage(database, tmp_path / "points")
    with pytest.raises(InputError):
        export_geopackage(database, tmp_path / "db.gpkg", cells=("X",))
    assert list(tmp_path.iterdir()) == []


def test_layers_that_cannot_be_written_leave_no_file(tmp_path):
    place = [shapely.Point(1.0, 2.0)]
    odd = geopandas.GeoDataFrame({"value": pd.Series([1 + 2j])}, geometry=place, crs=CRS)
    before = pyogrio.get_gdal_config_option("OGR_CURRENT_DATE")
    with pytest.raises(Exception):  # noqa: B017, PT011 - whichever library refuses it
        write_layers({"odd": odd}, tmp_path / "odd.gpkg")
    assert not (tmp_path / "odd.gpkg").exists()
    assert pyogrio.get_gdal_config_option("OGR_CURRENT_DATE") == before


def test_rows_that_a_geopackage_refuses_are_an_error_of_the_output(tmp_path):
    """Of two rows with one number."""
    twice = {"fid": [1, 1], "value": [2.0, 3.0]}
    layer = geopandas.GeoDataFrame(twice, geometry=[shapely.Point(1.0, 2.0)] * 2, crs=CRS)
    with pytest.raises(OutputError, match="a place that can be written") as caught:
        write_layers({"twice": layer}, tmp_path / "twice.gpkg")
    assert caught.value.faults[0].where == str(tmp_path / "twice.gpkg")
    assert list(tmp_path.iterdir()) == []
