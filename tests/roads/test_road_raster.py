"""Rasters of roads as ways: all their pixels and nothing else, and every fault of a raster."""

import numpy as np
import pytest
import rasterio
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from rasterio import Affine

from mapfilter.errors import InputError
from mapfilter.roads.raster import joined_pixels, raster_lattice, read_raster_ways
from mapfilter.roads.route_points import RouteSource

CRS = "EPSG:32632"
WEST_M, NORTH_M = 455_000.0, 5_433_000.0


def write(path, values, *, pixel_m=2.0, crs=CRS, transform=None, nodata=None):
    values = np.asarray(values)
    bands = values if values.ndim == 3 else values[None]
    transform = transform or Affine(pixel_m, 0, WEST_M, 0, -pixel_m, NORTH_M)
    with rasterio.open(
        path, "w", driver="GTiff", height=bands.shape[1], width=bands.shape[2],
        count=len(bands), dtype=bands.dtype, crs=crs, transform=transform, nodata=nodata,
    ) as target:  # fmt: skip
        target.write(bands)
    return path


def box(rows, cols, pixel_m=2.0):
    return WEST_M, NORTH_M - rows * pixel_m, WEST_M + cols * pixel_m, NORTH_M


@settings(max_examples=60, deadline=None)
@given(arrays(np.bool_, st.tuples(st.integers(1, 9), st.integers(1, 9))))
def test_lines_cover_every_pixel_of_a_road_and_no_other(mask):
    ends = joined_pixels(mask)
    if not mask.any():
        assert ends.shape == (0, 2, 2)
        return
    lines = shapely.linestrings(ends)
    every = shapely.points(np.argwhere(np.ones_like(mask)))
    near = np.min([shapely.distance(line, every) for line in lines], axis=0).reshape(mask.shape)
    assert np.all(near[mask] == 0)
    # Lines go from centre to centre of roads; corners are cut by half a diagonal.
    assert np.all(near[~mask] >= 0.5)


def test_touching_roads_have_one_number_and_their_class(tmp_path):
    values = np.zeros((12, 12), dtype=np.uint8)
    values[2, 1:6] = values[3:6, 6] = 1
    values[9, 2:9] = 1
    values[0, 10] = 2
    path = write(tmp_path / "roads.tif", values)
    ways = read_raster_ways(path, {"residential": 1, "path": 2}, CRS, box(12, 12))
    lengths = {}
    for number, code, line in zip(ways.way_id, ways.way_class, ways.geometry, strict=True):
        key = (int(number), ways.class_names[code])
        lengths[key] = lengths.get(key, 0.0) + shapely.length(line)
    assert {name for _, name in lengths} == {"residential", "path"}
    assert len(lengths) == 3
    assert lengths[1, "residential"] == pytest.approx(4 * 2 + 2 * 2**0.5 + 2 * 2)
    assert lengths[2, "residential"] == pytest.approx(6 * 2)
    assert lengths[3, "path"] == pytest.approx(2.0)


def test_a_line_drawn_one_pixel_wide_is_that_line_within_a_pixel(tmp_path):
    line = shapely.LineString([(20, 30), (180, 140), (190, 40)])
    row, col = np.indices((100, 100))
    centres = shapely.points(2 * col + 1.0, 200 - (2 * row + 1.0))
    path = write(tmp_path / "roads.tif", (shapely.distance(line, centres) <= 1).astype(np.uint8))
    ways = read_raster_ways(path, {"road": 1}, CRS, box(100, 100))
    placed = shapely.transform(line, lambda at: at + np.array([WEST_M, NORTH_M - 200]))
    assert shapely.hausdorff_distance(shapely.union_all(ways.geometry), placed) < 2.0
    lattice = raster_lattice(path, 5.0)
    assert lattice.bounds_m == box(100, 100)
    points = RouteSource.of(ways, None, None, 6.0).over(lattice)
    true = shapely.distance(placed, shapely.points(*points.east_north_m))
    assert np.abs(points.distance_to_way_m - true).max() < 2.0


def test_only_the_part_in_the_box_is_read(tmp_path):
    values = np.zeros((50, 50), dtype=np.int16)
    values[10] = values[40] = 7
    path = write(tmp_path / "roads.tif", values, nodata=-1)
    west, _, east, north = box(50, 50)
    ways = read_raster_ways(path, {"road": 7}, CRS, (west, north - 40, east, north + 500))
    assert len(ways) == 1


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"values": np.zeros((5, 5), np.uint8)}, "value 1 .road. in the area, found values 0"),
        ({"values": np.ones((5, 5), np.float32)}, "whole numbers"),
        ({"values": np.ones((3, 5, 5), np.uint8)}, "one band"),
        ({"crs": "EPSG:32633"}, "another zone"),
        ({"crs": "EPSG:4326"}, "crs"),
        ({"crs": None}, "crs"),
        ({"transform": Affine(2, 0.5, WEST_M, 0.5, -2, NORTH_M)}, "rotated"),
        ({"transform": Affine(2, 0, WEST_M + 1e5, 0, -2, NORTH_M)}, "another place"),
    ],
)
@pytest.mark.filterwarnings("ignore::rasterio.errors.NotGeoreferencedWarning")
def test_faults_of_a_raster_are_named(tmp_path, change, match):
    change = {"values": np.ones((5, 5), np.uint8), **change}
    path = write(tmp_path / "roads.tif", change.pop("values"), **change)
    with pytest.raises(InputError, match=match):
        read_raster_ways(path, {"road": 1}, CRS, box(5, 5))


def test_missing_damaged_and_classless_rasters_are_refused(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        read_raster_ways(tmp_path / "none.tif", {"road": 1}, CRS, box(5, 5))
    (tmp_path / "text.tif").write_text("roads")
    with pytest.raises(InputError, match="a raster that GDAL can read"):
        raster_lattice(tmp_path / "text.tif", 5.0)
    whole = write(tmp_path / "whole.tif", np.ones((400, 400), np.uint8))
    data = whole.read_bytes()
    (tmp_path / "cut.tif").write_bytes(data[: len(data) // 2])
    with pytest.raises(InputError, match="a readable raster"):
        read_raster_ways(tmp_path / "cut.tif", {"road": 1}, CRS, box(400, 400))
    with pytest.raises(InputError, match="at least one class"):
        read_raster_ways(whole, {}, CRS, box(5, 5))
