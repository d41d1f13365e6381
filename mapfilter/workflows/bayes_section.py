"""``[filter.bayes]``: what can be set of the Bayes map filter."""

from __future__ import annotations

from math import radians
from typing import Annotated

from pydantic import Field

from mapfilter.filters.particle_options import ParticleOptions
from mapfilter.models.fingerprint import LevelErrors
from mapfilter.models.street_motion import MapWeights, MotionErrors
from mapfilter.positioning.bayes_options import BayesOptions
from mapfilter.positioning.evidence import EvidenceOptions
from mapfilter.positioning.sky_options import SkyOptions, TimingOptions
from mapfilter.workflows.fields import Finite, NotNegative, Positive, Section


class BayesSection(Section):
    """``[filter.bayes]``: errors of dead reckoning and of the prediction, weights, particles.

    Angles are degrees. A noise that is taken too large costs some metres until the filter has
    converged, one taken too small costs wrong positions.
    """

    step_sd_m: NotNegative = 0.3
    heading_sd_deg: NotNegative = 6.0
    bias_deg: NotNegative = 3.0
    drift_deg_per_sqrt_m: NotNegative = 0.05
    scale: Annotated[float, Field(ge=0, lt=1)] = 0.02
    map_sd_m: Positive = 4.0
    map_weight_per_m: NotNegative = 1 / 18
    off_cost_per_m: NotNegative = 0.1
    levels: bool = True
    level_error_db: Positive = 10.0
    level_correlation_m: Positive = 50.0
    level_weight: Annotated[float, Field(gt=0, le=1)] = 0.7
    report_spacing_m: NotNegative = 5.0
    most_particles: Annotated[int, Field(ge=100, le=10_000_000)] = 20_000
    searching_particles: Annotated[int, Field(ge=10, le=10_000_000)] = 12_000
    least_particles: Annotated[int, Field(ge=10, le=10_000_000)] = 1000
    switch_mass: Annotated[float, Field(gt=0, lt=1)] = 0.99
    switch_hold_m: NotNegative = 14.0
    smooth: bool = False
    satellite_sd_m: Positive = 2.0
    antenna_height_m: Finite = 100.0
    antenna_height_sd_m: NotNegative = 200.0
    timing_step_m: Positive = 553.5
    timing_sd_m: Positive = 200.0

    @property
    def options(self) -> BayesOptions:
        """The options that these settings mean."""
        return BayesOptions(
            MotionErrors(
                step_sd_m=self.step_sd_m,
                heading_sd_rad=radians(self.heading_sd_deg),
                bias_sd_rad=radians(self.bias_deg),
                bias_drift_rad_per_sqrt_m=radians(self.drift_deg_per_sqrt_m),
                scale_sd=self.scale,
            ),
            MapWeights(self.map_sd_m, self.map_weight_per_m, self.off_cost_per_m),
            EvidenceOptions(
                levels=LevelErrors(
                    sd_db=self.level_error_db,
                    correlation_m=self.level_correlation_m,
                    weight=self.level_weight,
                ),
                spacing_m=self.report_spacing_m,
                use_levels=self.levels,
            ),
            ParticleOptions(
                most=self.most_particles,
                searching=self.searching_particles,
                least=self.least_particles,
                switch_mass=self.switch_mass,
                switch_hold_m=self.switch_hold_m,
            ),
            satellites=SkyOptions(
                zenith_m=self.satellite_sd_m,
                height_m=self.antenna_height_m,
                height_sd_m=self.antenna_height_sd_m,
            ),
            timing=TimingOptions(step_m=self.timing_step_m, advance_sd_m=self.timing_sd_m),
            smooth=self.smooth,
        )
