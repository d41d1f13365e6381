"""The baseline of a replay: the same reports, each located by itself, without motion.

They are located while pictures are drawn, so what that needs is imported then.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from mapfilter._types import Bools, Floats
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.errors import InputError
from mapfilter.evaluation.accuracy import mean_of, percentile_m
from mapfilter.positioning.fingerprints.options import Probabilistic, method_name
from mapfilter.propagation.shadowing import named_rng
from mapfilter.tracks.log import TrackLog

if TYPE_CHECKING:
    from mapfilter.positioning.fingerprints.censoring import Bounds
    from mapfilter.positioning.fingerprints.locating import ReportLocator
    from mapfilter.positioning.fingerprints.reports import Reports

MOST_REPORTS = 300
"""Reports of a log that are located, evenly taken."""
CALIBRATED_WITH = 200
"""Reports by which regions are calibrated."""


@dataclass(frozen=True, eq=False)
class SingleReports:
    """Errors of single reports; N of them are scored.

    Parameters
    ----------
    reports, tried : int
        With readings and a true position, and how many of these were located, evenly taken.
    error_m : ndarray, shape (N,)
        Of those that have a position.
    within_95 : ndarray of bool, shape (N,)
        Whether the 95 % radius holds the true position.
    """

    reports: int
    tried: int
    error_m: Floats
    within_95: Bools

    @property
    def figures(self) -> dict[str, Any]:
        """Counts, median and 95 % of the errors, and the share within the 95 % radius."""
        share = mean_of(self.within_95)
        return {
            "method": f"single reports, {method_name(Probabilistic())}",
            "reports": self.reports,
            "tried": self.tried,
            "scored": int(self.error_m.size),
            "error_median_m": percentile_m(self.error_m, 0.5),
            "error_95_m": percentile_m(self.error_m, 0.95),
            "within_95": share,
        }


def together(parts: Sequence[SingleReports | None]) -> SingleReports | None:
    """Return the reports of several logs as one; None without any."""
    some = [part for part in parts if part is not None]
    if not some:
        return None
    return SingleReports(
        sum(part.reports for part in some),
        sum(part.tried for part in some),
        np.concatenate([part.error_m for part in some]),
        np.concatenate([part.within_95 for part in some]),
    )


class Baselines:
    """Locates the reports of logs over one database, which is prepared once, when needed.

    Parameters
    ----------
    database : RadioRouteDatabase or None
        Without cells there is no baseline.
    seed : int
        Of the reports that are drawn to calibrate regions.
    """

    def __init__(self, database: RadioRouteDatabase | None, seed: int) -> None:
        self._database, self._seed = database, seed
        self._fitted: dict[tuple[int, Bounds, float], ReportLocator] = {}

    @cached_property
    def _known(self) -> Reports | None:
        from mapfilter.positioning.fingerprints.sources import reports_of_database

        assert self._database is not None
        try:
            return reports_of_database(self._database)
        except InputError:
            return None

    def of(self, log: TrackLog) -> SingleReports | None:
        """Return the errors of a log's single reports; None without truth, reports or cells."""
        from mapfilter.positioning.fingerprints.locating import locate_by
        from mapfilter.positioning.fingerprints.sources import reports_of_logs

        database = self._database
        if database is None or not database.cell_ids or log.radio.empty or log.truth.empty:
            return None
        placed = reports_of_logs([log], database.plan)
        scored = np.isfinite(placed.east_m) & (np.diff(placed.first) > 0)
        of_truth = np.flatnonzero(scored)
        if not of_truth.size or self._known is None:
            return None
        count = min(of_truth.size, MOST_REPORTS)
        at = np.linspace(0, of_truth.size - 1, count).astype(np.int64)
        tried = placed.some(of_truth[at])
        located = locate_by(self._locator(tried), tried)
        known = np.isfinite(located.error_m)
        error_m = located.error_m[known]
        within: Bools = error_m <= located.radii_m[known, 2]
        return SingleReports(of_truth.size, count, error_m, within)

    def _locator(self, tried: Reports) -> ReportLocator:
        from mapfilter.positioning.fingerprints.censoring import bounds_of
        from mapfilter.positioning.fingerprints.locating import (
            fit_locator,
            timed_share,
            usual_readings,
        )
        from mapfilter.positioning.fingerprints.matches import located_once

        strongest, bounds = usual_readings(tried), bounds_of(tried)
        # In tenths, so that logs share locators.
        timed = round(timed_share(tried), 1)
        key = strongest, bounds, timed
        if key not in self._fitted:
            assert self._known is not None
            rng = named_rng(self._seed, "replay", "single reports")
            fitted = fit_locator(
                self._known,
                Probabilistic(),
                rng,
                strongest=strongest,
                validated=CALIBRATED_WITH,
                bounds=bounds,
                timed=timed,
            )
            # Draws of one journey receive the same.
            self._fitted[key] = replace(fitted, locator=located_once(fitted.locator))
        return self._fitted[key]
