"""Positions in a made metropolis: python benchmarks/metropolis.py build|walk|whole|tiles FOLDER.

``build`` writes a database of streets and cells of three-sector sites, by default four cells per
square kilometre on pixels of 5 m: made streets in an irregular grid over ``--km2``, or those of an
OpenStreetMap extract of Heidelberg (``--map FILE``; the lattice is that of this city). Levels fall
off with the distance and the antenna, and are shadowed; what phones measure is shadowed otherwise,
too. ``walk`` locates walks with an unknown start; ``whole`` and ``tiles`` locate walks in one small
made area that is held whole, or by tiles.
"""

import argparse
import gc
import json
import time
from dataclasses import dataclass
from functools import partial
from math import ceil, sqrt
from pathlib import Path

import numpy as np
import shapely
from numba import njit
from scipy.ndimage import gaussian_filter

from mapfilter.database.estimate import peak_memory_bytes
from mapfilter.database.parts import Head, write_parts
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.database.sources import LayerRoutes
from mapfilter.database.store import open_database
from mapfilter.database.tiles import TileRows, places_table, received_levels, tile_windows
from mapfilter.errors import InputError, MapfilterError, fail
from mapfilter.evaluation.accuracy import SUCCESS_RADIUS_M
from mapfilter.evaluation.success import wilson_interval
from mapfilter.lattice import Lattice
from mapfilter.positioning.bayes.area.area_map import AreaMap
from mapfilter.positioning.bayes.area.tiled_area import TiledArea
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.merging import epochs
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.roads.index import HALF_WIDTH_M
from mapfilter.roads.network import street_network
from mapfilter.roads.osm import read_ways
from mapfilter.roads.route_points import RouteSource
from mapfilter.roads.ways import Ways
from mapfilter.simulation.journeys import JourneyPlan, journey
from mapfilter.simulation.reports import ReportModel
from mapfilter.simulation.routes import route
from mapfilter.simulation.simulate import SimulationSettings, simulate_log

CRS, WEST_M, NORTH_M, PIXEL_M = "EPSG:32632", 400_000.0, 5_600_000.0, 5.0
FLOOR_DBM, MARGIN_DB, TILE_PX = -104.0, 6.0, 256
STREET_M, CELLS_PER_KM2 = 125.0, 4.0
EIRP_DBM, AT_1KM_DB, PER_DECADE_DB = 50.0, 132.0, 38.0
SHADOW_DB, ERROR_DB, SHADOW_PX = 6.0, 6.0, 1024
"""Deviations of the predicted levels about their mean, and of the measured about the predicted;
side of the patterns that both are made of, which correlate over some 40 m."""
REACH_M = 5_000.0
WINDOW_M = 4_000.0
MOST_FAILED = 1000
"""Starts in a row without a route of the length of a walk before the area is given up."""


