"""Motion that is not located, as the log's own fixes disprove it and an option mends it."""

from __future__ import annotations

from collections.abc import Callable, Collection

from mapfilter.errors import Faults
from mapfilter.tracks.checks.headings import are_mirrored
from mapfilter.tracks.checks.motion_fault import (
    BY_COMPASS,
    MIRRORED,
    MOTION_COLUMNS,
    MotionFault,
    fault_notes,
)
from mapfilter.tracks.checks.motion_faults import motion_faults
from mapfilter.tracks.log import TrackLog

_BY_COMPASS = f"{MIRRORED} {BY_COMPASS}: "
AS_HEADING = "heading_rad as π/2 minus the azimuth in radians"
"""What mends headings of a compass in a log that was written."""


def mirrored_notes(log: TrackLog) -> list[str]:
    """Return the notes of a log on positions that are a mirror image of the way by a compass."""
    return [note for note in log.notes if _BY_COMPASS in note]


def refused_faults(log: TrackLog, given: Collection[str]) -> dict[str, MotionFault]:
    """Return the faults for which a log is not located: what fixes prove and options mend.

    Headings of a compass that are a mirror image of the fixes are one, whichever of both is wrong:
    without an option, the recording is to be mended. What ground truth alone shows is noted:
    filters are judged by it, also with faults that are meant.

    Parameters
    ----------
    log : TrackLog
        With its notes: where positions are the likely fault there is none on motion.
    given : collection of str
        Columns that a person gave a factor for.
    """
    noted = {one for one in MOTION_COLUMNS if fault_notes(log.notes, one)} - set(given)
    found = motion_faults(log.motion, log.gnss) if noted else {}
    refused = {name: fault for name, fault in found.items() if name in noted and fault.option}
    causes = [note.rpartition(_BY_COMPASS)[2] for note in mirrored_notes(log)]
    if causes and "heading_rad" not in given and are_mirrored(log.motion, log.gnss):
        mirror = "headings of a compass that are their mirror image", "courses of the positions"
        likely = causes[0].removesuffix("?")
        refused["heading_rad"] = MotionFault("heading_rad", *mirror, otherwise=likely)
    return refused


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
        Returns what mends a fault by its option, and what takes the column as it is, in words.
    """
    for column, fault in refused_faults(log, given).items():
        mended, kept = mends(fault)
        as_it_is = f"{kept} takes it as it is"
        other = f"; or {fault.otherwise}" if fault.otherwise else ""
        hint = f"{mended}; {as_it_is}{other}"
        if not fault.option:
            hint = f"{fault.otherwise}; {as_it_is}"
        faults.add(f"{where}, motion, {column}", fault.expected, fault.found, hint)
