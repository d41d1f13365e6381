"""Limits and ties of the database's small functions, each worked by hand on both of its sides."""

import json
from dataclasses import replace

import numpy as np
import pyarrow as pa
import pytest
from small_world import CRS, LATTICE, make_database, make_world

from mapfilter._json_files import sealed
from mapfilter.database.build import check_parameters
from mapfilter.database.defaults import MARGIN_DB, TILE_PX
from mapfilter.database.field import fill_field
from mapfilter.database.manifest import (
    InputFile,
    apart,
    describe_part,
    levels_folders,
    read_manifest,
)
from mapfilter.database.parts import levels_rows, points_table
from mapfilter.database.sources import check_aligned, overlap, pixels_between
from mapfilter.database.tiles import TileLevels, TileRows, received_levels, tile_windows, z_order
from mapfilter.errors import InputError, StoreError
from mapfilter.lattice import Lattice

NAN = np.nan


def test_names_of_folders_up_to_200_characters_stay_and_longer_ones_end_in_a_checksum():
    kept, cut, other = "a" * 200, "a" * 201, "a" * 200 + "b"
    folders = levels_folders([kept, cut, other])
    assert folders[kept] == f"levels/{kept}"
    for cell_id in (cut, other):
        head, _, digest = folders[cell_id].removeprefix("levels/").partition("-")
        assert head == "a" * 100
        assert len(digest) == 64
    assert folders[cut] != folders[other]
    assert levels_folders([".", "..", "a/b", "ä"]) == {
        ".": "levels/%2E", "..": "levels/%2E%2E", "a/b": "levels/a%2Fb", "ä": "levels/%C3%A4",
    }  # fmt: skip


def test_names_that_differ_in_case_get_twelve_digits_each():
    assert apart({"x": "One", "y": "two"}) == {"x": "One", "y": "two"}
    assert apart({"a": "S", "A": "s", "b": "t"}) == {
        "a": "S-ca978112ca1b", "A": "s-559aead08264", "b": "t",
    }  # fmt: skip


def test_the_entry_of_a_part(tmp_path):
    file = tmp_path / "levels" / "S" / "part-0.parquet"
    file.parent.mkdir(parents=True)
    file.write_bytes(b"abc")
    digest = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
    whole = {"path": "levels/S/part-0.parquet", "rows": 7, "bytes": 3, "sha256": digest}
    assert describe_part(tmp_path, file, 7) == whole
    assert describe_part(tmp_path, file, 7, "S") == {**whole, "cell": "S"}
    assert InputFile.of("roads", file) == InputFile("roads", "part-0.parquet", digest)


def test_what_is_heard_of_four_cells_at_six_points():
    level_dbm = np.array(
        [
            [-70.0, -70.0, -104.01, -104.0, NAN, -80.004],
            [-70.0, -76.5, -104.01, NAN, NAN, -80.006],
            [-75.0, NAN, -110.0, -120.0, NAN, -120.0],
            [-69.99, -103.99, NAN, NAN, NAN, -104.004],
        ]
    )
    heard = received_levels(level_dbm, -104.0)
    # At the floor counts; levels are rounded before; of equals the first is the best.
    assert heard.best.tolist() == [3, 0, -1, 0, -1, 0]
    np.testing.assert_allclose(
        heard.best_level_dbm, [-69.99, -70.0, -104.01, -104.0, NAN, -80.0], rtol=1e-6
    )
    np.testing.assert_allclose(heard.margin_db, [0.01, 6.5, NAN, NAN, NAN, 0.01], atol=1e-6)
    assert heard.cell.tolist() == [0, 0, 0, 0, 1, 1, 1, 2, 3, 3, 3]
    assert heard.which.tolist() == [0, 1, 3, 5, 0, 1, 5, 0, 0, 1, 5]
    np.testing.assert_allclose(
        heard.below_best_db, [0.01, 0, 0, 0, 0.01, 6.5, 0.01, 5.01, 0, 33.99, 24.0], atol=1e-5
    )
    np.testing.assert_allclose(heard.level_dbm[-1], -104.0)
    tied = received_levels(np.array([[-80.0], [-70.0], [-70.0]]), -104.0)
    assert (tied.best.tolist(), tied.margin_db.tolist()) == ([1], [0.0])
    alone = received_levels(np.array([[-80.0, -105.0]]), -104.0)
    assert alone.best.tolist() == [0, -1]
    assert np.isnan(alone.margin_db).all()
    none = received_levels(np.empty((0, 3)), -104.0)
    assert none.best.tolist() == [-1, -1, -1]
    assert none.cell.size == 0
    numbered = heard.of_cells((5, 7, 8, 9))
    assert numbered.best.tolist() == [9, 5, -1, 5, -1, 5]
    assert numbered.cell.tolist() == [5, 5, 5, 5, 7, 7, 7, 8, 9, 9, 9]


