"""Usual widths of ways by their class; here, as a database needs no geometries to know them."""

from __future__ import annotations

_HALF_WIDTH_M = {
    "motorway": 12.0,
    "trunk": 10.0,
    "primary": 10.0,
    "secondary": 9.0,
    "tertiary": 8.5,
    "residential": 7.0,
    "unclassified": 7.0,
    "living_street": 5.0,
    "pedestrian": 6.0,
    "service": 4.0,
    "cycleway": 3.0,
    "track": 3.0,
    "footway": 2.5,
    "path": 2.0,
    "steps": 2.0,
}
_USUAL_HALF_WIDTH_M = 5.0


def half_width_of(way_class: str) -> float:
    """Return half the usual width of a class of way, pavements included, in metres.

    Maps rarely hold widths. These are from typical cross-sections of town streets: two lanes of
    2.75 to 3.5 m, parked cars of 2 m and pavements of 2 to 2.5 m on both sides.

    Examples
    --------
    >>> half_width_of("residential"), half_width_of("primary_link"), half_width_of("unknown")
    (7.0, 10.0, 5.0)
    """
    return _HALF_WIDTH_M.get(way_class.removesuffix("_link"), _USUAL_HALF_WIDTH_M)
