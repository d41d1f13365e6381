"""Motion that is not replayed, as the log's own fixes disprove it and an option mends it."""

from __future__ import annotations

from collections.abc import Collection

from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.motion_fault import MOTION_COLUMNS, MotionFault, fault_notes
from mapfilter.tracks.motion_faults import motion_faults


def refused_faults(log: TrackLog, given: Collection[str]) -> dict[str, MotionFault]:
    """Return the faults for which a log is not replayed: what fixes prove and options mend.

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
