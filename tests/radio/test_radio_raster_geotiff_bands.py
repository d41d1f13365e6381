"""GeoTIFF: how bands are written, what is read from those of other programs, and checksums."""

import hashlib
import warnings
from pathlib import Path

import numpy as np
import pytest
import rasterio

from mapfilter.errors import InputError
from mapfilter.lattice import Lattice
from mapfilter.rasters.geotiff import open_geotiff, tag_of
from mapfilter.rasters.geotiff_writer import is_as_written, new_geotiff, write_rasters
from mapfilter.rasters.opening import open_rasters

CRS = "EPSG:32635"
LATTICE = Lattice(CRS, 385000.0, 6673000.0, 5.0, 6, 8)
LEVEL = np.linspace(-110, -60, 48).reshape(6, 8)


class Declared:
    """What a user declares, besides the file."""

    def __init__(self, crs=None, nodata=None, factor=1.0):
        self.crs, self.nodata, self.factor = crs, nodata, factor


def foreign(path, data, *, lattice=LATTICE, names=(), crs=CRS, **more):
    """Write a GeoTIFF as another program might: (bands, rows, cols)."""
    scales, offsets, mask = (more.pop(key, None) for key in ("scales", "offsets", "mask"))
    profile = {"driver": "GTiff", "count": len(data), "height": lattice.rows, "crs": crs,
               "width": lattice.cols, "dtype": data.dtype,
               "transform": rasterio.Affine.from_gdal(*lattice.gdal_transform), **more}  # fmt: skip
    with rasterio.open(path, "w", **profile) as target:
        target.write(data)
        target.descriptions = names or tuple("ABCDEFGHIJKLMNOP"[: len(data)])
        if scales:
            target.scales, target.offsets = scales, offsets
        if mask is not None:
            target.write_mask(mask)
    return path


def opened(path, **declared):
    return open_geotiff(path, "own", Declared(**declared))


def read(path, bands=(0, 1), window=(0, 0, 6, 8), **declared):
    return opened(path, **declared).read(bands, window)


def test_what_is_written_is_recognised_until_a_pixel_changes(tmp_path):
    path = tmp_path / "a.tif"
    level = LEVEL.copy()
    level[2, 3], level[4, 5] = np.nan, np.inf
    tags = {"seed": "7"}
    write_rasters(path, LATTICE, [("A", level), ("B", level - 0.004)], ["A", "B"], tags)
    assert tags == {"seed": "7"}
    assert is_as_written(path)
    rounded = np.round(np.stack([level, level - 0.004]), 2).astype(np.float32)
    rounded[:, 4, 5] = np.nan
    np.testing.assert_array_equal(read(path), rounded)
    digest = hashlib.sha256(rounded.tobytes()).hexdigest()
    assert tag_of(path, "PIXELS_SHA256") == digest
    assert tag_of(path, "MAPFILTER_QUANTITY") == "level"
    assert (tag_of(path, "seed"), tag_of(path, "none")) == ("7", None)
    assert opened(path).tagged
    copy = tmp_path / "b.tif"
    copy.write_bytes(path.read_bytes())
    with rasterio.open(copy, "r+", IGNORE_COG_LAYOUT_BREAK="YES") as target:
        band = target.read(2)
        band[5, 7] += 0.01
        target.write(band, 2)
    assert not is_as_written(copy)
    assert is_as_written(path)
    with rasterio.open(copy, "r+", IGNORE_COG_LAYOUT_BREAK="YES") as target:
        band[5, 7] = rounded[1, 5, 7]
        target.write(band, 2)
    assert is_as_written(copy)


def test_files_of_others_and_none_are_not_as_written(tmp_path):
    other = foreign(tmp_path / "a.tif", LEVEL[None].astype("f4"))
    text = tmp_path / "b.tif"
    text.write_text("no raster")
    for path in (other, text, tmp_path / "none.tif"):
        assert not is_as_written(path)
        assert tag_of(path, "seed") is None
    assert not opened(other).tagged


@pytest.mark.parametrize(("given", "told"), [([], "0"), ([("A", LEVEL)], "1")])
def test_cells_that_are_missing_at_the_end(tmp_path, given, told):
    ids = ["A", "B"][: len(given) + 1]
    with pytest.raises(InputError) as caught:
        write_rasters(tmp_path / "a.tif", LATTICE, given, ids)
    (fault,) = caught.value.faults
    assert (fault.where, fault.expected, fault.got) == ("bands", f"{len(ids)} cells", told)


@pytest.mark.parametrize("shape", [(6, 7), (5, 8), (8, 6)])
def test_bands_have_the_shape_of_the_lattice(tmp_path, shape):
    with pytest.raises(InputError, match=r"band 1 \(A\): expected 6 x 8 pixels"):
        write_rasters(tmp_path / "a.tif", LATTICE, [("A", np.full(shape, -80.0))], ["A"])


