"""Errors of predicted levels that last along the path, summed out for each hypothesis.

A level received is the predicted one plus four errors: *slow* and *fast* ones of the cell's
prediction, Gauss-Markov processes along the path (Gudmundson 1991), one of the *device* that all
cells share, and white noise. Slow and fast errors of cells of one site, and of all cells, are
correlated. Given a hypothesis's path these errors are Gaussian, so a Kalman filter estimates them
and the likelihood of a level is that of its innovation: a Rao-Blackwellised particle filter (Doucet
et al. 2000). Its covariance does not depend on the levels and is shared by all hypotheses, see
:class:`LevelMemory`; the means and the probability of each cell's fault are those of a hypothesis.

A *fault* of a cell (switched off, moved, rotated, or something else that the prediction does not
know) is a state that lasts for hundreds of metres: its levels then say nothing of the position. The
likelihood of a level is the mixture over both, and the log odds of the fault are kept for each
hypothesis and cell.

A cell that the prediction expects, and that is absent from a report although weaker ones are in it,
is evidence, too: its level is below that of the weakest one reported.

Where the prediction changes much from pixel to pixel, a hypothesis a few metres beside the true
position expects another level; the local standard deviation of the prediction is added to that of
the innovation.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import exp, log
from typing import NamedTuple

import numpy as np
from numba import njit
from scipy.ndimage import uniform_filter

from mapfilter._kernels import exp32, log32
from mapfilter._types import Bytes, Floats, Floats32, Ints, Ints32
from mapfilter.errors import Faults
from mapfilter.options import NotNegative, Options, Positive, Probability, Share

SLOTS = 24
"""Most cells whose errors are estimated at a time."""

_F = np.float32
_ROUGHNESS_M = 35.0
_LOG_ODDS, _MOST_LOG_ODDS = 20.0, 8.0
_ABSENT_BY_FAULT = log(0.7)
_OTHER_DBM, _OTHER_SD_DB, _OTHER_M = -90.0, 15.0, 150.0
_NEGLIGIBLE = 1e-3
_STEPS_PER_SD, _REACH_SD = 32, 8


@dataclass(frozen=True, slots=True)
class LevelErrors(Options):
    """How levels differ from their prediction.

    Parameters
    ----------
    slow_db, slow_m : float
        Standard deviation of the slow error, and the distance after which its correlation is 1/e.
    fast_db, fast_m : float
        The same of the fast error.
    white_db : float
        Standard deviation of the independent error of each level.
    device_db : float
        Standard deviation of the device's error, equal for all cells.
    site_share, common_share : float
        Correlation of the errors of cells of one site beyond that of all cells, and of all cells.
    roughness : float
        Share of the local variance of the prediction that is added.
    fault_probability : float
        Share of cells that the prediction is wrong about.
    fault_m : float
        Distance after which a fault may have ended or begun.
    absent_db : float
        Further standard deviation of the level of a cell that is absent from a report.
    weight : float
        Exponent of the likelihood; below 1, as real errors come in bursts.
    """

    slow_db: NotNegative = 7.0
    slow_m: Positive = 200.0
    fast_db: NotNegative = 4.0
    fast_m: Positive = 20.0
    white_db: Positive = 3.3
    device_db: NotNegative = 5.0
    site_share: Share = 0.6
    common_share: Share = 0.2
    roughness: NotNegative = 1.0
    fault_probability: Probability = 0.06
    fault_m: Positive = 300.0
    absent_db: NotNegative = 3.0
    weight: Share = 0.35

    def check(self, faults: Faults) -> None:
        """Add shares that leave no error of a cell's own."""
        if self.site_share + self.common_share >= 1:
            where = "LevelErrors, site_share and common_share"
            found = f"{self.site_share} and {self.common_share}"
            faults.add(where, "site_share + common_share < 1", found)

    @property
    def total_db(self) -> float:
        """Standard deviation of a first level without the device's error."""
        return float(np.hypot(np.hypot(self.slow_db, self.fast_db), self.white_db))

    @property
    def fault_log_odds(self) -> float:
        """Log odds of a fault before anything is known."""
        return log(self.fault_probability / (1 - self.fault_probability))


