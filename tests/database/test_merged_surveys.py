"""Merged databases of surveys keep what was measured, each at its place on the merged lattice."""

import sys
from dataclasses import replace

import numpy as np
from small_world import CRS, FLOOR_DBM, IDS, LATTICE, make_plan, make_routes

from mapfilter.database.build import build
from mapfilter.database.measured import Readings
from mapfilter.database.merge import merge
from mapfilter.database.rewrite import levels_of, rewrite, routes_of
from mapfilter.radio.cells import CellPlan
from mapfilter.rasters.geotiff_writer import write_rasters
from mapfilter.rasters.opening import open_rasters

LOST = {"old": (), "new": (1,)}
WINDOWS = {"west": (0, 0, 40, 22), "east": (4, 22, 36, 28)}


def readings(count, seed):
    rng = np.random.default_rng(seed)
    number = np.arange(count, dtype=np.int32)
    places = 531_000.0 + rng.uniform(0, 200, count), 4_556_000.0 - rng.uniform(0, 150, count)
    return Readings(
        IDS, (number % 3).astype(np.int32), number, number // 2, *places,
        -60.0 - number, np.full(count, np.nan), number % 2 == 0,
    )  # fmt: skip


def surveyed(world, folder, name, *, measured=True, lost=()):
    """Build a database of a part of the area; the deviation is that of the pixel in the whole."""
    folder.mkdir(exist_ok=True)
    row, col, rows, cols = WINDOWS[name]
    lattice, made = LATTICE.window(*WINDOWS[name]), {}
    level = world.levels_dbm[:, row : row + rows, col : col + cols].copy()
    level[list(lost)] = np.nan
    number = np.arange(LATTICE.rows * LATTICE.cols).reshape(LATTICE.rows, LATTICE.cols)
    sd = 1 + 0.001 * number[row : row + rows, col : col + cols]
    deviation = np.where(np.isnan(level), np.nan, np.stack([sd, sd + 3, sd + 6]))
    bands = {"level": level, "deviation": deviation.astype(np.float32)}
    for quantity, values in bands.items():
        file = folder / f"{name}-{quantity}.tif"
        write_rasters(file, lattice, zip(IDS, values, strict=True), IDS, {}, quantity=quantity)
        made[quantity] = open_rasters(file)
    given = (readings(6, len(name)), made["deviation"]) if measured else None
    options = {"floor_dbm": FLOOR_DBM, "tile_px": 16, "measured": given}
    out = folder / f"{name}-{measured}"
    return build(made["level"], make_plan(), make_routes(lattice), out, **options)


def test_readings_and_deviations_of_both_are_kept_at_their_places(world, tmp_path):
    west, east = (surveyed(world, tmp_path, name) for name in WINDOWS)
    merged = merge([west, east], tmp_path / "all")
    assert merged.lattice.crs == CRS
    assert (merged.lattice.rows, merged.lattice.cols) == (40, 50)
    found = merged.measured()
    given = [west.measured(), east.measured()]
    for name in ("east_m", "north_m", "level_dbm", "serving"):
        expected = np.concatenate([getattr(one.readings, name) for one in given])
        np.testing.assert_array_equal(getattr(found.readings, name), expected)
    # Reports and drives of different surveys differ.
    assert found.readings.report.tolist() == list(range(12))
    assert found.readings.session.tolist() == [0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5]
    deviations = found.deviations
    assert len(deviations) == sum(len(one.deviations) for one in given) > 100
    number = deviations.row * LATTICE.cols + deviations.col
    expected = 1 + 0.001 * number + 3 * deviations.cell
    np.testing.assert_allclose(deviations.deviation_db, expected, atol=0.006)


def test_of_cells_that_are_left_out_nothing_is_kept(world, tmp_path):
    west = surveyed(world, tmp_path, "west")
    found = merge([west], tmp_path / "one", without=[IDS[0]]).measured()
    assert found.readings.cell_ids == IDS[1:]
    assert found.readings.level_dbm.tolist() == [-61.0, -62.0, -64.0, -65.0]
    assert set(found.deviations.cell.tolist()) == {0, 1}


def test_beside_a_database_without_a_survey_nothing_is_kept(world, tmp_path):
    west = surveyed(world, tmp_path, "west")
    plain = surveyed(world, tmp_path, "east", measured=False)
    for order in ([west, plain], [plain, west]):
        assert merge(order, tmp_path / "mixed").measured() is None


def test_readings_of_cells_without_a_map_are_kept(world, tmp_path, monkeypatch):
    """At times they serve, and single reports are compared with them."""
    plain = readings(6, 4)
    cell = np.array([0, 3, 2, 0, 1, 2], dtype=np.int32)
    rare = replace(plain, cell_ids=(*IDS, "rare"), cell=cell)
    monkeypatch.setattr(sys.modules[__name__], "readings", lambda *_: rare)
    west = surveyed(world, tmp_path, "west")
    for name, merged in (
        ("merged", merge([west], tmp_path / "merged", without=[IDS[1]])),
        ("rewritten", rewrite(west, tmp_path / "rewritten", *without(west, IDS[1]))),
    ):
        found = merged.measured().readings
        names = [found.cell_ids[number] for number in found.cell]
        assert names == [IDS[0], "rare", IDS[2], IDS[0], IDS[2]], name


def without(database, cell_id):
    kept = [number for number, one in enumerate(database.cell_ids) if one != cell_id]
    plan = CellPlan(CRS, tuple(database.plan.cells[number] for number in kept))
    return plan, routes_of(database), levels_of(database)[kept]


def test_deviations_of_levels_that_are_overridden_are_not_kept(world, tmp_path):
    """A later survey covers all of the east, and did not receive the second cell there."""
    old, new = (surveyed(world, tmp_path / name, "east", lost=lost) for name, lost in LOST.items())
    given = new.measured().deviations
    assert 0 < len(given) < len(old.measured().deviations)
    found = merge([old, new], tmp_path / "all").measured().deviations
    for name in ("row", "col", "deviation_db"):
        assert sorted(getattr(found, name)) == sorted(getattr(given, name))
    assert set(found.cell.tolist()) == {0, 2}
    # The other way round the survey that received it is the later one.
    found = merge([new, old], tmp_path / "other").measured().deviations
    assert len(found) == len(old.measured().deviations)
