"""The table of sessions found: a row for each part and method, and one for each session."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields
from math import isfinite, nan
from pathlib import Path
from typing import Any

import numpy as np

from mapfilter._io import read_sealed, write_sealed
from mapfilter._types import Bools, Floats
from mapfilter.errors import StoreError, fail
from mapfilter.evaluation.success import wilson_interval, wilson_interval_of_routes
from mapfilter.experiments.benchmarks.ottawa import METHODS, FoundSession

_MAPPED_SHARE = 0.5


@dataclass(frozen=True)
class PartRow:
    """Accuracy of one method on one part.

    Parameters
    ----------
    method : str
        ``bayes``: from CONVERGED on; ``smoothed``: whole tracks, smoothed; both also as
        ``-mapped``, of the sessions of which at least half lies within 50 m of where others were;
        ``centroid``: the mean place of the serving cell's rows.
    unit_count : int
        Sessions, each left out once.
    n : int
        Fixes that were scored, over all draws of the noise.
    median_m, mean_m, p95_m : float
        Of their errors.
    success, success_low, success_high : float
        Share of the runs that converged at most 50 m off, with the 95 % Wilson interval over
        sessions.
    coverage_95 : float
        Share of the scored fixes within the 95 % radius.
    baseline_m : float
        Median error of the centroids of the same sessions.
    published_m : float
        NaN: no figures of others are known.
    """

    part: str
    method: str
    unit_count: int
    n: int
    median_m: float
    mean_m: float
    p95_m: float
    success: float
    success_low: float
    success_high: float
    coverage_95: float
    baseline_m: float
    published_m: float = nan


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


def part_rows(
    part: str, found: Sequence[FoundSession], centroid_m: dict[str, Floats]
) -> list[PartRow]:
    """Summarise the sessions of a part; ``centroid_m`` are errors of the centroids, by session."""
    mapped = {one.session for one in found if one.on_map >= _MAPPED_SHARE}
    rows = []
    for method in METHODS:
        own = [one for one in found if one.method == method]
        rows.append(_row(part, method, own, centroid_m))
        if mapped and len(mapped) < len(centroid_m):
            some = [one for one in own if one.session in mapped]
            rows.append(_row(part, f"{method}-mapped", some, centroid_m))
    every = _joined(centroid_m.values())
    errors = _errors(every)
    rows.append(
        PartRow(
            part, "centroid", len(centroid_m), every.size, *errors, nan, nan, nan, nan, errors[0]
        )
    )
    return rows


def session_rows(found: Sequence[FoundSession], centroid_m: dict[str, Floats]) -> list[SessionRow]:
    """Summarise each session, in the order of their names."""
    rows = []
    for name in sorted({one.session for one in found}):
        own = [one for one in found if one.session == name and one.method == "bayes"]
        smoothed = [one for one in found if one.session == name and one.method == "smoothed"]
        converged = [one for one in own if one.converged]
        errors = _joined(one.error_m for one in own)
        rows.append(
            SessionRow(
                own[0].part,
                name,
                own[0].on_map,
                len(own),
                len(converged),
                sum(one.success for one in own),
                _median(np.array([one.switch_m for one in converged])),
                _median(np.array([one.error_at_switch_m for one in converged])),
                errors.size,
                _median(errors),
                _mean(_joined(one.covered for one in own)),
                _median(_joined(one.error_m for one in smoothed)),
                _median(centroid_m[name]),
                sum(one.lost for one in own),
            )
        )
    return rows


def _row(
    part: str, method: str, found: Sequence[FoundSession], centroid_m: dict[str, Floats]
) -> PartRow:
    names = sorted({one.session for one in found})
    runs = [sum(one.session == name for one in found) for name in names]
    good = [sum(one.success for one in found if one.session == name) for name in names]
    if len(found) == len(names):
        low, high = wilson_interval(sum(good), len(found))
    else:
        low, high = wilson_interval_of_routes(good, runs)
    errors = _joined(one.error_m for one in found)
    return PartRow(
        part,
        method,
        len(names),
        errors.size,
        *_errors(errors),
        sum(good) / len(found) if found else nan,
        low,
        high,
        _mean(_joined(one.covered for one in found)),
        _median(_joined(centroid_m[name] for name in names)),
    )


def _joined(parts: Iterable[Floats | Bools]) -> Floats:
    return np.concatenate([np.empty(0), *parts])


def _errors(errors_m: Floats) -> tuple[float, float, float]:
    """Return median, mean and 95 % of errors; NaN without any."""
    p95_m = float(np.quantile(errors_m, 0.95)) if errors_m.size else nan
    return _median(errors_m), _mean(errors_m), p95_m


def _median(values: Floats) -> float:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if known.size else nan


def _mean(values: Floats) -> float:
    return float(np.mean(values)) if values.size else nan


@dataclass(frozen=True, eq=False)
class LeftOut:
    """One session, found several times, and errors of the centroids of its serving cells."""

    session: str
    centroid_m: Floats
    found: tuple[FoundSession, ...]


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
