"""Extent, cells and sites of an area in a local frame, however its levels are held."""

from __future__ import annotations

import hashlib
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from functools import cached_property

import numpy as np

from mapfilter._types import Bools, Floats, Floats32, Ints, Ints32
from mapfilter.lattice import Lattice
from mapfilter.models.fingerprint import RasterFrame
from mapfilter.models.way_map import all_inside, places_beyond, weight_inside
from mapfilter.radio.cells import CellPlan
from mapfilter.radio.identities import LIMITS

BELOW_FLOOR_DB = 6.0
"""How far below the floor a level is assumed to be that the database does not hold."""
_EDGE_M, _EDGE_SHARE, _ROUNDING_M = 60.0, 0.05, 1.0
_F = np.float32


class AreaFrame(ABC):
    """An area in a local frame, whose origin is the lattice's south-western corner.

    In single precision a UTM northing is resolved to half a metre, a local one to micrometres.

    Parameters
    ----------
    cell_ids : tuple of str
        Cells with a level somewhere in the area: bands 0 to C - 1.
    known_ids : frozenset of str
        All cells of the database, also those without a level here.
    carriers : mapping
        Bands of the cells on each (ARFCN, BSIC); BSIC -1 for all on the carrier.
    floor_dbm : float
        Weaker levels are not in the database.
    sites : mapping of str to tuple of float
        East, north and height of all cells of the database.
    interfering : frozenset of int
        Bands of the cells that a phone may not find though they are above the floor
        (:func:`interfering_of`).
    layers : tuple of int
        Number of each band's layer, from 0 (:mod:`mapfilter.radio.layers`); empty where all are of
        one.
    """

    lattice: Lattice
    cell_ids: tuple[str, ...]
    known_ids: frozenset[str]
    carriers: dict[tuple[int, int], tuple[int, ...]]
    floor_dbm: float
    sites: Mapping[str, tuple[float, float, float]]
    interfering: frozenset[int]
    layers: tuple[int, ...]

    @abstractmethod
    def levels_at(self, pixel: Ints32, band: Ints) -> Floats32:
        """Return the levels of cells (N,), by their bands, each at a pixel (N,)."""

    @abstractmethod
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

    @cached_property
    def uncoded(self) -> frozenset[int]:
        """Bands of the cells that no carrier with a code tells: any such neighbour may be one."""
        coded = {band for (_, code), bands in self.carriers.items() if code >= 0 for band in bands}
        return frozenset(range(len(self.cell_ids))) - coded

    @cached_property
    def layer_of(self) -> Ints:
        """Number of each band's layer, (C,)."""
        layers = self.layers or (0,) * len(self.cell_ids)
        return np.array(layers, dtype=np.int64)

    @cached_property
    def bands(self) -> int:
        """Number of bands: of cells, and of each layer its strongest and second strongest level."""
        return len(self.cell_ids) + 2 * (max(self.layers, default=0) + 1)

    def strongest(self, band: int) -> int:
        """Return the band with the strongest level of a cell's layer; the next is the second."""
        return len(self.cell_ids) + 2 * int(self.layer_of[band])

    @cached_property
    def checksum(self) -> str:
        """Checksum of lattice, floor and cells, by which states are told from those of others."""
        made_of = (self.lattice, self.floor_dbm, self.cell_ids)
        return hashlib.sha256(repr(made_of).encode()).hexdigest()

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
        found: Bools = places_beyond(state[0], state[1], *self.size_m)
        return found

    def holds_all(self, east_m: Floats32, north_m: Floats32) -> bool:
        """Return whether all places (N,) in the local frame lie in the area."""
        return bool(all_inside(east_m, north_m, *self.size_m))

    def holds(self, east_m: Floats32, north_m: Floats32, weight: Floats32) -> bool:
        """Return whether most of a belief in the local frame lies in the area."""
        if self.holds_all(east_m, north_m):
            return bool(weight.size)
        return bool(weight_inside(east_m, north_m, weight, *self.size_m) > 0.5)


def carriers_of(plan: CellPlan, cell_ids: Iterable[str]) -> dict[tuple[int, int], tuple[int, ...]]:
    """Return the bands of cells on each (ARFCN, BSIC); BSIC -1 for all on the carrier."""
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


def interfering_of(plan: CellPlan, cell_ids: Iterable[str]) -> frozenset[int]:
    """Return the bands of cells of GSM, UMTS, LTE and NR, but not of an unknown technology.

    Neighbours share a carrier, so a phone finds one only where the stronger ones do not drown it:
    in LTE at -6 dB of signal to interference (3GPP TS 36.133). In GSM it looks for the carriers
    that the network names, and has to read the code beside other cells on that carrier.
    """
    found = {cell.id for cell in plan.cells if cell.technology in LIMITS}
    return frozenset(band for band, cell in enumerate(cell_ids) if cell in found)


def sites_of(plan: CellPlan) -> dict[str, tuple[float, float, float]]:
    """Return east, north and height of each cell."""
    return {cell.id: (cell.east_m, cell.north_m, cell.height_m) for cell in plan.cells}
