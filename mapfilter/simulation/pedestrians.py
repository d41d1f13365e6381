"""Pedestrians who follow a gas that diffuses from their destination.

A source at the target gives off gas, which spreads between the houses and decays; nothing passes a
wall. A pedestrian walks up the gradient: by the shortest way in the large, on smooth curves in the
small, and never into a wall (Kammann, Angermann & Lami, *A new mobility model based on maps*, VTC
2003, as the DLR paper adapts it).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy import ndimage
from scipy.sparse import coo_array
from scipy.sparse.linalg import splu

from mapfilter._types import Bools, Floats
from mapfilter.errors import Faults, InputError, fail
from mapfilter.lattice import Lattice

_ARRIVED_CELLS = 2.0
_LEAST_TARGETS_M = 50.0
_TINY = 1e-300


class GasGround:
    """Open ground on which gas spreads.

    With the gas c at a cell and decay over the length L, in a steady state
    ``Σ (c_j - c) - (h / L)² c + s = 0`` over the open cells j beside it, h their side.

    Parameters
    ----------
    free : (rows, cols) array of bool
        Open ground; what its largest connected part does not hold is left out.
    reach_m : float
        L.

    Raises
    ------
    InputError
        Shapes differ, nothing is free, or the length is not above 0.
    """

    def __init__(self, lattice: Lattice, free: Bools, reach_m: float = 100.0) -> None:
        faults = Faults()
        if free.shape != (lattice.rows, lattice.cols):
            faults.add("ground, free", f"shape ({lattice.rows}, {lattice.cols})", free.shape)
        elif not free.any():
            faults.add("ground, free", "open cells", "none")
        faults.check_positive("ground, ", "metres", reach_m=reach_m)
        faults.raise_if_any(InputError)
        parts, count = ndimage.label(free)
        largest = 1 + int(np.argmax(np.bincount(parts.ravel(), minlength=count + 1)[1:]))
        self.lattice = lattice
        self.free: Bools = parts == largest
        self._cell = np.argwhere(self.free)
        number = np.full(free.shape, -1)
        number[self.free] = np.arange(len(self._cell))
        self._number = number
        below, right = self.free[:-1] & self.free[1:], self.free[:, :-1] & self.free[:, 1:]
        down = [number[:-1][below], number[1:][below]]
        pairs = np.hstack([down, [number[:, :-1][right], number[:, 1:][right]]])
        size = len(self._cell)
        loss = np.bincount(pairs.ravel(), minlength=size) + (lattice.resolution_m / reach_m) ** 2
        row = np.concatenate([pairs[0], pairs[1], np.arange(size)])
        column = np.concatenate([pairs[1], pairs[0], np.arange(size)])
        value = np.concatenate([np.full(2 * pairs.shape[1], -1.0), loss])
        self._solver = splu(coo_array((value, (row, column)), shape=(size, size)).tocsc())

    def draw_place(self, rng: np.random.Generator) -> Floats:
        """Draw an open place, evenly, shape (2,): east and north."""
        row, col = self._cell[rng.integers(len(self._cell))] + rng.uniform(-0.5, 0.5, 2)
        return np.array(self.lattice.east_north(row, col))

    def ways(self, target_m: ArrayLike) -> Floats:
        """Return the gradient of the logarithm of the gas from a target, (rows, cols, 2).

        East and north, per metre; 0 where nothing is free.

        Raises
        ------
        InputError
            The target is not on open ground.
        """
        target = np.asarray(target_m, dtype=np.float64)
        if not (np.isfinite(target).all() and self.is_free(target)):
            raise fail(InputError, "target_m", "a place on open ground", target)
        source = np.zeros(len(self._cell))
        source[self._number[self.lattice.row_col(*target)]] = 1.0
        gas = np.zeros(self.free.shape)
        gas[self.free] = np.log(np.maximum(self._solver.solve(source), _TINY))
        gradient = np.zeros((*self.free.shape, 2))
        for axis, component, sign in ((0, 1, -1.0), (1, 0, 1.0)):
            ahead = np.moveaxis(gas, axis, 0)
            open_ = np.moveaxis(self.free, axis, 0)
            both = open_[1:] & open_[:-1]
            step = np.where(both, ahead[1:] - ahead[:-1], 0.0)
            total = np.zeros_like(ahead)
            total[1:] += step
            total[:-1] += step
            # Nothing flows through a wall: there the difference is 0.
            gradient[..., component] = np.moveaxis(total, 0, axis) * sign / 2
        return gradient / self.lattice.resolution_m

    def toward(self, ways: Floats, place_m: Floats) -> Floats:
        """Return the unit vector along the gradient at a place, from the four cells around it."""
        resolution = self.lattice.resolution_m
        east = (place_m[0] - self.lattice.west_m) / resolution - 0.5
        north = (self.lattice.north_m - place_m[1]) / resolution - 0.5
        found = np.zeros(2)
        first_row, first_col = int(np.floor(north)), int(np.floor(east))
        for row in (first_row, first_row + 1):
            for col in (first_col, first_col + 1):
                if self._is_free(row, col):
                    weight = (1 - abs(north - row)) * (1 - abs(east - col))
                    found += weight * ways[row, col]
        length = float(np.hypot(*found))
        return found / length if length > 0 else found

    def is_free(self, place_m: Floats) -> bool:
        """Return whether a place is on open ground."""
        return self._is_free(*self.lattice.row_col(*place_m))

    def _is_free(self, row: int, col: int) -> bool:
        inside = 0 <= row < self.free.shape[0] and 0 <= col < self.free.shape[1]
        return inside and bool(self.free[row, col])


def gas_walk(
    ground: GasGround,
    steps: int,
    speed_mps: float,
    rng: np.random.Generator,
    interval_s: float = 1.0,
) -> Floats:
    """Draw a walk from a random place to random targets, one after another.

    Positions, of shape (steps, 2), are one interval apart; the first one is an interval after the
    start.

    Raises
    ------
    InputError
        A number is not above 0.
    """
    faults = Faults()
    rates = {"speed_mps": speed_mps, "interval_s": interval_s}
    faults.check_positive("gas walk, ", "a number", steps=steps, **rates)
    faults.raise_if_any(InputError)
    cell_m = ground.lattice.resolution_m
    pieces = max(1, int(np.ceil(speed_mps * interval_s / (0.5 * cell_m))))
    stride_m = speed_mps * interval_s / pieces
    place, way = ground.draw_place(rng), None
    target = place
    found = np.empty((steps, 2))
    for k in range(steps):
        for _ in range(pieces):
            if way is None or np.hypot(*(target - place)) < _ARRIVED_CELLS * cell_m:
                target = _next_target(ground, place, rng)
                way = ground.ways(target)
            place = _stepped(ground, place, stride_m * ground.toward(way, place))
        found[k] = place
    return found


def _next_target(ground: GasGround, place_m: Floats, rng: np.random.Generator) -> Floats:
    """Draw a place that is not here; in a small yard the last one drawn will do."""
    for _ in range(20):
        target = ground.draw_place(rng)
        if np.hypot(*(target - place_m)) > _LEAST_TARGETS_M:
            break
    return target


def _stepped(ground: GasGround, place_m: Floats, step_m: Floats) -> Floats:
    """Return the place after a step; at a wall's corner, where cells are coarse, along the wall."""
    for one in (step_m, step_m * [1.0, 0.0], step_m * [0.0, 1.0]):
        if ground.is_free(place_m + one):
            return place_m + one
    return place_m
