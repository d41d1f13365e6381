"""The table of sessions found: a row for each part and method, and one for each session."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from math import isfinite, nan
from pathlib import Path
from typing import Any

import numpy as np

from mapfilter._json_files import read_sealed, write_sealed
from mapfilter._types import Floats
from mapfilter.errors import StoreError, fail
from mapfilter.evaluation.accuracy import mean_of
from mapfilter.experiments.accuracy_row import Row, Success, joined, median_of, row_of, success_of
from mapfilter.experiments.benchmarks.ottawa import METHODS, ORACLES, FoundSession
from mapfilter.experiments.row_intervals import RowInterval, ScoredRun, interval_of

_MAPPED_SHARE = 0.5
_CENTROID = "centroid"


@dataclass(frozen=True)
class SessionRow:
    """Results of one session, over all draws of the noise.

    Parameters
    ----------
    on_map : float
        Share of its good fixes within 50 m of where others were.
    switch_m, error_at_switch_m : float
        Medians over the runs that converged.
    n : int
        Fixes scored from CONVERGED on.
    smoothed_m : float
        Median error of the whole smoothed track.
    lost : int
        Epochs that were LOST.
    """

    part: str
    session: str
    on_map: float
    runs: int
    converged: int
    successes: int
    switch_m: float
    error_at_switch_m: float
    n: int
    median_m: float
    coverage_95: float
    smoothed_m: float
    centroid_m: float
    lost: int


def part_rows(part: str, found: Sequence[FoundSession], centroid_m: dict[str, Floats]) -> list[Row]:
    """Return a row for each method on a part, then that of the centroids.

    Methods are ``bayes``, from CONVERGED on; ``smoothed``, whole tracks; both also as ``-mapped``,
    of the sessions of which at least half lies within 50 m of where others were; the oracles, from
    CONVERGED on; ``centroid``, the mean place of the serving cell's rows. A run succeeds that
    converges at most 50 m off. The baseline is the median error of the centroids of the same
    sessions.

    Parameters
    ----------
    centroid_m : dict of str to ndarray
        Errors of the centroids, by session.
    """
    rows = [_row(part, method, own, centroid_m) for method, own in _by_method(found)]
    every = joined(centroid_m.values())
    no_radii = np.empty(0)
    usual_m = median_of(every)
    rows.append(row_of(part, _CENTROID, len(centroid_m), every, Success(), no_radii, usual_m))
    return rows


def part_intervals(
    part: str, found: Sequence[FoundSession], centroid_m: dict[str, Floats]
) -> list[RowInterval]:
    """Return the intervals of each row of :func:`part_rows`, in its order, over sessions."""
    intervals = [
        interval_of(part, method, [ScoredRun(o.session, o.error_m, o.covered) for o in own])
        for method, own in _by_method(found)
    ]
    no_radii = np.empty(0, dtype=np.bool_)
    centroids = [ScoredRun(name, each, no_radii) for name, each in centroid_m.items()]
    return [*intervals, interval_of(part, _CENTROID, centroids)]


def _by_method(found: Sequence[FoundSession]) -> list[tuple[str, list[FoundSession]]]:
    """Return the runs of each row but that of the centroids."""
    sessions = {one.session for one in found}
    mapped = {one.session for one in found if one.on_map >= _MAPPED_SHARE}
    selected = []
    for method in METHODS:
        own = [one for one in found if one.method == method]
        selected.append((method, own))
        if mapped and mapped != sessions:
            selected.append((f"{method}-mapped", [one for one in own if one.session in mapped]))
    for oracle in ORACLES:
        own = [one for one in found if one.method == oracle]
        selected += [(oracle, own)] if own else []
    return selected


def session_rows(found: Sequence[FoundSession], centroid_m: dict[str, Floats]) -> list[SessionRow]:
    """Summarise each session, in the order of their names."""
    rows = []
    for name in sorted({one.session for one in found}):
        own = [one for one in found if one.session == name and one.method == "bayes"]
        smoothed = [one for one in found if one.session == name and one.method == "smoothed"]
        converged = [one for one in own if one.converged]
        errors = joined(one.error_m for one in own)
        rows.append(
            SessionRow(
                own[0].part,
                name,
                own[0].on_map,
                len(own),
                len(converged),
                sum(one.success for one in own),
                median_of(np.array([one.switch_m for one in converged])),
                median_of(np.array([one.error_at_switch_m for one in converged])),
                errors.size,
                median_of(errors),
                mean_of(joined(one.covered for one in own)),
                median_of(joined(one.error_m for one in smoothed)),
                median_of(centroid_m[name]),
                sum(one.lost for one in own),
            )
        )
    return rows


def _row(
    part: str, method: str, found: Sequence[FoundSession], centroid_m: dict[str, Floats]
) -> Row:
    names = sorted({one.session for one in found})
    return row_of(
        part,
        method,
        len(names),
        joined(one.error_m for one in found),
        success_of([one.session for one in found], [one.success for one in found]),
        joined(one.covered for one in found),
        median_of(joined(centroid_m[name] for name in names)),
    )


@dataclass(frozen=True, eq=False)
class LeftOut:
    """One session, found several times, and errors of the centroids of its serving cells."""

    session: str
    centroid_m: Floats
    found: tuple[FoundSession, ...]


def worst_session(every: Sequence[LeftOut]) -> tuple[int, int] | None:
    """Return the worst run by ``bayes``: index of its session, and its draw; None without any.

    A wrong claim is worse than the largest median error of a whole smoothed track.
    """
    runs = []
    for i, one in enumerate(every):
        filtered = [found for found in one.found if found.method == METHODS[0]]
        smoothed = [found for found in one.found if found.method == METHODS[1]]
        for draw, (found, track) in enumerate(zip(filtered, smoothed, strict=True)):
            wrong = found.converged and not found.success
            error_m = median_of(track.error_m)
            runs.append((wrong, error_m if isfinite(error_m) else 0.0, -i, -draw))
    if not runs:
        return None
    _, _, session, draw = max(runs)
    return -session, -draw


def write_left_out(left_out: LeftOut, file: Path) -> None:
    """Write the results of a session."""
    rows = [
        {one.name: _plain(getattr(found, one.name)) for one in fields(FoundSession)}
        for found in left_out.found
    ]
    centroid_m = left_out.centroid_m.tolist()
    write_sealed(file, {"session": left_out.session, "centroid_m": centroid_m, "found": rows})


def read_left_out(file: Path) -> LeftOut:
    """Read the results of a session; a missing, damaged or edited file is a StoreError."""
    read = read_sealed(file)
    try:
        found = tuple(
            FoundSession(**{name: _read(name, value) for name, value in row.items()})
            for row in read["found"]
        )
        return LeftOut(read["session"], np.array(read["centroid_m"], dtype=np.float64), found)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise fail(StoreError, str(file), "the results of a session", error, "cut off") from error


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.tolist()
    return None if isinstance(value, float) and not isfinite(value) else value


def _read(name: str, value: Any) -> Any:
    if isinstance(value, list):
        return np.array(value, dtype=np.bool_ if name == "covered" else np.float64)
    return nan if value is None else value
