"""What a finished tile depends on: with any of it changed, resuming makes the tile again."""

import contextlib
import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import shapely
from counting import Counting
from small_world import CRS, FLOOR_DBM, LATTICE, contents, levels_of, make_plan, make_routes

from mapfilter import _resume
from mapfilter._resume import FinishedParts
from mapfilter.database.build import build, work_key
from mapfilter.database.sources import LatticeRoutes, LayerRoutes
from mapfilter.errors import InputError, OutputError
from mapfilter.rasters.geotiff_writer import write_rasters
from mapfilter.rasters.opening import open_rasters
from mapfilter.roads.buildings import Buildings
from mapfilter.roads.osm import Water
from mapfilter.roads.route_points import RouteSource
from mapfilter.roads.ways import Squares, Ways

FINISHED = 3


def written(folder, seed):
    """Return rasters of path loss: 50 dBm of EIRP less the level."""
    plan = make_plan()
    losses = ((cell, np.float32(50) - level) for cell, level in levels_of(plan, seed=seed))
    write_rasters(folder, LATTICE, losses, plan.ids, quantity="loss")
    return open_rasters(folder)


@pytest.fixture(scope="module")
def inputs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rasters")
    return {
        "rasters": written(folder / "rxlev.tif", seed=3),
        "plan": make_plan(),
        "routes": make_routes(),
        "floor_dbm": FLOOR_DBM,
        "tile_px": 8,
        "pixels_a_task": 0,
    }


def other_rasters(_, folder):
    # The same name, cells and lattice: only the values tell them apart.
    return {"rasters": written(folder / "rxlev.tif", seed=4)}


def other_power(inputs, _):
    stronger = [replace(cell, eirp_dbm=53.0) for cell in inputs["plan"].cells]
    return {"plan": replace(inputs["plan"], cells=tuple(stronger))}


def other_factor(inputs, _):
    return {"rasters": replace(inputs["rasters"], factor=1.01)}


def other_routes(inputs, _):
    routes = inputs["routes"]
    return {"routes": replace(routes, distance_to_way_m=routes.distance_to_way_m + 1)}


def other_floor(_, __):
    return {"floor_dbm": FLOOR_DBM - 5}


@pytest.mark.parametrize(
    "change", [other_rasters, other_power, other_factor, other_routes, other_floor]
)
def test_tiles_of_other_inputs_are_never_taken(inputs, change, tmp_path):
    with pytest.raises(KeyboardInterrupt):
        build(**inputs, out=tmp_path / "db", executor=Counting(FINISHED), in_flight=1)
    changed = inputs | change(inputs, tmp_path)
    anew, resumed = Counting(), Counting()
    expected = contents(build(**changed, out=tmp_path / "anew" / "db", executor=anew).path)
    built = build(**changed, out=tmp_path / "db", executor=resumed, resume=True)
    assert resumed.tasks == anew.tasks > FINISHED
    assert contents(built.path) == expected


def test_another_margin_is_no_other_tile(inputs, tmp_path):
    with pytest.raises(KeyboardInterrupt):
        build(**inputs, out=tmp_path / "db", executor=Counting(FINISHED), in_flight=1)
    anew, resumed = Counting(), Counting()
    build(**inputs, out=tmp_path / "anew", executor=anew)
    build(**inputs, out=tmp_path / "db", executor=resumed, resume=True, margin_db=3.0)
    assert resumed.tasks == anew.tasks - FINISHED


PARAMETERS = {"margin_db": 6.0, "floor_dbm": FLOOR_DBM, "tile_px": 8}


def key(inputs, *, sha256="a" * 64, routes="r", parameters=PARAMETERS, **changes):
    rasters = replace(inputs["rasters"], **changes.get("rasters", {}))
    plan = changes.get("plan", inputs["plan"])
    return work_key(sha256, rasters, plan, routes, parameters)


def one_cell_changed(plan, **changes):
    first, *rest = plan.cells
    return replace(plan, cells=(replace(first, **changes), *rest))


