"""Locate single reports in a notebook."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.positioning.fingerprints.censoring import bounds_of
from mapfilter.positioning.fingerprints.located import LocatedReports
from mapfilter.positioning.fingerprints.locating import (
    fit_locator,
    locate_by,
    timed_share,
    usual_readings,
)
from mapfilter.positioning.fingerprints.options import AUTO, Method
from mapfilter.positioning.fingerprints.reports import Reports
from mapfilter.positioning.fingerprints.sources import reports_of_database, reports_of_logs
from mapfilter.tracks.log import TrackLog


def locate_reports(
    log: TrackLog | Reports,
    database: RadioRouteDatabase | Reports | TrackLog | Sequence[TrackLog],
    method: Method | str = AUTO,
    *,
    level_error_db: float = 6.0,
    seed: int | np.random.Generator = 0,
) -> LocatedReports:
    """Locate each report of a log by itself, without motion.

    Parameters
    ----------
    log : TrackLog or Reports
        What was received; in the CRS of the database.
    database : RadioRouteDatabase, Reports, TrackLog or sequence of TrackLog
        Predicted or surveyed levels; or fingerprints: logs with ground truth, or a table of
        :func:`mapfilter.read_fingerprint_table`.
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
        The log is in another CRS than the database, or the database has no report with a position.
    ConfigError
        There is no such method.
    """
    plan = None
    if isinstance(database, RadioRouteDatabase):
        known, plan = reports_of_database(database, level_error_db), database.plan
    elif isinstance(database, Reports):
        known = database
    else:
        known = reports_of_logs([database] if isinstance(database, TrackLog) else database)
    reports = reports_of_logs([log], plan) if isinstance(log, TrackLog) else log
    rng = np.random.default_rng(seed)
    strongest = usual_readings(reports)
    fitted = fit_locator(
        known,
        method,
        rng,
        strongest=strongest,
        bounds=bounds_of(reports),
        timed=timed_share(reports),
    )
    return locate_by(fitted, reports)
