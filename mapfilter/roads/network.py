"""The street network: what journeys are routed on."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from mapfilter.geodesy import Floats


@dataclass(frozen=True, eq=False)
class StreetNetwork:
    """Straight street segments between nodes; the largest connected part of the ways.

    Parameters
    ----------
    crs : str
        Projected CRS, in metres.
    east_m, north_m : numpy.ndarray, shape (N,)
        The nodes.
    node_a, node_b : numpy.ndarray of int32, shape (E,)
        Ends of each edge; the way is drawn from a to b.
    length_m : numpy.ndarray, shape (E,)
        Length of each edge.
    way_id : numpy.ndarray of int64, shape (E,)
        The way that the edge belongs to.
    way_class : numpy.ndarray of int16, shape (E,)
        Index into ``class_names``.
    class_names : tuple of str
        Kinds of way.
    oneway : numpy.ndarray of int8, shape (E,)
        1 when only a to b is allowed, -1 when only b to a, 0 when both.
    """

    crs: str
    east_m: Floats
    north_m: Floats
    node_a: NDArray[np.int32]
    node_b: NDArray[np.int32]
    length_m: Floats
    way_id: NDArray[np.int64]
    way_class: NDArray[np.int16]
    class_names: tuple[str, ...]
    oneway: NDArray[np.int8]

    @cached_property
    def adjacency(self) -> Any:
        """Lengths between neighbouring nodes (m), ``scipy.sparse.csr_array``, shape (N, N).

        Entry (i, j) exists when one may go from i to j; of parallel edges the shortest counts.
        """
        forth, back = self.oneway >= 0, self.oneway <= 0
        start = np.concatenate([self.node_a[forth], self.node_b[back]])
        end = np.concatenate([self.node_b[forth], self.node_a[back]])
        length = np.concatenate([self.length_m[forth], self.length_m[back]])
        order = np.lexsort((length, end, start))
        start, end, length = start[order], end[order], length[order]
        first = np.ones(start.size, dtype=bool)
        first[1:] = (np.diff(start) != 0) | (np.diff(end) != 0)
        size = self.east_m.size
        return csr_array((length[first], (start[first], end[first])), shape=(size, size))
