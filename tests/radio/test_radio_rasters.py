"""RxLev rasters: round trips, determinism and files that nobody should send."""

import contextlib
import struct
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rasterio
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from rasterio.errors import NotGeoreferencedWarning

from mapfilter.errors import InputError, OutputError
from mapfilter.lattice import Lattice
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.rasters.geotiff_writer import write_rasters
from mapfilter.rasters.opening import open_rasters
from mapfilter.rasters.raster_set import check_against_plan

LATTICE = Lattice("EPSG:32635", 385000.0, 6673000.0, 5.0, 300, 280)
IDS = ("A", "B", "C")


def _values(lattice: Lattice = LATTICE, count: int = 3) -> NDArray[np.float32]:
    values = np.random.default_rng(0).normal(-80, 10, (count, lattice.rows, lattice.cols))
    values[:, :20, :30] = np.nan
    return values.astype(np.float32)


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("rasters") / "rxlev.tif"
    write_rasters(path, LATTICE, zip(IDS, _values(), strict=True), IDS, {"seed": "1"})
    return path


def _foreign(path: Path, **changes: Any) -> Path:
    """Write a GeoTIFF as another program might."""
    profile = {
        "driver": "GTiff",
        "width": 8,
        "height": 6,
        "count": 2,
        "dtype": "float32",
        "crs": "EPSG:32635",
        "transform": rasterio.Affine(5, 0, 385000, 0, -5, 6673000),
    }
    names = changes.pop("names", ("A", "B"))
    units = changes.pop("units", ("dBm", "dBm"))
    data = changes.pop("data", None)
    scales = changes.pop("scales", None)
    profile.update(changes)
    if data is None:
        data = np.full((profile["count"], profile["height"], profile["width"]), -80)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", NotGeoreferencedWarning)
        with rasterio.open(path, "w", **profile) as target:
            target.write(data.astype(profile["dtype"]))
            target.descriptions = names
            target.units = units
            if scales:
                target.scales = scales
    return path


def _complaint(path: Path) -> str:
    with pytest.raises(InputError) as caught:
        open_rasters(path)
    return str(caught.value)


def test_round_trip_to_a_hundredth_of_a_decibel(written: Path) -> None:
    rasters = open_rasters(written)
    assert rasters.cell_ids == IDS
    assert rasters.lattice == LATTICE
    assert rasters.quantity == "level"
    expected = np.round(_values().astype(np.float64), 2).astype(np.float32)
    np.testing.assert_array_equal(rasters.read(), expected)


@given(st.integers(0, 299), st.integers(0, 279), st.integers(1, 300), st.integers(1, 280))
@settings(max_examples=30)
def test_a_window_is_a_part_of_the_whole(
    written: Path, row: int, col: int, rows: int, cols: int
) -> None:
    rasters = open_rasters(written)
    rows, cols = min(rows, 300 - row), min(cols, 280 - col)
    part = rasters.read((row, col, rows, cols), ["C", "A"])
    whole = rasters.read()[[2, 0], row : row + rows, col : col + cols]
    np.testing.assert_array_equal(part, whole)


def test_equal_values_give_equal_bytes(written: Path, tmp_path: Path) -> None:
    again = tmp_path / "other name.tif"
    write_rasters(again, LATTICE, zip(IDS, _values(), strict=True), IDS, {"seed": "1"})
    assert again.read_bytes() == written.read_bytes()


def test_it_is_a_cloud_optimised_geotiff_that_says_what_it_is(written: Path) -> None:
    with rasterio.open(written) as source:
        assert source.tags(ns="IMAGE_STRUCTURE")["LAYOUT"] == "COG"
        assert source.descriptions == IDS
        assert source.units == ("dBm",) * 3
        assert source.tags()["seed"] == "1"
        assert np.isnan(source.nodata)


def test_losses_become_levels_by_eirp(tmp_path: Path) -> None:
    lattice = Lattice("EPSG:32635", 385000.0, 6673000.0, 5.0, 2, 3)
    path = tmp_path / "loss.tif"
    write_rasters(path, lattice, [("A", np.full((2, 3), 120.0))], ["A"], quantity="loss")
    rasters = open_rasters(path)
    plan = CellPlan("EPSG:32635", (Cell("A", "A", 385000, 6673000, 30, None, 50, 1800, "omni"),))
    assert rasters.quantity == "loss"
    np.testing.assert_array_equal(rasters.read_levels_dbm(plan), np.full((1, 2, 3), -70.0))


