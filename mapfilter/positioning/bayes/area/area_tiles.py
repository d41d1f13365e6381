"""Tiles of a large area, read from its database when they are looked up, and given up again.

A tile has the nearest point of each pixel, and the levels of a cell at these points: only of cells
that are looked up, and nothing of cells that are not received there. Of a cell those parts are read
that reach the tile. What was looked up longest ago is given up when all of it takes more than a
number of bytes.
"""

from __future__ import annotations

from functools import cached_property
from threading import RLock
from typing import Any

import numpy as np

from mapfilter._types import Bytes, Floats32, Ints, Ints32
from mapfilter.database.cell_levels import (
    CellLevels,
    PartExtents,
    PointReader,
    part_extents,
    read_levels,
)
from mapfilter.database.parquet import read_columns
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.models.level_errors import roughness_px
from mapfilter.models.tile_kernels import levels_at_points, tenths_of_roughness
from mapfilter.models.way_map import map_log_likelihood
from mapfilter.positioning.bayes.area.area_frame import BELOW_FLOOR_DB
from mapfilter.positioning.bayes.area.bounded_cache import BoundedCache
from mapfilter.positioning.bayes.area.tile_parts import LevelRange, Reaching, Tile, level_range

TILE_PX = 128
HELD_BYTES = 640 << 20
"""Most bytes of tiles and levels that are held at a time."""


