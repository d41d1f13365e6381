"""Walks in Belgium whose radio freezes within a minute, while the positions go on.

It is a test of honesty. ``live`` gives the filter what the phone logged, row by row: after its last
change the last report is repeated, as in the file. The run succeeds where the filter says that the
radio is stale within 60 s of its last change, and never reports CONVERGED at a wrong place. The map
is the corridor of the other walks of the place, with levels predicted from the table of towers.
``locate`` takes each report that was really measured by itself, anywhere in the box around the
towers.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import nan
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from mapfilter._inputs import json_value, read_input
from mapfilter.database.store import open_database
from mapfilter.errors import InputError, fail
from mapfilter.evaluation.accuracy import SUCCESS_RADIUS_M, position_errors_m
from mapfilter.evaluation.truth import Truth
from mapfilter.experiments.recorded.benchmark import Benchmark, Journey, Judged, Task
from mapfilter.experiments.recorded.ground import (
    corridor_routes,
    lattice_about,
    open_ground,
    positions_of,
    predicted,
)
from mapfilter.experiments.recorded.locating import OpenMap, locate_log
from mapfilter.experiments.recorded.rows import Found
from mapfilter.experiments.recorded.scoring import score_journey
from mapfilter.experiments.recorded.worst_report import WorstReport, worst_report
from mapfilter.filters.contract import Reason, Status
from mapfilter.geodesy import project
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.positioning.fingerprints.locating import (
    ReportLocator,
    locate_by,
    locator_for,
)
from mapfilter.positioning.fingerprints.sources import reports_of_database, reports_of_logs
from mapfilter.propagation.shadowing import named_rng
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.radio.reported_power import reported_eirp_dbm
from mapfilter.roads.corridors import Positions
from mapfilter.tracks.joining.identify import name_by_plan
from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.open_log import open_log
from mapfilter.tracks.open_options import CombineOptions, OpenOptions

ZONE = "Europe/Brussels"
LEAST_S = 60.0
HEIGHT_M, CARRIER_DBM = 30.0, 58.0
"""Usual values, the latter of a carrier's EIRP: the table of towers has neither."""
_TOWERS = "tower_data/towers.json"
_MARGIN_M, _BOX_MARGIN_M, _BOX_RESOLUTION_M = 300.0, 1500.0, 25.0
_NEAR_M = 5000.0
_FLOOR_DBM = -130.0
"""Phones report RSRP down to about this."""
_LARGEST_BYTES = 10_000_000
_BOX = "box"


def units(folder: Path) -> list[tuple[str, str, int]]:
    """Return each walk; the part is its place."""
    return [(_place(file), file.stem, 1) for file in _walks(folder)]


@dataclass(frozen=True, eq=False)
class Place:
    """Walks of a place by their files' names, the cells near them, and a locator of reports."""

    logs: dict[str, TrackLog]
    plan: CellPlan
    locator: ReportLocator


def prepare(folder: Path, work: Path) -> None:
    """Predict the levels anywhere in the box around the towers of each place."""
    for place in dict.fromkeys(_place(file) for file in _walks(folder)):
        logs, plan = _place_of(folder, place)
        at = np.array([(cell.east_m, cell.north_m) for cell in plan.cells])
        towers = [Positions(at[:, 0], at[:, 1])]
        crs = next(iter(logs.values())).crs
        box = lattice_about(crs, towers, _BOX_MARGIN_M, _BOX_RESOLUTION_M)
        predicted(plan, box, open_ground(box), work / place / _BOX, floor_dbm=_FLOOR_DBM)


def read(task: Task) -> Place:
    """Read the walks of a place, and fit the locator to the levels predicted there."""
    logs, plan = _place_of(task.data, task.part)
    box = open_database(task.work / task.part / _BOX)
    # As ``locate`` does: regions are those of reports with as many cells and timing advances.
    reports = reports_of_logs([name_by_plan(log, plan) for log in logs.values()], plan)
    fitted = locator_for(reports, reports_of_database(box), "probabilistic")
    return Place(logs, plan, fitted)


