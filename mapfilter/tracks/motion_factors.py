"""Columns of motion times a factor that a person gives: another unit, or another sense of turns."""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite

import numpy as np
import pandas as pd

from mapfilter.angles import wrap_rad
from mapfilter.errors import Faults, InputError
from mapfilter.tracks.checks.motion_fault import MOTION_COLUMNS, fault_notes
from mapfilter.tracks.log import TrackLog, make_log
from mapfilter.tracks.schema import TABLES


def check_factors(factors: Mapping[str, float], where: str, faults: Faults) -> None:
    """Note columns that have no factor, and factors that are 0 or no number.

    ``where`` is the option or argument that gives them.
    """
    for column, factor in factors.items():
        if column not in MOTION_COLUMNS:
            faults.add(where, f"one of {', '.join(MOTION_COLUMNS)}", column)
        elif not isfinite(factor) or factor == 0:
            faults.add(f"{where} {column}", "a number other than 0", f"{factor:g}")


def scaled_motion(
    motion: pd.DataFrame | None, factors: Mapping[str, float], where: str
) -> tuple[pd.DataFrame | None, tuple[str, ...]]:
    """Return motion with columns times their factors, and a note on each.

    Parameters
    ----------
    motion : pandas.DataFrame or None
        step_m, heading_rad and turn_rad; None for no motion.
    factors : mapping of str to float
        By column. One of 1 leaves a column as it is.
    where : str
        Name of the motion in messages.

    Raises
    ------
    InputError
        There are no values of a column that has a factor.

    Examples
    --------
    >>> motion = pd.DataFrame({"turn_rad": [0.0, 0.5], "step_m": 1.0})
    >>> scaled, notes = scaled_motion(motion, {"turn_rad": -1.0}, "drive")
    >>> scaled["turn_rad"].tolist(), notes
    ([-0.0, -0.5], ('motion, turn_rad: times -1, as given',))
    """
    faults, notes, changed = Faults(), list[str](), {}
    for column, factor in factors.items():
        if motion is None or column not in motion or motion[column].isna().all():
            faults.add(f"{where}, --factor {column}", f"motion with {column}", "none")
        elif factor != 1:
            values = factor * motion[column].to_numpy(dtype=np.float64)
            changed[column] = wrap_rad(values) if column == "heading_rad" else values
            if column == "step_m" and "sampling_sd_m" in motion:
                # The error of a step is in its unit.
                changed["sampling_sd_m"] = abs(factor) * motion["sampling_sd_m"].to_numpy()
            notes.append(f"motion, {column}: times {factor:g}, as given")
    faults.raise_if_any(InputError)
    return (motion if motion is None else motion.assign(**changed)), tuple(notes)


def scaled_log(log: TrackLog, factors: Mapping[str, float], where: str) -> TrackLog:
    """Return a log with columns of its motion times their factors, and its notes by them.

    Parameters
    ----------
    log : TrackLog
    factors : mapping of str to float
        By column.
    where : str
        Name of the log in messages.

    Raises
    ------
    InputError
        There are no values of a column that has a factor, or those that it gives make no sense.
    """
    if not factors:
        return log
    motion, notes = scaled_motion(log.motion, factors, where)
    outdated = {note for column in MOTION_COLUMNS for note in fault_notes(log.notes, column)}
    tables = {name: getattr(log, name) for name in TABLES} | {"motion": motion}
    return make_log(
        log.crs,
        **tables,
        start_utc_s=log.start_utc_s,
        notes=(*(note for note in log.notes if note not in outdated), *notes),
        imu=log.imu,
        vehicle=log.vehicle,
    )