class LevelReport(NamedTuple):
    """The levels of one report.

    Parameters
    ----------
    cell : ndarray of int32, shape (K,)
        Bands of the cells, each once.
    level_dbm : ndarray of float32, shape (K,)
        Their levels.
    absent : ndarray of int32, shape (J,)
        Bands of cells that would be in the report if they were stronger than ``limit_dbm``.
    limit_dbm : float
        Weakest level that is reported.
    offset_db : float
        Standard deviation that is added as hypotheses lie beside the true position.
    """

    cell: Ints32
    level_dbm: Floats32
    absent: Ints32
    limit_dbm: float
    offset_db: float


class LevelTerms(NamedTuple):
    """One report prepared for :func:`weigh_by_levels` and :func:`weigh_by_absence`.

    ``gain`` (K, 2S + 1) and ``variance_db2`` (K,) are those of sequential Kalman updates;
    ``other`` (K,) the log-likelihoods of the levels if the prediction is wrong.
    """

    cell: Ints32
    slot: Ints32
    level_dbm: Floats32
    gain: Floats32
    variance_db2: Floats32
    other: Floats32


@dataclass(frozen=True, eq=False)
class LevelMemory:
    """What all hypotheses of a belief share of the errors of levels.

    A slot is for one cell. The errors are ordered: slow ones of all slots, fast ones of all slots,
    the device's.

    Parameters
    ----------
    errors : LevelErrors
        How large they are.
    site : ndarray of int, shape (C,)
        Number of each band's site.
    band : ndarray of int32, shape (S,)
        Band of each slot; -1 for none yet.
    prior_db2, covariance_db2 : ndarray, shape (2S + 1, 2S + 1)
        Covariance of the errors before any level, and given the levels so far.
    other_dbm, other_db2 : ndarray, shape (S,)
        Mean and variance of the next level of a cell that the prediction is wrong about.
    used : ndarray of int, shape (S,)
        Number of the report that last used a slot.
    reports : int
        Reports so far.
    other_log_likelihood : float
        Of the last report, if the prediction is wrong about all of its cells.
    """

    errors: LevelErrors
    site: Ints
    band: Ints32
    prior_db2: Floats
    covariance_db2: Floats
    other_dbm: Floats
    other_db2: Floats
    used: Ints
    reports: int = 0
    other_log_likelihood: float = 0.0

    @classmethod
    def empty(cls, errors: LevelErrors, site: Ints) -> LevelMemory:
        """Return the memory before the first report, with as many slots as cells up to a limit."""
        slots = min(site.size, SLOTS)
        covariance = np.zeros((2 * slots + 1, 2 * slots + 1))
        covariance[-1, -1] = errors.device_db**2
        return cls(
            errors,
            site,
            np.full(slots, -1, dtype=np.int32),
            covariance,
            covariance,
            np.full(slots, _OTHER_DBM),
            np.full(slots, _OTHER_SD_DB**2),
            np.full(slots, -1),
        )

    @property
    def slots(self) -> int:
        """Number of slots."""
        return self.band.size

    @property
    def width(self) -> int:
        """Numbers that each hypothesis keeps: means of errors, then log odds of faults."""
        return 3 * self.slots + 1

    @property
    def slot_of(self) -> dict[int, int]:
        """Slot of each band that has one."""
        return {band: slot for slot, band in enumerate(self.band.tolist()) if band >= 0}

    def start(self, count: int) -> Floats32:
        """Return what hypotheses keep before the first report, shape (count, width)."""
        kept = np.zeros((count, self.width), dtype=np.float32)
        kept[:, 2 * self.slots + 1 :] = self.errors.fault_log_odds
        return kept

    def correlation(self, one: Ints32, other: Ints32) -> Floats:
        """Return the correlation of the errors of two lists of bands before any level."""
        own = 1 - self.errors.site_share - self.errors.common_share
        same_site = self.site[one][:, None] == self.site[other][None, :]
        same = one[:, None] == other[None, :]
        found = self.errors.common_share + self.errors.site_share * same_site + own * same
        return np.asarray(found, dtype=np.float64)

    def with_cells(self, bands: Ints32, kept: Floats32) -> tuple[LevelMemory, Floats32]:
        """Give cells slots; those unused for longest lose theirs.

        The errors of new cells are expected from those of the others, by their correlation. Returns
        the memory and what the hypotheses keep, (N, width).
        """
        slot_of = self.slot_of
        wanted = [band for band in bands.tolist() if band not in slot_of]
        held = [slot_of[band] for band in bands.tolist() if band in slot_of]
        if not wanted:
            return self, kept
        order = [slot for slot in np.lexsort((self.band >= 0, self.used)) if slot not in held]
        at = np.array(order[: len(wanted)], dtype=np.intp)
        band = self.band.copy()
        band[at] = wanted[: at.size]
        rest = np.array([s for s in np.flatnonzero(self.band >= 0) if s not in at], dtype=np.intp)
        slots = self.slots
        # Slow and fast errors have the same correlations, so one regression serves both.
        by: Floats = np.zeros((at.size, rest.size))
        if rest.size:
            known = self.correlation(band[rest], band[rest])
            by = np.asarray(np.linalg.solve(known, self.correlation(band[rest], band[at])).T)
        left = self.correlation(band[at], band[at])
        if rest.size:
            left = left - by @ self.correlation(band[rest], band[at])
        turn, noise = np.eye(2 * slots + 1), np.zeros((2 * slots + 1, 2 * slots + 1))
        for part, sd_db in ((0, self.errors.slow_db), (slots, self.errors.fast_db)):
            turn[part + at] = 0.0
            turn[np.ix_(part + at, part + rest)] = by
            noise[np.ix_(part + at, part + at)] = sd_db**2 * left
        prior = np.zeros_like(self.prior_db2)
        held_now = np.flatnonzero(band >= 0)
        correlation = self.correlation(band[held_now], band[held_now])
        prior[np.ix_(held_now, held_now)] = self.errors.slow_db**2 * correlation
        prior[np.ix_(slots + held_now, slots + held_now)] = self.errors.fast_db**2 * correlation
        prior[-1, -1] = self.errors.device_db**2
        kept = kept.copy()
        for part in (0, slots):
            kept[:, part + at] = kept[:, part + rest] @ by.T.astype(np.float32)
        kept[:, 2 * slots + 1 + at] = self.errors.fault_log_odds
        other_dbm, other_db2, used = self.other_dbm.copy(), self.other_db2.copy(), self.used.copy()
        other_dbm[at], other_db2[at], used[at] = _OTHER_DBM, _OTHER_SD_DB**2, self.reports
        return replace(
            self,
            band=band,
            prior_db2=prior,
            covariance_db2=turn @ self.covariance_db2 @ turn.T + noise,
            other_dbm=other_dbm,
            other_db2=other_db2,
            used=used,
        ), kept

    def after(self, length_m: float) -> tuple[LevelMemory, Floats32]:
        """Return the memory after a distance, and the factor of each mean, shape (2S + 1,)."""
        errors, slots = self.errors, self.slots
        decay = np.ones(2 * slots + 1)
        decay[:slots], decay[slots:-1] = (
            exp(-length_m / errors.slow_m),
            exp(-length_m / errors.fast_m),
        )
        both = np.outer(decay, decay)
        keep = exp(-length_m / _OTHER_M)
        return replace(
            self,
            covariance_db2=self.covariance_db2 * both + self.prior_db2 * (1 - both),
            other_dbm=_OTHER_DBM + (self.other_dbm - _OTHER_DBM) * keep,
            other_db2=_OTHER_SD_DB**2 + (self.other_db2 - _OTHER_SD_DB**2) * keep**2,
        ), decay.astype(np.float32)

    def updated(
        self, report: LevelReport, rough_db2: Floats | None = None
    ) -> tuple[LevelMemory, LevelTerms]:
        """Return the memory after the levels of a report whose cells have slots, and its terms.

        Where the prediction is wrong about a cell, its level is what it was before, with the same
        fast and white errors as else, and with ``rough_db2`` (K,), what the roughness of the
        prediction adds to the variance on average.
        """
        slot_of, slots = self.slot_of, self.slots
        slot = np.array([slot_of[band] for band in report.cell.tolist()], dtype=np.int32)
        covariance = self.covariance_db2.copy()
        white_db2 = self.errors.white_db**2 + report.offset_db**2
        gain = np.zeros((slot.size, 2 * slots + 1))
        variance, other = np.zeros(slot.size), np.zeros(slot.size)
        rough_db2 = np.zeros(slot.size) if rough_db2 is None else rough_db2
        other_white_db2 = white_db2 + 0.5 * self.errors.fast_db**2 + rough_db2
        other_dbm, other_db2, used = self.other_dbm.copy(), self.other_db2.copy(), self.used.copy()
        for k, (s, level_dbm) in enumerate(zip(slot, report.level_dbm, strict=True)):
            column = covariance[:, s] + covariance[:, slots + s] + covariance[:, -1]
            variance[k] = column[s] + column[slots + s] + column[-1] + white_db2
            gain[k] = column / variance[k]
            covariance -= np.outer(gain[k], column)
            off_dbm, off_db2 = level_dbm - other_dbm[s], other_db2[s] + other_white_db2[k]
            other[k] = -0.5 * off_dbm**2 / off_db2 - 0.5 * log(off_db2)
            other_dbm[s] += other_db2[s] / off_db2 * off_dbm
            other_db2[s] *= 1 - other_db2[s] / off_db2
        gain[np.abs(gain) < _NEGLIGIBLE / 10] = 0.0
        used[slot] = self.reports
        memory = replace(
            self,
            covariance_db2=covariance,
            other_dbm=other_dbm,
            other_db2=other_db2,
            used=used,
            reports=self.reports + 1,
        )
        terms = LevelTerms(
            report.cell,
            slot,
            report.level_dbm,
            gain.astype(np.float32),
            variance.astype(np.float32),
            other.astype(np.float32),
        )
        return memory, terms

    def absence(self, report: LevelReport) -> LevelTerms:
        """Return the terms of absent cells that have slots; levels are the limit."""
        slot_of, slots = self.slot_of, self.slots
        held = [(band, slot_of[band]) for band in report.absent.tolist() if band in slot_of]
        cell, slot = np.array(held, dtype=np.int32).reshape(-1, 2).T.copy()
        covariance = self.covariance_db2
        column = covariance[:, slot] + covariance[:, slots + slot] + covariance[:, -1:]
        at = np.arange(slot.size)
        variance = column[slot, at] + column[slots + slot, at] + column[-1, at]
        variance += self.errors.white_db**2 + report.offset_db**2 + self.errors.absent_db**2
        gain = (column / variance).T
        gain[np.abs(gain) < _NEGLIGIBLE] = 0.0
        return LevelTerms(
            cell,
            slot,
            np.full(cell.size, report.limit_dbm, dtype=np.float32),
            np.ascontiguousarray(gain, dtype=np.float32),
            variance.astype(np.float32),
            np.full(cell.size, _ABSENT_BY_FAULT, dtype=np.float32),
        )


