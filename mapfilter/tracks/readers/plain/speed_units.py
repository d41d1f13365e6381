"""The unit of a column of speeds whose header states none: by positions, or by its values."""

from __future__ import annotations

import numpy as np
import pandas as pd

from mapfilter._constants import KNOT_MPS, MPH_MPS
from mapfilter._types import Bools, Floats
from mapfilter.tracks.checks.receiver_speeds import speed_unit_fault
from mapfilter.tracks.joining.position_units import metres_about_middle
from mapfilter.tracks.readers.plain.mapped import Mapped

_FASTEST_MPS, _MOST = 70.0, 0.95
"""Vehicles are slower most of the time: numbers beyond are km/h."""
_OFF = 1.1
_KMH, _OTHERS = 3.6, {"mph": 1 / MPH_MPS, "knots": 1 / KNOT_MPS}


def speed_unit(mapped: Mapped, column: str, time_s: Floats) -> str:
    """Return the unit of a column of speeds; "" where nothing tells it.

    Positions of the same rows tell m/s, km/h, mph and knots; numbers above 70 are km/h.

    Parameters
    ----------
    mapped : Mapped
    column : str
        Its name.
    time_s : (N,) array
        Times of the rows.
    """
    number = pd.to_numeric(pd.Series(mapped.rows.texts(column)), errors="coerce")
    speed = number.to_numpy(dtype=np.float64)
    known = np.isfinite(speed) & np.isfinite(time_s)
    if not known.any():
        return ""
    if mapped.has("lat_deg", "lon_deg") and (unit := _by_places(mapped, time_s, speed, known)):
        return unit
    fast = float(np.quantile(np.abs(speed[known]), _MOST)) > _FASTEST_MPS
    return "km/h" if fast else ""


def _by_places(mapped: Mapped, time_s: Floats, speed: Floats, known: Bools) -> str:
    lat, lon = (mapped.number(name) for name in ("lat_deg", "lon_deg"))
    east_m, north_m = metres_about_middle(lon, lat)
    places = pd.DataFrame({"time_s": time_s, "east_m": east_m, "north_m": north_m})
    rows = pd.DataFrame({"time_s": time_s[known], "speed_mps": speed[known]})
    rows = rows.sort_values("time_s").drop_duplicates("time_s")
    # Ten times too fast: else the positions tell nothing.
    if speed_unit_fault(rows["time_s"], 10 * rows["speed_mps"], places) is None:
        return ""
    fault = speed_unit_fault(rows["time_s"], rows["speed_mps"], places)
    if fault is None:
        return "m/s"
    units = {"km/h": _KMH, **_OTHERS}
    off = {unit: abs(float(np.log(times * fault.factor))) for unit, times in units.items()}
    nearest = min(off, key=off.__getitem__)
    return nearest if off[nearest] <= np.log(_OFF) else ""
