"""Runs in the plain and the easy world: walks, logs, ground truths, filters."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from mapfilter.experiments.benchmarks.cases import CASES, Case
from mapfilter.experiments.benchmarks.journeys import (
    Walk,
    displaced_walk,
    log_of,
    spoofer_of,
    walk,
    with_satellites,
)
from mapfilter.experiments.benchmarks.world import BenchmarkWorld
from mapfilter.experiments.sweep.world import SweepWorld
from mapfilter.positioning.filter import Filter, FilterOptions
from mapfilter.propagation.shadowing import named_rng
from mapfilter.simulation.level_samplers import Levels
from mapfilter.tracks.log import TrackLog


@dataclass(frozen=True)
class PlainCity:
    """A plain or easy world with the seed of its routes, ground truths and noise."""

    world: BenchmarkWorld
    seed: int

    @property
    def sha256(self) -> str:
        """Of the world."""
        return self.world.sha256

    @property
    def streets(self) -> SweepWorld:
        """Streets and cells."""
        return self.world.streets

    def case(self, name: str) -> Case:
        """Return a case by its name."""
        return CASES[name]

    def on_route(self, route: int, fixed: frozenset[str] = frozenset()) -> PlainRuns:
        """Return the runs of all cases on one route and in one ground truth."""
        return PlainRuns(self, route, fixed)


class PlainRuns:
    """The runs of all cases on one route and in one ground truth.

    Parameters
    ----------
    route : int
        Its number.
    fixed : frozenset of str
        Errors that were set for all cases.
    """

    def __init__(self, city: PlainCity, route: int, fixed: frozenset[str]) -> None:
        self.world, self.seed, self.route, self.fixed = city.world, city.seed, route, fixed
        self._truths: dict[float | None, Levels] = {}

    def run(self, case: Case) -> tuple[Walk, TrackLog]:
        """Return truth and log of a case."""
        world, seed, route = self.world, self.seed, self.route
        streets, settings = world.streets, world.settings
        make = displaced_walk if case.recovery_within_m > 0 else walk
        walked = make(streets, settings.journey, seed, route)
        log = log_of(case, walked, self._levels(case), streets, settings, seed, route, self.fixed)
        skyline = world.skyline(case)
        return walked, with_satellites(case, log, walked, skyline, seed, route, world.reception)

    def filter(self, choice: FilterOptions, case: Case) -> Filter[Any]:
        """Return the filter over the database that a case is given."""
        return self.world.filter(choice, thinned=case.missing_ways > 0)

    def window_from_s(self, case: Case, walked: Walk) -> float | None:
        """Return from when on the errors about a spoofer are looked at, with satellites."""
        if case.satellites is None:
            return None
        return spoofer_of(walked, self.seed, self.route).from_s

    def _levels(self, case: Case) -> Levels:
        error_db = None if "level_error_db" in self.fixed else case.level_error_db
        if error_db not in self._truths:
            rng = named_rng(self.seed, "ground truth", str(self.route))
            truth_seed = int(rng.integers(2**62))
            self._truths[error_db] = self.world.ground_truth(truth_seed, error_db)
        return self._truths[error_db]