def roughness(level_dbm: Floats32, resolution_m: float) -> Floats32:
    """Return the local standard deviation of predicted levels, (rows, cols, C), in dB.

    It is that of a square of 45 to 50 m at pixels of 5 to 10 m, and of 3 x 3 pixels at least.
    """
    size = max(2 * round(_ROUGHNESS_M / resolution_m / 2) + 1, 3)
    found = np.empty(level_dbm.shape, dtype=np.float32)
    for band in range(level_dbm.shape[2]):
        level = level_dbm[..., band].astype(np.float64)
        mean = uniform_filter(level, size)
        found[..., band] = np.sqrt(np.maximum(uniform_filter(level**2, size) - mean**2, 0.0))
    return found


@njit(error_model="numpy", fastmath={"contract"}, cache=True)
def decayed(kept: Floats32, decay: Floats32, fault_keep: float, fault_log_odds: float) -> Floats32:
    """Return what hypotheses keep, (N, width), after a distance."""
    now = np.empty_like(kept)
    means, width = decay.size, kept.shape[1]
    keep, usual = _F(fault_keep), _F(fault_log_odds)
    for i in range(kept.shape[0]):
        for d in range(means):
            now[i, d] = kept[i, d] * decay[d]
        for d in range(means, width):
            now[i, d] = usual + (kept[i, d] - usual) * keep
    return now


