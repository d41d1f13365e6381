"""The world of a benchmark on disk: streets, cells, heights and databases."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import shapely
from numpy.typing import NDArray

from mapfilter._io import atomic_file, sha256_file
from mapfilter.database.store import open_database
from mapfilter.experiments.benchmarks.cases import Case
from mapfilter.experiments.sweep.world import SweepWorld, open_world
from mapfilter.gnss.visibility import Skyline
from mapfilter.positioning.locators import FilterChoice, Locator, open_locator
from mapfilter.radio.predict import PredictionModel, RealityErrors, realise
from mapfilter.roads.ways import Buildings
from mapfilter.simulation.reports import Levels, array_sampler

STREETS, HEIGHTS, FULL, THINNED = "streets", "heights.npy", "database", "database-thinned"
BUILDINGS = "buildings.parquet"


@dataclass(frozen=True)
class BenchmarkWorld:
    """Where a benchmark's world lies.

    Parameters
    ----------
    folder : Path
        Holds streets and cells, buildings and their heights, and a database with all ways, and
        one that lacks some.
    model : PredictionModel
        That the databases were predicted with.
    """

    folder: Path
    model: PredictionModel

    @property
    def sha256(self) -> str:
        """Of streets, cells, levels and buildings."""
        parts = (*(f"{name}/manifest.json" for name in (FULL, THINNED)), BUILDINGS)
        told = (sha256_file(self.folder / part) for part in (f"{STREETS}/world.json", *parts))
        return hashlib.sha256("".join(told).encode()).hexdigest()

    @property
    def streets(self) -> SweepWorld:
        """Streets and cells."""
        return _streets(self.folder / STREETS)

    def locator(self, choice: FilterChoice, *, thinned: bool) -> Locator:
        """Return a function that locates logs, with the databases read once by each process."""
        return _locator(self.folder / (THINNED if thinned else FULL), choice)

    def skyline(self, case: Case) -> Skyline | None:
        """Return the buildings that hide satellites, where a case has any satellites."""
        return None if case.satellites is None else _skyline(self.folder / BUILDINGS)

    def reality(self, seed: int, level_error_db: float) -> Levels:
        """Draw how the cells are really heard."""
        return _reality(self.folder, self.model, seed, level_error_db)


def write_buildings(buildings: Buildings, path: Path) -> None:
    """Keep footprints and heights."""
    columns = {"footprint": shapely.to_wkb(buildings.footprints), "height_m": buildings.height_m}
    with atomic_file(path) as file:
        pq.write_table(pa.table(columns), file)


@lru_cache(maxsize=1)
def _skyline(path: Path) -> Skyline | None:
    table = pq.read_table(path)
    footprints = shapely.from_wkb(table["footprint"].to_numpy())
    return Skyline(footprints, table["height_m"].to_numpy()) if len(footprints) else None


@lru_cache(maxsize=1)
def _streets(folder: Path) -> SweepWorld:
    return open_world(folder)


@lru_cache(maxsize=32)
def _locator(database: Path, choice: FilterChoice) -> Locator:
    return open_locator(open_database(database), choice, ways=False)


@lru_cache(maxsize=2)
def _reality(folder: Path, model: PredictionModel, seed: int, level_error_db: float) -> Levels:
    world = _streets(folder / STREETS)
    heights_m: NDArray[np.float32] = np.load(folder / HEIGHTS, allow_pickle=False)
    errors = RealityErrors(level_error_db=level_error_db, seed=seed)
    levels = np.stack(
        [level for _, level in realise(world.plan, world.lattice, heights_m, model, errors)]
    )
    return array_sampler(levels, world.lattice)
