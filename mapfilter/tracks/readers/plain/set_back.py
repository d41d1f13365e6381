"""Times of a plain CSV whose clock was set back while its rows were written."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from mapfilter._types import Floats, Ints
from mapfilter.tracks.checks.clock_steps import ClockStep, clock_steps
from mapfilter.tracks.readers.clocks.set_back import set_back_by
from mapfilter.tracks.readers.plain.fix_states import fix_column
from mapfilter.tracks.readers.plain.mapped import Mapped
from mapfilter.tracks.readers.recorded.reading import Reading
from mapfilter.tracks.readers.texts.numbers import MISSING

_FLAGS, _MOSTLY = {"0", "1"}, 0.5


def with_clock_set_right(time_s: Floats, mapped: Mapped, reading: Reading) -> Floats:
    """Return times that go on where a clock was set back, with a note.

    A clock is set to the right time, so that rows before it are earlier, also those of parts that
    were read before; where it is set forward again by as much, it was wrong in between. Series that
    are written one after the other, such as those of two sensors, and rows that are there twice are
    no clock.

    Parameters
    ----------
    time_s : (N,) array
        Of the rows in the order in which they were written; NaN where missing.
    mapped : Mapped
    reading : Reading
    """
    known = np.flatnonzero(np.isfinite(time_s))
    steps = clock_steps(time_s[known]) if reading.clock.kind in ("utc", "local") else ()
    if not steps or set_back_by(np.array([step.back_s for step in steps]), reading.clock):
        return time_s
    if _are_series(mapped, time_s, known, steps):
        return time_s
    moved, line = time_s.copy(), mapped.rows.line
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


def _are_series(mapped: Mapped, time_s: Floats, known: Ints, steps: tuple[ClockStep, ...]) -> bool:
    """Return whether the rows of two sides of a step are of two sensors, or the same twice."""
    rows = mapped.rows
    parts = np.split(known, [step.row for step in steps])
    sides = list(pairwise(parts))
    common = [np.intersect1d(time_s[a], time_s[b], return_indices=True)[1:] for a, b in sides]
    equal = [np.ones(len(first), dtype=np.bool_) for first, _ in common]
    only_before, only_after = (np.zeros(len(sides), dtype=np.bool_) for _ in range(2))
    # A first fix may set the clock, and dates change with it.
    beside = {*mapped.beside, fix_column(rows)}
    for name in dict.fromkeys(rows.names):
        texts, filled = rows.texts(name), ~rows.flags(name, true=MISSING)
        for side, (before, after) in enumerate(sides):
            first, second = common[side]
            equal[side] &= texts[before[first]] == texts[after[second]]
            if filled[before].any() and filled[after].any():
                words = set(texts[before].tolist()), set(texts[after].tolist())
                if name not in beside and _name_series(*words, measured=name in mapped.taken):
                    return True
            else:
                only_before[side] |= filled[before].any()
                only_after[side] |= filled[after].any()
    repeated = any(one.mean() > _MOSTLY for one in equal if one.size)
    return repeated or bool((only_before & only_after).any())


def _name_series(before: set[str], after: set[str], *, measured: bool) -> bool:
    """Return whether words of two sides name what each is of: one each; of values no numbers."""
    both = before | after
    if not len(before) == len(after) == 1 or len(both) == 1:
        return False
    return not measured or both == _FLAGS or not any(map(str.isdigit, "".join(both)))