def test_foreign_nodata_scale_and_unit(tmp_path: Path) -> None:
    data = np.full((2, 6, 8), -8000)
    data[0, 0, 0] = -32768
    path = _foreign(
        tmp_path / "x.tif", data=data, dtype="int16", nodata=-32768, scales=(0.01, 0.01)
    )
    values = open_rasters(path).read()
    assert np.isnan(values[0, 0, 0])
    np.testing.assert_allclose(values[1], -80.0)


def test_unknown_quantity_is_asked_for(tmp_path: Path) -> None:
    path = _foreign(tmp_path / "x.tif", units=(None, None))
    assert "levels (dBm) or losses (dB)" in _complaint(path)
    assert open_rasters(path, "level").quantity == "level"


def test_losses_taken_for_levels_are_told(tmp_path: Path) -> None:
    path = _foreign(tmp_path / "x.tif", data=np.full((2, 6, 8), 120.0))
    with pytest.raises(InputError, match="path losses, or raw RXLEV, given for levels"):
        open_rasters(path).read()


@pytest.mark.parametrize("best", [63, 58])
@pytest.mark.parametrize("missing", [None, -110.0])
def test_raw_rxlev_taken_for_levels_is_told(
    tmp_path: Path, missing: float | None, best: int
) -> None:
    rxlev = np.random.default_rng(3).integers(0, best, (2, 6, 8)).astype(float)
    rxlev[0, 0, :2] = 0, best
    if missing is not None:
        rxlev[1, :3] = missing
    path = _foreign(tmp_path / "x.tif", data=rxlev)
    with pytest.raises(InputError, match=rf"dBm.*, found .*\.\.{best}.*likely: .*raw RXLEV"):
        open_rasters(path).read()


def test_a_few_levels_above_0_dbm_are_fine(tmp_path: Path) -> None:
    data = np.full((2, 6, 8), -60.0)
    data[:, :2] = 12.0
    assert open_rasters(_foreign(tmp_path / "x.tif", data=data)).read().max() == 12.0


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"crs": None}, "CRS left out on export"),
        ({"crs": "EPSG:4326"}, "degrees given for metres"),
        ({"transform": rasterio.Affine.identity()}, "where the pixels lie"),
        ({"transform": rasterio.Affine(5, 1, 385000, 1, -5, 6673000)}, "a rotated raster"),
        ({"transform": rasterio.Affine(5, 0, 385000, 0, -4, 6673000)}, "square pixels"),
        ({"transform": rasterio.Affine(5, 0, 385000, 0, 5, 6673000)}, "upside down"),
        ({"names": ("A", None)}, "band 2: expected a cell id"),
        ({"names": ("A", "A")}, "'A' 2 times"),
        ({"names": ("A", "../B")}, "without /"),
        ({"dtype": "complex64"}, "real numbers"),
    ],
)
def test_foreign_rasters_that_will_not_do(
    tmp_path: Path, changes: dict[str, Any], said: str
) -> None:
    assert said in _complaint(_foreign(tmp_path / "x.tif", **changes))


def test_all_faults_are_told_together(tmp_path: Path) -> None:
    complaint = _complaint(_foreign(tmp_path / "x.tif", crs=None, names=("A", None)))
    assert "CRS" in complaint
    assert "band 2" in complaint


def test_missing_empty_folder_and_other_files(tmp_path: Path) -> None:
    assert "No such file" in _complaint(tmp_path / "none.tif")
    assert "found none in this folder" in _complaint(tmp_path)
    (tmp_path / "empty.tif").write_bytes(b"")
    assert "an empty file" in _complaint(tmp_path / "empty.tif")
    (tmp_path / "text.tif").write_text("cell,lat,lon\n")
    assert "cut off, or no raster" in _complaint(tmp_path / "text.tif")


@pytest.mark.parametrize("share", [0.001, 0.01, 0.3, 0.9, 0.999])
def test_cut_off_files_are_refused_when_opened(written: Path, tmp_path: Path, share: float) -> None:
    whole = written.read_bytes()
    path = tmp_path / "cut.tif"
    path.write_bytes(whole[: int(share * len(whole))])
    assert "cut off" in _complaint(path)


