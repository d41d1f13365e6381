"""Options of the Bayes map filter."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from functools import partial
from math import radians
from typing import Annotated, Any

from annotated_types import Ge, Gt, Le

from mapfilter._device import DeviceName, open_device
from mapfilter._threads import Threads
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.errors import Faults
from mapfilter.filters.particle import ParticleOptions
from mapfilter.models.level_errors import LevelErrors
from mapfilter.models.street_motion import MotionErrors
from mapfilter.models.way_map import MapWeights
from mapfilter.options import Below1, NotNegative, Options, Positive, Probability
from mapfilter.positioning.bayes.alternative import AlternativeRules
from mapfilter.positioning.bayes.area_frame import AreaFrame
from mapfilter.positioning.bayes.area_map import AreaMap
from mapfilter.positioning.bayes.carriageways import carriageway_filters
from mapfilter.positioning.bayes.evidence_options import EvidenceOptions
from mapfilter.positioning.bayes.filter import BayesPositioner
from mapfilter.positioning.bayes.hold_rules import HoldRules, PullRules
from mapfilter.positioning.bayes.maker import Maker, made_over_area
from mapfilter.positioning.bayes.model import BayesModel
from mapfilter.positioning.bayes.opened_area import open_area
from mapfilter.positioning.bayes.over_survey import (
    SURVEYED,
    SURVEYED_WAYS,
    filled_field,
    over_measured,
)
from mapfilter.positioning.gnss.options import GnssOptions, TimingOptions

_SLOW, _FAST, _WHITE = 7.0, 4.0, 3.3
_TOTAL_DB = (_SLOW**2 + _FAST**2 + _WHITE**2) ** 0.5
_FAST_OF_SLOW_M = 0.1

VEHICLE: Mapping[str, float] = {
    "step_sd_m": 0.05,
    "heading_sd_deg": 1.5,
    "drift_deg_per_sqrt_m": 0.25,
    "scale": 0.02,
    "off_cost_per_m": 0.15,
}
"""Defaults of vehicles, where they differ."""
_VEHICLE_MOTION: Mapping[str, float] = {
    "disturbances_per_m": 0.0,
    "remounts_per_m": 0.0,
    "rate_rad_per_m": radians(0.01),
    "stretch_sd": 0.02,
    "corners_per_m": 1 / 20,
}
_VEHICLE_LEAVES_PER_M = 3e-4

_MORE_BY_MAP = 3
_LEAST_MASS_BY_MAP, _LEAST_HOLD_BY_MAP_M = 0.998, 200.0
_CONVERGE_BY_MAP, _NATS_PER_M_BY_MAP = -8.0, 0.03
"""Where the map alone is the evidence: factor of the numbers of particles; least mass and distance
of the switch rule; largest log odds of the null hypothesis, its cost of a metre."""

Particles = Annotated[int, Ge(10), Le(10_000_000)]


@dataclass(frozen=True, slots=True)
class BayesFilter(Options):
    """The Bayes map filter: a particle filter over streets, serving cells and levels.

    What it assumes of errors need not be what they are: a noise that is taken too large costs some
    metres until the filter has converged, one taken too small costs wrong positions. The defaults
    are for a phone without a data sheet.

    Parameters
    ----------
    vehicle : bool or None
        Dead reckoning is that of a vehicle (wheels, camera, lidar), which keeps to ways: errors of
        motion and weights of the map that have their defaults are those of vehicles. None: where
        motion has turns, no headings, and a vehicle's speed.
    step_sd_m : float
        Assumed deviation of a step's length.
    heading_sd_deg : float
        Assumed deviation of a heading: of errors that last for tens of metres, and white noise.
    bias_sd_deg : float
        Assumed deviation of the journey's constant heading error.
    drift_deg_per_sqrt_m : float
        Assumed random walk of the heading error, by distance.
    scale : float
        Assumed deviation of the journey's step scale.
    map_sd_m : float
        Deviation of positions from the edges of ways, beside them.
    map_weight_per_m : float
        Weight of the map for each metre travelled.
    off_cost_per_m : float
        Log-likelihood that a hypothesis off the map loses with each metre.
    levels : bool
        Whether levels are used, or serving cells only.
    level_error_db : float
        Assumed deviation of levels from the prediction.
    level_correlation_m : float
        Distance over which most of such an error is correlated by 1/e.
    device_error_db : float
        Assumed deviation of the error that the device adds to all levels.
    fault_probability : float
        Assumed share of cells that the prediction is wrong about: off, moved, rotated.
    level_weight : float
        Exponent of the likelihood of levels.
    report_spacing_m : float
        Distance travelled between two reports that are used.
    max_particles : int
        Most particles.
    min_search_particles : int
        Least number of particles until the filter has converged.
    min_particles : int
        Least number of particles afterwards.
    switch_mass : float
        Share of the belief within 50 m of the leading hypothesis from which on the filter has
        converged.
    switch_hold_m : float
        Distance travelled for which that must hold.
    smooth : bool
        Whether positions are smoothed by the whole log (backward simulation).
    satellite_sd_m : float
        Assumed white noise of a pseudorange at the zenith, where a log gives no deviation.
    antenna_height_m : float
        Assumed height of the antenna above the ellipsoid, before anything is measured.
    antenna_height_sd_m : float
        Its assumed deviation.
    timing_step_m : float
        Distance of a step of timing advance: 553.5 m in GSM, 78.1 m in LTE.
    timing_sd_m : float
        Assumed deviation of a timing advance besides its rounding.
    threads : int
        Threads that a step of 32 768 particles or more is divided among, 1 to 64; with fewer
        particles, in worker processes and on a grid it is not. Results do not depend on it.
    """

    vehicle: bool | None = None
    step_sd_m: NotNegative = 0.3
    heading_sd_deg: NotNegative = 15.0
    bias_sd_deg: NotNegative = 10.0
    drift_deg_per_sqrt_m: NotNegative = 0.3
    scale: Below1 = 0.03
    map_sd_m: Positive = 3.0
    map_weight_per_m: NotNegative = 1 / 12
    off_cost_per_m: NotNegative = 0.04
    levels: bool = True
    level_error_db: Positive = 8.7
    level_correlation_m: Positive = 200.0
    device_error_db: NotNegative = 5.0
    fault_probability: Probability = 0.06
    level_weight: Annotated[float, Gt(0), Le(1)] = 0.35
    report_spacing_m: NotNegative = 5.0
    max_particles: Annotated[int, Ge(100), Le(10_000_000)] = 20_000
    min_search_particles: Particles = 12_000
    min_particles: Particles = 3000
    switch_mass: Probability = 0.995
    switch_hold_m: NotNegative = 20.0
    smooth: bool = False
    satellite_sd_m: Positive = 2.0
    antenna_height_m: Annotated[float, Ge(-1e4), Le(1e4)] = 100.0
    antenna_height_sd_m: NotNegative = 200.0
    timing_step_m: Positive = 553.5
    timing_sd_m: Positive = 200.0
    threads: Annotated[int, Ge(1), Le(64)] = 1

    def check(self, faults: Faults) -> None:
        """Add a least number of particles above the largest."""
        if self.min_particles > self.max_particles:
            where = f"{type(self).__name__}, min_particles and max_particles"
            found = f"{self.min_particles} and {self.max_particles}"
            faults.add(where, "min_particles <= max_particles", found)

    @property
    def name(self) -> str:
        """The filter's name."""
        return "bayes"

    def over(self, database: RadioRouteDatabase, *, ways: bool = True) -> BayesPositioner:  # noqa: ARG002
        """Return the filter over the area of a database, which is read as a whole, or by tiles.

        Over surveyed levels, options that have their defaults are those of measured maps
        (:mod:`mapfilter.positioning.bayes.over_survey`).
        """
        measured = database.measured()
        if measured is None:
            return self.over_area(open_area(database, whole=self.name == "grid"))
        roles = {one["role"] for one in database.manifest["inputs"]}
        tracks = "tracks" in roles and not roles & {"map", "roads"}
        usual = {**SURVEYED, **(SURVEYED_WAYS if tracks else {})}
        field = filled_field(database.field(), measured)
        area = AreaMap.of_field(field, database.plan, database.floor_dbm)
        return over_measured(area, usual, database, measured, self)

    @property
    def resolved(self) -> BayesFilter:
        """Options with the defaults of vehicles in place of those of walkers, where asked for."""
        return self.with_usual(VEHICLE) if self.vehicle else self

    def with_usual(self, usual: Mapping[str, float]) -> BayesFilter:
        """Return options in which other values are taken for those that have their defaults.

        Parameters
        ----------
        usual : mapping of str to float
            By the names of options.
        """
        default = {one.name: one.default for one in fields(self)}
        taken: dict[str, Any] = {
            name: value for name, value in usual.items() if getattr(self, name) == default[name]
        }
        return replace(self, **taken)

    def over_area(self, area: AreaFrame) -> BayesPositioner:
        """Return the filter over an area."""
        maker = Maker(self, partial(made_over_area, area))
        return replace(self.resolved._over_area(area), maker=maker)

    def _over_area(self, area: AreaFrame) -> BayesPositioner:
        motion = MotionErrors(
            step_sd_m=self.step_sd_m,
            heading_sd_rad=radians(self.heading_sd_deg),
            bias_sd_rad=radians(self.bias_sd_deg),
            bias_drift_rad_per_sqrt_m=radians(self.drift_deg_per_sqrt_m),
            scale_sd=self.scale,
        )
        # Disturbances are part of the headings' errors: with small ones large jumps are rarer.
        usual = MotionErrors()
        times = motion.heading_sd_rad / usual.heading_sd_rad
        motion = replace(motion, disturbances_per_m=times * usual.disturbances_per_m)
        weights = MapWeights(self.map_sd_m, self.map_weight_per_m, self.off_cost_per_m)
        if self.vehicle:
            motion = replace(motion, **_VEHICLE_MOTION)
            weights = replace(weights, leave_per_m=_VEHICLE_LEAVES_PER_M)
        share = self.level_error_db / _TOTAL_DB
        levels = LevelErrors(
            slow_db=share * _SLOW,
            slow_m=self.level_correlation_m,
            fast_db=share * _FAST,
            fast_m=_FAST_OF_SLOW_M * self.level_correlation_m,
            white_db=share * _WHITE,
            device_db=self.device_error_db,
            fault_probability=self.fault_probability,
            weight=self.level_weight,
        )
        evidence = EvidenceOptions(
            levels=levels, spacing_m=self.report_spacing_m, use_levels=self.levels
        )
        particles = ParticleOptions(
            max_particles=self.max_particles,
            min_search_particles=self.min_search_particles,
            min_particles=self.min_particles,
            switch_mass=self.switch_mass,
            switch_hold_m=self.switch_hold_m,
        )
        rules = AlternativeRules()
        rules = replace(rules, claimed_from=min(rules.claimed_from, self.switch_mass))
        positioned, carriageways = None, None
        threads = Threads(self.threads)
        model = BayesModel(area, motion, weights, evidence=evidence, threads=threads)
        if not area.cell_ids:
            positioned = particles, rules
            rules = replace(
                rules,
                converge_log_odds=_CONVERGE_BY_MAP,
                map_nats_per_m=_NATS_PER_M_BY_MAP,
            )
            particles = replace(
                particles,
                max_particles=_MORE_BY_MAP * self.max_particles,
                min_search_particles=_MORE_BY_MAP * self.min_search_particles,
                switch_mass=max(self.switch_mass, _LEAST_MASS_BY_MAP),
                switch_hold_m=max(self.switch_hold_m, _LEAST_HOLD_BY_MAP_M),
            )
            if self.vehicle:
                carriageways = carriageway_filters(model, particles, rules, positioned[0])
        satellites = GnssOptions(
            zenith_m=self.satellite_sd_m,
            height_m=self.antenna_height_m,
            height_sd_m=self.antenna_height_sd_m,
        )
        return BayesPositioner(
            model,
            particles,
            rules,
            grid=self.name == "grid",
            satellites=satellites,
            timing=TimingOptions(step_m=self.timing_step_m, advance_sd_m=self.timing_sd_m),
            smooth=self.smooth,
            positioned=positioned,
            carriageways=carriageways,
            # A vehicle's compass is screwed on; without cells any street may go straight on.
            holds=HoldRules(watched=bool(area.cell_ids) and not self.vehicle),
            # By ways alone a belief without positions goes astray sooner than they do.
            pulls=PullRules(watched=bool(area.cell_ids)),
        )


@dataclass(frozen=True, slots=True)
class GridFilter(BayesFilter):
    """The exact Bayes filter on the lattice in place of particles, without the step scale.

    It takes about 60 times as long as particles: half a minute for a walk of 1.5 km in a town
    centre of a square kilometre.

    Parameters are those of :class:`BayesFilter`, and:

    Parameters
    ----------
    device : {"cpu", "gpu"}
        Where the filter computes: ``gpu`` is a graphics processor with CUDA, which needs the extra
        ``gpu``.
    """

    device: DeviceName = "cpu"

    @property
    def name(self) -> str:
        """The filter's name."""
        return "grid"

    def _over_area(self, area: AreaFrame) -> BayesPositioner:
        device = open_device(self.device, "filter.grid.device")
        # Without arguments super() does not work in a dataclass with slots.
        return replace(BayesFilter._over_area(self, area), device=device)
