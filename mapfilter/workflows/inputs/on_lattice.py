"""Where boxes lie, seen from a lattice."""

from __future__ import annotations

from mapfilter.lattice import Lattice


def pixels_on(
    lattice: Lattice, bounds_m: tuple[float, float, float, float]
) -> tuple[int, int, int, int] | None:
    """Return the pixels of a lattice that a box in its CRS touches, or None where there are none.

    Examples
    --------
    >>> lattice = Lattice("EPSG:32635", 0.0, 100.0, 5.0, 20, 20)
    >>> pixels_on(lattice, (10.0, 50.0, 30.0, 200.0))
    (0, 2, 10, 4)
    >>> pixels_on(lattice, (100.0, 0.0, 200.0, 100.0)) is None
    True
    """
    west, south, east, north = bounds_m
    # A hair inside, so that an edge on a pixel's edge takes no pixel beyond it.
    hair_m = 1e-6 * lattice.resolution_m
    top, left = lattice.row_col(west + hair_m, north - hair_m)
    bottom, right = lattice.row_col(east - hair_m, south + hair_m)
    top, left = max(int(top), 0), max(int(left), 0)
    rows = min(int(bottom), lattice.rows - 1) - top + 1
    cols = min(int(right), lattice.cols - 1) - left + 1
    return None if rows < 1 or cols < 1 else (top, left, rows, cols)
