"""The model of a report in a Kalman-type filter: errors that last, of reports in a row."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from mapfilter.models.gaussian import GaussianTerms
from mapfilter.models.signal_strength import with_errors
from mapfilter.models.state import StateLayout
from mapfilter.positioning.kalman.level_errors import LEAST_MOVED_M, CellSlots
from mapfilter.positioning.kalman.models import SiteModels
from mapfilter.positioning.kalman.readings import SiteReadings


def report_model(
    sites: SiteModels,
    layout: StateLayout,
    given: SiteReadings,
    slots: CellSlots,
    growth: Mapping[str, float],
    moved_m: float,
) -> GaussianTerms:
    """Return the model of a report's levels and timing advances.

    Parameters
    ----------
    layout : StateLayout
        With the errors of levels that ``slots`` keeps.
    growth : mapping of str to float
        How many times as large the variance of each cell's own error is where it is not kept.
    moved_m : float
        Distance travelled since the report before.
    """
    options = sites.options
    kept_m = [options.level_noise_memory_m] * len(given.cells)
    kept_m += [options.timing_memory_m] * len(given.timed)
    model = aged(sites.of(layout, given.cells, given.timed), kept_m, moved_m)
    if not slots.size:
        return model
    errors = slots.components(given.cells, layout)
    # More cells than are kept at a time: their own errors are noise.
    more_db2 = np.zeros(model.size)
    for row, (name, (_, own)) in enumerate(zip(given.cells, errors, strict=True)):
        more_db2[row] = growth[name] * options.level_error_db**2 if own < 0 else 0.0
    return with_errors(replace(model, noise=model.noise + np.diag(more_db2)), errors)


def aged(model: GaussianTerms, kept_m: Sequence[float], moved_m: float) -> GaussianTerms:
    """Return a model with noise for errors that last: reports in a row count once."""
    growth = np.sqrt(np.maximum(1.0, np.array(kept_m) / max(moved_m, LEAST_MOVED_M)))
    return replace(model, noise=model.noise * np.outer(growth, growth))
