"""``mapfilter bound``: a small made city from its database to raster, tables and pictures."""

from dataclasses import fields, replace
from pathlib import Path
from types import SimpleNamespace

import geopandas
import numpy as np
import pandas as pd
import pytest
import rasterio
from command_line import assert_done, assert_refused, mapfilter

import mapfilter as mf
from mapfilter.evaluation.map_bound import BANDS
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.workflows.bound import LAYERS_NOTE, NOTES, BoundResult, _summary

DOCS = Path(__file__).parents[2] / "docs"

FILES = {
    "bound.gpkg",
    "bound.tif",
    "ways.parquet",
    "twins.parquet",
    "position-bound.png",
    "metres-to-fix.png",
    "twins.png",
}


@pytest.fixture(scope="module")
def database(tmp_path_factory):
    folder = tmp_path_factory.mktemp("town")
    settings = ["area.map=synthetic", "area.size_m=700,700", "cells.indoor=1"]
    settings += ["output.pictures=none", f"output.dir={folder}"]
    given = [word for setting in settings for word in ("--set", setting)]
    assert_done(mapfilter("predict", *given))
    assert_done(mapfilter("build", *given))
    return folder / "database"


def test_several_layers_are_noted():
    cell = Cell("A", "S", 0.0, 0.0, 30.0, None, 30.0, 900.0, "omni", technology="GSM")
    other = replace(cell, id="B", technology="LTE", arfcn=1300)
    found = SimpleNamespace(
        fix=SimpleNamespace(
            start=np.zeros(1), levels_m=np.ones(1), cells_m=np.ones(1), cells_bits=np.ones(1),
            levels_bits=np.ones(1), right=np.ones(1, bool), twin_error=np.ones(1),
        ),
        options=SimpleNamespace(path_m=1.0, most_m=9.0),
        radio=Radio(),
        position=SimpleNamespace(plane_m=np.ones(1), along_m=np.ones(1)),
        distinct=SimpleNamespace(cell_bits=np.ones(1), level_bits=np.ones(1)),
    )  # fmt: skip
    for cells, noted in (((cell,), False), ((cell, other), True)):
        result = _summary(found, CellPlan("EPSG:32631", cells), 0.0, ())
        assert (LAYERS_NOTE in result.notes) is noted


class Radio:
    """A map of one point."""

    cell_ids, way_id = ("A",), np.ones(1)

    def __len__(self):
        return 1


def test_a_database_is_bound(database, tmp_path):
    found = assert_done(mapfilter("bound", database, "--out", tmp_path / "b", "--json")).json
    assert {path.name for path in (tmp_path / "b").iterdir()} == FILES
    assert found["points"] > 3000
    assert 0 < found["along_bound_m"] < found["plane_bound_m"] < 700
    assert 0 < found["levels_to_fix_m"] < 1500
    assert 0 <= found["levels_wrong"] < 0.1
    assert sum(note.startswith("exact") for note in found["notes"]) == 2
    with rasterio.open(tmp_path / "b" / "bound.tif") as raster:
        assert raster.descriptions == tuple(name for name, _ in BANDS)
        assert raster.units[0] == "m"
        assert raster.crs.to_epsg() == 32631
    shown = assert_done(mapfilter("info", tmp_path / "b" / "bound.tif", "--json")).json
    assert (shown["kind"], shown["crs"]) == ("bound", "EPSG:32631")
    assert shown["bands"] == [name for name, _ in BANDS]
    ways = pd.read_parquet(tmp_path / "b" / "ways.parquet")
    assert ways["points"].sum() == found["points"]
    assert ways["starts"].sum() == found["starts"]
    # The same on the map: each way's points, in the database's CRS.
    placed = geopandas.read_parquet(tmp_path / "b" / "ways.parquet")
    layer = geopandas.read_file(tmp_path / "b" / "bound.gpkg", layer="ways")
    for one in (placed, layer):
        assert one.crs.to_epsg() == 32631
        assert one.count_coordinates().tolist() == ways["points"].tolist()
    points = mf.open_database(database).points()
    lattice = mf.open_database(database).lattice
    for way_id, geometry in zip(placed["way_id"], placed.geometry, strict=True):
        mine = points.way_id == way_id
        east_m, north_m = lattice.east_north(points.row[mine], points.col[mine])
        bounds = east_m.min(), north_m.min(), east_m.max(), north_m.max()
        assert geometry.bounds == pytest.approx(bounds)
    twins = geopandas.read_file(tmp_path / "b" / "bound.gpkg", layer="twins")
    assert np.allclose(twins.length, np.hypot(
        twins["twin_east_m"] - twins["east_m"], twins["twin_north_m"] - twins["north_m"]
    ))  # fmt: skip


def test_every_key_of_the_summary_has_a_sentence():
    page = (DOCS / "howto" / "where-will-it-work.rst").read_text()
    for one in fields(BoundResult):
        if one.name not in ("notes", "outputs", "seconds"):
            assert f"``{one.name}``" in page, one.name
    assert any(note.startswith("without_plane_bound: ") for note in NOTES)


def test_equal_seeds_give_equal_bytes_and_others_other_journeys(database, tmp_path):
    few = ["--spacing", "200", "--journeys", "1"]
    for name, seed in (("a", 1), ("b", 1), ("c", 2)):
        assert_done(mapfilter("bound", database, "--out", tmp_path / name, "--seed", seed, *few))
    raster, ways, layers = (
        [(tmp_path / name / file).read_bytes() for name in "abc"]
        for file in ("bound.tif", "ways.parquet", "bound.gpkg")
    )
    assert layers[0] == layers[1] != layers[2]
    assert raster[0] == raster[1] != raster[2]
    assert ways[0] == ways[1] != ways[2]


@pytest.mark.parametrize(
    ("given", "told"),
    [
        (["--spacing", "0"], "error: --spacing, FirstFixOptions, spacing_m: expected"),
        (["--journeys", "0"], "error: --journeys, FirstFixOptions, journeys: expected"),
        (["--level-error", "-1"], "error: --level-error, ErrorModel, deviation_db: expected"),
        (["--correlation", "nan"], "error: --correlation, ErrorModel, correlation_m: expected"),
    ],
)
def test_impossible_options_are_refused(database, tmp_path, given, told):
    assert_refused(mapfilter("bound", database, "--out", tmp_path / "b", *given), told)
    assert not (tmp_path / "b").exists()


def test_what_is_no_database_is_refused(tmp_path):
    assert_refused(mapfilter("bound", tmp_path / "none", "--out", tmp_path / "b"), "none")