@dataclass(frozen=True, eq=False)
class Radio:
    """Cells as columns of numbers, and patterns that shadow them."""

    lattice: Lattice
    place_m: np.ndarray
    azimuth_rad: np.ndarray
    pattern: np.ndarray
    shift: np.ndarray

    @classmethod
    def of(cls, plan: CellPlan, lattice: Lattice) -> "Radio":
        """Return the cells of a plan."""
        rng = np.random.default_rng(11)
        pattern = gaussian_filter(rng.standard_normal((SHADOW_PX, SHADOW_PX)), 6.0, mode="wrap")
        place_m = np.array([[cell.east_m, cell.north_m] for cell in plan.cells])
        azimuth = np.radians([float(cell.azimuth_deg or 0.0) for cell in plan.cells])
        # Shifts of the patterns of a site, of a cell, and of the errors of both.
        site = np.unique([cell.site for cell in plan.cells], return_inverse=True)[1]
        shift = np.random.default_rng(12).integers(SHADOW_PX, size=(len(plan), 4, 2))
        shift[:, [0, 2]] = shift[site][:, [0, 2]]
        return cls(lattice, place_m, azimuth, (pattern / pattern.std()).astype(np.float32), shift)

    def levels(self, cells: np.ndarray, east_m: np.ndarray, north_m: np.ndarray) -> np.ndarray:
        """Return predicted levels of some cells at places, (K, N)."""
        given = self.place_m[cells], self.azimuth_rad[cells], self.shift[cells, :2]
        row, col = self.lattice.row_col(east_m, north_m)
        return levels_dbm(*given, self.pattern, SHADOW_DB, east_m, north_m, row, col)

    def measured(self, cells: np.ndarray, east_m: np.ndarray, north_m: np.ndarray) -> np.ndarray:
        """Return true levels of some cells at places, (N, K)."""
        row, col = self.lattice.row_col(east_m, north_m)
        found = self.levels(cells, east_m, north_m)
        return (found + shadows(self.shift[cells, 2:], self.pattern, ERROR_DB, row, col)).T

    def near(self, window: Lattice) -> np.ndarray:
        """Return the cells that may be above the floor in a window."""
        west, south, east, north = window.bounds_m
        middle = np.array([(west + east) / 2, (south + north) / 2])
        half_m = 0.5 * np.hypot(east - west, north - south)
        apart = middle - self.place_m
        away_m = np.hypot(*apart.T)
        turned = np.arctan2(*apart.T) - self.azimuth_rad
        turned = np.abs((turned + np.pi) % (2 * np.pi) - np.pi)
        spread = np.arcsin(np.minimum(half_m / np.maximum(away_m, 1.0), 1.0))
        gain = -np.minimum(12 * (np.maximum(turned - spread, 0) / np.radians(65)) ** 2, 22.0)
        gain[away_m < 1.5 * half_m] = 0.0
        nearest_km = np.maximum(away_m - half_m, 50.0) / 1000
        most_dbm = EIRP_DBM - AT_1KM_DB - PER_DECADE_DB * np.log10(nearest_km) + gain
        audible = most_dbm + 2.5 * SHADOW_DB > FLOOR_DBM
        return np.flatnonzero((away_m - half_m < REACH_M) & audible)


@njit(cache=True)
def shadows(shift, pattern, sd_db, row, col):  # type: ignore[no-untyped-def]
    """Return the sum of two patterns for each cell and place, shifted by cell, (K, N)."""
    found = np.empty((shift.shape[0], row.size), dtype=np.float64)
    last = pattern.shape[0] - 1
    for k in range(shift.shape[0]):
        for i in range(row.size):
            one = pattern[(row[i] + shift[k, 0, 0]) & last, (col[i] + shift[k, 0, 1]) & last]
            two = pattern[(row[i] + shift[k, 1, 0]) & last, (col[i] + shift[k, 1, 1]) & last]
            found[k, i] = sd_db * 0.70710678 * (one + two)
    return found


@njit(cache=True)
def levels_dbm(  # type: ignore[no-untyped-def]
    place_m, azimuth_rad, shift, pattern, sd_db, east_m, north_m, row, col
):
    """Return log-distance levels with a sector's pattern and shadows, (K, N)."""
    found = shadows(shift, pattern, sd_db, row, col)
    for k in range(place_m.shape[0]):
        for i in range(row.size):
            x, y = east_m[i] - place_m[k, 0], north_m[i] - place_m[k, 1]
            away_km = max(np.sqrt(x * x + y * y), 30.0) / 1000
            turned = np.arctan2(x, y) - azimuth_rad[k]
            turned -= 2 * np.pi * np.round(turned / (2 * np.pi))
            gain = -min(12 * (turned / 1.134) ** 2, 22.0)
            found[k, i] += EIRP_DBM - AT_1KM_DB - PER_DECADE_DB * np.log10(away_km) + gain
    return found


