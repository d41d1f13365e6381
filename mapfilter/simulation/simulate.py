"""Whole journeys: a route, its ground truth, and logs of the inertial unit and the phone."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
import pandas as pd

from mapfilter._same import EqualByValue
from mapfilter.errors import ConfigError, Faults, InputError, fail
from mapfilter.geodesy import same_crs, shown_crs
from mapfilter.radio.cells import CellPlan
from mapfilter.rasters.raster_set import RxLevRasters
from mapfilter.roads.network import StreetNetwork
from mapfilter.simulation.imu import noisy_motion
from mapfilter.simulation.journeys import JourneyPlan, journey, ticks_s
from mapfilter.simulation.level_samplers import Levels, level_sampler
from mapfilter.simulation.reports import ReportModel, reports
from mapfilter.simulation.routes import route
from mapfilter.simulation.walking import Inside
from mapfilter.tracks.imu_noise import ImuNoise
from mapfilter.tracks.log import TrackLog, make_log

_ROUTE, _IMU, _RADIO, _WALKER = range(4)
_MOST_TICKS = 10_000_000


@dataclass(frozen=True, slots=True, eq=False)
class SimulationSettings(EqualByValue):
    """Number, motion and sensors of simulated journeys.

    Parameters
    ----------
    journeys : int
        Different routes.
    draws : int
        Logs for each route, which differ in noise only.
    start_utc_s : float
        When every journey starts, UTC seconds; NaN, the default, where that does not matter.

    Raises
    ------
    ConfigError
        There are no journeys or no draws, or a journey would have more than ten million ticks.
    """

    journeys: int = 1
    draws: int = 1
    journey: JourneyPlan = field(default_factory=JourneyPlan)
    imu: ImuNoise = field(default_factory=ImuNoise)
    reports: ReportModel = field(default_factory=ReportModel)
    start_utc_s: float = float("nan")

    def __post_init__(self) -> None:
        for name in ("journeys", "draws"):
            if getattr(self, name) < 1:
                raise fail(ConfigError, f"journeys, {name}", "at least 1", getattr(self, name))
        journey, faults = self.journey, Faults()
        # Drivers are sampled at every metre.
        speed_mps = journey.speed_mps if journey.profile == "walking" else 1.0
        for name, period_s in (
            ("journeys, period_s", journey.period_s),
            ("imu, period_s", self.imu.period_s),
            ("journeys, report_period_s", self.reports.report_period_s),
        ):
            ticks = journey.length_m / speed_mps / period_s
            if ticks > _MOST_TICKS:
                expected = f"at most {_MOST_TICKS:.0e} times per journey"
                got = f"{ticks:.1e}: {journey.length_m:g} m at {speed_mps:g} m/s every"
                faults.add(name, expected, f"{got} {period_s:g} s", "a wrong unit")
        faults.raise_if_any(ConfigError)


def simulate_journeys(
    network: StreetNetwork,
    levels: Levels | RxLevRasters,
    plan: CellPlan,
    settings: SimulationSettings | None = None,
    seed: int = 0,
    inside: Inside | None = None,
) -> Iterator[tuple[str, TrackLog]]:
    """Simulate journeys one after another.

    The randomness of route, inertial unit and radio comes from (seed, journey, draw) apart from
    each other: more journeys or draws, or another noise, change no other journey.

    Parameters
    ----------
    levels : RxLevRasters or callable
        The true levels: rasters, or a function from positions to levels in the plan's order, as
        :func:`mapfilter.simulation.level_samplers.level_sampler` returns it.
    plan : CellPlan
        In the network's CRS.
    settings : SimulationSettings, optional
        Journeys, dead reckoning and reports.
    seed : int
        Not negative.
    inside : callable, optional
        Where buildings keep walkers off the pavement, see
        :func:`mapfilter.simulation.walking.inside_buildings`.

    Yields
    ------
    name : str
        Such as ``journey-0003-draw-000``; names sort in the order of the journeys.
    log : TrackLog
        With its truth; of the profile "driving" it states that a vehicle moved.

    Raises
    ------
    InputError
        Rasters, plan and network differ in their CRS, or no route is as long as wanted.
    """
    settings = settings or SimulationSettings()
    if not same_crs(plan.crs, network.crs):
        expected = f"the streets' {shown_crs(network.crs)}"
        raise fail(InputError, "cell plan, crs", expected, shown_crs(plan.crs))
    if isinstance(levels, RxLevRasters):
        if not same_crs(levels.lattice.crs, network.crs):
            expected = f"the rasters' {shown_crs(levels.lattice.crs)}"
            raise fail(InputError, "streets, crs", expected, shown_crs(network.crs))
        levels = level_sampler(levels, plan.ids, plan=plan)
    walk, leg_m = settings.journey, settings.journey.leg_m
    for j in range(settings.journeys):
        along = route(network, walk.length_m, _rng(seed, _ROUTE, j), leg_m=leg_m)
        for d in range(settings.draws):
            # All draws of a route are the same walk.
            truth = journey(along, walk, _rng(seed, _WALKER, j), inside)
            rngs = _rng(seed, _IMU, j, d), _rng(seed, _RADIO, j, d)
            log = simulate_log(network.crs, truth, levels, plan, settings, *rngs)
            yield f"journey-{j:04d}-draw-{d:03d}", log


def simulate_log(
    crs: str,
    truth: pd.DataFrame,
    levels: Levels,
    plan: CellPlan,
    settings: SimulationSettings,
    imu_rng: np.random.Generator,
    radio_rng: np.random.Generator,
) -> TrackLog:
    """Make the log of one journey; arguments as of :func:`simulate_journeys`.

    A drive is stated to be a vehicle's (``log.vehicle``).
    """
    return make_log(
        crs,
        motion=noisy_motion(at_ticks(truth, settings.imu.period_s), settings.imu, imu_rng),
        radio=reports(truth, levels, plan, settings.reports, radio_rng),
        truth=truth,
        start_utc_s=settings.start_utc_s,
        vehicle=True if settings.journey.profile == "driving" else None,
    )


def at_ticks(truth: pd.DataFrame, period_s: float) -> pd.DataFrame:
    """Return the true positions at the unit's ticks, from the start on."""
    time_s = truth["time_s"].to_numpy()
    tick_s = ticks_s(time_s, period_s)
    there = {name: np.interp(tick_s, time_s, truth[name]) for name in ("east_m", "north_m")}
    return pd.DataFrame({"time_s": tick_s, **there})


def _rng(seed: int, *key: int) -> np.random.Generator:
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=key))
