"""What makes several files one set of rasters: options, quantities, names, notes, checksums."""

import hashlib

import numpy as np
import pytest
import rasterio
from raster_files import INDEX_HEADER, index_row, write_ascii, write_bil

from mapfilter.errors import InputError
from mapfilter.lattice import Lattice
from mapfilter.rasters.opening import is_raster_folder, open_rasters

CRS = "EPSG:32635"
LATTICE = Lattice(CRS, 385000.0, 6673000.0, 5.0, 6, 8)
LEVEL = np.linspace(-110, -60, 48).reshape(6, 8).round()


def geotiff(path, *names, units=(), tag="", values=LEVEL, lattice=LATTICE):
    profile = {"driver": "GTiff", "width": lattice.cols, "height": lattice.rows, "crs": CRS,
               "count": max(len(names), 1), "dtype": "float32",
               "transform": rasterio.Affine.from_gdal(*lattice.gdal_transform)}  # fmt: skip
    with rasterio.open(path, "w", **profile) as target:
        for band, name in enumerate(names or (None,), start=1):
            target.write(values.astype("f4"), band)
            target.set_band_description(band, name)
        target.units = units or (None,) * target.count
        if tag:
            target.update_tags(MAPFILTER_QUANTITY=tag)
    return path


def faults(*arguments, **options):
    with pytest.raises(InputError) as caught:
        open_rasters(*arguments, **options)
    return [f"{fault.where.rpartition('/')[2]}: {fault.expected}" for fault in caught.value.faults]


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"crs": " "}, ["crs"]),
        ({"factor": 0.0}, ["factor"]),
        ({"factor": np.inf}, ["factor"]),
        ({"nodata": np.nan}, ["nodata"]),
        ({"resolution_m": 0.0}, ["resolution_m"]),
        ({"resolution_m": -5.0}, ["resolution_m"]),
        ({"resolution_m": np.inf}, ["resolution_m"]),
        (
            {"crs": "", "factor": np.nan, "nodata": np.nan, "resolution_m": np.nan},
            ["crs", "factor", "nodata", "resolution_m"],
        ),
    ],
)
def test_each_option_is_checked(tmp_path, options, told):
    found = faults(tmp_path, "level", **options)
    assert [one.partition(":")[0].rpartition(" ")[2] for one in found] == told


def test_options_that_just_are(tmp_path):
    path = geotiff(tmp_path / "A.tif")
    held = open_rasters(path, "level", factor=-0.5, nodata=np.inf, resolution_m=5.0)
    assert (held.factor, held.lattice, held.resampling) == (-0.5, LATTICE, "nearest")
    assert open_rasters(path, "level").factor == 1.0
    fine = open_rasters(path, "level", resolution_m=0.5).lattice
    assert (fine.rows, fine.cols, fine.resolution_m) == (60, 80, 0.5)


def test_which_folders_hold_rasters(tmp_path):
    assert not is_raster_folder(tmp_path)
    (tmp_path / "x.tif").mkdir()
    (tmp_path / ".a.tif").write_text("hidden")
    (tmp_path / "a.csv").write_text("a table")
    assert not is_raster_folder(tmp_path)
    assert faults(tmp_path, "level")[0].endswith(" or an index of them")
    (tmp_path / "A.ASC").write_text("a grid")
    assert is_raster_folder(tmp_path)
    assert not is_raster_folder(tmp_path / "A.ASC")


def test_a_file_without_anything_in_it_is_no_raster(tmp_path):
    for name in ("A.tif", "A.asc", "A.bil", "A.any"):
        (tmp_path / name).touch()
        assert faults(tmp_path / name, "level") == [f"{name}: a raster file"]
    assert len(faults(tmp_path, "level")) == 3


def test_rasters_in_folders_of_bands_are_named(tmp_path):
    for band in ("L800", "L1800"):
        (tmp_path / band).mkdir()
        (tmp_path / band / "A.asc").write_text("a grid")
    with pytest.raises(InputError, match=r"they are in folders in it \(L1800, L800\): name one"):
        open_rasters(tmp_path, "level")


QUANTITIES = [
    (None, [("", "dBm"), ("", "dBm")], "level"),
    (None, [("loss", ""), ("", "dB")], "loss"),
    (None, [("", "dBm"), ("", "dB")], "levels or losses in all files"),
    (None, [("", "dBm"), ("", "")], "a quantity of the bands, levels (dBm) or losses (dB)"),
    (None, [("", ""), ("", "")], "a quantity of the bands, levels (dBm) or losses (dB)"),
    ("level", [("", "dB"), ("", "")], "level"),
    ("loss", [("loss", ""), ("", "dBm")], "loss"),
    ("level", [("", "dBm"), ("loss", "")], "level, as declared"),
]


