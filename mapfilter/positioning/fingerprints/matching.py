"""How alike two reports are: distances between fingerprints, and log-likelihoods.

Both are sums over transmitters that two reports share, less what each has alone, so that only
shared transmitters are looked at one by one. Representations and metrics are those of
Torres-Sospedra et al., Expert Systems with Applications 42 (2015), 9263-9278.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from mapfilter._types import Floats, Ints, Ints8, Ints32
from mapfilter.positioning.fingerprints.censoring import likely
from mapfilter.positioning.fingerprints.reports import Reports

Representation = Literal["positive", "exponential", "powed"]
Metric = Literal["sorensen", "euclidean", "manhattan"]

_ALPHA_DB = 24.0
_LEAST = 1e-12


@dataclass(frozen=True, eq=False)
class ByCell:
    """Readings of reports sorted by transmitter.

    Parameters
    ----------
    first : ndarray, shape (C + 1,)
        Readings of cell c are those from ``first[c]`` to ``first[c + 1]``.
    report : ndarray, shape (N,)
        Reports of the readings, ascending within a cell.
    order : ndarray, shape (N,)
        Where each reading is among those of the reports.
    """

    count: int
    first: Ints
    report: Ints
    order: Ints

    @classmethod
    def of(cls, reports: Reports) -> ByCell:
        """Sort the readings of reports."""
        order = np.argsort(reports.cell, kind="stable")
        first = np.searchsorted(reports.cell[order], np.arange(len(reports.cell_ids) + 1))
        return cls(len(reports), first, reports.report[order], order)

    def of_cell(self, cell: int) -> slice:
        """Return where the readings of a cell are."""
        return slice(int(self.first[cell]), int(self.first[cell + 1]))


def usual_levels(reports: Reports) -> Floats:
    """Return the mean level of each cell, shape (C,); that of all where a cell has none."""
    known = np.isfinite(reports.level_dbm)
    cells = len(reports.cell_ids)
    count = np.bincount(reports.cell[known], minlength=cells)
    total = np.bincount(reports.cell[known], reports.level_dbm[known], minlength=cells)
    overall = float(reports.level_dbm[known].mean()) if known.any() else 0.0
    return np.where(count > 0, total / np.maximum(count, 1), overall)


@dataclass(frozen=True, slots=True)
class Scale:
    """Representation of levels as numbers that grow from not received to strong.

    Parameters
    ----------
    floor_dbm : float
        1 dB below the weakest level of the database; stands for "not received".
    exponent : float
        Of ``powed``.
    """

    representation: Representation
    floor_dbm: float
    exponent: float

    @property
    def absent(self) -> float:
        """Value of a cell that was not received."""
        return float(np.exp(self._top / -_ALPHA_DB)) if self.representation == "exponential" else 0

    @property
    def _top(self) -> float:
        # Levels are relative to 0 dBm; a floor at or above it has no span of its own.
        return max(-self.floor_dbm, 1.0)

    def __call__(self, level_dbm: Floats) -> Floats:
        """Return by how much the value of each level exceeds that of a cell not received."""
        # Weaker than all of the database is received still.
        above_db = np.maximum(level_dbm - self.floor_dbm, 0.5)
        if self.representation == "exponential":
            return np.asarray(np.exp((above_db - self._top) / _ALPHA_DB) - self.absent)
        power = self.exponent if self.representation == "powed" else 1.0
        return np.asarray((above_db / self._top) ** power)


@dataclass(frozen=True, eq=False)
class Distances:
    """Distances from reports to those of a database.

    Parameters
    ----------
    value : ndarray, shape (N,)
        Represented levels of the database, sorted by cell.
    total, total2 : ndarray, shape (R,)
        Sum and sum of squares of each report's.
    """

    by_cell: ByCell
    scale: Scale
    metric: Metric
    usual_dbm: Floats
    value: Floats
    total: Floats
    total2: Floats

    @classmethod
    def to(cls, reports: Reports, metric: Metric, scale: Scale) -> Distances:
        """Represent the reports of a database."""
        by_cell, usual_dbm = ByCell.of(reports), usual_levels(reports)
        level_dbm = likely(reports.level_dbm, reports.censored, reports.cell, usual_dbm)
        value = scale(level_dbm)[by_cell.order]
        total, total2 = sums_by_report(by_cell, value), sums_by_report(by_cell, value**2)
        return cls(by_cell, scale, metric, usual_dbm, value, total, total2)

    def of(self, cell: Ints32, level_dbm: Floats, censored: Ints8 | None = None) -> Floats:
        """Return the distances of one report to all of the database, shape (R,)."""
        own = self.scale(likely(level_dbm, censored, cell, self.usual_dbm))
        shared = np.zeros(self.by_cell.count)
        for one, value in zip(cell.tolist(), own.tolist(), strict=True):
            where = self.by_cell.of_cell(one)
            known = self.value[where]
            both: Floats = known * value if self.metric == "euclidean" else np.minimum(known, value)
            shared[self.by_cell.report[where]] += both
        if self.metric == "euclidean":
            squared = self.total2 + float(np.sum(own**2)) - 2 * shared
            return np.asarray(np.sqrt(np.maximum(squared, 0.0)))
        apart: Floats = np.maximum(self.total + own.sum() - 2 * shared, 0.0)
        if self.metric == "manhattan":
            return apart
        absent = 2 * self.scale.absent * (len(self.by_cell.first) - 1)
        return np.asarray(apart / np.maximum(self.total + own.sum() + absent, _LEAST))


def sums_by_report(by_cell: ByCell, values: Floats) -> Floats:
    """Return the sum of values, sorted by cell, for each report."""
    found = np.bincount(by_cell.report, values, minlength=by_cell.count)
    return np.asarray(found, dtype=np.float64)
