"""The map filter's model where earlier sessions were along the same streets.

Serving cells and timing advances are weighed by what was heard before, levels by their map: more
where the cell was measured, less where only its trend is known.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import isfinite

import numpy as np

from mapfilter._types import Floats, Floats32, Ints32
from mapfilter.filters.contract import Reason
from mapfilter.models.fingerprint import LevelReading
from mapfilter.models.heard_maps import HeardMaps
from mapfilter.positioning.bayes_model import BayesModel
from mapfilter.positioning.evidence import RadioReading

_LEAST_VARIANCE = 0.25
"""Of an innovation, as a share of the usual one."""


@dataclass(frozen=True)
class HeardModel(BayesModel):
    """Streets and radio of an area, with maps of what was heard.

    Parameters
    ----------
    heard : HeardMaps
        On the area's lattice.
    level_sd_db : ndarray of float32, shape (C, P), optional
        Of a new reading against the map of levels, on the area's lattice; without it that of the
        evidence's options holds everywhere.
    """

    heard: HeardMaps | None = None

    @property
    def timed_by_sites(self) -> bool:
        """Whether timing advances are compared with the distances of sites: with maps if any."""
        return self.heard is None

    level_sd_db: Floats32 | None = None

    def weigh(self, state: Floats32, log_weight: Floats, reading: RadioReading) -> Reason:
        """Add the log-likelihood of a report and of a fix, in place."""
        heard = self.heard
        if heard is None or reading.serving < 0:
            return super().weigh(state, log_weight, reading)
        pixel = self._pixels(state, 0.0, 0.0)
        found = heard.log_serving(reading.serving, pixel)
        if isfinite(reading.timing_advance):
            found = found + heard.log_advance(reading.serving, pixel, reading.timing_advance)
        log_weight += reading.serving_weight * found
        levels = reading.levels
        if levels is not None and self.level_sd_db is not None:
            log_weight += self._log_levels(state, pixel, levels, self.level_sd_db)
            reading = replace(reading, levels=None)
        super().weigh(state, log_weight, replace(reading, serving_weight=0.0))
        return Reason.USED

    def _log_levels(
        self, state: Floats32, now: Ints32, levels: LevelReading, sd_db: Floats32
    ) -> Floats32:
        """Return the log-likelihood of levels that are more certain at some places than at others.

        As :func:`mapfilter.models.fingerprint.weigh_by_levels`, but with errors of different cells
        that have nothing in common.
        """
        table = self.area.level_dbm
        table = table.reshape(-1, table.shape[-1])
        then = self._pixels(state, levels.back_east_m, levels.back_north_m)
        usual = self.evidence.levels
        found = np.zeros(now.size, dtype=np.float32)
        for cell, offset_db, rho, scale in zip(
            levels.cell, levels.offset_db, levels.rho, levels.scale, strict=True
        ):
            innovation_db = offset_db - table[now, cell] + rho * table[then, cell]
            more_db2 = sd_db[cell][now] ** 2 - usual.measurement_db**2 - usual.sd_db**2
            wider = 1 + np.maximum(more_db2 * (1 - rho**2) * scale**2, _LEAST_VARIANCE - 1)
            square = np.minimum((innovation_db * scale) ** 2 / wider, levels.clip**2)
            found -= np.float32(0.5 * levels.weight) * (square + np.log(wider))
        return found