def test_damaged_pixels_are_told_when_read(written: Path, tmp_path: Path) -> None:
    data = bytearray(written.read_bytes())
    data[len(data) // 2 :] = bytes(len(data) - len(data) // 2)
    path = tmp_path / "damaged.tif"
    path.write_bytes(data)
    with pytest.raises(InputError, match="cut off or damaged"):
        open_rasters(path).read()


# rasterio's own logger stumbles over GDAL messages that quote bytes which are no text.
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@given(st.data())
@settings(max_examples=50, derandomize=True)
def test_damaged_bytes_are_told_or_harmless(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    lattice = Lattice("EPSG:32635", 385000.0, 6673000.0, 5.0, 12, 9)
    path = tmp_path_factory.mktemp("damaged") / "x.tif"
    write_rasters(path, lattice, [("A", np.full((12, 9), -80.0))], ["A"])
    content = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    path.write_bytes(content)
    with contextlib.suppress(InputError):
        rasters = open_rasters(path)
        if rasters.lattice.rows * rasters.lattice.cols < 10**6:
            rasters.read()


def _tiff_header(width: int, height: int, rows_per_strip: int) -> bytes:
    """Return a classic TIFF of one IFD that promises pixels which are not there."""
    entries = [
        (256, 4, 1, width),
        (257, 4, 1, height),
        (258, 3, 1, 32),
        (259, 3, 1, 1),
        (262, 3, 1, 1),
        (273, 4, 1, 8),
        (277, 3, 1, 1),
        (278, 4, 1, rows_per_strip),
        (279, 4, 1, 2**32 - 1),
        (339, 3, 1, 3),
    ]
    body = b"".join(struct.pack("<HHII", *entry) for entry in entries)
    return b"II*\0" + struct.pack("<I", 8) + struct.pack("<H", len(entries)) + body + b"\0" * 4


@pytest.mark.parametrize(
    ("width", "height", "strip"),
    [(2**31 - 1, 2**31 - 1, 1), (32768, 32768, 32768), (65536, 16384, 1), (1000, 1000, 1000)],
)
def test_headers_that_promise_gigabytes_are_refused_at_once(
    tmp_path: Path, width: int, height: int, strip: int
) -> None:
    path = tmp_path / "huge.tif"
    path.write_bytes(_tiff_header(width, height, strip))
    with pytest.raises(InputError):
        open_rasters(path, "level")


def test_requests_off_the_lattice_or_for_unknown_cells(written: Path) -> None:
    rasters = open_rasters(written)
    for window in ((-1, 0, 5, 5), (0, 0, 0, 5), (299, 0, 2, 5), (0, 276, 5, 5)):
        with pytest.raises(InputError, match="a window on 300 x 280"):
            rasters.read(window)
    with pytest.raises(InputError, match="'Z'"):
        rasters.read(None, ["A", "Z"])
    assert rasters.read((0, 0, 4, 5), []).shape == (0, 4, 5)


def test_written_in_order_and_complete_or_not_at_all(tmp_path: Path) -> None:
    path = tmp_path / "x.tif"
    values = _values()
    for items, said in (
        ([("B", values[0])], "expected 'A'"),
        ([("A", values[0][:5])], "300 x 280 pixels"),
        ([("A", values[0])], "3 cells"),
        (list(zip((*IDS, "D"), (*values, values[0]), strict=True)), "no more cells"),
    ):
        with pytest.raises(InputError, match=said):
            write_rasters(path, LATTICE, items, IDS)
    assert list(tmp_path.iterdir()) == []


def test_an_old_file_survives_a_failed_write(written: Path, tmp_path: Path) -> None:
    path = tmp_path / "x.tif"
    path.write_bytes(b"old")
    with pytest.raises(InputError):
        write_rasters(path, LATTICE, [], IDS)
    assert path.read_bytes() == b"old"
    with pytest.raises(OutputError, match=r"\.tif"):
        write_rasters(tmp_path / "x.png", LATTICE, [], IDS)
    with pytest.raises(OutputError):
        write_rasters(written / "below" / "x.tif", LATTICE, [], IDS)


def test_cells_of_rasters_and_plan_are_compared_both_ways(written: Path) -> None:
    cells = tuple(
        Cell(name, "S", 385000, 6673000, 30, None, 50, 1800, "omni") for name in ("A", "B", "D")
    )
    with pytest.raises(InputError) as caught:
        check_against_plan(open_rasters(written), CellPlan("EPSG:32635", cells))
    assert "found 'C'" in str(caught.value)
    assert "no band for 'D'" in str(caught.value)


def test_a_set_and_a_plan_are_printed_in_one_line(written: Path) -> None:
    held = "level of 3 cells, 300 x 280 pixels of 5 m (1.4 x 1.5 km), EPSG:32635"
    assert repr(open_rasters(written)) == f"<RxLevRasters rxlev.tif: {held}>"
    cells = tuple(Cell(i, "S", 0.0, 0.0, 30.0, 0.0, 50.0, 1800.0) for i in IDS)
    assert repr(CellPlan(LATTICE.crs, cells)) == "<CellPlan: 3 cells at 1 site, EPSG:32635>"
