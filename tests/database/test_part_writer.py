"""Rows of tiles in parts: whatever their number in memory, and of the writers."""

import json

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from small_world import CRS

from mapfilter.database import parts
from mapfilter.database.parquet import point_geometry
from mapfilter.database.parts import PartWriter, levels_table, points_table, write_parts
from mapfilter.database.tiles import TileRows, received_levels
from mapfilter.lattice import Lattice

LATTICE = Lattice(CRS, 1000.0, 2000.0, 5.0, 6, 8)
IDS = ("A", "b", "B")


def tile(cols, level_dbm):
    """A tile of the points of some columns, row by row, with levels (cells, points)."""
    row, col = (one.ravel() for one in np.meshgrid(np.arange(6), cols, indexing="ij"))
    places = pa.table({
        "point": row * 8 + col, "row": row.astype("i4"), "col": col.astype("i4"),
        "geometry": point_geometry(*LATTICE.east_north(row, col)),
    })  # fmt: skip
    return TileRows(places, received_levels(np.asarray(level_dbm, float), -100.0))


def tiles(seed=1):
    """Four tiles of two columns; the second cell is not received in the first of them."""
    rng = np.random.default_rng(seed)
    for number in range(4):
        level = np.round(rng.uniform(-120, -60, (3, 12)), 2)
        if number == 0:
            level[1] = -110.0
        yield tile([2 * number, 2 * number + 1], level)


def written(folder, memory, writers=1, ids=IDS):
    folder.mkdir()
    done = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(parts, "ROWS_IN_MEMORY", memory)
        made = write_parts(folder, CRS, ids, tiles(), 4, writers, lambda *at: done.append(at))
    assert done == [(1, 4), (2, 4), (3, 4), (4, 4)]
    return made


def rows_of(folder, made, cell):
    entries = [one for one in made.parts if one.get("cell") == cell]
    return pa.concat_tables(pq.read_table(folder / one["path"]) for one in entries)


@pytest.mark.parametrize("writers", [1, 3])
@pytest.mark.parametrize("memory", [1, 30, 1000])
def test_parts_hold_all_rows_however_few_are_in_memory(tmp_path, memory, writers):
    folder = tmp_path / "db"
    made = written(folder, memory, writers)
    assert made.points == 48
    every = list(tiles())
    points = [points_table(one.places, one.levels, IDS) for one in every]
    assert made.received == sum(one.num_rows for one in points) < 48
    found = pq.read_table(folder / "points.parquet")
    np.testing.assert_array_equal(found["point"], np.concatenate([one["point"] for one in points]))
    servers = [name for one in points for name in one["best_server"].to_pylist()]
    assert found["best_server"].to_pylist() == servers
    for cell, name in enumerate(IDS):
        expected = [one.levels.level_dbm[one.levels.cell == cell] for one in every]
        rows = rows_of(folder, made, name)
        np.testing.assert_array_equal(rows["level_dbm"], np.concatenate(expected))
        assert set(rows["cell"].to_pylist()) == {name}
        assert rows.column_names == ["point", "row", "col", "cell", "level_dbm", "below_best_db"]


def test_parts_are_listed_points_first_then_cell_by_cell(tmp_path):
    """With one tile in memory at a time each has a part of its own, if the cell is in it."""
    made = written(tmp_path / "db", 1)
    paths = [one["path"] for one in made.parts]
    folders = sorted({path.rpartition("/")[0] for path in paths[1:]})
    assert paths[0] == "points.parquet"
    assert [path.rpartition("/")[2] for path in paths[1:]] == [
        *(f"part-{n}.parquet" for n in range(4)),
        *(f"part-{n}.parquet" for n in range(3)),
        *(f"part-{n}.parquet" for n in range(4)),
    ]
    # Folders of names that differ in case differ in more.
    assert len({folder.casefold() for folder in folders}) == 3
    assert [one.get("cell") for one in made.parts] == [None] + ["A"] * 4 + ["b"] * 3 + ["B"] * 4
    for one in made.parts:
        assert pq.read_metadata(tmp_path / "db" / one["path"]).num_rows == one["rows"]
    few = written(tmp_path / "few", 1000)
    assert [one.get("cell") for one in few.parts] == [None, *IDS]


def test_rows_are_written_as_soon_as_so_many_wait(tmp_path, monkeypatch):
    first, second, *_ = tiles()
    size = first.levels.cell.size
    for memory, flushed in ((size, True), (size + 1, False)):
        monkeypatch.setattr(parts, "ROWS_IN_MEMORY", memory)
        folder = tmp_path / str(memory)
        folder.mkdir()
        with PartWriter(folder, CRS, IDS, 1) as writer:
            writer.add(first)
            assert (folder / "levels").exists() == flushed
            writer.add(second)
            writer.finish()


def test_roads_alone_are_written_as_soon_as_so_many_points_wait(tmp_path, monkeypatch):
    none = tile([0, 1], np.empty((0, 12)))
    for memory, groups in ((12, 2), (13, 1)):
        monkeypatch.setattr(parts, "ROWS_IN_MEMORY", memory)
        folder = tmp_path / str(memory)
        folder.mkdir()
        made = write_parts(folder, CRS, (), [none, none], 2)
        assert (made.points, made.received) == (24, 24)
        footer = pq.read_metadata(folder / "points.parquet")
        assert (footer.num_rows, footer.num_row_groups) == (24, groups)
        assert set(pq.read_table(folder / "points.parquet")["best_server"].to_pylist()) == {""}


@pytest.mark.parametrize("memory", [1, 1000])
def test_bounds_are_those_of_all_points(tmp_path, memory):
    folder = tmp_path / "db"
    written(folder, memory)
    footer = pq.read_metadata(folder / "points.parquet")
    box = json.loads(footer.metadata[b"geo"])["columns"]["geometry"]["bbox"]
    point = pq.read_table(folder / "points.parquet")["point"].to_numpy()
    east, north = LATTICE.east_north(*np.divmod(point, 8))
    assert box == [east.min(), north.min(), east.max(), north.max()]


def test_rows_of_a_group_are_limited(tmp_path, monkeypatch):
    monkeypatch.setattr(parts, "_ROWS_IN_A_GROUP", 5)
    made = written(tmp_path / "db", 1000)
    for one in made.parts:
        footer = pq.read_metadata(tmp_path / "db" / one["path"])
        sizes = [footer.row_group(n).num_rows for n in range(footer.num_row_groups)]
        assert sizes == [5] * (one["rows"] // 5) + [one["rows"] % 5] * (one["rows"] % 5 > 0)


def test_nothing_received_is_no_part(tmp_path):
    quiet = tile([0, 1], np.full((3, 12), -120.0))
    made = write_parts(tmp_path, CRS, IDS, [quiet], 1)
    assert (made.points, made.received, made.parts) == (12, 0, [])
    assert list(tmp_path.iterdir()) == []


def test_a_cells_table_joins_the_rows_of_tiles():
    rows = {"point": np.array([3, 4]), "row": np.array([0, 0]), "col": np.array([3, 4]),
            "level_dbm": np.float32([-70, -71])}  # fmt: skip
    found = levels_table("x", [rows, {name: values[:1] for name, values in rows.items()}])
    assert found["point"].to_pylist() == [3, 4, 3]
    assert found["cell"].to_pylist() == ["x"] * 3
    assert found.column_names == ["point", "row", "col", "cell", "level_dbm"]
