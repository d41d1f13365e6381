"""Motion of a log that is located: its factors, and what the log's own fixes disprove."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from mapfilter.api.logs import read_log, read_log_of_area
from mapfilter.errors import ConfigError, Faults, InputError
from mapfilter.tracks.checks.motion_fault import MotionFault
from mapfilter.tracks.checks.refused_motion import AS_HEADING, note_refused
from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.motion_factors import check_factors, scaled_log


def with_right_motion(
    log: TrackLog | Path | str,
    crs: str,
    about_deg: tuple[float, float] | None,
    factors: Mapping[str, float],
) -> TrackLog:
    """Return a log with its motion times factors, read where it is a path.

    Parameters
    ----------
    log : TrackLog or path
    crs : str
        In which recordings are read.
    about_deg : (float, float) or None
        Latitude and longitude of the area, for recordings without positions.
    factors : mapping of str to float
        By column of motion. One of 1 takes a column as it is.

    Raises
    ------
    ConfigError
        A factor is of no column, or 0 or no number.
    InputError
        The log's fixes prove that a column of its motion is of another unit or sense, and it has no
        factor; or a factor has no column.
    """
    faults = Faults()
    check_factors(factors, "factors", faults)
    faults.raise_if_any(ConfigError)
    if isinstance(log, TrackLog):
        where, log = "log", scaled_log(log, factors, "log")
    else:
        where = str(log)
        if about_deg is None:
            log = read_log(log, crs=crs, factors=factors)
        else:
            log = read_log_of_area(log, crs, about_deg, factors)
    note_refused(log, factors, where, _mends, faults)
    faults.raise_if_any(InputError)
    return log


def _mends(fault: MotionFault) -> tuple[str, str]:
    """Return the arguments that mend a fault, and that take the column as it is."""
    kept = f'factors={{"{fault.column}": 1}}'
    if fault.remedy:
        name, _, column = fault.remedy.removeprefix("--column ").partition("=")
        read = f'mf.read_log(…, columns={{"{name}": "{column}"}}) of the recording'
        return f"{read} mends it, or {AS_HEADING}", kept
    return f'factors={{"{fault.column}": {fault.factor:.4g}}} mends it', kept
