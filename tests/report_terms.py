"""Terms of a radio report by itself at any place, in plain arithmetic.

The page of replays computes the same in the browser, and the filter over all of its hypotheses.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import exp, log
from typing import Any

import numpy as np
from scipy.special import log_ndtr

from mapfilter._types import Floats

_MOST_KEPT = 8.0


@dataclass(frozen=True, slots=True)
class Report:
    """A report: bands and levels.

    Parameters
    ----------
    serving : int
        Band of the serving cell; -1 for none.
    cells : sequence of int
        Bands whose levels are reported, in the report's order.
    level_dbm : sequence of float
        Their levels.
    """

    serving: int
    cells: Sequence[int]
    level_dbm: Sequence[float]


@dataclass(frozen=True, slots=True)
class Place:
    """What the map has at a place.

    Parameters
    ----------
    level_dbm, rough_db : (C,) arrays
        Predicted level of each band, and its local deviation.
    best_dbm, second_dbm : (C,) arrays
        Strongest and second strongest level of the cells of each band's layer.
    distance_m : float
        To the edge of the nearest way.
    """

    level_dbm: Floats
    rough_db: Floats
    best_dbm: Floats
    second_dbm: Floats
    distance_m: float


def report_terms(
    report: Report, place: Place, why: dict[str, Any], site: Sequence[int]
) -> list[tuple[str, int, float]]:
    """Return kind, band and nats of each term of a report at a place, streets first.

    Parameters
    ----------
    why : dict
        What :func:`mapfilter.viewing.page_constants.constants` returns.
    site : sequence of int
        Number of each band's site.
    """
    rows = [("streets", -1, _streets(place.distance_m, why))]
    odds = np.full(len(site), float(why["fault_log_odds"]))
    if report.serving >= 0:
        own, best_dbm = place.level_dbm[report.serving], place.best_dbm[report.serving]
        margin = own - (place.second_dbm[report.serving] if own >= best_dbm else best_dbm)
        weight = why["serving_weight"] * (why["serving_with_levels"] if report.cells else 1.0)
        right = weight * float(log_ndtr((margin + why["hysteresis_db"]) / why["sd_db"]))
        other, before = -weight * why["fault_nats"], float(odds[report.serving])
        rows.append(("serving", report.serving, _mixed(before, other, right)))
        odds[report.serving] = min(max(before + other - right, -_MOST_KEPT), _MOST_KEPT)
    cells = np.asarray(report.cells, dtype=np.int64)
    at_site = np.asarray(site)[cells]
    alike = why["common_share"] + why["site_share"] * (at_site[:, None] == at_site[None, :])
    own_share = 1 - why["site_share"] - why["common_share"]
    alike = alike + own_share * np.eye(cells.size)
    covariance = (why["slow_db"] ** 2 + why["fast_db"] ** 2) * alike + why["device_db"] ** 2
    white = why["white_db"] ** 2 + why["offset_db"] ** 2
    bias = np.zeros(cells.size)
    for k, cell in enumerate(cells.tolist()):
        reported = float(report.level_dbm[k])
        variance = float(covariance[k, k]) + white
        gain = covariance[:, k] / variance
        innovation = reported - float(place.level_dbm[cell]) - float(bias[k])
        wide = variance + why["roughness"] * float(place.rough_db[cell]) ** 2
        right = -0.5 * (innovation**2 / wide + log(wide))
        spread = why["other_db2"] + white + 0.5 * why["fast_db"] ** 2 + why["other_rough_db2"]
        other = -0.5 * ((reported - why["other_dbm"]) ** 2 / spread + log(spread))
        before = float(odds[cell])
        rows.append(("level", cell, why["weight"] * _mixed(before, other, right)))
        fine = 1 / (1 + exp(min(before + other - right, 700.0)))
        bias = bias + gain * fine * innovation * variance / wide
        covariance = covariance - np.outer(gain, covariance[k])
    return rows


def _mixed(odds: float, other: float, right: float) -> float:
    """Return the log-likelihood of a reading whose prediction may be wrong."""
    return float(np.logaddexp(right, odds + other) - np.logaddexp(0.0, odds))


def _streets(distance_m: float, why: dict[str, Any]) -> float:
    near = 0.97 * exp(-0.5 * (distance_m / why["map_sd_m"]) ** 2) + 0.03 * exp(-distance_m / 30)
    on = why["map_weight_per_m"] * why["map_m"] * log(near)
    return float(max(on, -why["off_cost_per_m"] * why["map_m"]))
