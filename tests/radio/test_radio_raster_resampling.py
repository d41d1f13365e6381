"""Rasters of different lattices, put on one by hand and by definition, pixel by pixel."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pyproj
import pytest

from mapfilter.errors import InputError
from mapfilter.lattice import Lattice
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
    # Named is the one that the others are far from, on whichever side of them it lies.
    for west_m, north_m in ((1e6, 1e6), (1e6, 12e6), (-6e6, 12e6)):
        odd = replace(LATTICE, west_m=west_m, north_m=north_m)
        files = [made(), made(odd, path=Path("rasters/odd.tif")), made()]
        with pytest.raises(InputError) as caught:
            common_lattice(files, 2.0, "nearest")
        assert caught.value.faults[0].where == "rasters, with odd.tif"
    other = replace(LATTICE, crs="EPSG:32634")
    with pytest.raises(InputError, match="two systems mixed up"):
        common_lattice([made(), made(other)], None, "nearest")
    # GeoTIFF has the parameters of a system, which were all in the message.
    wkt = pyproj.CRS.from_epsg(3067).to_wkt()
    assert wkt.count('"Longitude of natural origin",27') == 1
    own = wkt.replace('"Longitude of natural origin",27', '"Longitude of natural origin",26')
    # As WKT or by its code, a known system is one.
    known = replace(LATTICE, crs=wkt)
    with pytest.raises(InputError, match=r"as in .*, found EPSG:3067 \(likely"):
        common_lattice([made(), made(known)], None, "nearest")
    other = replace(LATTICE, crs=own)
    with pytest.raises(InputError, match=r"as in .*, found .*TM35FIN\(E,N\) \(likely"):
        common_lattice([made(), made(other)], None, "nearest")


def test_pixels_a_hair_before_a_multiple_are_in_step_with_it():
    # 384999.999 / 5 is 0.9998 pixels on, which is 0 to three digits.
    hair = replace(LATTICE, west_m=384999.999)
    lattice, notes = common_lattice([made(hair), made(replace(hair, rows=7))], None, "nearest")
    assert lattice == replace(hair, rows=7)
    assert len(notes) == 1


@pytest.mark.parametrize("hair", [{"west_m": 384999.999}, {"north_m": 6672999.999}])
def test_pixels_a_hair_before_a_multiple_are_counted_with_those_on_it(hair):
    off = replace(LATTICE, west_m=385002.0, north_m=6673002.0)
    lattices = {"off": off, "hair": replace(LATTICE, **hair), "on": LATTICE}
    files = [made(lattice, path=Path(f"{name}.tif")) for name, lattice in lattices.items()]
    lattice, notes = common_lattice(files, None, "nearest")
    assert (lattice.west_m, lattice.north_m) == pytest.approx((385000, 6673005), abs=0.002)
    assert notes[1].startswith("1 of 3 rasters lie between the pixels")
    assert notes[1].endswith(": off.tif")


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


@pytest.mark.parametrize(("axis", "shift_px", "same"), [
    ("west_m", 0.0009, True), ("west_m", 0.0015, False),
    ("north_m", -0.0009, True), ("north_m", 0.0015, False),
])  # fmt: skip
def test_a_thousandth_of_a_pixel_is_the_same_place(axis, shift_px, same):
    file = made()
    moved = replace(LATTICE, **{axis: getattr(LATTICE, axis) + 5.0 * shift_px})
    found = read_on(file, [0, 1], moved, (1, 1, 4, 6), "bilinear")
    exact = np.array_equal(found, file.values[:, 1:5, 1:7], equal_nan=True)
    assert exact == same
    lattice, _ = common_lattice([made(), made(moved)], None, "nearest")
    more = 0 if same else 1
    assert (lattice.rows - 6, lattice.cols - 8) == ((0, more) if axis == "west_m" else (more, 0))


@pytest.mark.parametrize(("rows", "cols", "side_m", "same"), [
    (49, 2, 5.0001, True), (2, 49, 5.0001, True), (51, 2, 5.0001, False),
    (2, 51, 5.0001, False), (49, 49, 4.9999, True), (3, 51, 4.9999, False),
])  # fmt: skip
def test_pixels_are_those_of_a_lattice_as_long_as_they_do_not_drift_away(rows, cols, side_m, same):
    """A thousandth of a pixel over all rows and columns."""
    source = Lattice(CRS, 385000.0, 6673000.0, side_m, rows, cols)
    file, target = made(source), replace(source, resolution_m=5.0)
    found = read_on(file, [0, 1], target, (0, 0, rows, cols), "bilinear")
    assert np.array_equal(found, file.values, equal_nan=True) == same


@pytest.mark.parametrize(("asked_m", "same"), [(5.0000045, True), (5.000006, False),
                                               (4.9999955, True), (4.999994, False)])  # fmt: skip
def test_a_millionth_of_the_resolution_is_the_same(asked_m, same):
    lattice, _ = common_lattice([made()], asked_m, "nearest")
    assert (lattice == LATTICE) == same


def test_forty_thousand_million_pixels_are_the_most():
    one = Lattice(CRS, 0.0, 1_000_000.0, 5.0, 2, 2)
    corner = Lattice(CRS, 5.0 * 199_998, 10.0, 5.0, 2, 2)
    lattice, _ = common_lattice([made(one), made(corner)], None, "nearest")
    assert (lattice.rows, lattice.cols) == (200_000, 200_000)
    with pytest.raises(InputError) as caught:
        common_lattice([made(one), made(replace(corner, cols=3))], None, "nearest")
    (fault,) = caught.value.faults
    assert fault.where == "rasters, with a.tif"
    assert (fault.expected, fault.got) == (
        "rasters that 4e+10 pixels can cover", "1000 km x 1000 km at 5 m")  # fmt: skip


def test_edges_within_a_thousandth_of_a_pixel_need_no_pixel_more():
    for shift_m in (0.004, -0.004, 0.006, -0.006):
        other = replace(LATTICE, west_m=385000.0 + shift_m, north_m=6673000.0 + shift_m)
        lattice, _ = common_lattice([made(), made(), made(other)], None, "nearest")
        wider = abs(shift_m) > 0.005
        assert (lattice.rows, lattice.cols) == ((7, 9) if wider else (6, 8))
        west_m, north_m = (385000.0 - 5 * (wider and shift_m < 0),
                           6673000.0 + 5 * (wider and shift_m > 0))  # fmt: skip
        assert (lattice.west_m, lattice.north_m) == (west_m, north_m)


def test_files_of_two_systems_are_each_named():
    files = [made(replace(LATTICE, crs=crs), path=Path(f"{n}.tif"))
             for n, crs in enumerate((CRS, "EPSG:32634", CRS, "EPSG:3067"))]  # fmt: skip
    with pytest.raises(InputError) as caught:
        common_lattice(files, None, "nearest")
    assert [(f.where, f.expected, f.got) for f in caught.value.faults] == [
        ("1.tif, CRS", f"{CRS}, as in 0.tif", "EPSG:32634"),
        ("3.tif, CRS", f"{CRS}, as in 0.tif", "EPSG:3067"),
    ]


def test_five_resolutions_are_named():
    files = [made()] + [
        made(Lattice(CRS, 385000.0, 6673000.0, 5.0 * n, 2, 2), path=Path(f"{n}.tif"))
        for n in range(2, 8)
    ]
    notes = common_lattice(files, None, "nearest")[1]
    assert " from 10 m, 15 m, 20 m, 25 m, 30 m to 5 m: " in notes[-1]


def test_only_the_pixels_between_the_outer_ones_are_read():
    reads = []
    file = replace(made(), reads=reads)
    for window, read in (((2, 3, 2, 4), (1, 0, 2, 4)), ((4, 5, 5, 3), (3, 2, 3, 3))):
        lattice = Lattice(CRS, 384985.0, 6673005.0, 5.0, 12, 12)
        read_on(file, [0], lattice, window, "nearest")
        assert reads.pop() == read
    found = read_on(file, [1, 0], Lattice(CRS, 385000.0, 6673000.0, 10.0, 3, 4), (1, 1, 2, 2),
                    "nearest")  # fmt: skip
    assert reads == [(3, 3, 3, 3)]
    np.testing.assert_array_equal(found, file.values[[1, 0]][:, 3:6:2, 3:6:2])


@pytest.mark.parametrize("rows_at_a_time", [1, 2, 3])
def test_strips_of_pixels_that_coincide(monkeypatch, rows_at_a_time):
    reads = []
    file = replace(made(), reads=reads)
    limit_bytes = rows_at_a_time * 4 * 2 * 7
    for limit in (limit_bytes, limit_bytes + 55):
        monkeypatch.setattr(_resampling, "_LARGEST_SOURCE_BYTES", limit)
        found = read_on(file, [0, 1], TARGETS["in step"], (0, 0, 12, 9), "nearest")
        np.testing.assert_array_equal(found[:, 2:8, 2:], file.values[:, :, :7])
        assert np.isnan(found).sum() == 2 * (12 * 9 - 6 * 7) + np.isnan(file.values[:, :, :7]).sum()
    assert reads == [
        (top, 0, rows_at_a_time, 7) for _ in range(2) for top in range(0, 6, rows_at_a_time)
    ]


def test_less_memory_than_a_row_needs_is_a_row(monkeypatch):
    monkeypatch.setattr(_resampling, "_LARGEST_SOURCE_BYTES", 1)
    reads = []
    read_on(replace(made(), reads=reads), [0], TARGETS["in step"], (2, 2, 6, 2), "nearest")
    assert reads == [(row, 0, 1, 2) for row in range(6)]
