"""Line of sight over a raster of building heights, on flat ground; roofs about every pixel."""

from __future__ import annotations

import numpy as np
from numba import njit

from mapfilter._types import Bools, Floats32
from mapfilter.errors import InputError, fail
from mapfilter.lattice import Lattice

_STEP_PX = 0.5
_SAME_ROOF_M = 0.5


def line_of_sight(
    heights_m: Floats32,
    lattice: Lattice,
    transmitter: tuple[float, float, float],
    receiver_height_m: float,
) -> Bools:
    """Return the pixels with line of sight to an antenna.

    Each ray from the antenna to a pixel's centre is followed in steps of at most half a pixel; it
    is blocked where a building reaches higher than the ray. The roof that the antenna stands on (or
    the building that it hangs in) does not block: pixels of that height count from the antenna
    outwards until the ray first leaves them. A pixel under another roof has no line of sight.

    Parameters
    ----------
    heights_m : ndarray of float32, shape (rows, cols)
        Heights of buildings above ground; 0 where there is none.
    lattice : Lattice
        Of the same shape.
    transmitter : (east_m, north_m, height_m)
        Height above ground; it may lie outside the lattice, where nothing blocks.
    receiver_height_m : float
        Above ground.
    """
    heights = check_heights(heights_m, lattice)
    east_m, north_m, height_m = transmitter
    row = (lattice.north_m - north_m) / lattice.resolution_m - 0.5
    col = (east_m - lattice.west_m) / lattice.resolution_m - 0.5
    result: Bools = _march(heights, row, col, height_m, receiver_height_m, float(heights.max()))
    return result


def own_building(heights_m: Floats32, lattice: Lattice, east_m: float, north_m: float) -> Bools:
    """Return the pixels of the connected buildings about a place; none where it is outdoors."""
    from scipy.ndimage import label

    row, col = lattice.row_col(east_m, north_m)
    if not lattice.contains(row, col) or heights_m[row, col] <= 0:
        return np.zeros(heights_m.shape, dtype=np.bool_)
    parts, _count = label(heights_m > 0)
    return np.asarray(parts == parts[row, col])


def mean_roof_height(
    heights_m: Floats32, lattice: Lattice, radius_m: float, default_m: float
) -> Floats32:
    """Return the mean height of the roofs within a square of ``radius_m`` around every pixel.

    Parameters
    ----------
    heights_m : ndarray of float32, shape (rows, cols)
        0 where there is no building; such pixels do not count.
    radius_m : float
        Half the side of the square.
    default_m : float
        Where no roof is near.
    """
    from scipy.ndimage import uniform_filter

    size = 2 * round(radius_m / lattice.resolution_m) + 1
    heights = heights_m.astype(np.float64)
    share = uniform_filter((heights > 0).astype(np.float64), size, mode="constant")
    total = uniform_filter(heights, size, mode="constant")
    # The running sums of the filter leave rounding noise where there is no roof at all.
    roofs = share > 0.5 / size**2
    mean = np.divide(total, share, out=np.full(heights.shape, float(default_m)), where=roofs)
    return np.asarray(mean, dtype=np.float32)


def check_heights(heights_m: Floats32, lattice: Lattice) -> Floats32:
    """Return heights as contiguous float32 after checking shape and values."""
    heights = np.ascontiguousarray(heights_m, dtype=np.float32)
    if heights.shape != (lattice.rows, lattice.cols):
        expected = f"{lattice.rows} x {lattice.cols} pixels"
        raise fail(InputError, "building heights", expected, heights.shape)
    if not (np.isfinite(heights).all() and heights.min() >= 0):
        got, hint = "NaN, infinity or negative", "nodata not replaced by 0"
        raise fail(InputError, "building heights", "finite metres ≥ 0", got, hint)
    return heights


@njit(cache=True, nogil=True)
def _march(
    heights: Floats32,
    row: float,
    col: float,
    height_m: float,
    receiver_height_m: float,
    highest_m: float,
) -> Bools:
    rows, cols = heights.shape
    seen = np.ones((rows, cols), dtype=np.bool_)
    own_m = 0.0
    own_row, own_col = int(np.floor(row + 0.5)), int(np.floor(col + 0.5))
    if 0 <= own_row < rows and 0 <= own_col < cols:
        own_m = heights[own_row, own_col]
    for to_row in range(rows):
        for to_col in range(cols):
            down, right = to_row - row, to_col - col
            steps = int(np.ceil(max(abs(down), abs(right)) / _STEP_PX))
            on_own_roof = own_m > 0
            for k in range(steps + 1):
                part = k / steps if steps > 0 else 1.0
                ray_m = height_m + part * (receiver_height_m - height_m)
                if ray_m >= highest_m and not on_own_roof:
                    continue
                at_row = int(np.floor(row + part * down + 0.5))
                at_col = int(np.floor(col + part * right + 0.5))
                if at_row < 0 or at_row >= rows or at_col < 0 or at_col >= cols:
                    on_own_roof = False
                    continue
                roof_m = heights[at_row, at_col]
                if on_own_roof and abs(roof_m - own_m) <= _SAME_ROOF_M:
                    continue
                on_own_roof = False
                if roof_m > ray_m:
                    seen[to_row, to_col] = False
                    break
    return seen
