"""The report of ``mapfilter learn``: findings, cells and journeys as tables, and a map."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import shapely

from mapfilter._io import atomic_file
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.learning.learn import Lesson
from mapfilter.learning.patch import Change
from mapfilter.report.learned import plot_learned
from mapfilter.report.saving import save
from mapfilter.workflows.lessons.study import Taught
from mapfilter.workflows.outputs.served import served_points, street_map

PATCH, FINDINGS, CELLS, JOURNEYS, MAP = (
    "patch.toml",
    "findings.csv",
    "cells.csv",
    "journeys.csv",
    "learned.png",
)
_COLUMNS = (
    "kind",
    "cell",
    "value",
    "unit",
    "log_bayes_factor",
    "probability",
    "journeys",
    "agreeing",
    "east_m",
    "north_m",
)
_UNITS = {"offset": "dB", "turned": "deg", "rotated": "deg", "moved": "m", "way": "m"}


def older_report(out: Path) -> list[Path]:
    """Return the files of an older report in a folder."""
    names = PATCH, FINDINGS, CELLS, JOURNEYS, MAP
    return [path for name in names if (path := out / name).is_file()]


def write_report(taught: Taught, out: Path) -> tuple[dict[str, Any], ...]:
    """Write tables and map into a folder, and return the findings."""
    database, lesson, patch = taught.database, taught.lesson, taught.patch
    findings = findings_of(taught)
    _write(pd.DataFrame(findings, columns=_COLUMNS), out / FINDINGS)
    _write(_cells(database, lesson), out / CELLS)
    _write(_journeys(lesson, taught.names), out / JOURNEYS)
    base = street_map(database, served_points(database))
    kept = [
        np.column_stack([track.east_m, track.north_m])
        for track, use in zip(taught.tracks, lesson.trusted.tolist(), strict=True)
        if use
    ]
    save(plot_learned(patch.changes, database.plan, base, kept), out / MAP)
    return tuple(findings)


def findings_of(taught: Taught) -> list[dict[str, Any]]:
    """Return the findings, one row each: changes first, then cells that the database lacks."""
    found = [_finding(change, taught.database) for change in taught.patch.changes]
    for one in taught.unlisted:
        known = np.isfinite(one.east_m)
        row = dict.fromkeys(_COLUMNS)
        row |= {"kind": "unlisted", "cell": one.cell, "unit": ""}
        row |= {"journeys": one.journeys, "agreeing": one.journeys}
        row["east_m"] = round(one.east_m, 1) if known else None
        row["north_m"] = round(one.north_m, 1) if known else None
        found.append(row)
    return found


def _finding(change: Change, database: RadioRouteDatabase) -> dict[str, Any]:
    value: float | None = None
    place: tuple[float, float] | None = None
    if change.kind == "offset":
        value = change.offset_db
    elif change.kind in ("turned", "rotated"):
        value = change.turn_deg
    elif change.kind == "moved":
        cell = database.plan[change.cells[0]]
        place = change.east_m, change.north_m
        value = float(np.hypot(place[0] - cell.east_m, place[1] - cell.north_m))
    elif change.kind == "way":
        line = shapely.LineString(change.line_m)
        middle = line.interpolate(0.5, normalized=True)
        value, place = float(line.length), (middle.x, middle.y)
    return {
        "kind": change.kind,
        "cell": " ".join(change.cells),
        "value": None if value is None else round(value, 1),
        "unit": _UNITS.get(change.kind, ""),
        "log_bayes_factor": round(change.log_bayes_factor, 1),
        "probability": round(change.probability, 4),
        "journeys": change.journeys,
        "agreeing": change.agreeing,
        "east_m": None if place is None else round(place[0], 1),
        "north_m": None if place is None else round(place[1], 1),
    }


def _cells(database: RadioRouteDatabase, lesson: Lesson) -> pd.DataFrame:
    visits, states = lesson.visits, lesson.learned.network.cells
    count = len(database.plan)
    return pd.DataFrame(
        {
            "cell": database.cell_ids,
            "offset_db": [round(s.offset_db, 2) if s.kind != "dead" else np.nan for s in states],
            "offset_sd_db": [round(s.offset_sd_db, 2) for s in states],
            "visits": np.bincount(visits.cell, minlength=count),
            "received": np.bincount(visits.cell[visits.received], minlength=count),
        }
    )


def _journeys(lesson: Lesson, names: Sequence[str]) -> pd.DataFrame:
    learned, visits = lesson.learned, lesson.visits
    return pd.DataFrame(
        {
            "log": names,
            "trust": np.round(learned.trust, 3),
            "phone_offset_db": np.round(learned.phone_db, 2),
            "visits": np.bincount(visits.journey, minlength=len(names)),
        }
    )


def _write(table: pd.DataFrame, path: Path) -> None:
    with atomic_file(path) as temporary:
        table.to_csv(temporary, index=False)
