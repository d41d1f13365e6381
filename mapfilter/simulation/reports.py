"""Simulated measurement reports: serving cell, neighbours without identity, quantised levels."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
import pandas as pd
from annotated_types import Ge, Le

from mapfilter._types import Bools, Floats, Ints
from mapfilter.errors import ConfigError, Faults, InputError, fail
from mapfilter.options import NotNegative, Options, Positive
from mapfilter.radio.cells import CellPlan
from mapfilter.radio.rxlev import quantise_level_dbm
from mapfilter.simulation.journeys import ticks_s
from mapfilter.simulation.layer_choice import layers_by_priority, layers_served
from mapfilter.simulation.level_samplers import Levels
from mapfilter.tracks.schema import NEIGHBOUR, SERVING

_SILENT_DBM = -140.0
_MOST_LEVELS = 100_000_000
_MOST_AVERAGED = 1000


@dataclass(frozen=True, slots=True)
class ReportModel(Options):
    """Measurement reports of a simulated phone; part of ``[journeys]`` of a configuration.

    Parameters
    ----------
    report_period_s : float
        Between two reports: 0.48 s in GSM, 1 s in many logs.
    radio : {"ground_truth", "as_predicted"}
        With "as_predicted" the serving cell is the strongest of its layer at each place: no noise,
        no averaging, no hysteresis. The levels must then be the predicted ones.
    hysteresis_db : float
        Another cell takes over when its mean is more than this above the serving cell's.
    averaging_s : float
        Handover compares means, in dB, over the reports of this long; at least the last one, at
        most 1000.
    fading_db : float
        Standard deviation of the measurement noise, drawn for each cell and report.
    max_neighbours : int
        Strongest other cells that are reported; of a network's layers those of the serving one.
    layer_reserve_db : float
        In a network of several layers, a phone stays on the newest technology and the highest
        frequency while the best cell there is at least this much above the sensitivity.
    sensitivity_dbm : float
        Weaker cells are not received.
    phone_offset_sd_db : float
        All levels of a journey are off by one number that is normal with this deviation: the
        receiver's calibration, the hand, the pocket.
    quantise : bool
        Whether levels are RXLEV bin centres, censored at both ends of the scale.

    Raises
    ------
    ConfigError
        With every value that is out of range.
    """

    report_period_s: Positive = 1.0
    radio: Literal["ground_truth", "as_predicted"] = "ground_truth"
    hysteresis_db: NotNegative = 4.0
    averaging_s: NotNegative = 1.92
    fading_db: NotNegative = 1.0
    max_neighbours: Annotated[int, Ge(0), Le(32)] = 6
    sensitivity_dbm: Annotated[float, Ge(-150), Le(0)] = -104.0
    layer_reserve_db: NotNegative = 10.0
    phone_offset_sd_db: NotNegative = 0.0
    quantise: bool = True

    def check(self, faults: Faults) -> None:
        """Check that the averaging does not cover too many reports."""
        if not faults.found and self.averaging_s > _MOST_AVERAGED * self.report_period_s:
            most = f"at most {_MOST_AVERAGED} reports, {_MOST_AVERAGED * self.report_period_s:g} s"
            faults.add("ReportModel, averaging_s", most, self.averaging_s, "a wrong unit")


def reports(
    truth: pd.DataFrame,
    levels: Levels,
    plan: CellPlan,
    model: ReportModel,
    rng: np.random.Generator,
) -> pd.DataFrame:
    """Return the radio table of one journey.

    Parameters
    ----------
    truth : pandas.DataFrame
        time_s, east_m, north_m; between its rows one moves straight on.
    levels : callable
        From positions to levels, one column for each cell in the plan's order.
    plan : CellPlan
        Gives the carriers and BSICs that neighbours are reported by.
    rng : numpy.random.Generator
        The draws do not depend on ``model``.

    Returns
    -------
    radio : pandas.DataFrame
        The columns of a log's radio table; for each report the serving cell, then the neighbours
        from the strongest down, whose ``cell`` is None, all of one layer. Of cells that share
        carrier and BSIC only the strongest is received, or the serving one. An empty report has no
        rows.

    Raises
    ------
    InputError
        ``levels`` does not give one column for each cell.
    ConfigError
        There would be more than 1e8 levels.
    """
    if truth.empty:
        raise fail(InputError, "truth", "at least one row", "none")
    time, east, north = (truth[name].to_numpy() for name in ("time_s", "east_m", "north_m"))
    most = (time[-1] - time[0]) / model.report_period_s + 1
    if most * len(plan) > _MOST_LEVELS:
        expected = f"at most {_MOST_LEVELS:.0e} levels per journey"
        got = f"{most:.0f} reports of {len(plan)} cells"
        raise fail(ConfigError, "ReportModel, report_period_s", expected, got, "a wrong unit")
    tick_s = ticks_s(time, model.report_period_s)
    count = len(tick_s)
    there = np.interp(tick_s, time, east), np.interp(tick_s, time, north)
    level = np.asarray(levels(*there), dtype=np.float64)
    if level.shape != (count, len(plan)):
        expected = f"an array of shape {(count, len(plan))}"
        raise fail(InputError, "levels", expected, level.shape, "another plan's cells")
    noise_db = model.fading_db * rng.standard_normal(level.shape)
    noise_db += model.phone_offset_sd_db * rng.standard_normal()
    if model.radio == "ground_truth":
        level = level + noise_db
    received = np.where(level >= model.sensitivity_dbm, level, -np.inf)
    averaged, hysteresis_db = 1, 0.0
    if model.radio == "ground_truth":
        averaged = max(1, round(model.averaging_s / model.report_period_s))
        hysteresis_db = model.hysteresis_db
    mean = running_mean_db(np.where(np.isnan(level), _SILENT_DBM, level), averaged)
    layer, enough_dbm = layers_by_priority(plan), model.sensitivity_dbm + model.layer_reserve_db
    on = layers_served(mean, np.isfinite(received), layer, enough_dbm, hysteresis_db)
    received = np.where(layer == on[:, np.newaxis], received, -np.inf)
    if model.radio == "ground_truth":
        serving = serving_cells(mean, np.isfinite(received), hysteresis_db)
    else:
        serving = np.where(np.isfinite(received).any(axis=1), np.argmax(received, axis=1), -1)
    rank = _ranked(received, serving, plan, model.max_neighbours)
    report, place = np.nonzero(rank >= 0)
    cell = rank[report, place]
    reported, censored = level[report, cell], np.zeros(len(cell), dtype=np.int8)
    if model.quantise:
        reported, censored = quantise_level_dbm(reported)
    ids = np.array([*plan.ids, None], dtype=object)
    arfcn = pd.array([c.arfcn for c in plan.cells], dtype="Int64")
    bsic = pd.array([c.bsic for c in plan.cells], dtype="Int64")
    return pd.DataFrame(
        {
            "time_s": tick_s[report],
            "role": np.where(place == 0, SERVING, NEIGHBOUR),
            "cell": pd.Series(ids[np.where(place == 0, cell, -1)], dtype=object),
            "arfcn": arfcn[cell],
            "bsic": bsic[cell],
            "level_dbm": reported,
            "censored": censored,
            "timing_advance": pd.array([None] * len(cell), dtype="Int64"),
        }
    )


def running_mean_db(level_dbm: Floats, count: int) -> Floats:
    """Return the mean, in dB, of the last ``count`` of N reports, shape (N, cells).

    Examples
    --------
    >>> running_mean_db(np.array([[-60.0], [-70.0], [-90.0]]), 2).ravel().tolist()
    [-60.0, -65.0, -80.0]
    """
    total = level_dbm.copy()
    for back in range(1, min(count, len(total))):
        total[back:] += level_dbm[:-back]
    return np.asarray(total / np.minimum(np.arange(len(total)) + 1, count)[:, np.newaxis])


def serving_cells(mean_dbm: Floats, received: Bools, hysteresis_db: float) -> Ints:
    """Return which cell serves at each report: handover with hysteresis.

    A cell serves until the strongest received one is more than ``hysteresis_db`` above it, or until
    it is not received any more; then the strongest takes over (the first of equals). Means and
    received are of shape (N, cells); of each report, the column of the cell is returned, or -1
    when none is received.

    Examples
    --------
    >>> mean_dbm = np.array([[-70.0, -80.0], [-80.0, -77.0], [-80.0, -75.0], [-80.0, -82.0]])
    >>> serving_cells(mean_dbm, np.ones((4, 2), dtype=bool), 4.0).tolist()
    [0, 0, 1, 1]
    """
    audible = np.where(received, mean_dbm, -np.inf)
    serving = np.full(len(audible), -1, dtype=np.int64)
    if not audible.size:
        return serving
    best = np.argmax(audible, axis=1)
    now = -1
    for i, strongest in enumerate(best):
        lost = now < 0 or not received[i, now]
        if lost or audible[i, strongest] > audible[i, now] + hysteresis_db:
            now = int(strongest) if received[i, strongest] else -1
        serving[i] = now
    return serving


def _ranked(received_dbm: Floats, serving: Ints, plan: CellPlan, max_neighbours: int) -> Ints:
    """Return the cells of each report, shape (N, 1 + neighbours), -1 where there is none."""
    report = np.arange(len(serving))
    served = serving >= 0
    others = received_dbm.copy()
    # The serving cell drowns those of its own carrier and BSIC.
    others[report[served], serving[served]] = np.inf
    for ids in (ids for ids in plan.ids_by_carrier.values() if len(ids) > 1):
        group = np.array([plan.index(cell_id) for cell_id in ids])
        strongest = group[np.argmax(others[:, group], axis=1)]
        kept = others[report, strongest]
        others[:, group] = -np.inf
        others[report, strongest] = kept
    others[report[served], serving[served]] = -np.inf
    neighbours = np.argsort(-others, axis=1, kind="stable")[:, :max_neighbours]
    audible = np.isfinite(np.take_along_axis(others, neighbours, axis=1))
    neighbours = np.where(audible & served[:, np.newaxis], neighbours, -1)
    return np.column_stack([serving, neighbours])
