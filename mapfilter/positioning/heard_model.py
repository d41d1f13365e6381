"""The map filter's model where earlier sessions were along the same streets.

Serving cells and timing advances are weighed by what was heard before, levels by their map.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import isfinite

import numpy as np
from numpy.typing import NDArray

from mapfilter.filters.contract import Reason
from mapfilter.models.heard_maps import HeardMaps
from mapfilter.positioning.bayes_model import BayesModel
from mapfilter.positioning.evidence import RadioReading

Floats = NDArray[np.float64]
Floats32 = NDArray[np.float32]


@dataclass(frozen=True)
class HeardModel(BayesModel):
    """Streets and radio of an area, with maps of what was heard.

    Parameters
    ----------
    heard : HeardMaps
        On the area's lattice.
    """

    heard: HeardMaps | None = None

    @property
    def timed_by_sites(self) -> bool:
        """Whether timing advances are compared with the distances of sites: with maps if any."""
        return self.heard is None

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
        super().weigh(state, log_weight, replace(reading, serving_weight=0.0))
        return Reason.USED
