"""The map filter's model over measured maps.

Serving cells and timing advances are compared with their statistics at each place, and levels with
a map whose standard deviation varies.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import isfinite, log

import numpy as np

from mapfilter._types import Bytes, Floats, Floats32, Ints32
from mapfilter.models.measured_map import ServingStatistics
from mapfilter.positioning.bayes.beliefs.model import BayesModel
from mapfilter.positioning.bayes.sources.evidence import RadioReading


@dataclass(frozen=True)
class MeasuredMapModel(BayesModel):
    """Ways and measured radio maps of an area.

    Parameters
    ----------
    serving_model : ServingStatistics
        On the area's lattice.
    level_sd_db : ndarray of float32, shape (C, P), optional
        Standard deviation of a new reading from the map of levels, on the area's lattice; without
        it that of the evidence options everywhere.
    """

    serving_model: ServingStatistics | None = None
    level_sd_db: Floats32 | None = None

    @property
    def timed_by_sites(self) -> bool:
        """Whether timing advances are compared with the distances of sites: not with maps."""
        return self.serving_model is None

    def usual_serving(self, serving: int, timing_advance: float) -> float:
        """Return the log-likelihood (nats) of a cell (band) and its advance (steps) on any way.

        What is compared with a probability of so many cells at a place has to be one, too.
        """
        from scipy.special import logsumexp

        model = self.serving_model
        if model is None:
            return super().usual_serving(serving, timing_advance)
        if not self._way_pixels.size:
            return super().usual_serving(serving, timing_advance)
        # NaN is no key that is found again.
        key = serving, timing_advance if isfinite(timing_advance) else None
        if key not in self._usual_serving:
            found = self._log_serving(model, serving, timing_advance, self._way_pixels)
            self._usual_serving[key] = float(logsumexp(found)) - log(found.size)
        return self._usual_serving[key]

    @cached_property
    def _usual_serving(self) -> dict[tuple[int, float | None], float]:
        """As many values as cells have timing advances."""
        return {}

    @cached_property
    def _way_pixels(self) -> Ints32:
        return np.flatnonzero(self.whole.on_way).astype(np.int32)

    def rough_db(self) -> Bytes:
        """Return by how much the map's deviation exceeds that of the options."""
        return super().rough_db() if self.level_sd_db is None else self._rough_db

    @cached_property
    def _rough_db(self) -> Bytes:
        count = len(self.area.cell_ids)
        sd_db = np.zeros((self.whole.on_way.size, self.area.bands))
        if self.level_sd_db is not None:
            sd_db[:, :count] = self.level_sd_db.reshape(count, -1).T
        more_db = np.sqrt(np.maximum(sd_db**2 - self.evidence.levels.total_db**2, 0.0))
        tenths: Bytes = np.minimum(np.rint(10 * more_db), 255).astype(np.uint8).reshape(-1)
        return tenths

    @property
    def serving_is_measured(self) -> bool:
        """Whether serving cells have statistics at each place."""
        return self.serving_model is not None

    def log_serving_at(self, pixel: Ints32, reading: RadioReading) -> Floats:
        """Return the log-likelihood (N,) of a measured serving cell at pixels (N,)."""
        assert self.serving_model is not None, "a map without statistics of serving cells"
        serving, advance = reading.serving, reading.timing_advance
        found = self._log_serving(self.serving_model, serving, advance, pixel)
        return np.asarray(reading.serving_weight * found)

    def _log_serving(
        self, model: ServingStatistics, serving: int, timing_advance: float, pixel: Ints32
    ) -> Floats32:
        found = model.log_serving(serving, pixel)
        if isfinite(timing_advance):
            found = found + model.log_advance(serving, pixel, timing_advance)
        return found
