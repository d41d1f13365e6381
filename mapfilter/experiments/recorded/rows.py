"""What a benchmark finds in a recording, and the rows of the table that all benchmarks share."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from math import inf, isfinite, nan
from pathlib import Path
from typing import Any

import numpy as np

from mapfilter._io import read_sealed, write_sealed
from mapfilter._types import Bools, Floats
from mapfilter.errors import StoreError, fail
from mapfilter.evaluation.success import wilson_interval, wilson_interval_of_routes


@dataclass(frozen=True)
class Row:
    """Accuracy of one method on one part of a data set.

    Parameters
    ----------
    unit_count : int
        Journeys, sessions or reports: what is independent of each other.
    n : int
        Places or times that were scored.
    median_m, p95_m : float
        Of the errors there; NaN without any. An error without a position is infinite.
    mean_m : float
        Of the finite errors.
    success, success_low, success_high : float
        Share of the runs that did what the benchmark asks for, with its 95 % interval over units;
        NaN where nothing is asked for but the errors. Without an interval where the runs are
        neighbouring points of one journey.
    coverage_95 : float
        Share of what was scored where the 95 % radius held the truth; NaN without radii.
    baseline_m : float
        Error of the benchmark's baseline by the same statistic as its target.
    published_m : float
        Published figure of the same part; NaN if there is none.
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
    published_m: float


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


def unit_rows(found: Sequence[Found]) -> list[UnitRow]:
    """Return one row for each part, method and unit."""
    rows = []
    keys = dict.fromkeys((one.part, one.method, one.unit) for one in found)
    for part, method, unit in keys:
        own = [o for o in found if (o.part, o.method, o.unit) == (part, method, unit)]
        errors = _joined(one.error_m for one in own)
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
                _median(np.array([one.after_m for one in own])),
                _median(errors),
                _quantile(errors, 0.95),
                _mean(_joined(one.covered for one in own)),
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
    units = sorted({one.unit for one in own})
    errors = _joined(one.error_m for one in own)
    of_baseline = _joined(one.baseline_m for one in own)
    of_baseline = of_baseline[np.isfinite(of_baseline)]
    baseline_m = _mean(of_baseline) if baseline == "mean" else _median(of_baseline)
    count = max(len(units), sum(one.count for one in own if one.count > 1))
    return Row(
        part,
        method,
        count,
        errors.size,
        _median(errors),
        _mean(errors[np.isfinite(errors)]),
        _quantile(errors, 0.95),
        *_success(own, units),
        _mean(_joined(one.covered for one in own)),
        baseline_m,
        published_m,
    )


def _success(own: Sequence[Found], units: Sequence[str]) -> tuple[float, float, float]:
    judged = [one for one in own if one.success is not None]
    if not judged:
        return nan, nan, nan
    runs = [sum(one.unit == name for one in judged) for name in units]
    good = [sum(bool(one.success) for one in judged if one.unit == name) for name in units]
    if any(one.dependent for one in judged):
        return sum(good) / len(judged), nan, nan
    # One unit says nothing of others: the interval is that of its runs.
    single = len(units) == 1 or len(judged) == len(units)
    low, high = (
        wilson_interval(sum(good), len(judged)) if single else wilson_interval_of_routes(good, runs)
    )
    return sum(good) / len(judged), low, high


def _worst_m(one: Found) -> float:
    return _quantile(one.error_m, 0.95) if one.error_m.size else -1.0


def _joined(parts: Iterable[Floats | Bools]) -> Floats:
    return np.concatenate([np.empty(0), *parts])


def _median(values: Floats) -> float:
    known = values[~np.isnan(values)]
    return float(np.median(known)) if known.size else nan


def _quantile(values: Floats, share: float) -> float:
    if not values.size:
        return nan
    above = float(np.quantile(values, share, method="higher"))
    # Between a finite and an infinite error there is no interpolation.
    return float(np.quantile(values, share)) if isfinite(above) else above


def _mean(values: Floats) -> float:
    return float(np.mean(values)) if values.size else nan


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        # JSON knows no infinity; numpy reads the word back.
        return ["inf" if each == inf else each for each in value.tolist()]
    return None if isinstance(value, float) and not isfinite(value) else value


_FLOATS = ("after_m", "seconds", "real_s")


def _read(name: str, value: Any) -> Any:
    if isinstance(value, list):
        return np.array(value, dtype=np.bool_ if name == "covered" else np.float64)
    return nan if value is None and name in _FLOATS else value
