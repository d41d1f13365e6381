"""Options of the Bayes map filter."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from functools import partial
from typing import Annotated, Any

from annotated_types import Ge, Gt, Le

from mapfilter._device import PROCESSOR, Device, DeviceName, open_device
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.errors import Faults
from mapfilter.options import Below1, NotNegative, Options, Positive, Probability
from mapfilter.positioning.bayes.area.area_frame import AreaFrame
from mapfilter.positioning.bayes.area.area_map import AreaMap
from mapfilter.positioning.bayes.area.opened_area import open_area
from mapfilter.positioning.bayes.assembly import assembled
from mapfilter.positioning.bayes.filter import BayesPositioner
from mapfilter.positioning.bayes.maker import Maker, made_over_area
from mapfilter.positioning.bayes.over_survey import (
    SURVEYED,
    SURVEYED_WAYS,
    filled_field,
    over_measured,
)
from mapfilter.positioning.filter import check_over

VEHICLE: Mapping[str, float] = {
    "step_sd_m": 0.05,
    "heading_sd_deg": 1.5,
    "drift_deg_per_sqrt_m": 0.25,
    "scale": 0.02,
    "off_cost_per_m": 0.15,
}
"""Defaults of vehicles, where they differ."""

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
    claim_mass : float
        Least probability that a tracked position is right within 50 m with which it is claimed, as
        TRACKING; with less it is UNCERTAIN.
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
    claim_mass: Probability = 0.998
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
        check_over(self, database)
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
        return replace(assembled(self.resolved, area), maker=maker)

    def opened_device(self) -> Device:
        """Return the device that the filter computes on: the processor."""
        return PROCESSOR


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

    def opened_device(self) -> Device:
        """Return the device that the filter computes on, as it is asked for.

        Raises
        ------
        ConfigError
            There is none, or what computes on it is not installed.
        """
        return open_device(self.device, "filter.grid.device")
