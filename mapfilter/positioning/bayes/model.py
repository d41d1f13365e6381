"""The map filter's model, which the filters of a single belief call.

:class:`BayesModel` draws the first hypotheses, moves them by dead reckoning, and weighs them by the
map of ways, by radio reports and by the terms of other sources. :class:`MeasuredMapModel` compares
serving cells and timing advances with their statistics at each place, and levels with a map whose
standard deviation varies.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from math import isfinite, pi, sqrt

import numpy as np

from mapfilter._types import Floats, Floats32, Ints32
from mapfilter.filters.contract import MotionStep, Reason
from mapfilter.filters.hypotheses import BeliefSummary, Bins
from mapfilter.filters.resampling import systematic
from mapfilter.models import fingerprint
from mapfilter.models.fingerprint import LevelReading
from mapfilter.models.measured_map import ServingStatistics
from mapfilter.models.street_motion import (
    BIAS,
    EAST,
    LOG_SCALE,
    NORTH,
    OFF,
    STATES,
    MapWeights,
    MotionErrors,
    interpolate,
    move,
    weigh_by_map,
)
from mapfilter.positioning.bayes.area_map import AreaMap
from mapfilter.positioning.bayes.evidence import RadioReading
from mapfilter.positioning.bayes.radio import EvidenceOptions

_F = np.float32
OFF_AT_START = 0.05
_OFF_SHARE, _TRIES = 0.2, 2


@dataclass(frozen=True, slots=True)
class Start:
    """Prior of a belief.

    Parameters
    ----------
    reading : RadioReading or None
        First evidence.
    compass : bool
        Headings are those of a compass; else their lasting error is uniform.
    east_m, north_m, sd_m : float
        Known start in the CRS of the database; NaN for an unknown one.
    """

    reading: RadioReading | None
    compass: bool = True
    east_m: float = float("nan")
    north_m: float = float("nan")
    sd_m: float = float("nan")


@dataclass(frozen=True)
class BayesModel:
    """Ways and radio maps of an area, and the errors of measurements."""

    area: AreaMap
    motion: MotionErrors = field(default_factory=MotionErrors)
    weights: MapWeights = field(default_factory=MapWeights)
    evidence: EvidenceOptions = field(default_factory=EvidenceOptions)

    @property
    def timed_by_sites(self) -> bool:
        """Whether timing advances are compared with the distances of sites."""
        return True

    @cached_property
    def bins(self) -> Bins:
        """Bins of 25 m over the area."""
        return Bins.over((0.0, 0.0, *self.area.size_m))

    @cached_property
    def log_map(self) -> Floats32:
        """Log-likelihood of the map at every pixel."""
        return self.area.log_map(self.weights.sd_m)

    @cached_property
    def _serving_table(self) -> Floats32:
        return fingerprint.serving_table(self.evidence.serving)

    @cached_property
    def _bound_table(self) -> Floats32:
        return fingerprint.bound_table()

    def start(self, prior: Start, most: int, rng: np.random.Generator) -> tuple[Floats32, Floats]:
        """Draw the first hypotheses: by the first evidence, or about a known start.

        Without a known start they are drawn in proportion to their likelihood from the points on
        ways and from places anywhere; those on ways are spread over their pixel.
        """
        state = np.zeros((STATES, most), dtype=np.float32)
        log_weight = np.full(most, -np.log(most))
        if isfinite(prior.east_m):
            west, south = self.area.origin_m
            place = np.array([[prior.east_m - west], [prior.north_m - south]])
            state[EAST : NORTH + 1] = place + prior.sd_m * rng.standard_normal((2, most))
            state[OFF] = OFF_AT_START
        else:
            self._spread(state, log_weight, prior.reading, rng)
        bias = rng.standard_normal(most) * self.motion.bias_sd_rad
        state[BIAS] = bias if prior.compass else pi * (2 * rng.random(most) - 1)
        state[LOG_SCALE] = self.motion.scale_sd * rng.standard_normal(most)
        if isfinite(prior.east_m) and prior.reading is not None:
            self.weigh(state, log_weight, prior.reading)
        return state, log_weight

    def _spread(
        self,
        state: Floats32,
        log_weight: Floats,
        reading: RadioReading | None,
        rng: np.random.Generator,
    ) -> None:
        """Fill places on the map and off it; off it more of them, with smaller weights."""
        resolution_m, size_m = self.area.lattice.resolution_m, np.array(self.area.size_m)
        count = state.shape[1]
        middle = count - int(_OFF_SHARE * count)
        anywhere = (size_m * rng.random((_TRIES * (count - middle), 2))).T.astype(np.float32)
        for part, points, spread_m, off in (
            (slice(0, middle), self.area.points, resolution_m, 0.0),
            (slice(middle, count), anywhere, 0.0, 1.0),
        ):
            if not points.shape[1] or part.start == part.stop:
                log_weight[part] = -np.inf
                continue
            chosen, log_mean = self._likely(points, reading, part.stop - part.start, rng)
            beside = rng.random((2, chosen.size), dtype=np.float32) - _F(0.5)
            state[EAST : NORTH + 1, part] = points[:, chosen] + _F(spread_m) * beside
            state[OFF, part] = off
            share = OFF_AT_START if off else 1 - OFF_AT_START
            log_weight[part] = log_mean + np.log(share / chosen.size)

    def _likely(
        self, points: Floats32, reading: RadioReading | None, count: int, rng: np.random.Generator
    ) -> tuple[Ints32, float]:
        """Draw points by their likelihood; return them and the logarithm of its mean."""
        state = np.zeros((STATES, points.shape[1]), dtype=np.float32)
        state[EAST : NORTH + 1] = points
        log_weight = np.zeros(points.shape[1])
        if reading is not None:
            self.weigh(state, log_weight, reading)
        most = log_weight.max()
        weight = np.exp(log_weight - most)
        chosen = np.empty(count, dtype=np.int32)
        systematic((weight / weight.sum()).astype(np.float32), rng.random(), chosen)
        return chosen, float(most + np.log(weight.mean()))

    def any_heading(self, state: Floats32, times: int, rng: np.random.Generator) -> Floats32:
        """Return ``times`` copies with uniform heading errors, spread over their pixels."""
        turned = np.tile(state, times)
        resolution_m = _F(self.area.lattice.resolution_m)
        spread = rng.random((2, turned.shape[1]), dtype=np.float32) - _F(0.5)
        turned[: NORTH + 1] += resolution_m * spread
        turned[BIAS] = pi * (2 * rng.random(turned.shape[1]) - 1)
        return turned

    def move(
        self, state: Floats32, log_weight: Floats, motion: MotionStep, key: np.uint64
    ) -> tuple[Floats32, Floats]:
        """Move by one step and weigh by the map, by the metre."""
        length_m = abs(motion.step_m)
        if isfinite(motion.heading_rad):
            moved = move(state, motion.step_m, motion.heading_rad, self.motion, key)
        else:
            # To all sides; the mean square of the distance is that of the step.
            moved = move(state, 0.0, 0.0, self.motion, key)
            noise = np.random.default_rng(int(key)).standard_normal((2, state.shape[1]))
            moved[: NORTH + 1] += (length_m / sqrt(2.0) * noise).astype(np.float32)
        weighed = log_weight.copy()
        rows, step = self.area.lattice.rows, self.area.lattice.resolution_m
        found = interpolate(moved, self.log_map, step / 2, (rows - 0.5) * step, 1 / step)
        weigh_by_map(found, moved[OFF], self.weights.over(length_m), weighed)
        return moved, weighed

    def weigh(self, state: Floats32, log_weight: Floats, reading: RadioReading) -> Reason:
        """Add the log-likelihood of a report, then of each further term, in place."""
        flat = self.area.flat_level_dbm
        bands = len(self.area.cell_ids) + 2
        used = False
        if reading.serving >= 0 or reading.levels is not None or reading.bounds:
            now = self._pixels(state, 0.0, 0.0)
            used = True
            if reading.serving >= 0 and reading.serving_weight > 0:
                table, weight = self._serving_table, reading.serving_weight
                fingerprint.weigh_by_serving(
                    now, flat, bands, reading.serving, table, weight, log_weight
                )
            if reading.levels is not None:
                levels = reading.levels
                then = self._pixels(state, levels.back_east_m, levels.back_north_m)
                fingerprint.weigh_by_levels(now, then, flat, bands, levels, log_weight)
            for bound in reading.bounds:
                fingerprint.weigh_by_bound(now, flat, bands, bound, self._bound_table, log_weight)
        for term in reading.terms:
            log_weight += term.log_likelihood(state)
            used = True
        return Reason.USED if used else Reason.NO_READING

    def can_converge(self, summary: BeliefSummary) -> bool:
        """Return whether the leading hypothesis is on the map rather than off it."""
        return bool(summary.mean[OFF] < 0.5)

    def _pixels(self, state: Floats32, back_east_m: float, back_north_m: float) -> Ints32:
        """Return the pixel of each hypothesis, moved back by a displacement of dead reckoning."""
        return np.asarray(fingerprint.pixels(state, back_east_m, back_north_m, self.area.frame))


_MIN_VARIANCE = 0.25
"""Least variance of an innovation, as a share of the usual one."""


@dataclass(frozen=True)
class MeasuredMapModel(BayesModel):
    """Ways and measured radio maps of an area.

    Parameters
    ----------
    serving_model : ServingStatistics
        On the area's lattice.
    level_sd_db : ndarray of float32, shape (C, P), optional
        Standard deviation of a new reading from the map of levels, on the area's lattice; without
        it that of the evidence options everywhere.
    """

    serving_model: ServingStatistics | None = None
    level_sd_db: Floats32 | None = None

    @property
    def timed_by_sites(self) -> bool:
        """Whether timing advances are compared with the distances of sites: not with maps."""
        return self.serving_model is None

    def weigh(self, state: Floats32, log_weight: Floats, reading: RadioReading) -> Reason:
        """Add the log-likelihood of a report and of further terms, in place."""
        serving_model = self.serving_model
        if serving_model is None or reading.serving < 0:
            return super().weigh(state, log_weight, reading)
        pixel = self._pixels(state, 0.0, 0.0)
        found = serving_model.log_serving(reading.serving, pixel)
        if isfinite(reading.timing_advance):
            found = found + serving_model.log_advance(
                reading.serving, pixel, reading.timing_advance
            )
        log_weight += reading.serving_weight * found
        levels = reading.levels
        if levels is not None and self.level_sd_db is not None:
            log_weight += self._log_levels(state, pixel, levels, self.level_sd_db)
            reading = replace(reading, levels=None)
        super().weigh(state, log_weight, replace(reading, serving_weight=0.0))
        return Reason.USED

    def _log_levels(
        self, state: Floats32, now: Ints32, levels: LevelReading, sd_db: Floats32
    ) -> Floats32:
        """Return the log-likelihood of levels with a standard deviation for each pixel.

        As :func:`mapfilter.models.fingerprint.weigh_by_levels`, but with independent errors of
        different cells.
        """
        table = self.area.level_dbm
        table = table.reshape(-1, table.shape[-1])
        then = self._pixels(state, levels.back_east_m, levels.back_north_m)
        usual = self.evidence.levels
        found = np.zeros(now.size, dtype=np.float32)
        for cell, offset_db, rho, scale in zip(
            levels.cell, levels.offset_db, levels.rho, levels.scale, strict=True
        ):
            innovation_db = offset_db - table[now, cell] + rho * table[then, cell]
            more_db2 = sd_db[cell][now] ** 2 - usual.measurement_db**2 - usual.sd_db**2
            wider = 1 + np.maximum(more_db2 * (1 - rho**2) * scale**2, _MIN_VARIANCE - 1)
            square = np.minimum((innovation_db * scale) ** 2 / wider, levels.clip**2)
            found -= np.float32(0.5 * levels.weight) * (square + np.log(wider))
        return found
