"""Usual widths of ways by their class."""

import pytest

from mapfilter.roads.widths import half_width_of


@pytest.mark.parametrize(
    ("way_class", "half_m"),
    [("motorway", 12.0), ("trunk", 10.0), ("primary", 10.0), ("secondary", 9.0),
     ("tertiary", 8.5), ("residential", 7.0), ("unclassified", 7.0), ("living_street", 5.0),
     ("pedestrian", 6.0), ("service", 4.0), ("cycleway", 3.0), ("track", 3.0),
     ("footway", 2.5), ("path", 2.0), ("steps", 2.0)],
)  # fmt: skip
def test_half_widths_by_class(way_class, half_m):
    assert half_width_of(way_class) == half_m


def test_links_are_as_wide_as_what_they_link_and_other_classes_are_five_metres():
    assert half_width_of("motorway_link") == half_width_of("motorway")
    assert half_width_of("tertiary_link") == 8.5
    for other in ("", "_link", "Residential", "corridor", "link_primary", "primary_linked"):
        assert half_width_of(other) == 5.0


def test_wider_classes_are_no_narrower():
    order = ("steps", "footway", "service", "residential", "tertiary", "secondary", "primary",
             "motorway")  # fmt: skip
    widths = [half_width_of(one) for one in order]
    assert widths == sorted(widths)
