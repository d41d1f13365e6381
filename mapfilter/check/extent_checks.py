"""Checks that no raster of several lies elsewhere than the others."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from mapfilter._types import Floats
from mapfilter.check.findings import Findings
from mapfilter.errors import listed
from mapfilter.radio.cells import CellPlan
from mapfilter.rasters.files import RasterFile
from mapfilter.rasters.raster_set import RxLevRasters

_LEAST_FILES = 3
_MOST_ODD = 0.25
_EDGE = 0.25


def check_extents(rasters: RxLevRasters, plan: CellPlan, findings: Findings) -> frozenset[str]:
    """Find files of a set that lie elsewhere than the others; return the ids of their cells.

    Where most files cover one extent, others of its size are off it. Else a file is displaced that
    ends far from the site of its cell, where other files hold that site or none meets the file. The
    plan is in the CRS of the rasters.
    """
    files = rasters.files
    if len(files) < _LEAST_FILES:
        return frozenset()
    shifted = _off_the_common_extent(files, plan)
    away = {} if shifted else _away_from_their_sites(files, plan)
    _report(shifted | away, rasters, findings)
    return frozenset(cell_id for index in shifted | away for cell_id in files[index].cell_ids)


def _report(said: dict[int, str], rasters: RxLevRasters, findings: Findings) -> None:
    if said:
        files = [rasters.files[index] for index in said]
        where = f"{rasters.path}, {listed([file.path.name for file in files])}"
        evidence = f"{len(files)} of {len(rasters.files)} rasters lie elsewhere than the others: "
        sentences = [
            f"{file.path.name} {text}" for file, text in zip(files, said.values(), strict=True)
        ]
        findings.add("raster-displaced", where, f"{evidence}{listed(sentences, 4)}.")


def _off_the_common_extent(files: Sequence[RasterFile], plan: CellPlan) -> dict[int, str]:
    """Return what is wrong with files of the common size beside the extent of most others."""
    bounds = [tuple(round(edge_m, 3) for edge_m in file.lattice.bounds_m) for file in files]
    common, count = Counter(bounds).most_common(1)[0]
    odd = [index for index, one in enumerate(bounds) if one != common]
    if not odd or 2 * count <= len(files) or len(odd) > max(1, _MOST_ODD * len(files)):
        return {}
    held = (file for file, one in zip(files, bounds, strict=True) if one == common)
    sites = {plan[i].site for file in held for i in file.cell_ids if i in plan}
    if len(sites) < 2:
        # Windows about each site are of one size, too.
        return {}
    found = {}
    for index in odd:
        right_m, up_m = bounds[index][0] - common[0], bounds[index][1] - common[1]
        size, usual = (np.subtract(one[2:], one[:2]) for one in (bounds[index], common))
        least_m = files[index].lattice.resolution_m
        if np.allclose(size, usual) and np.hypot(right_m, up_m) >= least_m:
            found[index] = f"has their size and is {_shown(right_m, up_m)} of their extent"
    return found


def _away_from_their_sites(files: Sequence[RasterFile], plan: CellPlan) -> dict[int, str]:
    bounds_m = np.array([file.lattice.bounds_m for file in files])
    found = {}
    for index, file in enumerate(files):
        sites_m = np.array([(plan[i].east_m, plan[i].north_m) for i in file.cell_ids if i in plan])
        others_m = np.delete(bounds_m, index, axis=0)
        west, south, east, north = bounds_m[index]
        # Rasters that are cropped to their data may end a little before the site.
        edge_m = _EDGE * min(east - west, north - south) * np.array([-1, -1, 1, 1])
        if not len(sites_m) or _holds(bounds_m[[index]] + edge_m, sites_m).any():
            continue
        meets = (others_m[:, :2] < (east, north)).all(axis=1)
        meets &= (others_m[:, 2:] > (west, south)).all(axis=1)
        if _holds(others_m, sites_m).any() or not meets.any():
            off_m = np.median(sites_m, axis=0) - ((west + east) / 2, (south + north) / 2)
            found[index] = f"has its middle {_shown(*-off_m)} of its site, which it does not hold"
    return found if len(found) <= max(1, _MOST_ODD * len(files)) else {}


def _holds(bounds_m: Floats, places_m: Floats) -> Floats:
    """Return whether each extent holds each place, shape (extents, places)."""
    low, high = bounds_m[:, None, :2], bounds_m[:, None, 2:]
    return np.asarray(((places_m >= low) & (places_m <= high)).all(axis=2))


def _shown(right_m: float, up_m: float) -> str:
    """Return an offset in words, such as ``1.0 km east and 20 m south``."""
    sides = ((right_m, "east", "west"), (up_m, "north", "south"))
    parts = [
        f"{_length(abs(by_m))} {ahead if by_m > 0 else behind}"
        for by_m, ahead, behind in sides
        if abs(by_m) >= 1
    ]
    return " and ".join(parts)


def _length(length_m: float) -> str:
    return f"{length_m / 1000:.1f} km" if length_m >= 1000 else f"{length_m:.0f} m"
