"""The map filter's model, which the filters of a single belief call.

:class:`BayesModel` draws the first hypotheses, moves them by dead reckoning, and weighs them by the
map of ways, by radio reports and by the terms of other sources.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from math import exp, isfinite, log, nan, pi, sqrt

import numpy as np

from mapfilter._types import Bools, Bytes, Floats, Floats32, Ints32
from mapfilter.filters.contract import MotionStep, Reason
from mapfilter.filters.hypotheses import BeliefSummary, Bins
from mapfilter.filters.particle import Cloud
from mapfilter.filters.resampling import log_sum, systematic
from mapfilter.geodesy import wrap_rad
from mapfilter.models import fingerprint
from mapfilter.models.level_errors import LevelReport
from mapfilter.models.level_kernels import (
    Prediction,
    decayed,
    gained,
    rough_squares,
    shares_above,
    weigh_by_absence,
    weigh_by_levels,
)
from mapfilter.models.level_memory import LevelMemory
from mapfilter.models.street_motion import (
    BIAS,
    EAST,
    LOG_SCALE,
    NORTH,
    OFF,
    RATE,
    STATES,
    STRETCH,
    TURN,
    MapWeights,
    MotionErrors,
    move,
)
from mapfilter.models.way_map import WayMap, weighed_by_ways
from mapfilter.positioning.bayes.area_map import AreaMap
from mapfilter.positioning.bayes.evidence import RadioReading
from mapfilter.positioning.bayes.path import RecentPath
from mapfilter.positioning.bayes.path_start import (
    OFF_AT_START,
    ends_of_path,
    possible_turns_rad,
)
from mapfilter.positioning.bayes.radio import EvidenceOptions

_F = np.float32
_OFF_SHARE, _TRIES = 0.2, 2
_BEYOND_M, _BEYOND_SHARE, _BEYOND_AT_START = 300.0, 0.15, 0.02
_BEYOND_COST_PER_M = 0.015
"""Width of the belt around the area, its share of the first hypotheses and of the first belief, and
the negative log-likelihood of each metre there, in a database with cells."""
_AT_ONCE = 50_000
_NEW_M = 50.0
_LEAST_EXPECTED = 0.02
_SAMPLE = 256


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
    path : RecentPath or None
        Way to the start, where the map alone is the first evidence.
    """

    reading: RadioReading | None
    compass: bool = True
    east_m: float = float("nan")
    north_m: float = float("nan")
    sd_m: float = float("nan")
    path: RecentPath | None = None


