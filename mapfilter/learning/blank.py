"""Databases and logs that say nothing of the radio: tracks by map and dead reckoning alone.

No fault of a cell can bias such a track. The one cell of a blank database is received everywhere
at the same level, and serves in every report of a blank log.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.database.rewrite import rewrite, routes_of
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.schema import SERVING

EVERYWHERE = "everywhere"
_LEVEL_DBM = -80.0


def blank_database(database: RadioRouteDatabase, out: Path) -> RadioRouteDatabase:
    """Write a database of the same points with one cell that is received alike everywhere."""
    west, south, east, north = database.lattice.bounds_m
    middle = 0.5 * (west + east), 0.5 * (south + north)
    cell = Cell(EVERYWHERE, EVERYWHERE, *middle, 30.0, None, 50.0, 1800.0, antenna="omni")
    routes = routes_of(database)
    level = np.full((1, len(routes)), _LEVEL_DBM, dtype=np.float32)
    return rewrite(database, out, CellPlan(database.plan.crs, (cell,)), routes, level)


def blank_log(log: TrackLog) -> TrackLog:
    """Return a log in which every report names the cell of a blank database, and nothing else."""
    radio = log.radio.drop_duplicates("time_s").reset_index(drop=True)
    unknown = {name: pd.array([pd.NA] * len(radio), dtype="Int64") for name in ("arfcn", "bsic")}
    cell = pd.Series([EVERYWHERE] * len(radio), dtype=object)
    advance = pd.array([pd.NA] * len(radio), dtype="Int64")
    inside = pd.array(np.zeros(len(radio), dtype=np.int8), dtype=radio["censored"].dtype)
    return replace(
        log,
        radio=radio.assign(
            role=SERVING,
            cell=cell,
            level_dbm=np.nan,
            censored=inside,
            timing_advance=advance,
            **unknown,
        ),
    )
