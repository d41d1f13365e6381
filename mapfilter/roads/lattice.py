"""The route lattice: the accessible points of the radio rasters' lattice."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mapfilter._types import Bools, Floats, Floats32, Ints, Ints32
from mapfilter._words import number_of
from mapfilter.errors import Faults, InputError, fail
from mapfilter.lattice import Lattice

_COLUMNS: Mapping[str, type[np.generic]] = {
    "row": np.int32,
    "col": np.int32,
    "way_id": np.int64,
    "way_class": np.int16,
    "distance_to_way_m": np.float32,
    "on_square": np.bool_,
}


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class RouteLattice:
    """Lattice points that are accessible on foot or by car.

    Columns may be given as lists, or as arrays of another type that hold such numbers.

    Parameters
    ----------
    lattice : Lattice
        The points are centres of its pixels.
    row, col : numpy.ndarray of int32, shape (N,)
        The points, in strictly ascending row-major order.
    way_id : numpy.ndarray of int64, shape (N,)
        The way that the point belongs to; 0 when it only lies in a square or in a class of land
        use.
    way_class : numpy.ndarray of int16, shape (N,)
        Index into ``class_names``.
    class_names : tuple of str
        Kinds of way; points without a way have the class "square" or that of their land use.
    distance_to_way_m : numpy.ndarray of float32, shape (N,)
        Distance to the nearest way's centre line, also of points that belong to none; infinite
        when the area has no way.
    on_square : numpy.ndarray of bool, shape (N,)
        The point lies in a square or in a walkable class of land use.
    attribution : str
        What the licence of the map asks for; a database that is built of the points keeps it, and
        pictures show it.
    notes : tuple of str
        What of the roads was left out, and settings that no way met.
    """

    lattice: Lattice
    row: Ints32
    col: Ints32
    way_id: Ints
    way_class: NDArray[np.int16]
    class_names: tuple[str, ...]
    distance_to_way_m: Floats32
    on_square: Bools
    attribution: str = ""
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        faults = Faults()
        for name, kind in _COLUMNS.items():
            object.__setattr__(self, name, _column(name, getattr(self, name), kind, faults))
        faults.raise_if_any(InputError)
        columns = (self.col, self.way_id, self.way_class, self.distance_to_way_m, self.on_square)
        if any(column.shape != self.row.shape for column in columns):
            shapes = ", ".join(str(column.shape) for column in columns)
            raise fail(InputError, "route lattice", f"columns of length {len(self)}", shapes)
        if not np.all(self.lattice.contains(self.row, self.col)):
            faults.add("route lattice", "points on the lattice", "some off the lattice")
        if np.any(np.diff(self.point) <= 0):
            faults.add("route lattice", "ascending row-major order", "another order")
        if np.any((self.way_class < 0) | (self.way_class >= len(self.class_names))):
            faults.add("route lattice, way_class", f"0..{len(self.class_names) - 1}", "others")
        if not np.all(self.distance_to_way_m >= 0):
            faults.add("route lattice, distance_to_way_m", "metres >= 0", "negative or NaN")
        faults.raise_if_any(InputError)

    def __len__(self) -> int:
        return int(self.row.size)

    def __repr__(self) -> str:
        notes = f"; {number_of(len(self.notes), 'note')}" if self.notes else ""
        size = f"{len(self)} points, {len(self.class_names)} classes"
        return f"RouteLattice({size}; {self.lattice}{notes})"

    @property
    def crs(self) -> str:
        """CRS of the lattice."""
        return self.lattice.crs

    @property
    def point(self) -> Ints:
        """Point numbers, ``row * lattice.cols + col``: the same in every rebuild, shape (N,)."""
        return self.row.astype(np.int64) * self.lattice.cols + self.col

    @property
    def east_north_m(self) -> tuple[Floats, Floats]:
        """Positions of the points, shape (N,) each."""
        east, north = self.lattice.east_north(self.row, self.col)
        return east, north

    def mask(self) -> Bools:
        """Return a raster of the points, shape (lattice.rows, lattice.cols)."""
        mask = np.zeros((self.lattice.rows, self.lattice.cols), dtype=np.bool_)
        mask[self.row, self.col] = True
        return mask


def _column(name: str, given: Any, kind: type[np.generic], faults: Faults) -> NDArray[Any]:
    """Return a column as an array of its type, the same where it is one."""
    where, found = f"route lattice, {name}", np.asarray(given)
    if found.ndim != 1:
        faults.add(where, "one dimension", found.shape)
    elif found.dtype == kind:
        return found
    elif not issubclass(kind, np.integer):
        other = kind is np.bool_ and ~np.isin(found, (0, 1))
        if found.dtype.kind not in "biuf":
            faults.add(where, "numbers", _kind_of(found))
        elif np.any(other):
            faults.add(where, "true or false", found[other][0])
        else:
            return found.astype(kind)
    elif found.dtype.kind not in "iuf":
        faults.add(where, "whole numbers", _kind_of(found))
    else:
        broken = ~np.isfinite(found) | (found != np.floor(found))
        limits = np.iinfo(kind)
        # As a float the largest number of 64 bits is one more than that.
        beyond = (found < limits.min) | (found >= limits.max + 1)
        if not broken.any() and not beyond.any():
            return found.astype(kind)
        expected = "whole numbers" if broken.any() else f"whole numbers of {kind.__name__}"
        faults.add(where, expected, found[broken if broken.any() else beyond][0])
    return np.empty(0, kind)


def _kind_of(values: NDArray[Any]) -> str:
    return "text" if values.dtype.kind in "US" else str(values.dtype)
