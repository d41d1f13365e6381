"""Positions whose degrees have few decimals: they lie in steps of 100 m or more."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from mapfilter._words import number_of
from mapfilter.tracks.joining.position_units import METRES_PER_DEGREE, RADIUS_68

_FEWEST = 10
_DECIMALS, _EXACT_DEG = 3, 1e-9
_MARK = ": degrees of "


def rounding_m(rows: pd.DataFrame) -> float:
    """Return the step of positions whose degrees have three decimals or fewer; 0 for others.

    Parameters
    ----------
    rows : pandas.DataFrame
        lat_deg and lon_deg; or other positions, which have no such step.

    Examples
    --------
    >>> degrees = 60 + np.arange(30) / 1000
    >>> round(rounding_m(pd.DataFrame({"lat_deg": degrees, "lon_deg": 25.0})))
    111
    """
    decimals = _decimals(rows) if "lat_deg" in rows else None
    return 0.0 if decimals is None else METRES_PER_DEGREE * 10.0**-decimals


def with_rounding(rows: pd.DataFrame, where: str = "positions") -> tuple[pd.DataFrame, str]:
    """Return positions whose accuracy holds the error of rounding, and a note; "" without one.

    Parameters
    ----------
    rows : pandas.DataFrame
        lat_deg, lon_deg and, if it is stated, accuracy_m: the radius that holds 68 %.
    where : str
        Name of the table in the note.
    """
    decimals = _decimals(rows)
    if decimals is None:
        return rows, ""
    step_m = METRES_PER_DEGREE * 10.0**-decimals
    sd_m, given_m = step_m / 12**0.5, np.zeros(len(rows))
    if "accuracy_m" in rows:
        given_m = rows["accuracy_m"].fillna(0.0).to_numpy(dtype=np.float64)
    some = number_of(decimals, "decimal")
    note = f"{where}{_MARK}{some}, in steps of {step_m:.0f} m: errors of ± {sd_m:.0f} m"
    return rows.assign(accuracy_m=np.hypot(given_m, RADIUS_68 * sd_m)), note


def rounded_notes(notes: Sequence[str]) -> tuple[str, ...]:
    """Return those notes of a log that name positions of few decimals."""
    return tuple(note for note in notes if _MARK in note and "errors of ±" in note)


def _decimals(rows: pd.DataFrame) -> int | None:
    degrees = rows[["lat_deg", "lon_deg"]].to_numpy(dtype=np.float64)
    if len(rows) < _FEWEST or (np.ptp(degrees, axis=0) == 0).all():
        return None
    return next(
        (
            count
            for count in range(_DECIMALS + 1)
            if (np.abs(degrees - np.round(degrees, count)) < _EXACT_DEG).all()
        ),
        None,
    )