def test_the_key_tells_every_input_apart(inputs):
    rasters, plan = inputs["rasters"], inputs["plan"]
    east_of_it = replace(rasters.lattice, west_m=rasters.lattice.west_m + 5)
    keys = [
        key(inputs),
        key(inputs, sha256="b" * 64),
        key(inputs, routes="s"),
        key(inputs, parameters=PARAMETERS | {"floor_dbm": FLOOR_DBM - 1}),
        key(inputs, parameters=PARAMETERS | {"tile_px": 9}),
        key(inputs, rasters={"cell_ids": rasters.cell_ids[::-1]}),
        key(inputs, rasters={"lattice": east_of_it}),
        key(inputs, rasters={"quantity": "level"}),
        key(inputs, rasters={"factor": 2.0}),
        key(inputs, rasters={"resampling": "bilinear"}),
        key(inputs, plan=replace(plan, cells=plan.cells[::-1])),
        key(inputs, plan=one_cell_changed(plan, id="S1.Z")),
        key(inputs, plan=one_cell_changed(plan, eirp_dbm=50.5)),
        key(inputs, plan=one_cell_changed(plan, east_m=plan.cells[0].east_m + 1)),
    ]
    assert len(set(keys)) == len(keys)
    assert key(inputs) == keys[0]
    assert key(inputs, parameters=PARAMETERS | {"margin_db": 3.0}) == keys[0]


def test_the_key_tells_apart_what_is_declared_of_the_files(inputs):
    (file,) = inputs["rasters"].files
    keys = {
        key(inputs),
        key(inputs, rasters={"files": (replace(file, nodata=(-80.0,)),)}),
        key(inputs, rasters={"files": (replace(file, cell_ids=file.cell_ids[::-1]),)}),
    }
    assert len(keys) == 3
    elsewhere = replace(file, path=Path("/elsewhere") / file.path.name, parts=())
    assert key(inputs, rasters={"files": (elsewhere,)}) == key(inputs)


def test_tiles_of_rasters_whose_side_car_changed_are_made_again(tmp_path):
    def rasters():
        return open_rasters(tmp_path / "rxlev.tif")

    plan = make_plan()
    write_rasters(tmp_path / "rxlev.tif", LATTICE, levels_of(plan, seed=3), plan.ids)
    given = {"plan": plan, "routes": make_routes(), "floor_dbm": FLOOR_DBM, "tile_px": 8}
    given["pixels_a_task"] = 0
    with pytest.raises(KeyboardInterrupt):
        build(rasters(), **given, out=tmp_path / "db", executor=Counting(FINISHED), in_flight=1)
    bands = "".join(
        f'<PAMRasterBand band="{n}"><Offset>-3</Offset><Scale>1</Scale></PAMRasterBand>'
        for n in (1, 2, 3)
    )
    (tmp_path / "rxlev.tif.aux.xml").write_text(f"<PAMDataset>{bands}</PAMDataset>")
    anew = build(rasters(), **given, out=tmp_path / "anew")
    resumed = build(rasters(), **given, out=tmp_path / "db", resume=True)
    assert contents(resumed.path) == contents(anew.path)


def test_no_tile_of_other_code_is_taken_over(inputs, tmp_path, monkeypatch):
    with pytest.raises(KeyboardInterrupt):
        build(**inputs, out=tmp_path / "db", executor=Counting(FINISHED), in_flight=1)
    monkeypatch.setattr(_resume, "code_digest", lambda: "of other code")
    everything, anew = Counting(), Counting()
    build(**inputs, out=tmp_path / "db", executor=everything, resume=True)
    build(**inputs, out=tmp_path / "anew", executor=anew)
    assert everything.tasks == anew.tasks


def test_a_tile_under_the_name_of_another_is_none(tmp_path):
    tiles = FinishedParts(tmp_path / "db", lambda: "k", keep=True, name="tile")
    tiles.save(0, b"rows of 0")
    tiles.save(1, b"rows of 1")
    (tiles.folder / "tile-1.arrow").write_bytes((tiles.folder / "tile-0.arrow").read_bytes())
    assert tiles.load(0) == b"rows of 0"
    assert tiles.load(1) is None


LAID_CHANGES = ["row", "col", "way_id", "way_class", "distance_to_way_m"]


@pytest.mark.parametrize("name", LAID_CHANGES)
def test_the_digest_of_laid_points_tells_every_column_apart(inputs, name):
    routes = inputs["routes"]
    column = getattr(routes, name).copy()
    column[-1] += 1
    # Only the digest is asked: the lattice of the changed points need not be sound.
    changed = SimpleNamespace(**{
        field: getattr(routes, field)
        for field in (*LAID_CHANGES, "lattice", "class_names", "on_square")
    })  # fmt: skip
    before = LatticeRoutes(changed).digest()
    assert before == LatticeRoutes(routes).digest()
    setattr(changed, name, column)
    assert LatticeRoutes(changed).digest() != before


