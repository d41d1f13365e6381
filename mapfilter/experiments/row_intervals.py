"""Intervals of the errors in the table of a benchmark on recordings, beside its rows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import nan
from typing import Literal

import numpy as np

from mapfilter._same import EqualByValue
from mapfilter._types import Bools, Floats
from mapfilter.evaluation.intervals import LEAST_POOLED, pooled_interval, share_interval

Over = Literal["units", "runs", "reports", ""]


@dataclass(frozen=True, eq=False)
class RowInterval(EqualByValue):
    """The 95 % intervals of one row's errors, over what is independent of each other.

    Parameters
    ----------
    part, method : str
        As in the row.
    over : {"units", "runs", "reports", ""}
        What is drawn again. Runs of one or two units say nothing of other units; "" where there is
        too little to draw from, and all intervals are NaN.
    count : int
        How many there are. Intervals over fewer than ten are too narrow.
    median_low_m, median_high_m, mean_low_m, mean_high_m : float
        Of the errors' median, and of the mean of the finite ones.
    coverage_low, coverage_high : float
        Of the share within the 95 % radius.
    """

    part: str
    method: str
    over: Over
    count: int
    median_low_m: float = nan
    median_high_m: float = nan
    mean_low_m: float = nan
    mean_high_m: float = nan
    coverage_low: float = nan
    coverage_high: float = nan


@dataclass(frozen=True, eq=False)
class ScoredRun:
    """Errors of one run, and where its 95 % radius held the truth.

    Parameters
    ----------
    error_m : ndarray, shape (N,)
    covered : ndarray of bool, shape (N,)
        Empty without radii.
    reports : bool
        Whether the errors are those of reports that are independent of each other.
    dependent : bool
        Whether the run is one of many neighbouring points of its unit: no interval.
    """

    unit: str
    error_m: Floats
    covered: Bools
    reports: bool = False
    dependent: bool = False


def interval_of(part: str, method: str, runs: Sequence[ScoredRun]) -> RowInterval:
    """Return the intervals of a part and method, from all of its runs."""
    over, errors, covered = _groups(runs)
    if len(errors) < LEAST_POOLED:
        return RowInterval(part, method, "", len(errors))
    finite = [one[np.isfinite(one)] for one in errors]
    held = [(int(one.sum()), one.size) for one in covered if one.size]
    shares = share_interval(*zip(*held, strict=True)) if held else (nan, nan)
    return RowInterval(
        part,
        method,
        over,
        len(errors),
        *pooled_interval(errors),
        *pooled_interval(finite, "mean"),
        *shares,
    )


def _groups(runs: Sequence[ScoredRun]) -> tuple[Over, list[Floats], list[Bools]]:
    """Return what is drawn again: its kind, its errors, and where radii held."""
    if any(one.dependent for one in runs):
        return "", [], []
    if any(one.reports for one in runs):
        errors = np.concatenate([one.error_m for one in runs])
        covered = np.concatenate([one.covered for one in runs])
        return "reports", list(errors[:, None]), list(covered[:, None])
    units = list(dict.fromkeys(one.unit for one in runs))
    if len(units) < LEAST_POOLED:
        own = [one for one in runs if one.error_m.size]
        return "runs", [one.error_m for one in own], [one.covered for one in own]
    grouped = [[one for one in runs if one.unit == unit and one.error_m.size] for unit in units]
    grouped = [own for own in grouped if own]
    return (
        "units",
        [np.concatenate([one.error_m for one in own]) for own in grouped],
        [np.concatenate([one.covered for one in own]) for own in grouped],
    )
