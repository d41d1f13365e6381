"""Locate single reports: choose a method by cross-validation, calibrate regions, locate."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from math import nan
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from scipy.spatial import cKDTree

from mapfilter._parallel import Progress
from mapfilter._types import Bools, Floats, Ints
from mapfilter.errors import ConfigError, InputError, fail
from mapfilter.geodesy import same_crs, unproject
from mapfilter.positioning.fingerprints.censoring import OPEN, Bounds, bounded
from mapfilter.positioning.fingerprints.matches import Position, Received, locator
from mapfilter.positioning.fingerprints.options import (
    AUTO,
    CANDIDATES,
    METHODS,
    Method,
    Probabilistic,
    SurveyMaps,
    method_name,
    method_options,
)
from mapfilter.positioning.fingerprints.regions import Errors, Regions, calibrate, coverage
from mapfilter.positioning.fingerprints.reports import Reports
from mapfilter.positioning.fingerprints.sources import STRONGEST, simulated_reports

MOST_FOLDS = 10
MOST_VALIDATED = 2000
"""Reports that are left out in cross-validation, evenly taken."""

LOCATED, NOTHING, UNKNOWN = "", "nothing received", "no transmitter of the database"
"""Why a report has no position; empty where it has one."""

_LEAST_VALIDATED = 20
_SPACINGS = 2.0
_LEAST_SQUARE_M = 1.0
_FORMER, _LATTER = 73_856_093, 19_349_663


@dataclass(frozen=True)
class Validation:
    """Errors of a method where a part of the database was left out in turn.

    Parameters
    ----------
    blocks : str
        What was left out: "logs", or "squares of N m"; or how reports were drawn.
    folds, reports : int
        Times that something was left out, and reports located.
    mean_m, median_m, error_95_m : float
    within_50, within_67, within_95 : float
        Shares of the reports within the radii, each calibrated without its own block.
    """

    method: str
    blocks: str
    folds: int
    reports: int
    mean_m: float
    median_m: float
    error_95_m: float
    within_50: float
    within_67: float
    within_95: float


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


@dataclass(frozen=True, eq=False, repr=False)
class LocatedReports:
    """Positions of R reports, each from that report alone.

    Parameters
    ----------
    east_m, north_m : ndarray, shape (R,)
        NaN where there is no position.
    radii_m : ndarray, shape (R, 3)
        Radii of the circles that hold 50, 67 and 95 % of the true positions; NaN where they are
        not calibrated.
    known, unknown : ndarray of int64, shape (R,)
        Transmitters received that the database has, and has not.
    reason : tuple of str
        Why there is no position, empty where there is one.
    error_m : ndarray, shape (R,)
        Distance to the true position; NaN where that is unknown.
    """

    crs: str
    method: Method
    time_s: Floats
    east_m: Floats
    north_m: Floats
    radii_m: Floats
    known: Ints
    unknown: Ints
    reason: tuple[str, ...]
    error_m: Floats
    validations: tuple[Validation, ...] = ()
    notes: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.time_s)

    def __repr__(self) -> str:
        located = int(np.isfinite(self.east_m).sum())
        scored = self.error_m[np.isfinite(self.error_m)]
        score = ""
        if scored.size:
            score = f", {scored.mean():.1f} m off on average, median {np.median(scored):.1f} m"
        return f"LocatedReports by {method_name(self.method)}: {located} of {len(self)}{score}"

    def to_dataframe(self) -> pd.DataFrame:
        """Return one row for each report: position, radii (m), transmitters, reason, error (m)."""
        lon_deg, lat_deg = unproject(self.crs, self.east_m, self.north_m)
        return pd.DataFrame(
            {
                "time_s": self.time_s,
                "east_m": self.east_m,
                "north_m": self.north_m,
                "lon_deg": np.where(np.isfinite(self.east_m), lon_deg, nan),
                "lat_deg": np.where(np.isfinite(self.east_m), lat_deg, nan),
                "radius_50_m": self.radii_m[:, 0],
                "radius_67_m": self.radii_m[:, 1],
                "radius_95_m": self.radii_m[:, 2],
                "known": self.known,
                "unknown": self.unknown,
                "reason": self.reason,
                "error_m": self.error_m,
            }
        )


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
        found = [(one, _simulated(placed, one, some)) for one in tried]
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
        _validation(one, some, blocks) for one, some in found if len(some) >= _LEAST_VALIDATED
    )
    regions = calibrate(errors) if enough else None
    return ReportLocator(chosen, placed, locator(chosen, placed), regions, validations)


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
        The reports are in another CRS than the database.
    """
    database = fitted.database
    if not same_crs(reports.crs, database.crs):
        expected = f"{database.crs}, the database's"
        raise fail(InputError, "log, crs", expected, reports.crs, "log of another area or zone")
    received = np.diff(reports.first)
    named, unknown = reports.named_as(database.cell_ids)
    positions, located = _positions(fitted.locator, named, np.arange(len(reports)))
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


def cross_validate(
    database: Reports,
    method: Method,
    fold: Ints,
    progress: Progress | None = None,
    most: int = MOST_VALIDATED,
    bounds: Bounds = OPEN,
) -> Errors:
    """Return the errors of a method where each fold is located by the database of the others.

    At most ``most`` reports are located, evenly taken; those of which no transmitter was received
    in the other folds have no error. Their levels end where ``bounds`` does.
    """
    count = min(len(database), most)
    tried = np.linspace(0, max(len(database) - 1, 0), count).astype(np.int64)
    parts = []
    for left in left_out(database, method, fold, tried, progress, bounds):
        block = np.full(len(left.positions), left.fold)
        spread_m, mismatch = left.positions[:, 2], left.positions[:, 3]
        parts.append(Errors(np.hypot(*left.off_m.T), spread_m, mismatch, block))
    columns = ("error_m", "spread_m", "mismatch", "block")
    empty = Errors(np.empty(0), np.empty(0), np.empty(0), np.empty(0, dtype=np.int64))
    every = [empty, *parts]
    return Errors(*(np.concatenate([getattr(part, name) for part in every]) for name in columns))


