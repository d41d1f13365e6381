"""The cells of a grid as people read them: only what differs, and what came out."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from mapfilter.evaluation.success_cells import COORDINATES, SuccessCell

_FOUND = ("runs", "success", "low", "high", "wrong", "error_mean_m", "switch_distance_m")


def brief(cells: Sequence[SuccessCell]) -> list[dict[str, Any]]:
    """Return each cell with those coordinates in which the cells differ, and its main figures.

    Examples
    --------
    >>> from dataclasses import replace
    >>> place = dict.fromkeys(SuccessCell.__dataclass_fields__, 0.0)
    >>> cell = SuccessCell(**place)
    >>> [list(one)[:2] for one in brief([cell, replace(cell, sigma_orient_deg=3.0)])]
    [['sigma_orient_deg', 'runs'], ['sigma_orient_deg', 'runs']]
    """
    axes = [name for name in COORDINATES if len({repr(getattr(c, name)) for c in cells}) > 1]
    return [{name: getattr(cell, name) for name in (*axes, *_FOUND)} for cell in cells]
