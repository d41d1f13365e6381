"""Local times of a file that is read part by part: a later part may tell those of earlier ones."""

from __future__ import annotations

import numpy as np

from mapfilter._types import Floats
from mapfilter.clocks.local_times import LONGEST_STEP_S, change_notes, doubled_s
from mapfilter.tracks.readers.recorded.reading import Reading


def note_changes(
    reading: Reading, local_s: Floats, utc_s: Floats, zone: str, after_s: float
) -> None:
    """Note odd local times of a part, and mend the rows of parts before it.

    A file that begins within an hour that comes twice is taken for the first of these. Where it
    goes on after the second one without a gap, its rows so far are those of the second.

    Parameters
    ----------
    reading : Reading
    local_s, utc_s, zone, after_s
        As of :func:`mapfilter.clocks.local_times.change_notes`.
    """
    notes = change_notes(local_s, utc_s, zone, after_s)
    for note in notes:
        reading.note(note)
    known_s = utc_s[np.isfinite(local_s)]
    if not known_s.size:
        return
    later_s = doubled_s(local_s, utc_s, zone)
    if not np.isfinite(after_s):
        reading.doubled = (later_s, notes[-1] if later_s else "")
    elif reading.doubled[0] and not later_s:
        later_s, note = reading.doubled
        reading.doubled = (0.0, "")
        reading.notes.remove(note)
        if later_s <= known_s[0] - after_s <= later_s + LONGEST_STEP_S:
            reading.shift(later_s)