class LeftOut(NamedTuple):
    """Reports of a fold that were located by the others; L of them have a position.

    Parameters
    ----------
    fold : int
    reports : Reports
        Those L of them.
    positions : (L, 4) array
        East, north, spread and mismatch, see :class:`~.matches.Position`.
    """

    fold: int
    reports: Reports
    positions: Floats

    @property
    def off_m(self) -> Floats:
        """Errors east and north, shape (L, 2)."""
        return self.positions[:, :2] - self.reports.places


def left_out(
    database: Reports,
    method: Method,
    fold: Ints,
    tried: Ints,
    progress: Progress | None = None,
    bounds: Bounds = OPEN,
) -> Iterator[LeftOut]:
    """Yield some reports of each fold, located by the database of the other folds.

    Parameters
    ----------
    fold : (R,) array
        Of each report.
    tried : (T,) array
        Which reports are located.
    bounds : Bounds
        Where their levels end.
    """
    names = np.unique(fold)
    for done, one in enumerate(names.tolist()):
        others = fold != one
        own = tried[fold[tried] == one]
        if others.any() and len(own):
            rest, query = database.some(others).compact(), bounded(database.some(own), bounds)
            known, _ = query.named_as(rest.cell_ids)
            try:
                by = locator(method, rest)
            except InputError:
                continue
            positions, located = _positions(by, known, np.arange(len(query)))
            yield LeftOut(one, query.some(located), positions)
        if progress is not None:
            progress(done + 1, len(names))


def _simulated(database: Reports, method: Method, drawn: Reports) -> Errors:
    """Return the errors of a method at drawn reports; every tenth is of one block."""
    known, _ = drawn.named_as(database.cell_ids)
    positions, located = _positions(locator(method, database), known, np.arange(len(drawn)))
    off_m = positions[:, :2] - drawn.places[located]
    block = np.arange(len(positions)) % MOST_FOLDS
    return Errors(np.hypot(*off_m.T), positions[:, 2], positions[:, 3], block)


def folds_of(database: Reports) -> tuple[Ints, str]:
    """Return the fold of each report, and by what: by logs, or by squares where there is one log.

    Squares are twice as wide as the usual distance between neighbouring places.
    """
    blocks, which = np.unique(database.block, return_inverse=True)
    if len(blocks) > 1 and blocks[0] >= 0:
        return which % MOST_FOLDS, "logs"
    places = database.places
    known = np.unique(places, axis=0)
    side_m = _LEAST_SQUARE_M
    if len(known) > 1:
        apart_m = cKDTree(known).query(known, k=2)[0][:, 1]
        side_m = max(side_m, _SPACINGS * float(np.median(apart_m)))
    row, col = np.floor(places.T / side_m).astype(np.int64)
    # Neighbouring squares in different folds, without a pattern.
    scattered = ((row * _FORMER) ^ (col * _LATTER)) % (2**31 - 1) % MOST_FOLDS
    return scattered, f"squares of {side_m:.3g} m"


def _positions(
    by: Callable[[Received], Position], reports: Reports, index: Sequence[int] | Ints
) -> tuple[Floats, Bools]:
    """Return the positions of reports, shape (L, 4), and which of the reports have one."""
    found: list[Position] = []
    located = np.zeros(len(index), dtype=np.bool_)
    for at, one in enumerate(index):
        cell, level_dbm = reports.readings(int(one))
        if len(cell):
            serving, advance = int(reports.serving[one]), float(reports.timing_advance[one])
            censored = reports.censored[reports.first[one] : reports.first[one + 1]]
            ends = censored if censored.any() else None
            found.append(by(Received(cell, level_dbm, serving, advance, ends)))
            located[at] = True
    return np.array(found, dtype=np.float64).reshape(-1, 4), located


def _validation(method: Method, errors: Errors, blocks: str) -> Validation:
    return Validation(
        method_name(method),
        blocks,
        len(np.unique(errors.block)),
        len(errors),
        float(errors.error_m.mean()),
        float(np.median(errors.error_m)),
        float(np.quantile(errors.error_m, 0.95)),
        *coverage(errors),
    )


def figures_of(located: LocatedReports) -> dict[str, Any]:
    """Return counts, and the score where true positions are known."""
    error_m = located.error_m
    scored = np.isfinite(error_m)
    reasons = [reason for reason in located.reason if reason]
    found: dict[str, Any] = {
        "method": method_name(located.method),
        "reports": len(located),
        "located": int(np.isfinite(located.east_m).sum()),
        "not_located": {reason: reasons.count(reason) for reason in sorted(set(reasons))},
        "unknown_transmitters": int(located.unknown.sum()),
    }
    if scored.any():
        within = np.mean(error_m[scored, np.newaxis] <= located.radii_m[scored], axis=0)
        calibrated = np.isfinite(located.radii_m[scored]).all()
        found |= {
            "scored": int(scored.sum()),
            "error_mean_m": float(error_m[scored].mean()),
            "error_median_m": float(np.median(error_m[scored])),
            "error_67_m": float(np.quantile(error_m[scored], 0.67)),
            "error_95_m": float(np.quantile(error_m[scored], 0.95)),
        }
        for level, share in zip((50, 67, 95), within.tolist(), strict=True):
            found[f"within_{level}"] = share if calibrated else nan
    found["validations"] = located.validations
    return found
