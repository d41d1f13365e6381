"""Real phones in Ottawa: each session is found on the map that the other sessions made.

A phone reports its serving cell, RSRP and timing advance; speed and bearing by GNSS, with noise and
bias added, are its dead reckoning. Positions by GNSS are the truth where they are good enough.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.spatial import cKDTree

from mapfilter._types import Bools, Floats
from mapfilter.errors import InputError, fail
from mapfilter.evaluation.accuracy import SUCCESS_RADIUS_M
from mapfilter.evaluation.truth import Truth
from mapfilter.experiments.benchmarks.ottawa_sessions import (
    ReckoningErrors,
    Session,
    centroids,
    session_log,
)
from mapfilter.experiments.recorded.oracles import MOTION, START, with_start, with_true_motion
from mapfilter.filters.contract import Status
from mapfilter.positioning.bayes.filter import BayesPositioner
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.positioning.loop import locate
from mapfilter.propagation.shadowing import named_rng
from mapfilter.tracks.log import TrackLog

PARTS = ("lacolyoc", "uottawa", "carling")
FOLDER = "cell-ottawa-lte"
LEFT_OUT = ("OpenCellID_20200830",)
"""Beginnings of files that are no session of their part: another drive, of 27 km."""
GOOD_M = 20.0
"""Fixes of this reported accuracy, or better, are scored."""
MAP_M = 50.0
"""Fixes of this accuracy make maps."""
METHODS = ("bayes", "smoothed")
ORACLES = (START, MOTION)
"""The filter of ``bayes`` with the true first 30 m as fixes, or with the true way between good
fixes as motion; the first draw of the noise only."""
_ON_MAP_M = 50.0
_LEAST_FIXES = 2
"""Positions of a true way."""


@dataclass(frozen=True)
class OttawaOptions:
    """The filter, and the errors that dead reckoning gets; the filter's are its defaults."""

    filter: BayesFilter = field(default_factory=BayesFilter)
    errors: ReckoningErrors = field(default_factory=ReckoningErrors)


@dataclass(frozen=True, eq=False)
class FoundSession:
    """One session found once by one method; N fixes are scored.

    Parameters
    ----------
    on_map : float
        Share of all good fixes that lie within 50 m of the map.
    converged, success : bool
        At most 50 m off at the first good fix from CONVERGED on.
    switch_m : float
        Metres by dead reckoning until CONVERGED.
    lost : int
        Epochs that were LOST.
    error_m : ndarray, shape (N,)
        Of the good fixes from CONVERGED on; of all good fixes for ``smoothed``.
    covered : ndarray of bool, shape (N,)
        Whether the 95 % radius held the fix.
    """

    part: str
    session: str
    method: str
    on_map: float
    converged: bool
    success: bool
    switch_m: float
    error_at_switch_m: float
    lost: int
    error_m: Floats
    covered: Bools


def find_session(
    part: str,
    session: Session,
    positioner: BayesPositioner,
    options: OttawaOptions,
    seed: int,
    draw: int,
    step_factor: float = 1.0,
) -> list[FoundSession]:
    """Find a session from an unknown start, with one draw of the noise, by all methods.

    Oracles need two good fixes; a session with fewer has none.
    """
    found = []
    oracles = ORACLES if draw == 0 and has_truth(session) else ()
    for method in (*METHODS, *oracles):
        log, estimate = locate_session(
            session, positioner, options, seed, draw, step_factor, method=method
        )
        found.append(_scored(part, session, method, log, estimate, positioner))
    return found


def locate_session(
    session: Session,
    positioner: BayesPositioner,
    options: OttawaOptions,
    seed: int,
    draw: int,
    step_factor: float = 1.0,
    *,
    method: str = METHODS[0],
) -> tuple[TrackLog, TrackEstimate]:
    """Return the log of a session with one draw of the noise, and its estimate by a method.

    Raises
    ------
    InputError
        The method is an oracle, and the session has fewer than two good fixes.
    """
    rng = named_rng(seed, "noise", session.name, str(draw))
    crs = positioner.area.lattice.crs
    log = session_log(session, crs, options.errors, rng, step_factor=step_factor)
    given = _for_oracle(method, log, session)
    # The same stream of numbers: the filter below the smoother is the filter itself.
    own = named_rng(seed, "filter", session.name, str(draw))
    return log, locate(given, replace(positioner, smooth=method == METHODS[1]), own).estimate


def _for_oracle(method: str, log: TrackLog, session: Session) -> TrackLog:
    """Return the log that a method is given: an oracle's holds parts of the truth."""
    if method not in ORACLES:
        return log
    truth = Truth.of_table(log.truth[session.accuracy_m <= GOOD_M])
    if truth is None:
        expected = f"two fixes of {GOOD_M:g} m or better for {method}"
        raise fail(InputError, session.name, expected, int(np.sum(session.accuracy_m <= GOOD_M)))
    return with_start(log, truth) if method == START else with_true_motion(log, truth)


def has_truth(session: Session) -> bool:
    """Return whether a session has the two good fixes that an oracle needs."""
    return int(np.sum(session.accuracy_m <= GOOD_M)) >= _LEAST_FIXES


def centroid_errors_m(session: Session, others: Sequence[Session], crs: str) -> Floats:
    """Return how far good fixes are from the mean place of their serving cell in other sessions."""
    middle, places = centroids(others, crs, np.inf), session.places(crs)
    return np.array(
        [
            np.hypot(*(places[i] - middle[cell]))
            for i, cell in enumerate(session.cell)
            if session.accuracy_m[i] <= GOOD_M and cell in middle
        ]
    )


def _scored(
    part: str,
    session: Session,
    method: str,
    log: TrackLog,
    estimate: TrackEstimate,
    positioner: BayesPositioner,
) -> FoundSession:
    truth = log.truth[["east_m", "north_m"]].to_numpy()
    at = np.searchsorted(estimate.time_s, log.truth["time_s"].to_numpy())
    error_m = np.hypot(estimate.east_m[at] - truth[:, 0], estimate.north_m[at] - truth[:, 1])
    good = (session.accuracy_m <= GOOD_M) & np.isfinite(error_m)
    switch = estimate.converged_at
    after = good & (at >= switch) if switch is not None else np.zeros_like(good)
    first_m = float(error_m[after][0]) if after.any() else float("nan")
    scored = good if method == "smoothed" else after
    gone_m = float("nan")
    if switch is not None:
        before = log.motion["time_s"] <= estimate.time_s[switch]
        gone_m = float(log.motion["step_m"][before].abs().sum())
    return FoundSession(
        part,
        session.name,
        method,
        _on_map(positioner, truth[session.accuracy_m <= GOOD_M]),
        switch is not None,
        first_m <= SUCCESS_RADIUS_M,
        gone_m,
        first_m,
        sum(status is Status.LOST for status in estimate.status),
        error_m[scored],
        (error_m <= estimate.radii_m[at, 2])[scored],
    )


def _on_map(positioner: BayesPositioner, places: Floats) -> float:
    """Return the share of places within 50 m of the map."""
    area = positioner.model.whole
    away_m, _ = cKDTree(area.points.T + np.array(area.origin_m)).query(places)
    return float(np.mean(away_m <= _ON_MAP_M)) if len(places) else float("nan")