class AreaTiles:
    """The tiles of a database's area.

    Whoever looks something up holds ``lock`` meanwhile, and keeps nothing but copies.

    Parameters
    ----------
    cell_ids : tuple of str
        Bands.
    layers : tuple of int
        Number of each band's layer; empty where all are of one.
    side : int
        Of a tile, pixels.
    largest_bytes : int
        Of everything that is held.
    """

    def __init__(
        self,
        database: RadioRouteDatabase,
        cell_ids: tuple[str, ...],
        layers: tuple[int, ...] = (),
        side: int = TILE_PX,
        largest_bytes: int = HELD_BYTES,
    ) -> None:
        self.database, self.cell_ids, self.layers, self.side = database, cell_ids, layers, side
        self.largest_bytes = largest_bytes
        lattice = database.lattice
        self.rows, self.cols = -(-lattice.rows // side), -(-lattice.cols // side)
        self.quiet_dbm = np.float32(database.floor_dbm - BELOW_FLOOR_DB)
        self.lock = RLock()
        self.held = BoundedCache(largest_bytes)
        self._ranges: dict[int, LevelRange] = {}
        self._rough_px = roughness_px(lattice.resolution_m)
        self._halo = self._rough_px // 2

    def __getstate__(self) -> tuple[Any, ...]:
        # Other processes read for themselves.
        return self.database, self.cell_ids, self.layers, self.side, self.largest_bytes

    def __setstate__(self, state: tuple[Any, ...]) -> None:
        self.__init__(*state)  # type: ignore[misc]

    @cached_property
    def extents(self) -> PartExtents:
        """Where the parts of the cells lie, and how strong they are."""
        with self.lock:
            return part_extents(self.database, self.cell_ids)

    @cached_property
    def _reader(self) -> PointReader:
        return PointReader(self.database)

    def tile(self, number: int) -> Tile:
        """Return a tile."""

        def make() -> Tile:
            lattice, side, halo = self.database.lattice, self.side, self._halo
            top, left = side * (number // self.cols), side * (number % self.cols)
            bottom, right = min(top + side, lattice.rows), min(left + side, lattice.cols)
            first_row, first_col = max(top - halo, 0), max(left - halo, 0)
            rows = min(bottom + halo, lattice.rows) - first_row
            cols = min(right + halo, lattice.cols) - first_col
            points = self._reader.nearest((first_row, first_col, rows, cols))
            row, col = points.point // lattice.cols, points.point % lattice.cols
            own = (row >= top) & (row < bottom) & (col >= left) & (col < right)
            box = int(row.min()), int(row.max()), int(col.min()), int(col.max())
            return Tile(points, row[own], col[own], box)

        return self.held.get(("tile", number), make)

    def every_point(self) -> Ints:
        """Return the numbers of all points of the database, without what is known there."""
        point = read_columns(self.database.points_part, ("point",))["point"].to_numpy()
        return np.sort(point)

    def log_map(self, number: int, sd_m: float) -> Floats32:
        """Return the map's log-likelihood at the pixels of a tile's arrays."""

        def make() -> Floats32:
            return map_log_likelihood(self.tile(number).points.edge_m, sd_m)

        return self.held.get(("ways", number, sd_m), make)

    def levels(self, number: int, band: int) -> Floats32 | None:
        """Return a cell's levels at a tile's nearest points, (P,); None where it has none.

        Bands from C on are the strongest and the second strongest level of each layer.
        """
        points, count = self.tile(number).points, len(self.cell_ids)
        if band >= count and max(self.layers, default=0) == 0:
            top_dbm = points.best_dbm if band == count else points.second_dbm
            return np.where(np.isnan(top_dbm), self.quiet_dbm, top_dbm)
        if band >= count:
            layer, place = divmod(band - count, 2)
            level_dbm: Floats32 = self._strongest(number, layer)[place]
            return level_dbm
        reaching = self._reaching(number).band
        at = int(np.searchsorted(reaching, band))
        if at == reaching.size or reaching[at] != band:
            return None

        parts = self._reaching(number).part[at]

        def make() -> Floats32 | None:
            every_dbm, received = None, False
            for part in parts.tolist():
                level_dbm, there = levels_at_points(
                    points.point, *self._levels_of_part(part), float(self.quiet_dbm)
                )
                # A point is in one part of a cell, and quiet in the others.
                every_dbm = level_dbm if every_dbm is None else np.maximum(every_dbm, level_dbm)
                received |= there
            return every_dbm if received else None

        return self.held.get(("levels", number, band), make)

    def _strongest(self, number: int, layer: int) -> Floats32:
        """Return the strongest and the second strongest level of a layer's cells, (2, P)."""

        def make() -> Floats32:
            points = self.tile(number).points.point
            top_dbm = np.full((2, points.size), self.quiet_dbm, dtype=np.float32)
            for band in self._reaching(number).band.tolist():
                level_dbm = self.levels(number, band) if self.layers[band] == layer else None
                if level_dbm is not None:
                    top_dbm[1] = np.maximum(top_dbm[1], np.minimum(top_dbm[0], level_dbm))
                    top_dbm[0] = np.maximum(top_dbm[0], level_dbm)
            return top_dbm

        return self.held.get(("strongest", number, layer), make)

    def rough_db(self, number: int, band: int) -> Bytes | None:
        """Return the roughness of a cell's levels at a tile's pixels; None where it has none."""
        level_dbm = self.levels(number, band)
        if level_dbm is None:
            return None

        def make() -> Bytes:
            near, size = self.tile(number).points.near, self._rough_px
            tenths: Bytes = tenths_of_roughness(level_dbm, near, size)
            return tenths

        return self.held.get(("rough", number, band), make)

    def strong(self, number: int, bands: Ints32, limit_dbm: Floats32) -> Ints:
        """Return the places in ``bands`` of cells that may be above levels (K,) in a tile.

        ``bands`` (K,) ascend, and so do the places. Cells are read for it only where the footers
        of their parts leave it open.
        """
        reaching = self._reaching(number)
        if not bands.size:
            return np.empty(0, dtype=np.intp)
        place = np.minimum(np.searchsorted(bands, reaching.band), bands.size - 1)
        limit = np.where(bands[place] == reaching.band, limit_dbm[place], np.inf)
        for k in np.flatnonzero((reaching.bound_dbm > limit) & ~reaching.exact).tolist():
            level_dbm = self.levels(number, int(reaching.band[k]))
            reaching.bound_dbm[k] = -np.inf if level_dbm is None else level_dbm.max()
            reaching.exact[k] = True
        found: Ints = place[reaching.bound_dbm > limit]
        return found

    def _reaching(self, number: int) -> Reaching:
        """Return the cells with a part that may reach a tile's nearest points."""

        def make() -> Reaching:
            top, bottom, left, right = self.tile(number).box
            low, high, west, east = self.extents.box.T
            meets = (low <= bottom) & (high >= top) & (west <= right) & (east >= left)
            part = np.flatnonzero(meets)
            band, first = np.unique(self.extents.band[part], return_index=True)
            parts = tuple(np.split(part, first[1:])) if part.size else ()
            bound_dbm = np.array([self.extents.most_dbm[some].max() for some in parts])
            return Reaching(band, bound_dbm, np.zeros(band.size, dtype=np.bool_), parts)

        return self.held.get(("reaching", number), make)

    def range_of(self, band: int) -> LevelRange:
        """Return the range of a cell's levels by tiles; kept for good once it was read."""
        found = self._ranges.get(band)
        if found is None:
            parts = [self._levels_of_part(k) for k in self._parts_of(band)]
            found = level_range(parts, self.database.lattice.cols, self.side, self.rows, self.cols)
            self._ranges[band] = found
        return found

    def _parts_of(self, band: int) -> list[int]:
        first, end = np.searchsorted(self.extents.band, [band, band + 1]).tolist()
        return list(range(first, end))

    def _levels_of_part(self, part: int) -> CellLevels:
        """Return the levels of a part, by its place among the extents."""

        def make() -> CellLevels:
            return read_levels(self.extents.part[part], self.database.lattice)

        return self.held.get(("part", part), make)
