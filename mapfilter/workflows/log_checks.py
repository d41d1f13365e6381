"""What replay sees of logs before it locates any."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from mapfilter._io import path_fault, shown
from mapfilter._types import Floats
from mapfilter.errors import Faults, InputError, MapfilterError
from mapfilter.geodesy import Lattice, same_crs
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.schema import SERVING
from mapfilter.tracks.store import read_log
from mapfilter.workflows.cover import outside_m

_AWAY_M = 5000.0


def check_logs(folders: Sequence[Path], lattice: Lattice) -> None:
    """Read every log once before any is located, so that all faults are told and none half-way.

    Raises
    ------
    InputError
        Logs cannot be read, are in another CRS than the database, or their truth or GNSS fixes all
        lie more than 5 km outside its lattice.
    """
    faults = Faults()
    for folder in folders:
        if wrong := path_fault(folder):
            faults.add("logs", wrong, shown(str(folder)))
            continue
        try:
            log = read_log(folder)
        except MapfilterError as error:
            faults.found.extend(error.faults)
            continue
        if not same_crs(log.crs, lattice.crs):
            expected = f"{lattice.crs}, the database's"
            faults.add(f"{folder}, crs", expected, log.crs, "log of another area or zone")
            continue
        for table in ("truth", "gnss"):
            places = getattr(log, table)
            east_m, north_m = places["east_m"].to_numpy(), places["north_m"].to_numpy()
            _check_near(f"{folder}, {table}", east_m, north_m, lattice, faults)
    faults.raise_if_any(InputError)


def lacking(log: TrackLog, estimate: TrackEstimate) -> str:
    """Return what a log lacks so that nothing could be located in it, or an empty text."""
    serving = (log.radio["role"] == SERVING) & log.radio["cell"].notna()
    moved = log.motion["step_m"].notna()
    lacks = []
    if not serving.any() and not (estimate.hypotheses > 0).any():
        lacks.append("no serving cell")
    elif not (estimate.hypotheses > 0).any():
        lacks.append("no serving cell of which the database has points")
    if not moved.any():
        lacks.append("no motion")
    elif not (moved & log.motion["heading_rad"].notna()).any():
        turns = log.motion["turn_rad"].notna().any()
        lacks.append("no heading" + (" (turns alone do not tell it)" if turns else ""))
    return " and ".join(lacks)


def _check_near(
    where: str, east_m: Floats, north_m: Floats, lattice: Lattice, faults: Faults
) -> None:
    if not east_m.size or outside_m(east_m, north_m, lattice).min() <= _AWAY_M:
        return
    box = lattice.bounds_m
    found = east_m.min(), north_m.min(), east_m.max(), north_m.max()
    swapped = outside_m(north_m, east_m, lattice).min() <= _AWAY_M
    faults.add(
        where,
        f"positions near the database's {_box(*box)}",
        _box(*found),
        "east and north swapped" if swapped else "log of another area or zone",
    )


def _box(west_m: float, south_m: float, east_m: float, north_m: float) -> str:
    return f"{west_m:.0f}..{east_m:.0f} m east, {south_m:.0f}..{north_m:.0f} m north"
