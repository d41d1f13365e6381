"""CRS that rows of a cell plan state: projected, in metres or in another unit that PROJ knows."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from functools import lru_cache

from pyproj import CRS
from pyproj.exceptions import CRSError

from mapfilter._words import number_of
from mapfilter.errors import Faults, InputError
from mapfilter.geodesy import horizontal_part, known_crs, projected_crs, short_crs

_METRES = ("metre", "meter")


def stated_systems(texts: Iterable[str], where: str, faults: Faults) -> dict[str, str]:
    """Return the canonical CRS of each text that rows state; one that is none is one fault.

    Parameters
    ----------
    texts : iterable of str
        One for each row, empty where it states none.
    where : str
        File and column.
    """
    found: dict[str, str] = {}
    for text, rows in Counter(filter(None, texts)).items():
        try:
            found[text] = _system(text, f"{where} ({number_of(rows, 'row')})")
        except InputError as error:
            faults.found.extend(error.faults)
    return found


def unit_notes(systems: Mapping[str, str]) -> tuple[str, ...]:
    """Return a note for each CRS whose coordinates are in another unit than metres."""
    return tuple(
        f"positions in {unit}, the unit of {short_crs(crs)}, are converted to metres"
        for crs in dict.fromkeys(systems.values())
        if (unit := unit_name(crs)) != "metres"
    )


@lru_cache(maxsize=64)
def unit_name(crs: str) -> str:
    """Return the unit of a projected CRS, as messages name it.

    Examples
    --------
    >>> unit_name("EPSG:2263"), unit_name("EPSG:32635")
    ('US survey feet', 'metres')
    """
    name = horizontal_part(CRS.from_user_input(crs)).axis_info[0].unit_name
    return "metres" if name in _METRES else name.replace("foot", "feet")


def _system(text: str, where: str) -> str:
    """Return a projected CRS; its coordinates may be in feet."""
    try:
        return projected_crs(text, where)
    except InputError:
        crs = _in_another_unit(text)
        if crs is None:
            raise
        authority = crs.to_authority(min_confidence=100)
        return f"{authority[0]}:{authority[1]}" if authority else str(crs.to_wkt())


def _in_another_unit(text: str) -> CRS | None:
    """Return a CRS that counts to the east and north in a unit that PROJ knows; else None."""
    try:
        crs = horizontal_part(known_crs(text))
    except (CRSError, InputError):
        return None
    axes = crs.axis_info[:2]
    usual = {axis.direction for axis in axes} == {"east", "north"}
    known = all(axis.unit_conversion_factor > 0 for axis in axes)
    return crs if crs.is_projected and usual and known else None
