"""The world of a sweep on disk: streets, cells and levels, which every worker maps into memory."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from mapfilter._io import atomic_dir, sha256_file
from mapfilter._json_files import read_json, write_json
from mapfilter._types import Floats32
from mapfilter.database.store import open_database, read_cells, write_cells
from mapfilter.errors import InputError, StoreError, fail
from mapfilter.geodesy import same_crs, shown_crs
from mapfilter.lattice import Lattice
from mapfilter.positioning.filter import Filter, FilterOptions
from mapfilter.radio.cells import CellPlan
from mapfilter.rasters.raster_set import RxLevRasters
from mapfilter.roads.network import StreetNetwork
from mapfilter.simulation.walking import Inside, inside_buildings

_HEAD, _CELLS, _STREETS = "world.json", "cells.parquet", "streets.npz"
_HEIGHTS = "heights.npy"
_ARRAYS = ["east_m", "north_m", "node_a", "node_b", "length_m", "way_id", "way_class", "oneway"]


@dataclass(frozen=True, eq=False)
class SweepWorld:
    """Where journeys go and what is received there.

    Parameters
    ----------
    network : StreetNetwork
        In the lattice's CRS.
    lattice : Lattice
        Of the levels.
    levels_dbm : mapping of str to ndarray, shape (cells, rows, cols)
        By the radio's name; NaN where a cell is not received. Read from disk, they are mapped.
    heights_m : ndarray, shape (rows, cols), or None
        Of buildings on the lattice, where walkers keep out of them.
    """

    network: StreetNetwork
    plan: CellPlan
    lattice: Lattice
    levels_dbm: Mapping[str, Floats32]
    heights_m: Floats32 | None = None

    @classmethod
    def of(
        cls,
        network: StreetNetwork,
        plan: CellPlan,
        rasters: Mapping[str, RxLevRasters],
        heights_m: Floats32 | None = None,
    ) -> SweepWorld:
        """Read the levels of a sweep, by the names of its radios, from rasters of one lattice."""
        lattices = {one.lattice for one in rasters.values()}
        if len(lattices) != 1:
            raise fail(InputError, "rasters", "one lattice for all", f"{len(lattices)} of them")
        lattice = lattices.pop()
        for where, crs in [("streets", network.crs), ("cell plan", plan.crs)]:
            if not same_crs(crs, lattice.crs):
                expected = f"the rasters' {shown_crs(lattice.crs)}"
                raise fail(InputError, f"{where}, crs", expected, shown_crs(crs))
        levels_dbm = {name: all_levels_dbm(one, plan) for name, one in rasters.items()}
        return cls(network, plan, lattice, levels_dbm, heights_m)

    @property
    def inside(self) -> Inside | None:
        """Lookup of buildings; None where heights are unknown."""
        if self.heights_m is None:
            return None
        return inside_buildings(self.heights_m, self.lattice)


def all_levels_dbm(rasters: RxLevRasters, plan: CellPlan) -> Floats32:
    """Read the levels of all cells of a plan, in its order, shape (cells, rows, cols)."""
    return np.asarray(rasters.read_levels_dbm(plan, None, plan.ids), dtype=np.float32)


def write_world(world: SweepWorld, folder: Path) -> str:
    """Write a world, and return the SHA-256 of its head."""
    names = sorted(world.levels_dbm)
    with atomic_dir(folder) as into:
        write_cells(world.plan, into / _CELLS)
        arrays: dict[str, Any] = {name: getattr(world.network, name) for name in _ARRAYS}
        np.savez(into / _STREETS, **arrays)
        for number, name in enumerate(names):
            levels = np.ascontiguousarray(world.levels_dbm[name], dtype=np.float32)
            np.save(into / _levels(number), levels)
        lattice = world.lattice
        parts = [_CELLS, _STREETS, *(_levels(number) for number in range(len(names)))]
        if world.heights_m is not None:
            np.save(into / _HEIGHTS, np.asarray(world.heights_m, dtype=np.float32))
            parts.append(_HEIGHTS)
        head = {
            "crs": lattice.crs,
            "west_m": lattice.west_m,
            "north_m": lattice.north_m,
            "resolution_m": lattice.resolution_m,
            "rows": lattice.rows,
            "cols": lattice.cols,
            "class_names": list(world.network.class_names),
            "levels": names,
            "sha256": {part: sha256_file(into / part) for part in parts},
        }
        write_json(into / _HEAD, head)
    return sha256_file(folder / _HEAD)


def open_world(folder: Path) -> SweepWorld:
    """Open a world; its levels are mapped into memory, not read. A damaged one is a StoreError."""
    head = read_json(folder / _HEAD)
    try:
        lattice = Lattice(
            str(head["crs"]),
            float(head["west_m"]),
            float(head["north_m"]),
            float(head["resolution_m"]),
            int(head["rows"]),
            int(head["cols"]),
        )
        for part, digest in head["sha256"].items():
            if sha256_file(folder / part) != digest:
                raise fail(
                    StoreError, str(folder / part), "the world of this sweep", "a changed file"
                )
        with np.load(folder / _STREETS, allow_pickle=False) as arrays:
            streets = {name: arrays[name] for name in _ARRAYS}
        network = StreetNetwork(crs=lattice.crs, class_names=tuple(head["class_names"]), **streets)
        levels = {
            str(name): np.load(folder / _levels(number), mmap_mode="r", allow_pickle=False)
            for number, name in enumerate(head["levels"])
        }
        heights_m = None
        if _HEIGHTS in head["sha256"]:
            heights_m = np.load(folder / _HEIGHTS, mmap_mode="r", allow_pickle=False)
    except (OSError, KeyError, TypeError, ValueError, OverflowError) as error:
        raise fail(StoreError, str(folder), "the world of a sweep", error, "cut off") from error
    cells = read_cells(folder / _CELLS, lattice.crs)
    return SweepWorld(network, cells, lattice, levels, heights_m)


@lru_cache(maxsize=1)
def opened_world(folder: Path, sha256: str) -> SweepWorld:
    """Open a world once in each process; another one by now is a StoreError."""
    if sha256_file(folder / _HEAD) != sha256:
        raise fail(StoreError, str(folder), "the world of this sweep", "another", "two at once")
    return open_world(folder)


@lru_cache(maxsize=32)
def opened_filter(database: Path, sha256: str, choice: FilterOptions) -> Filter[Any]:
    """Return a filter over a database, by the SHA-256 of its manifest, once in each process."""
    return choice.over(open_database(database, generation=sha256), ways=False)


@lru_cache(maxsize=32)
def scored_filter(database: Path, sha256: str, choice: FilterOptions) -> Filter[Any]:
    """Return the filter of :func:`opened_filter` without what success and errors do not need."""
    return opened_filter(database, sha256, choice).for_scores()


def _levels(number: int) -> str:
    return f"levels-{number}.npy"