@njit(error_model="numpy", fastmath={"contract"}, cache=True)
def weigh_by_levels(
    kept: Floats32,
    pixel: Ints32,
    level_dbm: Floats32,
    rough_db: Bytes,
    bands: int,
    terms: LevelTerms,
    roughness_share: float,
    weight: float,
    log_weight: Floats,
) -> None:
    """Add the log-likelihood of levels to weights and update what hypotheses keep, in place.

    ``level_dbm`` and ``rough_db`` (tenths of a dB) are flat over pixels and bands.
    """
    means = terms.gain.shape[1]
    slots = (means - 1) // 2
    cell, slot, gain = terms.cell, terms.slot, terms.gain
    share, half, one, zero = _F(0.01 * roughness_share), _F(0.5), _F(1.0), _F(0.0)
    most, cap = _F(_LOG_ODDS), _F(_MOST_LOG_ODDS)
    width = np.int64(bands)
    for i in range(pixel.size):
        at = np.int64(pixel[i]) * width
        total = zero
        for k in range(cell.size):
            s = slot[k]
            error = kept[i, s] + kept[i, slots + s] + kept[i, means - 1]
            v = terms.level_dbm[k] - level_dbm[at + cell[k]] - error
            rough = _F(rough_db[at + cell[k]])
            own = terms.variance_db2[k]
            variance = own + share * rough * rough
            right = -half * (v * v / variance + log32(variance))
            before = kept[i, means + s]
            whole = before + terms.other[k] - right
            odds = whole if whole < most else most
            odds = odds if odds > -most else -most
            fine = one / (one + exp32(odds))
            # Beyond the bound the logarithm of one plus the odds is that of the odds.
            beyond = whole - odds if whole > odds else zero
            total += right + beyond - log32(fine * (one + exp32(before)))
            after = odds if odds < cap else cap
            kept[i, means + s] = after if after > -cap else -cap
            step = fine * v * own / variance
            for d in range(means):
                kept[i, d] += gain[k, d] * step
        log_weight[i] += weight * total


