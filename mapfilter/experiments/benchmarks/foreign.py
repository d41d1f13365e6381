"""Runs in the foreign, harsh and sensors worlds: walks, logs, and the databases given."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from mapfilter._io import sha256_file
from mapfilter._types import Floats
from mapfilter.experiments.benchmarks.journeys import Walk
from mapfilter.experiments.benchmarks.world_cases import CASES_OF, OtherWorld, WorldCase
from mapfilter.experiments.sweep.world import SweepWorld, open_world, opened_filter
from mapfilter.positioning.filter import Filter, FilterOptions
from mapfilter.propagation.shadowing import named_rng
from mapfilter.simulation.worlds.faults import GivenInputs, given_inputs
from mapfilter.simulation.worlds.inertial import motion_table
from mapfilter.simulation.worlds.open_ground import OpenGround
from mapfilter.simulation.worlds.other_city import (
    AWAY_M,
    dealt_anew,
    mirrored_ground,
    mirrored_heights,
    mirrored_network,
)
from mapfilter.simulation.worlds.phone import report_table
from mapfilter.simulation.worlds.radio import Radio, RadioModel
from mapfilter.simulation.worlds.sensor_faults import faulty_log
from mapfilter.simulation.worlds.street_lines import StreetLines
from mapfilter.simulation.worlds.walkers import PedestrianModel, PedestrianWalk, pedestrian_walk
from mapfilter.tracks.log import TrackLog, make_log

STREETS, GROUND = "streets", "ground.npz"
VARIANTS = 3
"""How many cities with a fault there are for each; run n takes the n-th of them, in turn."""


def database_name(fault: str | None, variant: int) -> str:
    """Return the folder of the database that is given under a fault."""
    return "database" if fault is None else f"database-{fault}-{variant}"


@dataclass(frozen=True)
class ForeignWorld:
    """A city on disk, as it is received, and the databases that are given of it.

    Parameters
    ----------
    name : {"foreign", "harsh", "sensors"}
    folder : Path
        Holds streets, open ground, and one database for each fault and variant.
    seed : int
        Of the benchmark.
    radio : RadioModel
    offsets_db : tuple of float
        See :class:`mapfilter.simulation.worlds.radio.Radio`.
    length_m : float or None
        Of the walks, in place of that of the cases.
    databases : tuple of str
        Folders of the databases by which worlds are told apart: that without faults, and the first
        variant of each fault.
    """

    name: OtherWorld
    folder: Path
    seed: int
    radio: RadioModel = field(default_factory=RadioModel)
    offsets_db: tuple[float, float] = (0.0, 0.0)
    length_m: float | None = None
    databases: tuple[str, ...] = ("database",)

    @property
    def sha256(self) -> str:
        """Of streets, ground and databases, and of all that is simulated."""
        parts = [f"{STREETS}/world.json", GROUND]
        parts += [f"{name}/manifest.json" for name in self.databases]
        drawn = [sha256_file(self.folder / part) for part in parts]
        simulated = map(repr, (self.radio, self.offsets_db, self.length_m, CASES_OF[self.name]))
        return hashlib.sha256("".join((*drawn, *simulated)).encode()).hexdigest()

    @property
    def city(self) -> City:
        """Streets, cells, buildings and open ground."""
        streets, ground = self.folder / STREETS, self.folder / GROUND
        return _city(streets, ground, sha256_file(streets / "world.json") + sha256_file(ground))

    @property
    def streets(self) -> SweepWorld:
        """Streets and cells."""
        return self.city.streets

    def case(self, name: str) -> WorldCase:
        """Return a case of the world by its name."""
        return CASES_OF[self.name][name]

    def on_route(self, route: int, fixed: frozenset[str] = frozenset()) -> RouteRuns:  # noqa: ARG002
        """Return the runs of all cases on a route; the world takes no settings of errors."""
        return RouteRuns(self, route)

    def given(self, case: WorldCase, route: int) -> GivenInputs:
        """Return what the filter is given in a run of a case."""
        city = self.city.streets
        return given_inputs(case.fault, city.plan, city.lattice, self.seed, route % VARIANTS)

    def filter(self, choice: FilterOptions, case: WorldCase, route: int) -> Filter[Any]:
        """Return the filter over the database that is given in a run of a case."""
        folder = self.folder / database_name(case.fault, route % VARIANTS)
        return opened_filter(folder, sha256_file(folder / "manifest.json"), choice)


@dataclass(frozen=True, eq=False)
class City:
    """The parts of a city that journeys need."""

    streets: SweepWorld
    ground: OpenGround

    @cached_property
    def lines(self) -> StreetLines:
        """The centre lines."""
        return StreetLines(self.streets.network)

    def mirrored(self, rng: np.random.Generator) -> City:
        """Return another city, see :mod:`mapfilter.simulation.worlds.other_city`."""
        own = self.streets
        other = replace(
            own,
            network=mirrored_network(own.network, own.lattice),
            plan=dealt_anew(own.plan, own.lattice, rng),
            heights_m=mirrored_heights(own.heights_m),
        )
        return City(other, mirrored_ground(self.ground))


@dataclass(frozen=True, eq=False)
class _Received:
    """A walk, and the levels along it."""

    walk: PedestrianWalk
    levels_dbm: Floats


class RouteRuns:
    """The runs of all cases on one route and in one ground truth.

    Cases that walk alike share the walk and its levels.

    Parameters
    ----------
    route : int
        Its number.
    """

    def __init__(self, world: ForeignWorld, route: int) -> None:
        self.world, self.route = world, route
        self._received: dict[tuple[PedestrianModel, bool], _Received] = {}
        self._radio: dict[bool, tuple[City, Radio]] = {}

    def run(self, case: WorldCase) -> tuple[Walk, TrackLog]:
        """Return truth and log of a case."""
        world, number = self.world, str(self.route)
        city, _ = self._city_of(case.other_city)
        received = self._walk_of(case)
        plan, truth = city.streets.plan, received.walk.truth
        levels_dbm = received.levels_dbm.copy()
        silent = [plan.index(name) for name in world.given(case, self.route).silent]
        levels_dbm[:, silent] = -np.inf
        rng = named_rng(world.seed, "foreign phone", number)
        radio = report_table(truth, levels_dbm, received.walk.loss_db, plan, case.phone, rng)
        if not case.levels:
            serving = radio[radio["role"] == "serving"]
            radio = serving.assign(level_dbm=np.nan, censored=np.int8(0)).reset_index(drop=True)
        rng = named_rng(world.seed, "foreign unit", number)
        motion = motion_table(truth, case.inertial, rng)
        if not case.compass:
            motion["heading_rad"] = np.nan
        log = make_log(city.streets.network.crs, motion=motion, radio=radio)
        if case.other_city:
            truth = truth.assign(east_m=truth["east_m"] + AWAY_M)
        log = replace(log, truth=truth)
        if case.sensor is None:
            return Walk(truth), log
        rng = named_rng(world.seed, "sensor fault", case.sensor, number)
        log, window = faulty_log(case.sensor, log, rng)
        return Walk(truth, fault_at_s=window.begin_s, fault_until_s=window.end_s), log

    def filter(self, choice: FilterOptions, case: WorldCase) -> Filter[Any]:
        """Return the filter over the database that a case is given."""
        return self.world.filter(choice, case, self.route)

    def window_from_s(self, case: WorldCase, walked: Walk) -> None:
        """Return None: no satellites are received here."""

    def _walk_of(self, case: WorldCase) -> _Received:
        key = case.pedestrian, case.other_city
        if key not in self._received:
            city, radio = self._city_of(case.other_city)
            model = case.pedestrian
            if self.world.length_m is not None:
                model = replace(model, length_m=self.world.length_m)
            rng = named_rng(self.world.seed, "foreign walk", str(self.route))
            walk = pedestrian_walk(city.lines, city.ground, model, rng)
            places = (walk.truth[name].to_numpy() for name in ("east_m", "north_m"))
            self._received[key] = _Received(walk, radio.levels_dbm(*places))
        return self._received[key]

    def _city_of(self, other: bool) -> tuple[City, Radio]:
        if other not in self._radio:
            world, number = self.world, str(self.route)
            city = world.city
            if other:
                city = city.mirrored(named_rng(world.seed, "other city", number))
            seed = int(named_rng(world.seed, "foreign radio", number).integers(2**62))
            own = city.streets
            parts = own.plan, own.lattice, own.heights_m, city.lines
            self._radio[other] = city, Radio(*parts, world.radio, seed, world.offsets_db)
        return self._radio[other]


def write_ground(ground: OpenGround, path: Path) -> None:
    """Keep open ground."""
    np.savez_compressed(path, open=ground.open, built=ground.built)


# What is read is kept by its checksum: a folder may hold another world by now.
@lru_cache(maxsize=1)
def _city(streets: Path, ground: Path, sha256: str) -> City:  # noqa: ARG001
    world = open_world(streets)
    with np.load(ground, allow_pickle=False) as masks:
        return City(world, OpenGround(world.lattice, masks["open"], masks["built"]))