@pytest.mark.parametrize(
    ("quantity", "unit"), [("level", "dBm"), ("loss", "dB"), ("deviation", "dB")]
)
def test_bands_have_their_unit(tmp_path, quantity, unit):
    path = tmp_path / "a.tiff"
    write_rasters(path, LATTICE, [("A", LEVEL)], ["A"], quantity=quantity)
    with rasterio.open(path) as source:
        assert (source.units, source.descriptions) == ((unit,), ("A",))
    assert opened(path).quantity == quantity


@pytest.mark.parametrize(("count", "cloud"), [(256, True), (257, False)])
def test_more_than_256_bands_are_written_band_by_band(tmp_path, count, cloud):
    path = tmp_path / "a.tif"
    bands = [(f"C{n}", "dBm") for n in range(count)]
    with new_geotiff(path, LATTICE, bands, {"seed": "1"}) as target:
        target.write(LEVEL.astype("f4"), count)
    with rasterio.open(path) as source:
        form = source.tags(ns="IMAGE_STRUCTURE")
        assert (form.get("LAYOUT") == "COG") == cloud
        assert (form["COMPRESSION"], form["PREDICTOR"]) == ("DEFLATE", "3")
        assert (source.interleaving.name.lower() == "band") != cloud
        assert source.block_shapes[0] == (256, 256)
        assert np.isnan(source.nodatavals).all()
        assert (source.descriptions[0], source.descriptions[-1]) == ("C0", f"C{count - 1}")
        np.testing.assert_array_equal(source.read(count), LEVEL.astype("f4"))
        # What was not written is without data.
        assert np.isnan(source.read(count - 1)).all()


@pytest.mark.parametrize("overviews", ["average", "nearest"])
def test_overviews_of_levels_are_means_and_those_of_numbers_are_not(tmp_path, overviews):
    path, lattice = tmp_path / "a.tif", Lattice(CRS, 385000.0, 6673000.0, 5.0, 400, 600)
    values = np.random.default_rng(1).integers(0, 9, (400, 600)).astype("f4")
    with new_geotiff(path, lattice, [("A", "")], {}, overviews=overviews) as target:
        target.write(values, 1)
    with rasterio.open(path) as source:
        assert source.overviews(1)[0] == 2
        assert source.block_shapes == [(256, 256)]
        half = source.read(1, out_shape=(200, 300))
    blocks = values.reshape(200, 2, 300, 2)
    if overviews == "average":
        np.testing.assert_allclose(half, blocks.mean(axis=(1, 3)), atol=1e-5)
    else:
        assert (half[:, None, :, None] == blocks).any(axis=(1, 3)).all()
        assert np.abs(half - blocks.mean(axis=(1, 3))).max() > 1
    with new_geotiff(path, lattice, [("A", "")], {}) as target:
        target.write(values, 1)
    with rasterio.open(path) as source:
        assert set(np.unique(source.read(1, out_shape=(200, 300)))) <= set(range(9))


def test_levels_are_written_with_means_for_overviews(tmp_path):
    path, lattice = tmp_path / "a.tif", Lattice(CRS, 385000.0, 6673000.0, 5.0, 600, 600)
    values = np.random.default_rng(1).uniform(-90, -60, (600, 600)).round(2)
    write_rasters(path, lattice, [("A", values)], ["A"])
    with rasterio.open(path) as source:
        half = source.read(1, out_shape=(300, 300))
    expected = values.reshape(300, 2, 300, 2).mean(axis=(1, 3))
    np.testing.assert_allclose(half, expected, atol=1e-3)


def test_bands_and_windows_are_read_in_the_order_wanted(tmp_path):
    data = np.random.default_rng(2).uniform(-90, -60, (3, 6, 8)).astype("f4")
    path = foreign(tmp_path / "a.tif", data)
    np.testing.assert_array_equal(read(path, [2, 0], (1, 3, 4, 2)), data[[2, 0], 1:5, 3:5])
    assert opened(path).cell_ids == ("A", "B", "C")
    assert opened(path).described


@pytest.mark.parametrize(
    ("scales", "offsets"),
    [((0.5, 1.0), (0.0, 0.0)), ((1.0, 2.0), (0.0, 0.0)), ((1.0, 1.0), (-3.0, 0.0)),
     ((1.0, 1.0), (0.0, 4.0)), ((0.5, 2.0), (1.0, -1.0))],
)  # fmt: skip
def test_scales_and_offsets_of_each_band(tmp_path, scales, offsets):
    data = np.random.default_rng(2).integers(-90, -60, (2, 6, 8)).astype("i2")
    path = foreign(tmp_path / "a.tif", data, scales=scales, offsets=offsets)
    expected = data * np.array(scales)[:, None, None] + np.array(offsets)[:, None, None]
    # A number that means no data is one as stored.
    expected[data == -70] = np.nan
    found = read(path, nodata=-70)
    np.testing.assert_array_equal(found, expected.astype("f4"))
    assert found.dtype == np.float32
    np.testing.assert_array_equal(read(path, [1], nodata=-70), expected[1:].astype("f4"))


