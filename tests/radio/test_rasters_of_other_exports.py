"""Rasters as tools export them that are no levels on square metres: what messages say of them."""

import numpy as np
import pytest
import rasterio
from rasterio.transform import Affine

from mapfilter._area_scale import SWAPPED, check_scale
from mapfilter.check.findings import Findings
from mapfilter.check.raster_checks import sampled
from mapfilter.errors import InputError
from mapfilter.rasters.files import check_plausible
from mapfilter.rasters.opening import open_rasters

CRS = "EPSG:32635"
PLACE = Affine(5, 0, 385_000, 0, -5, 6_673_000)
LEVELS = np.linspace(-120, -60, 400, dtype=np.float32).reshape(20, 20)


def write(path, values, crs=CRS, place=PLACE, unit=None):
    rows, cols = values.shape
    layout = {"driver": "GTiff", "width": cols, "height": rows, "count": 1, "dtype": "float32"}
    with rasterio.open(path, "w", crs=crs, transform=place, **layout) as target:
        target.write(values.astype(np.float32), 1)
        if unit:
            target.units = [unit]
    return path


def fault_of(path, **options):
    with pytest.raises(InputError) as caught:
        open_rasters(path, **options)
    (fault,) = caught.value.faults
    return str(fault)


@pytest.mark.parametrize(
    ("unit", "remedy"),
    [("mW", "10 log10"), ("W", "10 log10"), ("dBW", "add 30 dB"), ("dBµV/m", "received levels")],
)
def test_units_of_other_quantities_are_named(tmp_path, unit, remedy):
    """With a declared quantity they were read as levels, without one the unit was not named."""
    path = write(tmp_path / "A1.tif", LEVELS, unit=unit)
    for quantity in (None, "level"):
        told = fault_of(path, quantity=quantity)
        assert f"found {unit!r}" in told
        assert remedy in told


def test_pixels_in_degrees_have_one_fault(tmp_path):
    """Their sides were called oblong metres as well."""
    place = Affine(9e-5, 0, 24.93, 0, -4.5e-5, 60.18)
    told = fault_of(write(tmp_path / "A1.tif", LEVELS, "EPSG:4326", place), quantity="level")
    assert "a projected CRS in metres" in told


def test_oblong_pixels_and_how_they_become_square(tmp_path):
    place = Affine(5, 0, 385_000, 0, -6, 6_673_000)
    told = fault_of(write(tmp_path / "A1.tif", LEVELS, place=place), quantity="level")
    assert "gdalwarp -tr 5 5 -r bilinear A1.tif TO.tif" in told


def test_powers_are_no_levels(tmp_path):
    with pytest.raises(InputError, match="powers in W or mW"):
        check_plausible(10 ** (LEVELS / 10), "level", tmp_path / "A1.tif")
    with pytest.raises(InputError, match="path losses"):
        check_plausible(-LEVELS, "level", tmp_path / "A1.tif")


def test_exchanged_axes_are_named():
    """They were said to be of another region."""
    check_scale(CRS, (385_000, 6_672_000, 386_000, 6_673_000), "rasters")
    with pytest.raises(InputError, match=SWAPPED):
        check_scale(CRS, (6_672_000, 385_000, 6_673_000, 386_000), "rasters")
    with pytest.raises(InputError, match="another region"):
        check_scale("EPSG:3857", (2_770_000, 8_430_000, 2_771_000, 8_431_000), "rasters")


@pytest.mark.parametrize(
    ("name", "remedy"),
    [
        ("A1.bin", "write a .hdr beside it"),
        ("A1.grc", "classes of Vertical Mapper, without levels"),
        ("A1.xyz", "prediction.survey.files"),
        ("A1.img", "gdal_translate FROM TO.tif converts others, such as A1.img"),
    ],
)
def test_a_folder_of_other_formats_and_what_to_do(tmp_path, name, remedy):
    (tmp_path / name).write_bytes(b"x")
    assert remedy in fault_of(tmp_path, quantity="level")


@pytest.mark.parametrize(
    ("values", "cause"),
    [
        (10 ** (LEVELS / 10), "powers in W or mW"),
        (np.repeat([1.0, 2.0, 3.0, 2.0], 100).reshape(20, 20), "raster of the best server"),
    ],
)
def test_likely_causes_of_values(tmp_path, values, cause):
    path = write(tmp_path / "A1.tif", values)
    findings = Findings()
    sampled(open_rasters(path, "level"), None, 256, findings)
    assert any(cause in one.evidence for one in findings.found)
