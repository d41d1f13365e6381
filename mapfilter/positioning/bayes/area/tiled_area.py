"""A large area: levels and ways by tiles, loaded where hypotheses are."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mapfilter._types import Bytes, Floats, Floats32, Ints, Ints32
from mapfilter.database.cell_levels import received_cells
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.errors import StoreError, fail
from mapfilter.lattice import Lattice
from mapfilter.models.fingerprint import RasterFrame
from mapfilter.models.level_kernels import Prediction
from mapfilter.models.tile_kernels import (
    by_tile,
    interpolate_tile,
    look_up_levels,
    pixels_from_south,
    upper_left,
)
from mapfilter.positioning.bayes.area.area_frame import (
    AreaFrame,
    carriers_of,
    interfering_of,
    sites_of,
)
from mapfilter.positioning.bayes.area.area_tiles import HELD_BYTES, TILE_PX, AreaTiles
from mapfilter.radio.layers import layers_of

SEARCH_TILES = 48
"""Most tiles in which the first hypotheses are drawn."""
_MOST_PIXELS = 1 << 31
_LEVELS_AT_ONCE = 256
"""Pixels that levels are looked up at together: as each may be of another cell, they are looked up
at all pixels."""


@dataclass(frozen=True, eq=False)
class TiledArea(AreaFrame):
    """An area whose levels and ways are read by tiles where they are looked up.

    What is looked up equals that of :class:`~mapfilter.positioning.bayes.area.area_map.AreaMap`.

    Parameters
    ----------
    lattice, cell_ids, known_ids, carriers, floor_dbm, sites, interfering, layers
        As of :class:`~mapfilter.positioning.bayes.area.area_frame.AreaFrame`.
    tiles : AreaTiles
        Of the database.
    search_tiles : int
        Most tiles in which the first hypotheses are drawn.
    """

    lattice: Lattice
    cell_ids: tuple[str, ...]
    known_ids: frozenset[str]
    carriers: dict[tuple[int, int], tuple[int, ...]]
    floor_dbm: float
    sites: Mapping[str, tuple[float, float, float]]
    tiles: AreaTiles
    search_tiles: int = SEARCH_TILES
    interfering: frozenset[int] = frozenset()
    layers: tuple[int, ...] = ()

    @classmethod
    def of_database(
        cls,
        database: RadioRouteDatabase,
        side: int = TILE_PX,
        largest_bytes: int = HELD_BYTES,
        search_tiles: int = SEARCH_TILES,
    ) -> TiledArea:
        """Prepare a database with cells; nothing of its points or levels is read yet.

        Parameters
        ----------
        database : RadioRouteDatabase
            With a level of at least one cell.
        side : int
            Of a tile, pixels.
        largest_bytes : int
            Of all tiles and levels that are held at a time.
        search_tiles : int
            Most tiles in which the first hypotheses are drawn.

        Raises
        ------
        StoreError
            The area has more pixels than 32 bits count.
        """
        if database.lattice.rows * database.lattice.cols >= _MOST_PIXELS:
            expected, got = f"an area of less than {_MOST_PIXELS} pixels", repr(database.lattice)
            hint = "cut it to the region of the log, or merge fewer regions"
            raise fail(StoreError, str(database.path), expected, got, hint)
        plan, cells = database.plan, received_cells(database)
        layers = layers_of(plan, cells)
        return cls(
            database.lattice,
            cells,
            frozenset(plan.ids),
            carriers_of(plan, cells),
            database.floor_dbm,
            sites_of(plan),
            AreaTiles(database, cells, layers, side, largest_bytes),
            search_tiles,
            interfering_of(plan, cells),
            layers,
        )

    def looked_up(
        self, pixel: Ints32, cell: Ints32, *, rough: bool = True
    ) -> tuple[Floats32, Bytes]:
        """Return levels and their roughness (tenths of a dB) of cells (K,) at pixels (N,): (N, K).

        Without ``rough`` the second is empty.
        """
        bands, tiles = cell.tolist(), self.tiles
        found_dbm = np.full((pixel.size, cell.size), tiles.quiet_dbm, dtype=np.float32)
        found_rough = np.zeros((pixel.size, cell.size if rough else 0), dtype=np.uint8)
        for number, which in self._by_tile(pixel):
            with tiles.lock:
                tile = tiles.tile(number)
                near = tile.points.near
                levels = [tiles.levels(number, band) for band in bands]
                received = [k for k, level in enumerate(levels) if level is not None]
                if not received:
                    continue
                level_dbm = np.full((cell.size, tile.points.point.size), tiles.quiet_dbm)
                rough_db = np.zeros((cell.size if rough else 0, *near.shape), dtype=np.uint8)
                for k in received:
                    level_dbm[k] = levels[k]
                    page = tiles.rough_db(number, bands[k]) if rough else None
                    if page is not None:
                        rough_db[k] = page
                look_up_levels(
                    pixel,
                    which,
                    self.lattice.cols,
                    tile.corner,
                    near,
                    level_dbm,
                    rough_db,
                    found_dbm,
                    found_rough,
                )
        return found_dbm, found_rough

    def predicted(
        self, pixel: Ints32, cell: Ints32, share: float, *, rough: bool = True
    ) -> tuple[Prediction, Ints32, Ints32]:
        """Return predicted levels of cells as kernels take them, with their pixels and bands.

        Each hypothesis has a pixel of its own.
        """
        level_dbm, rough_db = self.looked_up(pixel, cell, rough=rough)
        predicted = Prediction(level_dbm.reshape(-1), rough_db.reshape(-1), cell.size, share)
        own = np.arange(pixel.size, dtype=np.int32)
        return predicted, own, np.arange(cell.size, dtype=np.int32)

    def shares_above(self, pixel: Ints32, cell: Ints32, limit_dbm: Floats32) -> Floats:
        """Return the share of pixels (N,) at which each cell (K,) is above a level (K,)."""
        above, tiles = np.zeros(cell.size), self.tiles
        for number, which in self._by_tile(pixel):
            with tiles.lock:
                tile = tiles.tile(number)
                (top, left), cols = tile.corner, self.lattice.cols
                point = tile.points.near[pixel[which] // cols - top, pixel[which] % cols - left]
                for k in tiles.strong(number, cell, limit_dbm).tolist():
                    level_dbm = tiles.levels(number, int(cell[k]))
                    if level_dbm is not None:
                        above[k] += np.count_nonzero(level_dbm[point] > limit_dbm[k])
        low = np.flatnonzero(tiles.quiet_dbm > limit_dbm)
        if low.size:
            # Cells that are nowhere received are above such a limit everywhere.
            found_dbm, _ = self.looked_up(pixel, cell[low], rough=False)
            above[low] = np.count_nonzero(found_dbm > limit_dbm[low], axis=0)
        return above / pixel.size

    def log_map_at(self, state: Floats32, sd_m: float) -> Floats32:
        """Return the map's log-likelihood at hypotheses, (N,), between the pixels' centres."""
        pixel_m, rows, cols = self.lattice.resolution_m, self.lattice.rows, self.lattice.cols
        centres = RasterFrame(pixel_m / 2, (rows - 0.5) * pixel_m, 1 / pixel_m, rows, cols)
        first = upper_left(state, centres)
        found = np.empty(first.size, dtype=np.float32)
        for number, which in self._by_tile(first):
            with self.tiles.lock:
                corner = self.tiles.tile(number).corner
                values = self.tiles.log_map(number, sd_m)
                interpolate_tile(state, first, which, centres, corner, values, found)
        return found

    def levels_at(self, pixel: Ints32, band: Ints) -> Floats32:
        """Return the levels of cells (N,), by their bands, each at a pixel (N,)."""
        pixel, level_dbm = np.asarray(pixel, dtype=np.int32), np.empty(pixel.size, dtype=np.float32)
        for first in range(0, pixel.size, _LEVELS_AT_ONCE):
            part = slice(first, first + _LEVELS_AT_ONCE)
            bands, at = np.unique(band[part], return_inverse=True)
            found_dbm, _ = self.looked_up(pixel[part], bands.astype(np.int32), rough=False)
            level_dbm[part] = found_dbm[np.arange(at.size), at]
        return level_dbm

    def matched_way(
        self, east_m: Floats32, north_m: Floats32, weight: Floats32
    ) -> tuple[int, float]:
        """Return the way that holds the largest share of a belief, and that share."""
        rows, cols = self.lattice.rows, self.lattice.cols
        pixel = pixels_from_south(east_m, north_m, rows, cols, 1 / self.lattice.resolution_m)
        way_id = np.zeros(pixel.size, dtype=np.int64)
        for number, which in self._by_tile(pixel):
            with self.tiles.lock:
                tile = self.tiles.tile(number)
                (top, left), points = tile.corner, tile.points
                at = points.near[pixel[which] // cols - top, pixel[which] % cols - left]
                way_id[which] = points.way_id[at]
        ways, rank = np.unique(way_id, return_inverse=True)
        mass = np.zeros(ways.size, dtype=np.float32)
        np.add.at(mass, rank, weight)
        best = int(np.argmax(mass))
        return int(ways[best]), min(float(mass[best]), 1.0)

    def _by_tile(self, pixel: Ints32) -> Iterator[tuple[int, Ints]]:
        """Yield each tile that pixels lie in, and which of them."""
        if not pixel.size:
            return
        side, tiles = self.tiles.side, self.tiles
        order, first, numbers = by_tile(pixel, self.lattice.cols, side, tiles.cols, self.count)
        for k, number in enumerate(numbers.tolist()):
            yield number, order[first[k] : first[k + 1]]

    @cached_property
    def count(self) -> int:
        """Number of tiles."""
        return self.tiles.rows * self.tiles.cols
