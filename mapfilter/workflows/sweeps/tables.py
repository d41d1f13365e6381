"""Tables of a sweep: its cells, and the pairs of its filters, in full and in brief."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import pandas as pd

from mapfilter.evaluation.paired import PairedCell
from mapfilter.evaluation.success_cells import HEADING, READING, SuccessCell, axes_of

_SUCCESS = ("runs", "success", "low", "high", "wrong", "error_mean_m", "switch_distance_m")
_COVERAGE = ("coverage_95", "coverage_95_low", "coverage_95_high")
_FOUND = (*_SUCCESS, "claimed", *_COVERAGE, "radius_95_median_m")
_BRIEF = (*_SUCCESS, "coverage_95", "radius_95_median_m")
_GAINED = ("success", "success_routes_low", "success_routes_high", "wrong")
_PAIR_BRIEF = (READING, "baseline", "runs", *_GAINED, "error_m", "distance_m")


def cell_table(cells: Sequence[SuccessCell]) -> pd.DataFrame:
    """Return one row for each cell: coordinates in which the cells differ, and main figures."""
    names = [*axes_of(cells), *_FOUND]
    return pd.DataFrame([asdict(cell) | cell.place for cell in cells])[names]


def pair_table(pairs: Sequence[PairedCell]) -> pd.DataFrame:
    """Return one row for each pair: coordinates in which the pairs differ, and all figures."""
    rows = pd.DataFrame([pair.row for pair in pairs])
    alike = [name for name in pairs[0].place if len({repr(value) for value in rows[name]}) == 1]
    return rows.drop(columns=alike)


def brief_pairs(pairs: Sequence[PairedCell]) -> list[dict[str, Any]]:
    """Return a row for each pair: coordinates in which the pairs differ, and main figures."""
    if not pairs:
        return []
    names = [name for name in pair_table(pairs) if name in (*pairs[0].place, *_PAIR_BRIEF)]
    return [{name: pair.row[name] for name in names} for pair in pairs]


def brief(cells: Sequence[SuccessCell]) -> list[dict[str, Any]]:
    """Return a row for each cell, or with several heading noises for all that differ in it alone.

    Rows hold those coordinates in which the cells differ. With one heading noise they hold the
    main figures, with several the success at each.

    Examples
    --------
    >>> from dataclasses import replace
    >>> place = dict.fromkeys(SuccessCell.__dataclass_fields__, 0.0)
    >>> cell = SuccessCell(**{**place, "runs": 4, "success": 0.75, "varied": {}})
    >>> brief([cell, replace(cell, sigma_orient_deg=3.0, success=0.5)])
    [{'runs': 4, 'success at 0°': 0.75, '3°': 0.5}]
    >>> list(brief([cell, replace(cell, sigma_trans_m=0.4)])[0])[:3]
    ['sigma_trans_m', 'runs', 'success']
    """
    axes = axes_of(cells, by_reading=True)
    if HEADING not in axes:
        names = [*axes, *_BRIEF]
        return [{name: (asdict(cell) | cell.place)[name] for name in names} for cell in cells]
    axes = [name for name in axes if name not in (HEADING, f"imu.{HEADING}")]
    degrees = sorted({cell.sigma_orient_deg for cell in cells})
    names = [f"{'' if number else 'success at '}{deg:g}°" for number, deg in enumerate(degrees)]
    rows: dict[str, dict[str, Any]] = {}
    for cell in cells:
        at = {name: cell.place[name] for name in axes}
        row = rows.setdefault(repr(at), {**at, "runs": cell.runs, **dict.fromkeys(names)})
        row[names[degrees.index(cell.sigma_orient_deg)]] = round(cell.success, 3)
    return list(rows.values())
