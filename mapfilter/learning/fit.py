"""Fit a network to visits: cells, phones and journeys in turn, until nothing changes.

Journeys that were located in a wrong place say nothing of any cell. One counts as far as its
visits are more probable with what the network is found to be than with levels that are drawn from
all that was measured of the same cells anywhere.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mapfilter._constants import MAD_TO_SD
from mapfilter._types import Floats, Ints
from mapfilter.learning.calibration import Calibration, calibrate
from mapfilter.learning.cell_evidence import Explanation, Scene
from mapfilter.learning.likelihood import LevelNoise, report_log_likelihood, visit_weights
from mapfilter.learning.network import NetworkFit, explain
from mapfilter.learning.patterns import Patterns
from mapfilter.learning.visits import Visits
from mapfilter.radio.cells import CellPlan

_ROUNDS = 4
_PHONE_SD_DB = 4.0
_SD_DB = (5.0, 14.0)
_LEAST_SPREAD_DB = 3.0
_USUAL_CELLS = 6


@dataclass(frozen=True, eq=False)
class Learned:
    """A network as journeys tell.

    Parameters
    ----------
    network : NetworkFit
    outdoor, indoor : Calibration
        Mean errors of the prediction.
    phone_db : (journeys,) array
        Offset of each journey's phone.
    trust : (journeys,) array
        Probability that a journey was located where it was, 0..1.
    sd_db : float
        Deviation of levels from the prediction, offsets and faults taken out.
    """

    network: NetworkFit
    outdoor: Calibration
    indoor: Calibration
    phone_db: Floats
    trust: Floats
    sd_db: float


def fit_network(visits: Visits, patterns: Patterns, place: Ints, journeys: int) -> Learned:
    """Fit cells, phones and journeys to visits.

    Parameters
    ----------
    patterns : Patterns
        In M places.
    place : (N,) array of int
        Row of each visit in the patterns.
    journeys : int
        Their number; those without a visit have trust 0.
    """
    phone, trust, sd_db = np.zeros(journeys), np.ones(journeys), 9.0
    cells_sd_db = LevelNoise.cells_sd_db
    trust[np.bincount(visits.journey, minlength=journeys) == 0] = 0.0
    base = visit_weights(visits)
    indoor = np.array([cell.indoor for cell in patterns.plan.cells])[visits.cell]
    distance_m = _distance_m(visits, patterns.plan)
    classes = {kind: Calibration() for kind in (False, True)}
    for number in range(_ROUNDS + 1):
        last = number == _ROUNDS
        common = np.where(indoor, *(classes[kind].at(distance_m) for kind in (True, False)))
        shift = phone[visits.journey] + common
        weight = base * trust[visits.journey]
        noise = LevelNoise(sd_db=sd_db, cells_sd_db=cells_sd_db)
        scene = Scene(visits, patterns, place, weight, shift, noise, journeys, last)
        network = explain(scene)
        if last:
            break
        cells_sd_db = _scatter_db(network.cells)
        pattern, offset = _expected(visits, network.cells)
        for kind in classes:
            own = (indoor == kind) & np.isfinite(pattern)
            excess = (visits.level_dbm - pattern - phone[visits.journey])[own]
            parts = excess, visits.received[own], visits.cell[own], distance_m[own], weight[own]
            classes[kind] = calibrate(*parts, sd_db, classes[kind])
        common = np.where(indoor, *(classes[kind].at(distance_m) for kind in (True, False)))
        expected = pattern + offset + common
        phone = _phones(visits, visits.level_dbm - expected, base, sd_db, trust)
        expected += phone[visits.journey]
        used = visits.received & np.isfinite(expected) & (trust[visits.journey] > 0.5)
        if used.any():
            left = (visits.level_dbm - expected)[used]
            sd_db = float(np.clip(MAD_TO_SD * np.median(np.abs(left - np.median(left))), *_SD_DB))
        trust = _trust(visits, expected, base, sd_db, journeys)
    return Learned(network, classes[False], classes[True], phone, trust, sd_db)


def _scatter_db(cells: tuple[Explanation, ...]) -> float:
    """Return the deviation of the offsets of cells, outliers aside, drawn towards the usual one."""
    offsets = np.array([cell.offset_db for cell in cells if np.isfinite(cell.offset_sd_db)])
    usual, few = LevelNoise.cells_sd_db, _USUAL_CELLS
    if not offsets.size:
        return usual
    robust = MAD_TO_SD * float(np.median(np.abs(offsets)))
    variance = (few * usual**2 + offsets.size * robust**2) / (few + offsets.size)
    return float(np.clip(np.sqrt(variance), 1.5, 6.0))


def _distance_m(visits: Visits, plan: CellPlan) -> Floats:
    east = np.array([cell.east_m for cell in plan.cells])[visits.cell]
    north = np.array([cell.north_m for cell in plan.cells])[visits.cell]
    return np.asarray(np.hypot(visits.east_m - east, visits.north_m - north))


def _phones(
    visits: Visits, residual_db: Floats, weight: Floats, sd_db: float, trust: Floats
) -> Floats:
    """Return the offset of each journey's phone: the median residual, shrunk to 0."""
    found, used = np.zeros(trust.size), visits.received & np.isfinite(residual_db)
    for journey in range(trust.size):
        own = used & (visits.journey == journey)
        if own.any():
            number = 2 * weight[own].sum()
            shrink = number / (number + (sd_db / _PHONE_SD_DB) ** 2)
            found[journey] = shrink * np.median(residual_db[own])
    return np.asarray(found - np.average(found, weights=trust + 1e-9))


def _expected(visits: Visits, cells: tuple[Explanation, ...]) -> tuple[Floats, Floats]:
    """Return the levels of the patterns, and the offsets of the cells, at visits."""
    pattern, offset = np.full(len(visits), np.nan), np.zeros(len(visits))
    for cell, state in enumerate(cells):
        own = visits.cell == cell
        pattern[own] = state.expected
        offset[own] = state.offset_db
    return pattern, offset


def _trust(
    visits: Visits, expected_dbm: Floats, weight: Floats, sd_db: float, journeys: int
) -> Floats:
    """Return the probability of each journey that its visits were where they are said to be."""
    gain = np.zeros(len(visits))
    for cell in np.unique(visits.cell):
        own = visits.cell == cell
        heard = visits.received[own]
        if not heard.any():
            continue
        share = float(np.clip(heard.mean(), 0.02, 0.98))
        level = visits.level_dbm[own]
        spread = max(float(np.std(level[heard])), _LEAST_SPREAD_DB)
        z = (level - float(np.mean(level[heard]))) / spread
        anywhere = np.where(
            heard,
            np.log(share) - 0.5 * z**2 - np.log(spread * np.sqrt(2 * np.pi)),
            np.log1p(-share),
        )
        z = (level - expected_dbm[own]) / sd_db
        gain[own] = np.where(
            np.isnan(z), 0.0, report_log_likelihood(np.nan_to_num(z), heard, sd_db) - anywhere
        )
    odds = np.bincount(visits.journey, gain * weight, journeys)
    with_visits = np.bincount(visits.journey, minlength=journeys) > 0
    return np.where(with_visits, 1.0 / (1.0 + np.exp(-np.clip(odds, -50, 50))), 0.0)
