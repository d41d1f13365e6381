"""Levels at points of windows: which pixels they are, and how often a file is read for them."""

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pytest

from mapfilter.errors import InputError
from mapfilter.lattice import Lattice
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.rasters import sampling
from mapfilter.rasters.raster_set import RxLevRasters
from mapfilter.rasters.sampling import Places, levels_at

CRS = "EPSG:32635"
LATTICE = Lattice(CRS, 385000.0, 6673000.0, 5.0, 12, 20)


@dataclass(frozen=True)
class InMemory:
    """A raster file whose pixels are an array; it notes bands and windows that are read."""

    path: Path
    cell_ids: tuple[str, ...]
    values: np.ndarray
    lattice: Lattice = LATTICE
    reads: list = field(default_factory=list)

    def read(self, bands, window):
        row, col, rows, cols = window
        self.reads.append((tuple(bands), tuple(window)))
        return self.values[list(bands), row : row + rows, col : col + cols].copy()


def made(name, cells, lattice=LATTICE, seed=0):
    shape = len(cells), lattice.rows, lattice.cols
    values = np.random.default_rng(seed).uniform(30, 100, shape).astype(np.float32)
    return InMemory(Path(name), tuple(cells), values, lattice)


def rasters(*files, quantity="loss", factor=1.0):
    ids = tuple(cell for file in files for cell in file.cell_ids)
    return RxLevRasters(Path("x"), ids, LATTICE, quantity, files, (), factor)


def plan(*ids):
    """Cells with an EIRP of 50 dBm, 51 dBm and so on, and of 50 dBm again after thirty."""
    cells = (
        Cell(one, "S", 0.0, 0.0, 30.0, 0.0, 50.0 + n % 30, 1800.0) for n, one in enumerate(ids)
    )
    return CellPlan(CRS, tuple(cells))


def places(held, cells, window, points, ids="ABCD"):
    row, col = np.array(points, dtype=np.int64).reshape(-1, 2).T
    return Places(held, plan(*ids), tuple(cells), window, row, col)


