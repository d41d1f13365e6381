"""Recordings of one journey whose positions lie kilometres apart: exchanged or mirrored degrees."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from mapfilter.errors import Faults, InputError
from mapfilter.tracks.checks.misplaced import FAR_M, UNDONE
from mapfilter.tracks.joining.position_units import METRES_PER_DEGREE, continuous_deg, near_deg
from mapfilter.tracks.readers.recorded.recording import Recording

_TIMES = 10.0
_MIDDLE = (0.02, 0.98)
"""Quantiles of latitude and longitude: single positions may lie anywhere."""


def check_far_apart(recordings: Sequence[Recording]) -> None:
    """Refuse recordings of one journey that lie far apart by a mistake of their degrees.

    The mistake is one without which a recording lies where the first one does that has positions.

    Raises
    ------
    InputError
        With a fault for each recording that disagrees with the first one.
    """
    placed = [(one, rows) for one in recordings if (rows := _degrees(one)) is not None]
    faults = Faults()
    for other, rows in placed[1:]:
        first, reference = placed[0]
        apart_m = _apart_m(reference, rows)
        if apart_m <= FAR_M:
            continue
        for mistake, (lon, lat, lon_sign, lat_sign) in UNDONE.items():
            undone = rows.assign(lon_deg=lon_sign * rows[lon], lat_deg=lat_sign * rows[lat])
            if _apart_m(reference, undone) <= min(FAR_M, apart_m / _TIMES):
                here, there = _middle(rows), _middle(reference)
                expected = f"positions of one journey, near {there} ({first.name})"
                got = f"{here}, {apart_m / 1000:.0f} km off"
                hint = f"{mistake} in one of the two"
                faults.add(f"{other.path}, latitude and longitude", expected, got, hint)
                break
    faults.raise_if_any(InputError)


def _degrees(recording: Recording) -> pd.DataFrame | None:
    for name in ("positions", "truth"):
        if name in recording.tables:
            rows = recording.tables[name][["lon_deg", "lat_deg"]]
            return rows.assign(lon_deg=continuous_deg(rows["lon_deg"]))
    return None


def _middle(rows: pd.DataFrame) -> str:
    lon_deg = near_deg(rows["lon_deg"].median(), 0.0)
    return f"{rows['lat_deg'].median():.5f}, {lon_deg:.5f}"


def _apart_m(one: pd.DataFrame, other: pd.DataFrame) -> float:
    """Return the distance of the areas of two sets of positions; 0 where they overlap."""
    if other["lat_deg"].abs().max() > 90:
        return float("inf")
    middle_deg = float(other["lon_deg"].median())
    turns_deg = near_deg(middle_deg, float(one["lon_deg"].median())) - middle_deg
    other = other.assign(lon_deg=other["lon_deg"] + turns_deg)
    low, high = (np.array([rows.quantile(q) for rows in (one, other)]) for q in _MIDDLE)
    gap_deg = np.maximum(low.max(axis=0) - high.min(axis=0), 0.0)
    wide = np.cos(np.radians(one["lat_deg"].median()))
    return float(np.hypot(METRES_PER_DEGREE * wide * gap_deg[0], METRES_PER_DEGREE * gap_deg[1]))