def test_levels_are_compared_with_the_strongest_of_their_layer():
    """Best server and margin of a point are those of all cells; where one is alone it leads."""
    level_dbm = np.array(
        [[-60.0, -60.0, NAN], [-80.0, -110.0, -90.0], [-70.5, NAN, -61.0], [-92.0, -88.0, -95.0]]
    )
    heard = received_levels(level_dbm, -104.0, np.array([0, 1, 0, 1]))
    assert heard.best.tolist() == [0, 0, 2]
    np.testing.assert_allclose(heard.margin_db, [10.5, 28.0, 29.0], atol=1e-5)
    assert heard.cell.tolist() == [0, 0, 1, 1, 2, 2, 3, 3, 3]
    assert heard.which.tolist() == [0, 1, 0, 2, 0, 2, 0, 1, 2]
    expected = [0.0, 0.0, 0.0, 0.0, 10.5, 0.0, 12.0, 0.0, 5.0]
    np.testing.assert_allclose(heard.below_best_db, expected, atol=1e-5)
    alike = received_levels(level_dbm, -104.0, np.zeros(4, dtype=np.int64))
    plain = received_levels(level_dbm, -104.0)
    np.testing.assert_array_equal(alike.below_best_db, plain.below_best_db)
    assert not np.array_equal(plain.below_best_db, heard.below_best_db)


def test_a_tile_comes_back_from_its_bytes_and_is_split_by_cell():
    heard = received_levels(np.array([[-70.0, NAN, -90.0], [-72.5, NAN, -88.0]]), -104.0)
    places = pa.table({name: np.arange(3) + n for n, name in enumerate(("point", "row", "col"))})
    tile = TileRows(places, heard)
    back = TileRows.from_bytes(tile.to_bytes())
    assert back.places.equals(places)
    for name in TileLevels.__slots__:
        np.testing.assert_array_equal(getattr(back.levels, name), getattr(heard, name))
    rows = dict(levels_rows(places, heard))
    assert sorted(rows) == [0, 1]
    assert rows[1]["point"].tolist() == [0, 2]
    assert rows[1]["row"].tolist() == [1, 3]
    assert rows[1]["level_dbm"].tolist() == [-72.5, -88.0]
    assert rows[0]["below_best_db"].tolist() == [0.0, 2.0]
    points = points_table(places, heard, ("A", "B"))
    # What is found of a place stands before its geometry, the last of the columns.
    assert points.column_names == [
        "point",
        "row",
        "best_server",
        "best_level_dbm",
        "margin_db",
        "col",
    ]
    assert points["best_server"].to_pylist() == ["A", "B"]
    assert points["margin_db"].to_pylist() == [2.5, 2.0]


def interleaved(row, col):
    return sum(((row >> k & 1) << 2 * k + 1) | ((col >> k & 1) << 2 * k) for k in range(32))


