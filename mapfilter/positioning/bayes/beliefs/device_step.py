"""Motion and reports of the map filter's hypotheses on a graphics processor.

Hypotheses and what they keep stay on the device from one step to the next. What all of them share,
small matrices once per report, is computed by the processor, which is given the pixels of some
hundred of them for it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from math import exp, isfinite, nan
from typing import Any

import numpy as np

from mapfilter._device import Device, on_host
from mapfilter._kernels import draw_key
from mapfilter._types import Ints32
from mapfilter.filters import cuda_copies
from mapfilter.filters.array_resampling import normalise_arrays, systematic_arrays
from mapfilter.filters.belief_models import Cloud
from mapfilter.filters.contract import MotionStep, Reason
from mapfilter.filters.copies import array_of
from mapfilter.models import cuda_motion, cuda_reports, fingerprint
from mapfilter.models.level_errors import LevelReport
from mapfilter.models.level_kernels import LevelTerms, Prediction
from mapfilter.models.level_memory import LevelMemory
from mapfilter.positioning.bayes.area.beyond_edge import BEYOND_COST_PER_M, beyond_edge
from mapfilter.positioning.bayes.beliefs.model import BayesModel
from mapfilter.positioning.bayes.sources.evidence import RadioReading
from mapfilter.positioning.bayes.sources.sampled_cells import (
    expected_absent,
    mean_rough_db2,
    sample_stride,
)


@dataclass(frozen=True)
class DeviceStep:
    """The motion and the reports of a model, over arrays of a device.

    Steps have headings. Of hypotheses that keep the errors of levels nothing is withheld, as it is
    where they are tracked.
    """

    model: BayesModel
    device: Device

    @cached_property
    def _log_map(self) -> Any:
        return self.device.placed(self.model.log_map)

    @cached_property
    def _prediction(self) -> Prediction:
        here = self.model.prediction
        placed = self.device.placed
        return here._replace(level_dbm=placed(here.level_dbm), rough_db=placed(here.rough_db))

    @cached_property
    def _serving_table(self) -> Any:
        return self.device.placed(fingerprint.serving_table(self.model.evidence.serving))

    @cached_property
    def _bound_table(self) -> Any:
        return self.device.placed(fingerprint.bound_table())

    def __getstate__(self) -> dict[str, object]:
        # Arrays are brought to the device again where they are needed.
        return {name: self.__dict__[name] for name in self.__dataclass_fields__}

    def placed(self, cloud: Cloud) -> Cloud:
        """Return hypotheses on the device."""
        placed = self.device.placed
        kept = np.ascontiguousarray(array_of(cloud.kept))
        return cloud._replace(state=placed(cloud.state), kept=placed(kept))

    def move(
        self, state: Any, log_weight: Any, motion: MotionStep, key: np.uint64
    ) -> tuple[Any, Any]:
        """Move by one step and weigh by the map, as :meth:`BayesModel.move` does."""
        model, moved = self.model, self.device.arrays.empty_like(state)
        weighed, weights = log_weight.copy(), model.weights
        errors, more = model.motion, (motion.sampling_sd_m, motion.rows)
        step = motion.step_m, motion.heading_rad
        cuda_motion.move(state, *step, errors, key, moved, *more)
        cost = BEYOND_COST_PER_M if model.area.cell_ids else weights.off_cost_per_m
        beyond = -cost / weights.weight_per_m if weights.weight_per_m > 0 else nan
        cuda_motion.weigh_by_ways(
            moved,
            self._log_map,
            model.area.lattice.resolution_m,
            model.area.size_m,
            weights.over(abs(motion.step_m)),
            beyond,
            weighed,
        )
        return moved, weighed

    def weigh(self, cloud: Cloud, log_weight: Any, reading: RadioReading) -> tuple[Cloud, Reason]:
        """Add the log-likelihood of a reading in place, as :meth:`EvidenceModel.weigh` does.

        Terms of other sources are computed by the processor, for the states of all hypotheses.
        """
        used = reading.serving_weight > 0
        if used or reading.serving >= 0 or reading.levels is not None or reading.bounds:
            cloud, used = self._reported(cloud, log_weight, reading), True
        if reading.terms:
            state, used = on_host(cloud.state), True
            for term in reading.terms:
                log_weight += self.device.placed(np.asarray(term.log_likelihood(state)))
        return cloud, Reason.USED if used else Reason.NO_READING

    def _reported(self, cloud: Cloud, log_weight: Any, reading: RadioReading) -> Cloud:
        """Add the log-likelihood of a report in place; return what hypotheses keep afterwards."""
        arrays, model, area = self.device.arrays, self.model, self.model.area
        pixel = arrays.empty(log_weight.size, dtype=np.int32)
        cuda_reports.pixels(cloud.state, area.frame, pixel)
        every = sample_stride(pixel)
        some = np.ascontiguousarray(on_host(pixel[::every]))
        before = log_weight.copy()
        cloud = self._aged(cloud, reading)
        if reading.serving >= 0 and reading.serving_weight > 0:
            self._weigh_serving(cloud, pixel, log_weight, reading)
        other = 0.0
        if reading.levels is not None:
            weight = model.level_weight(reading)
            cloud = self._weigh_levels(cloud, pixel, some, log_weight, reading.levels, weight)
            other = cloud.shared.other_log_likelihood
        for bound in reading.bounds:
            cells, table = self.device.placed(bound.cells), self._bound_table
            cuda_reports.weigh_by_bound(pixel, self._prediction, bound, cells, table, log_weight)
        (wide, high), (east, north) = area.size_m, (cloud.state[0], cloud.state[1])
        beyond = (east < np.float32(0.0)) | (east > np.float32(wide))
        beyond = beyond | (north < np.float32(0.0)) | (north > np.float32(high))
        unknown, memory = reading.radio_under_null(other), cloud.shared
        odds = memory.beyond_odds(cloud.kept)
        at_edge = beyond_edge(odds, log_weight - before, unknown, arrays)
        log_weight[:] = arrays.where(beyond, before + at_edge.gained, log_weight)
        kept_odds = arrays.where(beyond, at_edge.log_odds, odds)
        memory.keep_beyond_odds(cloud.kept, slice(None), kept_odds)
        return cloud

    def resample(
        self, cloud: Cloud, log_weight: Any, jitter: Any, rng: np.random.Generator
    ) -> tuple[Any, Any]:
        """Return as many copies, with noise, by systematic resampling: state and what they keep."""
        arrays = self.device.arrays
        weight, log_total, _ = normalise_arrays(log_weight)
        assert isfinite(log_total), "no hypothesis is left"
        chosen = systematic_arrays(weight, rng.random(), weight.size)
        copies = arrays.empty_like(cloud.state)
        key = draw_key(rng)
        cuda_copies.copy_with_jitter(cloud.state, chosen, self.device.placed(jitter), key, copies)
        return copies, arrays.take(cloud.kept, chosen, axis=1)

    def _aged(self, cloud: Cloud, reading: RadioReading) -> Cloud:
        errors, memory, length_m = self.model.evidence.levels, cloud.shared, reading.length_m
        if memory is None or not self.model.remember:
            memory = LevelMemory.empty(errors, self.model.area.site_of)
            kept = memory.start(cloud.state.shape[1], self.device.arrays)
        else:
            memory, decay = memory.after(length_m)
            keep, kept = exp(-length_m / errors.fault_m), array_of(cloud.kept).copy()
            cuda_reports.age(kept, self.device.placed(decay), keep, errors.fault_log_odds)
        served = [reading.serving] if reading.serving >= 0 else []
        memory, kept = memory.with_cells(np.array(served, dtype=np.int32), kept, in_place=True)
        return cloud._replace(kept=kept, shared=memory)

    def _weigh_serving(
        self, cloud: Cloud, pixel: Any, log_weight: Any, reading: RadioReading
    ) -> None:
        if self.model.serving_is_measured:
            measured = self.model.log_serving_at(on_host(pixel), reading)
            log_weight += self.device.placed(np.asarray(measured))
            return
        odds = cloud.shared.fault_odds(reading.serving, cloud.kept)
        cuda_reports.weigh_by_serving(
            pixel,
            self._prediction,
            reading.serving,
            self.model.area.strongest(reading.serving),
            self._serving_table,
            reading.serving_weight,
            odds,
            -self.model.evidence.serving.fault_nats,
            log_weight,
        )

    def _weigh_levels(
        self,
        cloud: Cloud,
        pixel: Any,
        some: Ints32,
        log_weight: Any,
        report: LevelReport,
        weight: float,
    ) -> Cloud:
        """Add the log-likelihood of levels and absent cells; ``some`` are pixels of a sample."""
        model, memory, kept = self.model, cloud.shared, cloud.kept
        report = expected_absent(model.prediction, some, report)
        cells = np.concatenate([report.cell, report.absent])
        memory, kept = memory.with_cells(cells[: memory.slots], kept, in_place=True)
        if report.cell.size > memory.slots:
            slotted = np.isin(report.cell, memory.band)
            report = report._replace(cell=report.cell[slotted], level_dbm=report.level_dbm[slotted])
        rough_db2 = mean_rough_db2(model.prediction, some, report.cell)
        memory, terms = memory.updated(report, rough_db2)
        absent = memory.absence(report)
        given = kept, pixel, self._prediction
        if terms.cell.size:
            cuda_reports.weigh_by_levels(*given, self._terms(terms), weight, log_weight)
        if absent.cell.size:
            expected = self._terms(absent), self._bound_table
            cuda_reports.weigh_by_absence(*given, *expected, weight, log_weight)
        other = weight * (float(terms.other.sum()) + float(absent.other.sum()))
        return cloud._replace(kept=kept, shared=replace(memory, other_log_likelihood=other))

    def _terms(self, terms: LevelTerms) -> LevelTerms:
        return LevelTerms(*map(self.device.placed, terms))
