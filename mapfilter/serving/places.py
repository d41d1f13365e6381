"""Positions that devices send: in or near the area, or refused with the likely mistake."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isfinite
from typing import Any

import numpy as np

from mapfilter._inputs import shown
from mapfilter.errors import Faults, InputError
from mapfilter.geodesy import project
from mapfilter.lattice import Lattice
from mapfilter.positioning.bayes.state import BayesState
from mapfilter.positioning.epochs import Epoch
from mapfilter.positioning.known_start import ELSEWHERE, MOST_SD_M, check_place
from mapfilter.serving.documents import RequestError, check_keys, number
from mapfilter.tracks.checks.misplaced import (
    check_near,
    degrees_for_metres,
    misplaced_by,
    nearest_m,
)
from mapfilter.tracks.joining.no_fix import holds_no_fix, no_fix_note
from mapfilter.tracks.joining.position_units import RADIUS_68

_RANGES = {"lat_deg": 90.0, "lon_deg": 180.0, "sd_m": MOST_SD_M}
_AS_A_PHONE = ("lat_deg", "lon_deg", "accuracy_m")
_LIKELY = {"lat": "lat_deg", "lon": "lon_deg", "lng": "lon_deg", "acc": "accuracy_m"}
"""Keys that are meant by others that begin so."""
_MOST_ACCURACY_M = 1e5
_MOST_DEG = 180.0
_FAR_M = 100_000.0
"""No cells of an area are heard so far outside; nearer, its mirror image may be a true place."""


def start_of(
    given: Mapping[str, Any], lattice: Lattice, faults: Faults
) -> tuple[float, float, float] | None:
    """Return a known start (east, north, deviation) in the CRS of an area; None, with faults.

    Parameters
    ----------
    given : mapping
        ``lat_deg``, ``lon_deg`` and ``sd_m``.
    lattice : Lattice
        Of the area. A start farther outside than 500 m and than five deviations is a fault.
    """
    before = len(faults.found)
    check_keys(given, tuple(_RANGES), "start", faults)
    found = [
        number(given.get(key), f"start.{key}", f"a number up to {most:g}", faults, low, most)
        for key, most in _RANGES.items()
        for low in (0.0 if key == "sd_m" else -most,)
    ]
    if len(faults.found) > before:
        return None
    lat_deg, lon_deg, sd_m = (float(one) for one in found if one is not None)
    east_m, north_m = project(lattice.crs, [lon_deg], [lat_deg])
    if not (np.isfinite(east_m).all() and np.isfinite(north_m).all()):
        faults.add("start", f"a place that {lattice.crs} covers", "one beyond it")
        return None
    place = float(east_m[0]), float(north_m[0]), sd_m
    check_place("start", *place, lattice, faults, f"latitude {lat_deg:g}, longitude {lon_deg:g}")
    return place if len(faults.found) == before else None


def in_metres(
    row: Mapping[str, Any], where: str, crs: str, faults: Faults
) -> Mapping[str, Any] | None:
    """Return a row of ``gnss`` in a CRS, also where it is as phones give it.

    None, with faults, where it is wrong; and without any where it holds no position.

    Parameters
    ----------
    row : mapping
        With ``lat_deg``, ``lon_deg`` and ``accuracy_m``, the radius that holds 68 %, or with the
        columns of a log, and then returned as it is.
    """
    if not any(key in row for key in _AS_A_PHONE):
        if not row or {"east_m", "north_m"} & row.keys():
            return row
        _ask_for_degrees(row, where, faults)
        return None
    before = len(faults.found)
    check_keys(row, _AS_A_PHONE, where, faults)
    if _is_placeless(row):
        return None
    lat_deg, lon_deg = (
        number(
            row.get(key), f"{where}.{key}", f"degrees in -{most:g}..{most:g}", faults, -most, most
        )
        for key, most in (("lat_deg", _RANGES["lat_deg"]), ("lon_deg", _RANGES["lon_deg"]))
    )
    radius_m: float | None = 0.0
    if row.get("accuracy_m") is not None:
        place, expected = f"{where}.accuracy_m", f"metres in 0..{_MOST_ACCURACY_M:g}"
        radius_m = number(row["accuracy_m"], place, expected, faults, 0.0, _MOST_ACCURACY_M)
    if lat_deg is None or lon_deg is None or len(faults.found) > before:
        return None
    east_m, north_m = (float(one) for one in project(crs, lon_deg, lat_deg))
    if not (isfinite(east_m) and isfinite(north_m)):
        faults.add(where, f"a place that {crs} covers", "one beyond it")
        return None
    found = {"east_m": east_m, "north_m": north_m}
    if not radius_m:
        return found
    variance_m2 = (radius_m / RADIUS_68) ** 2
    both = {"var_east_m2": variance_m2, "var_north_m2": variance_m2, "cov_east_north_m2": 0.0}
    return {**found, **both}


def _ask_for_degrees(row: Mapping[str, Any], where: str, faults: Faults) -> None:
    """Note all keys of a position that has none of those of a place."""
    expected = f"keys of {', '.join(_AS_A_PHONE)}, or east_m, north_m and their variances"
    for name in row:
        begun = (known for begin, known in _LIKELY.items() if name.lower().startswith(begin))
        faults.add(where, expected, shown(name), next(begun, ""))


def placeless_note(document: Mapping[str, Any]) -> tuple[str, ...]:
    """Return a note on positions of a request that are none; empty without any.

    Parameters
    ----------
    document : mapping
        A request whose epochs were checked.
    """
    placeless = [
        f"epochs[{at}].gnss[{index}]"
        for at, epoch in enumerate(document["epochs"])
        for index, row in enumerate(epoch.get("gnss") or ())
        if any(key in row for key in _AS_A_PHONE) and _is_placeless(row)
    ]
    return (no_fix_note("gnss", len(placeless), placeless[0]),) if placeless else ()


def _is_placeless(row: Mapping[str, Any]) -> bool:
    return holds_no_fix(row.get("lat_deg"), row.get("lon_deg"))


def check_fixes(epochs: Sequence[Epoch], before: BayesState, lattice: Lattice) -> None:
    """Check that positions of a request lie near an area, as those of a log have to.

    They are checked until a position of the session was used; the device may leave the area later.
    A device whose receiver is misled still has to be located by its cells: where it reports cells,
    or the session has a belief, the filter judges what can be a spoofer's position.

    Raises
    ------
    RequestError
        There are positions, all of them lie elsewhere, and they are degrees given for metres; or
        the session has no belief, and another usual mistake puts them far away or the request
        reports no cells (400).
    """
    placed = [(index, one.gnss) for index, one in enumerate(epochs) if one.gnss is not None]
    if not placed or before.last_fix is not None:
        return
    east_m = np.array([fix.east_m for _, fix in placed])
    north_m = np.array([fix.north_m for _, fix in placed])
    # Also those of a place that is not near: no receiver reports metres as small.
    as_small = np.maximum(np.abs(east_m), np.abs(north_m)).max() <= _MOST_DEG
    mistake = "degrees given for metres" if as_small else ""
    mistake = mistake or degrees_for_metres(east_m, north_m, lattice)
    if not mistake and before.belief is None:
        if not any(one.radio for one in epochs):
            mistake = ELSEWHERE
        elif nearest_m(east_m, north_m, lattice) > _FAR_M:
            mistake = misplaced_by(east_m, north_m, lattice)
    if not mistake:
        return
    faults, where = Faults(), f"epochs[{placed[0][0]}].gnss"
    check_near(where, east_m, north_m, lattice, faults, mistake)
    if faults.found:
        raise RequestError.of(InputError(tuple(faults.found)))
