"""Fingerprints from what there is: track logs with truth, radio-route databases, tables."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import ceil, sqrt
from pathlib import Path

import numpy as np
import pandas as pd

from mapfilter._types import Ints, Ints32
from mapfilter.database.measured import Readings
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.errors import InputError, fail
from mapfilter.positioning.fingerprints.joining import joined_reports
from mapfilter.positioning.fingerprints.log_reports import reports_of_log
from mapfilter.positioning.fingerprints.options import LEVEL_ERROR_DB
from mapfilter.positioning.fingerprints.planned import Planned, level_deviations_db
from mapfilter.positioning.fingerprints.reports import Reports, make_reports
from mapfilter.radio.cells import CellPlan
from mapfilter.radio.plan_notes import assumed_notes, carrier_notes
from mapfilter.tracks.log import TrackLog

MOST_POINTS = 20_000
"""A radio-route database is thinned to about so many places."""

STRONGEST = 7
"""Cells in a report of a phone: a serving cell and six neighbours."""

_OTHER_LAYERS = 0.5
"""Share of the layers besides that of the serving cell that a phone measures."""


def reports_of_logs(logs: Sequence[TrackLog], plan: CellPlan | None = None) -> Reports:
    """Return the reports of several logs, each a block of its own.

    Cells without id are named by carrier and BSIC where a plan has exactly one such cell.
    """
    named = logs if plan is None else [named_neighbours(log, plan) for log in logs]
    return joined_reports([reports_of_log(log, 0) for log in named])


def named_neighbours(log: TrackLog, plan: CellPlan) -> TrackLog:
    """Return a log whose cells without id have that of the only cell of their carrier and BSIC."""
    known: dict[tuple[int, int], list[str]] = {}
    for cell in plan.cells:
        if cell.arfcn is not None and cell.bsic is not None:
            known.setdefault((cell.arfcn, cell.bsic), []).append(cell.id)
    radio = log.radio
    rows = zip(radio["cell"], radio["arfcn"], radio["bsic"], strict=True)
    found: list[str | None] = []
    for cell, arfcn, bsic in rows:
        ids = [] if arfcn is pd.NA or bsic is pd.NA else known.get((int(arfcn), int(bsic)), [])
        found.append(ids[0] if pd.isna(cell) and len(ids) == 1 else cell)
    return replace(log, radio=radio.assign(cell=pd.Series(found, index=radio.index, dtype=object)))


def reports_of_database(
    database: RadioRouteDatabase, level_error_db: float = LEVEL_ERROR_DB
) -> Reports:
    """Return the levels of a radio-route database as reports at its points.

    Where usual values stand for what the plan of a cell lacks, its levels err by more
    (:mod:`mapfilter.positioning.fingerprints.planned`).

    Those of a survey are its readings themselves: its rasters tell the level where a cell is
    received, and not where it is not.

    Parameters
    ----------
    level_error_db : float
        Standard deviation of the error of levels that are predicted with a plan's own values.

    Raises
    ------
    InputError
        No cell is received at any of its points.
    """
    measured = database.measured()
    if measured is not None and len(measured.readings):
        return _reports_of_survey(measured.readings, database.lattice.crs)
    lattice = database.lattice
    parts = [database.cell_points(cell_id, np.inf) for cell_id in database.cell_ids]
    place = [row.astype(np.int64) * lattice.cols + col for row, col, _ in parts]
    every = np.concatenate([np.empty(0, dtype=np.int64), *place])
    places = np.unique(every)
    if not len(places):
        raise fail(InputError, str(database.path), "points with levels", "none")
    step = max(1, ceil(sqrt(len(places) / MOST_POINTS)))
    row, col = places // lattice.cols, places % lattice.cols
    thin = (row % step == 0) & (col % step == 0)
    # A thin corridor may miss all of a coarse lattice.
    kept = places[thin] if thin.any() else places[:: step**2]
    at = np.searchsorted(kept, every)
    there = (at < len(kept)) & (kept[np.minimum(at, len(kept) - 1)] == every)
    names = np.repeat(np.array(database.cell_ids, dtype=str), [len(part[0]) for part in parts])
    level_dbm = np.concatenate([part[2] for part in parts]).astype(np.float64)
    east_m, north_m = lattice.east_north(kept // lattice.cols, kept % lattice.cols)
    place_m = np.column_stack([east_m, north_m])
    which = np.repeat(np.arange(len(parts)), [len(part[0]) for part in parts])[there]
    sd_db = np.full(len(which), float(level_error_db))
    for index, cell_id in enumerate(database.cell_ids):
        if database.plan[cell_id].assumes:
            own = which == index
            near_m = place_m[at[there][own]]
            cell = database.plan[cell_id]
            sd_db[own] = level_deviations_db(cell, lattice.crs, near_m, level_error_db)
    found = make_reports(
        lattice.crs,
        at[there],
        names[there],
        level_dbm[there],
        count=len(kept),
        places=place_m,
        sd_db=sd_db,
        notes=(*assumed_notes(database.plan), *carrier_notes(database.plan)),
    )
    stated = any(cell.technology or cell.assumed for cell in database.plan.cells)
    planned = Planned.of(database.plan, found.cell_ids) if stated else None
    return replace(found, predicted=True, planned=planned)


def _reports_of_survey(readings: Readings, crs: str) -> Reports:
    """Return the readings of a survey as reports; each session is a block of its own."""
    _, first, report = np.unique(readings.report, return_index=True, return_inverse=True)
    names = np.array(readings.cell_ids, dtype=str)[readings.cell]
    # Of several serving cells of a report the first counts.
    of_report, leading = np.unique(report[readings.serving], return_index=True)
    served = np.flatnonzero(readings.serving)[leading]
    serving = np.full(len(first), "", dtype=names.dtype)
    serving[of_report] = names[served]
    advance = np.full(len(first), np.nan)
    advance[of_report] = readings.timing_advance[served]
    found = make_reports(
        crs,
        report,
        names,
        readings.level_dbm,
        count=len(first),
        places=np.column_stack([readings.east_m[first], readings.north_m[first]]),
        block=readings.session[first],
        serving=serving,
        timing_advance=advance,
    )
    if len(found) <= MOST_POINTS:
        return found
    kept = np.linspace(0, len(found) - 1, MOST_POINTS).astype(np.int64)
    return found.some(kept, f"{MOST_POINTS} of {len(found)} reports taken, evenly")


def simulated_reports(
    database: Reports,
    count: int,
    strongest: int,
    shared_db: float,
    rng: np.random.Generator,
    timed: float = 0.0,
) -> Reports:
    """Draw reports at places of predicted levels, with the errors that are stated for these.

    Each has the strongest cells, with independent errors and one that all share. Of a network of
    several layers the serving cell is the strongest of one of them, each as likely as another, and
    the cells are of that layer and, with even odds, of each other one.

    Parameters
    ----------
    timed : float
        Share of the reports that have a timing advance, where its step is known.
    """
    drawn = database.some(rng.choice(len(database), min(count, len(database)), replace=False))
    report, planned = drawn.report, drawn.planned
    if planned is not None:
        shared_db = float(np.hypot(shared_db, planned.common_db))
    shared = shared_db * rng.standard_normal(len(drawn))
    level_dbm = drawn.level_dbm + shared[report]
    level_dbm = level_dbm + drawn.sd_db * rng.standard_normal(len(level_dbm))
    order = np.lexsort((-level_dbm, report))
    best = drawn.cell[order[drawn.first[:-1]]]
    if planned is not None:
        best = _served(drawn, order, planned.layer, rng)
        measured = rng.random((len(drawn), int(planned.layer.max()) + 1)) < _OTHER_LAYERS
        measured[np.arange(len(drawn)), planned.layer[best]] = True
        order = order[measured[report[order], planned.layer[drawn.cell[order]]]]
    begins = np.searchsorted(report[order], np.arange(len(drawn)))
    rank = np.arange(len(order)) - begins[report[order]]
    kept = order[rank < strongest]
    names = np.array(drawn.cell_ids, dtype=str)
    steps = np.full(len(drawn), np.nan)
    if planned is not None:
        steps = planned.drawn_timing(drawn.places, best, rng)
        steps[rng.random(len(drawn)) >= timed] = np.nan
    return make_reports(
        drawn.crs,
        report[kept],
        names[drawn.cell[kept]],
        level_dbm[kept],
        count=len(drawn),
        places=drawn.places,
        serving=None if planned is None else names[best],
        timing_advance=steps,
    )


def _served(drawn: Reports, order: Ints, layer: Ints, rng: np.random.Generator) -> Ints32:
    """Return the strongest cell (R,) of a layer that is received there, drawn for each report.

    ``order`` (L,) has the levels of each report one after the other, strongest first.
    """
    count = int(layer.max()) + 1
    key = drawn.report[order] * count + layer[drawn.cell[order]]
    leading, first = np.unique(key, return_index=True)
    chance = rng.random(leading.size) if count > 1 else np.zeros(leading.size)
    by_chance = np.lexsort((chance, leading // count))
    begins = np.searchsorted(leading[by_chance] // count, np.arange(len(drawn)))
    served: Ints32 = drawn.cell[order[first[by_chance[begins]]]]
    return served


def is_table(path: Path) -> bool:
    """Return whether a path is a file that may be a table of fingerprints."""
    return path.is_file() and path.suffix.lower() in (".csv", ".tsv", ".txt")
