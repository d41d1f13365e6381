"""Levels, ways and distances of an area, prepared for compiled kernels."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numba import njit

from mapfilter._types import Bools, Bytes, Floats, Floats32, Ints, Ints32
from mapfilter.database.radioroutes import RadioField
from mapfilter.geodesy import Lattice
from mapfilter.models.fingerprint import RasterFrame
from mapfilter.models.level_errors import roughness
from mapfilter.models.street_motion import map_log_likelihood
from mapfilter.models.way_map import all_inside, places_beyond
from mapfilter.radio.cells import CellPlan

BELOW_FLOOR_DB = 6.0
"""How far below the floor a level is assumed to be that the database does not hold."""
_EDGE_M, _EDGE_SHARE, _ROUNDING_M = 60.0, 0.05, 1.0
_CARRIAGEWAY_SHARE, _LEAST_CARRIAGEWAY_M = 0.3, 2.0
"""Of half a way's width, pavements included, and at least: the middles of the lanes beside its
centre line."""
_F = np.float32


@dataclass(frozen=True, eq=False)
class AreaMap:
    """An area in a local frame, whose origin is the lattice's south-western corner.

    In single precision a UTM northing is resolved to half a metre, a local one to micrometres.

    Parameters
    ----------
    cell_ids : tuple of str
        Cells with a level somewhere in the area: bands 0 to C - 1.
    known_ids : frozenset of str
        All cells of the database, also those without a level here.
    level_dbm : ndarray of float32, shape (rows, cols, C + 2)
        Levels, and the strongest and second strongest of each pixel.
    distance_m : ndarray of float32, shape (rows, cols)
        To the edge of the nearest way, 0 on it.
    way_id : ndarray of int64, shape (rows, cols)
        Id of the way of the nearest point; 0 where that belongs to no way.
    on_way : ndarray of bool, shape (rows, cols)
        Whether the pixel is a point of the database.
    carriers : mapping
        Bands of the cells on each (ARFCN, BSIC); BSIC -1 for all on the carrier.
    floor_dbm : float
        Weaker levels are not in the database.
    sites : mapping of str to tuple of float
        East, north and height of all cells of the database.
    carriageway_m : ndarray of float32, shape (rows, cols), or None
        To the edge of the nearest carriageway; None in a database with cells.
    """

    lattice: Lattice
    cell_ids: tuple[str, ...]
    known_ids: frozenset[str]
    level_dbm: Floats32
    distance_m: Floats32
    way_id: Ints
    on_way: Bools
    carriers: dict[tuple[int, int], tuple[int, ...]]
    floor_dbm: float
    sites: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)
    carriageway_m: Floats32 | None = None

    @classmethod
    def of_field(cls, field: RadioField, plan: CellPlan, floor_dbm: float) -> AreaMap:
        """Prepare a field of a database.

        Where a cell is below the floor, a level a little below it is assumed.
        """
        rows, cols, count = field.level_dbm.shape
        level = np.empty((rows, cols, count + 2), dtype=np.float32)
        quiet_dbm = np.float32(floor_dbm - BELOW_FLOOR_DB)
        np.copyto(level[..., :count], field.level_dbm)
        received = level[..., :count]
        received[np.isnan(received)] = quiet_dbm
        level[..., count:] = quiet_dbm
        if count > 1:
            # One row at a time, as sorting all of them at once would double the memory.
            for row in range(rows):
                top = np.partition(received[row], count - 2, axis=-1)
                level[row, :, count], level[row, :, count + 1] = top[:, -1], top[:, -2]
        elif count:
            level[..., count] = received[..., 0]
        lane_m = None
        if not field.cell_ids:
            share_m = np.float32(_CARRIAGEWAY_SHARE) * field.half_width_m
            edge_m = np.maximum(share_m, np.float32(_LEAST_CARRIAGEWAY_M))
            lane_m = np.maximum(field.distance_to_way_m - edge_m, 0)
        return cls(
            field.lattice,
            field.cell_ids,
            frozenset(plan.ids),
            level,
            np.maximum(field.distance_to_way_m - field.half_width_m, 0),
            field.way_id,
            field.on_way,
            _carriers(plan, field.cell_ids),
            floor_dbm,
            {cell.id: (cell.east_m, cell.north_m, cell.height_m) for cell in plan.cells},
            lane_m,
        )

    def of_carriageways(self) -> AreaMap | None:
        """Return the area with carriageways for ways; None where their distance is not known."""
        if self.carriageway_m is None:
            return None
        return replace(self, distance_m=self.carriageway_m)

    @cached_property
    def origin_m(self) -> tuple[float, float]:
        """East and north of the local frame's origin."""
        west, south, _, _ = self.lattice.bounds_m
        return west, south

    @cached_property
    def size_m(self) -> tuple[float, float]:
        """East and north extent."""
        west, south, east, north = self.lattice.bounds_m
        return east - west, north - south

    @cached_property
    def frame(self) -> RasterFrame:
        """Where the lattice's pixels lie in the local frame."""
        rows, cols, step = self.lattice.rows, self.lattice.cols, self.lattice.resolution_m
        return RasterFrame(0.0, rows * step, 1 / step, rows, cols)

    @cached_property
    def flat_level_dbm(self) -> Floats32:
        """Levels as one line of numbers, the bands of a pixel together."""
        return self.level_dbm.reshape(-1)

    @cached_property
    def flat_rough_db(self) -> Bytes:
        """Local standard deviation of the levels in tenths of a dB, in the same order."""
        rough_db = roughness(self.level_dbm, self.lattice.resolution_m)
        return np.minimum(np.rint(10 * rough_db), 255).astype(np.uint8).reshape(-1)

    @cached_property
    def site_of(self) -> Ints:
        """Number of the site of each band; cells at one place are of one site."""
        places = {cell: self.sites[cell][:2] for cell in self.cell_ids if cell in self.sites}
        numbers: dict[object, int] = {}
        found = [numbers.setdefault(places.get(c, c), len(numbers)) for c in self.cell_ids]
        return np.array(found, dtype=np.int64)

    @cached_property
    def band_of(self) -> dict[str, int]:
        """Band of each cell."""
        return {cell: band for band, cell in enumerate(self.cell_ids)}

    @cached_property
    def way_ids(self) -> Ints:
        """All ways of the area in ascending order; 0 stands for none."""
        return np.unique(self.way_id)

    @cached_property
    def way_rank(self) -> Ints32:
        """Index into ``way_ids`` of each pixel, shape (rows, cols)."""
        return np.searchsorted(self.way_ids, self.way_id).astype(np.int32)

    @cached_property
    def points(self) -> Floats32:
        """East and north in the local frame of all points on ways, shape (2, P)."""
        row, col = np.nonzero(self.on_way)
        step = self.lattice.resolution_m
        return np.stack([(col + 0.5) * step, (self.lattice.rows - row - 0.5) * step]).astype(
            np.float32
        )

    def at_edge(self, place_m: Floats) -> bool:
        """Return whether a place in the local frame is near the edge of the area, or beyond."""
        (width_m, height_m), east_m, north_m = self.size_m, float(place_m[0]), float(place_m[1])
        inside_m = min(east_m, width_m - east_m, north_m, height_m - north_m)
        return inside_m < self._edge_m

    def clear_of_edge(self, state: Floats32) -> bool:
        """Return whether all hypotheses, by their first two rows, lie well away from the edge.

        Then so does their mean.
        """
        (width_m, height_m), away_m = self.size_m, self._edge_m + _ROUNDING_M
        shape = width_m - 2 * away_m, height_m - 2 * away_m
        return bool(all_inside(state[0] - _F(away_m), state[1] - _F(away_m), *shape))

    @property
    def _edge_m(self) -> float:
        return min(_EDGE_M, _EDGE_SHARE * min(self.size_m))

    def beyond(self, state: Floats32) -> Bools:
        """Return whether each hypothesis, by its first two rows, lies beyond the area, (N,)."""
        found: Bools = places_beyond(state, *self.size_m)
        return found

    def holds(self, east_m: Floats32, north_m: Floats32, weight: Floats32) -> bool:
        """Return whether most of a belief in the local frame lies in the area."""
        width_m, height_m = self.size_m
        if all_inside(east_m, north_m, width_m, height_m):
            return bool(weight.size)
        inside = (east_m >= 0) & (east_m <= width_m) & (north_m >= 0) & (north_m <= height_m)
        return bool(np.sum(weight[inside]) > 0.5)

    def log_map(self, sd_m: float) -> Floats32:
        """Return the map's log-likelihood at every pixel."""
        return map_log_likelihood(self.distance_m, sd_m)

    def matched_way(
        self, east_m: Floats32, north_m: Floats32, weight: Floats32
    ) -> tuple[int, float]:
        """Return the way whose nearest points hold the largest share of a belief, and that share.

        Parameters
        ----------
        east_m, north_m, weight : ndarray of float32, shape (N,)
            In the local frame; weights sum to one.

        Returns
        -------
        way_id : int
            0 where the largest share lies in squares, off all ways.
        """
        per_m, count = 1 / self.lattice.resolution_m, len(self.way_ids)
        rank, share = _heaviest(east_m, north_m, weight, self.way_rank, count, per_m)
        return int(self.way_ids[rank]), min(float(share), 1.0)


