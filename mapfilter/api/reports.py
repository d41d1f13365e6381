"""Locate single reports in a notebook."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from mapfilter._arguments import PATH, Argument, Setting, check_arguments, generator
from mapfilter.api.given import OTHER_LOGS, opened, read
from mapfilter.api.python_words import python_words
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.options import Positive
from mapfilter.positioning.fingerprints.located import LocatedReports
from mapfilter.positioning.fingerprints.locating import locate_by, locator_for
from mapfilter.positioning.fingerprints.options import AUTO, LEVEL_ERROR_DB, Method
from mapfilter.positioning.fingerprints.reports import Reports
from mapfilter.positioning.fingerprints.sources import reports_of_database, reports_of_logs
from mapfilter.tracks.checks.placeless import in_frame
from mapfilter.tracks.checks.range_units import with_range_notes
from mapfilter.tracks.joining.identify import name_by_plan
from mapfilter.tracks.log import TrackLog


@python_words()
def locate_reports(
    log: TrackLog | Reports | Path | str,
    database: RadioRouteDatabase | Path | str | Reports | TrackLog | Iterable[TrackLog],
    method: Method | str = AUTO,
    *,
    level_error_db: float = LEVEL_ERROR_DB,
    seed: int | np.random.Generator = 0,
) -> LocatedReports:
    """Locate each report of a log by itself, without motion.

    Parameters
    ----------
    log : TrackLog, Reports or path
        What was received. A log of another CRS than the database is projected, with a note. A
        path is read as by :func:`mapfilter.read_log`.
    database : RadioRouteDatabase or its path, Reports, TrackLog or several
        Predicted or surveyed levels; or fingerprints: logs with ground truth, of which the first
        has the CRS of all, or a table of :func:`mapfilter.read_fingerprint_table`.
    method : options, or str
        "knn", "probabilistic", "gp", "centroid", their options, or "auto" for the best of the first
        two in cross-validation.
    level_error_db : float
        Standard deviation of the errors of the levels of a radio-route database.
    seed : int or numpy.random.Generator
        Of the reports by which regions of a radio-route database are calibrated.

    Raises
    ------
    InputError
        Reports, or a log in a local frame, are in another CRS than the database, or the database
        has no report with a position.
    ConfigError
        There is no such method, an argument is none of these, or the seed is none.
    """
    check_arguments(
        "locate_reports",
        Argument(
            "log",
            log,
            TrackLog | Reports | PATH,
            "a log, reports or the path of a log",
            OTHER_LOGS,
        ),
        Argument(
            "database",
            database,
            RadioRouteDatabase | PATH | Reports | TrackLog | Iterable,
            "a database or its path, reports, or logs",
        ),
        keywords=[Setting("level_error_db", level_error_db, Positive)],
    )
    rng = generator("locate_reports", seed)
    plan, about_deg = None, None
    if isinstance(database, RadioRouteDatabase | str | os.PathLike):
        database = opened(database)
        known, plan = reports_of_database(database, level_error_db), database.plan
        about_deg = database.lattice.middle_deg
    elif isinstance(database, Reports):
        known = database
    else:
        logs = [database] if isinstance(database, TrackLog) else list(database)
        each = [Argument(f"database[{k}]", one, TrackLog, "a log") for k, one in enumerate(logs)]
        check_arguments("locate_reports", *each)
        known = reports_of_logs([in_frame(one, logs[0].crs) for one in logs])
    if not isinstance(log, Reports):
        track = read(log, known.crs, about_deg)
        if plan is not None:
            track = with_range_notes(name_by_plan(track, plan), plan)
        log = reports_of_logs([track], plan)
    return locate_by(locator_for(log, known, method, rng), log)