@njit(error_model="numpy", fastmath={"contract"}, cache=True)
def weigh_by_absence(
    kept: Floats32,
    pixel: Ints32,
    level_dbm: Floats32,
    rough_db: Bytes,
    bands: int,
    terms: LevelTerms,
    table: Floats32,
    roughness_share: float,
    weight: float,
    log_weight: Floats,
) -> None:
    """Add the log-likelihood that cells are below a level, and update as above, in place.

    ``table`` is that of :func:`mapfilter.models.fingerprint.bound_table`. Means move to those of
    the truncated normal distribution.
    """
    means = terms.gain.shape[1]
    slots = (means - 1) // 2
    cell, slot, gain = terms.cell, terms.slot, terms.gain
    share, half, one, zero = _F(0.01 * roughness_share), _F(0.5), _F(1.0), _F(0.0)
    most, cap = _F(_LOG_ODDS), _F(_MOST_LOG_ODDS)
    middle, last = _F(_REACH_SD * _STEPS_PER_SD), _F(2 * _REACH_SD * _STEPS_PER_SD)
    width = np.int64(bands)
    for i in range(pixel.size):
        at = np.int64(pixel[i]) * width
        total = zero
        for k in range(cell.size):
            s = slot[k]
            error = kept[i, s] + kept[i, slots + s] + kept[i, means - 1]
            rough = _F(rough_db[at + cell[k]])
            own = terms.variance_db2[k]
            sd = np.sqrt(own + share * rough * rough)
            z = (terms.level_dbm[k] - level_dbm[at + cell[k]] - error) / sd
            place = z * _F(_STEPS_PER_SD) + middle + half
            place = place if place > zero else zero
            place = place if place < last else last
            right = table[np.int32(place)]
            before = kept[i, means + s]
            whole = before + terms.other[k] - right
            odds = whole if whole < most else most
            odds = odds if odds > -most else -most
            fine = one / (one + exp32(odds))
            # Beyond the bound the logarithm of one plus the odds is that of the odds.
            beyond = whole - odds if whole > odds else zero
            total += right + beyond - log32(fine * (one + exp32(before)))
            after = odds if odds < cap else cap
            kept[i, means + s] = after if after > -cap else -cap
            if z < _F(6.0):
                z = z if z > _F(-8.0) else _F(-8.0)
                hazard = exp32(-half * z * z - _F(0.9189385) - right)
                step = -fine * hazard * own / sd
                for d in range(means):
                    kept[i, d] += gain[k, d] * step
        log_weight[i] += weight * total