WEST_M, _, _, NORTH_M = LATTICE.bounds_m


def box(east_m):
    return shapely.box(WEST_M + east_m, NORTH_M - 40, WEST_M + east_m + 20, NORTH_M - 20)


def street(north_m=-20.0, way_id=77, way_class=0, names=("residential", "footway")):
    line = shapely.LineString([
        (WEST_M + 5, NORTH_M + north_m), (WEST_M + 200, NORTH_M + north_m)
    ])  # fmt: skip
    return Ways(
        CRS, np.array([way_id]), np.array([way_class], np.int16), names, np.array([line]),
        np.zeros(1, bool), np.zeros(1, np.int8),
    )  # fmt: skip


def digest(ways=None, square=10, house=60, lake=110, half_width_m=10.0, lattice=LATTICE):
    squares = Squares(CRS, np.array([5]), np.array([box(square)]))
    houses = Buildings(CRS, np.array([box(house)]), np.array([9.0]), 1, 0, 0)
    water = Water(CRS, np.array([box(lake)]))
    source = RouteSource.of(ways or street(), squares, houses, half_width_m, water=water)
    return LayerRoutes(source, lattice).digest()


def test_the_digest_of_layers_tells_every_layer_apart():
    digests = [
        digest(),
        digest(street(north_m=-25.0)),
        digest(street(way_id=78)),
        digest(street(way_class=1)),
        digest(street(names=("residential", "path"))),
        digest(square=15),
        digest(house=65),
        digest(lake=115),
        digest(half_width_m=12.0),
        digest(lattice=replace(LATTICE, west_m=WEST_M + 5)),
    ]
    assert len(set(digests)) == len(digests)
    assert digest() == digests[0]


def test_tiles_lie_beside_the_database_in_a_folder_named_after_the_key(tmp_path):
    folders = {
        FinishedParts(tmp_path / "db", lambda key=key: key, name="tile").folder for key in "aab"
    }
    assert len(folders) == 2
    assert {folder.parent for folder in folders} == {tmp_path}
    assert all(re.fullmatch(r"\.db\.tiles-[0-9a-f]{16}", folder.name) for folder in folders)


@pytest.mark.parametrize(
    ("error", "kept"),
    [(None, False), (InputError, False), (OutputError, False), (KeyboardInterrupt, True),
     (RuntimeError, True)],
)  # fmt: skip
def test_tiles_stay_only_where_going_on_makes_sense(tmp_path, error, kept):
    tiles = FinishedParts(tmp_path / "db", lambda: "k", name="tile")
    with contextlib.suppress(BaseException), tiles:
        tiles.save(0, b"rows")
        if error is not None:
            raise error(())
    assert tiles.folder.exists() is kept


@pytest.mark.parametrize("error", [None, InputError, KeyboardInterrupt])
def test_tiles_left_by_other_code_go_when_the_database_is_finished(tmp_path, error):
    """After an update nobody would take them over, or remove them."""
    older = FinishedParts(tmp_path / "db", lambda: "before the update", name="tile")
    others = [
        FinishedParts(tmp_path / "db", lambda: "k", name="journey"),
        FinishedParts(tmp_path / "db2", lambda: "k", name="tile"),
        FinishedParts(tmp_path / "[d]b", lambda: "k", name="tile"),
    ]
    for one in (older, *others):
        one.save(0, b"rows")
    (tmp_path / ".db.tiles-of-mine").mkdir()
    with (
        contextlib.suppress(BaseException),
        FinishedParts(tmp_path / "db", lambda: "now", name="tile") as tiles,
    ):
        tiles.save(0, b"rows")
        if error is not None:
            raise error(())
    assert older.folder.exists() is (error is not None)
    assert all(one.folder.exists() for one in others)
    assert (tmp_path / ".db.tiles-of-mine").exists()


def test_who_never_asked_for_tiles_needs_no_key(tmp_path):
    with FinishedParts(tmp_path / "db", lambda: pytest.fail("the key was asked for"), name="tile"):
        pass


def test_a_tile_that_cannot_be_written_is_an_error(tmp_path):
    tiles = FinishedParts(tmp_path / "db", lambda: "k", name="tile")
    tiles.folder.write_bytes(b"a file where the folder should be")
    with pytest.raises(OutputError, match="tile-3"):
        tiles.save(3, b"rows")