@dataclass(frozen=True)
class BayesModel:
    """Ways and radio maps of an area, and the errors of measurements.

    ``remember`` is whether hypotheses keep the errors of levels from one report to the next; else
    each report counts by the share of its errors that is new.
    """

    area: AreaMap
    motion: MotionErrors = field(default_factory=MotionErrors)
    weights: MapWeights = field(default_factory=MapWeights)
    evidence: EvidenceOptions = field(default_factory=EvidenceOptions)
    remember: bool = True

    @property
    def timed_by_sites(self) -> bool:
        """Whether timing advances are compared with the distances of sites."""
        return True

    @cached_property
    def bins(self) -> Bins:
        """Bins of 25 m over the area and what surrounds it."""
        (width_m, height_m), more_m = self.area.size_m, _BEYOND_M
        return Bins.over((-more_m, -more_m, width_m + more_m, height_m + more_m))

    @cached_property
    def log_map(self) -> Floats32:
        """Log-likelihood of the map at every pixel."""
        return self.area.log_map(self.weights.sd_m)

    @cached_property
    def _ways(self) -> WayMap:
        return WayMap(self.log_map, self.area.lattice.resolution_m, *self.area.size_m)

    @cached_property
    def _serving_table(self) -> Floats32:
        return fingerprint.serving_table(self.evidence.serving)

    @cached_property
    def _bound_table(self) -> Floats32:
        return fingerprint.bound_table()

    def start(self, prior: Start, most: int, rng: np.random.Generator) -> tuple[Cloud, Floats]:
        """Draw the first hypotheses: by the first evidence, or about a known start.

        Without a known start they are drawn in proportion to their likelihood from the points on
        ways and from places anywhere; those on ways are spread over their pixel. Others lie around
        the area, as one may come into it.
        """
        state = np.zeros((STATES, most), dtype=np.float32)
        log_weight = np.full(most, -np.log(most))
        if isfinite(prior.east_m):
            west, south = self.area.origin_m
            place = np.array([[prior.east_m - west], [prior.north_m - south]])
            state[EAST : NORTH + 1] = place + prior.sd_m * rng.standard_normal((2, most))
            state[OFF] = OFF_AT_START
        elif prior.path is None:
            self._spread(state, log_weight, prior.reading, rng)
        bias = rng.standard_normal(most) * self.motion.bias_sd_rad
        state[BIAS] = bias if prior.compass else pi * (2 * rng.random(most) - 1)
        state[LOG_SCALE] = self.motion.scale_sd * rng.standard_normal(most)
        state[TURN] = self.motion.turn_sd_rad * rng.standard_normal(most)
        state[STRETCH] = self.motion.stretch_sd * rng.standard_normal(most)
        if prior.path is not None:
            turns = possible_turns_rad(self.motion.bias_sd_rad, compass=prior.compass)
            ends = ends_of_path(self.area, self.weights, prior.path, turns, most, rng)
            state[EAST : NORTH + 1], state[OFF], log_weight = (
                ends.place_m,
                ends.off,
                ends.log_weight,
            )
            state[BIAS] = wrap_rad(ends.turned_rad - state[TURN])
        biased = rng.random(most) < self.motion.rate_share
        state[RATE] = self.motion.rate_rad_per_m * rng.standard_normal(most) * biased
        cloud = _new(state)
        if prior.reading is not None:
            # Hypotheses that were drawn by this evidence keep what it says of the levels' errors.
            drawn_by = not isfinite(prior.east_m)
            weighed = log_weight.copy() if drawn_by else log_weight
            cloud, _ = self.weigh(cloud, weighed, prior.reading)
        return cloud, log_weight

    def _spread(
        self,
        state: Floats32,
        log_weight: Floats,
        reading: RadioReading | None,
        rng: np.random.Generator,
    ) -> None:
        """Fill places on the map and off it; off it more of them, with smaller weights."""
        size_m, spread_m = np.array(self.area.size_m), self.area.lattice.resolution_m
        beyond = int(_BEYOND_SHARE * state.shape[1])
        off = int(_OFF_SHARE * state.shape[1])
        on = state.shape[1] - off - beyond
        anywhere = (size_m * rng.random((_TRIES * off, 2))).T.astype(np.float32)
        inside = 1 - _BEYOND_AT_START
        first = 0
        for count, points, pixel_m, is_off, share in (
            (on, self.area.points, spread_m, 0.0, inside * (1 - OFF_AT_START)),
            (off, anywhere, 0.0, 1.0, inside * OFF_AT_START),
            (beyond, self._around(beyond, rng), 0.0, OFF_AT_START, _BEYOND_AT_START),
        ):
            part = slice(first, first + count)
            first += count
            if not points.shape[1] or not count:
                log_weight[part] = -np.inf
                continue
            chosen, log_mean = self._likely(points, reading, count, rng)
            beside = rng.random((2, count), dtype=np.float32) - _F(0.5)
            state[EAST : NORTH + 1, part] = points[:, chosen] + _F(pixel_m) * beside
            state[OFF, part] = is_off
            log_weight[part] = log_mean + np.log(share / count)

    def _around(self, count: int, rng: np.random.Generator) -> Floats32:
        """Draw places around the area, shape (2, count)."""
        size_m = np.array(self.area.size_m)[:, None]
        found = np.empty((2, 0), dtype=np.float32)
        while found.shape[1] < count:
            some = (size_m + 2 * _BEYOND_M) * rng.random((2, 4 * count)) - _BEYOND_M
            places = some.astype(np.float32)
            found = np.concatenate([found, places[:, np.flatnonzero(self.area.beyond(places))]], 1)
        return found[:, :count]

    def _likely(
        self, points: Floats32, reading: RadioReading | None, count: int, rng: np.random.Generator
    ) -> tuple[Ints32, float]:
        """Draw points by their likelihood; return them and the logarithm of its mean."""
        log_weight = np.zeros(points.shape[1])
        if reading is not None:
            for first in range(0, points.shape[1], _AT_ONCE):
                part = slice(first, first + _AT_ONCE)
                state = np.zeros((STATES, points[:, part].shape[1]), dtype=np.float32)
                state[EAST : NORTH + 1] = points[:, part]
                self.weigh(_new(state), log_weight[part], reading)
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
            # To all sides.
            moved = move(state, 0.0, 0.0, self.motion, key)
            noise = np.random.default_rng(int(key)).standard_normal((2, state.shape[1]))
            moved[: NORTH + 1] += (motion.all_sides_m / sqrt(2.0) * noise).astype(np.float32)
        # Beyond the area nobody knows the ways; if these are all there is, it is off the map.
        cost = _BEYOND_COST_PER_M if self.area.cell_ids else self.weights.off_cost_per_m
        per_m = self.weights.weight_per_m
        beyond = -cost / per_m if per_m > 0 else nan
        factors = self.weights.over(length_m)
        weighed: Floats = weighed_by_ways(moved, self._ways, factors, beyond, log_weight)
        return moved, weighed

    def weigh(
        self, cloud: Cloud, log_weight: Floats, reading: RadioReading
    ) -> tuple[Cloud, Reason]:
        """Add the log-likelihood of a report, then of each further term, in place.

        Of a belief that is tracked a part of that of levels is left out, and returned as log
        evidence that is withheld from the weights.
        """
        kept_back: Floats | None = None
        counted: Floats | None = None
        # A serving cell that the map lacks weighs all hypotheses in the area alike.
        used = reading.serving_weight > 0
        if used or reading.serving >= 0 or reading.levels is not None or reading.bounds:
            pixel, beyond = self._pixels(cloud.state), self.area.beyond(cloud.state)
            some_beyond = bool(beyond.any())
            used = True
            cloud, before = self._aged(cloud, reading), log_weight.copy()
            other = 0.0
            if reading.serving >= 0 and reading.serving_weight > 0:
                self._weigh_serving(cloud, pixel, log_weight, reading)
            if reading.levels is not None:
                start = log_weight.copy()
                cloud = self._weigh_levels(cloud, pixel, log_weight, reading)
                other = cloud.shared.other_log_likelihood
                if reading.tracked and self.remember:
                    withheld_share = 1 - self.evidence.levels.tracking_share
                    kept_back = gained(start, log_weight, withheld_share)
            flat, bands, table = self.area.flat_level_dbm, self._bands, self._bound_table
            for bound in reading.bounds:
                fingerprint.weigh_by_bound(pixel, flat, bands, bound, table, log_weight)
            if kept_back is not None:
                counted = log_weight - kept_back
                share = self.evidence.levels.tracking_share
                if some_beyond:
                    _weigh_beyond(beyond, before, counted, reading, share * other)
            if some_beyond:
                _weigh_beyond(beyond, before, log_weight, reading, other)
        for term in reading.terms:
            log_likelihood = term.log_likelihood(cloud.state)
            log_weight += log_likelihood
            if counted is not None:
                counted += log_likelihood
            used = True
        if counted is not None:
            cloud = cloud._replace(withheld=log_sum(log_weight) - log_sum(counted))
            log_weight[:] = counted
        return cloud, Reason.USED if used else Reason.NO_READING

    def can_converge(self, summary: BeliefSummary, reading: RadioReading) -> bool:
        """Return whether the leading hypothesis is on the map, and nothing else is as probable."""
        return bool(summary.mean[OFF] < 0.5) and not reading.doubted

    def rough_db(self) -> Bytes:
        """Return what is added to the deviation of levels, in tenths of a dB, flat as levels."""
        return self.area.flat_rough_db

    @property
    def _bands(self) -> int:
        return len(self.area.cell_ids) + 2

    def _pixels(self, state: Floats32) -> Ints32:
        return np.asarray(fingerprint.pixels(state, self.area.frame))

    def _aged(self, cloud: Cloud, reading: RadioReading) -> Cloud:
        """Return hypotheses with what they keep of the cells' errors, as a reading finds it."""
        errors, memory, length_m = self.evidence.levels, cloud.shared, reading.length_m
        if memory is None or not self.remember:
            memory = LevelMemory.empty(errors, self.area.site_of)
            kept = memory.start(cloud.state.shape[1])
        else:
            memory, decay = memory.after(length_m)
            keep = exp(-length_m / errors.fault_m)
            kept = decayed(cloud.kept, decay, keep, errors.fault_log_odds)
        served = [reading.serving] if reading.serving >= 0 else []
        memory, kept = memory.with_cells(np.array(served, dtype=np.int32), kept)
        return Cloud(cloud.state, kept, memory)

    def _weigh_serving(
        self, cloud: Cloud, pixel: Ints32, log_weight: Floats, reading: RadioReading
    ) -> None:
        flat, table = self.area.flat_level_dbm, self._serving_table
        cell, weight = reading.serving, reading.serving_weight
        odds = cloud.shared.fault_odds(cell, cloud.kept)
        other = -self.evidence.serving.fault_nats
        fingerprint.weigh_by_serving(
            pixel, flat, self._bands, cell, table, weight, odds, other, log_weight
        )

    def _weigh_levels(
        self, cloud: Cloud, pixel: Ints32, log_weight: Floats, reading: RadioReading
    ) -> Cloud:
        """Add the log-likelihood of levels and absent cells; return what hypotheses keep now."""
        errors, area, report = self.evidence.levels, self.area, reading.levels
        assert report is not None
        memory, kept, weight = cloud.shared, cloud.kept, errors.weight
        if not self.remember and reading.length_m > 0:
            weight *= 1 - exp(-2 * reading.length_m / _NEW_M)
        predicted = Prediction(area.flat_level_dbm, self.rough_db(), self._bands, errors.roughness)
        # Cells that nobody expects say nothing, neither for the belief nor against it.
        report = report._replace(absent=_expected(predicted, pixel, report))
        cells = np.concatenate([report.cell, report.absent])
        memory, kept = memory.with_cells(cells[: memory.slots], kept)
        if report.cell.size > memory.slots:
            slotted = np.isin(report.cell, memory.band)
            report = report._replace(cell=report.cell[slotted], level_dbm=report.level_dbm[slotted])
        rough_db2 = _mean_rough_db2(predicted, pixel, report.cell)
        memory, terms = memory.updated(report, rough_db2)
        absent = memory.absence(report)
        weigh_by_levels(kept, pixel, predicted, terms, weight, log_weight)
        if absent.cell.size:
            table = self._bound_table
            weigh_by_absence(kept, pixel, predicted, absent, table, weight, log_weight)
        other = weight * (float(terms.other.sum()) + float(absent.other.sum()))
        memory = replace(memory, other_log_likelihood=other)
        return Cloud(cloud.state, kept, memory)


