"""The cells of a grid as people read them: only what differs, and what came out."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from mapfilter.evaluation.success_cells import COORDINATES, SuccessCell

_FOUND = ("runs", "success", "low", "high", "wrong", "error_mean_m", "switch_distance_m")
_ACROSS, _NAME = "sigma_orient_deg", "reading"


def brief(cells: Sequence[SuccessCell]) -> list[dict[str, Any]]:
    """Return a row for each cell, or with several heading noises for all that differ in it alone.

    Rows hold those coordinates in which the cells differ. With one heading noise they hold the
    main figures, with several the success at each.

    Examples
    --------
    >>> from dataclasses import replace
    >>> place = dict.fromkeys(SuccessCell.__dataclass_fields__, 0.0)
    >>> cell = SuccessCell(**{**place, "runs": 4, "success": 0.75})
    >>> brief([cell, replace(cell, sigma_orient_deg=3.0, success=0.5)])
    [{'runs': 4, 'success at 0°': 0.75, '3°': 0.5}]
    >>> list(brief([cell, replace(cell, sigma_trans_m=0.4)])[0])[:3]
    ['sigma_trans_m', 'runs', 'success']
    """
    axes = [name for name in COORDINATES if len({repr(getattr(c, name)) for c in cells}) > 1]
    if _NAME in axes:
        # What belongs to a name is told by it.
        axes = [name for name in axes if name in (_NAME, _ACROSS) or not _belongs(cells, name)]
    if _ACROSS not in axes:
        return [{name: getattr(cell, name) for name in (*axes, *_FOUND)} for cell in cells]
    axes.remove(_ACROSS)
    degrees = sorted({cell.sigma_orient_deg for cell in cells})
    names = [f"{'' if place else 'success at '}{deg:g}°" for place, deg in enumerate(degrees)]
    rows: dict[str, dict[str, Any]] = {}
    for cell in cells:
        place = {name: getattr(cell, name) for name in axes}
        empty: dict[str, Any] = dict.fromkeys(names)
        row = rows.setdefault(repr(place), {**place, "runs": cell.runs, **empty})
        row[names[degrees.index(cell.sigma_orient_deg)]] = round(cell.success, 3)
    return list(rows.values())


def _belongs(cells: Sequence[SuccessCell], axis: str) -> bool:
    """Tell whether all cells of a reading have one value of a coordinate."""
    values = {(cell.reading, repr(getattr(cell, axis))) for cell in cells}
    return len(values) == len({cell.reading for cell in cells})
