"""Wrong RxLev rasters: one message, exit code 2, and the older database stays as it was."""

import warnings

import numpy as np
import pytest
import rasterio
from command_line import assert_done, assert_refused, contents, mapfilter, settings
from rasterio.errors import NotGeoreferencedWarning
from rasterio.transform import Affine


@pytest.fixture
def rewrite(own_world):
    """Write the world's rasters anew, changed; keep everything else."""

    def rewrite(ids=("A", "B", "C"), values=None, **changes):
        with rasterio.open(own_world.rasters) as source:
            data, profile = source.read(), source.profile
        profile |= {"driver": "GTiff", "count": len(ids), **changes}
        profile = {key: value for key, value in profile.items() if value is not None}
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", NotGeoreferencedWarning)
            target = rasterio.open(own_world.rasters, "w", **profile)
        with target:
            for band, name in enumerate(ids, start=1):
                target.write(data[(band - 1) % 3] if values is None else values(data[0]), band)
                if name:
                    target.set_band_description(band, name)
                target.set_band_unit(band, "dBm")

    return rewrite


def assert_build_refused(world, *told, given=()):
    before = contents(world.folder)
    for more in ((), ("--dry-run",)):
        assert_refused(mapfilter("build", "-c", world.toml, *given, *more), *told)
    assert contents(world.folder) == before


def test_rewritten_rasters_are_fine_as_they_are(own_world, rewrite):
    rewrite()
    assert_done(mapfilter("build", "-c", own_world.toml))


@pytest.mark.parametrize(
    ("size", "told"),
    [
        (None, "found No such file or directory"),
        (0, "found an empty file"),
        (0.0001, "cut off, or no raster"),
        (0.01, "the file is cut off"),
        (0.5, "the file is cut off"),
        (0.98, "the file is cut off"),
    ],
)
@pytest.mark.parametrize("command", ["build", "simulate", "info"])
def test_missing_empty_or_truncated(command, size, told, own_world):
    whole = own_world.rasters.read_bytes()
    own_world.rasters.unlink()
    if size is not None:
        own_world.rasters.write_bytes(whole[: int(size * len(whole))])
    before = contents(own_world.folder)
    args = [own_world.rasters] if command == "info" else ["-c", own_world.toml]
    if command == "info" and size is None:
        told = "expected a database, raster file or log, found nothing there"
    assert_refused(mapfilter(command, *args), "rxlev.tif", told)
    assert contents(own_world.folder) == before


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"crs": None}, "CRS: expected a projected CRS in metres, found none"),
        ({"crs": "EPSG:4326"}, "degrees given for metres"),
        ({"crs": "EPSG:3857"}, "EPSG:3857, of which 100 m are"),
        ({"crs": "EPSG:32634"}, "(likely: rasters and roads of different places)"),
    ],
)
def test_crs(changes, told, own_world, rewrite):
    rewrite(**changes)
    assert_build_refused(own_world, told)


def test_another_crs_than_the_area(own_world):
    given = settings(area__crs="EPSG:3067")
    told = "CRS: expected EPSG:3067, the CRS of the area, found EPSG:32635"
    assert_build_refused(own_world, "rxlev.tif", told, given=given)
    before = contents(own_world.folder)
    assert_refused(mapfilter("simulate", "-c", own_world.toml, *given), told)
    assert contents(own_world.folder) == before


@pytest.mark.parametrize(
    ("transform", "told"),
    [
        (lambda t: t @ Affine.rotation(10), "found a rotated raster"),
        (lambda t: t @ Affine.scale(1, 2), "expected square pixels"),
        (lambda t: t @ Affine.scale(1, -1), "a raster upside down or mirrored"),
        (lambda _: Affine.identity(), "expected where the pixels lie"),
        (lambda t: Affine.translation(3000, 0) @ t, "rasters and roads of different places"),
        (lambda _: Affine(0.00009, 0, 24.942, 0, -0.00009, 60.1697), "rxlev.tif"),
    ],
)
def test_where_the_pixels_lie(transform, told, own_world, rewrite):
    with rasterio.open(own_world.rasters) as source:
        found = source.transform
    rewrite(transform=transform(found))
    assert_build_refused(own_world, told)


def test_rasters_beside_the_roads_without_a_box(own_world, rewrite):
    with rasterio.open(own_world.rasters) as source:
        found = source.transform
    rewrite(transform=Affine.translation(30_000, 0) @ found)
    text = own_world.toml.read_text(encoding="utf-8").replace("bbox", "# bbox")
    own_world.toml.write_text(text, encoding="utf-8")
    assert_build_refused(own_world, "expected ways; the map covers", "area lies outside the map")


def test_rasters_on_their_own_lattice_are_followed(own_world, rewrite):
    """The roads are put on the lattice of the rasters, wherever its pixels begin."""
    with rasterio.open(own_world.rasters) as source:
        found = source.transform
    rewrite(transform=Affine.translation(1.7, -2.2) @ found)
    assert_done(mapfilter("build", "-c", own_world.toml))
    box = assert_done(mapfilter("info", own_world.database, "--json")).json["bounds_m"]
    assert (box[0] - found.c, box[3] - found.f) == pytest.approx((1.7, -2.2))


@pytest.mark.parametrize(
    ("ids", "told"),
    [
        (("A", "B"), ["no band for 'C'"]),
        (("A", "B", "C", "D"), ["expected cells of the plan only, found 'D'"]),
        (("A", "B", "X"), ["no band for 'C'", "found 'X'"]),
        (("A", "B", "B"), ["each cell once, found 'B' 2 times"]),
        (("A", "B", ""), ["band 3: expected a cell id as band description"]),
        (("A", "B", "../C"), ["found '../C'"]),
        (("A", "B", "x/C"), ["found 'x/C'"]),
    ],
)
def test_cells_of_rasters_and_plan(ids, told, own_world, rewrite):
    rewrite(ids)
    assert_build_refused(own_world, "rxlev.tif", *told)
    before = contents(own_world.folder)
    assert_refused(mapfilter("simulate", "-c", own_world.toml), "rxlev.tif", *told)
    assert contents(own_world.folder) == before


def test_levels_that_are_none(own_world, rewrite):
    rewrite(values=lambda data: data + 200)
    assert_build_refused(own_world, "path losses, or raw RXLEV, given for levels")


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_no_level_anywhere(value, own_world, rewrite):
    rewrite(values=lambda data: np.full_like(data, value))
    before = contents(own_world.folder)
    assert_refused(mapfilter("build", "-c", own_world.toml), "rasters hold no data along the roads")
    assert contents(own_world.folder) == before


def test_a_plan_by_rule_is_the_same_in_a_part_of_the_area(own_world):
    rule = ["-c", own_world.toml, "--set=cells.sites=1", "--set=cells.indoor=1"]
    text = own_world.toml.read_text(encoding="utf-8").replace("plan =", "# plan =")
    own_world.toml.write_text(text, encoding="utf-8")
    assert_done(mapfilter("predict", *rule))
    places = []
    for box in ("24.9420,60.1660,24.9495,60.1697", "24.9440,60.1670,24.9480,60.1690"):
        assert_done(mapfilter("build", *rule, f"--set=area.bbox={box}"))
        places.append(contents(own_world.database)["database/cells.parquet"])
    assert places[0] == places[1]