def _mean_rough_db2(predicted: Prediction, pixel: Ints32, cell: Ints32) -> Floats:
    """Return the mean variance that the roughness of the prediction adds, for each cell."""
    squares = rough_squares(pixel, _every(pixel), predicted, cell)
    return np.asarray(predicted.share * (squares.sum(axis=1) / squares.shape[1]))


def _expected(predicted: Prediction, pixel: Ints32, report: LevelReport) -> Ints32:
    """Return absent cells that hypotheses expect to be in the report, most expected first."""
    absent = report.absent
    if not absent.size:
        return absent
    share = shares_above(pixel, _every(pixel), predicted, absent, report.limit_dbm)
    expected = [k for k, part in enumerate(share.tolist()) if part > _LEAST_EXPECTED]
    expected.sort(key=lambda k: -share[k])
    found: Ints32 = absent[expected]
    return found


def _every(pixel: Ints32) -> int:
    """Return how many hypotheses one stands for, where some stand for all of them."""
    return max(pixel.size // _SAMPLE, 1)


def _weigh_beyond(
    beyond: Bools,
    before: Floats,
    log_weight: Floats,
    reading: RadioReading,
    other_log_likelihood: float,
) -> None:
    """Mix what a report says beyond the area: predictions at the edge may hold, or not."""
    unknown = before[beyond] + reading.radio_under_null(other_log_likelihood)
    log_weight[beyond] = np.logaddexp(log_weight[beyond], unknown) - log(2)


def _new(state: Floats32) -> Cloud:
    return Cloud(state, np.empty((0, state.shape[1]), dtype=np.float32))