def test_the_z_order_of_every_single_bit():
    for k in range(31):
        row, col = np.array([1 << k, 0]), np.array([0, 1 << k])
        assert z_order(row, col).tolist() == [1 << (2 * k + 1), 1 << (2 * k)]
    assert int(z_order(np.array([54321]), np.array([65535]))[0]) == interleaved(54321, 65535)


def test_tiles_along_the_curve():
    lattice = replace(LATTICE, rows=5, cols=7)
    assert tile_windows(lattice, 3) == [
        (0, 0, 3, 3), (0, 3, 3, 3), (3, 0, 2, 3), (3, 3, 2, 3), (0, 6, 3, 1), (3, 6, 2, 1),
    ]  # fmt: skip


def test_what_a_build_takes_where_nothing_is_given():
    assert (MARGIN_DB, TILE_PX) == (6.0, 256)


@pytest.mark.parametrize(
    ("changes", "count"),
    [
        ({}, 0),
        ({"margin_db": 0.0}, 0),
        ({"margin_db": -0.1}, 1),
        ({"margin_db": np.inf}, 1),
        ({"floor_dbm": -200.0}, 0),
        ({"floor_dbm": -200.1}, 1),
        ({"floor_dbm": 0.0}, 0),
        ({"floor_dbm": 0.1}, 1),
        ({"tile_px": 1}, 0),
        ({"tile_px": 0}, 1),
        ({"margin_db": NAN, "floor_dbm": NAN, "tile_px": -1}, 3),
    ],
)
def test_parameters_of_a_build(changes, count):
    options = {"margin_db": 6.0, "floor_dbm": -104.0, "tile_px": 256, **changes}
    if not count:
        check_parameters(**options)
        return
    with pytest.raises(InputError) as caught:
        check_parameters(**options)
    assert len(caught.value.faults) == count


BASE = Lattice(CRS, 1000.0, 2000.0, 5.0, 10, 20)


@pytest.mark.parametrize(
    ("other", "between", "found"),
    [
        (BASE, (0, 0), (0, 0, 10, 20)),
        (Lattice(CRS, 1010.0, 1985.0, 5.0, 4, 6), (3, 2), (3, 2, 4, 6)),
        (Lattice(CRS, 990.0, 2005.0, 5.0, 4, 6), (-1, -2), (0, 0, 3, 4)),
        (Lattice(CRS, 1095.0, 1955.0, 5.0, 4, 6), (9, 19), (9, 19, 1, 1)),
        (Lattice(CRS, 1100.0, 1955.0, 5.0, 4, 6), (9, 20), None),
        (Lattice(CRS, 1095.0, 1950.0, 5.0, 4, 6), (10, 19), None),
        (Lattice(CRS, 970.0, 2000.0, 5.0, 4, 6), (0, -6), None),
        (Lattice(CRS, 1000.0, 2020.0, 5.0, 4, 6), (-4, 0), None),
    ],
)
def test_parts_of_a_lattice_that_another_covers(other, between, found):
    assert pixels_between(BASE, other) == between
    assert overlap(BASE, other, (0, 0, 10, 20)) == found
    if found is None:
        with pytest.raises(InputError, match="areas that overlap"):
            check_aligned(BASE, other, "roads")
    else:
        check_aligned(BASE, other, "roads")


def test_a_window_is_cut_too():
    other = Lattice(CRS, 1010.0, 1985.0, 5.0, 4, 6)
    assert overlap(BASE, other, (4, 0, 2, 5)) == (4, 2, 2, 3)
    assert overlap(BASE, other, (0, 0, 3, 5)) is None
    assert overlap(BASE, other, (0, 0, 4, 2)) is None


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"crs": "EPSG:32630"}, "one CRS"),
        ({"resolution_m": 5.0001}, "one resolution"),
        ({"west_m": 1000.0 + 5 * 0.4}, "shifted by +0.400 and +0.000 pixels"),
        ({"north_m": 2000.0 + 5 * 0.4}, "shifted by +0.000 and -0.400 pixels"),
    ],
)
def test_lattices_that_do_not_align(changes, said):
    with pytest.raises(InputError) as caught:
        check_aligned(BASE, replace(BASE, **changes), "roads")
    assert said in str(caught.value)


