"""Known starts: in or near the area, or refused with the likely mistake."""

from __future__ import annotations

from math import isfinite
from typing import Any

import numpy as np

from mapfilter._inputs import shown
from mapfilter.errors import Faults, InputError
from mapfilter.geodesy import unproject
from mapfilter.lattice import Lattice, outside_m
from mapfilter.tracks.checks.misplaced import misplaced_by

START_REACH_M, START_REACH_SD = 500.0, 5.0
"""A start is of this area up to so far outside, or up to so many of its own deviations."""

MOST_SD_M = 1e5
ELSEWHERE = "a position of another area or zone"

_MOST_M = 1e8


def check_start(east_m: Any, north_m: Any, sd_m: Any, lattice: Lattice) -> None:
    """Check a start of a program: numbers in metres, in the area or near it.

    Raises
    ------
    InputError
        With all faults together.
    """
    faults = Faults()
    given = (
        ("east_m", east_m, -_MOST_M, _MOST_M, "metres east"),
        ("north_m", north_m, -_MOST_M, _MOST_M, "metres north"),
        ("sd_m", sd_m, 0.0, MOST_SD_M, f"metres in 0..{MOST_SD_M:g}"),
    )
    for name, value, low, high, expected in given:
        if not (_is_number(value) and low <= value <= high):
            faults.add(f"start, {name}", expected, shown(value))
    if not faults.found:
        place = f"{east_m:.10g} m east, {north_m:.10g} m north"
        check_place("start", float(east_m), float(north_m), float(sd_m), lattice, faults, place)
    faults.raise_if_any(InputError)


def check_place(
    where: str,
    east_m: float,
    north_m: float,
    sd_m: float,
    lattice: Lattice,
    faults: Faults,
    shown_as: str,
) -> None:
    """Note a start that lies farther outside of an area than 500 m and than five deviations.

    Parameters
    ----------
    shown_as : str
        The place, as it was given.
    """
    east, north = np.array([east_m]), np.array([north_m])
    reach_m = max(START_REACH_M, START_REACH_SD * sd_m)
    away_m = float(outside_m(east, north, lattice)[0])
    if away_m > reach_m:
        box = _box_deg(lattice)
        expected = f"a place in the area ({box}), or at most {reach_m:.0f} m outside"
        got = f"{shown_as}, {away_m / 1000:.1f} km outside"
        faults.add(where, expected, got, misplaced_by(east, north, lattice) or ELSEWHERE)


def _is_number(value: object) -> bool:
    if isinstance(value, bool | np.bool_):
        return False
    return isinstance(value, int | float | np.integer | np.floating) and isfinite(value)


def _box_deg(lattice: Lattice) -> str:
    west, south, east, north = lattice.bounds_m
    lon_deg, lat_deg = unproject(lattice.crs, [west, west, east, east], [south, north] * 2)
    latitudes = f"latitude {lat_deg.min():.4f} to {lat_deg.max():.4f}"
    return f"{latitudes}, longitude {lon_deg.min():.4f} to {lon_deg.max():.4f}"
