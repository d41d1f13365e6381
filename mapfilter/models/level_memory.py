"""What a belief knows of the errors of predicted levels, after the reports so far.

A Kalman filter over the errors of :mod:`mapfilter.models.level_errors`. Its covariance is shared by
all hypotheses of a belief; the means and the odds of faults are theirs.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import exp, log
from typing import Any

import numpy as np

from mapfilter._changes import changed
from mapfilter._device import arrays_of
from mapfilter._types import Floats, Floats32, Ints, Ints32
from mapfilter.models.level_covariance import absence_gains, aged, sequential_updates
from mapfilter.models.level_errors import LevelErrors, LevelReport
from mapfilter.models.level_kernels import LevelTerms
from mapfilter.models.record_tiles import kept_in, new_records

SLOTS = 24
"""Most cells whose errors are estimated at a time."""

_ABSENT_BY_FAULT = log(0.7)
OTHER_DBM, OTHER_SD_DB = -90.0, 15.0
"""Mean and standard deviation of the level of a cell that the prediction is wrong about."""

_OTHER_M = 150.0
_NEGLIGIBLE = 1e-3
_ALL = slice(None)


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
            np.full(slots, OTHER_DBM),
            np.full(slots, OTHER_SD_DB**2),
            np.full(slots, -1),
        )

    @property
    def slots(self) -> int:
        """Number of slots."""
        return self.band.size

    @property
    def width(self) -> int:
        """Numbers that each hypothesis keeps: means of errors, then log odds of faults.

        The last number is the log odds that no prediction holds, for hypotheses beyond the area.
        """
        return 3 * self.slots + 2

    @cached_property
    def slot_of(self) -> dict[int, int]:
        """Slot of each band that has one."""
        return {band: slot for slot, band in enumerate(self.band.tolist()) if band >= 0}

    def __getstate__(self) -> dict[str, object]:
        return {name: self.__dict__[name] for name in self.__dataclass_fields__}

    def start(self, count: int, arrays: Any = None) -> Floats32:
        """Return what hypotheses keep before the first report, (width, count).

        These are records (:mod:`mapfilter.models.record_tiles`), or rows of a device's ``arrays``.
        """
        if arrays is None:
            records = new_records(count, self.width)
            records[:] = 0.0
            kept = kept_in(records, self.width)
        else:
            kept = arrays.zeros((self.width, count), dtype=np.float32)
        kept[2 * self.slots + 1 :] = self.errors.fault_log_odds
        return kept

    def fault_row(self, band: int) -> int:
        """Return the row of what hypotheses keep with the log odds of a cell's fault."""
        return 2 * self.slots + 1 + self.slot_of[band]

    def fault_odds(self, band: int, kept: Floats32) -> Floats32:
        """Return the log odds of a cell's fault among what hypotheses keep, (N,)."""
        row: Floats32 = kept[self.fault_row(band)]
        return row

    def beyond_odds(self, kept: Floats32, at: Any = _ALL) -> Floats32:
        """Return the log odds that no prediction holds beyond the area, of some hypotheses or all.

        They change over a distance as those of faults do, but towards even odds.
        """
        odds: Floats32 = kept[-1, at] - np.float32(self.errors.fault_log_odds)
        return odds

    def keep_beyond_odds(self, kept: Floats32, at: Any, log_odds: Any) -> None:
        """Put the log odds that no prediction holds in place, of some hypotheses."""
        kept[-1, at] = log_odds + self.errors.fault_log_odds

    def has_slots(self, bands: Ints32) -> bool:
        """Return whether all of these cells have slots."""
        return self.slot_of.keys() >= set(bands.tolist())

    def correlation(self, one: Ints32, other: Ints32) -> Floats:
        """Return the correlation of the errors of two lists of bands before any level."""
        own = 1 - self.errors.site_share - self.errors.common_share
        same_site = self.site[one][:, None] == self.site[other][None, :]
        same = one[:, None] == other[None, :]
        found = self.errors.common_share + self.errors.site_share * same_site + own * same
        return np.asarray(found, dtype=np.float64)

    def with_cells(
        self, bands: Ints32, kept: Floats32, *, in_place: bool = False
    ) -> tuple[LevelMemory, Floats32]:
        """Give cells slots; those unused for longest lose theirs.

        The errors of new cells are expected from those of the others, by their correlation. Returns
        the memory and what the hypotheses keep, (width, N), which ``in_place`` is ``kept`` itself.
        """
        slot_of = self.slot_of
        wanted = [band for band in bands.tolist() if band not in slot_of]
        if not wanted:
            return self, kept
        held = [slot_of[band] for band in bands.tolist() if band in slot_of]
        order = [slot for slot in np.argsort(self.used, kind="stable") if slot not in held]
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
        if not in_place:
            kept = kept.copy(order="K")
        arrays = arrays_of(kept)
        placed = arrays.asarray
        for part in (0, slots):
            known = arrays.ascontiguousarray(kept[placed(part + rest)])
            now = placed(by.astype(np.float32)) @ known if rest.size else 0.0
            kept[placed(part + at)] = now
        kept[placed(2 * slots + 1 + at)] = self.errors.fault_log_odds
        other_dbm, other_db2, used = self.other_dbm.copy(), self.other_db2.copy(), self.used.copy()
        other_dbm[at], other_db2[at], used[at] = OTHER_DBM, OTHER_SD_DB**2, self.reports
        return changed(
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
        errors, keep = self.errors, exp(-length_m / _OTHER_M)
        covariance, decay, other_dbm, other_db2 = aged(
            self.covariance_db2,
            self.prior_db2,
            exp(-length_m / errors.slow_m),
            exp(-length_m / errors.fast_m),
            (self.other_dbm, OTHER_DBM, keep),
            (self.other_db2, OTHER_SD_DB**2, keep**2),
        )
        memory = changed(self, covariance_db2=covariance, other_dbm=other_dbm, other_db2=other_db2)
        return memory._with_slots_of(self), decay

    def updated(
        self, report: LevelReport, rough_db2: Floats | None = None
    ) -> tuple[LevelMemory, LevelTerms]:
        """Return the memory after the levels of a report whose cells have slots, and its terms.

        Where the prediction is wrong about a cell, its level is what it was before, with the same
        fast and white errors as else, and with ``rough_db2`` (K,), what the roughness of the
        prediction adds to the variance on average.
        """
        slot_of = self.slot_of
        slot = np.array([slot_of[band] for band in report.cell.tolist()], dtype=np.int32)
        covariance = self.covariance_db2.copy()
        white_db2 = self.errors.white_db**2 + report.offset_db**2
        if rough_db2 is None:
            rough_db2 = np.zeros(slot.size)
        other_white_db2 = white_db2 + 0.5 * self.errors.fast_db**2 + rough_db2
        other_dbm, other_db2, used = self.other_dbm.copy(), self.other_db2.copy(), self.used.copy()
        gain, variance, other = sequential_updates(
            covariance,
            slot,
            report.level_dbm,
            white_db2,
            other_white_db2,
            other_dbm,
            other_db2,
            _NEGLIGIBLE / 10,
        )
        used[slot] = self.reports
        memory = changed(
            self,
            covariance_db2=covariance,
            other_dbm=other_dbm,
            other_db2=other_db2,
            used=used,
            reports=self.reports + 1,
        )
        memory._with_slots_of(self)
        return memory, LevelTerms(report.cell, slot, report.level_dbm, gain, variance, other)

    def with_other(self, log_likelihood: float) -> LevelMemory:
        """Return the memory with the last report's log-likelihood under wrong predictions."""
        return changed(self, other_log_likelihood=log_likelihood)._with_slots_of(self)

    def _with_slots_of(self, before: LevelMemory) -> LevelMemory:
        """Take over the look-up of slots from a memory with the same bands."""
        self.__dict__["slot_of"] = before.slot_of
        return self

    def absence(self, report: LevelReport) -> LevelTerms:
        """Return the terms of absent cells that have slots; levels are their limits."""
        slot_of = self.slot_of
        absent = report.absent.tolist()
        held = report.with_absent([k for k, band in enumerate(absent) if band in slot_of])
        cell = held.absent
        slot = np.array([slot_of[band] for band in cell.tolist()], dtype=np.int32)
        more_db2 = self.errors.white_db**2 + report.offset_db**2 + self.errors.absent_db**2
        gain, variance = absence_gains(self.covariance_db2, slot, more_db2, _NEGLIGIBLE)
        return LevelTerms(
            cell,
            slot,
            held.limit_dbm,
            gain,
            variance,
            np.full(cell.size, _ABSENT_BY_FAULT, dtype=np.float32),
        )
