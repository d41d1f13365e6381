"""What a benchmark finds in a recording, and the rows of the table that all benchmarks share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from math import isfinite, nan
from pathlib import Path
from typing import Any

import numpy as np

from mapfilter._json_files import read_sealed, write_sealed
from mapfilter._types import Bools, Floats
from mapfilter.errors import StoreError, fail
from mapfilter.evaluation.accuracy import mean_of
from mapfilter.experiments.accuracy_row import (
    Row,
    joined,
    median_of,
    quantile_of,
    row_of,
    success_of,
)
from mapfilter.experiments.row_intervals import RowInterval, ScoredRun, interval_of


@dataclass(frozen=True, eq=False)
class Found:
    """What one method found in one run of one unit.

    Parameters
    ----------
    unit : str
        Name of the journey, session or file.
    success, claimed, wrong : bool or None
        Whether it did what is asked for; whether a position was ever claimed; whether the first
        claim was more than 50 m off. None where there is no such thing.
    error_m : ndarray, shape (N,)
        Scored errors; infinite where a position was asked for and there was none.
    covered : ndarray of bool, shape (N,)
        Whether the 95 % radius held the truth; empty without radii.
    baseline_m : ndarray, shape (M,)
        Errors of the baseline.
    after_m : float
        Travelled until the first claim; NaN without any.
    lost : int
        Epochs that were LOST.
    seconds, real_s : float
        Processor time of the filter, and duration of the recording.
    note : str
        What is worth saying about the run.
    count : int
        Units that this stands for: the reports of a table.
    dependent : bool
        It is one of many neighbouring points of its unit: no interval is computed of them.
    """

    part: str
    method: str
    unit: str
    success: bool | None
    claimed: bool | None
    wrong: bool | None
    error_m: Floats
    covered: Bools
    baseline_m: Floats = field(default_factory=lambda: np.empty(0))
    after_m: float = nan
    lost: int = 0
    seconds: float = nan
    real_s: float = nan
    note: str = ""
    count: int = 1
    dependent: bool = False


@dataclass(frozen=True)
class UnitRow:
    """One unit and method over all of its runs: counts, and medians over the runs.

    Parameters
    ----------
    claimed, wrong : int
        Runs that claimed a position; those whose first claim was more than 50 m off.
    after_m : float
        Median way until the first claim, of the runs with one.
    real_time : float
        Seconds of the recording for each second of the filter.
    note : str
        Of the run with the largest 95 % error.
    """

    part: str
    method: str
    unit: str
    runs: int
    successes: int
    claimed: int
    wrong: int
    after_m: float
    median_m: float
    p95_m: float
    coverage_95: float
    lost: int
    real_time: float
    note: str


def table_rows(
    found: Sequence[Found],
    published_m: Mapping[tuple[str, str], float] | None = None,
    *,
    baseline: str = "median",
) -> list[Row]:
    """Return one row for each part and method, in the order of their first runs.

    Parameters
    ----------
    published_m : mapping of (part, method) to float, optional
        The method "" stands for all methods of a part, the part "" with it for all parts.
    baseline : {"median", "mean"}
        Statistic of the baseline's errors.
    """
    known = published_m or {}
    rows = []
    for part, method in dict.fromkeys((one.part, one.method) for one in found):
        own = [one for one in found if (one.part, one.method) == (part, method)]
        published = known.get((part, method), known.get((part, ""), known.get(("", ""), nan)))
        rows.append(_row(part, method, own, published, baseline))
    return rows


def table_intervals(found: Sequence[Found]) -> list[RowInterval]:
    """Return the intervals of each part and method, in the order of :func:`table_rows`."""
    keys = dict.fromkeys((one.part, one.method) for one in found)
    return [
        interval_of(
            part,
            method,
            [
                ScoredRun(o.unit, o.error_m, o.covered, o.count > 1, o.dependent)
                for o in found
                if (o.part, o.method) == (part, method)
            ],
        )
        for part, method in keys
    ]


def unit_rows(found: Sequence[Found]) -> list[UnitRow]:
    """Return one row for each part, method and unit."""
    rows = []
    keys = dict.fromkeys((one.part, one.method, one.unit) for one in found)
    for part, method, unit in keys:
        own = [o for o in found if (o.part, o.method, o.unit) == (part, method, unit)]
        errors = joined(one.error_m for one in own)
        worst = max(own, key=_worst_m)
        seconds = sum(one.seconds for one in own)
        rows.append(
            UnitRow(
                part,
                method,
                unit,
                len(own),
                sum(bool(one.success) for one in own),
                sum(bool(one.claimed) for one in own),
                sum(bool(one.wrong) for one in own),
                median_of(np.array([one.after_m for one in own])),
                median_of(errors),
                quantile_of(errors, 0.95),
                mean_of(joined(one.covered for one in own)),
                sum(one.lost for one in own),
                sum(one.real_s for one in own) / seconds if seconds > 0 else nan,
                worst.note,
            )
        )
    return rows


def worst_of(found: Sequence[Found]) -> Found | None:
    """Return the worst run: a wrong claim before the largest 95 % error; None without any run."""
    return max(found, key=lambda one: (bool(one.wrong), _worst_m(one)), default=None)


def write_found(found: Sequence[Found], file: Path) -> None:
    """Write what was found in a unit."""
    rows = [{one.name: _plain(getattr(each, one.name)) for one in fields(Found)} for each in found]
    write_sealed(file, {"found": rows})


def read_found(file: Path) -> tuple[Found, ...]:
    """Read what :func:`write_found` wrote; a missing, damaged or edited file is a StoreError."""
    read = read_sealed(file)
    try:
        return tuple(Found(**{k: _read(k, v) for k, v in row.items()}) for row in read["found"])
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise fail(StoreError, str(file), "the results of a unit", error, "cut off") from error


def _row(part: str, method: str, own: Sequence[Found], published_m: float, baseline: str) -> Row:
    units = {one.unit for one in own}
    of_baseline = joined(one.baseline_m for one in own)
    of_baseline = of_baseline[np.isfinite(of_baseline)]
    judged = [one for one in own if one.success is not None]
    success = success_of(
        [one.unit for one in judged],
        [bool(one.success) for one in judged],
        interval=not any(one.dependent for one in judged),
    )
    return row_of(
        part,
        method,
        max(len(units), sum(one.count for one in own if one.count > 1)),
        joined(one.error_m for one in own),
        success,
        joined(one.covered for one in own),
        mean_of(of_baseline) if baseline == "mean" else median_of(of_baseline),
        published_m,
    )


def _worst_m(one: Found) -> float:
    return quantile_of(one.error_m, 0.95) if one.error_m.size else -1.0


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        # JSON knows neither infinity nor NaN; numpy reads the words back.
        return [each if isfinite(each) else str(each) for each in value.tolist()]
    return None if isinstance(value, float) and not isfinite(value) else value


_FLOATS = ("after_m", "seconds", "real_s")


def _read(name: str, value: Any) -> Any:
    if isinstance(value, list):
        return np.array(value, dtype=np.bool_ if name == "covered" else np.float64)
    return nan if value is None and name in _FLOATS else value
