"""Radio reports as evidence: which cells and levels are used, and with which weight.

Errors of a predicted map last for tens of metres, so a report adds little soon after the last one.
A report is used ``spacing_m`` after the last one that was; serving cells count in proportion to the
distance, and levels by the part of their error that is new (see
:mod:`mapfilter.models.fingerprint`).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import exp, inf, isfinite, nan, sqrt
from typing import ClassVar

import numpy as np

from mapfilter._types import Floats
from mapfilter.filters.contract import Reason
from mapfilter.models.fingerprint import BoundReading, LevelErrors, LevelReading, ServingWeights
from mapfilter.options import NotNegative, Options
from mapfilter.positioning.bayes.area_map import AreaMap
from mapfilter.positioning.bayes.evidence import (
    Context,
    EvidenceSource,
    EvidenceUpdate,
    RadioReading,
)
from mapfilter.positioning.bayes.state import FIRST_SPACING_M, BayesState, DeadReckoning
from mapfilter.positioning.epochs import Epoch, ReportRow
from mapfilter.positioning.estimate import UnusedReading
from mapfilter.tracks.schema import SERVING, Kind

_SERVING_NATS = 0.5
_MAP_NATS_PER_M = 0.03
"""Expected log-likelihood, below 0: of a serving cell at full weight, and of the map per metre."""


@dataclass(frozen=True, slots=True)
class EvidenceOptions(Options):
    """Weights of radio reports.

    Parameters
    ----------
    spacing_m : float
        Least distance between two reports that are used.
    first_m : float
        Distance that the first report counts for, and the most that any report does.
    use_levels : bool
        Use levels, too, not serving cells only.
    """

    serving: ServingWeights = field(default_factory=ServingWeights)
    levels: LevelErrors = field(default_factory=LevelErrors)
    spacing_m: NotNegative = 5.0
    first_m: NotNegative = 25.0
    use_levels: bool = True


@dataclass(frozen=True, eq=False)
class RadioHistory:
    """Levels received so far, and where the last report was used.

    Parameters
    ----------
    level_dbm, received_at_m : ndarray, shape (C,)
        Last level of each cell inside the scale, and the distance travelled then; NaN and minus
        infinity before the first.
    used : DeadReckoning or None
        Dead reckoning at the last report that was used.
    """

    level_dbm: Floats
    received_at_m: Floats
    used: DeadReckoning | None = None

    @classmethod
    def empty(cls, cells: int) -> RadioHistory:
        """Return the history before the first report."""
        return cls(np.full(cells, nan), np.full(cells, -inf))


@dataclass(frozen=True)
class RadioSource(EvidenceSource):
    """Serving cells and levels, compared with the area's map."""

    area: AreaMap
    options: EvidenceOptions
    name: ClassVar[str] = "radio"
    kinds: ClassVar[frozenset[Kind]] = frozenset({"serving", "neighbour"})

    def begin(self) -> RadioHistory:
        """Return the history before the first report."""
        return RadioHistory.empty(len(self.area.cell_ids))

    def first(self, epoch: Epoch) -> EvidenceUpdate:
        """Read a report as if it were the first."""
        return self.read(self.begin(), DeadReckoning(), epoch, FIRST_SPACING_M)

    def update(self, state: BayesState, epoch: Epoch, context: Context) -> EvidenceUpdate:
        """Read the epoch's report."""
        history = state.sources[self.name]
        return self.read(history, state.reckoning, epoch, context.particle_spacing_m)

    def due(self, history: RadioHistory, travelled_m: float) -> bool:
        """Return whether a report would be used after so many metres."""
        used = history.used
        return used is None or travelled_m - used.travelled_m >= self.options.spacing_m

    def cells_only(self, reading: RadioReading, history: RadioHistory) -> bool:
        """Return whether the serving cell is the only evidence by radio, as no levels are reported.

        A reading of satellites or timing alone, between two reports, is no sign of that.
        """
        if reading.levels is not None or reading.bounds:
            return False
        return reading.serving >= 0 or not np.isfinite(history.received_at_m).any()

    def read(
        self,
        history: RadioHistory,
        reckoning: DeadReckoning,
        epoch: Epoch,
        particle_spacing_m: float,
    ) -> EvidenceUpdate:
        """Prepare a report for the model, and update the history.

        The hypotheses nearest to the true position lie up to ``particle_spacing_m`` from it.
        """
        options = self.options
        serving, reason, rows = self._serving(epoch)
        due = self.due(history, reckoning.travelled_m)
        if not due or not epoch.radio:
            if epoch.radio and reason is Reason.USED:
                reason = Reason.NOT_MOVED_ENOUGH
            return EvidenceUpdate(history, unused=_unused(epoch, rows), reason=reason)
        first = history.used is None
        since_m = 1e9 if history.used is None else reckoning.travelled_m - history.used.travelled_m
        counted_m = min(since_m, options.first_m)
        levels: LevelReading | None = None
        bounds: tuple[BoundReading, ...] = ()
        expected_levels = 0.0
        level_dbm, received_at_m = history.level_dbm, history.received_at_m
        if options.use_levels:
            inside, others, unknown = self._placed(epoch, serving)
            rows += unknown
            bounds = tuple(self._bound(bands, row, counted_m) for bands, row in others)
            if inside:
                levels, new = self._levels(history, reckoning, inside, particle_spacing_m)
                expected_levels = 0.5 * levels.weight * new
                level_dbm, received_at_m = level_dbm.copy(), received_at_m.copy()
                level_dbm[list(inside)] = list(inside.values())
                received_at_m[list(inside)] = reckoning.travelled_m
        unused = _unused(epoch, rows)
        if serving < 0 and levels is None and not bounds:
            return EvidenceUpdate(history, unused=unused, reason=reason)
        weight = counted_m * options.serving.weight_per_m
        by_cell = _SERVING_NATS * weight * (serving >= 0)
        by_map = _MAP_NATS_PER_M * min(since_m, 100.0)
        reading = RadioReading(
            serving,
            weight,
            levels,
            bounds,
            expected=-(by_cell + by_map) - expected_levels,
            length_m=0.0 if first else since_m,
            timing_advance=_timing_advance(epoch) if serving >= 0 else nan,
        )
        after = RadioHistory(level_dbm, received_at_m, reckoning)
        return EvidenceUpdate(after, unused=unused, radio=reading, reason=reason)

    def _serving(self, epoch: Epoch) -> tuple[int, Reason, list[_Unplaced]]:
        """Return the band of the serving cell, or -1 and the reason; and further serving rows."""
        named = [row for row in epoch.radio if row.role == SERVING and row.cell is not None]
        if not named:
            return -1, Reason.NO_SERVING_CELL if epoch.radio else Reason.NO_READING, []
        more = [(row, Reason.SECOND_SERVING_CELL) for row in named[1:]]
        cell = str(named[0].cell)
        if cell in self.area.band_of:
            return self.area.band_of[cell], Reason.USED, more
        known = cell in self.area.known_ids
        return -1, Reason.NO_POINTS_IN_CELL if known else Reason.UNKNOWN_CELL, more

    def _placed(
        self, epoch: Epoch, serving: int
    ) -> tuple[dict[int, float], list[tuple[tuple[int, ...], ReportRow]], list[_Unplaced]]:
        """Sort levels: of one cell and inside the scale, other ones, and those without a band."""
        inside: dict[int, float] = {}
        others: list[tuple[tuple[int, ...], ReportRow]] = []
        unplaced: list[_Unplaced] = []
        served = False
        for row in epoch.radio:
            if row.role == SERVING:
                # A second or unknown serving cell has its reason already.
                bands: tuple[int, ...] = () if served or serving < 0 else (serving,)
                served = True
                if not bands:
                    continue
            elif row.cell is not None:
                band = self.area.band_of.get(row.cell)
                bands = (band,) if band is not None else ()
            elif row.arfcn is not None:
                key = (row.arfcn, -1 if row.bsic is None else row.bsic)
                bands = tuple(b for b in self.area.carriers.get(key, ()) if b != serving)
            else:
                unplaced.append((row, Reason.NO_CELL))
                continue
            if not bands:
                unplaced.append((row, Reason.UNKNOWN_CELL))
            elif not isfinite(row.level_dbm):
                continue
            elif len(bands) == 1 and row.censored == 0:
                inside.setdefault(bands[0], row.level_dbm)
            else:
                others.append((bands, row))
        return inside, others, unplaced

    def _levels(
        self,
        history: RadioHistory,
        reckoning: DeadReckoning,
        inside: dict[int, float],
        particle_spacing_m: float,
    ) -> tuple[LevelReading, float]:
        """Return levels with their innovation's weights, and the sum of the shares that are new."""
        errors = self.options.levels
        count = len(inside)
        cell = np.fromiter(inside, np.int32, count)
        level = np.fromiter(inside.values(), np.float64, count)
        used = history.used or reckoning
        received_at_m = history.received_at_m[cell]
        together = received_at_m == used.travelled_m if history.used else np.zeros(count, np.bool_)
        correlation = np.exp(-(reckoning.travelled_m - received_at_m) / errors.correlation_m)
        rho = np.where(together, correlation, 0.0)
        before = np.where(together, history.level_dbm[cell], 0.0)
        # A level that was missing from the last report only still has most of its former error.
        new = np.where(together, 1.0, 1.0 - correlation**2)
        white = errors.measurement_db**2 + errors.offset_variance_db2(particle_spacing_m)
        variance = errors.sd_db**2 * (1 - rho**2) + white * (1 + rho**2)
        reading = LevelReading(
            cell,
            (level - rho * before).astype(np.float32),
            rho.astype(np.float32),
            np.sqrt(new / variance).astype(np.float32),
            errors.common,
            errors.weight,
            errors.clip_sd,
            reckoning.east_m - used.east_m,
            reckoning.north_m - used.north_m,
        )
        return reading, float(np.sum(new))

    def _bound(self, bands: tuple[int, ...], row: ReportRow, counted_m: float) -> BoundReading:
        errors = self.options.levels
        weight = errors.weight * (1.0 - exp(-2.0 * counted_m / errors.correlation_m))
        sd_db = sqrt(errors.sd_db**2 + errors.measurement_db**2)
        cells = np.array(bands, dtype=np.int32)
        return BoundReading(cells, row.level_dbm, row.censored, sd_db, weight)


_Unplaced = tuple[ReportRow, Reason]


def _timing_advance(epoch: Epoch) -> float:
    return next((row.timing_advance for row in epoch.radio if row.role == SERVING), nan)


def _unused(epoch: Epoch, rows: list[_Unplaced]) -> list[UnusedReading]:
    return [UnusedReading(epoch.time_s, row.role, name_of(row), why) for row, why in rows]


def name_of(row: ReportRow) -> str:
    """Return the cell of a report's row as messages name it."""
    if row.cell is not None:
        return row.cell
    bsic = "unknown" if row.bsic is None else row.bsic
    return "" if row.arfcn is None else f"ARFCN {row.arfcn}, BSIC {bsic}"
