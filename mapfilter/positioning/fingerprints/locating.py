"""Locate single reports: choose a method by cross-validation, calibrate regions, locate."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import nan

import numpy as np

from mapfilter._parallel import Progress
from mapfilter.errors import ConfigError, InputError, fail
from mapfilter.geodesy import same_grid, shown_crs
from mapfilter.positioning.fingerprints.censoring import OPEN, Bounds, bounded, bounds_of
from mapfilter.positioning.fingerprints.cross_validation import (
    MOST_VALIDATED,
    cross_validate,
    drawn_errors,
    folds_of,
    positions_of,
    validation_of,
)
from mapfilter.positioning.fingerprints.located import (
    LOCATED,
    NOTHING,
    UNKNOWN,
    LocatedReports,
    Validation,
)
from mapfilter.positioning.fingerprints.matches import Position, Received, locator
from mapfilter.positioning.fingerprints.options import (
    AUTO,
    CANDIDATES,
    METHODS,
    Method,
    Probabilistic,
    SurveyMaps,
    method_options,
)
from mapfilter.positioning.fingerprints.regions import Regions, calibrate
from mapfilter.positioning.fingerprints.reports import Reports
from mapfilter.positioning.fingerprints.sources import STRONGEST, simulated_reports

_LEAST_VALIDATED = 20


@dataclass(frozen=True, eq=False)
class ReportLocator:
    """A method with its database and regions; made by :func:`fit_locator`.

    Parameters
    ----------
    regions : Regions or None
        None where too few reports have a position to calibrate them.
    validations : tuple of Validation
        Of each method that was tried; the first is of the method chosen.
    """

    method: Method
    database: Reports
    locator: Callable[[Received], Position]
    regions: Regions | None
    validations: tuple[Validation, ...]


def fit_locator(
    database: Reports,
    method: Method | str = AUTO,
    rng: np.random.Generator | None = None,
    *,
    strongest: int = STRONGEST,
    validated: int = MOST_VALIDATED,
    bounds: Bounds = OPEN,
    timed: float = 0.0,
    progress: Progress | None = None,
) -> ReportLocator:
    """Cross-validate a method on a database, calibrate its regions, and prepare it.

    There is nothing to leave out of predicted levels: regions are calibrated with reports that are
    drawn with the errors that are stated for them.

    Parameters
    ----------
    database : Reports
        Those without a position are left out.
    method : options, or name
        "auto" takes the one of :data:`~.options.CANDIDATES` with the lowest median error in
        cross-validation.
    rng : numpy.random.Generator, optional
        Draws reports from predicted levels; seeded with 0 when left out.
    strongest : int
        Number of cells in such a report.
    validated : int
        Most reports by which regions are calibrated.
    bounds : Bounds
        Ends of the scale of the reports to be located: those of the calibration end there, too.
    timed : float
        Share of the reports to be located that have a timing advance.
    progress : callable, optional
        Called with folds done and folds in all.

    Raises
    ------
    InputError
        No report has a position and a transmitter.
    ConfigError
        There is no such method, or no survey maps of predicted levels.
    """
    tried = [method] if not isinstance(method, str) else list(CANDIDATES)
    if isinstance(method, str) and method != AUTO:
        tried = [method_options(method)]
    elif not isinstance(method, str) and type(method) not in METHODS.values():
        names = ", ".join((AUTO, *METHODS))
        raise fail(ConfigError, "method", f"{names}, or options of one", type(method).__name__)
    placed = database.placed()
    if placed.predicted and any(isinstance(one, SurveyMaps) for one in tried):
        hint = "levels of a radio-route database are maps already; use probabilistic"
        raise fail(ConfigError, "method gp", "measured reports", "predicted levels", hint)
    found = []
    if placed.predicted:
        blocks = "reports drawn with the stated errors"
        rng = rng if rng is not None else np.random.default_rng(0)
        shared_db = Probabilistic().shared_db
        some = simulated_reports(placed, validated, strongest, shared_db, rng, timed)
        some = bounded(some, bounds)
        found = [(one, drawn_errors(placed, one, some)) for one in tried]
    else:
        fold, blocks = folds_of(placed)
        count = len(np.unique(fold))
        for number, one in enumerate(tried):

            def report(done: int, _: int, begun: int = number * count) -> None:
                if progress is not None:
                    progress(begun + done, count * len(tried))

            found.append((one, cross_validate(placed, one, fold, report, validated, bounds)))
    found.sort(key=lambda pair: float(np.median(pair[1].error_m)) if len(pair[1]) else np.inf)
    chosen, errors = found[0]
    enough = len(errors) >= _LEAST_VALIDATED
    validations = tuple(
        validation_of(one, some, blocks) for one, some in found if len(some) >= _LEAST_VALIDATED
    )
    regions = calibrate(errors) if enough else None
    return ReportLocator(chosen, placed, locator(chosen, placed), regions, validations)


def locator_for(
    reports: Reports,
    database: Reports,
    method: Method | str = AUTO,
    rng: np.random.Generator | None = None,
    *,
    progress: Progress | None = None,
) -> ReportLocator:
    """Fit a method as :func:`fit_locator` does, calibrated by reports that are like given ones.

    They have as many cells, ends of the scale and timing advances as ``reports``, which are to be
    located.
    """
    return fit_locator(
        database,
        method,
        rng,
        strongest=usual_readings(reports),
        bounds=bounds_of(reports),
        timed=timed_share(reports),
        progress=progress,
    )


def usual_readings(reports: Reports) -> int:
    """Return the median number of readings of the reports that have any; at least 1."""
    counts = np.diff(reports.first)
    return int(np.median(counts[counts > 0])) if (counts > 0).any() else 1


def timed_share(reports: Reports) -> float:
    """Return the share of the reports with readings that have a timing advance."""
    timed = np.isfinite(reports.timing_advance[np.diff(reports.first) > 0])
    return float(timed.mean()) if timed.size else 0.0


def locate_by(fitted: ReportLocator, reports: Reports) -> LocatedReports:
    """Locate each report by itself.

    Raises
    ------
    InputError
        The reports are in a CRS with other metres than that of the database.
    """
    database = fitted.database
    if not same_grid(reports.crs, database.crs):
        expected = f"{shown_crs(database.crs)}, the database's"
        hint = "log of another area or zone"
        raise fail(InputError, "log, crs", expected, shown_crs(reports.crs), hint)
    received = np.diff(reports.first)
    named, unknown = reports.named_as(database.cell_ids)
    positions, located = positions_of(fitted.locator, named, np.arange(len(reports)))
    east_m, north_m = np.full((2, len(reports)), nan)
    east_m[located], north_m[located] = positions[:, 0], positions[:, 1]
    radii_m = np.full((len(reports), 3), nan)
    if fitted.regions is not None:
        radii_m[located] = fitted.regions.radii_m(positions[:, 2], positions[:, 3])
    reason = np.where(located, LOCATED, np.where(received > 0, UNKNOWN, NOTHING))
    return LocatedReports(
        database.crs,
        fitted.method,
        reports.time_s,
        east_m,
        north_m,
        radii_m,
        np.diff(named.first),
        unknown,
        tuple(reason.tolist()),
        np.hypot(east_m - reports.east_m, north_m - reports.north_m),
        fitted.validations,
        reports.notes,
    )
