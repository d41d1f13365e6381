"""The worst of many single reports: which one it is, and why, by rules over what it received."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from mapfilter._json_files import read_sealed, write_sealed
from mapfilter._types import Floats
from mapfilter.errors import StoreError, fail
from mapfilter.positioning.fingerprints.located import LocatedReports
from mapfilter.positioning.fingerprints.reports import Reports

MOST_PLACES = 4000
"""Places kept for a picture, evenly taken."""
_NEAREST = 5
_FEW = 2
_FAR, _LEAST_FAR_M = 3.0, 5.0


@dataclass(frozen=True, eq=False)
class WorstReport:
    """The worst report of one unit and method, for a picture.

    Parameters
    ----------
    number : int
        Of the report, from 0.
    error_m, radius_m : float
        Infinite without a position; radius that should hold 95 %.
    truth_m, place_m : (2,) array
        East and north of the true and of the estimated position; NaN without one.
    map_m : (M, 2) array
        Places of the database's reports, thinned.
    places_m : (N, 2) array
        True places of the located reports, thinned.
    errors_m : (N,) array
        Errors there.
    causes : tuple of str
        In words.
    """

    number: int
    error_m: float
    radius_m: float
    truth_m: Floats
    place_m: Floats
    map_m: Floats
    places_m: Floats
    errors_m: Floats
    causes: tuple[str, ...]

    @property
    def what(self) -> str:
        """What went wrong, in a few words."""
        if not np.isfinite(self.error_m):
            return "no position"
        held = "holds" if self.error_m <= self.radius_m else "does not hold"
        return f"{self.error_m:.0f} m off; the 95 % radius of {self.radius_m:.0f} m {held} it"


def worst_report(
    reports: Reports, located: LocatedReports, database: Reports
) -> WorstReport | None:
    """Return the worst of the reports whose true position is known; None without any.

    One without a position is worse than any error.

    Parameters
    ----------
    reports, located : Reports, LocatedReports
        What was received, and the positions of these reports by one method.
    database : Reports
        What they were located by.
    """
    known = np.isfinite(reports.east_m)
    if not known.any():
        return None
    error_m = np.where(np.isfinite(located.error_m), located.error_m, np.inf)
    number = int(np.argmax(np.where(known, error_m, -1.0)))
    truth = np.column_stack([reports.east_m, reports.north_m])
    place = np.array([located.east_m[number], located.north_m[number]])
    shown = np.flatnonzero(known & np.isfinite(located.error_m))
    shown = shown[:: max(1, len(shown) // MOST_PLACES)]
    of_map = np.column_stack([database.east_m, database.north_m])
    of_map = of_map[np.isfinite(of_map).all(axis=1)]
    return WorstReport(
        number,
        float(error_m[number]),
        float(located.radii_m[number, 2]),
        truth[number],
        place,
        of_map[:: max(1, len(of_map) // MOST_PLACES)],
        truth[shown],
        located.error_m[shown],
        causes_of_report(reports, number, place, database),
    )


def causes_of_report(
    reports: Reports, number: int, place_m: Floats, database: Reports
) -> tuple[str, ...]:
    """Return what can have caused the error of a report, in words; empty if no rule holds."""
    levels = _levels(reports, number)
    have = set(database.cell_ids)
    heard = {cell: level for cell, level in levels.items() if cell in have}
    if not heard:
        return (f"the database has none of the {len(levels)} transmitters received",)
    found = []
    counts = np.diff(reports.first)
    usual = float(np.median(counts))
    if len(heard) <= _FEW < usual:
        found.append(f"few readings: {len(heard)}, where {usual:.0f} are usual")
    elif len(heard) <= _FEW:
        found.append(f"few readings: {len(heard)}")
    truth_m = np.array([reports.east_m[number], reports.north_m[number]])
    rows = np.flatnonzero(np.isfinite(database.east_m))
    tree = cKDTree(np.column_stack([database.east_m, database.north_m])[rows])
    away_m, near = (np.atleast_1d(part) for part in tree.query(truth_m, min(_NEAREST, len(rows))))
    apart_m = np.median(tree.query(tree.data[:: max(1, len(rows) // 500)], 2)[0][:, 1])
    if away_m[0] > max(_FAR * apart_m, _LEAST_FAR_M):
        found.append(f"off the map: its nearest report is {away_m[0]:.0f} m from the true place")
    if not np.isfinite(place_m).all():
        return tuple(found)
    _, there = (np.atleast_1d(part) for part in tree.query(place_m, min(_NEAREST, len(rows))))
    true_share, true_db = _alike(heard, database, rows[near])
    own_share, own_db = _alike(heard, database, rows[there])
    if true_share < own_share:
        found.append(
            f"other transmitters: the map has {100 * true_share:.0f} % of those received about the "
            f"true place, and {100 * own_share:.0f} % about the estimate"
        )
    if np.isfinite(true_db) and own_db < true_db:
        found.append(
            f"levels as elsewhere: {true_db:.0f} dB from the map's at the true place, "
            f"{own_db:.0f} dB at the estimate (root mean square)"
        )
    return tuple(found)


def write_worst_report(report: WorstReport, file: Path) -> None:
    """Write a worst report."""
    write_sealed(file, {one.name: _plain(getattr(report, one.name)) for one in fields(WorstReport)})


def read_worst_report(file: Path) -> WorstReport | None:
    """Read what :func:`write_worst_report` wrote; None without the file, StoreError if damaged."""
    if not file.is_file():
        return None
    read = read_sealed(file)
    try:
        values: dict[str, Any] = {
            name: np.array(read[name], dtype=np.float64)
            for name in ("truth_m", "place_m", "map_m", "places_m", "errors_m")
        }
        values |= {name: float(read[name]) for name in ("error_m", "radius_m")}
        values |= {"number": int(read["number"]), "causes": tuple(read["causes"])}
        return WorstReport(**values)
    except (KeyError, TypeError, ValueError) as error:
        raise fail(StoreError, str(file), "a worst report", error, "cut off") from error


def _levels(reports: Reports, number: int) -> dict[str, float]:
    """Return the levels of a report by transmitter; NaN where the level is missing."""
    of = slice(int(reports.first[number]), int(reports.first[number + 1]))
    names = [reports.cell_ids[cell] for cell in reports.cell[of]]
    return dict(zip(names, reports.level_dbm[of].tolist(), strict=True))


def _alike(heard: dict[str, float], database: Reports, rows: Sequence[int]) -> tuple[float, float]:
    """Return the share of transmitters that some reports have, and how their levels differ."""
    near = [_levels(database, int(row)) for row in rows]
    apart = []
    count = 0
    for cell, level in heard.items():
        own = [some[cell] for some in near if cell in some]
        count += bool(own)
        if own and np.isfinite(own).any() and np.isfinite(level):
            apart.append(level - float(np.nanmean(own)))
    rms_db = float(np.sqrt(np.mean(np.square(apart)))) if apart else float("nan")
    return count / len(heard), rms_db


def _plain(value: Any) -> Any:
    """Return a value for JSON, which knows no NaN and no infinity; numpy reads the words back."""
    if isinstance(value, np.ndarray):
        return [_plain(one) for one in value] if value.ndim > 1 else [_word(v) for v in value]
    return _word(value) if isinstance(value, float) else value


def _word(value: float) -> float | str:
    return float(value) if np.isfinite(value) else str(float(value))