def judge(task: Task, shared: Place) -> Judged:
    """Judge a walk: what the filter claims while the radio stands still, and each fresh report."""
    own, near = shared.logs[task.unit], shared.plan
    others = [positions_of(log.truth) for log in shared.logs.values() if log is not own]
    folder = task.work / task.unit
    lattice = lattice_about(own.crs, others, _MARGIN_M)
    routes = corridor_routes(lattice, others)
    predicted(near, lattice, routes, folder / "corridor", floor_dbm=_FLOOR_DBM)
    rng = named_rng(task.seed, "belgium", task.unit)
    named = name_by_plan(own, near)
    located = locate_log(repeated(named), OpenMap.open(folder / "corridor"), rng)
    truth = Truth.of_table(own.truth)
    assert truth is not None, "walks have more than one position"
    delay_s = stale_after_s(located.estimate, named)
    live = score_journey(task.part, "live", task.unit, located.estimate, truth)
    named_in_time = bool(delay_s <= LEAST_S) and not claimed_wrongly(located.estimate, truth)
    note = f"stale radio named after {delay_s:.0f} s. {live.note}"
    live = replace(live, success=named_in_time, seconds=located.filter_s, note=note)
    alone, worst = _fresh_reports(task, named, shared)
    journeys = {"live": Journey(located.estimate, truth, folder / "corridor")}
    return Judged((live, alone), journeys, {} if worst is None else {alone.method: worst})


def read_walk(file: Path) -> TrackLog:
    """Read a walk: radio that was renewed, positions as truth, and motion made from them."""
    combine = CombineOptions(truth=(file,), course_motion=True)
    log = open_log(file, options=OpenOptions(zone=ZONE, combine=combine)).log
    if log.truth.empty and len(log.gnss):
        rows = log.gnss[["time_s", "east_m", "north_m"]].drop_duplicates("time_s")
        log = replace(log, truth=rows)
    return replace(log, gnss=log.gnss.iloc[:0])


def read_towers(file: Path, crs: str) -> CellPlan:
    """Read the table of towers; heights and powers, which it lacks, are usual ones."""
    try:
        table: dict[str, Any] = json_value(read_input(file, _LARGEST_BYTES, "a table of towers"))
        cells = [_cell(name, row, crs) for name, row in table.items()]
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        expected = "cells with latitude, longitude, pci, earfcn and azimuth"
        raise fail(InputError, str(file), expected, repr(error)) from error
    return CellPlan(crs, tuple(cells))


def repeated(log: TrackLog) -> TrackLog:
    """Return a log in which the last report is repeated at each later position, as logged."""
    radio, rows = log.radio, [log.radio]
    if not len(radio):
        return log
    last_s = float(radio["time_s"].max())
    last = radio[radio["time_s"] == last_s]
    later = log.truth["time_s"].to_numpy()
    rows += [last.assign(time_s=float(at)) for at in later[later > last_s]]
    return replace(log, radio=pd.concat(rows, ignore_index=True))


def stale_after_s(estimate: TrackEstimate, fresh: TrackLog) -> float:
    """Return the time from the radio's last change until the filter names it; NaN if never."""
    if not len(fresh.radio):
        return nan
    last_s = float(fresh.radio["time_s"].max())
    named = [
        float(at)
        for at, why in zip(estimate.time_s, estimate.reason, strict=True)
        if why is Reason.STALE_RADIO and at > last_s
    ]
    return min(named) - last_s if named else nan


def claimed_wrongly(estimate: TrackEstimate, truth: Truth) -> bool:
    """Return whether any CONVERGED epoch, not only the first, is more than 50 m off."""
    claims = np.array([status is Status.CONVERGED for status in estimate.status])
    return bool(np.any(position_errors_m(estimate, truth)[claims] > SUCCESS_RADIUS_M))


