"""What a build records of its inputs, replaces, and names its parts."""

import hashlib
import json
from concurrent.futures import Executor

import geopandas
import numpy as np
import pytest
from small_world import LATTICE, contents, make_plan

from mapfilter._parallel import SerialExecutor
from mapfilter.database.build import build
from mapfilter.database.export import export_geopackage
from mapfilter.database.manifest import InputFile
from mapfilter.errors import OutputError
from mapfilter.rasters.geotiff_writer import write_rasters
from mapfilter.rasters.opening import open_rasters


def test_provenance_is_recorded_by_role(world, tmp_path):
    for role, text in (("map", "streets"), ("landuse", "use")):
        (tmp_path / role).mkdir()
        (tmp_path / role / "area").write_text(text)
    inputs = [InputFile.of(role, tmp_path / role / "area") for role in ("map", "landuse")]
    built = build(world.rasters, world.plan, world.routes, tmp_path / "db", inputs=inputs)
    recorded = json.loads((built.path / "manifest.json").read_text())["inputs"]
    assert recorded == [
        {"role": role, "name": path.name, "sha256": hashlib.sha256(path.read_bytes()).hexdigest()}
        for role, path in (
            ("map", tmp_path / "map" / "area"),
            ("landuse", tmp_path / "landuse" / "area"),
            ("rasters", world.rasters.path),
        )
    ]


def test_a_folder_with_files_of_others_is_not_replaced(world, tmp_path):
    out = tmp_path / "db"
    out.mkdir()
    (out / "manifest.json").write_text('{"name": "a web page", "parts": []}')
    with pytest.raises(OutputError, match=r"other files \(manifest.json\)"):
        build(world.rasters, world.plan, world.routes, out)
    (out / "manifest.json").unlink()
    build(world.rasters, world.plan, world.routes, out)
    (out / "levels" / "notes.txt").write_text("mine")
    before = contents(out)
    with pytest.raises(OutputError, match=r"other files \(levels/notes.txt\)"):
        build(world.rasters, world.plan, world.routes, out)
    assert contents(out) == before
    (out / "levels" / "notes.txt").unlink()
    build(world.rasters, world.plan, world.routes, out, margin_db=1)


def test_ids_that_differ_in_case_only_have_folders_of_their_own(world, tmp_path):
    ids = ("a", "A", "b")
    plan = make_plan(ids)
    items = zip(ids, world.levels_dbm, strict=True)
    write_rasters(tmp_path / "r.tif", LATTICE, items, ids)
    built = build(open_rasters(tmp_path / "r.tif"), plan, world.routes, tmp_path / "db")
    folders = [path.name.lower() for path in (built.path / "levels").iterdir()]
    assert len(set(folders)) == 3
    assert not np.array_equal(built.cell_points("a")[2], built.cell_points("A")[2])
    export_geopackage(built, tmp_path / "db.gpkg", cells=("A", "b", "a"))
    layers = geopandas.list_layers(tmp_path / "db.gpkg")["name"]
    assert len({name.lower() for name in layers}) == 5
    (upper,) = [name for name in layers if name.startswith("cell A")]
    rows = geopandas.read_file(tmp_path / "db.gpkg", layer=upper)
    np.testing.assert_array_equal(rows["level_dbm"], built.cell_points("A")[2])


def test_no_more_tiles_wait_than_asked(world, tmp_path):
    waiting = []

    class Lazy(Executor):
        def submit(self, fn, /, *args, **kwargs):
            waiting.append(len(waiting))
            return SerialExecutor().submit(fn, *args, **kwargs)

    most = []
    build(
        world.rasters, world.plan, world.routes, tmp_path / "db", tile_px=8, executor=Lazy(),
        in_flight=3, pixels_a_task=0, progress=lambda done, _: most.append(len(waiting) - done),
    )  # fmt: skip
    assert max(most) == 2