@pytest.mark.parametrize(("declared", "stated", "quantity"), QUANTITIES)
def test_one_quantity_of_all_files(tmp_path, declared, stated, quantity):
    for name, (tag, unit) in zip("AB", stated, strict=True):
        geotiff(tmp_path / f"{name}.tif", units=(unit,), tag=tag)
    if quantity in ("level", "loss"):
        assert open_rasters(tmp_path, declared).quantity == quantity
    else:
        assert [one.partition(": ")[2] for one in faults(tmp_path, declared)] == [quantity]


def test_names_of_bands_and_of_files(tmp_path):
    geotiff(tmp_path / "A.tif", "Band 1")
    assert open_rasters(tmp_path, "level").cell_ids == ("Band 1",)
    geotiff(tmp_path / "B.tif")
    geotiff(tmp_path / "C.tif", "C1", "C2")
    assert open_rasters(tmp_path, "level").cell_ids == ("Band 1", "B", "C1", "C2")
    geotiff(tmp_path / "D.tif", "Band 1")
    held = open_rasters(tmp_path, "level")
    assert held.cell_ids == ("A", "B", "C1", "C2", "D")
    assert held.notes == ("cells are named by their files: all bands are called 'Band 1'",)
    geotiff(tmp_path / "E.tif", "other")
    assert faults(tmp_path, "level") == [f"{tmp_path.name}: each cell once"]
    (tmp_path / "D.tif").unlink()
    assert open_rasters(tmp_path, "level").cell_ids == ("Band 1", "B", "C1", "C2", "other")
    write_ascii(tmp_path / "F..G.asc", LATTICE, LEVEL)
    geotiff(tmp_path / "C1.tif")
    told = faults(tmp_path, "level", crs=CRS)
    assert [one.partition(":")[0] for one in told] == [tmp_path.name, "F..G.asc, name"]


def test_files_of_an_index_have_one_band_and_the_name_of_their_row(tmp_path):
    geotiff(tmp_path / "a.tif", "Band 1")
    geotiff(tmp_path / "b.tif", "Band 1")
    index = tmp_path / "index.txt"
    rows = [index_row(name, tmp_path / f"{name.lower()}.tif", LATTICE, 32) for name in "BA"]
    index.write_text(INDEX_HEADER + "".join(rows))
    held = open_rasters(tmp_path, "level")
    assert (held.cell_ids, held.notes) == (("B", "A"), ())
    assert held.parts == (tmp_path / "b.tif", tmp_path / "a.tif", index)
    geotiff(tmp_path / "b.tif", "B", "C")
    assert faults(index, "level") == ["b.tif: one band per file of an index"]


def test_the_same_note_of_several_rasters_is_counted(tmp_path):
    rows = []
    for name in "ABC":
        write_bil(tmp_path / f"{name}.bil", LATTICE, LEVEL.astype("i2"))
        rows.append(f"{name};{name}.bil;5;385002.5;385037.5;6672972.5;6672997.5;16\n")
    (tmp_path / "index.txt").write_text(INDEX_HEADER + "".join(rows))
    held = open_rasters(tmp_path, "level", crs=CRS)
    assert held.notes == ("area limits are centres of pixels in the index (3 rasters)",)
    assert repr(held) == (f"<RxLevRasters {tmp_path.name}: level of 3 cells, {LATTICE}>")


def test_the_checksum_is_that_of_the_file_or_of_names_and_checksums(tmp_path):
    def digest(path):
        return hashlib.sha256(path.read_bytes()).hexdigest()

    one = write_ascii(tmp_path / "A.asc", LATTICE, LEVEL)
    two = write_bil(tmp_path / "B.bil", LATTICE, LEVEL.astype("i2"))
    header = two.with_suffix(".hdr")
    assert open_rasters(one, "level", crs=CRS).sha256() == digest(one)
    lines = [f"{path.name} {digest(path)}\n" for path in (one, two, header)]
    for path, text in ((tmp_path, lines), (two, lines[1:])):
        expected = hashlib.sha256("".join(text).encode()).hexdigest()
        assert open_rasters(path, "level", crs=CRS).sha256() == expected
