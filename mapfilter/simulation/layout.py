"""Cell plans laid out over any area by rule, where no real plan is at hand."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.ndimage import distance_transform_edt, find_objects, label
from scipy.spatial import cKDTree

from mapfilter._types import Floats, Floats32
from mapfilter.errors import ConfigError, Faults
from mapfilter.lattice import Lattice
from mapfilter.propagation.line_of_sight import check_heights
from mapfilter.radio.cells import Cell, CellPlan

_MOST_CANDIDATES_PER_SIDE = 96
_LLOYD_ROUNDS = 40
_MOST_SECTORS = 6
_ABOVE_ROOF_M = 3.0
_SNAP_M = 75.0
# COST-231 Walfisch-Ikegami holds for antennas up to 50 m; nobody plans a macro cell on a tower.
_HIGHEST_ROOF_M = 45.0
_INTERIOR = 0.1
_FIRST_ARFCN = 512
_CARRIERS = 36
_CARRIER_STEP = 3
_COLOURS = 64


def lay_out_plan(
    lattice: Lattice,
    sites: int,
    sectors: int,
    indoor: int,
    seed: int,
    heights_m: Floats32 | None = None,
    *,
    frequency_mhz: float = 1800.0,
    eirp_dbm: float = 52.0,
    site_height_m: float = 30.0,
    first_azimuth_deg: float = 0.0,
    indoor_eirp_dbm: float = 30.0,
    indoor_height_m: float = 4.0,
    penetration_loss_db: float = 10.0,
) -> CellPlan:
    """Lay out sites with sectors, and indoor cells, over an area.

    Sites are spread evenly (a centroidal Voronoi tessellation by Lloyd's rounds, which tends to
    hexagons when there are many), each moved onto the highest roof of at most 45 m that is up to
    75 m away to the east or west and to the north or south, where heights are given. Sectors point
    in equal steps. Indoor cells hang in the largest buildings that stand apart, or, without
    heights, where the sites are farthest.

    Cells are called S1A, S1B, … from north to south, and I1, I2, … The n-th cell gets carrier
    512 + 3 (n mod 36) and BSIC ⌊n / 36⌋ mod 64: every pair is unique up to 2304 cells, and a
    carrier is used again from the 37th cell on.

    Parameters
    ----------
    lattice : Lattice
        The area.
    sites, sectors, indoor : int
        Numbers of sites, of sectors per site (1 is an omnidirectional antenna, at most 6) and of
        indoor cells.
    seed : int
        Of the places that Lloyd's rounds start from.
    heights_m : ndarray of float32, shape (rows, cols), optional
        Heights of buildings above ground, 0 where there is none.
    frequency_mhz, eirp_dbm, site_height_m, first_azimuth_deg : float
        Of the sectors; antennas are at least 3 m above the roof that they stand on.
    indoor_eirp_dbm, indoor_height_m, penetration_loss_db : float
        Of the indoor cells.

    Returns
    -------
    CellPlan
        In the lattice's CRS.

    Raises
    ------
    ConfigError
        A number is out of range.
    InputError
        The heights do not fit the lattice, or a cell would be none (such as an EIRP of 100 dBm).
    """
    faults = Faults()
    if sites < 0 or indoor < 0 or sites + indoor < 1:
        faults.add("cells, sites and indoor", "at least one cell", f"{sites} and {indoor}")
    if not 1 <= sectors <= _MOST_SECTORS:
        faults.add("cells, sectors", f"1..{_MOST_SECTORS}", sectors)
    if seed < 0:
        faults.add("cells, seed", "a whole number ≥ 0", seed)
    faults.raise_if_any(ConfigError)
    heights = None if heights_m is None else check_heights(heights_m, lattice)
    rng = np.random.default_rng(seed)
    masts = _masts(lattice, sites, heights, rng)
    cells: list[Cell] = []

    def add(site: str, letter: str, place: tuple[float, float], **properties: Any) -> None:
        round_, carrier = divmod(len(cells), _CARRIERS)
        properties["arfcn"] = _FIRST_ARFCN + _CARRIER_STEP * carrier
        properties["bsic"] = round_ % _COLOURS
        cells.append(Cell(site + letter, site, *place, frequency_mhz=frequency_mhz, **properties))

    for i, place in enumerate(masts, start=1):
        roof_m = 0.0 if heights is None else float(heights[lattice.row_col(*place)])
        for j in range(sectors):
            azimuth_deg = (first_azimuth_deg + j * 360.0 / sectors) % 360.0
            add(
                f"S{i}",
                "ABCDEF"[j],
                place,
                height_m=max(site_height_m, roof_m + _ABOVE_ROOF_M),
                azimuth_deg=None if sectors == 1 else azimuth_deg,
                antenna="omni" if sectors == 1 else "sector",
                eirp_dbm=eirp_dbm,
            )
    for i, place in enumerate(_indoor_places(lattice, indoor, heights, masts), start=1):
        add(
            f"I{i}",
            "",
            place,
            height_m=indoor_height_m,
            azimuth_deg=None,
            antenna="omni",
            eirp_dbm=indoor_eirp_dbm,
            indoor=True,
            penetration_loss_db=penetration_loss_db,
        )
    return CellPlan(lattice.crs, tuple(cells))


def _masts(
    lattice: Lattice, count: int, heights: Floats32 | None, rng: np.random.Generator
) -> list[tuple[float, float]]:
    """Return evenly spread places (east_m, north_m), from north to south."""
    if count == 0:
        return []
    points = _candidates(lattice)
    centres = points[rng.choice(len(points), count, replace=count > len(points))]
    for _ in range(_LLOYD_ROUNDS):
        _, nearest = cKDTree(centres).query(points)
        sizes = np.bincount(nearest, minlength=count)
        sums = [np.bincount(nearest, points[:, axis], count) for axis in (0, 1)]
        moved = np.column_stack(sums) / np.maximum(sizes, 1)[:, None]
        centres = np.where(sizes[:, None] > 0, moved, centres)
    if heights is not None:
        centres = np.array([_onto_roof(lattice, heights, place) for place in centres])
    order = np.lexsort((centres[:, 0], -centres[:, 1]))
    return [(round(float(east), 2), round(float(north), 2)) for east, north in centres[order]]


def _candidates(lattice: Lattice) -> Floats:
    """Return a coarse grid of places over the whole area, shape (n, 2)."""
    west, south, east, north = lattice.bounds_m
    step = max(lattice.resolution_m, max(east - west, north - south) / _MOST_CANDIDATES_PER_SIDE)
    easts = west + (np.arange(max(1, int((east - west) / step))) + 0.5) * step
    norths = south + (np.arange(max(1, int((north - south) / step))) + 0.5) * step
    grid = np.meshgrid(easts, norths)
    return np.column_stack([axis.ravel() for axis in grid])


def _onto_roof(lattice: Lattice, heights: Floats32, place: Floats) -> tuple[float, float]:
    """Return the highest fit roof near a place, the nearest of equals; the place without any."""
    row, col = lattice.row_col(*place)
    reach = int(_SNAP_M / lattice.resolution_m)
    top, left = max(0, row - reach), max(0, col - reach)
    near = heights[top : row + reach + 1, left : col + reach + 1]
    near = np.where(near <= _HIGHEST_ROOF_M, near, 0.0)
    if near.max() <= 0:
        return float(place[0]), float(place[1])
    rows, cols = np.nonzero(near == near.max())
    distance = np.hypot(rows + top - row, cols + left - col)
    best = int(np.argmin(distance))
    east_m, north_m = lattice.east_north(int(rows[best]) + top, int(cols[best]) + left)
    return float(east_m), float(north_m)


def _indoor_places(
    lattice: Lattice, count: int, heights: Floats32 | None, masts: list[tuple[float, float]]
) -> list[tuple[float, float]]:
    """Return places in the largest buildings apart from each other, then far from all others."""
    places: list[tuple[float, float]] = []
    apart_m = 0.5 * lattice.resolution_m * np.sqrt(lattice.rows * lattice.cols / max(count, 1))
    for place in _building_cores(lattice, heights) if count and heights is not None else []:
        if len(places) < count and all(np.hypot(*np.subtract(place, p)) > apart_m for p in places):
            places.append(place)
    points = _candidates(lattice)
    west, south, east, north = lattice.bounds_m
    size_m = np.array([east - west, north - south])
    off_m = np.abs(points - np.array([west + east, south + north]) / 2)
    # Not near the edge of the area, where there is room.
    interior = (off_m <= size_m / 2 - _INTERIOR * size_m).all(axis=1)
    inside = points[interior] if interior.any() else points
    while len(places) < count:
        taken = [*masts, *places]
        if taken:
            distance = cKDTree(taken).query(inside)[0]
        else:
            distance = np.minimum(inside - (west, south), (east, north) - inside).min(axis=1)
        east_m, north_m = inside[int(np.argmax(distance))]
        places.append((round(float(east_m), 2), round(float(north_m), 2)))
    return places


def _building_cores(lattice: Lattice, heights: Floats32) -> list[tuple[float, float]]:
    """Return the place farthest from the walls of each building, the largest building first."""
    parts, count = label(heights > 0)
    sizes = np.bincount(parts.ravel(), minlength=count + 1)[1:]
    boxes = find_objects(parts)
    cores = []
    for part in np.argsort(-sizes, kind="stable"):
        own = np.pad(parts[boxes[part]] == part + 1, 1)
        row, col = np.unravel_index(int(np.argmax(distance_transform_edt(own))), own.shape)
        top, left = boxes[part][0].start - 1, boxes[part][1].start - 1
        east_m, north_m = lattice.east_north(int(row) + top, int(col) + left)
        cores.append((float(east_m), float(north_m)))
    return cores
