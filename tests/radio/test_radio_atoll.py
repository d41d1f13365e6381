"""Indexes of raw rasters: half a pixel exactly right, and indexes that do not fit their files."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import rasterio
from raster_files import HDR, INDEX_HEADER, index_row, write_bil

from mapfilter.errors import InputError
from mapfilter.lattice import Lattice
from mapfilter.rasters.opening import open_rasters
from mapfilter.rasters.raster_set import RxLevRasters

CRS = "EPSG:32635"
LATTICE = Lattice(CRS, 385000.0, 6673000.0, 5.0, 6, 8)
LOSS = (np.arange(48).reshape(6, 8) + 100).astype(np.int16)


def _write(folder: Path, index: str, **options: object) -> Path:
    path = write_bil(folder / "a.bil", LATTICE, LOSS, **options)  # type: ignore[arg-type]
    (folder / "index.txt").write_text(INDEX_HEADER + index, encoding="utf-8")
    return path


def _open(folder: Path, factor: float = 1.0) -> RxLevRasters:
    return open_rasters(folder, "loss", crs=CRS, factor=factor)


def _complaint(folder: Path) -> str:
    with pytest.raises(InputError) as caught:
        _open(folder)
    return str(caught.value)


def test_header_centres_and_index_edges_are_the_same_place(tmp_path: Path) -> None:
    """Worked by hand: the corner 385000, 6673000 has its first pixel's centre at +2.5, -2.5."""
    path = _write(tmp_path, index_row("Tx 1", tmp_path / "a.bil", LATTICE))
    header = path.with_suffix(".hdr").read_text()
    assert "ULXMAP 385002.5" in header
    assert "ULYMAP 6672997.5" in header
    index = (tmp_path / "index.txt").read_text()
    assert "385000.0;385040.0;6672970.0;6673000.0" in index
    rasters = _open(tmp_path)
    assert rasters.lattice == LATTICE
    assert rasters.cell_ids == ("Tx 1",)
    np.testing.assert_array_equal(rasters.read()[0], LOSS)
    assert rasters.notes == ()


def test_gdal_sees_the_same_pixels_at_the_same_place(tmp_path: Path) -> None:
    path = _write(tmp_path, index_row("A", tmp_path / "a.bil", LATTICE), order="M")
    with rasterio.open(path) as source:
        assert source.transform.to_gdal() == LATTICE.gdal_transform
        np.testing.assert_array_equal(source.read(1), _open(tmp_path).read()[0])


def test_without_a_header_the_index_places_the_raster(tmp_path: Path) -> None:
    path = _write(tmp_path, index_row("A", tmp_path / "a.bil", LATTICE))
    path.with_suffix(".hdr").unlink()
    rasters = _open(tmp_path)
    assert rasters.lattice == LATTICE
    np.testing.assert_array_equal(rasters.read()[0], LOSS)


def test_a_header_without_place_is_placed_by_the_index(tmp_path: Path) -> None:
    lines = [line for line in HDR.splitlines() if not line.startswith(("UL", "XDIM", "YDIM"))]
    _write(tmp_path, index_row("A", tmp_path / "a.bil", LATTICE), header="\n".join(lines))
    assert _open(tmp_path).lattice == LATTICE


@pytest.mark.parametrize("shift_px", [-0.5, 0.5])
def test_half_a_pixel_off_is_told(tmp_path: Path, shift_px: float) -> None:
    _write(tmp_path, index_row("A", tmp_path / "a.bil", LATTICE), shift_px=shift_px)
    said = _complaint(tmp_path)
    assert f"a.bil shifted by {shift_px:+.2f} pixels east, {-shift_px:+.2f} north" in said
    assert "half a pixel: a corner where the header has to hold the pixel's centre" in said


def test_an_index_of_centres_is_understood(tmp_path: Path) -> None:
    inner = "385002.5;385037.5;6672972.5;6672997.5"
    _write(tmp_path, f"A;a.bil;5;{inner};16\n")
    rasters = _open(tmp_path)
    assert rasters.lattice == LATTICE
    assert rasters.notes == ("area limits are centres of pixels in the index",)


def test_a_raster_may_reach_beyond_its_area(tmp_path: Path) -> None:
    _write(tmp_path, "A;a.bil;5;385010;385020;6672980;6672990;16\n")
    assert "beyond their areas" in _open(tmp_path).notes[0]


@pytest.mark.parametrize(
    ("row", "said"),
    [
        ("A;a.bil;5;385100;385140;6672970;6673000;16", "index and rasters of different runs"),
        ("A;a.bil;5;384000;386000;6672000;6674000;16", "index and rasters of different runs"),
        ("A;a.bil;10;385000;385040;6672970;6673000;16", "RESOLUTION: expected 10, found 5"),
        ("A;a.bil;5;385000;385040;6672970;6673000;8", "NBITS: expected 8, found 16"),
        ("A;a.bil;5;385040;385000;6672970;6673000;16", "XMIN < XMAX"),
        ("A;a.bil;0;385000;385040;6672970;6673000;16", "metres > 0"),
        ("A;a.bil;x;385000;385040;6672970;6673000;16", "RESOLUTION: expected a number"),
        ("A;none.bil;5;385000;385040;6672970;6673000;16", "rasters moved elsewhere"),
        ("A;../a.bil;5;385000;385040;6672970;6673000;16", "FILE_NAME: expected the name"),
        ("A;..\\a.bil;5;385000;385040;6672970;6673000;16", "FILE_NAME: expected the name"),
        ("A;/etc/passwd;5;385000;385040;6672970;6673000;16", "FILE_NAME: expected the name"),
        ("A;C:\\a.bil;5;385000;385040;6672970;6673000;16", "FILE_NAME: expected the name"),
        ("A;;5;385000;385040;6672970;6673000;16", "FILE_NAME: expected the name"),
        ("../A;a.bil;5;385000;385040;6672970;6673000;16", "TX_NAME: expected an id"),
        ("A;a.bil;5;385000", "fields: expected 8, found 4"),
        ("A;a.bil;;;;;\nA;a.bil;;;;;", "fields: expected 8, found 7"),
        ("A;a.bil;;;;;;\nA;a.bil;;;;;;", "row 3, TX_NAME: expected each cell once"),
    ],
)
def test_indexes_that_do_not_fit(tmp_path: Path, row: str, said: str) -> None:
    _write(tmp_path, row + "\n")
    assert said in _complaint(tmp_path)


