"""The row of the table that all benchmarks on recordings share, and its statistics."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import isfinite, nan

import numpy as np

from mapfilter._same import EqualByValue
from mapfilter._types import Bools, Floats
from mapfilter.evaluation.accuracy import mean_of
from mapfilter.evaluation.success import wilson_interval, wilson_interval_of_routes


@dataclass(frozen=True, eq=False)
class Row(EqualByValue):
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
    published_m: float = nan


@dataclass(frozen=True, eq=False)
class Success(EqualByValue):
    """Share of successful runs and its 95 % interval; NaN where there is none."""

    share: float = nan
    low: float = nan
    high: float = nan


def row_of(
    part: str,
    method: str,
    unit_count: int,
    errors_m: Floats,
    success: Success,
    covered: Floats,
    baseline_m: float,
    published_m: float = nan,
) -> Row:
    """Return a row from the joined errors of its runs; other parameters are those of the row."""
    return Row(
        part,
        method,
        unit_count,
        errors_m.size,
        median_of(errors_m),
        mean_of(errors_m[np.isfinite(errors_m)]),
        quantile_of(errors_m, 0.95),
        success.share,
        success.low,
        success.high,
        mean_of(covered),
        baseline_m,
        published_m,
    )


def success_of(unit_of: Sequence[str], good: Sequence[bool], *, interval: bool = True) -> Success:
    """Return the share of good runs, and its interval over units.

    One unit says nothing of others: the interval is that of its runs.
    """
    if not len(good):
        return Success()
    share = sum(good) / len(good)
    if not interval:
        return Success(share)
    units = sorted(set(unit_of))
    if len(units) in (1, len(good)):
        return Success(share, *wilson_interval(sum(good), len(good)))
    runs = [sum(name == unit for name in unit_of) for unit in units]
    each = [sum(g for name, g in zip(unit_of, good, strict=True) if name == u) for u in units]
    return Success(share, *wilson_interval_of_routes(each, runs))


def joined(parts: Iterable[Floats | Bools]) -> Floats:
    """Return all values in one array."""
    return np.concatenate([np.empty(0), *parts])


def median_of(values: Floats) -> float:
    """Return the median of what is not NaN; NaN without any."""
    known = values[~np.isnan(values)]
    return float(np.median(known)) if known.size else nan


def quantile_of(values: Floats, share: float) -> float:
    """Return a quantile, which may be infinite; NaN without values."""
    if not values.size:
        return nan
    above = float(np.quantile(values, share, method="higher"))
    # Between a finite and an infinite error there is no interpolation.
    return float(np.quantile(values, share)) if isfinite(above) else above
