"""Rasters of different lattices, put on one by hand and by definition, pixel by pixel."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from mapfilter.errors import InputError
from mapfilter.geodesy import Lattice
from mapfilter.rasters import resampling as _resampling
from mapfilter.rasters.raster_set import RxLevRasters
from mapfilter.rasters.resampling import common_lattice, read_on

CRS = "EPSG:32635"
LATTICE = Lattice(CRS, 385000.0, 6673000.0, 5.0, 6, 8)


@dataclass(frozen=True)
class InMemory:
    """A raster file whose pixels are an array."""

    lattice: Lattice
    values: np.ndarray
    path: Path = Path("rasters/a.tif")
    cell_ids: tuple[str, ...] = ("A", "B")
    parts: tuple[Path, ...] = ()
    reads: tuple = ()

    def read(self, bands, window):
        row, col, rows, cols = window
        assert min(row, col) >= 0
        assert row + rows <= self.lattice.rows
        assert col + cols <= self.lattice.cols
        if isinstance(self.reads, list):
            self.reads.append(window)
        return self.values[list(bands), row : row + rows, col : col + cols].astype(np.float32)


def made(lattice=LATTICE, seed=1, **more):
    rng = np.random.default_rng(seed)
    values = rng.uniform(-100, -60, (2, lattice.rows, lattice.cols)).astype(np.float32)
    values[1, 2:3, 3:4] = np.nan
    return InMemory(lattice, values, **more)


def by_definition(file, lattice, window, resampling):
    source = file.lattice
    row, col, rows, cols = window
    found = np.full((2, rows, cols), np.nan)
    for i in range(rows):
        for j in range(cols):
            east = lattice.west_m + (col + j + 0.5) * lattice.resolution_m
            north = lattice.north_m - (row + i + 0.5) * lattice.resolution_m
            down = (source.north_m - north) / source.resolution_m
            right = (east - source.west_m) / source.resolution_m
            # On an edge the later pixel.
            r, c = int(np.floor(down + 1e-6)), int(np.floor(right + 1e-6))
            if not (0 <= r < source.rows and 0 <= c < source.cols):
                continue
            found[:, i, j] = file.values[:, r, c]
            if resampling == "nearest":
                continue
            for band in np.flatnonzero(~np.isnan(found[:, i, j])):
                total = weights = 0.0
                for a in range(source.rows):
                    for b in range(source.cols):
                        share = max(0, 1 - abs(down - a - 0.5)) * max(0, 1 - abs(right - b - 0.5))
                        if share and not np.isnan(file.values[band, a, b]):
                            total += share * file.values[band, a, b]
                            weights += share
                found[band, i, j] = total / weights
    return found


TARGETS = {
    "the same": LATTICE,
    "in step": Lattice(CRS, 384990.0, 6673010.0, 5.0, 12, 9),
    "half a pixel off": Lattice(CRS, 385002.5, 6673002.5, 5.0, 7, 8),
    "a third off": Lattice(CRS, 384998.3, 6672998.3, 5.0, 7, 9),
    "finer": Lattice(CRS, 384999.0, 6673001.0, 2.0, 16, 21),
    "coarser": Lattice(CRS, 384988.0, 6673003.0, 12.0, 4, 6),
    "elsewhere": Lattice(CRS, 386000.0, 6673000.0, 5.0, 3, 3),
}


@pytest.mark.parametrize("resampling", ["nearest", "bilinear"])
@pytest.mark.parametrize("name", TARGETS)
def test_pixels_by_definition(name, resampling):
    file, lattice = made(), TARGETS[name]
    for window in ((0, 0, lattice.rows, lattice.cols), (1, 2, 2, 1)):
        found = read_on(file, [0, 1], lattice, window, resampling)
        kind = "nearest" if name in ("the same", "in step") else resampling
        expected = by_definition(file, lattice, window, kind)
        np.testing.assert_allclose(found, expected, rtol=1e-5)
    assert read_on(file, [1], lattice, (0, 0, 1, 1), resampling).shape == (1, 1, 1)


def test_strips_that_fit_into_memory_give_the_same(monkeypatch):
    lattice = TARGETS["coarser"]
    window = (0, 0, lattice.rows, lattice.cols)
    whole = read_on(made(), [0, 1], lattice, window, "nearest")
    monkeypatch.setattr(_resampling, "_LARGEST_SOURCE_BYTES", 2 * 4 * 8 * 2)
    reads = []
    parts = read_on(replace(made(), reads=reads), [0, 1], lattice, window, "nearest")
    np.testing.assert_array_equal(parts, whole)
    assert len(reads) > 1
    assert all(rows <= 2 for _, _, rows, _ in reads)


def test_one_lattice_needs_nothing():
    assert common_lattice([made(), made()], None, "nearest") == (LATTICE, ())
    assert common_lattice([made()], 5.000001, "nearest") == (LATTICE, ())


def test_other_extents_are_covered():
    near = replace(LATTICE, west_m=385020.0, north_m=6672985.0)
    lattice, notes = common_lattice([made(near), made()], None, "nearest")
    assert lattice == Lattice(CRS, 385000.0, 6673000.0, 5.0, 9, 12)
    assert notes == (
        "rasters of different extents: put on 9 x 12 pixels of 5 m that cover all of them",
    )


def test_the_lattice_is_in_step_with_most_files():
    off = replace(LATTICE, west_m=385002.0, north_m=6672999.0)
    files = [made(off, path=Path(f"{n}.tif")) for n in "ab"] + [made(path=Path("c.tif"))]
    lattice, notes = common_lattice(files, None, "bilinear")
    # The western edge of the third is a part of a pixel farther out: a whole one is added.
    assert lattice == Lattice(CRS, 384997.0, 6673004.0, 5.0, 7, 9)
    assert notes[1] == (
        "1 of 3 rasters lie between the pixels of the lattice (by -0.40 pixels east, "
        "+0.20 north), resampled (bilinear): c.tif"
    )
    assert len(notes) == 2


def test_other_resolutions_are_named():
    coarse = Lattice(CRS, 385000.0, 6673000.0, 10.0, 3, 4)
    files = [made()] + [made(coarse, path=Path(f"{n}.tif")) for n in "abcd"]
    lattice, notes = common_lattice(files, None, "nearest")
    assert lattice == LATTICE
    assert notes == (
        "4 of 5 rasters resampled (nearest) from 10 m to 5 m: a.tif, b.tif, c.tif and 1 more",
    )
    lattice, notes = common_lattice(files, 10.0, "nearest")
    assert lattice == coarse
    assert notes == ("1 of 5 rasters resampled (nearest) from 5 m to 10 m: a.tif",)
    # A resolution of none of them: multiples of it from the origin of the system.
    lattice, _ = common_lattice([made()], 4.0, "nearest")
    assert lattice == Lattice(CRS, 385000.0, 6673000.0, 4.0, 8, 10)
    lattice, _ = common_lattice([made()], 7.0, "nearest")
    assert lattice == Lattice(CRS, 385000.0, 6673002.0, 7.0, 5, 6)


def test_files_far_apart_or_of_two_systems():
    far = replace(LATTICE, west_m=385000.0 + 5e6, north_m=6673000.0 - 5e6)
    with pytest.raises(InputError, match="a raster of another place"):
        common_lattice([made(), made(far)], None, "nearest")
    other = replace(LATTICE, crs="EPSG:32634")
    with pytest.raises(InputError, match="two systems mixed up"):
        common_lattice([made(), made(other)], None, "nearest")


def test_pixels_a_hair_before_a_multiple_are_in_step_with_it():
    # 384999.999 / 5 is 0.9998 pixels on, which is 0 to three digits.
    hair = replace(LATTICE, west_m=384999.999)
    lattice, notes = common_lattice([made(hair), made(replace(hair, rows=7))], None, "nearest")
    assert lattice == replace(hair, rows=7)
    assert len(notes) == 1


def set_of(*lattices):
    """Return a set with one file, of one cell, on each lattice."""
    files = tuple(
        made(lattice, path=Path(f"{n}.tif"), cell_ids=(f"C{n}",), parts=(Path(f"{n}.tif"),))
        for n, lattice in enumerate(lattices)
    )
    ids = tuple(cell_id for file in files for cell_id in file.cell_ids)
    return RxLevRasters(Path("rasters"), ids, LATTICE, "level", files, ())


def test_files_that_reach_a_window_by_a_pixel():
    # Pixels of columns 0 to 3, and of 5 to 7: each file may be needed one pixel beside its own.
    left, right = replace(LATTICE, cols=4), replace(LATTICE, west_m=385025.0, cols=3)
    rasters = set_of(left, right)
    assert rasters.reaching((0, 0, 6, 8)) is rasters
    for col, cols, ids in [
        (0, 4, ("C0",)),
        (0, 5, ("C0", "C1")),
        (4, 1, ("C0", "C1")),
        (5, 1, ("C1",)),
        (3, 1, ("C0",)),
        (5, 3, ("C1",)),
    ]:
        assert rasters.reaching((0, col, 6, cols)).cell_ids == ids, (col, cols)
    upper = set_of(replace(LATTICE, rows=2))
    for row, ids in [(0, ("C0",)), (2, ("C0",)), (3, ())]:
        found = upper.reaching((row, 0, 1, 8))
        assert found.cell_ids == ids
        assert found.parts == ((Path("0.tif"),) if ids and found is not upper else ())
