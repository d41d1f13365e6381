"""Some rows of arrays: those that are kept, and those that differ from the row before."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mapfilter._types import Bools, Floats, Ints


def only(columns: Mapping[str, Any], lines: Ints, rows: Bools) -> tuple[dict[str, Any], Ints]:
    """Return some rows of arrays, and their lines; the arrays themselves where all are kept."""
    if rows.all():
        return dict(columns), lines
    kept = {name: v[rows] if np.ndim(v) else v for name, v in columns.items()}
    return kept, lines[rows]


def changed_rows(columns: Mapping[str, Floats], names: Sequence[str]) -> Bools:
    """Return which rows differ from the row before in one of some columns; the first one does."""
    changed = np.ones(len(columns[names[0]]), dtype=bool)
    if len(changed):
        steps = np.stack([np.diff(np.nan_to_num(columns[name])) for name in names])
        changed[1:] = (steps != 0).any(axis=0)
    return changed