def _carriers(plan: CellPlan, cell_ids: Iterable[str]) -> dict[tuple[int, int], tuple[int, ...]]:
    band_of = {cell: band for band, cell in enumerate(cell_ids)}
    found: dict[tuple[int, int], tuple[int, ...]] = {}
    for cell in plan.cells:
        band = band_of.get(cell.id)
        if band is None or cell.arfcn is None:
            continue
        keys = [(cell.arfcn, -1)] + ([(cell.arfcn, cell.bsic)] if cell.bsic is not None else [])
        for key in keys:
            found[key] = (*found.get(key, ()), band)
    return found


@njit(error_model="numpy", cache=True)
def _heaviest(
    east_m: Floats32,
    north_m: Floats32,
    weight: Floats32,
    way_rank: Ints32,
    ways: int,
    per_m: float,
) -> tuple[int, float]:
    rows, cols = way_rank.shape
    count, last_col, last_row = weight.size, np.int32(cols - 1), np.int32(rows - 1)
    pixel, flat = np.empty(count, dtype=np.int32), way_rank.ravel()
    zero = np.int32(0)
    for i in range(count):
        col, row = np.int32(east_m[i] * per_m), np.int32(north_m[i] * per_m)
        col = col if col > zero else zero
        row = row if row > zero else zero
        col = col if col < last_col else last_col
        row = row if row < last_row else last_row
        pixel[i] = np.int32(np.int32(last_row - row) * np.int32(cols)) + col
    mass = np.zeros(ways, dtype=np.float32)
    for i in range(count):
        mass[np.uint32(flat[np.uint32(pixel[i])])] += weight[i]
    best = int(np.argmax(mass))
    return best, mass[best]
