"""Parts of PBF maps: decoded once for the layers of an area, and never mixed up."""

import tempfile
import time
from concurrent.futures import ThreadPoolExecutor

import pytest
import shapely
from made_maps import AREA, write_pbf, write_xml

from mapfilter.errors import InputError
from mapfilter.roads import elements, maps, osm_pbf
from mapfilter.roads.buildings import read_buildings
from mapfilter.roads.maps import _rounded_out
from mapfilter.roads.osm import read_squares, read_ways

FOOTWAY = (1, {"highway": "footway"}, [(10, 10), (50, 10)])
HOUSE = (2, {"building": "yes"}, [(20, 20), (40, 20), (40, 40), (20, 40), (20, 20)])
SQUARE = (4, {"highway": "pedestrian", "area": "yes"}, [(9, 9), (9, 60), (60, 60), (9, 9)])


@pytest.fixture
def path(tmp_path):
    return write_pbf(tmp_path / "made.osm.pbf", [FOOTWAY, HOUSE, SQUARE])


@pytest.fixture
def opened(monkeypatch):
    """Return the list to which each opening of a PBF is added: file and box."""
    found, inner = [], osm_pbf._opened

    def counted(*given):
        found.append(given)
        # Long enough for other threads to come to the same place.
        time.sleep(0.005)
        return inner(*given)

    osm_pbf._kept.cache_clear()
    monkeypatch.setattr(osm_pbf, "_opened", counted)
    return found


def layers(path, by_m=0.0):
    crs, (west, south, east, north) = AREA
    bounds = west - by_m, south - by_m, east + by_m, north + by_m
    found = (
        read_buildings(path, crs, bounds).footprints,
        read_ways(path, "walking", *AREA).geometry,
        read_squares(path, crs, bounds).geometry,
    )
    return [shapely.to_wkb(one).tolist() for one in found]


def test_layers_of_an_area_are_read_from_one_part_that_is_decoded_once(path, opened, monkeypatch):
    first = layers(path)
    assert [len(one) for one in first] == [1, 1, 1]
    assert len(opened) == 1
    # Areas that differ by the half width of a way read the same part.
    assert layers(path, by_m=6.0) == first
    assert len(opened) == 1
    # The same, decoded for each query: ways and squares share one.
    monkeypatch.setattr(elements, "_LARGEST_KEPT_BYTES", 0)
    assert layers(path) == first
    assert len(opened) == 4


def test_of_a_large_map_the_part_in_the_box_is_read(tmp_path, opened, monkeypatch):
    squares = [(2, {"highway": "pedestrian", "area": "yes"}, [(9, 9), (9, 60), (60, 60), (9, 9)])]
    ways = [(1, {"highway": "footway"}, [(10, 10), (50, 10)]),
            (3, {"highway": "footway"}, [(9_000, 9_000), (9_050, 9_000)])]  # fmt: skip
    path = write_pbf(tmp_path / "large.osm.pbf", [*ways, *squares])

    def read():
        found = read_ways(path, "walking", *AREA), read_squares(path, *AREA)
        return [shapely.to_wkb(one.geometry).tolist() for one in found]

    whole = read()
    assert [len(one) for one in whole] == [1, 1]
    del opened[:]
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setattr(elements, "_LARGEST_KEPT_BYTES", 0)
    monkeypatch.setattr(osm_pbf, "_LARGEST_IN_MEMORY_BYTES", 0)
    assert read() == whole
    # The whole map, and the part of it, for each of both.
    assert [place == path for place, _ in opened] == [True, False, True, False]
    # Nothing of the part is left.
    assert [file.name for file in tmp_path.rglob("*.pbf")] == ["large.osm.pbf"]


def test_a_file_that_was_damaged_or_mended_is_read_anew(path):
    good, before = path.read_bytes(), layers(path)
    path.write_bytes(good[: len(good) // 2])
    for _ in range(2):
        with pytest.raises(InputError, match=r"made\.osm\.pbf: expected a whole \.osm\.pbf file"):
            layers(path)
    path.write_bytes(good)
    assert layers(path) == before


def test_another_area_and_the_first_again_are_what_they_were(path):
    before, (crs, (west, south, east, north)) = layers(path), AREA
    far = west + 9_000, south, east + 9_000, north
    assert len(read_buildings(path, crs, far).footprints) == 0
    assert layers(path) == before


def test_threads_read_layers_of_one_part_as_one_thread_does(path, opened):
    expected = layers(path)
    for _ in range(5):
        osm_pbf._kept.cache_clear()
        maps._read_kept.cache_clear()
        maps._tidy_kept.cache_clear()
        read_before = len(opened)
        with ThreadPoolExecutor(4) as pool:
            found = list(pool.map(lambda _: layers(path), range(8)))
        assert found == [expected] * 8
        assert len(opened) <= read_before + 1


@pytest.mark.parametrize(
    ("box", "expected"),
    [
        ((8.6012, 49.3999, 8.6051, 49.4), (8.6, 49.395, 8.61, 49.4)),
        ((-8.6012, -0.0001, -8.5999, 0.0001), (-8.605, -0.005, -8.595, 0.005)),
        ((-180.0, -90.0, 180.0, 90.0), (-180.0, -90.0, 180.0, 90.0)),
        ((179.9999, 89.9999, 179.99991, 89.99991), (179.995, 89.995, 180.0, 90.0)),
    ],
)
def test_boxes_are_rounded_outwards(box, expected):
    assert _rounded_out(box) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("write", [write_pbf, write_xml])
def test_an_area_that_its_crs_does_not_show_is_refused(write, tmp_path):
    suffix = "osm.pbf" if write is write_pbf else "osm"
    path = write(tmp_path / f"made.{suffix}", [FOOTWAY])
    with pytest.raises(
        InputError, match=r"area: expected an area that EPSG:32629 can show, .*region"
    ):
        read_ways(path, "walking", "EPSG:32629", (5e7, 0.0, 5e7 + 1000, 1000.0))
