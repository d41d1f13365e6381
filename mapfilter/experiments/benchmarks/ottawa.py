"""Real phones in Ottawa: each session is found on the map that the other sessions made.

A phone reports its serving cell, RSRP and timing advance; speed and bearing by GNSS, with noise and
bias added, are its dead reckoning. Positions by GNSS are the truth where they are good enough.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from math import hypot

import numpy as np
from scipy.spatial import cKDTree

from mapfilter._types import Bools, Floats, Floats32
from mapfilter.database.radioroutes import RadioRouteDatabase
from mapfilter.errors import InputError, fail
from mapfilter.evaluation.accuracy import SUCCESS_RADIUS_M
from mapfilter.experiments.benchmarks.ottawa_sessions import (
    ReckoningErrors,
    Session,
    centroids,
    session_log,
    site_of,
)
from mapfilter.filters.contract import Status
from mapfilter.models.fingerprint import ServingWeights
from mapfilter.models.measured_map import MeasuredMapOptions, MeasuredRows, ServingStatistics
from mapfilter.positioning.bayes.area_map import AreaMap
from mapfilter.positioning.bayes.filter import BayesPositioner
from mapfilter.positioning.bayes.measured_model import MeasuredMapModel
from mapfilter.positioning.bayes.options import BayesFilter, open_area
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.positioning.filter import locate
from mapfilter.propagation.shadowing import named_rng
from mapfilter.rasters.raster_set import RxLevRasters
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
_ON_MAP_M = 50.0


@dataclass(frozen=True)
class OttawaOptions:
    """How the filter is set; chosen on the part ``carling`` alone.

    GNSS smooths its speed, so that steps are too short, at every corner by another share: the scale
    is wide and drifts. Serving cells and levels of another day err together over long stretches, so
    that both count little by the metre.

    Parameters
    ----------
    filter : BayesFilter
        The next four are further errors that only this filter sets.
    typical_step_m : float
        Length of the step that ``filter.step_sd_m`` is of.
    scale_drift_per_sqrt_m : float
        Random walk of the logarithm of the step scale.
    white_share : float
        Share of a heading's variance that is white.
    serving_weight_per_m : float
        Weight of a serving cell for each metre travelled.
    measurement_db : float
        Deviation of a level besides the error of the map.
    unmeasured_db : float
        Deviation of a level where its cell was not measured, and only its trend is known.
    """

    filter: BayesFilter = field(
        default_factory=lambda: BayesFilter(
            step_sd_m=1.0,
            heading_sd_deg=10.0,
            bias_sd_deg=6.0,
            drift_deg_per_sqrt_m=0.2,
            scale=0.15,
            map_sd_m=16.0,
            level_error_db=5.0,
            level_correlation_m=100.0,
            device_error_db=2.0,
            level_weight=0.5,
            switch_mass=0.998,
            switch_hold_m=30.0,
            max_particles=10_000,
            min_search_particles=7_000,
        )
    )
    typical_step_m: float = 14.0
    scale_drift_per_sqrt_m: float = 0.005
    white_share: float = 0.7
    serving_weight_per_m: float = 1 / 150
    measurement_db: float = 3.0
    unmeasured_db: float = 8.0
    serving_map: MeasuredMapOptions = field(default_factory=MeasuredMapOptions)
    errors: ReckoningErrors = field(default_factory=ReckoningErrors)

    def positioner(self, area: AreaMap) -> BayesPositioner:
        """Return the filter over an area, whose maps are not yet those of the sessions."""
        bound = self.filter.over_area(area)
        motion = replace(
            bound.model.motion,
            typical_step_m=self.typical_step_m,
            scale_drift_per_sqrt_m=self.scale_drift_per_sqrt_m,
            # Bearings by satellites know neither magnets nor gyroscopes.
            white_share=self.white_share,
            disturbances_per_m=0.0,
            rate_share=0.0,
            stretch_sd=0.0,
        )
        evidence = bound.model.evidence
        evidence = replace(
            evidence,
            serving=ServingWeights(weight_per_m=self.serving_weight_per_m),
            levels=replace(evidence.levels, white_db=self.measurement_db),
        )
        return replace(bound, model=replace(bound.model, motion=motion, evidence=evidence))


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


def surveyed_positioner(
    database: RadioRouteDatabase,
    others: Sequence[Session],
    options: OttawaOptions,
    deviation: RxLevRasters | None = None,
) -> BayesPositioner:
    """Return the filter over the database that other sessions made.

    ``deviation``, of the survey, is by how much a new reading differs from the map of levels; it
    has no value where a cell was not measured.
    """
    area, level_sd_db = open_area(database), None
    bound = options.positioner(area)
    evidence = bound.model.evidence
    if deviation is not None:
        level_sd_db = _level_sd_db(deviation, area, options.unmeasured_db)
        levels = evidence.levels
        usual_db = float(np.nanmedian(deviation.read()))
        lasting_db = max(usual_db**2 - levels.white_db**2, 1.0) ** 0.5
        before_db = hypot(levels.slow_db, levels.fast_db)
        slow_db, fast_db = (lasting_db * db / before_db for db in (levels.slow_db, levels.fast_db))
        levels = replace(levels, slow_db=slow_db, fast_db=fast_db)
        evidence = replace(evidence, levels=levels)
    crs = database.lattice.crs
    places = np.concatenate([other.places(crs) for other in others])
    good = np.concatenate([other.accuracy_m for other in others]) <= MAP_M
    cell = np.array([area.band_of.get(name, -1) for other in others for name in other.cell])
    steps = np.concatenate([other.timing_advance for other in others])
    rows = MeasuredRows(cell[good], places[good, 0], places[good, 1], steps[good])
    sites = np.unique([site_of(name) for name in area.cell_ids], return_inverse=True)[1]
    serving_model = ServingStatistics.of_rows(rows, area.lattice, sites, options.serving_map)
    model = MeasuredMapModel(
        area,
        bound.model.motion,
        bound.model.weights,
        evidence,
        serving_model=serving_model,
        level_sd_db=level_sd_db,
    )
    return replace(bound, model=model)


def _level_sd_db(deviation: RxLevRasters, area: AreaMap, unmeasured_db: float) -> Floats32:
    """Return the deviation at each pixel of the area, shape (C, P)."""
    found = deviation.read(cells=area.cell_ids)
    lattice = area.lattice
    if deviation.lattice != lattice:
        expected = "the lattice of the database"
        raise fail(InputError, str(deviation.path), expected, "another", "of another survey")
    flat = found.reshape(len(area.cell_ids), -1)
    return np.where(np.isfinite(flat), flat, np.float32(unmeasured_db)).astype(np.float32)


def find_session(
    part: str,
    session: Session,
    positioner: BayesPositioner,
    options: OttawaOptions,
    seed: int,
    draw: int,
    step_factor: float = 1.0,
) -> list[FoundSession]:
    """Find a session from an unknown start, with one draw of the noise, by both methods."""
    crs = positioner.area.lattice.crs
    rng = named_rng(seed, "noise", session.name, str(draw))
    log = session_log(session, crs, options.errors, rng, step_factor=step_factor)
    found = []
    for method in METHODS:
        # The same stream of numbers: the filter below the smoother is the filter itself.
        own = named_rng(seed, "filter", session.name, str(draw))
        located = locate(log, replace(positioner, smooth=method == "smoothed"), own)
        found.append(_scored(part, session, method, log, located.estimate, positioner))
    return found


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
    area = positioner.area
    away_m, _ = cKDTree(area.points.T + np.array(area.origin_m)).query(places)
    return float(np.mean(away_m <= _ON_MAP_M)) if len(places) else float("nan")