def test_numbers_are_not_scaled_twice(tmp_path):
    """Tenths of a dB, with the scale in the file: a factor of 0.1, too, would give -7 dBm."""
    data = np.random.default_rng(2).integers(-900, -600, (2, 6, 8)).astype("i2")
    path = foreign(tmp_path / "a.tif", data, scales=(0.1, 0.1), offsets=(0.0, 0.0))
    np.testing.assert_allclose(open_rasters(path, "level").read(), data / 10, atol=1e-4)
    with pytest.raises(InputError, match=r"its own scale, 0\.1, .* found a factor of 0\.1 .*leave"):
        open_rasters(path, "level", factor=0.1)
    plain = foreign(tmp_path / "b.tif", data, scales=(1.0, 1.0), offsets=(0.0, 0.0))
    np.testing.assert_allclose(
        open_rasters(plain, "level", factor=0.1).read(), data / 10, atol=1e-4
    )


def test_masks_and_numbers_that_mean_no_data(tmp_path):
    data = np.random.default_rng(3).integers(-90, -60, (2, 6, 8)).astype("i2")
    mask = np.ones((6, 8), dtype=bool)
    mask[2, 3:5] = False
    expected = data.astype("f4")
    expected[:, ~mask] = np.nan
    path = foreign(tmp_path / "a.tif", data, mask=mask)
    np.testing.assert_array_equal(read(path), expected)
    data[0, 1, 1] = -9999
    expected = data.astype("f4")
    expected[0, 1, 1] = np.nan
    path = foreign(tmp_path / "b.tif", data, nodata=-9999)
    np.testing.assert_array_equal(read(path), expected)
    np.testing.assert_array_equal(read(path, [1]), expected[1:])
    path = foreign(tmp_path / "c.tif", data)
    np.testing.assert_array_equal(read(path), data)
    np.testing.assert_array_equal(read(path, nodata=-9999.0), expected)
    assert (opened(path).nodata, opened(path, nodata=-9999.0).nodata) == ((), (-9999.0,))
    path = foreign(tmp_path / "d.tif", np.where(data == -9999, np.inf, data).astype("f4"))
    np.testing.assert_array_equal(read(path), expected)


def test_files_beside_it_belong_to_it(tmp_path):
    path = foreign(tmp_path / "a.tif", LEVEL[None].astype("f4"))
    assert opened(path).parts == (path,)
    beside = tmp_path / "a.tif.aux.xml"
    beside.write_text("<PAMDataset></PAMDataset>")
    (tmp_path / "b.tif").write_bytes(path.read_bytes())
    assert opened(path).parts == (path, beside)


def test_a_band_without_a_name_is_called_by_the_file(tmp_path):
    data = LEVEL[None].astype("f4")
    one = opened(foreign(tmp_path / "a.tif", data, names=(None,)))
    assert (one.cell_ids, one.described, one.quantity) == (("own",), False, None)
    names = ("A", *[None] * 12)
    with pytest.raises(InputError) as caught:
        opened(foreign(tmp_path / "b.tif", np.repeat(data, 13, axis=0), names=names))
    (fault,) = caught.value.faults
    # Ten of the twelve are named.
    assert fault.where.endswith("b.tif, band 2, 3, 4, 5, 6, 7, 8, 9, 10, 11")


@pytest.mark.parametrize(
    ("own", "declared", "told"),
    [
        (CRS, None, None),
        (CRS, CRS, None),
        (None, CRS, None),
        (CRS, "EPSG:3067", "EPSG:3067, as declared"),
        (None, None, "a projected CRS in metres"),
    ],
)
def test_the_file_s_crs_and_the_declared_one(tmp_path, own, declared, told):
    path = foreign(tmp_path / "a.tif", LEVEL[None].astype("f4"), crs=own)
    if told is None:
        assert opened(path, crs=declared).lattice == LATTICE
        return
    with pytest.raises(InputError) as caught:
        opened(path, crs=declared)
    assert [fault.expected for fault in caught.value.faults] == [told]


def test_names_of_files(tmp_path):
    for name in ("a.TIF", "a.Tiff"):
        write_rasters(Path(tmp_path / name), LATTICE, [("A", LEVEL)], ["A"])
        assert is_as_written(tmp_path / name)


@pytest.mark.parametrize("action", ["ignore", "error", "default"])
def test_a_file_without_a_place_is_told_whatever_warnings_are_for(tmp_path, action):
    path = tmp_path / "a.tif"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        foreign(path, LEVEL[None].astype("f4"), transform=None)
        warnings.simplefilter(action)
        with pytest.raises(InputError, match="transform: expected where the pixels lie"):
            opened(path)
