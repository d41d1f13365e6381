"""Levels that mean "not received": a filler in a table of all cells, or the floor of a receiver.

Such a value stands at the lower end of the levels of a session, and is far more frequent than those
just above it. It is no level: taken as one it moves what is fitted by many dB. The rows are left
out, as logs of what was received have none; levels that are taken to be at most the floor, and
filled in, were no better where a cell is received (simulated drive tests, ``measured-maps``).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

import numpy as np

from mapfilter._types import Bools, Floats, Ints
from mapfilter._words import number_of
from mapfilter.errors import listed
from mapfilter.survey.measurements import Measurements
from mapfilter.survey.weakest_reported import scale_of

_SQUARE_M = 10.0
_FEWEST_SQUARES = 10
_TIMES = 3.0
_COMPARED = 3
_FAR_DB = 10.0
_LEAST_VALUES = 8
"""Fewer different levels are those of a coarse scale, such as the bars of a phone."""
_NAMED = 3


def without_floor_values(measurements: Measurements) -> Measurements:
    """Leave out the rows whose level is a floor, with a note that counts them.

    A floor is the lowest level of a session, or of all together, of one technology, that is in ten
    squares of 10 m or more, and 10 dB below the next level or in three times as many squares as
    any of the next three. There may be two: a filler, and the floor above it.
    """
    at_floor = np.zeros(len(measurements), dtype=np.bool_)
    square = _squares(measurements)
    for rows in _groups(measurements):
        rows = rows[~at_floor[rows]]
        while (found := _at_floor(measurements.level_dbm[rows], square[rows])) is not None:
            at_floor[rows[found]] = True
            rows = rows[~found]
    if not at_floor.any():
        return measurements
    counts = Counter(measurements.level_dbm[at_floor].tolist())
    values = [f"{level_dbm:g} dBm ({count})" for level_dbm, count in sorted(counts.items())]
    return measurements.where(
        ~at_floor,
        f"{int(at_floor.sum())} of {number_of(len(at_floor), 'row')} left out: the lowest level, "
        f"repeated far more often than those above it: {listed(values, _NAMED)} (likely: what "
        "stands for a cell that was not received, or the floor of the receiver)",
    )


def fillers(level_dbm: Floats) -> Bools:
    """Return which levels fill in for cells that were not received, where squares are not known.

    That is the lowest one of ten rows or more, 10 dB below the next. NaN is ignored.

    Examples
    --------
    >>> levels = np.array([-140.0] * 12 + [*range(-110, -60, 5)])
    >>> int(fillers(levels).sum()), int(fillers(levels[12:]).sum())
    (12, 0)
    """
    values, count = np.unique(level_dbm[np.isfinite(level_dbm)], return_counts=True)
    if len(values) <= _LEAST_VALUES or count[0] < _FEWEST_SQUARES:
        return np.zeros(len(level_dbm), dtype=np.bool_)
    far = values[1] - values[0] >= _FAR_DB
    return np.asarray((level_dbm == values[0]) & far)


def _squares(measurements: Measurements) -> Ints:
    """Return the number of the cell and square of each row: who stands still counts once."""
    places = np.column_stack([measurements.east_m, measurements.north_m])
    keys = np.column_stack([measurements.cell, np.floor(places / _SQUARE_M)])
    return np.unique(keys, axis=0, return_inverse=True)[1].astype(np.int64)


def _groups(measurements: Measurements) -> Iterator[Ints]:
    """Yield the rows of each session, then of all, by technology: their levels can be compared."""
    known = measurements.technologies
    kinds = [scale_of(known.get(cell_id)) for cell_id in measurements.cell_ids]
    kind = np.unique(np.array(kinds, dtype=np.str_), return_inverse=True)[1][measurements.cell]
    both = kind * (int(measurements.session.max(initial=0)) + 1) + measurements.session
    for group in (both, kind):
        order = np.argsort(group, kind="stable")
        yield from np.split(order, np.flatnonzero(np.diff(group[order])) + 1)


def _at_floor(level_dbm: Floats, square: Ints) -> Bools | None:
    """Return which levels are a floor; None where the lowest one is a level like others."""
    values, which = np.unique(level_dbm, return_inverse=True)
    if len(values) <= _LEAST_VALUES:
        return None
    # Only the lowest levels are compared.
    low = which <= _COMPARED
    pairs = np.unique(np.column_stack([which[low], square[low]]), axis=0)
    count = np.bincount(pairs[:, 0], minlength=_COMPARED + 1)
    far = values[1] - values[0] >= _FAR_DB
    is_floor = count[0] >= _FEWEST_SQUARES and (far or count[0] >= _TIMES * count[1:].max())
    return np.asarray(which == 0) if is_floor else None