def _place_of(folder: Path, place: str) -> tuple[dict[str, TrackLog], CellPlan]:
    """Return the walks of a place, and the cells near them.

    Raises
    ------
    InputError
        There are no other walks to make the map of one of, or no cells within 5 km of them.
    """
    logs = {file.stem: read_walk(file) for file in _walks(folder) if _place(file) == place}
    where = str(folder / "walks" / f"{place}_*.txt")
    if len(logs) < 2:
        hint = "each walk is located on the map of the others"
        raise fail(InputError, where, "two walks of a place or more", len(logs), hint)
    towers = read_towers(folder / _TOWERS, next(iter(logs.values())).crs)
    plan = _near(towers, [positions_of(log.truth) for log in logs.values()])
    if not len(plan):
        expected = f"cells of {_TOWERS} within {_NEAR_M / 1000:g} km of the walks"
        raise fail(InputError, where, expected, "none")
    return logs, plan


def _fresh_reports(task: Task, log: TrackLog, place: Place) -> tuple[Found, WorstReport | None]:
    """Locate each report that was measured by itself, anywhere around the towers."""
    # Without a position by GNSS at its time a report is not scored.
    reports = reports_of_logs([log], place.plan)
    located = locate_by(place.locator, reports)
    known = np.isfinite(located.error_m)
    sites = _site_errors_m(log, place.plan)
    held = (located.error_m <= located.radii_m[:, 2])[known]
    found = Found(
        task.part,
        "locate",
        task.unit,
        None,
        None,
        None,
        located.error_m[known],
        held,
        sites,
        note=f"{int(known.sum())} reports were measured",
    )
    return found, worst_report(reports, located, place.locator.database)


def _site_errors_m(log: TrackLog, plan: CellPlan) -> np.ndarray:
    """Return how far the serving cell's site is from each fresh report."""
    serving = log.radio[log.radio["role"] == "serving"]
    site = {cell.id: (cell.east_m, cell.north_m) for cell in plan.cells}
    truth = Truth.of_table(log.truth)
    assert truth is not None, "walks have more than one position"
    east, north = truth.at(serving["time_s"].to_numpy())
    errors = [
        np.hypot(e - site[cell][0], n - site[cell][1])
        for e, n, cell in zip(east, north, serving["cell"], strict=True)
        if cell in site
    ]
    return np.array([error for error in errors if np.isfinite(error)], dtype=np.float64)


def _cell(name: str, row: dict[str, Any], crs: str) -> Cell:
    east, north = project(crs, [float(row["longitude"])], [float(row["latitude"])])
    frequency = float(str(row["downlink_frequency"]).split()[0])
    assumed = ["height_m", "eirp_dbm", *(["azimuth_deg"] if row["azimuth"] is None else [])]
    return Cell(
        name,
        str(row["enb_id"]),
        float(east[0]),
        float(north[0]),
        HEIGHT_M,
        None if row["azimuth"] is None else float(row["azimuth"]),
        reported_eirp_dbm(CARRIER_DBM, "LTE"),
        frequency,
        antenna="omni" if row["azimuth"] is None else "sector",
        ci=int(name),
        arfcn=int(row["earfcn"]),
        bsic=int(row["pci"]),
        technology="LTE",
        assumed=" ".join(assumed),
    )


def _near(plan: CellPlan, tracks: Sequence[Positions]) -> CellPlan:
    """Return the cells near the tracks' middle."""
    east = float(np.mean(np.concatenate([track.east_m for track in tracks])))
    north = float(np.mean(np.concatenate([track.north_m for track in tracks])))
    near = [c for c in plan.cells if np.hypot(c.east_m - east, c.north_m - north) < _NEAR_M]
    return CellPlan(plan.crs, tuple(near))


def _walks(folder: Path) -> list[Path]:
    return sorted((folder / "walks").glob("*.txt"))


def _place(file: Path) -> str:
    return file.stem.rpartition("_")[0]


BENCHMARK = Benchmark(
    "belgium",
    "cell-belgium-lte",
    ("walks/*.txt", _TOWERS),
    units,
    judge,
    prepare,
    read,
    shared_by_part=True,
)
