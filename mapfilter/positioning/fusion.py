"""Where Gaussian measurement models meet Kalman-type filters."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mapfilter.filters.trials import CompiledMeasurement

if TYPE_CHECKING:
    from mapfilter.models.gaussian import GaussianTerms


def compiled(measurement: GaussianTerms) -> CompiledMeasurement:
    """Return a measurement as the compiled filters take it."""
    from mapfilter.models._terms import measure

    return CompiledMeasurement(
        measure,
        measurement.slots,
        measurement.uses,
        measurement.rows,
        measurement.patterns,
        measurement.covariance(),
    )
