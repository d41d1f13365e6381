"""The whole track in hindsight: what came later tells where one was before.

The forward pass keeps the belief every few metres (and ever more seldom where that would take too
much memory). Going back from the last one, paths are drawn through the kept hypotheses (backward
simulation; Godsill, Doucet & West 2004); at each moment they are a sample of what the whole log
says. Between two kept beliefs a path follows the dead reckoning, bent to end where it must.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import log

import numpy as np

from mapfilter._kernels import draw_key
from mapfilter._types import Floats, Floats32
from mapfilter.filters.hypotheses import Bins, summarise
from mapfilter.filters.resampling import systematic
from mapfilter.models.street_motion import STATES, MotionErrors, draw_ancestors
from mapfilter.positioning.bayes.alternative import MapBelief
from mapfilter.positioning.bayes.area_map import AreaMap
from mapfilter.positioning.bayes.state import BayesState
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.positioning.matched_way import matched_way

_MOST_BYTES = 400 * 2**20
_JUMPS = 1e-4


@dataclass(frozen=True, eq=False)
class Kept:
    """A belief of the forward pass.

    Parameters
    ----------
    epoch : int
    state : ndarray of float32, shape (5, N)
    log_weight : ndarray of float32, shape (N,)
    moved_m : (float, float)
        East and north by dead reckoning since the start, in the frame of its headings.
    travelled_m : float
    """

    epoch: int
    state: Floats32
    log_weight: Floats32
    moved_m: tuple[float, float]
    travelled_m: float

    @property
    def bytes(self) -> int:
        """RadioHistory that it takes."""
        return int(self.state.nbytes + self.log_weight.nbytes)


@dataclass(eq=False)
class History:
    """Beliefs that are kept on the way; grows as the forward pass goes.

    Parameters
    ----------
    every_m : float
        Travelled between two that are kept.
    """

    every_m: float = 5.0
    kept: list[Kept] = field(default_factory=list)
    alternative: list[Kept] = field(default_factory=list)
    moved: list[tuple[float, float, float]] = field(default_factory=list)

    def add(self, before: BayesState, after: BayesState) -> None:
        """Add the state after one more epoch; a takeover replaces what was kept since it began."""
        now, epoch = after.reckoning, len(self.moved)
        self.moved.append((now.east_m, now.north_m, now.travelled_m))
        if before.alternative is not None and after.alternative is None:
            if after.takeovers > before.takeovers:
                start_m = before.alternative.start_m
                self.kept = [k for k in self.kept if k.travelled_m < start_m] + self.alternative
            self.alternative = []
        due = not self.kept or now.travelled_m - self.kept[-1].travelled_m >= self.every_m
        if after.belief is None or not due:
            return
        self.kept.append(_keep(after.belief, epoch, self.moved[-1]))
        if after.alternative is not None:
            self.alternative.append(_keep(after.alternative.belief, epoch, self.moved[-1]))
        if sum(k.bytes for k in self.kept) > _MOST_BYTES:
            self.kept, self.every_m = self.kept[::2], 2 * self.every_m

    def close(self, last: BayesState) -> None:
        """Keep the last belief, from which paths go back."""
        if last.leading is not None and self.kept and self.kept[-1].epoch < len(self.moved) - 1:
            self.kept.append(_keep(last.leading, len(self.moved) - 1, self.moved[-1]))


def _keep(belief: MapBelief, epoch: int, moved: tuple[float, float, float]) -> Kept:
    weight = belief.log_weight.astype(np.float32)
    return Kept(epoch, belief.state[:STATES], weight, moved[:2], moved[2])


def smoothed(
    estimate: TrackEstimate,
    history: History,
    area: AreaMap,
    errors: MotionErrors,
    rng: np.random.Generator,
    *,
    paths: int = 200,
    jitter: tuple[float, ...] = (1.5, 1.5, 0.01, 0.006, 0.0),
) -> TrackEstimate:
    """Return an estimate whose positions, radii and ways are those in hindsight.

    Parameters
    ----------
    estimate : TrackEstimate
        Of the forward pass; what it says of status and readings stays.
    history : History
        Closed.
    area : AreaMap
    errors : MotionErrors
        Of the forward pass.
    rng : numpy.random.Generator
    paths : int
        How many are drawn.
    jitter : tuple of float
        How far an ancestor may be off beyond the motion's noise, for each row of the state; not
        less than the forward pass parts copies by.
    """
    kept = history.kept
    if not kept:
        return estimate
    moved = np.array(history.moved)
    states = _paths(kept, area, errors, rng, paths, jitter)
    west, south = area.origin_m
    bins = Bins.over((0.0, 0.0, *area.size_m))
    weight = np.full(paths, 1 / paths, dtype=np.float32)
    east_m, north_m = estimate.east_m.copy(), estimate.north_m.copy()
    covariance_m2, radii_m = estimate.covariance_m2.copy(), estimate.radii_m.copy()
    mass, way_id = estimate.mass_50m.copy(), estimate.way_id.copy()
    way_probability = estimate.way_probability.copy()
    for index in range(kept[0].epoch, len(estimate)):
        place = _between(kept, states, moved, index)
        said = summarise(place, weight, bins)
        east_m[index], north_m[index] = said.mean[0] + west, said.mean[1] + south
        covariance_m2[index], radii_m[index] = said.covariance_m2, said.radii_m
        mass[index] = said.mass_50m
        way_id[index], way_probability[index] = matched_way(area, place[0], place[1], weight)
    return replace(
        estimate,
        east_m=east_m,
        north_m=north_m,
        covariance_m2=covariance_m2,
        radii_m=radii_m,
        mass_50m=mass,
        way_id=way_id,
        way_probability=way_probability,
    )


def _paths(
    kept: list[Kept],
    area: AreaMap,
    errors: MotionErrors,
    rng: np.random.Generator,
    paths: int,
    jitter: tuple[float, ...],
) -> list[Floats32]:
    """Draw paths back from the last belief; one state for each kept belief and path."""
    last = kept[-1]
    weight = np.exp(last.log_weight - last.log_weight.max())
    chosen = np.empty(paths, dtype=np.int32)
    systematic((weight / weight.sum()).astype(np.float32), rng.random(), chosen)
    states = [last.state[:, chosen]]
    width_m, height_m = area.size_m
    for later, earlier in zip(kept[:0:-1], kept[-2::-1], strict=True):
        length_m = later.travelled_m - earlier.travelled_m
        steps = length_m / errors.typical_step_m
        across = errors.typical_step_m * errors.heading_sd_rad
        place_var = steps * max(errors.step_sd_m, across) ** 2 + jitter[0] ** 2
        bias_var = errors.bias_drift_rad_per_sqrt_m**2 * length_m + jitter[2] ** 2
        scale_var = errors.scale_drift_per_sqrt_m**2 * length_m + jitter[3] ** 2
        moved_m = (later.moved_m[0] - earlier.moved_m[0], later.moved_m[1] - earlier.moved_m[1])
        variances = (place_var, bias_var, scale_var)
        log_jump = log(_JUMPS * place_var / (width_m * height_m))
        chosen = draw_ancestors(
            states[-1],
            earlier.state,
            earlier.log_weight,
            moved_m,
            variances,
            log_jump,
            draw_key(rng),
        )
        states.append(earlier.state[:, chosen])
    return states[::-1]


def _between(kept: list[Kept], states: list[Floats32], moved: Floats, index: int) -> Floats32:
    """Return where all paths are at an epoch."""
    after = next((k for k, one in enumerate(kept) if one.epoch >= index), len(kept) - 1)
    if kept[after].epoch == index or after == 0:
        return states[after]
    first, last = kept[after - 1], kept[after]
    start = states[after - 1]
    here = _reckoned(start, moved[index, :2] - np.asarray(first.moved_m))
    there = _reckoned(start, np.asarray(last.moved_m) - np.asarray(first.moved_m))
    length_m = last.travelled_m - first.travelled_m
    gone_m = moved[index, 2] - first.travelled_m
    share = np.float32(gone_m / length_m if length_m > 0 else 1.0)
    place = start.copy()
    place[:2] = here + share * (states[after][:2] - there)
    return place


def _reckoned(state: Floats32, moved_m: Floats) -> Floats32:
    cosine, sine, stretch = np.cos(state[2]), np.sin(state[2]), np.exp(state[3])
    east, north = np.float32(moved_m[0]), np.float32(moved_m[1])
    moved = np.stack([east * cosine - north * sine, east * sine + north * cosine])
    return np.asarray(state[:2] + stretch * moved, dtype=np.float32)


@dataclass(eq=False)
class BayesSmoother:
    """Collects beliefs of a forward pass, and smooths the track by them.

    Parameters
    ----------
    area : AreaMap
    errors : MotionErrors
        Of the forward pass.
    """

    area: AreaMap
    errors: MotionErrors
    history: History = field(default_factory=History)
    last: BayesState | None = None

    def add(self, before: BayesState, after: BayesState) -> None:
        """Record the states before and after one epoch."""
        self.history.add(before, after)
        self.last = after

    def smoothed(self, estimate: TrackEstimate, rng: np.random.Generator) -> TrackEstimate:
        """Return the estimate with positions, radii and ways given the whole log."""
        if self.last is not None:
            self.history.close(self.last)
        return smoothed(estimate, self.history, self.area, self.errors, rng)
