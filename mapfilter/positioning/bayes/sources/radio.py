"""Radio reports as evidence: which cells and levels are used, and with which weight.

A report is used ``spacing_m`` after the last one that was. Serving cells count in proportion to the
distance, because errors of a predicted map last for tens of metres; those of levels are estimated
(:mod:`mapfilter.models.level_errors`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from math import exp, isfinite, nan
from typing import ClassVar

import numpy as np

from mapfilter.filters.contract import Reason
from mapfilter.models.fingerprint import BoundReading
from mapfilter.models.level_errors import LevelReport
from mapfilter.positioning.bayes.area.area_frame import AreaFrame
from mapfilter.positioning.bayes.beliefs.path import DeadReckoning
from mapfilter.positioning.bayes.sources.evidence import (
    SERVING_UNDER_NULL,
    Context,
    EvidenceSource,
    EvidenceUpdate,
    RadioReading,
)
from mapfilter.positioning.bayes.sources.evidence_options import EvidenceOptions
from mapfilter.positioning.bayes.state import FIRST_SPACING_M, BayesState
from mapfilter.positioning.epochs import Epoch, ReportRow
from mapfilter.positioning.step_output import UnusedReading
from mapfilter.tracks.schema import SERVING, Kind

_NEIGHBOURS_FOR_ABSENCE = 2
"""A phone that reports fewer may not measure neighbours at all."""
_BOUND_M = 50.0
"""Bounds that are nearer to each other repeat the same error."""


def _same_everywhere(serving: int, timing_advance: float) -> float:  # noqa: ARG001
    return SERVING_UNDER_NULL


@dataclass(frozen=True)
class RadioSource(EvidenceSource):
    """Serving cells and levels, compared with the area's map.

    Parameters
    ----------
    usual_serving : callable
        Returns the log-likelihood of a serving cell (band) and its timing advance (steps, or NaN)
        under the null hypothesis.
    """

    area: AreaFrame
    options: EvidenceOptions
    usual_serving: Callable[[int, float], float] = _same_everywhere
    name: ClassVar[str] = "radio"
    kinds: ClassVar[frozenset[Kind]] = frozenset({"serving", "neighbour"})

    def begin(self) -> DeadReckoning | None:
        """Return no report yet: the state is dead reckoning at the last one that was used."""
        return None

    def first(self, epoch: Epoch) -> EvidenceUpdate:
        """Read a report as if it were the first."""
        return self.read(None, DeadReckoning(), epoch, FIRST_SPACING_M)

    def update(self, state: BayesState, epoch: Epoch, context: Context) -> EvidenceUpdate:
        """Read the epoch's report."""
        used = state.sources[self.name]
        return self.read(used, state.reckoning, epoch, context.particle_spacing_m)

    def due(self, used: DeadReckoning | None, travelled_m: float) -> bool:
        """Return whether a report would be used after so many metres."""
        return used is None or travelled_m - used.travelled_m >= self.options.spacing_m

    def read(
        self,
        used: DeadReckoning | None,
        reckoning: DeadReckoning,
        epoch: Epoch,
        particle_spacing_m: float,
    ) -> EvidenceUpdate:
        """Prepare a report for the model.

        The hypotheses nearest to the true position lie up to ``particle_spacing_m`` from it.
        """
        options = self.options
        served, serving, reason, rows = self._serving(epoch)
        if not self.due(used, reckoning.travelled_m) or not epoch.radio:
            if epoch.radio and reason is Reason.USED:
                reason = Reason.NOT_MOVED_ENOUGH
            return EvidenceUpdate(used, unused=_unused(epoch, rows), reason=reason)
        length_m = 0.0 if used is None else reckoning.travelled_m - used.travelled_m
        counted_m = options.first_m if used is None else min(length_m, options.first_m)
        levels: LevelReport | None = None
        bounds: tuple[BoundReading, ...] = ()
        if options.use_levels:
            inside, others, unplaced = self._placed(epoch, served, serving)
            rows += unplaced
            bounds = tuple(self._bound(bands, row, counted_m) for bands, row in others)
            if inside:
                levels = self._levels(inside, epoch, particle_spacing_m)
        unused = _unused(epoch, rows)
        unknown = reason in (Reason.UNKNOWN_CELL, Reason.NO_POINTS_IN_CELL)
        if serving < 0 and levels is None and not bounds and (used is None or not unknown):
            return EvidenceUpdate(used, unused=unused, reason=reason)
        share = 1.0 if levels is None else options.serving_with_levels
        advance = served.timing_advance if served is not None else nan
        reading = RadioReading(
            serving,
            counted_m * options.serving.weight_per_m * share * (serving >= 0 or unknown),
            levels,
            bounds,
            length_m=length_m,
            timing_advance=advance,
            serving_under_null=self.usual_serving(serving, advance) if serving >= 0 else nan,
        )
        return EvidenceUpdate(reckoning, unused=unused, radio=reading, reason=reason)

    def _serving(self, epoch: Epoch) -> tuple[ReportRow | None, int, Reason, list[_Unplaced]]:
        """Return the row of the serving cell and its band, or None, -1 and the reason.

        That is the first one with a band. Also return further serving rows that are not used.
        """
        named = [row for row in epoch.radio if row.role == SERVING and row.cell is not None]
        if not named:
            return None, -1, Reason.NO_SERVING_CELL if epoch.radio else Reason.NO_READING, []
        placed = [k for k, row in enumerate(named) if row.cell in self.area.band_of]
        if not placed:
            more = [(row, Reason.SECOND_SERVING_CELL) for row in named[1:]]
            return None, -1, self._why_unknown(named[0]), more
        served = named[placed[0]]
        rows = [(row, self._why_unknown(row)) for row in named[: placed[0]]]
        for row in named[placed[0] + 1 :]:
            if not self._serves_beside(row, served):
                rows.append((row, Reason.SECOND_SERVING_CELL))
        return served, self.area.band_of[str(served.cell)], Reason.USED, rows

    def _why_unknown(self, row: ReportRow) -> Reason:
        known = row.cell in self.area.known_ids
        return Reason.NO_POINTS_IN_CELL if known else Reason.UNKNOWN_CELL

    def _serves_beside(self, row: ReportRow, served: ReportRow | None) -> bool:
        """Return whether a serving row is of another layer than the serving cell.

        Phones with two connections (5G beside LTE) or two cards report such.
        """
        band_of, layer_of = self.area.band_of, self.area.layer_of
        if served is None or row.cell not in band_of:
            return False
        return bool(layer_of[band_of[row.cell]] != layer_of[band_of[str(served.cell)]])

    def _placed(
        self, epoch: Epoch, served: ReportRow | None, serving: int
    ) -> tuple[dict[int, float], list[tuple[tuple[int, ...], ReportRow]], list[_Unplaced]]:
        """Sort levels: of one cell and inside the scale, other ones, and those without a band."""
        inside: dict[int, float] = {}
        others: list[tuple[tuple[int, ...], ReportRow]] = []
        unplaced: list[_Unplaced] = []
        for row in epoch.radio:
            bands: tuple[int, ...]
            if row.role == SERVING and row is not served and not self._serves_beside(row, served):
                # A second, unknown or nameless serving cell has its reason already.
                continue
            if row is served:
                bands = (serving,)
            elif row.cell is not None:
                band = self.area.band_of.get(row.cell)
                bands = (band,) if band is not None else ()
            elif row.arfcn is not None:
                bands = tuple(b for b in self.area.carriers.get(_carrier(row), ()) if b != serving)
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
        self, inside: dict[int, float], epoch: Epoch, particle_spacing_m: float
    ) -> LevelReport:
        """Return levels, and the cells that are absent though a report has room for them."""
        absent, count = self._absent(epoch), len(inside)
        return LevelReport(
            np.fromiter(inside, np.int32, count),
            np.fromiter(inside.values(), np.float32, count),
            np.fromiter(absent, np.int32, len(absent)),
            np.fromiter(absent.values(), np.float32, len(absent)),
            self.options.offset_db(particle_spacing_m),
        )

    def _absent(self, epoch: Epoch) -> dict[int, float]:
        """Return cells that would be in a report if they were stronger, and than which level.

        They are of layers of which the phone measures neighbours.
        """
        present = self._present(epoch)
        full = sum(row.role != SERVING for row in epoch.radio) >= self.options.full_list
        rows: dict[int, list[ReportRow]] = {}
        for row in epoch.radio:
            for layer in self._layers_of(row):
                rows.setdefault(layer, []).append(row)
        found: dict[int, float] = {}
        for layer, some in rows.items():
            if sum(row.role != SERVING for row in some) < _NEIGHBOURS_FOR_ABSENCE:
                continue
            of_layer = self._bands_of_layer.get(layer, [])
            levels = [row.level_dbm for row in some if isfinite(row.level_dbm)]
            listed = levels and (full or not self.area.interfering.isdisjoint(of_layer))
            limit_dbm = min(levels) if listed else self.area.floor_dbm
            found.update(dict.fromkeys((b for b in of_layer if b not in present), limit_dbm))
        return dict(sorted(found.items()))

    def _layers_of(self, row: ReportRow) -> set[int]:
        """Return the layers that a row is of, or may be of, also of a cell that is not known."""
        if self._bands_of_layer.keys() <= {0}:
            return {0}
        layer_of = self.area.layer_of
        bands = self._bands_of(row)
        if not bands and row.arfcn is not None:
            bands = self.area.carriers.get((row.arfcn, -1), ())
        return {int(layer_of[band]) for band in bands}

    @cached_property
    def _bands_of_layer(self) -> dict[int, list[int]]:
        """Bands of the cells of each layer."""
        found: dict[int, list[int]] = {}
        for band, layer in enumerate(self.area.layer_of.tolist()):
            found.setdefault(layer, []).append(band)
        return found

    def _present(self, epoch: Epoch) -> set[int]:
        """Return the bands that rows of a report are of, or may be of, with and without levels."""
        if any(row.cell is None and row.arfcn is None for row in epoch.radio):
            return set(range(len(self.area.cell_ids)))
        found: set[int] = set()
        for row in epoch.radio:
            bands = self._bands_of(row)
            # A neighbour that the plan's carriers and codes do not tell may be a cell without them.
            found.update(self.area.uncoded if row.cell is None and not bands else bands)
        return found

    def _bands_of(self, row: ReportRow) -> tuple[int, ...]:
        """Return the bands that a row with a cell or a carrier is of, or may be of."""
        if row.cell is not None:
            band = self.area.band_of.get(row.cell)
            return () if band is None else (band,)
        return () if row.arfcn is None else self.area.carriers.get(_carrier(row), ())

    def _bound(self, bands: tuple[int, ...], row: ReportRow, counted_m: float) -> BoundReading:
        weight = self.options.bound_weight * (1.0 - exp(-2.0 * counted_m / _BOUND_M))
        cells = np.array(bands, dtype=np.int32)
        return BoundReading(
            cells, row.level_dbm, row.censored, self.options.levels.total_db, weight
        )


_Unplaced = tuple[ReportRow, Reason]


def _carrier(row: ReportRow) -> tuple[int, int]:
    return -1 if row.arfcn is None else row.arfcn, -1 if row.bsic is None else row.bsic


def _unused(epoch: Epoch, rows: list[_Unplaced]) -> list[UnusedReading]:
    return [UnusedReading(epoch.time_s, row.role, row.name, why) for row, why in rows]