def test_links_do_not_lead_out_of_the_folder(tmp_path: Path) -> None:
    outside, inside = tmp_path / "outside", tmp_path / "inside"
    outside.mkdir()
    inside.mkdir()
    path = write_bil(outside / "a.bil", LATTICE, LOSS)
    (inside / "a.bil").symlink_to(path)
    (inside / "index.txt").write_text(INDEX_HEADER + index_row("A", path, LATTICE))
    told = _complaint(inside)
    assert "FILE_NAME: expected the name of a file" in told
    assert "found 'a.bil', a link out of the folder (likely: rasters linked" in told
    assert "moved elsewhere" not in told
    (inside / "a.bil").unlink()
    (inside / "a.bil").symlink_to(inside / "none.bil")
    assert "moved elsewhere" in _complaint(inside)
    linked = tmp_path / "linked"
    linked.symlink_to(outside)
    (outside / "index.txt").write_text(INDEX_HEADER + index_row("A", path, LATTICE))
    assert _open(linked).cell_ids == ("A",)


def test_capitals_decimal_commas_and_a_folder_below(tmp_path: Path) -> None:
    below = tmp_path / "losses"
    below.mkdir()
    write_bil(below / "b.bil", LATTICE, LOSS)
    write_bil(tmp_path / "a.bil", LATTICE, LOSS)
    text = index_row("B", Path("losses\\b.bil"), LATTICE) + "A;A.BIL;5,0;;;;;\n"
    (tmp_path / "index.csv").write_text(INDEX_HEADER.lower() + text.replace(".0;", ",0;"))
    assert _open(tmp_path).cell_ids == ("B", "A")
    assert open_rasters(tmp_path / "index.csv", "loss", crs=CRS).cell_ids == ("B", "A")


def test_two_indexes_are_one_too_many(tmp_path: Path) -> None:
    _write(tmp_path, index_row("A", tmp_path / "a.bil", LATTICE))
    (tmp_path / "old.csv").write_text(INDEX_HEADER)
    assert "found index.txt, old.csv" in _complaint(tmp_path)


def test_transmitters_of_different_areas_are_put_on_one_lattice(tmp_path: Path) -> None:
    near = replace(LATTICE, west_m=385020.0, north_m=6672985.0)
    rows = index_row("A", tmp_path / "a.bil", LATTICE) + index_row("B", tmp_path / "b.bil", near)
    _write(tmp_path, rows)
    write_bil(tmp_path / "b.bil", near, LOSS)
    rasters = _open(tmp_path)
    assert rasters.lattice == Lattice(CRS, 385000.0, 6673000.0, 5.0, 9, 12)
    values = rasters.read()
    np.testing.assert_array_equal(values[0, :6, :8], LOSS)
    np.testing.assert_array_equal(values[1, 3:, 4:], LOSS)
    assert np.isnan(values).sum() == 2 * (9 * 12 - 48)
    assert rasters.notes == (
        "rasters of different extents: put on 9 x 12 pixels of 5 m that cover all of them",
    )


def test_sixteenths_of_a_decibel(tmp_path: Path) -> None:
    sixteenths = (LOSS * 16).astype(np.int16)
    sixteenths[0, 0] = -9999
    write_bil(tmp_path / "a.bil", LATTICE, sixteenths)
    (tmp_path / "index.txt").write_text(INDEX_HEADER + "A;a.bil;;;;;;\n")
    values = _open(tmp_path, factor=1 / 16).read()[0]
    assert np.isnan(values[0, 0])
    np.testing.assert_array_equal(values[1:], LOSS[1:])
    with pytest.raises(InputError, match="factor left out, or the wrong byte order"):
        _open(tmp_path).read()
    write_bil(tmp_path / "a.bil", LATTICE, LOSS)
    with pytest.raises(InputError, match="a factor that is not the file's"):
        _open(tmp_path, factor=1 / 16).read()


def test_an_index_may_name_geotiffs_and_raw_pixels_of_any_suffix(tmp_path: Path) -> None:
    profile = {
        "driver": "GTiff",
        "width": 8,
        "height": 6,
        "count": 1,
        "dtype": "int16",
        "crs": CRS,
        "transform": rasterio.Affine.from_gdal(*LATTICE.gdal_transform),
    }
    with rasterio.open(tmp_path / "a.tif", "w", **profile) as target:
        target.write(LOSS, 1)
    write_bil(tmp_path / "b.bil", LATTICE, LOSS + 1).rename(tmp_path / "b.los")
    rows = index_row("A", Path("a.tif"), LATTICE) + index_row("B", Path("b.los"), LATTICE)
    (tmp_path / "index.txt").write_text(INDEX_HEADER + rows)
    rasters = _open(tmp_path)
    assert rasters.cell_ids == ("A", "B")
    np.testing.assert_array_equal(rasters.read(), np.stack([LOSS, LOSS + 1]))
    # Outside an index the same file is none.
    with pytest.raises(InputError, match="a raster that GDAL can read"):
        open_rasters(tmp_path / "b.los", "loss", crs=CRS)
