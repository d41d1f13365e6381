"""The rows of radio reports as the page reads them: cell, level, prediction, and whether used."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from mapfilter._types import Floats, Ints
from mapfilter.filters.contract import Reason
from mapfilter.models.fingerprint import pixels
from mapfilter.positioning.bayes.area.area_frame import AreaFrame
from mapfilter.positioning.epochs import Epoch, ReportRow
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.positioning.merging import epochs
from mapfilter.positioning.step_output import UnusedReading
from mapfilter.radio.cells import CellPlan
from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.schema import SERVING
from mapfilter.viewing.arrays import cell_numbers, packed, starts

REASONS = tuple(Reason)
ROLES = ("serving", "neighbour")

LevelAt = Callable[[Floats, Floats, Sequence[str | None]], Floats]
"""Predicted levels of cells at places of the CRS, NaN where there are none."""

Unused = Mapping[tuple[float, str, str], tuple[Reason, int]]
"""Reasons, and of how many readings, by time, role and name of these."""

_LATE = (Reason.NOT_MOVED_ENOUGH, Reason.STALE_RADIO)


class NumberedTexts(dict[str, int]):
    """Numbers of texts in the order in which they come."""

    def __missing__(self, key: str) -> int:
        self[key] = len(self)
        return self[key]


class ReadingRow(NamedTuple):
    """A row of a radio report.

    ``cell`` is its number in the plan, -1 for none; ``known`` its id there; ``censored`` whether
    the level lies at an end of the scale: -1 below it, 1 above it, else 0.
    """

    cell: int
    name: str
    known: str | None
    role: str
    level_dbm: float
    use: Reason
    censored: int


def unused_of(readings: Iterable[UnusedReading]) -> tuple[Unused, frozenset[str]]:
    """Return why readings were not used, and the kinds that a filter never uses."""
    some = list(readings)
    why: dict[tuple[float, str, str], tuple[Reason, int]] = {}
    for one in some:
        key = one.time_s, one.kind, one.what
        _, before = why.get(key, (one.reason, 0))
        why[key] = one.reason, before + 1
    never = frozenset(one.kind for one in some if one.reason is Reason.NOT_USED_BY_FILTER)
    return why, never


def report_rows(
    epoch: Epoch,
    reason: Reason,
    unused: tuple[Unused, frozenset[str]],
    plan: CellPlan,
    index: Mapping[str, int],
) -> list[ReadingRow]:
    """Return the rows of an epoch's report.

    Parameters
    ----------
    reason : Reason
        Of the epoch's fix.
    unused : tuple
        From :func:`unused_of`.
    index : mapping of str to int
        Numbers of the plan's cells.
    """
    why, never = unused
    found: list[ReadingRow] = []
    serving = -1
    left = Counter((row.role, row.name) for row in epoch.radio)
    for row in epoch.radio:
        name = row.name
        known = _cell_of(row, plan, plan.ids[serving] if serving >= 0 else None)
        cell = index.get(known, -1) if known is not None else -1
        use, times = why.get((epoch.time_s, row.role, name), (Reason.USED, 0))
        # Of rows of one name those that are not used are the last ones.
        use = use if left[row.role, name] <= times else Reason.USED
        left[row.role, name] -= 1
        if row.role in never:
            use = Reason.NOT_USED_BY_FILTER
        elif use is Reason.USED and reason in _LATE:
            use = reason
        if row.role == SERVING and serving < 0:
            serving = cell
        found.append(ReadingRow(cell, name, known, row.role, row.level_dbm, use, row.censored))
    return found


class Readings:
    """The rows of the radio reports of those epochs that are shown."""

    def __init__(
        self, estimate: TrackEstimate, log: TrackLog | None, kept: Ints, plan: CellPlan
    ) -> None:
        self.count = np.zeros(kept.size, dtype=np.int64)
        self.serving = np.full(kept.size, -1, dtype=np.int64)
        self.rows: list[ReadingRow] = []
        at_epoch: list[int] = []
        if log is not None and len(log.radio):
            index = {cell: number for number, cell in enumerate(plan.ids)}
            unused = unused_of(estimate.unused)
            merged = epochs(log)
            place = np.searchsorted(estimate.time_s, [epoch.time_s for epoch in merged])
            of_epoch = dict(zip(place.tolist(), merged, strict=True))
            for number, at in enumerate(kept.tolist()):
                epoch = of_epoch.get(at)
                if epoch is None:
                    continue
                rows = report_rows(epoch, estimate.reason[at], unused, plan, index)
                self.count[number] = len(rows)
                self.serving[number] = next(
                    (r.cell for r in rows if r.role == SERVING and r.cell >= 0), -1
                )
                self.rows += rows
                at_epoch += [at] * len(rows)
        at_row = np.array(at_epoch, dtype=np.int64)
        self.east_m, self.north_m = estimate.east_m[at_row], estimate.north_m[at_row]

    def packed(self, whats: NumberedTexts, level_at: LevelAt) -> dict[str, Any]:
        """Return the rows as the page reads them."""
        rows, known = self.rows, [one.known for one in self.rows]
        predicted = level_at(self.east_m, self.north_m, known) if rows else np.empty(0)
        level = np.array([one.level_dbm for one in rows], dtype=np.float64)
        return {
            "first": starts(self.count),
            "cell": cell_numbers(np.array([one.cell for one in rows], dtype=np.int64)),
            "what": packed(np.array([whats[one.name] for one in rows], np.int64), "u4"),
            "role": packed(np.array([ROLES.index(one.role) for one in rows], np.int64), "u1"),
            "level": dbm(level),
            "predicted": dbm(predicted),
            "censored": packed(np.array([one.censored for one in rows], np.int64), "i1"),
            "use": packed(np.array([REASONS.index(one.use) for one in rows], np.int64), "u1"),
        }


def dbm(values: Any) -> dict[str, Any]:
    """Return levels as the page reads them, in steps of 0.5 dB."""
    return packed(values, "u1", scale=0.5, offset=-150.0, none=255)


def level_on(area: AreaFrame) -> LevelAt:
    """Return a function that looks levels up on a filter's own map."""
    (west, south), band_of = area.origin_m, area.band_of

    def look_up(east_m: Floats, north_m: Floats, cells: Sequence[str | None]) -> Floats:
        if not area.cell_ids:
            return np.full(len(cells), np.nan)
        place = np.stack([east_m - west, north_m - south])
        known = np.isfinite(place).all(axis=0)
        at = pixels(np.where(known, place, 0.0).astype(np.float32), area.frame)
        band = np.array([band_of.get(cell or "", -1) for cell in cells], dtype=np.int64)
        level = area.levels_at(at, band).astype(np.float64)
        return np.where(known & (band >= 0), level, np.nan)

    return look_up


def _cell_of(row: ReportRow, plan: CellPlan, serving: str | None) -> str | None:
    """Return the cell of a row: as it is named, or the only one of its carrier and code."""
    if row.cell is not None or row.arfcn is None:
        return row.cell
    alike = plan.ids_by_carrier.get((row.arfcn, -1 if row.bsic is None else row.bsic), ())
    others = [cell for cell in alike if cell != serving]
    return others[0] if len(others) == 1 else None
