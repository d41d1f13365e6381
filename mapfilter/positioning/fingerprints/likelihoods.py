"""Log-likelihoods of reports at the places of others."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from mapfilter._types import Floats, Ints, Ints8, Ints32
from mapfilter.positioning.fingerprints.censoring import likely
from mapfilter.positioning.fingerprints.likelihood_kernel import add_reading
from mapfilter.positioning.fingerprints.matching import ByCell, sums_by_report, usual_levels
from mapfilter.positioning.fingerprints.planned import Planned
from mapfilter.positioning.fingerprints.reports import Reports


@dataclass(frozen=True, slots=True)
class LevelErrors:
    """Errors of levels between two reports of one place, on different days.

    Parameters
    ----------
    level_db : float
        Of each level, independent of the others.
    shared_db : float
        Of all levels of a report alike: another phone, a pocket, a body.
    absence_per_db : float
        Loss of log-likelihood for each dB by which a cell was above the floor that only one of the
        two reports has.
    floor_dbm : float
    """

    level_db: float
    shared_db: float
    absence_per_db: float
    floor_dbm: float


@dataclass(frozen=True, eq=False)
class _Excess:
    """For each report the sum of what its levels have above a threshold.

    A database of predicted levels has millions of them, and each report to be located a threshold
    of its own. Sums above whole dBm are kept; between two of these only the levels there count.

    Parameters
    ----------
    first_dbm : int
        Lowest whole dBm.
    sums_db : ndarray, shape (Q, R)
        Sums of the levels above each whole dBm, less that; the last row is zero.
    count : ndarray of int32, shape (Q, R)
        Numbers of these levels.
    edges : ndarray, shape (Q + 1,)
        Levels of at least each whole dBm, but less than the next, are those between the edges.
    level_dbm, report : ndarray, shape (N,)
        By whole dBm.
    """

    first_dbm: int
    sums_db: Floats
    count: Ints32
    edges: Ints
    level_dbm: Floats
    report: Ints

    @classmethod
    def of(cls, reports: int, of_level: Ints, level_dbm: Floats) -> _Excess:
        """Prepare levels, each of the report ``of_level``."""
        if not len(level_dbm):
            none = np.zeros((1, reports))
            return cls(0, none, none.astype(np.int32), np.zeros(2, np.int64), level_dbm, of_level)
        whole = np.floor(level_dbm).astype(np.int64)
        first, last = int(whole.min()), int(whole.max())
        order = np.argsort(whole, kind="stable")
        edges = np.searchsorted(whole[order], np.arange(first, last + 2))
        level, report = level_dbm[order], of_level[order]
        steps = last + 2 - first
        sums, count = np.zeros((steps, reports)), np.zeros((steps, reports), dtype=np.int32)
        for step in range(steps - 2, -1, -1):
            own = slice(int(edges[step]), int(edges[step + 1]))
            over = np.bincount(report[own], level[own] - (first + step), minlength=reports)
            more = np.bincount(report[own], minlength=reports)
            # Those above the next whole dBm are one more above this one.
            sums[step] = sums[step + 1] + count[step + 1] + over
            count[step] = count[step + 1] + more
        return cls(first, sums, count, edges, level, report)

    def above(self, threshold_dbm: float) -> Floats:
        """Return the sums above a threshold, shape (R,)."""
        step = int(np.floor(threshold_dbm)) - self.first_dbm
        if step < 0:
            below_db = self.first_dbm - threshold_dbm
            return np.asarray(self.sums_db[0] + below_db * self.count[0])
        if step >= len(self.sums_db) - 1:
            return np.zeros(self.sums_db.shape[1])
        own = slice(int(self.edges[step]), int(self.edges[step + 1]))
        over = np.maximum(self.level_dbm[own] - threshold_dbm, 0.0)
        found = np.bincount(self.report[own], over, minlength=self.sums_db.shape[1])
        part_db = self.first_dbm + step + 1 - threshold_dbm
        return np.asarray(found + self.sums_db[step + 1] + part_db * self.count[step + 1])


@dataclass(frozen=True, eq=False)
class Likelihoods:
    """Log-likelihoods of reports at those of a database.

    Parameters
    ----------
    level_dbm, variance_db2 : ndarray, shape (N,)
        Of the database, sorted by cell; missing levels are NaN.
    loss : ndarray, shape (N,)
        Of log-likelihood, if a cell is not received.
    absence : ndarray, shape (R,)
        Loss of each report if none of its cells is received.
    usual_dbm : ndarray, shape (C,)
        Stands for missing levels.
    least_db2 : float
        Least of the variances.
    predicted : bool
        Whether the absence of a cell weaker than all that were reported is no evidence.
    planned : Planned or None
        With it, only cells that would have been measured with those of a report can be absent.
    """

    by_cell: ByCell
    errors: LevelErrors
    level_dbm: Floats
    variance_db2: Floats
    loss: Floats
    absence: Floats
    usual_dbm: Floats
    least_db2: float
    predicted: bool
    planned: Planned | None = None
    _prepared: dict[int, _Excess] = field(default_factory=dict)

    @classmethod
    def at(cls, reports: Reports, errors: LevelErrors) -> Likelihoods:
        """Prepare the reports of a database."""
        by_cell, usual_dbm = ByCell.of(reports), usual_levels(reports)
        level_dbm = reports.level_dbm[by_cell.order]
        variance_db2 = errors.level_db**2 + reports.sd_db[by_cell.order] ** 2
        cell = reports.cell[by_cell.order]
        loss = _absence(likely(level_dbm, None, cell, usual_dbm), errors)
        absence = sums_by_report(by_cell, loss)
        least_db2 = float(variance_db2.min()) if variance_db2.size else 1.0
        return cls(
            by_cell,
            errors,
            level_dbm,
            variance_db2,
            loss,
            absence,
            usual_dbm,
            least_db2,
            reports.predicted,
            reports.planned,
        )

    def _above(self, cell: Ints32, threshold_dbm: float) -> Floats:
        """Return the sums above a threshold of cells that would be reported with some, (R,)."""
        found, layers = np.zeros(self.by_cell.count), self._layer
        if self.planned is not None:
            layers = layers[self.planned.measured_with(cell)]
        # Sums are kept by layer, of which there are few; reports may have any set of them.
        for layer in np.unique(layers).tolist():
            if layer not in self._prepared:
                own = np.repeat(self._layer == layer, np.diff(self.by_cell.first))
                report, level_dbm = self.by_cell.report[own], self.level_dbm[own]
                self._prepared[layer] = _Excess.of(self.by_cell.count, report, level_dbm)
            found += self._prepared[layer].above(threshold_dbm)
        return found

    @cached_property
    def _layer(self) -> Ints:
        """Number of each cell's layer, (C,); one for all where no plan tells them apart."""
        if self.planned is None:
            return np.zeros(len(self.by_cell.first) - 1, dtype=np.int64)
        return self.planned.layer

    @cached_property
    def _log_variance(self) -> Floats:
        return np.asarray(np.log(self.variance_db2 / self.least_db2))

    def of(
        self, cell: Ints32, level_dbm: Floats, censored: Ints8 | None = None
    ) -> tuple[Floats, Floats]:
        """Return log-likelihoods of one report: of which cells it has, and of their levels, (R,).

        The shared error is integrated out: levels d_i with variances v_i about a common offset of
        variance t have the log-likelihood
        ``-(s2 - s1^2 / (s0 + 1/t)) / 2 - log(1 + t s0) / 2``, with ``s_k = sum d_i^k / v_i``, and a
        logarithm of each variance relative to the least of the database. A bound tells nothing
        where the level of the database keeps it; elsewhere it counts by what it is off.
        """
        strength_dbm = likely(level_dbm, censored, cell, self.usual_dbm)
        ends = (np.zeros(len(cell)) if censored is None else censored).tolist()
        own = _absence(strength_dbm, self.errors)
        count, lost, absence, errors = self.by_cell.count, self.loss, self.absence, self.errors
        if self.predicted:
            # Phones report the strongest cells: the absence of weaker ones is no evidence.
            least_dbm = max(float(strength_dbm.min()), self.errors.floor_dbm)
            errors = replace(self.errors, floor_dbm=least_dbm)
            absence = self.errors.absence_per_db * self._above(cell, least_dbm)
        received = -absence - own.sum()
        sums = np.zeros((4, count))
        readings = zip(cell.tolist(), level_dbm.tolist(), ends, own.tolist(), strict=True)
        for one, dbm, end, own_loss in readings:
            where = self.by_cell.of_cell(one)
            known_dbm = self.level_dbm[where]
            add_reading(
                self.by_cell.report[where],
                _absence(known_dbm, errors) if self.predicted else lost[where],
                known_dbm,
                self.variance_db2[where],
                self._log_variance[where],
                (float(dbm), float(end), own_loss),
                received,
                sums,
            )
        s0, s1, s2, logs = sums
        shared_db2 = self.errors.shared_db**2
        explained = s1**2 * shared_db2 / (1 + shared_db2 * s0)
        return received, -0.5 * (s2 - explained + np.log1p(shared_db2 * s0) + logs)


def _absence(level_dbm: Floats, errors: LevelErrors) -> Floats:
    return np.asarray(errors.absence_per_db * np.maximum(level_dbm - errors.floor_dbm, 0.0))
