"""Journeys of a sweep: routes with their truth and received levels, simulated once for many runs.

Random streams are named by names and values, not by places in the grid: another row, another order,
another number of runs change no run that was there before. All filters and databases see the same
logs.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd

from mapfilter.evaluation.truth import Truth
from mapfilter.experiments.sweep.plan import AS_PREDICTED, Radio, Run, SweepPlan
from mapfilter.experiments.sweep.world import SweepWorld
from mapfilter.propagation.shadowing import named_rng
from mapfilter.simulation.imu import noisy_motion
from mapfilter.simulation.journeys import journey
from mapfilter.simulation.level_samplers import array_sampler
from mapfilter.simulation.reports import reports
from mapfilter.simulation.routes import route
from mapfilter.simulation.simulate import at_ticks
from mapfilter.tracks.log import TrackLog, make_log


def route_rng(seed: int, route: int) -> np.random.Generator:
    """Return the generator of a route."""
    return named_rng(seed, "route", str(route))


def radio_rng(seed: int, route: int, radio: Radio, report_period_s: float) -> np.random.Generator:
    """Return the generator of what a phone measures along a route: once, as one measures once."""
    return named_rng(seed, "radio", str(route), radio.stream, _value(report_period_s))


def imu_rng(seed: int, run: Run) -> np.random.Generator:
    """Return the generator of a run's inertial unit: of its noise, not of filter and database."""
    values = (*run.noises, run.imu_period_s)
    return named_rng(seed, "imu", str(run.route), str(run.draw), *map(_value, values))


def filter_rng(seed: int, run: Run) -> np.random.Generator:
    """Return the generator of a run's filter."""
    reading = run.reading
    names = run.radio.stream, run.database, reading.name
    values = reading.update_length_m, run.report_period_s, run.imu_period_s, *run.noises
    return named_rng(seed, "filter", str(run.route), str(run.draw), *names, *map(_value, values))


def _value(number: float) -> str:
    # Minus zero is zero, and 3 is 3.0.
    return repr(float(number) + 0.0)


def true_path(world: SweepWorld, plan: SweepPlan, number: int) -> pd.DataFrame:
    """Draw a route and return the truth of the journey along it."""
    settings, seed = plan.journey, plan.seed
    rng = route_rng(seed, number)
    along = route(world.network, settings.length_m, rng, leg_m=settings.leg_m)
    return journey(along, settings, named_rng(seed, "walker", str(number)), world.inside)


def radio_log(
    world: SweepWorld,
    plan: SweepPlan,
    truth: pd.DataFrame,
    number: int,
    radio: Radio,
    report_period_s: float,
) -> TrackLog:
    """Return the log of a journey without its motion: what the phone reports, and the truth.

    A drive is stated to be a vehicle's, as by :mod:`mapfilter.simulation.simulate`.
    """
    model = replace(
        plan.reports,
        report_period_s=report_period_s,
        radio="as_predicted" if radio.name == AS_PREDICTED else "ground_truth",
    )
    levels = array_sampler(world.levels_dbm[radio.name], world.lattice)
    rng = radio_rng(plan.seed, number, radio, report_period_s)
    rows = reports(truth, levels, world.plan, model, rng)
    driven = plan.journey.profile == "driving" or None
    return make_log(world.network.crs, radio=rows, truth=truth, vehicle=driven)


def sensed(plan: SweepPlan, log: TrackLog, run: Run) -> TrackLog:
    """Return the log with a run's motion.

    What was checked once is not checked again for each run.
    """
    ticks = at_ticks(log.truth, run.imu_period_s)
    return replace(log, motion=noisy_motion(ticks, run.noise, imu_rng(plan.seed, run)))


def truth_of(truth: pd.DataFrame) -> Truth:
    """Return the truth of a journey as scores take it."""
    return Truth(*(np.asarray(truth[name], np.float64) for name in ("time_s", "east_m", "north_m")))
