"""The centre lines of streets: distances, feet, directions and widths at any position."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
import shapely
from shapely import STRtree

from mapfilter._types import Bools, Floats, Ints
from mapfilter.roads.network import StreetNetwork

HALF_WIDTH_M: Mapping[str, float] = MappingProxyType(
    {
        "motorway": 14.0,
        "trunk": 13.0,
        "primary": 12.5,
        "secondary": 10.0,
        "tertiary": 8.0,
        "unclassified": 6.5,
        "residential": 6.5,
        "living_street": 4.0,
        "pedestrian": 5.0,
        "service": 3.0,
        "track": 1.75,
        "cycleway": 1.5,
        "footway": 1.25,
        "path": 1.0,
        "steps": 1.25,
    }
)
"""Half of the width between the facades or fences, by OpenStreetMap's class of way: carriageway,
kerbside parking and pavements of the typical cross-sections in FGSV, RASt 06 (residential streets
of 9 to 16 m, main streets of 20 to 30 m), paths of 2 to 3 m."""

_OTHER_HALF_WIDTH_M = 5.0
OFF_MARGIN_M = 2.0
"""Farther than this outside the width of every way, one is off the ways."""


class Feet(NamedTuple):
    """Pairs of a position and an edge near it, shape (P,) each.

    Parameters
    ----------
    position, edge : (P,) arrays of int
    distance_m : (P,) array
    east_m, north_m : (P,) arrays
        The foot: the nearest point of the edge.
    """

    position: Ints
    edge: Ints
    distance_m: Floats
    east_m: Floats
    north_m: Floats


@dataclass(frozen=True, eq=False)
class StreetLines:
    """The edges of a street network, indexed.

    Parameters
    ----------
    network : StreetNetwork
    """

    network: StreetNetwork

    @cached_property
    def half_width_m(self) -> Floats:
        """Half width of each edge, shape (E,)."""
        names = self.network.class_names
        widths = np.array([HALF_WIDTH_M.get(name, _OTHER_HALF_WIDTH_M) for name in names])
        return np.asarray(widths[self.network.way_class], dtype=np.float64)

    @cached_property
    def direction_rad(self) -> Floats:
        """Direction of each edge, from its first node to its second, shape (E,)."""
        _, _, right, up = self._ends
        return np.asarray(np.arctan2(up, right))

    def near(self, east_m: Floats, north_m: Floats, within_m: float) -> Feet:
        """Return all edges within a distance of positions."""
        points = shapely.points(east_m, north_m)
        position, edge = self._tree.query(points, predicate="dwithin", distance=within_m)
        east, north, right, up = (axis[edge] for axis in self._ends)
        square = np.maximum(right**2 + up**2, 1e-12)
        along = ((east_m[position] - east) * right + (north_m[position] - north) * up) / square
        along = np.clip(along, 0.0, 1.0)
        foot_east, foot_north = east + along * right, north + along * up
        away = np.hypot(east_m[position] - foot_east, north_m[position] - foot_north)
        return Feet(position, edge, away, foot_east, foot_north)

    def clearance_m(self, east_m: Floats, north_m: Floats, within_m: float = 60.0) -> Floats:
        """Return how far outside the width of every way positions lie; ≤ 0 within one.

        Parameters
        ----------
        within_m : float
            Largest clearance that is looked for.
        """
        feet = self.near(east_m, north_m, within_m + float(self.half_width_m.max(initial=0.0)))
        clear = np.full(np.shape(east_m), within_m)
        np.minimum.at(clear, feet.position, feet.distance_m - self.half_width_m[feet.edge])
        return clear

    def off_ways(self, east_m: Floats, north_m: Floats) -> Bools:
        """Return which positions are off the ways: more than 2 m outside the width of all."""
        return np.asarray(self.clearance_m(east_m, north_m) > OFF_MARGIN_M)

    @cached_property
    def _ends(self) -> tuple[Floats, Floats, Floats, Floats]:
        """First node of each edge, and the vector to its second node."""
        net = self.network
        east, north = net.east_m[net.node_a], net.north_m[net.node_a]
        return east, north, net.east_m[net.node_b] - east, net.north_m[net.node_b] - north

    @cached_property
    def _tree(self) -> STRtree:
        east, north, right, up = self._ends
        first, last = np.column_stack([east, north]), np.column_stack([east + right, north + up])
        return STRtree(shapely.linestrings(np.stack([first, last], axis=1)))
