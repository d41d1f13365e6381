"""Remarks on predictions outside of what models are made for, or with unlikely antennas."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence

import numpy as np

from mapfilter.errors import listed
from mapfilter.lattice import Lattice
from mapfilter.propagation.models import PredictionModel, shortest_distance_m
from mapfilter.propagation.published_ranges import outside_published_range
from mapfilter.propagation.surroundings import Antennas
from mapfilter.radio.cells import Cell, CellPlan

_MOST_NAMED = 3
_NEAR_FREQUENCY = 0.2
_HIGH_M, _SPARSE_M = 75.0, 4000.0


def outside_validity(plan: CellPlan, lattice: Lattice, model: PredictionModel) -> tuple[str, ...]:
    """Return remarks on what lies outside the model's published range, and for which cells."""
    alike: dict[tuple[float, float], list[Cell]] = defaultdict(list)
    for cell in plan.to_crs(lattice.crs).cells:
        alike[cell.frequency_mhz, cell.height_m].append(cell)
    west, south, east, north = lattice.bounds_m
    ids: dict[str, list[str]] = defaultdict(list)
    for (frequency_mhz, height_m), cells in alike.items():
        east_m, north_m = np.array([(cell.east_m, cell.north_m) for cell in cells]).T
        beside_m, below_m = east_m - east_m.clip(west, east), north_m - north_m.clip(south, north)
        across_m = np.maximum(abs(east_m - west), abs(east_m - east))
        along_m = np.maximum(abs(north_m - south), abs(north_m - north))
        used = {
            "frequency_mhz": frequency_mhz,
            "base_height_m": height_m,
            "mobile_height_m": model.mobile_height_m,
            "distance_m": round(float(np.hypot(across_m, along_m).max())),
        }
        closest_m = round(float(np.hypot(beside_m, below_m).min()))
        nearest_m = max(closest_m, shortest_distance_m(model))
        for note in outside_published_range(model.model, used, nearest_m):
            ids[note].extend(cell.id for cell in cells)
    return tuple(f"{_named(names)}: {note}" for note, names in ids.items())


def off_frequency(plan: CellPlan, antennas: Antennas) -> tuple[str, ...]:
    """Return remarks on cells whose antenna was measured at a frequency far from theirs."""
    ids: dict[str, list[str]] = defaultdict(list)
    for cell in plan.cells:
        measured = antennas.get(cell.antenna)
        if measured is None or measured.frequency_mhz is None:
            continue
        if abs(cell.frequency_mhz / measured.frequency_mhz - 1) > _NEAR_FREQUENCY:
            note = f"antenna {cell.antenna!r} was measured at {measured.frequency_mhz:g} MHz"
            ids[note].append(cell.id)
    return tuple(f"{_named(names)}: {note}" for note, names in ids.items())


def upward_tilts(plan: CellPlan) -> tuple[str, ...]:
    """Return a remark where most tilted outdoor antennas of a plan look upwards.

    Some do in hilly towns; most do where the list counts angles upwards.
    """
    notes = []
    for name in ("downtilt_deg", "mechanical_downtilt_deg"):
        tilts = {cell.id: getattr(cell, name) for cell in plan.cells if not cell.indoor}
        upward = [cell_id for cell_id, tilt_deg in tilts.items() if tilt_deg < 0]
        if 2 * len(upward) > sum(tilt_deg != 0 for tilt_deg in tilts.values()):
            notes.append(
                f"{_named(upward)}: {name} below 0, such as {tilts[upward[0]]:g}: above the "
                "horizon (likely: the list counts tilts upwards)"
            )
    return tuple(notes)


def high_antennas(plan: CellPlan) -> tuple[str, ...]:
    """Return a remark where most outdoor antennas of a plan are as high as few masts are.

    None where sites are kilometres apart, as those of high masts in the country are.
    """
    known = [cell for cell in plan.cells if not cell.indoor and "height_m" not in cell.assumes]
    high = {cell.id: cell.height_m for cell in known if cell.height_m >= _HIGH_M}
    if 2 * len(high) <= len(known) or _median_spacing_m(known) > _SPARSE_M:
        return ()
    return (
        f"{_named([*high])}: antennas {_HIGH_M:g} m above the ground and higher, such as "
        f"{next(iter(high.values())):g} m (likely: feet given for metres)",
    )


def _median_spacing_m(cells: Sequence[Cell]) -> float:
    """Return the median distance from a site to the next; 0 for a single one."""
    from scipy.spatial import cKDTree

    places = np.unique([(cell.east_m, cell.north_m) for cell in cells], axis=0)
    if len(places) < 2:
        return 0.0
    return float(np.median(cKDTree(places).query(places, k=2)[0][:, 1]))


def _named(ids: list[str]) -> str:
    if len(ids) == 1:
        return f"cell {ids[0]!r}"
    return f"{len(ids)} cells ({listed([repr(name) for name in ids], _MOST_NAMED)})"
