"""Levels, ways and distances of an area, prepared for compiled kernels."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numba import njit

from mapfilter._types import Bools, Bytes, Floats32, Ints, Ints32
from mapfilter.database.field import RadioField
from mapfilter.lattice import Lattice
from mapfilter.models.level_errors import roughness
from mapfilter.models.way_map import map_log_likelihood
from mapfilter.positioning.bayes.area.area_frame import (
    BELOW_FLOOR_DB,
    AreaFrame,
    carriers_of,
    interfering_of,
    sites_of,
)
from mapfilter.radio.cells import CellPlan
from mapfilter.radio.layers import layers_of

_CARRIAGEWAY_SHARE, _LEAST_CARRIAGEWAY_M = 0.3, 2.0
"""Of half a way's width, pavements included, and at least, but no more than half of its width: the
middles of the lanes beside its centre line."""


@dataclass(frozen=True, eq=False)
class AreaMap(AreaFrame):
    """An area whose levels are all held, with a value for each pixel and cell.

    Parameters
    ----------
    level_dbm : ndarray of float32, shape (rows, cols, C + 2L)
        Levels, and the strongest and second strongest of each of the L layers.
    distance_m : ndarray of float32, shape (rows, cols)
        To the edge of the nearest way, 0 on it.
    way_id : ndarray of int64, shape (rows, cols)
        Id of the way of the nearest point; 0 where that belongs to no way.
    on_way : ndarray of bool, shape (rows, cols)
        Whether the pixel is a point of the database.
    lattice, cell_ids, known_ids, carriers, floor_dbm, sites, interfering, layers
        As of :class:`AreaFrame`.
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
    interfering: frozenset[int] = frozenset()
    layers: tuple[int, ...] = ()

    @classmethod
    def of_field(cls, field: RadioField, plan: CellPlan, floor_dbm: float) -> AreaMap:
        """Prepare a field of a database.

        Where a cell is below the floor, a level a little below it is assumed.
        """
        rows, cols, count = field.level_dbm.shape
        layers = layers_of(plan, field.cell_ids)
        layer_of = np.array(layers, dtype=np.int64)
        total = count + 2 * (max(layers, default=0) + 1)
        level = np.empty((rows, cols, total), dtype=np.float32)
        quiet_dbm = np.float32(floor_dbm - BELOW_FLOOR_DB)
        np.copyto(level[..., :count], field.level_dbm)
        received = level[..., :count]
        received[np.isnan(received)] = quiet_dbm
        level[..., count:] = quiet_dbm
        for layer in range((total - count) // 2 if count else 0):
            own, first = np.flatnonzero(layer_of == layer), count + 2 * layer
            if own.size == 1:
                level[..., first] = received[..., own[0]]
                continue
            # One row at a time, as sorting all of them at once would double the memory.
            for row in range(rows):
                top = np.partition(received[row][:, own], own.size - 2, axis=-1)
                level[row, :, first], level[row, :, first + 1] = top[:, -1], top[:, -2]
        lane_m = None
        if not field.cell_ids:
            share_m = np.float32(_CARRIAGEWAY_SHARE) * field.half_width_m
            edge_m = np.maximum(share_m, np.float32(_LEAST_CARRIAGEWAY_M))
            edge_m = np.minimum(edge_m, field.half_width_m)
            lane_m = np.maximum(field.distance_to_way_m - edge_m, 0)
        return cls(
            field.lattice,
            field.cell_ids,
            frozenset(plan.ids),
            level,
            np.maximum(field.distance_to_way_m - field.half_width_m, 0),
            field.way_id,
            field.on_way,
            carriers_of(plan, field.cell_ids),
            floor_dbm,
            sites_of(plan),
            lane_m,
            interfering_of(plan, field.cell_ids),
            layers,
        )

    def of_carriageways(self) -> AreaMap | None:
        """Return the area with carriageways for ways; None where their distance is not known."""
        if self.carriageway_m is None:
            return None
        return replace(self, distance_m=self.carriageway_m)

    @cached_property
    def flat_level_dbm(self) -> Floats32:
        """Levels as one line of numbers, the bands of a pixel together."""
        return self.level_dbm.reshape(-1)

    def levels_at(self, pixel: Ints32, band: Ints) -> Floats32:
        """Return the levels of cells (N,), by their bands, each at a pixel (N,)."""
        found: Floats32 = self.level_dbm.reshape(-1, self.bands)[pixel, band]
        return found

    @cached_property
    def flat_rough_db(self) -> Bytes:
        """Local standard deviation of the levels in tenths of a dB, in the same order."""
        rough_db = roughness(self.level_dbm, self.lattice.resolution_m)
        return np.minimum(np.rint(10 * rough_db), 255).astype(np.uint8).reshape(-1)

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

    def log_map(self, sd_m: float) -> Floats32:
        """Return the map's log-likelihood at every pixel."""
        return map_log_likelihood(self.distance_m, sd_m)

    def matched_way(
        self, east_m: Floats32, north_m: Floats32, weight: Floats32
    ) -> tuple[int, float]:
        """Return the way that holds the largest share of a belief, and that share."""
        per_m, count = 1 / self.lattice.resolution_m, len(self.way_ids)
        rank, share = _heaviest(east_m, north_m, weight, self.way_rank, count, per_m)
        return int(self.way_ids[rank]), min(float(share), 1.0)


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
