"""How hypotheses are weighed by a reading: by radio maps of the area, then by further terms.

What hypotheses keep of the errors of levels is aged and updated on the way. Ways and motion are no
part of this.
"""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass, field
from functools import cached_property
from math import exp

import numpy as np

from mapfilter._threads import ONE, Threads
from mapfilter._types import Bytes, Floats, Floats32, Ints32
from mapfilter.filters.belief_models import Cloud
from mapfilter.filters.contract import Reason
from mapfilter.filters.copies import columns_of
from mapfilter.filters.resampling import log_sum
from mapfilter.models import fingerprint
from mapfilter.models.ageing import Ageing, age, as_it_is
from mapfilter.models.level_errors import LevelReport
from mapfilter.models.level_kernels import Prediction, gained
from mapfilter.models.level_memory import LevelMemory
from mapfilter.models.record_tiles import kept_in, new_records, records_of
from mapfilter.models.report_kernel import NOT_HEARD, NOT_SERVED, Heard, Served, weigh_by_report
from mapfilter.positioning.bayes.area.area_frame import AreaFrame
from mapfilter.positioning.bayes.area.area_map import AreaMap
from mapfilter.positioning.bayes.area.beyond_edge import beyond_edge
from mapfilter.positioning.bayes.area.tiled_area import TiledArea
from mapfilter.positioning.bayes.sources.evidence import SERVING_UNDER_NULL, RadioReading
from mapfilter.positioning.bayes.sources.evidence_options import EvidenceOptions
from mapfilter.positioning.bayes.sources.sampled_cells import (
    expected_absent,
    mean_rough_db2,
    most_expected,
    sample_stride,
)

_NEW_M = 50.0


