"""What a phone reports: the body that carries it, fast fading, quantised and stale levels."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import pandas as pd

from mapfilter._constants import LIGHT_MPS
from mapfilter._types import Bools, Floats, Ints
from mapfilter.options import NotNegative, Options, Positive
from mapfilter.radio.cells import CellPlan
from mapfilter.simulation.worlds.handover import (
    HandoverModel,
    filtered_db,
    load_offsets_db,
    serving_cells,
)
from mapfilter.simulation.worlds.quantised import SCALES, ScaleName
from mapfilter.tracks.schema import NEIGHBOUR, SERVING

_MOVES_M = 0.02


@dataclass(frozen=True, slots=True)
class PhoneModel(Options):
    """A phone and how it is carried; defaults are those of the foreign world.

    Parameters
    ----------
    period_s : float
        Between two reports: 1 s in most logging programs, 5 s or 10 s where they save energy.
    scale : {"1dB", "2dB", "bars"}
        How levels are quantised, see :mod:`mapfilter.simulation.worlds.quantised`.
    stale_every_s : float
        Mean time between two stretches in which the last report is repeated; 0 for none.
    stale_s : float
        Mean duration of such a stretch.
    max_neighbours : int
        Strongest other cells in a report.
    sensitivity_dbm : float
        Weaker cells are not received.
    offset_sd_db : float
        All levels of a journey are off by one number of this standard deviation: absolute accuracy
        of 4 to 6 dB (3GPP TS 45.008).
    measurement_sd_db : float
        Standard deviation of each measurement of layer 1 without fading (relative accuracy of 2 to
        4 dB, the same).
    body_db : float
        Loss of a signal that comes from behind the body, against one from ahead.
    diversity : float
        Independent fades in a measurement at rest: receive antennas, bandwidth.
    carried : {"hand", "car"}
        A car takes off N(9 dB, 5 dB) for the journey (3GPP TR 38.901).

    Raises
    ------
    ConfigError
        With every value that is out of range.
    """

    period_s: Positive = 1.0
    scale: ScaleName = "1dB"
    stale_every_s: NotNegative = 0.0
    stale_s: Positive = 12.0
    max_neighbours: int = 6
    sensitivity_dbm: float = -104.0
    offset_sd_db: NotNegative = 3.0
    measurement_sd_db: NotNegative = 2.0
    body_db: NotNegative = 6.0
    diversity: Positive = 2.0
    carried: Literal["hand", "car"] = "hand"
    handover: HandoverModel = field(default_factory=HandoverModel)


_CAR_DB, _CAR_SD_DB = 9.0, 5.0


def report_table(
    truth: pd.DataFrame,
    levels_dbm: Floats,
    loss_db: Floats,
    plan: CellPlan,
    model: PhoneModel,
    rng: np.random.Generator,
) -> pd.DataFrame:
    """Return the radio table of one journey.

    Parameters
    ----------
    truth : pandas.DataFrame
        time_s, east_m, north_m.
    levels_dbm : (rows of truth, cells) array
        Local means, -inf where a cell is not on air.
    loss_db : (rows of truth,) array
        Of walls about the phone.
    plan : CellPlan
        Carriers and BSICs of the cells.

    Returns
    -------
    pandas.DataFrame
        Columns of a log's radio table; the serving cell first, then neighbours from the strongest
        down, without identity. Of cells that share carrier and BSIC only the strongest is reported.
    """
    time_s = truth["time_s"].to_numpy()
    tick = model.handover.tick_s
    count = int(np.floor((time_s[-1] - time_s[0]) / tick + 1e-9)) + 1
    tick_s = time_s[0] + np.arange(count) * tick
    east, north = (np.interp(tick_s, time_s, truth[name]) for name in ("east_m", "north_m"))
    on_air = np.isfinite(levels_dbm).all(axis=0)
    local = np.full((count, len(plan)), -np.inf)
    for column in np.flatnonzero(on_air):
        local[:, column] = np.interp(tick_s, time_s, levels_dbm[:, column] - loss_db)
    offset_db = model.offset_sd_db * rng.standard_normal()
    if model.carried == "car":
        offset_db -= max(0.0, _CAR_DB + _CAR_SD_DB * rng.standard_normal())
    else:
        local -= body_loss_db(east, north, plan, model.body_db)
    frequency_mhz = np.array([cell.frequency_mhz for cell in plan.cells])
    fading_db = fast_fading_db(east, north, frequency_mhz, model.diversity, rng)
    noise_db = model.measurement_sd_db * rng.standard_normal(local.shape)
    measured = local + offset_db + fading_db + noise_db
    measured[measured < model.sensitivity_dbm] = -np.inf
    filtered = filtered_db(measured, model.handover.filter_k)
    received = np.isfinite(filtered)
    load_db = load_offsets_db(len(plan), model.handover, rng)
    serving = serving_cells(filtered, received, load_db, model.handover, rng)
    at, source = report_ticks(tick_s, model, rng)
    return _table(tick_s[at], filtered[source], serving[source], plan, model)


def body_loss_db(east_m: Floats, north_m: Floats, plan: CellPlan, body_db: float) -> Floats:
    """Return the loss by the body, shape (ticks, cells): none ahead, ``body_db`` behind.

    The phone is held in front; at rest the body stays as it was turned.
    """
    heading = headings_rad(east_m, north_m)
    cell_east = np.array([cell.east_m for cell in plan.cells])
    cell_north = np.array([cell.north_m for cell in plan.cells])
    bearing = np.arctan2(cell_north - north_m[:, None], cell_east - east_m[:, None])
    return np.asarray(0.5 * body_db * (1.0 - np.cos(bearing - heading[:, None])))


def headings_rad(east_m: Floats, north_m: Floats) -> Floats:
    """Return the heading into each tick; at rest the last one, at the start the first one."""
    right, up = np.diff(east_m), np.diff(north_m)
    moving = np.hypot(right, up) > 1e-6
    if not moving.any():
        return np.zeros(east_m.shape)
    heading = np.arctan2(up, right)
    last = np.maximum.accumulate(np.where(moving, np.arange(moving.size), -1))
    last = np.where(last < 0, int(np.argmax(moving)), last)
    return np.concatenate([heading[last[:1]], heading[last]])


def fast_fading_db(
    east_m: Floats,
    north_m: Floats,
    frequency_mhz: Floats,
    diversity: float,
    rng: np.random.Generator,
) -> Floats:
    """Draw what is left of Rayleigh fading in each measurement, shape (ticks, cells).

    The power is gamma-distributed with as many degrees as there are independent fades: those of the
    receiver, and one for each half wavelength that is travelled during the measurement (Jakes 1974,
    section 1.3). At rest a fade lasts. In dB, the mean is taken out.
    """
    moved = np.hypot(np.diff(east_m, prepend=east_m[0]), np.diff(north_m, prepend=north_m[0]))
    half_wave_m = 0.5 * LIGHT_MPS / (frequency_mhz * 1e6)
    degrees = diversity + moved[:, None] / half_wave_m
    power = np.maximum(rng.gamma(degrees) / degrees, 1e-6)
    fade = 10 * np.log10(power) + 10 / np.log(10) / (2 * degrees)
    moving = moved > _MOVES_M
    moving[0] = True
    tick = np.arange(moved.size)
    # The first tick at rest draws the fade that lasts.
    draws = moving | np.concatenate([[True], moving[:-1]])
    return np.asarray(fade[np.maximum.accumulate(np.where(draws, tick, 0))])


def report_ticks(tick_s: Floats, model: PhoneModel, rng: np.random.Generator) -> tuple[Ints, Ints]:
    """Return the ticks of the reports, and those whose measurement each of them repeats."""
    step = max(1, round(model.period_s / model.handover.tick_s))
    at = np.arange(0, tick_s.size, step)
    source = at.copy()
    if model.stale_every_s > 0:
        duration_s = float(tick_s[-1] - tick_s[0])
        number = int(rng.poisson(duration_s / model.stale_every_s))
        begins_s = tick_s[0] + np.sort(rng.uniform(0.0, duration_s, number))
        lasts_s = rng.exponential(model.stale_s, number)
        for begin_s, last_s in zip(begins_s, lasts_s, strict=True):
            inside = (tick_s[at] > begin_s) & (tick_s[at] <= begin_s + last_s)
            before = np.flatnonzero(tick_s[at] <= begin_s)
            source[inside] = source[before[-1]]
    return at, source


def _table(
    report_s: Floats, level_dbm: Floats, serving: Ints, plan: CellPlan, model: PhoneModel
) -> pd.DataFrame:
    rank = _ranked(level_dbm, serving, plan, model.max_neighbours)
    report, place = np.nonzero(rank >= 0)
    cell = rank[report, place]
    reported, censored = SCALES[model.scale](level_dbm[report, cell])
    ids = np.array([*plan.ids, None], dtype=object)
    return pd.DataFrame(
        {
            "time_s": report_s[report],
            "role": np.where(place == 0, SERVING, NEIGHBOUR),
            "cell": pd.Series(ids[np.where(place == 0, cell, -1)], dtype=object),
            "arfcn": pd.array([c.arfcn for c in plan.cells], dtype="Int64")[cell],
            "bsic": pd.array([c.bsic for c in plan.cells], dtype="Int64")[cell],
            "level_dbm": reported,
            "censored": censored,
            "timing_advance": pd.array([None] * len(cell), dtype="Int64"),
        }
    )


def _ranked(level_dbm: Floats, serving: Ints, plan: CellPlan, neighbours: int) -> Ints:
    """Return the cells of each report, shape (reports, 1 + neighbours), -1 where there is none."""
    reports = np.arange(len(serving))
    served = serving >= 0
    first = level_dbm.copy()
    first[reports[served], serving[served]] = np.inf
    for ids in plan.ids_by_carrier.values():
        group = np.array([plan.index(name) for name in ids])
        if group.size > 1:
            weaker = first[:, group] < first[:, group].max(axis=1, keepdims=True)
            first[:, group] = np.where(weaker, -np.inf, first[:, group])
    first[reports[served], serving[served]] = -np.inf
    order = np.argsort(-first, axis=1, kind="stable")[:, :neighbours]
    audible: Bools = np.isfinite(np.take_along_axis(first, order, axis=1)) & served[:, None]
    return np.column_stack([serving, np.where(audible, order, -1)])
