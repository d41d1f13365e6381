"""Sweep filters over noise."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import fields
from functools import partial
from math import nan
from pathlib import Path
from typing import Any

from mapfilter._annotations import items_of
from mapfilter._arguments import (
    FUNCTION,
    Argument,
    Count,
    Entries,
    Setting,
    WholeNumber,
    check_arguments,
    executor_argument,
    items,
)
from mapfilter._parallel import Progress
from mapfilter.api.given import database_argument, opened
from mapfilter.api.journeys import (
    network_of,
    rasters_argument,
    reports_argument,
    roads_argument,
)
from mapfilter.api.python_words import python_words
from mapfilter.api.swept import Sweep
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.errors import ConfigError, Faults, fail
from mapfilter.experiments.sweep.noises import GYRO_ERRORS, NO_TURNS, NOISE_AXES
from mapfilter.experiments.sweep.plan import AS_PREDICTED, Radio, Reading, SweepPlan
from mapfilter.experiments.sweep.run import sweep_runs
from mapfilter.experiments.sweep.world import SweepWorld
from mapfilter.options import Positive
from mapfilter.positioning.candidate import CandidateFilter
from mapfilter.positioning.custom_filter import GivenFilter
from mapfilter.positioning.filter import Filter
from mapfilter.positioning.locators import given_options
from mapfilter.rasters.names import named_by_plan
from mapfilter.rasters.raster_set import RxLevRasters
from mapfilter.roads.osm import Profile
from mapfilter.roads.vector import Layer
from mapfilter.roads.ways import Ways
from mapfilter.simulation.journeys import JourneyPlan
from mapfilter.simulation.reports import ReportModel
from mapfilter.simulation.walking import WalkerModel
from mapfilter.tracks.imu_noise import ImuNoise

_FILTERS = 'names and options, such as {"mine": BayesFilter()}'


@python_words()
def sweep(
    database: RadioRouteDatabase | Path | str,
    rasters: RxLevRasters,
    roads: Layer | Ways,
    filters: Mapping[str, object],
    *,
    noises: Sequence[ImuNoise] | ImuNoise | None = None,
    routes: int = 10,
    draws: int = 1,
    length_m: float = 1940.0,
    reports: ReportModel | None = None,
    walker: WalkerModel | None = None,
    profile: Profile = "walking",
    seed: int = 0,
    executor: Executor | None = None,
    in_flight: int = 8,
    progress: Progress | None = None,
) -> Sweep:
    """Simulate many journeys with each noise, and locate each with every filter.

    Parameters
    ----------
    database : RadioRouteDatabase or path
    rasters : RxLevRasters
        The levels that the phone receives, with the handovers and fading of ``reports``.
    roads : path, GeoDataFrame or Ways
        As for :func:`simulate`.
    filters : mapping of str to options, a class, or the name of a filter
        Such as ``{"6 deg": BayesFilter(), "10 deg": BayesFilter(heading_sd_deg=10)}``. A custom
        filter is its class, or a function that makes it of a database, or the name of one,
        ``"my_module:MyFilter"``. Workers in processes of their own have to import it: one that is
        defined in a notebook runs in this process alone, also in its threads.
    noises : sequence of ImuNoise, or one, optional
        See :func:`mapfilter.experiments.sweep.noises.noise_grid` for all combinations. Errors of a
        gyro may differ only where a custom filter uses turns (``turns="gyro"``).
    routes, draws : int
        Routes, and runs on each of them with every noise.
    length_m : float
        Length of each route.
    reports, walker, profile : optional
        As for :func:`simulate`. Of drives, filters take the defaults of vehicles, as where
        :func:`locate` is given the log of a drive.
    seed : int
        Of routes and noise.
    executor : Executor, optional
        Does the runs, such as a ``ProcessPoolExecutor``; this process when left out.
    in_flight : int
        Batches that are handed out at once; twice the number of workers keeps all of them busy.
    progress : callable, optional
        Called with runs done and runs in all, such as ``print``.

    Raises
    ------
    InputError
        Database, rasters and roads differ in their CRS, or no route is as long as wanted.
    ConfigError
        An argument is none of these, or the seed is none.
    """
    several = (noises,) if isinstance(noises, ImuNoise) else () if noises is None else noises
    check_arguments(
        "sweep",
        database_argument(database),
        rasters_argument(rasters),
        roads_argument(roads),
        Entries("filters", filters, object, "options", _FILTERS, optional=False),
        keywords=[
            *items("noises", several, ImuNoise, "ImuNoise"),
            Setting("routes", routes, Count),
            Setting("draws", draws, Count),
            Setting("length_m", length_m, Positive),
            reports_argument(reports),
            Argument("walker", walker, WalkerModel | None, "WalkerModel"),
            Setting("profile", profile, Profile),
            Setting("seed", seed, WholeNumber),
            executor_argument(executor),
            Setting("in_flight", in_flight, Count),
            Argument("progress", progress, FUNCTION, "a function"),
        ],
    )
    database = opened(database)
    reports = reports or ReportModel()
    radio = Radio() if reports.radio == AS_PREDICTED else Radio("ground truth", nan)
    journey = JourneyPlan(length_m=length_m, profile=profile, walker=walker or WalkerModel())
    here = executor is None or isinstance(executor, ThreadPoolExecutor)
    readings = _readings(filters, here=here)
    plans = [
        SweepPlan(
            readings,
            noises=(noise,),
            radios=(radio,),
            report_periods_s=(reports.report_period_s,),
            imu_periods_s=(noise.period_s,),
            routes=routes,
            draws=draws,
            journey=journey,
            reports=reports,
            seed=seed,
            varied=varied,
        )
        for noise, varied in _distinguished(items_of(several) or [ImuNoise()])
    ]
    _check_turns(plans)
    network = network_of(roads, rasters, profile)
    named = named_by_plan(rasters, database.plan)
    world = SweepWorld.of(network, database.plan, {radio.name: named})
    runs = sweep_runs(
        plans,
        world,
        {"database": database},
        executor=executor,
        in_flight=in_flight,
        progress=progress,
    )
    return Sweep(runs)


def _readings(filters: Mapping[str, Any], *, here: bool) -> tuple[Reading, ...]:
    """Return the filters of a sweep; ``here`` is whether this process alone runs them."""
    faults = Faults()
    found = []
    if not filters:
        faults.add("sweep, filters", f"at least one, {_FILTERS}", "none")
    for name, given in filters.items():
        options = given_options(given)
        if isinstance(options, type) or not hasattr(options, "over"):
            wrong = _not_a_filter(options, here=here)
            if wrong is not None:
                faults.add(f"filters, {name}", *wrong)
                continue
            options = GivenFilter(options)
        own_m = options.update_length_m if isinstance(options, CandidateFilter) else nan
        found.append(Reading(name, options, float(own_m)))
    faults.raise_if_any(ConfigError)
    return tuple(found)


def _not_a_filter(given: Any, *, here: bool) -> tuple[str, str, str] | None:
    """Return what was expected and given, and the likely mistake, of what makes no filter."""
    if not callable(given):
        own = type(given)
        made = callable(getattr(given, "locate", getattr(given, "step", None)))
        hint = f"its class, {own.__name__}, which is called with the database" if made else ""
        if isinstance(given, Filter) and given.made_of is not None:
            hint = f"its options, {type(given.made_of).__name__}(…)"
        return "options, a class, or the name of a filter", own.__name__, hint
    if here:
        return None
    while isinstance(given, partial):
        given = given.func
    module, kind = getattr(given, "__module__", "__main__"), getattr(given, "__qualname__", "")
    found = None if module == "__main__" else sys.modules.get(module)
    for part in kind.split("."):
        found = getattr(found, part, None)
    if found is given:
        return None
    kind = getattr(given, "__name__", type(given).__name__)
    expected = "a filter that the workers of an executor can import"
    hint = "put it into a file of its own, or leave the executor out"
    return expected, f"{kind} of this notebook or program", hint


def _distinguished(
    noises: Sequence[ImuNoise],
) -> list[tuple[ImuNoise, tuple[tuple[str, float], ...]]]:
    """Return each noise with the values of those fields that the table has no column for."""
    if len(set(noises)) < len(noises):
        again = next(repr(noise) for noise in noises if list(noises).count(noise) > 1)
        raise fail(ConfigError, "noises", "one noise or several, each once", again)
    other = [
        field.name
        for field in fields(ImuNoise)
        if field.name not in ("period_s", *NOISE_AXES)
        and len({getattr(n, field.name) for n in noises}) > 1
    ]
    for name in other:
        if not all(isinstance(getattr(noise, name), int | float) for noise in noises):
            hint = "one sweep for each value"
            raise fail(ConfigError, f"noises, {name}", "one value for all", "several", hint)
    return [
        (noise, tuple((f"imu.{name}", float(getattr(noise, name))) for name in other))
        for noise in noises
    ]


def _check_turns(plans: Sequence[SweepPlan]) -> None:
    """Refuse errors of turns in which noises differ, and which no filter uses."""
    faults = Faults()
    for name in GYRO_ERRORS:
        given, used = (
            {getattr(noise, name) for plan in group for noise in plan.noises}
            for group in (plans, [plan.effective for plan in plans])
        )
        if len(given) > 1 and given != used:
            faults.add(f"noises, {name}", "one value for all", "one without effect", NO_TURNS)
    faults.raise_if_any(ConfigError)