@dataclass(frozen=True)
class EvidenceModel:
    """Radio maps of an area, and the errors of measurements.

    ``remember`` is whether hypotheses keep the errors of levels from one report to the next; else
    each report counts by the share of its errors that is new. Hypotheses are divided among
    ``threads``.
    """

    area: AreaFrame
    _: KW_ONLY
    evidence: EvidenceOptions = field(default_factory=EvidenceOptions)
    remember: bool = True
    threads: Threads = ONE

    def __getstate__(self) -> dict[str, object]:
        # What was computed is neither sent to other processes nor shared with copies: the
        # likelihoods kept are those of this object.
        return {name: self.__dict__[name] for name in self.__dataclass_fields__}

    @property
    def timed_by_sites(self) -> bool:
        """Whether timing advances are compared with the distances of sites."""
        return True

    def usual_serving(self, serving: int, timing_advance: float) -> float:  # noqa: ARG002
        """Return the log-likelihood (nats) of a serving cell (band) under the null hypothesis.

        ``timing_advance`` is in steps, NaN where none was reported.
        """
        return SERVING_UNDER_NULL

    @property
    def whole(self) -> AreaMap:
        """The area, where all of it is held."""
        assert isinstance(self.area, AreaMap), "an area that is held by tiles"
        return self.area

    def weigh(
        self, cloud: Cloud, log_weight: Floats, reading: RadioReading
    ) -> tuple[Cloud, Reason]:
        """Add the log-likelihood of a report, then of each further term, in place.

        Of a belief that is tracked a part of that of levels is left out, and returned as log
        evidence that is withheld from the weights.
        """
        kept_back: Floats | None = None
        counted: Floats | None = None
        withholds = reading.tracked and self.remember
        # A serving cell that the map lacks weighs all hypotheses in the area alike.
        used = reading.serving_weight > 0
        if used or reading.serving >= 0 or reading.levels is not None or reading.bounds:
            beyond, used = self.area.beyond(cloud.state).nonzero()[0], True
            before = log_weight[beyond]
            memory, kept, pixel = self._found(cloud, reading)
            other, served = 0.0, NOT_SERVED
            if reading.serving >= 0 and reading.serving_weight > 0:
                if self.serving_is_measured:
                    log_weight += self.log_serving_at(pixel, reading)
                else:
                    served = self._serving(memory, pixel, reading)
            if reading.levels is not None:
                start = np.empty(log_weight.size if withholds else 0)
                memory = self._weigh_levels(memory, kept, served, pixel, log_weight, start, reading)
                other = memory.other_log_likelihood
                if withholds:
                    withheld_share = 1 - self.evidence.levels.tracking_share
                    kept_back = gained(start, log_weight, withheld_share)
            else:
                self._age(kept, served, log_weight)
            now = kept_in(kept.now, memory.width)
            cloud = Cloud(cloud.state, now, memory)
            for bound in reading.bounds:
                predicted, own, cells = self._looked_up(pixel, bound.cells, rough=False)
                fingerprint.weigh_by_bound(
                    own,
                    predicted.level_dbm,
                    predicted.bands,
                    bound._replace(cells=cells),
                    self._bound_table,
                    log_weight,
                )
            if kept_back is not None:
                counted = log_weight - kept_back
            if beyond.size:
                unknown = reading.radio_under_null(other)
                odds = memory.beyond_odds(now, beyond)
                if counted is not None:
                    share = self.evidence.levels.tracking_share
                    counted_unknown = reading.radio_under_null(share * other)
                    held = gained(before, counted[beyond], 1.0)
                    counted[beyond] = before + beyond_edge(odds, held, counted_unknown).gained
                held = gained(before, log_weight[beyond], 1.0)
                at_edge = beyond_edge(odds, held, unknown)
                log_weight[beyond] = before + at_edge.gained
                memory.keep_beyond_odds(now, beyond, at_edge.log_odds)
        for term in reading.terms:
            log_likelihood = term.log_likelihood(cloud.state)
            log_weight += log_likelihood
            if counted is not None:
                counted += log_likelihood
            used = True
        if counted is not None:
            cloud = cloud._replace(withheld=log_sum(log_weight) - log_sum(counted))
            log_weight[:] = counted
        return cloud, Reason.USED if used else Reason.NO_READING

    @cached_property
    def _serving_table(self) -> Floats32:
        return fingerprint.serving_table(self.evidence.serving)

    @cached_property
    def _bound_table(self) -> Floats32:
        return fingerprint.bound_table()

    def rough_db(self) -> Bytes:
        """Return what is added to the deviation of levels, in tenths of a dB, flat as levels."""
        return self.whole.flat_rough_db

    @cached_property
    def prediction(self) -> Prediction:
        """Predicted levels of the area, as kernels take them."""
        share = self.evidence.levels.roughness
        return Prediction(self.whole.flat_level_dbm, self.rough_db(), self.area.bands, share)

    def _looked_up(
        self, pixel: Ints32, cell: Ints32, *, rough: bool = True
    ) -> tuple[Prediction, Ints32, Ints32]:
        """Return a prediction of cells at pixels, and the pixels and bands in it.

        Of an area that is held by tiles it has a pixel for each hypothesis, and these cells only.
        """
        if isinstance(self.area, TiledArea):
            return self.area.predicted(pixel, cell, self.evidence.levels.roughness, rough=rough)
        return self.prediction, pixel, cell

    def _found(self, cloud: Cloud, reading: RadioReading) -> tuple[LevelMemory, Ageing, Ints32]:
        """Return what a reading finds: the memory, what hypotheses keep, and their pixels.

        What they keep is to be aged yet, but for a serving cell that is new.
        """
        errors, memory, length_m = self.evidence.levels, cloud.shared, reading.length_m
        # That takes less time than to divide it.
        pixel, count = fingerprint.pixels(cloud.state, self.area.frame), cloud.state.shape[1]
        if memory is None or not self.remember:
            memory = LevelMemory.empty(errors, self.area.site_of)
            kept = as_it_is(records_of(memory.start(count)))
        else:
            memory, decay = memory.after(length_m)
            of, chosen = columns_of(cloud.kept)
            keep, before = exp(-length_m / errors.fault_m), records_of(of)
            # NumPy asks for large pages, numba for many small ones.
            now = new_records(count, memory.width)
            kept = Ageing(before, chosen, decay, keep, errors.fault_log_odds, True, now)
        serving = [reading.serving] if reading.serving >= 0 else []
        bands = np.array(serving, dtype=np.int32)
        memory, kept, _ = self._with_cells(memory, kept, NOT_SERVED, np.empty(0), bands)
        return memory, kept, pixel

    def _with_cells(
        self, memory: LevelMemory, kept: Ageing, served: Served, log_weight: Floats, bands: Ints32
    ) -> tuple[LevelMemory, Ageing, Served]:
        """Give cells slots; where some are new, what hypotheses keep is aged before.

        So is the serving cell weighed, which is returned if it still is due.
        """
        if memory.has_slots(bands):
            return memory, kept, served
        self._age(kept, served, log_weight)
        kept_now = kept_in(kept.now, memory.width)
        memory, _ = memory.with_cells(bands, kept_now, in_place=True)
        return memory, as_it_is(kept.now), NOT_SERVED

    def _age(self, kept: Ageing, served: Served, log_weight: Floats) -> None:
        """Age what hypotheses keep, and weigh by a serving cell, in place."""
        count = kept.now.shape[0]
        if served.row < 0:
            self.threads.over(count, (age, kept))
            return
        given = kept, served, *NOT_HEARD, *NOT_HEARD, self._bound_table, 0.0
        self.threads.over(count, (weigh_by_report, *given, log_weight, np.empty(0)))

    def _serving(self, memory: LevelMemory, pixel: Ints32, reading: RadioReading) -> Served:
        """Return the serving cell as kernels take it."""
        # Its own level, the strongest and the second strongest of its layer.
        top = self.area.strongest(reading.serving)
        some = np.array([reading.serving, top, top + 1], dtype=np.int32)
        predicted, pixel, some = self._looked_up(pixel, some, rough=False)
        return Served(
            pixel,
            predicted.level_dbm,
            fingerprint.ServingBands(predicted.bands, *some.tolist()),
            self._serving_table,
            reading.serving_weight,
            memory.fault_row(reading.serving),
            -self.evidence.serving.fault_nats,
        )

    @property
    def serving_is_measured(self) -> bool:
        """Whether serving cells have statistics at each place, as :meth:`log_serving_at` tells."""
        return False

    def log_serving_at(self, pixel: Ints32, reading: RadioReading) -> Floats:
        """Return the log-likelihood (N,) of a measured serving cell at pixels (N,)."""
        raise NotImplementedError

    def level_weight(self, reading: RadioReading) -> float:
        """Return the exponent of the likelihood of a report's levels."""
        weight = self.evidence.levels.weight
        if not self.remember and reading.length_m > 0:
            weight *= 1 - exp(-2 * reading.length_m / _NEW_M)
        return weight

    def _weigh_levels(
        self,
        memory: LevelMemory,
        kept: Ageing,
        served: Served,
        pixel: Ints32,
        log_weight: Floats,
        start: Floats,
        reading: RadioReading,
    ) -> LevelMemory:
        """Add the log-likelihood of levels and absent cells, in place; return the memory now.

        That of the serving cell is added before, and ``start`` filled with weights after it, if it
        is not empty.
        """
        report = reading.levels
        assert report is not None
        weight = self.level_weight(reading)
        # Cells that nobody expects say nothing, neither for the belief nor against it.
        report = self._expected_absent(pixel, report)
        cells = np.concatenate([report.cell, report.absent])
        bands = cells[: memory.slots]
        memory, kept, served = self._with_cells(memory, kept, served, log_weight, bands)
        if report.cell.size > memory.slots:
            slotted = np.isin(report.cell, memory.band)
            report = report._replace(cell=report.cell[slotted], level_dbm=report.level_dbm[slotted])
        predicted, own, cells = self._looked_up(pixel, report.cell)
        rough_db2 = mean_rough_db2(predicted, own, cells)
        memory, terms = memory.updated(report, rough_db2)
        absent = memory.absence(report)
        levels, missing = Heard(own, predicted, terms._replace(cell=cells)), NOT_HEARD
        if absent.cell.size:
            predicted, own, cells = self._looked_up(pixel, absent.cell)
            missing = Heard(own, predicted, absent._replace(cell=cells))
        given = kept, served, *levels, *missing, self._bound_table, weight, log_weight, start
        self.threads.over(log_weight.size, (weigh_by_report, *given))
        return memory.with_other(weight * (float(terms.other.sum()) + float(absent.other.sum())))

    def _expected_absent(self, pixel: Ints32, report: LevelReport) -> LevelReport:
        if not isinstance(self.area, TiledArea):
            return expected_absent(self.prediction, pixel, report)
        some = np.ascontiguousarray(pixel[:: sample_stride(pixel)])
        share = self.area.shares_above(some, report.absent, report.limit_dbm)
        return most_expected(report, share)
