"""The world of a benchmark on disk: its ground truths, its checksum, and its databases."""

from dataclasses import replace

import numpy as np
import pytest
import shapely
from grid_town import CRS, SOUTH_M, WEST_M, network, plan

from mapfilter.database.build import build
from mapfilter.database.sources import LatticeRoutes
from mapfilter.errors import StoreError
from mapfilter.experiments.benchmarks.cases import CASES
from mapfilter.experiments.benchmarks.world import BenchmarkWorld, write_buildings
from mapfilter.experiments.sweep.world import SweepWorld, open_world, write_world
from mapfilter.lattice import Lattice
from mapfilter.positioning.candidate import CandidateFilter
from mapfilter.propagation.models import GroundTruthErrors, PredictionModel
from mapfilter.propagation.predict import predict
from mapfilter.radio.antenna import MeasuredAntenna
from mapfilter.radio.cells import CellPlan
from mapfilter.rasters.geotiff_writer import write_rasters
from mapfilter.rasters.opening import open_rasters
from mapfilter.roads.lattice import RouteLattice
from mapfilter.roads.ways import Buildings
from mapfilter.simulation.simulate import SimulationSettings
from mapfilter.tracks.imu_noise import ImuNoise

LATTICE = Lattice(CRS, WEST_M, SOUTH_M + 600.0, 10.0, 60, 60)
PLAN = CellPlan(CRS, plan().cells[:2])
MODEL = PredictionModel(model="cost231_hata")
NONE = GroundTruthErrors(
    level_error_db=0.0, eirp_error_db=0.0, azimuth_error_deg=0.0, slope_error=0.0
)
ROWS, COLS = np.indices((60, 60))
PLACES = LATTICE.east_north(ROWS.ravel(), COLS.ravel())


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Streets alone: all that a ground truth needs."""
    path = tmp_path_factory.mktemp("world")
    write_world(SweepWorld(network(), PLAN, LATTICE, {}, np.zeros((60, 60))), path / "streets")
    return path


def received(folder, errors, seed, level_error_db=None):
    world = BenchmarkWorld(folder, MODEL, errors)
    return world.ground_truth(seed, level_error_db)(*PLACES)


def predicted():
    made = [level for _, level in predict(PLAN, LATTICE, None, MODEL)]
    return np.array(made).reshape(2, -1).T


def test_without_errors_the_ground_truth_is_the_prediction(folder):
    np.testing.assert_allclose(received(folder, NONE, 1), predicted(), atol=1e-4)


def test_the_ground_truth_differs_by_the_worlds_errors(folder):
    errors = replace(NONE, level_error_db=7.0, correlation_m=20.0)
    off = np.array([received(folder, errors, seed) - predicted() for seed in range(20)])
    square = (off**2).mean(axis=(1, 2))
    assert abs(square.mean() - 49.0) < 4 * square.std(ddof=1) / np.sqrt(20) < 8.0
    # Every seed has another one, and always the same.
    assert len({field.tobytes() for field in off}) == 20
    again = received(folder, errors, 3) - predicted()
    np.testing.assert_array_equal(again, off[3])
    # The errors' own seed has no say.
    np.testing.assert_array_equal(
        received(folder, replace(errors, seed=9), 3) - predicted(), off[3]
    )


def test_a_case_may_have_another_deviation(folder):
    errors = replace(NONE, level_error_db=7.0, correlation_m=20.0)
    usual, more = (received(folder, errors, 5, db) - predicted() for db in (None, 10.0))
    np.testing.assert_allclose(more, usual * 10 / 7, atol=1e-3)
    # Other errors stay.
    offset = replace(errors, offset_db=30.0)
    found = received(folder, offset, 5, 10.0) - predicted()
    np.testing.assert_allclose(found, more + 30.0, atol=1e-3)


def test_measured_antennas_are_the_ground_truths_too(tmp_path):
    turn = np.arange(0.0, 360.0, 10.0)
    zero = np.zeros(36)
    shut = MeasuredAntenna("shut", turn, zero + 40.0, turn, zero + 40.0)
    cells = tuple(replace(cell, antenna="panel", azimuth_deg=0.0) for cell in PLAN.cells)
    towns = SweepWorld(network(), CellPlan(CRS, cells), LATTICE, {})
    write_world(towns, tmp_path / "streets")
    world = BenchmarkWorld(tmp_path, MODEL, NONE, antennas={"panel": shut})
    levels = world.ground_truth(1)(*PLACES)
    np.testing.assert_allclose(levels, predicted() - 40.0, atol=0.01)


def test_the_default_ground_truth_is_not_the_prediction(folder):
    off = received(folder, GroundTruthErrors(), 1) - predicted()
    assert off.std() > 4.0


def lay_out(folder, *, height_m=10.0, tile_px=64):
    """A whole world: streets, two databases and a building."""
    write_world(SweepWorld(network(), PLAN, LATTICE, {}, np.zeros((60, 60))), folder / "streets")
    rasters = folder / "rxlev.tif"
    write_rasters(rasters, LATTICE, predict(PLAN, LATTICE, None, MODEL), PLAN.ids)
    for name, rows in (("database", 30), ("database-thinned", 20)):
        row, col = np.indices((rows, 60), dtype=np.int32)
        count = row.size
        routes = RouteLattice(
            LATTICE, row.ravel(), col.ravel(), np.ones(count, np.int64), np.zeros(count, np.int16),
            ("residential",), np.zeros(count, np.float32), np.zeros(count, bool),
        )  # fmt: skip
        build(open_rasters(rasters), PLAN, LatticeRoutes(routes), folder / name, tile_px=tile_px)
    box = shapely.box(WEST_M + 10, SOUTH_M + 10, WEST_M + 50, SOUTH_M + 50)
    shapes = np.array([box], dtype=object)
    write_buildings(
        Buildings(CRS, shapes, np.array([height_m]), 1, 0, 0), folder / "buildings.parquet"
    )
    return BenchmarkWorld(folder, MODEL)


def test_the_checksum_is_of_all_that_is_simulated(tmp_path):
    world = lay_out(tmp_path)
    worlds = [
        world,
        replace(world, model=replace(MODEL, environment="suburban")),
        replace(world, errors=GroundTruthErrors(offset_db=1.0)),
        replace(world, settings=SimulationSettings(imu=ImuNoise(turns="gyro"))),
        replace(world, settings=SimulationSettings(imu=ImuNoise(period_s=2.0))),
    ]
    assert len({one.sha256 for one in worlds}) == len(worlds)
    before = world.sha256
    assert BenchmarkWorld(tmp_path, MODEL).sha256 == before
    for part in ("streets/world.json", "database/manifest.json", "buildings.parquet"):
        data = (tmp_path / part).read_bytes()
        (tmp_path / part).write_bytes(data + b" ")
        assert world.sha256 != before, part
        (tmp_path / part).write_bytes(data)
    (tmp_path / "database-thinned/manifest.json").write_bytes(b"{}")
    assert world.sha256 != before


def test_another_world_in_the_same_folder_is_read_anew(tmp_path, monkeypatch):
    opened = []

    def over(_options, database, **_):
        opened.append(database)
        return opened

    monkeypatch.setattr(CandidateFilter, "over", over)
    world = lay_out(tmp_path)
    first = world.streets
    assert world.streets is first
    assert len(first.plan) == 2
    world.filter(CandidateFilter(), thinned=False)
    world.filter(CandidateFilter(), thinned=False)
    assert len(opened) == 1
    world.filter(CandidateFilter(margin_db=9.0), thinned=False)
    world.filter(CandidateFilter(), thinned=True)
    counts = [database.manifest["counts"]["points"] for database in opened]
    assert counts == [1800, 1800, 1200]
    skyline = world.skyline(CASES["satellites-2"])
    assert world.skyline(CASES["levels-6"]) is None
    assert world.skyline(CASES["spoofed"]) is skyline
    write_world(SweepWorld(network(), plan(), LATTICE, {}), tmp_path / "streets")
    assert len(world.streets.plan) == 10
    lay_out(tmp_path, height_m=25.0, tile_px=32)
    world.filter(CandidateFilter(), thinned=True)
    assert len(opened) == 4
    assert world.skyline(CASES["satellites-2"]) is not skyline


@pytest.mark.parametrize("value", ["Infinity", "NaN", "null", '"many"', "[1]"])
def test_a_world_of_no_size_is_refused(tmp_path, value):
    write_world(SweepWorld(network(), PLAN, LATTICE, {}), tmp_path / "world")
    assert open_world(tmp_path / "world").lattice == LATTICE
    head = tmp_path / "world" / "world.json"
    text = head.read_text()
    assert '"rows": 60' in text
    head.write_text(text.replace('"rows": 60', f'"rows": {value}'))
    with pytest.raises(StoreError, match="world of a sweep"):
        open_world(tmp_path / "world")
