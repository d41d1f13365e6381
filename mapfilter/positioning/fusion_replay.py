"""Replaying a log through a Kalman-type filter: GNSS, timing advances, levels, dead reckoning.

No map is needed, only the sites. With dead reckoning the state is the position, moved by each step;
without, it is position and velocity, and motion is that of constant velocity with white
acceleration.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from math import cos, isfinite, nan, sin

import numpy as np

from mapfilter.errors import InputError, fail
from mapfilter.filters.contract import MotionStep, Reason, Status
from mapfilter.filters.gaussian import Gaussian, Method
from mapfilter.filters.kalman import predict, update
from mapfilter.geodesy import same_crs
from mapfilter.models.gaussian import GaussianTerms
from mapfilter.models.motion import constant_velocity
from mapfilter.models.position_fix import position_fix
from mapfilter.models.state import MOVING, POSITION
from mapfilter.positioning.epochs import Epoch, GnssFix, epochs
from mapfilter.positioning.estimate import Fix, TrackEstimate, UnusedReading
from mapfilter.positioning.fusion import compiled
from mapfilter.positioning.fusion_models import SiteModels
from mapfilter.positioning.gaussian_radii import gaussian_radii_m
from mapfilter.positioning.track import PositionedTrack
from mapfilter.tracks.log import TrackLog
from mapfilter.tracks.schema import NEIGHBOUR, SERVING

_SURPRISE, _WINDOW = 5.0, 10


def position_by_fusion(
    sites: SiteModels, crs: str, log: TrackLog, method: Method
) -> PositionedTrack:
    """Locate a log with a Kalman-type filter.

    Nothing aborts a track: readings that cannot be used are labelled.

    Parameters
    ----------
    sites : SiteModels
    crs : str
        Of the sites.
    log : TrackLog
        In the same CRS.
    method : Method

    Raises
    ------
    InputError
        The log is in another CRS than the sites.
    """
    if not same_crs(log.crs, crs):
        raise fail(InputError, "log, crs", crs, log.crs, "log of another area or zone")
    began_s = time.process_time()
    walked = _Walk(sites, method, bool(len(log.motion)))
    timed = _timing_advances(log)
    fixes = [walked.take(epoch, timed.get(epoch.time_s, {})) for epoch in epochs(log)]
    estimate = TrackEstimate.of_fixes(
        crs, method.name, fixes, start_utc_s=log.start_utc_s, unused=walked.unused
    )
    return PositionedTrack(estimate, (), time.process_time() - began_s)


def _timing_advances(log: TrackLog) -> dict[float, dict[str, int]]:
    """Return the steps of timing advance by time and cell."""
    table = log.radio[log.radio["timing_advance"].notna() & log.radio["cell"].notna()]
    found: dict[float, dict[str, int]] = {}
    columns = (table["time_s"], table["cell"], table["timing_advance"])
    for time_s, cell, steps in zip(*(column.tolist() for column in columns), strict=True):
        found.setdefault(float(time_s), {})[str(cell)] = int(steps)
    return found


class _Walk:
    """One log on its way; the belief is replaced at each epoch."""

    def __init__(self, sites: SiteModels, method: Method, reckoned: bool) -> None:
        self.sites, self.method, self.options = sites, method, sites.options
        self.layout = POSITION if reckoned else MOVING
        self.belief: Gaussian | None = None
        self.time_s, self.heard_s, self.status = nan, nan, Status.SEARCHING
        self.surprise: list[float] = []
        self.unused: list[UnusedReading] = []

    def take(self, epoch: Epoch, timed: dict[str, int]) -> Fix:
        """Move, then measure; return the epoch's fix."""
        self._move(epoch)
        reason = self._measure(epoch, timed)
        self.time_s = epoch.time_s
        return self._fix(epoch.time_s, reason)

    def _move(self, epoch: Epoch) -> None:
        elapsed_s = max(epoch.time_s - self.time_s, 0.0) if isfinite(self.time_s) else 0.0
        if self.belief is None:
            self._label(epoch, epoch.motion, Reason.NOT_STARTED)
            return
        if self.layout is MOVING:
            if elapsed_s > 0:
                motion = constant_velocity(elapsed_s, self.options.acceleration, noise="continuous")
                self.belief = predict(self.belief, motion.transition, motion.noise)
            return
        shift, noise = np.zeros(2), self.options.drift_m**2 * elapsed_s * np.eye(2)
        for step in epoch.motion:
            moved, spread = self._step(epoch, step)
            shift, noise = shift + moved, noise + spread
        self.belief = predict(self.belief, np.eye(2), noise, shift)

    def _step(self, epoch: Epoch, step: MotionStep) -> tuple[np.ndarray, np.ndarray]:
        """Return where a step leads and how sure that is; without direction it is all spread."""
        if not isfinite(step.step_m):
            self._label(epoch, (step,), Reason.NO_STEP)
            return np.zeros(2), np.zeros((2, 2))
        if not isfinite(step.heading_rad):
            self._label(epoch, (step,), Reason.NO_HEADING)
            return np.zeros(2), step.step_m**2 * np.eye(2)
        along = np.array([cos(step.heading_rad), sin(step.heading_rad)])
        across = np.array([-along[1], along[0]])
        cross_m = step.step_m * self.options.heading_sigma_rad
        noise = self.options.step_sigma_m**2 * np.outer(along, along)
        return step.step_m * along, noise + cross_m**2 * np.outer(across, across)

    def _measure(self, epoch: Epoch, timed: dict[str, int]) -> Reason:
        heard: list[tuple[str, float]] = []
        for row in epoch.heard:
            kind = SERVING if row.role == SERVING else NEIGHBOUR
            if row.cell is None or row.cell not in self.sites.cells:
                reason = Reason.NOT_USED_BY_FILTER if row.cell is None else Reason.UNKNOWN_CELL
                self.unused.append(UnusedReading(epoch.time_s, kind, row.cell or "", reason))
            elif isfinite(row.level_dbm) and row.censored == 0:
                heard.append((row.cell, row.level_dbm))
            elif row.cell not in timed:
                self.unused.append(
                    UnusedReading(epoch.time_s, kind, row.cell, Reason.NOT_USED_BY_FILTER)
                )
        timing = {cell: steps for cell, steps in timed.items() if cell in self.sites.cells}
        if epoch.fix is None and not heard and not timing:
            return Reason.UNKNOWN_CELL if epoch.heard else Reason.NO_READING
        if self.belief is None:
            self._start(epoch.fix, [*timing, *(cell for cell, _ in heard)])
        if epoch.fix is not None:
            self._update_fix(epoch.fix)
        if heard or timing:
            first = next(iter(timing), None)
            model = self.sites.of(self.layout, tuple(cell for cell, _ in heard), first)
            reading = [level for _, level in heard]
            if first is not None:
                reading.append((timing[first] + 0.5) * self.options.timing_step_m)
            kept_s = [self.options.level_memory_s] * len(heard)
            kept_s += [self.options.timing_memory_s] * (first is not None)
            self._update(self._aged(model, kept_s, epoch.time_s), reading)
            self.heard_s = epoch.time_s
        return Reason.USED

    def _aged(self, model: GaussianTerms, kept_s: Sequence[float], time_s: float) -> GaussianTerms:
        """Return a model with noise for errors that last: reports in a row tell it only once."""
        elapsed_s = time_s - self.heard_s if isfinite(self.heard_s) else np.inf
        growth = np.sqrt(np.maximum(1.0, np.array(kept_s) / max(elapsed_s, 1e-3)))
        return replace(model, noise=model.noise * np.outer(growth, growth))

    def _start(self, fix: GnssFix | None, cells: Sequence[str]) -> None:
        if fix is not None:
            place = (fix.east_m, fix.north_m)
        else:
            cell = self.sites.cells[cells[0]]
            place = (cell.east_m, cell.north_m)
        mean, deviation = np.zeros(self.layout.size), np.zeros(self.layout.size)
        where = [self.layout.east, self.layout.north]
        mean[where], deviation[where] = place, self.options.start_sigma_m
        if self.layout is MOVING:
            deviation[list(self.layout.velocity)] = self.options.speed_sigma_mps
        if fix is None:
            # On the very site a distance has no direction to start with.
            mean[self.layout.east] += 1.0
        self.belief = Gaussian(mean, np.diag(deviation**2))

    def _update_fix(self, fix: GnssFix) -> None:
        noise = np.array(
            [
                [fix.var_east_m2, fix.cov_east_north_m2],
                [fix.cov_east_north_m2, fix.var_north_m2],
            ]
        )
        if not isfinite(fix.cov_east_north_m2):
            noise[0, 1] = noise[1, 0] = 0.0
        sure = np.isfinite(noise).all() and noise[0, 0] > 0 and np.linalg.det(noise) > 0
        if not sure:
            noise = np.eye(2) * self.options.fix_sigma_m**2
        self._update(position_fix(self.layout, noise), [fix.east_m, fix.north_m])

    def _update(self, model: GaussianTerms, reading: Sequence[float]) -> None:
        if self.belief is None:
            raise AssertionError("started before it measures")
        self.belief, news = update(self.belief, compiled(model), reading, self.method)
        if news.used:
            self.surprise = [*self.surprise, news.nis / len(reading)][-_WINDOW:]

    def _label(self, epoch: Epoch, steps: Sequence[MotionStep], reason: Reason) -> None:
        self.unused += [UnusedReading(epoch.time_s, "motion", "", reason) for _ in steps]

    def _fix(self, time_s: float, reason: Reason) -> Fix:
        if self.belief is None:
            empty = np.full((2, 2), nan)
            return Fix(
                time_s, nan, nan, empty, np.full(3, nan), self.status, 0, nan, 0, nan, reason
            )
        where = [self.layout.east, self.layout.north]
        covariance = self.belief.covariance[np.ix_(where, where)]
        radii, mass = gaussian_radii_m(covariance, 50.0)
        self._tell(float(radii[2]))
        east_m, north_m = (float(value) for value in self.belief.mean[where])
        return Fix(time_s, east_m, north_m, covariance, radii, self.status, 1, mass, 0, nan, reason)

    def _tell(self, radius_m: float) -> None:
        """Bring the status up to date: settled or not, surprised for long or not."""
        lost = len(self.surprise) == _WINDOW and float(np.mean(self.surprise)) > _SURPRISE
        if self.status is Status.SEARCHING:
            if radius_m <= self.options.settled_m:
                self.status = Status.CONVERGED
        else:
            self.status = Status.LOST if lost else Status.TRACKING
