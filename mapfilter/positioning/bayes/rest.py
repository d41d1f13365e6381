"""A phone that reports no motion: by its levels, whether it rests or is carried on.

At rest levels change by fading alone. Each block of a rest is compared with its first one, by the
likelihoods of "still there" and "carried elsewhere", and their ratio is added up from zero (a
CUSUM; Page, 1954).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import isfinite, log, nan

from mapfilter.positioning.epochs import ReportRow
from mapfilter.tracks.schema import SERVING

_BLOCK_S = 10.0
_AT_REST_DB, _ELSEWHERE_DB, _ALL_DB = 4.0, 9.0, 6.0
"""Deviations of a level from an earlier one at rest, and elsewhere; of all levels together, as a
phone is put into a pocket."""
_BLOCK_SHARE = 0.5
"""Power of a block's likelihoods: blocks near each other repeat the same deviation."""
_CELLS_AT_REST, _NATS_PER_CELL, _CELLS_S = 3, 2.5, 600.0
_NATS_PER_S = 1 / 300
"""Serving cells that are usual at rest, gain from each further one that has not served for so long,
and what is forgotten with time: now and then others serve, also at rest."""
_CARRIED_NATS = 6.0


@dataclass(frozen=True, slots=True)
class Rest:
    """Reports since motion stands still.

    Parameters
    ----------
    since_s : float
        Time of the last step.
    block_s : float
        When the present block began.
    first, present : mapping of str to tuple of float
        Sum and number of each cell's levels, in the first and the present block.
    served : mapping of str to float
        When each cell has served last.
    heard_s : float
        Time of the last report.
    carried_nats : float
        How much the levels speak for being carried on.
    """

    since_s: float
    block_s: float = nan
    first: Mapping[str, tuple[float, int]] = field(default_factory=dict)
    present: Mapping[str, tuple[float, int]] = field(default_factory=dict)
    served: Mapping[str, float] = field(default_factory=dict)
    heard_s: float = nan
    carried_nats: float = 0.0

    def heard(self, time_s: float, rows: tuple[ReportRow, ...]) -> Rest:
        """Add a report; a phone that was carried on stays so until a step is measured."""
        if self.is_carried:
            return self
        cells = {row.cell for row in rows if row.role == SERVING and row.cell is not None}
        recent = {cell: at_s for cell, at_s in self.served.items() if time_s - at_s <= _CELLS_S}
        known, all_cells = max(len(recent), _CELLS_AT_REST), len(cells | recent.keys())
        gone_s = time_s - self.heard_s if isfinite(self.heard_s) else 0.0
        kept = max(self.carried_nats - _NATS_PER_S * gone_s, 0.0)
        nats = min(kept + _NATS_PER_CELL * max(all_cells - known, 0), _CARRIED_NATS)
        served = recent | dict.fromkeys(cells, time_s)
        block_s, first, present = self.block_s, self.first, dict(self.present)
        if not isfinite(block_s):
            block_s = time_s
        elif time_s - block_s >= _BLOCK_S:
            nats = min(max(nats + _BLOCK_SHARE * _carried(first, present), 0.0), _CARRIED_NATS)
            block_s, first, present = time_s, {**present, **first}, {}
        for name, level_dbm in levels_of(rows):
            total, count = present.get(name, (0.0, 0))
            present[name] = (total + level_dbm, count + 1)
        return Rest(self.since_s, block_s, first, present, served, time_s, nats)

    @property
    def is_carried(self) -> bool:
        """Whether the phone is carried on though no motion is reported."""
        return self.carried_nats >= _CARRIED_NATS


def levels_of(rows: tuple[ReportRow, ...]) -> list[tuple[str, float]]:
    """Return the levels of a report by their cells."""
    return [
        (row.cell if row.cell is not None else f"{row.arfcn}/{row.bsic}", row.level_dbm)
        for row in rows
        if isfinite(row.level_dbm) and row.censored == 0
    ]


def _carried(first: Mapping[str, tuple[float, int]], now: Mapping[str, tuple[float, int]]) -> float:
    """Return the log-likelihood ratio of "elsewhere" to "still there", by the levels of both."""
    changes = [
        now[name][0] / now[name][1] - first[name][0] / first[name][1]
        for name in now
        if name in first
    ]
    if not changes:
        return 0.0
    return _log_density(changes, _ELSEWHERE_DB) - _log_density(changes, _AT_REST_DB)


def _log_density(changes_db: list[float], sd_db: float) -> float:
    """Return the log density of changes that share an error, up to a constant."""
    count, mean = len(changes_db), sum(changes_db) / len(changes_db)
    apart = sum((change - mean) ** 2 for change in changes_db)
    shared_db2 = sd_db**2 + count * _ALL_DB**2
    exponent = apart / sd_db**2 + count * mean**2 / shared_db2
    return -0.5 * exponent - (count - 1) * log(sd_db) - 0.5 * log(shared_db2)
