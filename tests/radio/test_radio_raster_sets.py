"""Folders of rasters on different lattices: found, named, put on one lattice."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rasterio
from hypothesis import given, settings
from hypothesis import strategies as st
from raster_files import write_ascii, write_bil

from mapfilter._io import sha256_file
from mapfilter.errors import InputError
from mapfilter.lattice import Lattice
from mapfilter.rasters.geotiff_writer import write_rasters
from mapfilter.rasters.opening import open_rasters

CRS = "EPSG:32635"
FINE = Lattice(CRS, 385000.0, 6673000.0, 5.0, 12, 16)
COARSE = Lattice(CRS, 385000.0, 6673000.0, 10.0, 6, 8)


def _values(lattice: Lattice, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-110, -60, (lattice.rows, lattice.cols)).round(1)


def _plane(lattice: Lattice) -> np.ndarray:
    """A plane in space: bilinear weights give it back exactly."""
    east_m, north_m = lattice.east_north(*np.mgrid[: lattice.rows, : lattice.cols])
    return np.asarray(-90 + 0.1 * (east_m - 385000) + 0.2 * (north_m - 6673000))


def _geotiff(path: Path, lattice: Lattice, values: np.ndarray, **more: Any) -> Path:
    names, unit = more.pop("names", (None,)), more.pop("unit", None)
    profile = {
        "driver": "GTiff",
        "width": lattice.cols,
        "height": lattice.rows,
        "count": 1,
        "dtype": "float32",
        "crs": lattice.crs,
        "transform": rasterio.Affine.from_gdal(*lattice.gdal_transform),
        **more,
    }
    with rasterio.open(path, "w", **profile) as target:
        target.write(values.astype(profile["dtype"]), 1)
        target.descriptions = names
        if unit:
            target.units = (unit,)
    return path


def _complaint(folder: Path, **options: Any) -> str:
    with pytest.raises(InputError) as caught:
        open_rasters(folder, **{"quantity": "level", "crs": CRS, **options})
    return str(caught.value)


def test_a_geotiff_per_cell_named_by_file_or_band(tmp_path: Path) -> None:
    _geotiff(tmp_path / "S1A.tif", FINE, _values(FINE), unit="dBm")
    _geotiff(tmp_path / "other.tiff", FINE, _values(FINE, 1), names=("S1B",), unit="dBm")
    (tmp_path / "S1A.tif.aux.xml").write_text("<x/>")
    (tmp_path / ".hidden.tif").write_text("x")
    (tmp_path / "notes.csv").write_text("a,b\n")
    rasters = open_rasters(tmp_path)
    assert rasters.cell_ids == ("S1A", "S1B")
    assert (rasters.lattice, rasters.quantity, rasters.notes) == (FINE, "level", ())
    np.testing.assert_array_equal(
        rasters.read((2, 3, 4, 5), ["S1B", "S1A"]),
        np.array([_values(FINE, 1), _values(FINE)], dtype=np.float32)[:, 2:6, 3:8],
    )


def test_bands_that_are_all_called_alike_are_named_by_their_files(tmp_path: Path) -> None:
    for name in ("A", "B"):
        _geotiff(tmp_path / f"{name}.tif", FINE, _values(FINE), names=("Signal level",))
    rasters = open_rasters(tmp_path, "level")
    assert rasters.cell_ids == ("A", "B")
    assert "all bands are called 'Signal level'" in rasters.notes[0]


def test_bands_and_files_may_be_mixed(tmp_path: Path) -> None:
    write_rasters(
        tmp_path / "many.tif", FINE, [("A", _values(FINE)), ("B", _values(FINE))], ["A", "B"]
    )
    write_ascii(tmp_path / "C.asc", FINE, _values(FINE))
    write_bil(tmp_path / "D.bil", FINE, _values(FINE).astype("f4"))
    rasters = open_rasters(tmp_path, "level", crs=CRS)
    assert rasters.cell_ids == ("C", "D", "A", "B")
    values = rasters.read(None, ["A", "C", "D", "B"])
    for other in values[1:]:
        np.testing.assert_allclose(other, values[0], rtol=1e-6)


def test_what_is_declared_must_not_contradict_the_file(tmp_path: Path) -> None:
    write_rasters(tmp_path / "a.tif", FINE, [("A", _values(FINE))], ["A"])
    assert "expected loss, as declared, found level" in _complaint(tmp_path, quantity="loss")
    assert "two systems mixed up" in _complaint(tmp_path, crs="EPSG:3067")
    _geotiff(tmp_path / "B.tif", FINE, _values(FINE), unit="dB")
    assert "found level and loss" in _complaint(tmp_path, quantity=None)
    (tmp_path / "B.tif").unlink()
    _geotiff(tmp_path / "B.tif", FINE, _values(FINE))
    assert "set quantity = level or loss" in _complaint(tmp_path, quantity=None)


def test_a_crs_is_declared_for_files_without(tmp_path: Path) -> None:
    _geotiff(tmp_path / "A.tif", FINE, _values(FINE), crs=None)
    assert "CRS left out on export" in _complaint(tmp_path, crs=None)
    assert open_rasters(tmp_path, "level", crs=CRS).lattice == FINE


def test_files_of_two_systems_are_told(tmp_path: Path) -> None:
    for name, crs in (("A", CRS), ("B", "EPSG:3067")):
        _geotiff(tmp_path / f"{name}.tif", replace(FINE, crs=crs), _values(FINE))
    assert "B.tif, CRS: expected EPSG:32635, as in A.tif" in _complaint(tmp_path, crs=None)


def test_faults_of_all_files_are_told_together(tmp_path: Path) -> None:
    for name in ("A", "B", "C"):
        (tmp_path / f"{name}.tif").write_text("cut off")
    assert _complaint(tmp_path).count("cut off, or no raster") == 3


def test_one_cell_in_two_files(tmp_path: Path) -> None:
    write_ascii(tmp_path / "A.asc", FINE, _values(FINE))
    write_bil(tmp_path / "A.bil", FINE, _values(FINE).astype("i2"))
    assert "found 'A' in A.asc and A.bil" in _complaint(tmp_path)


def test_empty_folders_and_names_that_are_no_ids(tmp_path: Path) -> None:
    assert _complaint(tmp_path).endswith("found none in this folder")
    (tmp_path / "A.grd").write_bytes(b"DSBB")
    assert "gdal_translate FROM TO.tif converts others, such as A.grd" in _complaint(tmp_path)
    write_ascii(tmp_path / "a..b.asc", FINE, _values(FINE))
    assert "an id of 1..128 characters" in _complaint(tmp_path)


@pytest.mark.parametrize("option", ["factor", "nodata", "resolution_m"])
def test_options_that_make_no_sense(tmp_path: Path, option: str) -> None:
    assert f"rasters, {option}: expected" in _complaint(tmp_path, **{option: float("nan")})


def test_the_checksum_covers_every_part(tmp_path: Path) -> None:
    one = write_ascii(tmp_path / "A.asc", FINE, _values(FINE))
    assert open_rasters(one, "level", crs=CRS).sha256() == sha256_file(one)
    path = write_bil(tmp_path / "B.bil", FINE, _values(FINE).astype("i2"))
    before = open_rasters(tmp_path, "level", crs=CRS).sha256()
    assert open_rasters(tmp_path, "level", crs=CRS).sha256() == before
    header = path.with_suffix(".hdr")
    header.write_text(header.read_text() + "COMMENT x\n")
    assert open_rasters(tmp_path, "level", crs=CRS).sha256() != before


def test_coarse_pixels_hold_the_fine_ones(tmp_path: Path) -> None:
    _geotiff(tmp_path / "A.tif", FINE, _values(FINE))
    _geotiff(tmp_path / "B.tif", COARSE, _values(COARSE))
    rasters = open_rasters(tmp_path, "level")
    assert rasters.lattice == FINE
    expected = np.repeat(np.repeat(_values(COARSE), 2, axis=0), 2, axis=1).astype(np.float32)
    np.testing.assert_array_equal(rasters.read()[1], expected)
    assert rasters.notes == ("1 of 2 rasters resampled (nearest) from 10 m to 5 m: B.tif",)


def test_a_plane_survives_bilinear_weights(tmp_path: Path) -> None:
    _geotiff(tmp_path / "A.tif", FINE, _plane(FINE))
    _geotiff(tmp_path / "B.tif", COARSE, _plane(COARSE))
    rasters = open_rasters(tmp_path, "level", resampling="bilinear")
    fine, coarse = rasters.read()
    np.testing.assert_allclose(coarse[1:-1, 1:-1], fine[1:-1, 1:-1], atol=1e-4)
    assert not np.isnan(coarse).any()


def test_bilinear_by_hand(tmp_path: Path) -> None:
    """At a quarter pixel from the first of two centres: three quarters of it, one of the other."""
    lattice = Lattice(CRS, 385000.0, 6673000.0, 10.0, 1, 3)
    _geotiff(tmp_path / "A.tif", lattice, np.array([[-100.0, -60.0, np.nan]]))
    rasters = open_rasters(tmp_path / "A.tif", "level", resolution_m=5.0, resampling="bilinear")
    expected = [-100, -90, -70, -60, np.nan, np.nan]
    np.testing.assert_allclose(rasters.read()[0], [expected, expected])


def test_half_a_pixel_between_rasters_is_told(tmp_path: Path) -> None:
    for name in ("A", "B"):
        _geotiff(tmp_path / f"{name}.tif", FINE, _plane(FINE))
    off = replace(FINE, west_m=FINE.west_m + 2.5)
    _geotiff(tmp_path / "C.tif", off, _plane(off))
    rasters = open_rasters(tmp_path, "level", resampling="bilinear")
    assert rasters.lattice == replace(FINE, cols=17)
    assert "(by +0.50 pixels east, +0.00 north), resampled (bilinear): C.tif" in rasters.notes[1]
    values = rasters.read()
    np.testing.assert_allclose(values[2][:, 2:15], values[0][:, 2:15], atol=1e-4)


def test_a_resolution_that_is_asked_for(tmp_path: Path) -> None:
    _geotiff(tmp_path / "A.tif", FINE, _values(FINE))
    rasters = open_rasters(tmp_path, "level", resolution_m=15.0)
    assert rasters.lattice == Lattice(CRS, 384990.0, 6673005.0, 15.0, 5, 6)
    east_m, north_m = rasters.lattice.east_north(2, 3)
    row, col = FINE.row_col(east_m, north_m)
    assert rasters.read()[0, 2, 3] == np.float32(_values(FINE)[row, col])


@pytest.mark.parametrize("resampling", ["nearest", "bilinear"])
@given(data=st.data())
@settings(max_examples=40)
def test_windows_of_resampled_rasters_are_parts_of_the_whole(
    tmp_path_factory: pytest.TempPathFactory, resampling: Any, data: st.DataObject
) -> None:
    folder = tmp_path_factory.mktemp("mixed")
    for name in ("A", "B", "C"):
        lattice = Lattice(
            CRS,
            385000.0 + data.draw(st.integers(-40, 40)) / 4,
            6673000.0 + data.draw(st.integers(-40, 40)) / 4,
            data.draw(st.sampled_from([2.0, 5.0, 7.5])),
            data.draw(st.integers(1, 9)),
            data.draw(st.integers(1, 9)),
        )
        values = _values(lattice)
        values[0, 0] = -9999
        write_bil(folder / f"{name}.bil", lattice, values.astype("f4"))
    rasters = open_rasters(folder, "level", crs=CRS, resampling=resampling)
    whole, size = rasters.read(), (rasters.lattice.rows, rasters.lattice.cols)
    row, col = (data.draw(st.integers(0, n - 1)) for n in size)
    rows, cols = (data.draw(st.integers(1, n - at)) for n, at in zip(size, (row, col), strict=True))
    part = rasters.read((row, col, rows, cols), ["B", "C"])
    np.testing.assert_array_equal(part, whole[1:, row : row + rows, col : col + cols])


def test_nearest_against_looking_every_centre_up(tmp_path: Path) -> None:
    odd = Lattice(CRS, 385001.3, 6672998.1, 3.7, 9, 11)
    _geotiff(tmp_path / "A.tif", FINE, _values(FINE))
    _geotiff(tmp_path / "B.tif", odd, _values(odd))
    rasters = open_rasters(tmp_path, "level")
    lattice = rasters.lattice
    east_m, north_m = lattice.east_north(*np.mgrid[: lattice.rows, : lattice.cols])
    for source, found in zip((FINE, odd), rasters.read(), strict=True):
        row, col = source.row_col(east_m, north_m)
        inside = source.contains(row, col)
        expected = np.full(inside.shape, np.nan, dtype=np.float32)
        expected[inside] = _values(source)[row[inside], col[inside]]
        np.testing.assert_array_equal(found, expected)


def test_a_raster_of_another_place_is_told(tmp_path: Path) -> None:
    _geotiff(tmp_path / "A.tif", FINE, _values(FINE))
    swapped = replace(FINE, west_m=6673000.0, north_m=385000.0)
    _geotiff(tmp_path / "B.tif", swapped, _values(FINE))
    assert "a raster of another place" in _complaint(tmp_path, crs=None)


@pytest.mark.parametrize("count", [3, 30])
def test_a_fault_that_many_files_share_is_told_once(count: int, tmp_path: Path) -> None:
    names = [f"{chr(97 + n % 26)}{'xyz'[n // 26]}" for n in range(count)]
    for name in names:
        _geotiff(tmp_path / f"{name}.tif", COARSE, _values(COARSE), crs="EPSG:4326", unit="dBm")
    with pytest.raises(InputError) as caught:
        open_rasters(tmp_path)
    lines = str(caught.value).splitlines()
    assert len(lines) == (3 if count == 3 else 1)
    if count > 3:
        three = "ax.tif, ay.tif, bx.tif and 27 more"
        assert lines[0].startswith(f"{tmp_path}, 30 of 30 rasters ({three}), CRS: expected ")


def test_another_fault_of_one_file_is_told_beside_that_of_many(tmp_path: Path) -> None:
    for name in ("a", "b", "c", "d", "e"):
        _geotiff(tmp_path / f"{name}.tif", COARSE, _values(COARSE), crs="EPSG:4326", unit="dBm")
    (tmp_path / "f.tif").write_bytes((tmp_path / "e.tif").read_bytes()[:100])
    with pytest.raises(InputError) as caught:
        open_rasters(tmp_path)
    lines = str(caught.value).splitlines()
    assert len(lines) == 2
    assert "5 of 6 rasters (a.tif, b.tif, c.tif and 2 more), CRS: expected" in lines[0]
    assert lines[1].startswith(f"{tmp_path / 'f.tif'}: expected ")
