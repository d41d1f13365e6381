"""Times of a plain CSV whose clock was set back while its rows were written."""

from __future__ import annotations

import numpy as np

from mapfilter._types import Floats, Ints
from mapfilter.tracks.checks.clock_steps import clock_steps
from mapfilter.tracks.readers.clocks.set_back import set_back_by
from mapfilter.tracks.readers.recorded.reading import Reading


def with_clock_set_right(time_s: Floats, line: Ints, reading: Reading) -> Floats:
    """Return times that go on where a clock was set back, with a note.

    A clock is set to the right time, so that rows before it are earlier, also those of parts that
    were read before; where it is set forward again by as much, it was wrong in between.

    Parameters
    ----------
    time_s : (N,) array
        Of the rows in the order in which they were written; NaN where missing.
    line : (N,) array of int
        The file's line of each row.
    reading : Reading
    """
    known = np.flatnonzero(np.isfinite(time_s))
    steps = clock_steps(time_s[known]) if reading.clock.kind in ("utc", "local") else ()
    if not steps or set_back_by(np.array([step.back_s for step in steps]), reading.clock):
        return time_s
    moved = time_s.copy()
    for step in steps:
        where = f"time goes back by {step.back_s:g} s after line {line[known[step.row - 1]]}"
        if np.isfinite(step.again_s):
            moved[known[step.row : step.again]] += step.late_s
            done = f"rows until it is set again are taken {step.late_s:g} s later"
        else:
            moved[known[: step.row]] -= step.late_s
            reading.shift(-step.late_s)
            done = f"earlier rows are taken {step.late_s:g} s earlier"
        reading.note(f"{where}, as when a clock is set back; {done}")
    return moved
