"""The Bayes map filter of its options: what they assume, as the parts of a filter over an area."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import radians
from typing import TYPE_CHECKING

from mapfilter._threads import Threads
from mapfilter.filters.particle import ParticleOptions
from mapfilter.models.level_errors import LevelErrors
from mapfilter.models.street_motion import MotionErrors
from mapfilter.models.way_map import MapWeights
from mapfilter.positioning.bayes.area.area_frame import AreaFrame
from mapfilter.positioning.bayes.beliefs.model import BayesModel
from mapfilter.positioning.bayes.carriageways import carriageway_filters
from mapfilter.positioning.bayes.filter import BayesPositioner
from mapfilter.positioning.bayes.rivals.alternative import AlternativeRules
from mapfilter.positioning.bayes.rivals.hold_rules import HoldRules, PullRules
from mapfilter.positioning.bayes.sources.evidence_options import EvidenceOptions
from mapfilter.positioning.gnss.options import GnssOptions, TimingOptions

if TYPE_CHECKING:
    from mapfilter.positioning.bayes.options import BayesFilter

_SLOW, _FAST, _WHITE = 7.0, 4.0, 3.3
_TOTAL_DB = (_SLOW**2 + _FAST**2 + _WHITE**2) ** 0.5
_FAST_OF_SLOW_M = 0.1

_VEHICLE_MOTION: Mapping[str, float] = {
    "disturbances_per_m": 0.0,
    "remounts_per_m": 0.0,
    "rate_rad_per_m": radians(0.01),
    "stretch_sd": 0.02,
    "corners_per_m": 1 / 20,
}
_RESCALES_PER_M, _RESCALED_BY_SCALE = 1 / 1000, 3.0
"""How often a vehicle's step scale becomes another one over cells, as after a stop of a bus; and
how far off it is then, as a multiple of the scale's own deviation."""
_VEHICLE_LEAVES_PER_M = 3e-4
_VEHICLE_FIX_MEMORY_S = 14.0
"""Time in which a walker goes the distance for which errors of fixes last; cars have it too."""

_MORE_BY_MAP = 3
_LEAST_MASS_BY_MAP, _LEAST_HOLD_BY_MAP_M = 0.998, 200.0
_CONVERGE_BY_MAP, _NATS_PER_M_BY_MAP = -8.0, 0.03
"""Where the map alone is the evidence: factor of the numbers of particles; least mass and distance
of the switch rule; largest log odds of the null hypothesis, its cost of a metre."""


def assembled(options: BayesFilter, area: AreaFrame) -> BayesPositioner:
    """Return the filter over an area.

    Parameters
    ----------
    options : BayesFilter
        With the defaults of vehicles where they are asked for.
    area : AreaFrame
        Without cells the map alone is the evidence as long as no positions are measured.
    """
    evidence = EvidenceOptions(
        levels=_level_errors(options),
        spacing_m=options.report_spacing_m,
        use_levels=options.levels,
    )
    threads = Threads(options.threads)
    motion, weights = _motion_errors(options, area), _map_weights(options)
    model = BayesModel(area, motion, weights, evidence=evidence, threads=threads)
    particles, rules = _particle_options(options), AlternativeRules(claimed_from=options.claim_mass)
    positioned, carriageways = None, None
    if not area.cell_ids:
        positioned = particles, rules
        particles, rules = _by_map_alone(particles, rules)
        if options.vehicle:
            carriageways = carriageway_filters(model, particles, rules, positioned[0])
    return BayesPositioner(
        model,
        particles,
        rules,
        grid=options.name == "grid",
        satellites=GnssOptions(
            zenith_m=options.satellite_sd_m,
            height_m=options.antenna_height_m,
            height_sd_m=options.antenna_height_sd_m,
            fix_memory_s=_VEHICLE_FIX_MEMORY_S if options.vehicle else 0.0,
        ),
        timing=TimingOptions(step_m=options.timing_step_m, advance_sd_m=options.timing_sd_m),
        smooth=options.smooth,
        positioned=positioned,
        carriageways=carriageways,
        # A vehicle's compass is screwed on; without cells any street may go straight on.
        holds=HoldRules(watched=bool(area.cell_ids) and not options.vehicle),
        # By ways alone a belief without positions goes astray sooner than they do.
        pulls=PullRules(watched=bool(area.cell_ids)),
        device=options.opened_device(),
    )


def _motion_errors(options: BayesFilter, area: AreaFrame) -> MotionErrors:
    motion = MotionErrors(
        step_sd_m=options.step_sd_m,
        heading_sd_rad=radians(options.heading_sd_deg),
        bias_sd_rad=radians(options.bias_sd_deg),
        bias_drift_rad_per_sqrt_m=radians(options.drift_deg_per_sqrt_m),
        scale_sd=options.scale,
    )
    if options.vehicle:
        motion = replace(motion, **_VEHICLE_MOTION)
        if not area.cell_ids:
            # Streets alone would follow any scale.
            return motion
        rescaled_sd = _RESCALED_BY_SCALE * options.scale
        return replace(motion, rescales_per_m=_RESCALES_PER_M, rescaled_sd=rescaled_sd)
    # Disturbances are part of the headings' errors: with small ones large jumps are rarer.
    usual = MotionErrors()
    times = motion.heading_sd_rad / usual.heading_sd_rad
    return replace(motion, disturbances_per_m=times * usual.disturbances_per_m)


def _map_weights(options: BayesFilter) -> MapWeights:
    weights = MapWeights(options.map_sd_m, options.map_weight_per_m, options.off_cost_per_m)
    return replace(weights, leave_per_m=_VEHICLE_LEAVES_PER_M) if options.vehicle else weights


def _level_errors(options: BayesFilter) -> LevelErrors:
    share = options.level_error_db / _TOTAL_DB
    return LevelErrors(
        slow_db=share * _SLOW,
        slow_m=options.level_correlation_m,
        fast_db=share * _FAST,
        fast_m=_FAST_OF_SLOW_M * options.level_correlation_m,
        white_db=share * _WHITE,
        device_db=options.device_error_db,
        fault_probability=options.fault_probability,
        weight=options.level_weight,
    )


def _particle_options(options: BayesFilter) -> ParticleOptions:
    return ParticleOptions(
        max_particles=options.max_particles,
        min_search_particles=options.min_search_particles,
        min_particles=options.min_particles,
        switch_mass=options.switch_mass,
        switch_hold_m=options.switch_hold_m,
    )


def _by_map_alone(
    particles: ParticleOptions, rules: AlternativeRules
) -> tuple[ParticleOptions, AlternativeRules]:
    """Return the numbers, switch rule and odds where the map alone is the evidence."""
    rules = replace(rules, converge_log_odds=_CONVERGE_BY_MAP, map_nats_per_m=_NATS_PER_M_BY_MAP)
    particles = replace(
        particles,
        max_particles=_MORE_BY_MAP * particles.max_particles,
        min_search_particles=_MORE_BY_MAP * particles.min_search_particles,
        switch_mass=max(particles.switch_mass, _LEAST_MASS_BY_MAP),
        switch_hold_m=max(particles.switch_hold_m, _LEAST_HOLD_BY_MAP_M),
    )
    return particles, rules
