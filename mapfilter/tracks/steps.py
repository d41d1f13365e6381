"""Whether the steps of a log can be metres moved in each interval."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd

from mapfilter._types import Floats
from mapfilter.errors import Faults

_FEW_ROWS = 10
_MANY_ROWS = 20
_FASTEST_MPS = 100.0
_SLOWEST_MPS = 0.02
_LONG_S = 60.0
_MOSTLY = 2 / 3
_SOMEWHERE_M = 100.0
_KILO = (100.0, 1200.0)
"""Between these, positions lie apart by the kilometres of the steps, or a part of them."""
_FASTEST_KMPS = 0.1

_EXPECTED = "metres moved in each interval"


def check_steps(tables: Mapping[str, pd.DataFrame], where: str, faults: Faults) -> tuple[str, ...]:
    """See that steps are neither cumulative, nor backwards, nor in another unit.

    Parameters
    ----------
    tables : mapping of str to pandas.DataFrame
        Of a log, with finite times, sorted. Tables of less than ten steps are let pass.
    where : str
        What faults call the table of motion.
    faults : Faults
        Collects what cannot be.

    Returns
    -------
    tuple of str
        Notes on what is odd, but can be.
    """
    motion = tables["motion"]
    motion = motion[np.isfinite(motion["step_m"].to_numpy())]
    time_s, step_m = motion["time_s"].to_numpy(), motion["step_m"].to_numpy()
    if len(step_m) < _FEW_ROWS:
        return ()
    lasted_s, moved_m = float(np.ptp(time_s)), float(np.abs(step_m).sum())
    between_s = np.diff(time_s)
    speed_mps = np.abs(step_m[1:])[between_s > 0] / between_s[between_s > 0]
    typical_mps = float(np.median(speed_mps)) if speed_mps.size else 0.0
    moving = step_m[step_m != 0]
    extent_m = _extent_m(tables, float(time_s[0]), float(time_s[-1]))
    column = f"{where}, step_m"
    if _grows(step_m, lasted_s):
        got = f"steps that only grow, from {step_m[0]:g} to {step_m[-1]:g}"
        faults.add(column, _EXPECTED, got, "distance since the start; give its differences")
    elif typical_mps > _FASTEST_MPS:
        hint = "centimetres or millimetres given for metres, or distance since the start"
        faults.add(column, _EXPECTED, f"{typical_mps:.0f} m/s in the median", hint)
    elif moving.size >= _FEW_ROWS and np.mean(moving < 0) > _MOSTLY:
        got = f"{int(np.sum(moving < 0))} negative steps of {moving.size}"
        faults.add(column, f"{_EXPECTED} along its heading", got, "a sign the other way round")
    elif typical_mps < _FASTEST_KMPS and _in_kilometres(moved_m, extent_m):
        got = f"{moved_m:.3g} m in all, while positions lie {extent_m:.0f} m apart"
        faults.add(column, _EXPECTED, got, "kilometres given for metres")
    elif lasted_s >= _LONG_S and 0 < moved_m < _SLOWEST_MPS * lasted_s:
        return (
            f"motion, step_m: only {moved_m:.3g} m in {lasted_s:.0f} s; kilometres for metres?",
        )
    return ()


def _in_kilometres(moved_m: float, extent_m: float) -> bool:
    low, high = _KILO
    return extent_m > _SOMEWHERE_M and low * moved_m < extent_m <= high * moved_m


def _grows(step_m: Floats, lasted_s: float) -> bool:
    """Tell whether steps never shrink and mostly grow: a car that speeds up for long does not."""
    growth_m = np.diff(step_m)
    long = len(step_m) >= _MANY_ROWS and lasted_s >= _LONG_S / 3
    return bool(long and np.all(growth_m >= 0) and np.mean(growth_m > 0) > 0.5)


def _extent_m(tables: Mapping[str, pd.DataFrame], first_s: float, last_s: float) -> float:
    """Return how far apart true positions or fixes lie within some time."""
    found = [0.0]
    for table in ("truth", "gnss"):
        places = tables[table]
        places = places[places["time_s"].between(first_s, last_s)]
        if len(places):
            found.append(float(np.hypot(np.ptp(places["east_m"]), np.ptp(places["north_m"]))))
    return max(found)
