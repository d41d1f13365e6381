"""What check tells of a planning tool's rasters that other settings hid or said twice."""

import re

import pytest
from check_world import make_world, shifted
from command_line import assert_done, assert_refused, mapfilter, settings

from mapfilter.check.findings import Findings, paragraphs


@pytest.fixture
def world(tmp_path, levels):
    world = make_world(tmp_path, levels)
    world.landuse = None
    return world


def codes(world, *given):
    found = mapfilter("check", "-c", world.toml, "--json", *given).json["findings"]
    return [finding["code"] for finding in found]


def test_half_a_pixel_is_found_whatever_the_resolution_of_the_area(world):
    world.lattice = shifted(5, -5)
    world.write()
    assert codes(world, *settings(area__resolution_m=5.0)) == ["half-pixel-shift"]


def test_ways_narrower_than_a_pixel_are_told(world):
    world.lattice = shifted(2, -2)
    world.write()
    assert codes(world) == []
    assert codes(world, *settings(roads__half_width_m=4.0)) == ["ways-with-gaps"]
    left_out = ("--set=roads.half_width_by_class_m={residential=5.0}",)
    assert codes(world, *left_out, *settings(roads__half_width_m=4.0)) == []
    given = settings(roads__half_width_m=4.0, output__pictures="none", output__dir=world.folder)
    notes = assert_done(mapfilter("build", "-c", world.toml, *given, "--json")).json["notes"]
    told = "100% of the ways, down to 8 m wide, are narrower than the pixels of 10 m"
    assert any(told in note for note in notes)


def test_a_build_without_a_point_says_why(world):
    world.write()
    given = settings(roads__half_width_m=4.0, output__dir=world.folder)
    built = mapfilter("build", "-c", world.toml, *given)
    assert_refused(built, "no point of the roads", "narrower than their pixels")


def test_of_rasters_that_cannot_be_read_nothing_else_is_told(world):
    world.quantity = ""
    world.write()
    text = world.toml.read_text(encoding="utf-8")
    text = re.sub("map = .*", 'map = "none"', re.sub("bbox = .*", "", text))
    world.toml.write_text(text, encoding="utf-8")
    assert codes(world) == ["quantity-unknown"]


def test_a_site_on_the_edge_is_inside(world):
    west, _, _, north = world.lattice.bounds_m
    world.in_metres()
    for cell_id in ("S1A", "S1B", "S1C"):
        world.row(cell_id).update(east=west - 0.3, north=north)
    world.write()
    assert "site-outside-area" not in codes(world)


def test_the_same_mistake_in_each_row_is_told_in_few_words():
    findings = Findings()
    for row in range(2, 1002):
        findings.add("lon-lat-swapped", f"cells.csv row {row}", "Swapped.")
    findings.add("raster-constant", "a.tif", "One number.")
    told = list(paragraphs(findings.result()))
    assert len(told) == 5
    assert told[3] == "error lon-lat-swapped: 997 more, the last of them cells.csv row 1001."
    assert told[4].startswith("error raster-constant: a.tif")
