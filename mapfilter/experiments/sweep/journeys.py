"""The journeys of a sweep: routes with their truth and what is heard there, made once for many."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd

from mapfilter.evaluation.accuracy import Truth
from mapfilter.experiments.sweep.plan import AS_PREDICTED, Radio, Run, SweepPlan
from mapfilter.experiments.sweep.seeds import imu_rng, radio_rng, route_rng, walker_rng
from mapfilter.experiments.sweep.world import SweepWorld
from mapfilter.simulation.imu import noisy_motion
from mapfilter.simulation.journeys import journey
from mapfilter.simulation.reports import array_sampler, reports
from mapfilter.simulation.routes import route
from mapfilter.simulation.simulate import at_ticks
from mapfilter.tracks.log import TrackLog, make_log


def true_path(world: SweepWorld, plan: SweepPlan, number: int) -> pd.DataFrame:
    """Draw a route and return the truth of the journey along it.

    Raises
    ------
    InputError
        One cannot go as far as the plan wants.
    """
    settings = plan.journey
    rng = route_rng(plan.seed, number)
    along = route(world.network, settings.length_m, rng, leg_m=settings.leg_m)
    return journey(along, settings, walker_rng(plan.seed, number), world.inside)


def heard(
    world: SweepWorld,
    plan: SweepPlan,
    truth: pd.DataFrame,
    number: int,
    radio: Radio,
    report_period_s: float,
) -> TrackLog:
    """Return the log of a journey without its motion: what the phone reports, and the truth."""
    model = replace(
        plan.reports,
        period_s=report_period_s,
        radio="as_predicted" if radio.name == AS_PREDICTED else "reality",
    )
    levels = array_sampler(world.levels_dbm[radio.name], world.lattice)
    rng = radio_rng(plan.seed, number, radio, report_period_s)
    rows = reports(truth, levels, world.plan, model, rng)
    return make_log(world.network.crs, radio=rows, truth=truth)


def sensed(plan: SweepPlan, log: TrackLog, run: Run) -> TrackLog:
    """Return the log with a run's motion.

    What was checked once is not checked again for each run.
    """
    errors = run.noise.errors(plan.imu)
    ticks = at_ticks(log.truth, run.imu_period_s)
    return replace(log, motion=noisy_motion(ticks, errors, imu_rng(plan.seed, run)))


def truth_of(truth: pd.DataFrame) -> Truth:
    """Return the truth of a journey as scores take it."""
    east_m, north_m = (np.asarray(truth[name], np.float64) for name in ("east_m", "north_m"))
    return Truth(np.asarray(truth["time_s"], np.float64), east_m, north_m)
