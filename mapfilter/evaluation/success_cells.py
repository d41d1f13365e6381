"""Success and coverage over a grid: the runs of each cell, with their intervals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from itertools import takewhile
from math import nan
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
    claimed : float
        Share of all epochs at which a position was claimed: CONVERGED or TRACKING.
    coverage_95, coverage_95_low, coverage_95_high : float
        Share of the claimed epochs of all runs, wrong ones included, whose 95 % radius held the
        true position, and its 95 % interval for *these* routes; NaN of filters without radii. Runs
        are drawn, not epochs, as those of a run are alike: a single one has no interval (NaN).
    coverage_95_routes_low, coverage_95_routes_high : float
        The interval for all routes of the area; NaN for a single one.
    radius_95_median_m : float
        Median over the runs that claimed a position of each run's median 95 % radius; NaN without
        any.
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
    claimed: float
    coverage_95: float
    coverage_95_low: float
    coverage_95_high: float
    coverage_95_routes_low: float
    coverage_95_routes_high: float
    radius_95_median_m: float
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
        The coordinates, ``route``, ``switched``, ``success``, ``switch_distance_m``, the errors
        and the claimed radii of each run, as a sweep's table holds them.
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
        **_radii(rows),
        varied=dict(zip(keys, map(float, place[count:]), strict=True)),
    )


def _radii(rows: pd.DataFrame) -> dict[str, Any]:
    """Return what the runs of a cell claimed, and how well their radii held it."""
    epochs, claimed = int(rows["epochs"].sum()), int(rows["claimed_epochs"].sum())
    figures: dict[str, Any] = {
        "claimed": claimed / epochs if epochs else nan,
        "radius_95_median_m": float(rows["radius_95_median_m"].median()),
    }
    known = rows[rows["held_95_epochs"].notna()]
    of = known["claimed_epochs"].sum()
    figures["coverage_95"] = float(known["held_95_epochs"].sum() / of) if of else nan
    by_route = known.groupby("route")[["held_95_epochs", "claimed_epochs"]].sum()
    for name, clusters in (("coverage_95", known), ("coverage_95_routes", by_route)):
        held, whole = clusters["held_95_epochs"], clusters["claimed_epochs"]
        ends = wilson_interval_of_routes(held, whole)
        figures |= dict(zip((f"{name}_low", f"{name}_high"), ends, strict=True))
    return figures


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
