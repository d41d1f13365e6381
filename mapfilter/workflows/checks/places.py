"""Checks that plan, rasters, area and roads are at the same place and on the same pixels."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np
import shapely

from mapfilter._types import Bools, Floats
from mapfilter.check.findings import Findings
from mapfilter.config.inputs import Area
from mapfilter.config.sections import Config
from mapfilter.database.floor import floor_of
from mapfilter.errors import InputError, listed
from mapfilter.geodesy import project, projected_crs, same_crs, unproject, utm_zone, utm_zone_crs
from mapfilter.lattice import Lattice, outside_m
from mapfilter.radio.cells import CellPlan
from mapfilter.rasters.raster_set import RxLevRasters
from mapfilter.roads.elements import BoxDeg
from mapfilter.roads.maps import box_deg, boxes_overlap, map_bounds_deg, overlaps_swapped
from mapfilter.roads.ways import Ways
from mapfilter.workflows.inputs.world import area_lattice

Move = Callable[[Floats, Floats], tuple[Floats, Floats]]

_HALF_TOLERANCE_PX = 0.02
_SAME_SIDE = 1e-6
_OUTSIDE_SHARE = 0.05
_AT_EDGE_M = 1.0
_MOST_ZONES = 2
_NEARLY_ALL = 0.9
_MOST_NAMED = 3
_RARELY_BEYOND_M = 10_000.0
_FARTHEST_M = 35_000.0
"""The largest timing advance of GSM."""


def check_rasters_place(rasters: RxLevRasters, config: Config, findings: Findings) -> bool:
    """Return whether rasters and area overlap; if not, find a CRS in which they would."""
    lattice, area, where = rasters.lattice, config.area, str(rasters.path)
    if area.crs is not None:
        wanted = projected_crs(area.crs, "area.crs")
        if not same_crs(wanted, lattice.crs):
            evidence = f"The rasters are in {lattice.crs}, the area in {wanted}."
            findings.add("crs-mixed", where, evidence)
            return False
    box = box_deg(lattice.crs, lattice.bounds_m)
    wanted_box = _area_box(area)
    if boxes_overlap(box, wanted_box):
        return True
    seen = f"The rasters cover {_shown(box)}, the area {_shown(wanted_box)} (degrees)."
    if area.bbox is not None and overlaps_swapped(area.bbox, box):
        evidence = f"{seen} With longitude and latitude exchanged they overlap."
        findings.add("lon-lat-swapped", "area.bbox", evidence)
        return False
    for crs in _other_systems(wanted_box):
        if not same_crs(crs, lattice.crs) and boxes_overlap(
            box_deg(crs, lattice.bounds_m), wanted_box
        ):
            evidence = f"{seen} As numbers of {crs} instead of {lattice.crs} they would overlap."
            findings.add("crs-mixed", where, evidence)
            return False
    findings.add("roads-outside-rasters", where, seen)
    return False


def check_sites(
    plan: CellPlan,
    lattice: Lattice,
    where: str,
    findings: Findings,
    strongest_dbm: Mapping[str, float] | None = None,
) -> frozenset[str]:
    """Return the ids of cells outside the area; report them with the mistake that explains it.

    An area that is cut out of a network has most cells beside it, which is noted. Cells that are
    too far away to be received there are a warning.

    Parameters
    ----------
    strongest_dbm : mapping of str to float, optional
        The strongest level of each cell in the area, as far as it is known.
    """
    east = np.array([cell.east_m for cell in plan.cells])
    north = np.array([cell.north_m for cell in plan.cells])
    outside = ~_inside(east, north, lattice)
    if not outside.any():
        return frozenset()
    ids = [cell.id for cell, out in zip(plan.cells, outside, strict=True) if out]
    beyond_m = dict(zip(ids, outside_m(east, north, lattice)[outside].tolist(), strict=True))
    named = f"{where}, cells {listed(ids, _MOST_NAMED)}"
    seen = f"{len(ids)} of {len(plan)} cells lie up to {_far(max(beyond_m.values()))} outside "
    seen += "the area"
    for code, words, move in _moves(lattice):
        moved = _inside(*move(east[outside], north[outside]), lattice)
        if moved.mean() >= _NEARLY_ALL:
            evidence = f"{seen}. {words}, {int(moved.sum())} of them lie inside."
            findings.add(code, named, evidence)
            return frozenset(ids)
    floor_dbm = floor_of(plan)
    received = {i for i, dbm in (strongest_dbm or {}).items() if dbm >= floor_dbm}
    lost = [
        i for i, m in beyond_m.items() if m >= (_FARTHEST_M if i in received else _RARELY_BEYOND_M)
    ]
    if lost:
        nearest = _far(min(beyond_m[i] for i in lost))
        seen += f", {len(lost)} of them {nearest} and more: too far to be received in it"
        named = f"{where}, cells {listed(lost, _MOST_NAMED)}"
    elif heard := received.intersection(ids):
        seen += f", {len(heard)} of them received in it"
    findings.add("site-outside-area", named, f"{seen}.", "warning" if lost else "note")
    return frozenset(ids)


def check_pixels(rasters: RxLevRasters, findings: Findings) -> None:
    """Check whether rasters are half a pixel off one another, or off multiples of their pixels.

    The lattice of an area lies on multiples of its pixels, and so do those of nearly all exports.
    """
    lattice = rasters.lattice
    corner = lattice.west_m, lattice.north_m
    off = {file.path.name: _half_step(file.lattice, *corner) for file in rasters.files}
    off = {name: step for name, step in off.items() if step}
    where, step = str(rasters.path), _half_step(lattice, 0.0, 0.0)
    if off:
        where = f"{rasters.path}, {listed(list(off))}"
        evidence = f"{next(iter(off.values()))} off the other rasters."
    elif step:
        evidence = f"{step} off multiples of {lattice.resolution_m:g} m: their corner is "
        evidence += f"{lattice.west_m:.10g}, {lattice.north_m:.10g}."
    else:
        return
    findings.add("half-pixel-shift", where, evidence, "warning")


def check_same_pixels(
    path: str, transform: Sequence[float], rasters: RxLevRasters, findings: Findings
) -> None:
    """Check whether another raster of the same resolution is half a pixel off the levels.

    ``transform`` is its west edge, pixel width and north edge.
    """
    west_m, side_m, north_m = transform
    same_side = math.isclose(side_m, rasters.lattice.resolution_m, rel_tol=_SAME_SIDE)
    if same_side and (step := _half_step(rasters.lattice, west_m, north_m)):
        evidence = f"The first lie {step} off the pixels of the second."
        findings.add("half-pixel-shift", f"{rasters.path} and {path}", evidence, "warning")


def check_ways(ways: Ways, rasters: RxLevRasters, where: str, findings: Findings) -> None:
    """Check that the rasters cover the ways."""
    length_m = float(shapely.length(ways.geometry).sum())
    inside = shapely.clip_by_rect(ways.geometry, *rasters.lattice.bounds_m)
    outside_m = length_m - float(shapely.length(inside).sum())
    if outside_m > _OUTSIDE_SHARE * length_m:
        share = f"{outside_m / 1000:.1f} of {length_m / 1000:.1f} km"
        evidence = f"{share} of ways in the area lie outside the rasters."
        nothing = outside_m > (1 - _OUTSIDE_SHARE) * length_m
        findings.add("roads-outside-rasters", where, evidence, "error" if nothing else "warning")


def _area_box(area: Area) -> BoxDeg:
    if area.has_box:
        lattice = area_lattice(area)
        return box_deg(lattice.crs, lattice.bounds_m)
    return map_bounds_deg(area.map)


def _inside(east: Floats, north: Floats, lattice: Lattice) -> Bools:
    west, south, right, top = np.array(lattice.bounds_m) + _AT_EDGE_M * np.array([-1, -1, 1, 1])
    return np.asarray((east >= west) & (east <= right) & (north >= south) & (north <= top))


def _other_systems(box: BoxDeg) -> Iterator[str]:
    """Yield the UTM zones of a place and about it, and Web Mercator."""
    lon, lat = (box[0] + box[2]) / 2, (box[1] + box[3]) / 2
    zone = utm_zone(lon, lat)
    for apart in sorted(range(-_MOST_ZONES, _MOST_ZONES + 1), key=abs):
        yield utm_zone_crs((zone + apart - 1) % 60 + 1, lat)
    yield "EPSG:3857"


def _moves(lattice: Lattice) -> Iterator[tuple[str, str, Move]]:
    """Yield mistakes that may have moved sites: code, words, and the move that undoes them."""

    def swapped_degrees(east: Floats, north: Floats) -> tuple[Floats, Floats]:
        return _projected(lattice.crs, *unproject(lattice.crs, east, north)[::-1])

    def mirrored(east: Floats, north: Floats) -> tuple[Floats, Floats]:
        lon, lat = unproject(lattice.crs, east, north)
        return _projected(lattice.crs, -lon, lat)

    yield "lon-lat-swapped", "With longitude and latitude exchanged", swapped_degrees
    yield "east-north-swapped", "With east and north exchanged", lambda east, north: (north, east)
    box = box_deg(lattice.crs, lattice.bounds_m)
    for crs in _other_systems(box):
        if same_crs(crs, lattice.crs):
            continue
        words = f"With their numbers read as {lattice.crs}, not {crs}"
        yield "crs-mixed", words, _read_as(crs, lattice.crs)
        yield "crs-mixed", f"With their numbers read as {crs}", _read_as(lattice.crs, crs)
    yield "lon-lat-swapped", "With the other sign of longitude", mirrored


def _read_as(to_crs: str, from_crs: str) -> Move:
    """Return what projects numbers of one CRS to another."""
    return lambda east, north: _projected(to_crs, *unproject(from_crs, east, north))


def _projected(crs: str, lon: Floats, lat: Floats) -> tuple[Floats, Floats]:
    nowhere = np.full(np.shape(lon), np.inf)
    with np.errstate(invalid="ignore"):
        on_earth = (np.abs(lon) <= 180) & (np.abs(lat) <= 90)
    if not on_earth.any():
        return nowhere, nowhere
    try:
        east, north = project(crs, np.where(on_earth, lon, 0.0), np.where(on_earth, lat, 0.0))
    except InputError:
        return nowhere, nowhere
    return np.where(on_earth, east, np.inf), np.where(on_earth, north, np.inf)


def _half_step(lattice: Lattice, west_m: float, north_m: float) -> str:
    """Return by which parts of a pixel a lattice is off a corner, if that is half of one."""
    right = (lattice.west_m - west_m) / lattice.resolution_m % 1
    up = (lattice.north_m - north_m) / lattice.resolution_m % 1
    half = [abs(part - 0.5) <= _HALF_TOLERANCE_PX for part in (right, up)]
    whole = [min(part, 1 - part) <= _HALF_TOLERANCE_PX for part in (right, up)]
    if any(half) and all(h or w for h, w in zip(half, whole, strict=True)):
        return f"{right % 1:.2f} pixels east and {up % 1:.2f} north"
    return ""


def _far(away_m: float) -> str:
    return f"{away_m / 1000:.1f} km" if away_m >= 10_000 else f"{away_m:.0f} m"


def _shown(box: BoxDeg) -> str:
    return ", ".join(f"{value:.4f}" for value in box)