def made_ways(lattice: Lattice, seed: int) -> Ways:
    """Return an irregular grid of streets: corners moved by chance, a sixth of its edges gone."""
    rng = np.random.default_rng(seed)
    west, south, east, north = lattice.bounds_m
    across, up = int((east - west) / STREET_M), int((north - south) / STREET_M)
    x, y = np.meshgrid(west + STREET_M * (np.arange(across) + 0.5),
                       south + STREET_M * (np.arange(up) + 0.5))  # fmt: skip
    x, y = x + rng.uniform(-32, 32, x.shape), y + rng.uniform(-32, 32, y.shape)
    place = np.round(np.stack([x, y], axis=-1), 2)
    ends = np.concatenate([
        np.stack([place[:, :-1], place[:, 1:]], axis=2).reshape(-1, 2, 2),
        np.stack([place[:-1], place[1:]], axis=2).reshape(-1, 2, 2),
    ])  # fmt: skip
    ends = ends[rng.random(len(ends)) > 1 / 6]
    names = rng.choice(["residential", "tertiary"], len(ends), p=[0.8, 0.2])
    return Ways.open(CRS, 1 + np.arange(len(ends)), names, shapely.linestrings(ends))


def made_plan(
    lattice: Lattice, seed: int, namesakes: int, cells_per_km2: float = CELLS_PER_KM2
) -> CellPlan:
    """Return sites of three sectors about the points of a hexagonal grid."""
    rng = np.random.default_rng(seed)
    west, south, east, north = lattice.bounds_m
    spacing_m = sqrt(2 / sqrt(3) * 3e6 / cells_per_km2)
    cells, rows = [], ceil((north - south) / (spacing_m * sqrt(3) / 2))
    per_row = ceil((east - west) / spacing_m)
    number = 0
    codes = ceil(3 * rows * per_row / namesakes)
    carriers = max(codes // 64 + 1, 12)
    for row in range(rows):
        for col in range(per_row):
            x, y = rng.uniform(-0.2, 0.2, 2) * spacing_m
            x += west + (col + 0.25 + 0.5 * (row % 2)) * spacing_m
            y += south + (row + 0.5) * spacing_m * sqrt(3) / 2
            turn = rng.uniform(0, 120)
            for sector in range(3):
                code = number % codes
                cells.append(Cell(
                    f"C{number:05d}", f"S{number // 3:05d}", float(x), float(y), 30.0,
                    (turn + 120 * sector) % 360, EIRP_DBM, 900.0, "sector",
                    arfcn=1 + code % carriers, bsic=code // carriers % 64,
                ))  # fmt: skip
                number += 1
    return CellPlan(lattice.crs, tuple(cells))


def made_database(
    folder: Path, km2: float, extract: Path | None, namesakes: int
) -> dict[str, float]:
    """Write a database; return the time (processor seconds) and counts."""
    began_s = time.process_time()
    if extract is None:
        side_px = 2 * round(sqrt(km2) * 1000 / PIXEL_M / 2)
        lattice = Lattice(CRS, WEST_M, NORTH_M, PIXEL_M, side_px, side_px)
        ways = made_ways(lattice, 1)
    else:
        lattice, ways = real_ways(extract)
    plan = made_plan(lattice, 2, namesakes)
    radio = Radio.of(plan, lattice)
    source = LayerRoutes(RouteSource.of(ways, None, None, HALF_WIDTH_M, crs=lattice.crs), lattice)
    windows = [w for w in tile_windows(lattice, TILE_PX) if source.holds(lattice.window(*w))]

    def tiles():  # type: ignore[no-untyped-def]
        for window in windows:
            part = lattice.window(*window)
            places = places_table(source.part(part)(), lattice)
            cells = radio.near(part)
            row, col = (places[name].to_numpy() for name in ("row", "col"))
            level = radio.levels(cells, *lattice.east_north(row, col))
            yield TileRows(places, received_levels(level, FLOOR_DBM).of_cells(cells.tolist()))

    def say(done: int, total: int) -> None:
        if done % 100 == 0:
            print(f"{done} of {total} tiles, {time.process_time() - began_s:.0f} s", flush=True)

    folder.mkdir(parents=True)
    database = folder / "database"
    database.mkdir()
    written = write_parts(database, lattice.crs, plan.ids, tiles(), len(windows), progress=say)
    counts = {"points": written.received, "points_below_floor": 0, "points_off_rasters": 0}
    parameters = {"margin_db": MARGIN_DB, "floor_dbm": FLOOR_DBM, "tile_px": TILE_PX}
    Head(lattice, plan, parameters, "", (), counts).write(database, written.parts)
    return {
        "seconds": time.process_time() - began_s,
        "km2": lattice.rows * lattice.cols * PIXEL_M**2 / 1e6,
        "cells": len(plan),
        "points": written.received,
        "levels": sum(part["rows"] for part in written.parts if "cell" in part),
        "parts": len(written.parts),
        "bytes": sum(part["bytes"] for part in written.parts),
        "peak_gb": peak_memory_bytes() / 1e9,
    }


def real_ways(extract: Path) -> tuple[Lattice, Ways]:
    """Return the walkable ways of Heidelberg's extract, and their lattice in UTM zone 32."""
    west, south, side_px = 473_500.0, 5_467_000.0, (2970, 2660)
    lattice = Lattice(CRS, west, south + side_px[0] * PIXEL_M, PIXEL_M, *side_px)
    return lattice, read_ways(extract, "walking", CRS, lattice.bounds_m)


def walks(database: RadioRouteDatabase, ways: Ways, count: int, length_m: float, seed: int):  # type: ignore[no-untyped-def]
    """Yield logs of walks that begin anywhere in the area, 600 m from its edge or farther.

    Starts without a route are drawn again; a thousand of them in a row end it with an InputError.
    """
    lattice, plan = database.lattice, database.plan
    radio, tree = Radio.of(plan, lattice), shapely.STRtree(ways.geometry)
    west, south, east, north = lattice.bounds_m
    half_m = min(WINDOW_M, east - west - 1200, north - south - 1200) / 2
    report = ReportModel(phone_offset_sd_db=3.0)
    settings = SimulationSettings(journey=JourneyPlan(length_m=length_m), reports=report)
    made, attempt, failed = 0, 0, 0
    while made < count:
        rng = np.random.default_rng((seed, attempt))
        attempt += 1
        x = rng.uniform(west + 600 + half_m, east - 600 - half_m)
        y = rng.uniform(south + 600 + half_m, north - 600 - half_m)
        box = shapely.box(x - half_m, y - half_m, x + half_m, y + half_m)
        some = ways.select(np.sort(tree.query(box, predicate="contains")))
        try:
            network = street_network(some)
            along = route(network, length_m, rng, leg_m=settings.journey.leg_m)
        except MapfilterError as error:  # A window without streets is no start.
            print("no walk:", error, flush=True)
            failed += 1
            if failed == MOST_FAILED:
                expected = f"a route of {length_m:.0f} m"
                raise fail(InputError, "area", expected, f"none in {failed} starts") from error
            continue
        failed = 0
        truth = journey(along, settings.journey, rng)
        row, col = lattice.row_col(truth["east_m"].to_numpy(), truth["north_m"].to_numpy())
        top, left = max(int(row.min()), 0), max(int(col.min()), 0)
        window = lattice.window(top, left, int(row.max()) - top + 1, int(col.max()) - left + 1)
        cells = radio.near(window)
        near = CellPlan(plan.crs, tuple(plan.cells[k] for k in cells))
        levels = partial(radio.measured, cells)
        yield simulate_log(lattice.crs, truth, levels, near, settings, rng, rng)
        made += 1


def walked(folder: Path, count: int, length_m: float, seed: int, extract: Path | None) -> None:
    """Locate walks, and print what was found and what it took."""
    began = time.process_time()
    database = open_database(folder / "database")
    opened_s = time.process_time() - began
    positioner = BayesFilter().over(database)
    positioner.warm_up([])
    loaded_s = time.process_time() - began
    area = positioner.area
    lattice = database.lattice
    ways = real_ways(extract)[1] if extract else made_ways(lattice, 1)
    kind = type(area).__name__
    print(f"{kind}: opened {opened_s:.1f} s, ready {loaded_s:.1f} s", flush=True)
    found, wrong, steps, tracked, firsts, gone = 0, 0, [], [], [], []
    for number, log in enumerate(walks(database, ways, count, length_m, seed)):
        rng, state = np.random.default_rng(5), positioner.begin()
        truth, at_m, own = log.truth, float("nan"), []
        east, north = (
            partial(np.interp, xp=truth["time_s"], fp=truth[axis]) for axis in ("east_m", "north_m")
        )
        for epoch in epochs(log):
            before = time.process_time()
            state, out = positioner.step(state, epoch, rng)
            own.append(time.process_time() - before)
            if state.status.is_followed:
                tracked.append(own[-1])
                if np.isnan(at_m):
                    at_m = float(np.hypot(out.fix.east_m - east(epoch.time_s),
                                          out.fix.north_m - north(epoch.time_s)))  # fmt: skip
                    gone.append(1.4 * epoch.time_s)
        found += at_m <= SUCCESS_RADIUS_M
        wrong += at_m > SUCCESS_RADIUS_M
        steps += own
        firsts.append(own[0])
        held = area.tiles.held.bytes / 1e6 if isinstance(area, TiledArea) else float("nan")
        print(
            f"{number}: {at_m:.1f} m after {gone[-1] if gone else 0:.0f} m; first {own[0]:.2f} s,"
            f" most {max(own[1:]):.2f} s; held {held:.0f} MB,"
            f" peak {peak_memory_bytes() / 1e9:.2f} GB",
            flush=True,
        )
    print(json.dumps({
        "area": kind, "walks": count, "found": found, "wrong": wrong,
        "found_interval": wilson_interval(found, count),
        "wrong_interval": wilson_interval(wrong, count),
        "step_95_s": float(np.quantile(steps, 0.95)), "step_99_s": float(np.quantile(steps, 0.99)),
        "steps_over_1s": int(np.sum(np.array(steps) > 1)), "steps": len(steps),
        "tracked_median_s": float(np.median(tracked)) if tracked else None,
        "first_median_s": float(np.median(firsts)), "first_most_s": float(np.max(firsts)),
        "gone_median_m": float(np.median(gone)) if gone else None,
        "peak_gb": peak_memory_bytes() / 1e9, "opened_s": opened_s, "ready_s": loaded_s,
    }))  # fmt: skip


def compare(folder: Path, count: int, length_m: float, seed: int, how: str) -> None:
    """Locate walks with the area held whole or by tiles, and print time and memory."""
    database = open_database(folder / "database")
    before = time.process_time()
    if how == "whole":
        area = AreaMap.of_field(database.field(), database.plan, database.floor_dbm)
        area.flat_rough_db  # noqa: B018
        gc.collect()
    else:
        area = TiledArea.of_database(database)
    positioner, ways = BayesFilter().over_area(area), made_ways(database.lattice, 1)
    loaded_s = time.process_time() - before
    steps, ends = [], []
    for log in walks(database, ways, count, length_m, seed):
        rng, state = np.random.default_rng(5), positioner.begin()
        for epoch in epochs(log):
            before = time.process_time()
            state, out = positioner.step(state, epoch, rng)
            steps.append(time.process_time() - before)
        end = log.truth.iloc[-1]
        away_m = np.hypot(out.fix.east_m - end["east_m"], out.fix.north_m - end["north_m"])
        ends.append((str(state.status), round(float(away_m), 1)))
    print(json.dumps({
        "how": how, "loaded_s": loaded_s, "total_s": sum(steps), "median_s": np.median(steps),
        "most_s": max(steps), "peak_gb": peak_memory_bytes() / 1e9, "ends": ends,
    }))  # fmt: skip


def main() -> None:
    """Build an area, or locate walks in it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=["build", "walk", "whole", "tiles"])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--km2", type=float, default=25.0)
    parser.add_argument("--map", type=Path, help="OpenStreetMap extract of Heidelberg")
    parser.add_argument("--namesakes", type=int, default=1, help="cells of a carrier and code")
    parser.add_argument("--walks", type=int, default=5)
    parser.add_argument("--length-m", type=float, default=1200.0)
    parser.add_argument("--seed", type=int, default=100)
    given = parser.parse_args()
    if given.what == "build":
        print(json.dumps(made_database(given.folder, given.km2, given.map, given.namesakes)))
    elif given.what == "walk":
        walked(given.folder, given.walks, given.length_m, given.seed, given.map)
    else:
        compare(given.folder, given.walks, given.length_m, given.seed, given.what)


if __name__ == "__main__":
    main()
