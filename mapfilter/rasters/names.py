"""Names of rasters that are ids of a plan within a common prefix and suffix."""

from __future__ import annotations

from dataclasses import replace

from mapfilter.radio.cells import CellPlan
from mapfilter.rasters.raster_set import RxLevRasters

_LEAST_SHARE = 0.9
_TRIED = 3


def named_by_plan(rasters: RxLevRasters, plan: CellPlan) -> RxLevRasters:
    """Return rasters with the ids of a plan, where each name is an id between the same texts.

    Planning tools name files such as ``HD0001_1_RSRP.tif`` for the cell ``HD0001_1``. Nothing
    changes where any raster has an id of the plan, or where fewer than nine of ten names fit.

    Returns
    -------
    RxLevRasters
        With a note where names changed; ``check_against_plan`` finds the names that do not fit.
    """
    held = rasters.cell_ids
    if not held or any(cell_id in plan for cell_id in held):
        return rasters
    best: tuple[int, int, str, str] | None = None
    for prefix, suffix in {pair for name in held[:_TRIED] for pair in _around(name, plan)}:
        inner = {_within(name, prefix, suffix) for name in held}
        fitting = sum(name is not None and name in plan for name in inner)
        # Of equally good ones that with the longest ids.
        rank = (fitting, -len(prefix) - len(suffix), prefix, suffix)
        best = rank if best is None or rank > best else best
    if best is None or best[0] < _LEAST_SHARE * len(held):
        return rasters
    _, _, prefix, suffix = best

    def cell_of(name: str) -> str:
        inner = _within(name, prefix, suffix)
        return inner if inner is not None and inner in plan else name

    files = tuple(replace(f, cell_ids=tuple(map(cell_of, f.cell_ids))) for f in rasters.files)
    note = f"rasters named {prefix}*{suffix}, where * is a cell of the plan"
    return replace(
        rasters, cell_ids=tuple(map(cell_of, held)), files=files, notes=(*rasters.notes, note)
    )


def _around(name: str, plan: CellPlan) -> list[tuple[str, str]]:
    """Return what stands before and after each id of the plan within a name."""
    found = []
    for cell_id in plan.ids:
        at = name.find(cell_id)
        while at >= 0:
            found.append((name[:at], name[at + len(cell_id) :]))
            at = name.find(cell_id, at + 1)
    return found


def _within(name: str, prefix: str, suffix: str) -> str | None:
    fits = name.startswith(prefix) and name.endswith(suffix)
    return name[len(prefix) : len(name) - len(suffix)] if fits else None
