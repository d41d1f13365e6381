"""Success over the cells of a grid, from a table with one row for each run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import pandas as pd

from mapfilter.evaluation.success import wilson_interval, wilson_interval_of_routes

COORDINATES = (
    "database",
    "radio",
    "prediction_error_db",
    "report_period_s",
    "imu_period_s",
    "filter",
    "reading",
    "update_length_m",
    "sigma_trans_m",
    "sigma_orient_deg",
    "bias_deg",
    "drift_deg_per_sqrt_s",
    "scale",
)
"""Columns that tell the cells of a grid apart."""


@dataclass(frozen=True, slots=True)
class SuccessCell:
    """All runs in one cell of a grid.

    Parameters
    ----------
    database, radio, filter, reading : str
        Names.
    prediction_error_db, report_period_s, imu_period_s, update_length_m, sigma_trans_m : float
    sigma_orient_deg, bias_deg, drift_deg_per_sqrt_s, scale : float
        Where in the grid; NaN where that is not known.
    runs, routes : int
        Counts.
    success, low, high : float
        Share of successful runs, and its 95 % Wilson interval for *these* routes.
    routes_low, routes_high : float
        The interval for all routes of the area; NaN for a single one.
    switched, wrong : float
        Shares of all runs: those that switched, and those that switched more than 50 m off.
    error_mean_m, error_67_m, error_95_m : float
        Means over the successful runs of each run's figure, as Table 4 of Khalaf-Allah 2007.
    switch_distance_m : float
        Mean over the runs that switched.
    """

    database: str
    radio: str
    prediction_error_db: float
    report_period_s: float
    imu_period_s: float
    filter: str
    reading: str
    update_length_m: float
    sigma_trans_m: float
    sigma_orient_deg: float
    bias_deg: float
    drift_deg_per_sqrt_s: float
    scale: float
    runs: int
    routes: int
    success: float
    low: float
    high: float
    routes_low: float
    routes_high: float
    switched: float
    wrong: float
    error_mean_m: float
    error_67_m: float
    error_95_m: float
    switch_distance_m: float


def success_cells(runs: pd.DataFrame) -> tuple[SuccessCell, ...]:
    """Score every cell of a grid, in the order in which the cells first occur.

    Parameters
    ----------
    runs : pandas.DataFrame
        The coordinates, ``route``, ``switched``, ``success``, ``switch_distance_m`` and the errors
        of each run, as a sweep's table holds them.
    """
    grouped = runs.groupby(list(COORDINATES), sort=False, dropna=False)
    return tuple(_cell(place, rows) for place, rows in grouped)


def _cell(place: tuple[object, ...], rows: pd.DataFrame) -> SuccessCell:
    by_route = rows.groupby("route")["success"].agg(["sum", "count"])
    good, total = int(by_route["sum"].sum()), len(rows)
    right = rows[rows["success"]]
    low, high = wilson_interval(good, total)
    routes_low, routes_high = wilson_interval_of_routes(by_route["sum"], by_route["count"])
    at: dict[str, Any] = dict(zip(COORDINATES, place, strict=True))
    return SuccessCell(
        **at,
        runs=total,
        routes=len(by_route),
        success=good / total,
        low=low,
        high=high,
        routes_low=routes_low,
        routes_high=routes_high,
        switched=float(rows["switched"].mean()),
        wrong=float((rows["switched"] & ~rows["success"]).mean()),
        error_mean_m=float(right["error_mean_m"].mean()),
        error_67_m=float(right["error_67_m"].mean()),
        error_95_m=float(right["error_95_m"].mean()),
        switch_distance_m=float(rows["switch_distance_m"].mean()),
    )
