"""Areas across 180° of longitude are named as that, with what to do instead."""

import pytest
from command_line import mapfilter

from mapfilter._area_scale import check_scale
from mapfilter.config.load import load_config
from mapfilter.degrees import check_bbox
from mapfilter.errors import InputError
from mapfilter.geodesy import project
from mapfilter.workflows.inputs.area_lattice import area_lattice

ACROSS = "area.bbox: expected an area on one side of 180° of longitude, found "
SIDES = "make an area of each side: 179.9,-17,180,-16.9 and -180,-17,-179.9,-16.9"


@pytest.mark.parametrize(
    "box",
    [
        (179.9, -17.0, -179.9, -16.9),
        (179.9, -17.0, 180.1, -16.9),
        (-180.1, -17.0, -179.9, -16.9),
    ],
)
def test_a_box_in_each_way_of_counting(box):
    with pytest.raises(InputError) as refused:
        check_bbox(box, "area.bbox")
    assert str(refused.value).startswith(ACROSS)
    assert SIDES in str(refused.value)


@pytest.mark.parametrize("box", [(179.9, -17.0, 180.0, -16.9), (-180.0, -17.0, -179.9, -16.9)])
@pytest.mark.parametrize("south", [0.0, 80.0])
def test_each_side_is_an_area(box, south):
    west, _, east, _ = box
    given = [f"area.bbox={west},{south},{east},{south + 0.3}", "area.map=none"]
    lattice = area_lattice(load_config(None, given).area, on_map=False)
    assert lattice.crs == ("EPSG:32660" if west > 0 else "EPSG:32601")


def test_longitudes_of_0_to_360_and_exchanged_corners_are_others():
    with pytest.raises(InputError, match="longitudes of 0 to 360; write -170,-17,-169,-16"):
        check_bbox((190.0, -17.0, 191.0, -16.0), "area.bbox")
    for west, east in ((24.95, 24.94), (10.0, -10.0), (150.0, -110.0)):
        with pytest.raises(InputError, match="corners swapped"):
            check_bbox((west, 60.0, east, 61.0))


@pytest.mark.parametrize("part", [0.1, 0.5, 0.9])
@pytest.mark.parametrize("zone", [1, 60])
def test_an_area_of_metres_by_any_part_of_it(zone, part):
    crs = f"EPSG:327{zone:02}"
    east_m, north_m = (float(one) for one in project(crs, 180.0, -17.0))
    west_m, south_m = east_m - 20_000 * part, north_m - 10_000
    bounds_m = (west_m, south_m, west_m + 20_000, south_m + 20_000)
    with pytest.raises(InputError, match=r"on one side of 180° of longitude, found .* across it"):
        check_scale(crs, bounds_m, "area.crs")


def test_a_corner_and_a_size():
    given = ["area.southwest=179.98,-17", "area.size_m=3000,3000", "area.map=none"]
    with pytest.raises(InputError, match=r"area\.crs: expected an area on one side of 180°"):
        area_lattice(load_config(None, given).area, on_map=False)


@pytest.mark.parametrize("command", ["build", "predict", "check"])
def test_each_command_says_so(tmp_path, command):
    out = [] if command == "check" else ["--out", tmp_path / "out"]
    settings = ["--set", "area.bbox=179.9,-17,-179.9,-16.9", "--set", "area.map=none"]
    done = mapfilter(command, *settings, *out)
    assert done.code == 2
    assert "an area on one side of 180° of longitude" in (done.out + done.err).replace("\n", " ")
