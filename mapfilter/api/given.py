"""What may be given as an object or by its path."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import pandas as pd

from mapfilter._arguments import PATH, Argument
from mapfilter.api.logs import TABLE, read_log, read_log_of_area
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.database.store import open_database
from mapfilter.tracks.checks.placeless import in_frame
from mapfilter.tracks.log import TrackLog

OTHER_LOGS = (
    (pd.DataFrame, TABLE),
    (Mapping, "logs by their names, as of simulate: give one of them"),
)
"""What is given for a log, and what to do with it."""


def database_argument(value: object) -> Argument:
    """Return the argument ``database`` to be checked."""
    expected = "a database of open_database or build, or its path"
    return Argument("database", value, RadioRouteDatabase | PATH, expected)


def optional_database(value: object) -> Argument:
    """Return the argument ``database`` to be checked, where some filters need none."""
    expected = "a database of open_database or build, or its path, or None"
    return Argument("database", value, RadioRouteDatabase | PATH | None, expected)


def log_argument(value: object) -> Argument:
    """Return the argument ``log`` to be checked."""
    expected = "a log of read_log or make_log, or its path"
    return Argument("log", value, TrackLog | PATH, expected, OTHER_LOGS)


def opened(database: RadioRouteDatabase | Path | str) -> RadioRouteDatabase:
    """Return a database, opened where it is a path."""
    return database if isinstance(database, RadioRouteDatabase) else open_database(database)


def read(
    log: TrackLog | Path | str, crs: str, about_deg: tuple[float, float] | None = None
) -> TrackLog:
    """Return a log in a CRS, see :func:`in_frame`; read where it is a path."""
    if isinstance(log, TrackLog):
        return in_frame(log, crs, about_deg)
    return (
        read_log(log, crs=crs) if about_deg is None else read_log_of_area(log, crs, about_deg, {})
    )
