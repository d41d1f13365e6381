"""Sets of rasters: what is read from which file, and which requests are refused."""

from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from raster_files import WINDOWS

from mapfilter.errors import InputError
from mapfilter.lattice import Lattice
from mapfilter.rasters.raster_set import RxLevRasters, check_against_plan

CRS = "EPSG:32635"
LATTICE = Lattice(CRS, 385000.0, 6673000.0, 5.0, 6, 8)


@dataclass(frozen=True)
class InMemory:
    """A raster file whose pixels are an array."""

    path: Path
    cell_ids: tuple[str, ...]
    values: np.ndarray
    lattice: Lattice = LATTICE
    parts: tuple[Path, ...] = ()
    reads: list = field(default_factory=list)

    def read(self, bands, window):
        row, col, rows, cols = window
        self.reads.append(tuple(bands))
        return self.values[list(bands), row : row + rows, col : col + cols].astype(np.float32)


def in_memory(quantity="level", factor=1.0):
    """Return a set of three files: A, B and C; D and E; F."""
    values = np.random.default_rng(4).uniform(-110, -60, (6, 6, 8)).astype(np.float32)
    cut = {"1": slice(0, 3), "2": slice(3, 5), "3": slice(5, 6)}
    files = tuple(InMemory(Path(n), tuple("ABCDEF"[s]), values[s]) for n, s in cut.items())
    return RxLevRasters(Path("x"), tuple("ABCDEF"), LATTICE, quantity, files, (), factor), values


@pytest.mark.parametrize("cells", ["ABCDEF", "FEDCBA", "C", "EBDA", "AA", "BFB", ""])
@pytest.mark.parametrize("window", [(0, 0, 6, 8), (2, 3, 4, 5), (5, 7, 1, 1)])
def test_cells_are_read_in_the_order_wanted(cells, window):
    row, col, rows, cols = window
    for factor in (1.0, 0.5):
        held, values = in_memory(factor=factor)
        found = held.read(window, list(cells))
        part = values[["ABCDEF".index(cell) for cell in cells]] * np.float32(factor)
        np.testing.assert_array_equal(found, part[:, row : row + rows, col : col + cols])
        assert found.dtype == np.float32
        # Each file that has one of them is opened once.
        of_file = dict(zip("ABCDEF", "111223", strict=True))
        opened = {file.path.name: len(file.reads) for file in held.files if file.reads}
        assert opened == dict.fromkeys({of_file[cell] for cell in cells}, 1)
    np.testing.assert_array_equal(in_memory()[0].read(), in_memory()[1])


@pytest.mark.parametrize(("window", "fits"), WINDOWS)
def test_requests_lie_on_the_lattice(window, fits):
    held, _ = in_memory()
    if fits:
        assert held.read(window, ["D"]).shape == (1, *window[2:])
        return
    with pytest.raises(InputError, match="a window on 6 x 8 pixels") as caught:
        held.read(window, ["D", "X"])
    assert [fault.expected for fault in caught.value.faults][1:] == ["a cell of the rasters"]


@pytest.mark.parametrize(
    ("cols", "cells", "fits"),
    [(32768, "A", True), (32769, "A", False), (16384, "AB", True), (16385, "AB", False)],
)
def test_four_gibibytes_are_the_most(cols, cells, fits):
    lattice = Lattice(CRS, 0.0, 0.0, 1.0, 32768, cols)

    def read(bands, window):  # noqa: ARG001
        raise EOFError

    file = SimpleNamespace(path=Path("1"), cell_ids=tuple("AB"), lattice=lattice, read=read)
    held = RxLevRasters(Path("x"), tuple("AB"), lattice, "level", (file,), ())
    with pytest.raises(EOFError if fits else InputError):
        held.read(None, list(cells))


