"""The map filter's model, which the filters of a single belief call.

:class:`BayesModel` draws the first hypotheses, moves them by dead reckoning, and weighs them by the
map of ways. What :class:`~mapfilter.positioning.bayes.sources.evidence_model.EvidenceModel` adds is
how they are weighed by radio reports and by the terms of other sources.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property, lru_cache, partial
from math import isfinite, nan

import numpy as np

from mapfilter._types import Floats, Floats32
from mapfilter.angles import wrap_rad
from mapfilter.filters.belief_models import Cloud
from mapfilter.filters.contract import MotionStep
from mapfilter.filters.hypotheses import BeliefSummary, Bins
from mapfilter.models.street_motion import BIAS, NORTH, OFF, MotionErrors, move, moving
from mapfilter.models.way_course import with_courses
from mapfilter.models.way_map import (
    MapWeights,
    WayMap,
    interpolate,
    weigh_by_ways,
    weighed_at_places,
)
from mapfilter.models.way_spread import density_beyond, spread_along_ways
from mapfilter.positioning.bayes.area.beyond_edge import BEYOND_COST_PER_M
from mapfilter.positioning.bayes.area.likely_points import KEPT_REPORTS, KnownReading, likelihoods
from mapfilter.positioning.bayes.area.tiled_area import TiledArea
from mapfilter.positioning.bayes.beliefs.first_hypotheses import (
    BEYOND_AT_START,
    BEYOND_M,
    Start,
    first_hypotheses,
)
from mapfilter.positioning.bayes.rivals.alternative import MAP_NATS_PER_M
from mapfilter.positioning.bayes.sources.evidence import RadioReading
from mapfilter.positioning.bayes.sources.evidence_model import EvidenceModel

_F = np.float32
_BESIDE = 1.0
"""Negative log-likelihood of the map that the middle of a way may have without a cost."""


@dataclass(frozen=True)
class BayesModel(EvidenceModel):
    """Ways and radio maps of an area, and the errors of motion and measurements."""

    motion: MotionErrors = field(default_factory=MotionErrors)
    weights: MapWeights = field(default_factory=MapWeights)

    @cached_property
    def bins(self) -> Bins:
        """Bins of 25 m over the area and what surrounds it."""
        (width_m, height_m), more_m = self.area.size_m, BEYOND_M
        return Bins.over((-more_m, -more_m, width_m + more_m, height_m + more_m))

    @cached_property
    def log_map(self) -> Floats32:
        """Log-likelihood of the map at every pixel."""
        return self.whole.log_map(self.weights.sd_m)

    @cached_property
    def _ways(self) -> WayMap:
        return WayMap(self.log_map, self.area.lattice.resolution_m, *self.area.size_m)

    @cached_property
    def kept_likelihoods(self) -> Callable[[KnownReading], tuple[Floats32, float]]:
        """Likelihoods of all points on ways, of the last few reports that beliefs started from."""
        return lru_cache(maxsize=KEPT_REPORTS)(partial(_likelihoods_on_ways, self))

    def start(self, prior: Start, most: int, rng: np.random.Generator) -> tuple[Cloud, Floats]:
        """Draw the first hypotheses: by the first evidence, or about a known start."""
        cloud, log_weight = first_hypotheses(self, prior, most, rng)
        if prior.reading is not None:
            # Hypotheses that were drawn by this evidence keep what it says of the levels' errors.
            drawn_by = not isfinite(prior.east_m)
            weighed = log_weight.copy() if drawn_by else log_weight
            cloud, _ = self.weigh(cloud, weighed, prior.reading)
        return cloud, log_weight

    def move(
        self, state: Floats32, log_weight: Floats, motion: MotionStep, key: np.uint64
    ) -> tuple[Floats32, Floats]:
        """Move by one step and weigh by the map, by the metre."""
        if self.motion.corners_per_m > 0 and motion.is_undirected:
            return self._along_ways(state, log_weight, motion, key)
        if not isfinite(motion.heading_rad):
            return self._to_all_sides(state, log_weight, motion, key)
        sampling_sd_m, rows = motion.sampling_sd_m, motion.rows
        heading_rad, errors = motion.heading_rad, self.motion
        call, moved = moving(state, motion.step_m, heading_rad, errors, key, sampling_sd_m, rows)
        beyond, factors = self._beyond_per_m, self.weights.over(abs(motion.step_m))
        weighed: Floats
        if isinstance(self.area, TiledArea):
            self.threads.over(log_weight.size, call)
            on_map = self.area.log_map_at(moved, self.weights.sd_m)
            weighed = weighed_at_places(
                moved, on_map, self.area.size_m, factors, beyond, log_weight
            )
        else:
            weighed = np.empty_like(log_weight)
            by_ways = (weigh_by_ways, moved, self._ways, factors, beyond, log_weight, weighed)
            self.threads.over(log_weight.size, call, by_ways)
        return moved, weighed

    def _along_ways(
        self, state: Floats32, log_weight: Floats, motion: MotionStep, key: np.uint64
    ) -> tuple[Floats32, Floats]:
        """Move by a step without any direction, each hypothesis on along the ways."""
        state = with_courses(state, motion.step_m, self.motion, self._log_map_at, key)
        more = motion.sampling_sd_m, motion.rows
        moved = move(state, motion.step_m, 0.0, self.motion, key, *more)
        # Along narrow ways a raster is a few metres beside them: such cost no more than others.
        fit = np.minimum(self._log_map_at(moved[: NORTH + 1]) + _F(_BESIDE), _F(0.0))
        factors = self.weights.over(abs(motion.step_m))
        size_m, beyond = self.area.size_m, self._beyond_per_m
        return moved, weighed_at_places(moved, fit, size_m, factors, beyond, log_weight)

    def _to_all_sides(
        self, state: Floats32, log_weight: Floats, motion: MotionStep, key: np.uint64
    ) -> tuple[Floats32, Floats]:
        """Move by a step that nothing measured, or whose direction nothing did.

        It is no evidence for any place, nor against what the belief leaves out: each metre costs
        what one off the map does, but no more than it costs the null hypothesis.
        """
        length_m, size_m = abs(motion.step_m), self.area.size_m
        beyond = (density_beyond(size_m, BEYOND_AT_START, BEYOND_M), BEYOND_M)
        moved = spread_along_ways(
            state,
            motion.all_sides_m,
            length_m,
            self.weights,
            self._log_map_at,
            size_m,
            beyond,
            key,
        )
        if motion.turned_sd_rad > 0:
            turned = np.random.default_rng(int(key)).standard_normal(
                log_weight.size, dtype=np.float32
            )
            moved[BIAS] = wrap_rad(moved[BIAS] + np.float32(motion.turned_sd_rad) * turned)
        cost_per_m = min(self.weights.off_cost_per_m, MAP_NATS_PER_M)
        return moved, log_weight - cost_per_m * length_m

    @property
    def _beyond_per_m(self) -> float:
        """The map's log-likelihood beyond the area, where nobody knows the ways; NaN for none.

        If these hypotheses are all there is, the belief is off the map.
        """
        cost = BEYOND_COST_PER_M if self.area.cell_ids else self.weights.off_cost_per_m
        return -cost / self.weights.weight_per_m if self.weights.weight_per_m > 0 else nan

    def _log_map_at(self, places_m: Floats32) -> Floats32:
        """Return the map's log-likelihood at places (2, N), in metres."""
        if isinstance(self.area, TiledArea):
            return self.area.log_map_at(places_m, self.weights.sd_m)
        rows, pixel_m = self.log_map.shape[0], self.area.lattice.resolution_m
        upper_m = (rows - 0.5) * pixel_m
        east_m, north_m = places_m
        return interpolate(east_m, north_m, self.log_map, pixel_m / 2, upper_m, 1 / pixel_m)

    def can_converge(self, summary: BeliefSummary, reading: RadioReading) -> bool:
        """Return whether the leading hypothesis is on the map, and nothing else is as probable."""
        if reading.doubted or not summary.mean[OFF] < 0.5:
            return False
        return not reading.at_edge(self.area)


def _likelihoods_on_ways(model: BayesModel, known: KnownReading) -> tuple[Floats32, float]:
    return likelihoods(model, model.whole.points, known.reading)
