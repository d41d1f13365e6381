"""Reading a database by hand: areas by their edges, margins, one cell of several parts."""

import numpy as np
import pyarrow as pa
import pytest
from small_world import FLOOR_DBM, IDS, LATTICE, make_database, make_world

from mapfilter.database.merge import merge
from mapfilter.database.parquet import text_codes
from mapfilter.database.parts import PartWriter
from mapfilter.errors import InputError


@pytest.fixture(scope="module")
def world(tmp_path_factory):
    return make_world(tmp_path_factory.mktemp("world"))


@pytest.fixture(scope="module")
def database(world, tmp_path_factory):
    return make_database(world, tmp_path_factory.mktemp("database"))


WEST, SOUTH, EAST, NORTH = LATTICE.bounds_m


@pytest.mark.parametrize(
    ("bounds_m", "found"),
    [
        (None, (0, 0, 40, 50)),
        ((WEST, SOUTH + 1, EAST - 1, NORTH), (0, 0, 40, 50)),
        ((WEST - 99, SOUTH - 99, EAST + 99, NORTH + 99), (0, 0, 40, 50)),
        ((WEST + 12, NORTH - 24, WEST + 31, NORTH - 6), (1, 2, 4, 5)),
        ((WEST + 12, NORTH - 8, WEST + 13, NORTH - 6), (1, 2, 1, 1)),
        ((EAST - 2, SOUTH + 1, EAST + 99, SOUTH + 3), (39, 49, 1, 1)),
    ],
)
def test_the_pixels_of_an_area(database, bounds_m, found):
    top, left, window = database._window(bounds_m)
    assert (top, left, window.rows, window.cols) == found
    assert window == LATTICE.window(*found)


@pytest.mark.parametrize(
    "bounds_m",
    [
        (EAST + 1, SOUTH, EAST + 99, NORTH),
        (WEST - 99, SOUTH, WEST - 1, NORTH),
        (WEST, NORTH + 1, EAST, NORTH + 99),
        (WEST, SOUTH - 99, EAST, SOUTH - 1),
        (24.9, 60.1, 25.0, 60.2),
    ],
)
def test_areas_beside_the_lattice(database, bounds_m):
    with pytest.raises(InputError, match="an area within"):
        database.field(bounds_m)


def levels_at(world):
    level = np.where(world.levels_dbm >= FLOOR_DBM, world.levels_dbm, np.nan)
    return level[:, world.routes.row, world.routes.col]


@pytest.mark.parametrize("margin_db", [0.0, 2.4, 6.0, np.inf, None])
@pytest.mark.parametrize("number", [0, 1, 2])
def test_points_of_a_cell_by_its_rasters(world, database, margin_db, number):
    level = levels_at(world)
    best = np.nanmax(np.where(np.isnan(level), -np.inf, level), axis=0)
    margin = 6.0 if margin_db is None else margin_db
    wanted = ~np.isnan(level[number]) & (np.round(best - level[number], 2) <= margin)
    row, col, found = database.cell_points(IDS[number], margin_db)
    assert row.tolist() == world.routes.row[wanted].tolist()
    assert col.tolist() == world.routes.col[wanted].tolist()
    np.testing.assert_allclose(found, level[number][wanted], atol=1e-5)


def test_points_by_the_rasters(world, database):
    level = levels_at(world)
    heard = ~np.isnan(level).all(axis=0)
    points, routes = database.points(), world.routes
    assert len(points) == heard.sum()
    strength = np.where(np.isnan(level), -np.inf, level)[:, heard]
    assert points.best_server.tolist() == strength.argmax(axis=0).tolist()
    np.testing.assert_allclose(points.best_level_dbm, strength.max(axis=0), atol=1e-5)
    ordered = np.sort(strength, axis=0)
    margin = ordered[-1] - ordered[-2]
    np.testing.assert_allclose(
        points.margin_db, np.where(np.isfinite(margin), margin, np.nan), atol=5e-3
    )
    for name in ("row", "col", "way_id", "on_square", "distance_to_way_m"):
        np.testing.assert_array_equal(getattr(points, name), getattr(routes, name)[heard])
    codes, names = points.way_class
    assert [names[code] for code in codes] == [
        routes.class_names[code] for code in routes.way_class[heard]
    ]


def test_codes_of_text_in_several_pieces():
    column = pa.chunked_array([["b", "a"], ["c", "b"]]).dictionary_encode()
    codes, names = text_codes(column)
    assert [names[code] for code in codes] == ["b", "a", "c", "b"]
    assert codes.dtype == np.int32


def test_rows_wait_in_memory_until_there_are_enough(database, tmp_path, monkeypatch):
    flushed = []
    flush = PartWriter._flush
    monkeypatch.setattr(
        PartWriter, "_flush", lambda self: flushed.append(self._waiting) or flush(self)
    )
    merge([database], tmp_path / "one")
    whole = sum(len(database.cell_points(cell, np.inf)[0]) for cell in IDS)
    assert flushed == [whole]
    flushed.clear()
    monkeypatch.setattr("mapfilter.database.parts.ROWS_IN_MEMORY", whole // 2)
    merged = merge([database], tmp_path / "several")
    assert len(flushed) >= 2
    assert all(rows >= whole // 2 for rows in flushed[:-1])
    assert sum(flushed) == whole
    assert len(merged.level_parts[IDS[0]]) == 2
    for cell in IDS:
        for one, other in zip(
            merged.cell_points(cell, np.inf), database.cell_points(cell, np.inf), strict=True
        ):
            np.testing.assert_array_equal(one, other)


def test_what_a_merge_says_of_where_it_comes_from(database, tmp_path):
    merged = merge([database, database], tmp_path / "merged")
    assert [file["role"] for file in merged.manifest["inputs"]] == ["database"] * 2
    assert merged.manifest["counts"] == {
        "points": len(database.points()), "points_below_floor": None, "points_off_rasters": None,
    }  # fmt: skip
    assert merged.lattice == database.lattice
    seen = []
    merge([database], tmp_path / "again", progress=lambda *at: seen.append(at))
    assert [done for done, _ in seen] == list(range(1, len(seen) + 1))
    assert {total for _, total in seen} == {len(seen)}


def test_what_is_opened_shows_itself_in_two_lines(database):
    text = repr(database)
    assert len(text.splitlines()) == 2
    count = len(database.points())
    for part in (str(database.path), f"{len(IDS)} cells", f"{count} points", "EPSG:"):
        assert part in text
    field = f"{len(database.field().cell_ids)} cells, {count} points; {LATTICE}"
    assert repr(database.field()) == f"RadioField({field})"
    assert repr(database.points()).startswith(f"Points({count} of point, row, col, ")
