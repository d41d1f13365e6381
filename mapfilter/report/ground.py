"""What lies under the data of a map picture, as values: this module imports no drawing library."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from mapfilter._types import Floats
from mapfilter.errors import Faults, InputError

Bounds = tuple[float, float, float, float]

MAX_PANELS = 6
"""Moments that one picture of beliefs shows."""


@dataclass(frozen=True, slots=True, eq=False)
class BaseMap:
    """What lies under the data of a map picture; all in metres of one projected CRS.

    Raises
    ------
    InputError
        The extent is not finite or is empty.
    """

    bounds_m: Bounds
    """West, south, east, north."""
    streets: tuple[Floats, ...] = ()
    """Lines, arrays (k, 2), as east, north."""
    points_m: Floats | None = None
    """Points of the map, (n, 2), as east, north, on a lattice; drawn as pale pixels."""
    attribution: str = ""
    """Owner of the map, such as "© OpenStreetMap contributors"; drawn small in a corner."""
    resolution_m: float = 5.0
    """Distance between neighbouring points."""
    whole_m: Bounds | None = None
    """Extent of the whole area, of which ``bounds_m`` is a part; equal to it when left out. Its
    south-western corner is the local origin of the axes, so that parts of one area compare."""

    def __post_init__(self) -> None:
        west, south, east, north = self.bounds_m
        faults = Faults()
        if not np.isfinite(self.bounds_m).all():
            faults.add("map extent", "four finite numbers", self.bounds_m)
        elif west >= east or south >= north:
            faults.add("map extent", "west < east and south < north", self.bounds_m)
        if not (np.isfinite(self.resolution_m) and self.resolution_m > 0):
            faults.add("map resolution", "metres > 0", self.resolution_m)
        faults.raise_if_any(InputError)

    def zoomed(self, bounds_m: Bounds) -> BaseMap:
        """Return the same map with another extent, and the same local origin."""
        return replace(self, bounds_m=bounds_m, whole_m=self.whole_m or self.bounds_m)
