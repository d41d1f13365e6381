"""Motion that is not located, as the log's own fixes disprove it and an option mends it."""

from __future__ import annotations

from collections.abc import Callable, Collection

from mapfilter.errors import Faults
from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.motion_fault import MOTION_COLUMNS, MotionFault, fault_notes
from mapfilter.tracks.motion_faults import motion_faults

AS_HEADING = "heading_rad as π/2 minus the azimuth in radians"
"""What mends headings of a compass in a log that was written."""


def refused_faults(log: TrackLog, given: Collection[str]) -> dict[str, MotionFault]:
    """Return the faults for which a log is not located: what fixes prove and options mend.

    What ground truth alone shows is noted: filters are judged by it, also with faults that are
    meant.

    Parameters
    ----------
    log : TrackLog
        With its notes: where positions are the likely fault there is none on motion.
    given : collection of str
        Columns that a person gave a factor for.
    """
    noted = {one for one in MOTION_COLUMNS if fault_notes(log.notes, one)} - set(given)
    if not noted:
        return {}
    found = motion_faults(log.motion, log.gnss)
    return {name: fault for name, fault in found.items() if name in noted and fault.option}


def note_refused(
    log: TrackLog,
    given: Collection[str],
    where: str,
    mends: Callable[[MotionFault], tuple[str, str]],
    faults: Faults,
) -> None:
    """Note columns of motion that the log's fixes prove to be of another unit or sense.

    Dead reckoning by them would claim wrong positions where the positions end.

    Parameters
    ----------
    log, given
        As of :func:`refused_faults`.
    where : str
        What the motion is of, in messages.
    mends : callable
        Returns what mends a fault, and what takes the column as it is, in words.
    """
    for column, fault in refused_faults(log, given).items():
        mended, kept = mends(fault)
        other = f"; or {fault.otherwise}" if fault.otherwise else ""
        hint = f"{mended}; {kept} takes it as it is{other}"
        faults.add(f"{where}, motion, {column}", fault.expected, fault.found, hint)
