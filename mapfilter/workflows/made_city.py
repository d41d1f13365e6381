"""Cities that are made in place of a map, for areas that name one."""

from __future__ import annotations

from functools import lru_cache

from mapfilter.simulation.city import SyntheticCity, manhattan, synthetic_city
from mapfilter.workflows.area import area_lattice
from mapfilter.workflows.fields import MADE_MAPS, SYNTHETIC_MAP
from mapfilter.workflows.sections import Area


def made_city(area: Area, crs: str) -> SyntheticCity | None:
    """Return the city that is made for an area, in a CRS; None where a map or nothing is named.

    It fills the area as configured, whatever part of it rasters cover.

    Raises
    ------
    ConfigError
        The area is too small or too large for one.
    """
    if area.map not in MADE_MAPS:
        return None
    return _made(area.model_copy(update={"crs": crs}))


@lru_cache(maxsize=2)
def _made(area: Area) -> SyntheticCity:
    lattice = area_lattice(area)
    if area.map == SYNTHETIC_MAP:
        return synthetic_city(lattice, area.seed)
    return manhattan(lattice)