def test_a_field_of_two_points_by_hand():
    lattice = Lattice(CRS, 0.0, 20.0, 5.0, 2, 4)
    pixels = np.array([0, 1]), np.array([0, 3])
    heard = [("A", np.array([0]), np.array([0]), np.array([-70.0], np.float32)),
             ("B", *pixels, np.array([-80.0, -60.0], np.float32))]  # fmt: skip
    distance_m, half_width_m = np.array([[1.5, 2.0], [3.0, 8.5]], np.float32)
    field = fill_field(lattice, pixels, np.array([7, 9]), distance_m, half_width_m, heard)
    assert field.half_width_m.dtype == np.float32
    assert field.half_width_m.tolist() == [[3.0, 3.0, 8.5, 8.5]] * 2
    assert field.way_id.tolist() == [[7, 7, 9, 9], [7, 7, 9, 9]]
    assert field.on_way.tolist() == [[True, False, False, False], [False, False, False, True]]
    np.testing.assert_array_equal(field.level_dbm[..., 1], [[-80, -80, -60, -60]] * 2)
    np.testing.assert_array_equal(field.level_dbm[..., 0], [[-70, -70, NAN, NAN]] * 2)
    diagonal = 5 * np.sqrt(2)
    np.testing.assert_allclose(
        field.distance_to_way_m,
        [[1.5, 6.5, 2 + diagonal, 7.0], [6.5, 1.5 + diagonal, 7.0, 2.0]],
        rtol=1e-6,
    )


def test_an_edited_manifest_names_what_is_twice_or_elsewhere(tmp_path):
    database = make_database(make_world(tmp_path), tmp_path)
    file = database.path / "manifest.json"
    whole = json.loads(file.read_text())

    def complaint(change):
        manifest = json.loads(json.dumps(whole))
        change(manifest)
        file.write_text(json.dumps(sealed(manifest)))
        with pytest.raises(StoreError) as caught:
            read_manifest(database.path)
        return [
            f"{fault.where} {fault.expected}".split("manifest.json")[1]
            for fault in caught.value.faults
        ]

    points = next(n for n, part in enumerate(whole["parts"]) if part["path"] == "points.parquet")
    (level, *_) = [n for n, part in enumerate(whole["parts"]) if "cell" in part]
    path = whole["parts"][level]["path"]
    assert complaint(lambda m: m["parts"].append(m["parts"][level])) == [f" part {path} once"]
    assert complaint(lambda m: m["parts"].pop(points)) == [" a part points.parquet"]
    assert complaint(lambda m: m["parts"][points].update(rows=1))[0].startswith(", points.parquet ")
    assert complaint(lambda m: m["parts"][level].pop("cell"))[0].endswith(
        "the cell whose part it is"
    )
    assert complaint(lambda m: m["parts"][level].update(cell="S9"))[0].endswith("a cell listed")
    assert complaint(lambda m: m["parts"][level].update(path="levels/other/part-0.parquet"))
    assert complaint(lambda m: m.update(crs="EPSG:32630"))[0].endswith("the lattice's CRS")
    assert complaint(lambda m: m["lattice"].update(rows=0))
    assert complaint(lambda m: m["counts"].update(points=-1))
    assert complaint(lambda m: m["parts"][level].update(sha256="0" * 63))
    manifest = json.loads(json.dumps(whole)) | {"cells": "x" * 300}
    file.write_text(json.dumps(sealed(manifest)))
    with pytest.raises(StoreError) as caught:
        read_manifest(database.path)
    assert [fault.got for fault in caught.value.faults] == ["'" + 79 * "x"]
    file.write_text(json.dumps(whole))
    assert read_manifest(database.path)[0] == whole