def test_values_of_each_file_are_checked():
    held, values = in_memory()
    values[4, 5, 7] = 70.0
    assert held.read(None, list("ABC")).shape == (3, 6, 8)
    assert held.read((0, 0, 5, 8)).shape == (6, 5, 8)
    for cells in ("E", "AE", "EF"):
        with pytest.raises(InputError, match=r"2 pixels: expected a level in -300\.\.60 dBm"):
            held.read(None, list(cells))


class Plan(dict):
    """EIRP (dBm) by cell."""

    ids = property(tuple)
    inactive = ()

    def __getitem__(self, cell):
        return SimpleNamespace(eirp_dbm=self.get(cell))


def test_levels_are_eirp_less_losses():
    held, values = in_memory("loss")
    values *= -1
    plan = Plan(A=50.0, B=53.0, E=61.0)
    found = held.read_levels_dbm(plan, (1, 2, 2, 3), ["E", "A"])
    expected = np.array([61.0, 50.0])[:, None, None] - values[[4, 0], 1:3, 2:5]
    np.testing.assert_allclose(found, expected, rtol=1e-6)
    assert found.dtype == np.float32
    at_points = held.levels_dbm(np.float32([[100, 90], [80, 70]]), plan, ["B", "E"])
    np.testing.assert_array_equal(at_points, [[-47, -37], [-19, -9]])
    levels, values = in_memory()
    np.testing.assert_array_equal(levels.read_levels_dbm(Plan()), values)
    with pytest.raises(InputError, match="the deviations of a survey given for its levels"):
        in_memory("deviation")[0].read_levels_dbm(plan)


def test_plan_and_rasters_hold_the_same_cells():
    held, _ = in_memory()
    check_against_plan(held, Plan.fromkeys("FEDCBA"))
    for ids, told in (("ABCDE", ["'F'"]), ("ABCDEFG", ["no band for 'G'"]),
                      ("ABCDEG", ["'F'", "no band for 'G'"])):  # fmt: skip
        with pytest.raises(InputError) as caught:
            check_against_plan(held, Plan.fromkeys(ids))
        assert [fault.got for fault in caught.value.faults] == told


def reached(file, window_m):
    """Whether a file, one pixel larger on each side, overlaps west, south, east and north."""
    pad_m = max(file.resolution_m, LATTICE.resolution_m)
    west_m, north_m = file.west_m - pad_m, file.north_m + pad_m
    east_m = file.west_m + file.cols * file.resolution_m + pad_m
    south_m = file.north_m - file.rows * file.resolution_m - pad_m
    return (west_m < window_m[2] and east_m > window_m[0]
            and south_m < window_m[3] and north_m > window_m[1])  # fmt: skip


def test_files_that_reach_a_window_are_those_that_overlap_it():
    rng, sizes = np.random.default_rng(5), (2.5, 5.0, 10.0)
    files = tuple(
        InMemory(
            Path(f"{n}.tif"), (f"A{n}", f"B{n}"), np.empty(0),
            Lattice(CRS, 385000.0 + 2.5 * int(rng.integers(-2, 14)),
                    6673000.0 - 2.5 * int(rng.integers(-2, 10)), sizes[n % 3],
                    int(rng.integers(1, 4)), int(rng.integers(1, 4))),
            (Path(f"{n}.tif"), Path(f"{n}.prj")),
        )
        for n in range(12)
    )  # fmt: skip
    ids = tuple(cell for file in files for cell in file.cell_ids)
    held = RxLevRasters(Path("x"), ids, LATTICE, "level", files, ())
    counts = set()
    for row in range(6):
        for col in range(8):
            west_m, north_m = 385000.0 + 5 * col, 6673000.0 - 5 * row
            window_m = west_m, north_m - 5, west_m + 5, north_m
            there = [file for file in files if reached(file.lattice, window_m)]
            found = held.reaching((row, col, 1, 1))
            assert found.files == tuple(there)
            assert found.cell_ids == tuple(c for file in there for c in file.cell_ids)
            assert found.parts == tuple(part for file in there for part in file.parts)
            counts.add(len(there))
    assert len(counts) > 3
    assert held.reaching((0, 0, 6, 8)) is held