def test_levels_are_those_of_the_pixels_under_the_points():
    """Two files, one of them coarser; windows overlap, and ask for cells in orders of their own."""
    coarse = Lattice(CRS, 385000.0, 6673000.0, 10.0, 6, 10)
    first, second = made("1", "AB"), made("2", "CD", coarse, seed=1)
    first.values[1, 4, 7] = np.nan
    held = rasters(first, second, factor=0.5)
    asked = [
        ("DA", (2, 5, 4, 6), [(0, 0), (2, 2), (3, 5), (3, 5)]),
        ("B", (3, 4, 5, 5), [(1, 3), (4, 4)]),
        ("CBAD", (0, 0, 12, 20), [(11, 19), (0, 19), (11, 0)]),
    ]
    found = levels_at([places(held, *one) for one in asked])
    eirp_dbm = {"A": 50.0, "B": 51.0, "C": 52.0, "D": 53.0}
    for (cells, (top, left, _, _), points), levels in zip(asked, found, strict=True):
        expected = np.empty((len(cells), len(points)))
        for i, cell in enumerate(cells):
            for j, (row, col) in enumerate(points):
                r, c = top + row, left + col
                band = "ABCD".index(cell)
                of = (
                    first.values[band, r, c]
                    if band < 2
                    else second.values[band - 2, r // 2, c // 2]
                )
                expected[i, j] = eirp_dbm[cell] - 0.5 * of
        assert levels.dtype == np.float32
        np.testing.assert_allclose(levels, expected, rtol=1e-5)
    assert np.isnan(found[1][0, 0])
    # Each is read once, in the box about all windows.
    assert first.reads == [((0, 1), (0, 0, 12, 20))]
    assert len(second.reads) == 1


@pytest.mark.parametrize("resampling", ["nearest", "bilinear"])
@pytest.mark.parametrize("quantity", ["level", "loss"])
@pytest.mark.parametrize("factor", [1.0, 2.0, 0.5])
def test_levels_at_points_are_those_of_whole_windows(resampling, quantity, factor):
    """Each read by itself, of files on two lattices, one of them between the pixels."""
    between = Lattice(CRS, 385002.0, 6672999.0, 4.0, 14, 24)
    files = [made("1", "AB"), made("2", "CD", between, seed=1)]
    sign = -1 if quantity == "level" else 1
    files = [replace(file, values=sign * file.values) for file in files]
    held = replace(rasters(*files, quantity=quantity, factor=factor), resampling=resampling)
    rng = np.random.default_rng(3)
    asked = [
        places(held, cells, window, rng.integers(0, window[2:], (5, 2)))
        for cells, window in (("ABCD", (0, 0, 12, 20)), ("DB", (3, 4, 5, 6)), ("C", (4, 7, 5, 5)))
    ]
    for one, found in zip(asked, levels_at(asked), strict=True):
        whole = held.read_levels_dbm(one.plan, one.window, one.cells)
        np.testing.assert_array_equal(found, whole[:, one.row, one.col])
        assert np.isfinite(found).any()


def test_a_cell_without_a_raster_has_no_level():
    file = made("1", "AB")
    (found,) = levels_at([places(rasters(file), "CB", (0, 0, 2, 2), [(0, 0), (1, 1)])])
    assert np.isnan(found[0]).all()
    np.testing.assert_array_equal(found[1], np.float32(51.0) - file.values[1, [0, 1], [0, 1]])


def test_levels_need_no_eirp():
    file = made("1", "AB")
    file.values[:] *= -1
    held = rasters(file, quantity="level")
    (found,) = levels_at([places(held, "BA", (1, 2, 3, 4), [(2, 3), (0, 0)], ids="")])
    expected = file.values[[1, 0]][:, [3, 1], [5, 2]]
    np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize(
    ("second", "reads"),
    [
        # The box of 2 x 8 pixels is twice as many as both windows have.
        ((0, 6, 2, 2), [(0, 0, 2, 8)]),
        ((0, 7, 2, 2), [(0, 0, 2, 2), (0, 7, 2, 2)]),
        ((6, 0, 2, 2), [(0, 0, 8, 2)]),
        ((7, 0, 2, 2), [(0, 0, 2, 2), (7, 0, 2, 2)]),
        ((3, 3, 1, 1), [(0, 0, 2, 2), (3, 3, 1, 1)]),
        ((1, 1, 3, 3), [(0, 0, 4, 4)]),
    ],
)
def test_windows_are_read_together_where_most_of_their_box_is_asked_for(second, reads):
    file = made("1", "AB")
    held = rasters(file)
    asked = [places(held, "A", (0, 0, 2, 2), [(1, 1)]), places(held, "B", second, [(0, 0)])]
    found = levels_at(asked)
    assert [window for _, window in file.reads] == reads
    assert all(bands == (0, 1) for bands, _ in file.reads)
    assert found[0][0, 0] == np.float32(50.0) - file.values[0, 1, 1]
    assert found[1][0, 0] == np.float32(51.0) - file.values[1, second[0], second[1]]


@pytest.mark.parametrize(("bands", "together"), [(32, True), (33, False)])
def test_of_many_bands_no_more_is_held_than_128_bands_of_a_window(bands, together):
    """The box has four times as many pixels as the largest window."""
    cells = [f"C{n}" for n in range(bands)]
    file = made("1", cells)
    held = rasters(file)
    asked = [
        places(held, cells, (0, 0, 2, 4), [(1, 3)], cells),
        places(held, cells, (2, 0, 2, 4), [(0, 0)], cells),
        places(held, cells, (0, 4, 4, 4), [(0, 0)], cells),
        places(held, cells[:1], (0, 8, 8, 8), [], cells),
        places(held, cells[:1], (4, 0, 4, 4), [(0, 0)], cells),
        places(held, cells[:1], (4, 4, 4, 4), [(0, 0)], cells),
    ]
    found = levels_at(asked)
    assert len(file.reads) == (1 if together else 5)
    np.testing.assert_allclose(found[0][:, 0], 50.0 + np.arange(bands) % 30 - file.values[:, 1, 3])
    np.testing.assert_allclose(found[2][:, 0], 50.0 + np.arange(bands) % 30 - file.values[:, 0, 4])
    assert found[3].shape == (1, 0)


def test_128_bands_are_read_at_a_time_and_fewer_of_large_windows(monkeypatch):
    cells = [f"C{n}" for n in range(129)]
    file = made("1", cells)
    asked = [places(rasters(file), cells, (0, 0, 2, 3), [(1, 2)], cells)]
    (found,) = levels_at(asked)
    assert [len(bands) for bands, _ in file.reads] == [128, 1]
    np.testing.assert_allclose(found[:, 0], 50.0 + np.arange(129) % 30 - file.values[:, 1, 2])
    for limit_bytes, sizes in ((4 * 6 * 50, [50, 50, 29]), (4 * 6 * 51 - 1, [50, 50, 29])):
        monkeypatch.setattr(sampling, "_MOST_BYTES", limit_bytes)
        file.reads.clear()
        np.testing.assert_array_equal(levels_at(asked)[0], found)
        assert [len(bands) for bands, _ in file.reads] == sizes
    monkeypatch.setattr(sampling, "_MOST_BYTES", 1)
    file.reads.clear()
    # The larger one of two windows counts.
    small = places(rasters(file), cells[:3], (0, 0, 1, 1), [(0, 0)], cells)
    levels_at([small])
    assert [bands for bands, _ in file.reads] == [(0,), (1,), (2,)]
    monkeypatch.setattr(sampling, "_MOST_BYTES", 4 * 6 * 3)
    file.reads.clear()
    levels_at([small, *asked])
    assert {len(bands) for bands, _ in file.reads} == {3}


def test_only_bands_and_files_that_are_asked_for_are_read():
    first, second = made("1", "AB"), made("2", "CD")
    held = rasters(first, second)
    levels_at([places(rasters(second), "D", (0, 0, 2, 2), [(0, 0)])])
    assert (first.reads, second.reads) == ([], [((1,), (0, 0, 2, 2))])
    second.reads.clear()
    levels_at([places(held, "B", (0, 0, 2, 2), [(0, 0)])])
    assert (first.reads, second.reads) == ([((1,), (0, 0, 2, 2))], [])
    first.reads.clear()
    # Without points or cells there is nothing to read, nor anything to check.
    nothing = rasters(first, quantity="deviation")
    found = levels_at(
        [places(nothing, "AB", (0, 0, 2, 2), []), places(nothing, "", (0, 0, 2, 2), [(0, 0)])]
    )
    assert [one.shape for one in found] == [(2, 0), (0, 1)]
    assert first.reads == []
    assert levels_at([]) == []


def test_deviations_are_no_levels():
    with pytest.raises(InputError, match="the deviations of a survey given for its levels"):
        levels_at(
            [places(rasters(made("1", "A"), quantity="deviation"), "A", (0, 0, 2, 2), [(0, 0)])]
        )


@pytest.mark.parametrize(("place", "told"), [((0, 2), False), ((1, 4), True), ((0, 0), True)])
def test_pixels_of_the_windows_are_checked_and_none_between_them(place, told):
    file = made("1", "A")
    file.values[(0, *place)] = 500.0
    held = rasters(file)
    asked = [
        places(held, "A", (0, 0, 2, 2), [(1, 1)]),
        places(held, "A", (0, 3, 2, 2), [(0, 0)]),
    ]
    if told:
        with pytest.raises(InputError, match=r"a loss in 0\.\.400 dB"):
            levels_at(asked)
    else:
        levels_at(asked)
    assert [window for _, window in file.reads] == [(0, 0, 2, 5)]


def test_cells_that_an_index_gives_one_file_have_its_levels_both():
    first = made("1", "A")
    second = InMemory(first.path, ("B",), first.values)
    held = rasters(first, second, quantity="level")
    held = replace(held, factor=-1.0)
    (found,) = levels_at([places(held, "AB", (2, 3, 4, 5), [(0, 0), (3, 4)])])
    np.testing.assert_array_equal(found, -first.values[[0, 0]][:, [2, 5], [3, 7]])
    np.testing.assert_array_equal(found, held.read((2, 3, 4, 5), "AB")[:, [0, 3], [0, 4]])
