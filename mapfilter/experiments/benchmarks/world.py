"""The world of a benchmark: streets, cells and databases on disk, and the ground truth."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import shapely
from shapely import STRtree

from mapfilter._arrow import open_parquet
from mapfilter._io import atomic_file, sha256_file
from mapfilter._types import Ints
from mapfilter.experiments.benchmarks.cases import Case
from mapfilter.experiments.sweep.world import SweepWorld, opened_filter, opened_world
from mapfilter.gnss.skyline import Skyline
from mapfilter.positioning.filter import Filter, FilterOptions
from mapfilter.propagation.models import GroundTruthErrors, PredictionModel
from mapfilter.propagation.predict import simulate_ground_truth
from mapfilter.radio.antenna import MeasuredAntenna
from mapfilter.roads.lattice import RouteLattice
from mapfilter.roads.ways import Buildings, Ways
from mapfilter.simulation.level_samplers import Levels, array_sampler
from mapfilter.simulation.satellites import ReceptionModel
from mapfilter.simulation.simulate import SimulationSettings

STREETS, FULL, THINNED = "streets", "database", "database-thinned"
BUILDINGS = "buildings.parquet"


@dataclass(frozen=True)
class BenchmarkWorld:
    """Where a benchmark's world lies, and how it differs from its prediction.

    Parameters
    ----------
    folder : Path
        Holds streets, cells and building heights, buildings, and a database with all ways, and one
        that lacks some.
    model : PredictionModel
        That the databases were predicted with.
    errors : GroundTruthErrors
        How the ground truth differs; its seed is drawn anew for each ground truth.
    settings : SimulationSettings
        The walker, the reports, and the errors of dead reckoning.
    antennas : mapping of str to MeasuredAntenna
        That the cell plan names.
    reception : ReceptionModel
        How satellites are received.
    """

    folder: Path
    model: PredictionModel
    errors: GroundTruthErrors = field(default_factory=GroundTruthErrors)
    settings: SimulationSettings = field(default_factory=SimulationSettings)
    antennas: Mapping[str, MeasuredAntenna] = field(default_factory=dict)
    reception: ReceptionModel = field(default_factory=ReceptionModel)

    @property
    def sha256(self) -> str:
        """Of streets, cells, levels and buildings, and of all that is simulated."""
        parts = (*(f"{name}/manifest.json" for name in (FULL, THINNED)), BUILDINGS)
        drawn = [sha256_file(self.folder / part) for part in (f"{STREETS}/world.json", *parts)]
        simulated = map(repr, (self.model, self.errors, self.settings, self.reception))
        return hashlib.sha256("".join((*drawn, *simulated)).encode()).hexdigest()

    @property
    def streets(self) -> SweepWorld:
        """Streets, cells and building heights."""
        folder = self.folder / STREETS
        return opened_world(folder, sha256_file(folder / "world.json"))

    def filter(self, choice: FilterOptions, *, thinned: bool) -> Filter[Any]:
        """Return the filter over the city, with the databases read once by each process."""
        folder = self.folder / (THINNED if thinned else FULL)
        return opened_filter(folder, sha256_file(folder / "manifest.json"), choice)

    def skyline(self, case: Case) -> Skyline | None:
        """Return the buildings that hide satellites, where a case has any satellites."""
        if case.satellites is None:
            return None
        file = self.folder / BUILDINGS
        return _skyline(file, sha256_file(file))

    def ground_truth(self, seed: int, level_error_db: float | None = None) -> Levels:
        """Draw the levels that are received, by default with the world's deviation in dB."""
        errors = replace(self.errors, seed=seed)
        if level_error_db is not None:
            errors = replace(errors, level_error_db=level_error_db)
        streets = self.streets
        cells = simulate_ground_truth(
            streets.plan,
            streets.lattice,
            streets.heights_m,
            self.model,
            errors,
            antennas=self.antennas,
        )
        return array_sampler(np.stack([level_dbm for _, level_dbm in cells]), streets.lattice)


def write_buildings(buildings: Buildings, path: Path) -> None:
    """Keep footprints and heights."""
    columns = {"footprint": shapely.to_wkb(buildings.footprints), "height_m": buildings.height_m}
    with atomic_file(path) as file:
        pq.write_table(pa.table(columns), file)


# What is read is kept by its checksum: a folder may hold another world by now.
@lru_cache(maxsize=1)
def _skyline(path: Path, sha256: str) -> Skyline | None:  # noqa: ARG001
    with open_parquet(path) as source:
        table = source.read()
    footprints = shapely.from_wkb(table["footprint"].to_numpy())
    return Skyline(footprints, table["height_m"].to_numpy()) if len(footprints) else None


def ways_gone(ways: Ways, share: float, rng: np.random.Generator) -> Ints:
    """Draw the ids of the ways that are not known, each with this probability."""
    ids = np.unique(ways.way_id)
    return np.asarray(ids[rng.random(ids.size) < share])


def without_ways(
    routes: RouteLattice, ways: Ways, share: float, half_width_m: float, rng: np.random.Generator
) -> RouteLattice:
    """Return the points that are left when a share of the ways is not known.

    A point of a way that is missing stays where it lies in a square or within the half width of
    another way, of which it then is.

    Parameters
    ----------
    ways : Ways
        In the lattice's CRS.
    share : float
        Each way is missing with this probability; parts of one way go together.
    """
    gone = ways_gone(ways, share, rng)
    kept_way = ~np.isin(ways.way_id, gone)
    kept = ~np.isin(routes.way_id, gone) | routes.on_square
    way_id, distance_m = routes.way_id.copy(), routes.distance_to_way_m.copy()
    lost = np.flatnonzero(np.isin(routes.way_id, gone))
    if lost.size and kept_way.any():
        places = shapely.points(*routes.lattice.east_north(routes.row[lost], routes.col[lost]))
        (which, nearest), away_m = STRtree(ways.geometry[kept_way]).query_nearest(
            places, return_distance=True, all_matches=False
        )
        near = away_m <= half_width_m
        kept[lost[which]] |= near
        distance_m[lost[which]] = away_m
        way_id[lost[which]] = np.where(near, ways.way_id[kept_way][nearest], 0)
    return RouteLattice(
        routes.lattice,
        routes.row[kept],
        routes.col[kept],
        way_id[kept],
        routes.way_class[kept],
        routes.class_names,
        distance_m[kept],
        routes.on_square[kept],
    )
