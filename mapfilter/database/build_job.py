"""A build cut into tiles, and its tiles made in order by any executor."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Executor
from dataclasses import dataclass

from mapfilter._area_scale import check_scale
from mapfilter._parallel import SerialExecutor, ordered_results
from mapfilter._resume import FinishedParts
from mapfilter.database.parquet import Window
from mapfilter.database.sources import LatticeRoutes, Routes, check_aligned, cut_by_tile, overlap
from mapfilter.database.tiles import TileRows, TileTask, grouped, read_tiles, tile_windows
from mapfilter.errors import InputError, fail
from mapfilter.lattice import Lattice
from mapfilter.radio.cells import CellPlan
from mapfilter.radio.far_cells import check_cells_near
from mapfilter.radio.layers import layer_numbers
from mapfilter.rasters.names import named_by_plan
from mapfilter.rasters.raster_set import RxLevRasters, check_against_plan
from mapfilter.roads.lattice import RouteLattice

TASKS_A_WORKER = 4
"""Tasks in flight for each worker, which keep all of them busy."""


@dataclass(frozen=True, slots=True, eq=False)
class BuildJob:
    """A build cut into tiles; no tile's points are laid before its turn.

    The plan is in the rasters' CRS; ``windows`` are the tiles on the rasters' lattice that may hold
    points, along the Z-order curve; ``layers`` are the numbers of the cells' layers.
    """

    rasters: RxLevRasters
    plan: CellPlan
    routes: Routes
    floor_dbm: float
    windows: tuple[Window, ...]
    layers: tuple[int, ...]

    @classmethod
    def of(
        cls,
        rasters: RxLevRasters,
        plan: CellPlan,
        routes: RouteLattice | Routes,
        floor_dbm: float,
        tile_px: int,
    ) -> BuildJob:
        """Check that the inputs fit each other, and cut them.

        Errors are those of :func:`mapfilter.database.build.build`.
        """
        check_scale(rasters.lattice.crs, rasters.lattice.bounds_m, f"{rasters.path}, CRS")
        source = cut_by_tile(routes)
        rasters = named_by_plan(rasters, plan)
        check_against_plan(rasters, plan)
        check_aligned(rasters.lattice, source.lattice, f"{rasters.path} and roads")
        lattice, windows = rasters.lattice, []
        for window in tile_windows(lattice, tile_px):
            inside = overlap(lattice, source.lattice, window)
            if inside is not None and source.holds(lattice.window(*inside)):
                windows.append(window)
        if not windows:
            hint = "files of different areas"
            raise fail(InputError, str(rasters.path), "points of the roads", "none", hint)
        plan = plan.to_crs(lattice.crs)
        check_cells_near(plan, lattice, "plan")
        layers = tuple(layer_numbers(plan.cells).tolist())
        return cls(rasters, plan, source, floor_dbm, tuple(windows), layers)

    def task(self, number: int) -> TileTask:
        """Return the task that makes a tile."""
        window = self.windows[number]
        part = self.routes.part(self.covered(window))
        rasters, plan = self.rasters.reaching(window), self.plan
        numbers = tuple(range(len(plan)))
        if rasters is not self.rasters:
            numbers = tuple(sorted(plan.index(cell_id) for cell_id in rasters.cell_ids))
            # A plan of no cells is none.
            plan = CellPlan(plan.crs, tuple(plan.cells[n] for n in numbers or (0,)))
        layers = tuple(self.layers[n] for n in numbers)
        return TileTask(rasters, plan, numbers, layers, window, part, self.floor_dbm)

    def covered(self, window: Window) -> Lattice:
        """Return the part of a tile that the roads cover."""
        inside = overlap(self.rasters.lattice, self.routes.lattice, window)
        assert inside is not None
        return self.rasters.lattice.window(*inside)

    def made(
        self, executor: Executor, finished: FinishedParts, in_flight: int, pixels_a_task: int
    ) -> Iterator[TileRows]:
        """Yield the tiles in order, finished ones from disk."""
        every = range(len(self.windows))
        missing = [n for n in every if not finished.keep or finished.load(n) is None]
        shares = 1 if isinstance(executor, SerialExecutor) else max(in_flight // TASKS_A_WORKER, 1)
        todo = tuple(missing)
        tasks = grouped(map(self.task, todo), pixels_a_task, len(todo), shares)
        results = ordered_results(executor, read_tiles, tasks, in_flight=in_flight)
        made = (rows for group in results for rows in group)
        for number in every:
            if missing and number == missing[0]:
                rows = next(made)
                finished.save(missing.pop(0), rows)
            else:
                # A file that was removed or damaged meanwhile is made again.
                rows = finished.load(number) or read_tiles([self.task(number)])[0]
            yield TileRows.from_bytes(rows)

    def off_rasters(self, points: int) -> int:
        """Return how many points of a route lattice lie beyond the rasters."""
        return len(self.routes.points) - points if isinstance(self.routes, LatticeRoutes) else 0
