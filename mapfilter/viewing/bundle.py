"""The bundle: everything that a view shows, as one JSON object.

Format and meaning of its fields are in the documentation ("See a replay"); arrays are packed by
:mod:`mapfilter.viewing.arrays`.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any

import numpy as np

from mapfilter._io import program_version
from mapfilter._types import Floats
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.errors import InputError
from mapfilter.geodesy import unproject
from mapfilter.positioning.bayes.beliefs.model import BayesModel
from mapfilter.positioning.bayes.filter import BayesPositioner
from mapfilter.radio.cells import CellPlan
from mapfilter.roads.ways import Bounds
from mapfilter.viewing.explain import TERMS
from mapfilter.viewing.ground import ViewFrame, background, cells_of, empty_background, level_fields
from mapfilter.viewing.page_constants import constants
from mapfilter.viewing.readings import REASONS, LevelAt, level_on
from mapfilter.viewing.runs import STATUSES, ViewedRun, run_of, thresholds, tracks_bounds
from mapfilter.viewing.words import REASONS as WORDS

FORMAT, VERSION = "mapfilter-view", 1

_AROUND_M = 400.0
_ALIGNED_M = 100.0


def replay_bundle(
    title: str, runs: Sequence[ViewedRun], database: RadioRouteDatabase | None
) -> dict[str, Any]:
    """Return the bundle of one or more runs over one database.

    Parameters
    ----------
    runs : sequence of ViewedRun
        Their positions are in the CRS of the database.
    database : RadioRouteDatabase or None
        None for filters without a map.
    """
    crs = runs[0].estimate.crs if runs else ""
    tracks = tracks_bounds(runs, _AROUND_M)
    if database is not None:
        bounds: Bounds = database.lattice.bounds_m
        crs, plan = database.lattice.crs, database.plan
    else:
        bounds, plan = tracks or (0.0, 0.0, 1.0, 1.0), CellPlan(crs, ())
    frame = _frame(crs, bounds)
    found = _head("replay", title, frame, bounds, plan)
    measured = _measured(runs)
    ways: dict[str, int] = {}
    if database is not None:
        found |= {
            "attribution": database.attribution,
            "database": database.generation,
            "background": background(database, frame),
        }
        ways = {one["id"]: at for at, one in enumerate(found["background"]["ways"])}
        if database.cell_ids and tracks is not None:
            fields = _fields(database, frame, tracks, measured)
            if fields is not None:
                found["levels"], bands = fields
                models = (one for run in runs if (one := _model(run)) is not None)
                found["why"] = _why(next(models, None), tuple(bands))
    found["runs"] = [run_of(run, frame, plan, ways, _level_at(run)) for run in runs]
    return found


def database_bundle(
    title: str, database: RadioRouteDatabase, filter_: BayesPositioner | None = None
) -> dict[str, Any]:
    """Return the bundle of a database: streets, cells, best servers, levels of every cell.

    Parameters
    ----------
    filter_ : BayesPositioner, optional
        Its positions are shown while they come: the bundle is "live" then, and holds what the page
        needs to compare places by a report.
    """
    bounds = database.lattice.bounds_m
    frame = _frame(database.lattice.crs, bounds)
    kind = "database" if filter_ is None else "live"
    found = _head(kind, title, frame, bounds, database.plan)
    found |= {
        "attribution": database.attribution,
        "database": database.generation,
        "background": background(database, frame),
    }
    if database.cell_ids:
        found["levels"], bands = level_fields(database, frame, None)
        if filter_ is not None:
            found["why"] = _why(filter_.model, tuple(bands))
    if filter_ is not None:
        found["thresholds"], found["terms"] = thresholds(filter_), list(TERMS)
    return found


def _head(
    kind: str, title: str, frame: ViewFrame, bounds: Bounds, plan: CellPlan
) -> dict[str, Any]:
    _, _, east_m, north_m = bounds
    size = east_m - frame.west_m, north_m - frame.south_m
    corners_m = [(0.0, 0.0), (size[0], 0.0), size, (0.0, size[1])]
    east, north = np.array(corners_m).T
    lon, lat = unproject(frame.crs, east + frame.west_m, north + frame.south_m)
    return {
        "format": FORMAT,
        "version": VERSION,
        "kind": kind,
        "title": title,
        "mapfilter": program_version(),
        "database": "",
        "frame": {
            "crs": frame.crs,
            "origin": [frame.west_m, frame.south_m],
            "size": [round(side, 1) for side in size],
            "corners": [[round(x, 7), round(y, 7)] for x, y in zip(lon, lat, strict=True)],
        },
        "attribution": "",
        "notes": [],
        "statuses": [str(one) for one in STATUSES],
        "reasons": [str(one) for one in REASONS],
        "words": {str(reason): text for reason, text in WORDS.items()},
        "cells": cells_of(plan, frame),
        "background": empty_background(),
        "levels": None,
        "why": None,
        "runs": [],
    }


def _frame(crs: str, bounds: Bounds) -> ViewFrame:
    west_m, south_m = (_ALIGNED_M * float(np.floor(at / _ALIGNED_M)) for at in bounds[:2])
    return ViewFrame(crs, west_m, south_m)


def _measured(runs: Sequence[ViewedRun]) -> set[str]:
    found: set[str] = set()
    for run in runs:
        if run.log is not None and len(run.log.radio):
            found.update(str(cell) for cell in run.log.radio["cell"].dropna().unique())
    return found


def _fields(
    database: RadioRouteDatabase, frame: ViewFrame, tracks: Bounds, measured: Collection[str]
) -> tuple[dict[str, Any], Any] | None:
    west, south, east, north = database.lattice.bounds_m
    inside = (
        max(tracks[0], west),
        max(tracks[1], south),
        min(tracks[2], east),
        min(tracks[3], north),
    )
    if inside[0] >= inside[2] or inside[1] >= inside[3]:
        return None
    try:
        return level_fields(database, frame, inside, measured)
    except InputError:
        # The tracks lie where the database has no point.
        return None


def _model(run: ViewedRun) -> BayesModel | None:
    filter_ = run.trace.filter if run.trace is not None else None
    return filter_.model if isinstance(filter_, BayesPositioner) else None


def _why(model: BayesModel | None, cells: Sequence[str]) -> dict[str, Any] | None:
    """Return the constants of a map filter's model; ``cells`` are the bands of the levels."""
    if type(model) is not BayesModel:
        # Over measured maps serving cells count where they were measured, which is not in the page.
        return None
    site = dict(zip(model.area.cell_ids, model.area.site_of.tolist(), strict=True))
    return {**constants(model), "site": [site.get(cell, -1) for cell in cells]}


def _level_at(run: ViewedRun) -> LevelAt:
    """Return a function that looks levels up on the filter's own map."""
    model = _model(run)

    def nothing(east_m: Floats, north_m: Floats, cells: Sequence[str | None]) -> Floats:  # noqa: ARG001
        return np.full(len(cells), np.nan)

    return nothing if model is None else level_on(model.area)
