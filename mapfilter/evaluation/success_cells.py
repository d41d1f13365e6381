"""Success rates over a grid: the runs of each cell, with their intervals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from itertools import takewhile
from typing import Any

import pandas as pd

from mapfilter.evaluation.success import wilson_interval, wilson_interval_of_routes

HEADING = "sigma_orient_deg"
"""The coordinate over which tables and figures show success."""

READING = "reading"
"""The coordinate that names filters."""


@dataclass(frozen=True, slots=True)
class SuccessCell:
    """All runs in one cell of a grid.

    Parameters
    ----------
    database, radio, filter, reading : str
        Names.
    sigma_orient_deg, bias_sd_deg, drift_deg_per_sqrt_s, scale : float
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
    varied : dict of str to float
        Values of varied options, by dotted key.
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
    bias_sd_deg: float
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
    varied: dict[str, float] = field(default_factory=dict)

    @property
    def place(self) -> dict[str, Any]:
        """Coordinates in the grid, varied options included."""
        return {name: getattr(self, name) for name in COORDINATES} | self.varied

    @property
    def row(self) -> dict[str, Any]:
        """Coordinates, varied options included, then counts and figures: a row of a table."""
        figures = {one.name: getattr(self, one.name) for one in fields(self)}
        del figures["varied"]
        return self.place | figures


COORDINATES = tuple(
    takewhile(lambda name: name != "runs", (one.name for one in fields(SuccessCell)))
)
"""Columns that define the cells of a grid, beside those of varied options."""


def success_cells(runs: pd.DataFrame) -> tuple[SuccessCell, ...]:
    """Score every cell of a grid, in the order in which the cells first occur.

    Parameters
    ----------
    runs : pandas.DataFrame
        The coordinates, ``route``, ``switched``, ``success``, ``switch_distance_m`` and the errors
        of each run, as a sweep's table holds them.
    """
    keys = varied_keys(runs)
    grouped = runs.groupby([*COORDINATES, *keys], sort=False, dropna=False)
    return tuple(_cell(place, keys, rows) for place, rows in grouped)


def _cell(place: tuple[Any, ...], keys: Sequence[str], rows: pd.DataFrame) -> SuccessCell:
    by_route = rows.groupby("route")["success"].agg(["sum", "count"])
    good, total = int(by_route["sum"].sum()), len(rows)
    right = rows[rows["success"]]
    low, high = wilson_interval(good, total)
    routes_low, routes_high = wilson_interval_of_routes(by_route["sum"], by_route["count"])
    count = len(COORDINATES)
    at: dict[str, Any] = dict(zip(COORDINATES, place[:count], strict=True))
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
        varied=dict(zip(keys, map(float, place[count:]), strict=True)),
    )


def axes_of(cells: Sequence[SuccessCell], *, by_reading: bool = False) -> list[str]:
    """Return the coordinates in which cells differ; a varied option stands for its own column.

    Parameters
    ----------
    by_reading : bool
        Where readings differ, leave out what all cells of each reading have in common.
    """
    places = [cell.place for cell in cells]
    names = list(places[0]) if places else []
    own = {name.partition(".")[2] for name in names if "." in name} - {HEADING}
    axes = [
        name
        for name in names
        if name not in own and len({repr(place[name]) for place in places}) > 1
    ]
    if not (by_reading and "reading" in axes):
        return axes
    readings = {cell.reading for cell in cells}
    return [
        name
        for name in axes
        if name in ("reading", HEADING)
        or len({(place["reading"], repr(place[name])) for place in places}) > len(readings)
    ]


def varied_keys(runs: pd.DataFrame) -> list[str]:
    """Return the columns of varied options: those that are named by a dotted key."""
    return [name for name in runs.columns if "." in name]
