"""Times of a table that go back: rows out of order, or a clock that was set."""

from __future__ import annotations

import numpy as np

from mapfilter._types import Floats

_STEPS = 3
_ROWS = 3
"""At most so many steps are those of a clock; so many rows come again between the same times."""


def told_clock_steps(time_s: Floats) -> str | None:
    """Return what a note says of a clock that was set back; None where there is no such step.

    It makes the same times twice: rows before and after the step lie between the same two times.
    Rows that are out of order do not overlap so.

    Examples
    --------
    >>> told_clock_steps(np.array([0.0, 1.0, 2.0, 3.0, 0.5, 1.5, 2.5, 3.5]))
    'time goes back by 2.5 s after 3 s, as when a clock is set back; sorted by time'
    >>> told_clock_steps(np.array([0.0, 2.0, 1.0, 3.0])) is None
    True
    """
    back = np.flatnonzero(np.diff(time_s) < 0)
    if not 0 < back.size <= _STEPS:
        return None
    steps = [_step(time_s, int(at)) for at in back]
    told = [step for step in steps if step is not None]
    if len(told) < back.size:
        return None
    return f"time goes back {', '.join(told)}, as when a clock is set back; sorted by time"


def _step(time_s: Floats, at: int) -> str | None:
    """Return by how much and when, if rows on both sides lie between the same times."""
    before, after = time_s[: at + 1], time_s[at + 1 :]
    first, last = max(before.min(), after.min()), min(before.max(), after.max())
    twice = [np.sum((rows >= first) & (rows <= last)) for rows in (before, after)]
    if min(twice) < _ROWS:
        return None
    return f"by {before[-1] - after[0]:g} s after {before[-1]:g} s"
