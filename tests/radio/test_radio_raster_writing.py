"""Rasters on a disk that is full at either step of writing them."""

import contextlib
import resource

import numpy as np
import pytest

from mapfilter.errors import InputError, OutputError
from mapfilter.lattice import Lattice
from mapfilter.rasters import geotiff_writer as raster_writer
from mapfilter.rasters.geotiff_writer import write_rasters
from mapfilter.rasters.opening import open_rasters

LATTICE = Lattice("EPSG:32629", 531_000.0, 4_556_000.0, 5.0, 512, 512)


@contextlib.contextmanager
def limited_files(size):
    """Let no file grow beyond a size, as a full disk would.

    Only for the block: pytest itself must be able to write its report to a file.
    """
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def assert_told(path, limit=contextlib.nullcontext):
    noise = np.random.default_rng(1).uniform(-120, -40, (512, 512))
    with limit(), pytest.raises(OutputError) as caught:
        write_rasters(path, LATTICE, [("A", noise)], ["A"])
    assert "x.tif: expected a raster that can be written" in str(caught.value)
    assert list(path.parent.iterdir()) == []


@pytest.mark.parametrize("size", [0, 100_000, 1_000_000])
def test_the_bands_do_not_fit(tmp_path, size):
    assert_told(tmp_path / "x.tif", lambda: limited_files(size))


@pytest.mark.parametrize("size", [0, 100_000, 500_000])
def test_the_final_file_does_not_fit(tmp_path, monkeypatch, size):
    copy = raster_writer.copy_raster

    def copy_to_a_full_disk(*args, **options):
        with limited_files(size):
            return copy(*args, **options)

    monkeypatch.setattr(raster_writer, "copy_raster", copy_to_a_full_disk)
    assert_told(tmp_path / "x.tif")


def test_hundreds_of_bands_can_be_read_again(tmp_path):
    """In blocks of 256 x 256 pixels the bands of one would fill more than 64 MiB."""
    lattice = Lattice("EPSG:32635", 385_000.0, 6_672_000.0, 5.0, 257, 260)
    ids = [f"ap-{number}" for number in range(270)]
    path = tmp_path / "rxlev.tif"
    levels = np.full((lattice.rows, lattice.cols), np.nan, dtype=np.float32)
    levels[3, 7] = -70.0
    write_rasters(
        path, lattice, ((cell, levels - number / 100) for number, cell in enumerate(ids)), ids
    )
    found = open_rasters(path)
    assert found.cell_ids == tuple(ids)
    assert found.read()[269, 3, 7] == np.float32(-72.69)


SMALL = Lattice("EPSG:32629", 531_000.0, 4_556_000.0, 5.0, 2, 3)


def test_masked_pixels_are_no_data(tmp_path):
    values = np.ma.masked_less([[-80.0, -120.0, -70.0], [-60.0, -50.0, -130.0]], -100)
    write_rasters(tmp_path / "x.tif", SMALL, [("A", values)], ["A"])
    found = open_rasters(tmp_path / "x.tif").read()[0]
    assert np.isnan(found).tolist() == [[False, True, False], [False, False, True]]
    assert found[0, 0] == -80


def test_levels_by_cell_need_no_list_of_cells(tmp_path):
    levels = {"B": np.full((2, 3), -80.0), "A": [[-70, -71, -72], [-73, -74, -75]]}
    write_rasters(tmp_path / "x.tif", SMALL, levels)
    found = open_rasters(tmp_path / "x.tif")
    assert found.cell_ids == ("B", "A")
    assert found.read()[1].tolist() == levels["A"]
    write_rasters(tmp_path / "y.tif", SMALL, levels, ["A", "B"])
    assert open_rasters(tmp_path / "y.tif").cell_ids == ("A", "B")
    assert open_rasters(tmp_path / "y.tif").read(None, ["B", "A"]).tolist() == found.read().tolist()


def test_one_array_of_all_cells_is_in_their_order(tmp_path):
    levels_dbm = -80.0 - np.arange(12.0).reshape(2, 2, 3)
    path = write_rasters(tmp_path / "x.tif", SMALL, levels_dbm, ("B", "A"))
    assert path == tmp_path / "x.tif"
    found = open_rasters(path)
    assert (found.cell_ids, found.crs) == (("B", "A"), SMALL.crs)
    assert found.read().tolist() == levels_dbm.tolist()
    write_rasters(tmp_path / "y.tif", SMALL, {"B": levels_dbm[0], "A": levels_dbm[1]})
    assert (tmp_path / "y.tif").read_bytes() == path.read_bytes()


@pytest.mark.parametrize(
    ("items", "ids", "expected"),
    [
        (
            {"A": np.zeros((2, 3))},
            ["A", "B"],
            "levels: expected an array of each cell, found none of B",
        ),
        ([("A", np.zeros((2, 3)))], None, "cell_ids: expected the ids of all cells, found none"),
        ({}, None, "cell_ids: expected the ids of all cells, found none"),
        ([np.zeros((2, 3))], ["A"], "band 1: expected a cell id and its array, found ndarray"),
        (np.zeros((1, 2, 3)), None, "cell_ids: expected the ids of all cells, found none"),
        (np.zeros((1, 2, 3)), ["A", "B"], r"items: expected \(2, 2, 3\): cells, rows, columns"),
        (np.zeros((1, 3)), ["A"], r"items: expected \(1, 2, 3\): cells, rows, columns, found"),
        (np.zeros((1, 3, 2)), ["A"], r"band 1 \(A\): expected 2 x 3 pixels, found \(3, 2\)"),
        ({"A": [["x"] * 3] * 2}, None, r"band 1 \(A\): expected rows of numbers, found list"),
        ({"A": [[1, 2, 3], [4, 5]]}, None, r"band 1 \(A\): expected rows of numbers, found list"),
    ],
)
def test_cells_without_levels_and_levels_without_cells_are_named(items, ids, expected, tmp_path):
    with pytest.raises(InputError, match=expected):
        write_rasters(tmp_path / "x.tif", SMALL, items, ids)
    assert list(tmp_path.iterdir()) == []
