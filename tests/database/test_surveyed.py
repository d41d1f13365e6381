"""A database of a survey: what it keeps when it is written anew, and how its parts are checked."""

from dataclasses import replace

import numpy as np
import pytest
from small_world import FLOOR_DBM, IDS, LATTICE, make_routes, make_world

from mapfilter.database.build import build
from mapfilter.database.measured import Readings
from mapfilter.database.rewrite import levels_of, rewrite, routes_of
from mapfilter.database.store import info, open_database
from mapfilter.errors import StoreError
from mapfilter.radio.cells import CellPlan
from mapfilter.rasters.geotiff_writer import write_rasters
from mapfilter.rasters.opening import open_rasters

COUNT = 30_000


def many_readings():
    """Readings at random places, so many that their file has several blocks."""
    rng, number = np.random.default_rng(8), np.arange(COUNT, dtype=np.int32)
    west, south, east, north = LATTICE.bounds_m
    return Readings(
        IDS, number % np.int32(3), number, number // np.int32(9),
        rng.uniform(west, east, COUNT), rng.uniform(south, north, COUNT),
        rng.uniform(-90, -60, COUNT), np.full(COUNT, np.nan), number % 2 == 0,
    )  # fmt: skip


def build_surveyed(folder):
    world = make_world(folder)
    number = np.arange(LATTICE.rows * LATTICE.cols, dtype=np.float32).reshape(LATTICE.rows, -1)
    bands = ((cell, 1 + 0.01 * number + k) for k, cell in enumerate(IDS))
    write_rasters(folder / "sd.tif", LATTICE, bands, IDS, {}, quantity="deviation")
    given = many_readings(), open_rasters(folder / "sd.tif")
    options = {"floor_dbm": FLOOR_DBM, "tile_px": 16, "measured": given}
    return build(world.rasters, world.plan, make_routes(), folder / "db", **options)


@pytest.fixture(scope="module")
def surveyed(tmp_path_factory):
    return build_surveyed(tmp_path_factory.mktemp("survey"))


def by_place(measured):
    found = measured.deviations
    rows = zip(found.cell.tolist(), found.row.tolist(), found.col.tolist(), strict=True)
    keys = ((found.cell_ids[cell], row, col) for cell, row, col in rows)
    return dict(zip(keys, found.deviation_db.tolist(), strict=True))


def test_what_was_measured_is_kept_at_its_places(surveyed, tmp_path):
    given, plan = surveyed.measured(), surveyed.plan
    assert len(given.readings) == COUNT
    expected = {
        (cell, row, col): pytest.approx(1 + 0.01 * (row * LATTICE.cols + col) + k, abs=0.006)
        for k, cell in enumerate(IDS)
        for row, col in zip(surveyed.points().row, surveyed.points().col, strict=True)
    }
    assert by_place(given) == expected
    routes, levels_dbm = routes_of(surveyed), levels_of(surveyed)
    again = rewrite(surveyed, tmp_path / "again", plan, routes, levels_dbm).measured()
    assert by_place(again) == by_place(given)
    np.testing.assert_array_equal(again.readings.level_dbm, given.readings.level_dbm)
    fewer = CellPlan(plan.crs, plan.cells[1:])
    less = rewrite(surveyed, tmp_path / "less", fewer, routes, levels_dbm[1:]).measured()
    assert by_place(less) == {key: sd for key, sd in by_place(given).items() if key[0] != IDS[0]}
    assert len(less.readings) == COUNT * 2 // 3


def test_of_roads_alone_nothing_was_measured(surveyed):
    assert surveyed.without_cells().measured() is None
    assert replace(surveyed).measured() is not None


def test_the_full_check_reads_every_block_and_the_usual_one_the_last(tmp_path):
    """A changed byte in the first of several blocks: found by the full check, or when read."""
    database = build_surveyed(tmp_path)
    file = database.path / "readings.parquet"
    assert file.stat().st_size > 2 << 18
    data = bytearray(file.read_bytes())
    data[1000] ^= 1
    file.write_bytes(bytes(data))
    database = open_database(tmp_path / "db")
    assert database.cell_points(IDS[2])[0].size
    with pytest.raises(StoreError, match=r"readings\.parquet: expected SHA-256"):
        database.measured()
    with pytest.raises(StoreError) as caught:
        open_database(tmp_path / "db", verify="full")
    (fault,) = caught.value.faults
    assert (fault.where, fault.hint) == (str(file), "changed after it was written")


def test_levels_are_counted_without_the_readings(surveyed):
    found = info(surveyed)
    counts = {cell: surveyed.cell_points(cell, np.inf)[0].size for cell in IDS}
    assert found["levels_per_cell"] == counts
    assert found["levels"] == sum(counts.values()) < COUNT
    assert found["bytes"] == sum(f.stat().st_size for f in surveyed.path.rglob("*.parquet"))
