"""Smoothing: forward filtering, backward simulation.

The forward pass keeps the belief every few metres (less often where that would take too much
memory). Going back from the last one, paths are drawn through the kept hypotheses (Godsill, Doucet
& West 2004); at each epoch they are a sample of the posterior given the whole log. Between two kept
beliefs a path follows the dead reckoning, bent to end at the later one.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import exp, isfinite, log
from typing import NamedTuple

import numpy as np

from mapfilter._kernels import draw_key
from mapfilter._types import Floats, Floats32
from mapfilter.filters.hypotheses import Bins, summarise
from mapfilter.filters.resampling import systematic
from mapfilter.models.street_ancestors import draw_ancestors
from mapfilter.models.street_motion import (
    BIAS,
    LOG_SCALE,
    OFF,
    STRETCH,
    TURN,
    MotionErrors,
)
from mapfilter.positioning.bayes.area.area_frame import AreaFrame
from mapfilter.positioning.bayes.rivals.alternative import AlternativeHypothesis, MapBelief
from mapfilter.positioning.bayes.state import BayesState, belief_here
from mapfilter.positioning.estimate import TrackEstimate

_MAX_BYTES = 400 * 2**20
_JUMPS = 1e-4
_ROWS = OFF + 1
_PLACE = ("east_m", "north_m", "covariance_m2", "radii_m", "mass_50m")
_SMOOTHED = (*_PLACE, "way_id", "way_probability")


class Kept(NamedTuple):
    """A belief of the forward pass: states, shape (5, N), weights, and dead reckoning so far.

    ``sampling_m2`` is the variance of its sampling.
    """

    epoch: int
    state: Floats32
    log_weight: Floats32
    moved_m: tuple[float, float]
    travelled_m: float
    sampling_m2: float = 0.0


@dataclass(eq=False)
class BayesSmoother:
    """Collects beliefs of a forward pass, and smooths the track by them.

    Parameters
    ----------
    errors : MotionErrors
        Of the forward pass.
    every_m : float
        Distance between two beliefs that are kept; doubles when they take too much memory.
    kept, alternative : list of Kept
        Of the main belief and, since its start, of the present alternative.
    alternative_is_whole : bool
        Whether there is one of each part since its start: none was dropped at a takeover.
    moved : list of (float, float, float, float)
        East, north and distance by dead reckoning at each epoch, and the variance of its sampling.
    last : BayesState or None
        After the last epoch.
    """

    area: AreaFrame
    errors: MotionErrors
    every_m: float = 5.0
    kept: list[Kept] = field(default_factory=list)
    alternative: list[Kept] = field(default_factory=list)
    alternative_is_whole: bool = True
    moved: list[tuple[float, float, float, float]] = field(default_factory=list)
    last: BayesState | None = None
    _kept_bytes: int = 0

    def add(self, before: BayesState, after: BayesState) -> None:
        """Record the states before and after one epoch; a takeover replaces beliefs kept since."""
        self.last, now = after, after.reckoning
        self.moved.append((now.east_m, now.north_m, now.travelled_m, now.sampling_m2))
        taken_over, held_anew = after.takeovers > before.takeovers, after.hold != before.hold
        since_m = after.alone_from_m
        led = isfinite(since_m) and since_m != before.alone_from_m
        unit = after.hold.step_unit_m / before.hold.step_unit_m
        if self._is_another(before.alternative, after.alternative):
            self.alternative, self.alternative_is_whole = [], True
        if taken_over and unit != 1.0:
            self._read_in_another_unit(unit)
        elif taken_over and (held_anew or led):
            # Since the start of what has taken over positions led the beliefs away, or dead
            # reckoning was read otherwise.
            if not led:
                starts_m = [one.start_m for one in before.held if one.hold == after.hold]
                if not starts_m and before.alternative is not None:
                    starts_m = [before.alternative.start_m]
                since_m = min(starts_m, default=now.travelled_m)
            self._keep_only([k for k in self.kept if k.travelled_m < since_m])
            self.alternative, self.alternative_is_whole = [], after.alternative is None
        elif before.alternative is not None and after.alternative is None:
            if taken_over:
                start_m = before.alternative.start_m
                ours = [k for k in self.kept if k.travelled_m < start_m]
                self._keep_only(ours + (self.alternative if self.alternative_is_whole else []))
            self.alternative, self.alternative_is_whole = [], True
        due = not self.kept or now.travelled_m - self.kept[-1].travelled_m >= self.every_m
        if after.belief is None or not due or after.leg.rows:
            # Beliefs whose steps wait are kept when these have moved them.
            return
        self._append(self.kept, after.belief)
        if after.alternative is not None:
            self._append(self.alternative, after.alternative.belief)
        if self._kept_bytes > _MAX_BYTES:
            self._keep_only(self.kept[::2])
            self.every_m *= 2

    @staticmethod
    def _is_another(one: AlternativeHypothesis | None, other: AlternativeHypothesis | None) -> bool:
        """Return whether an alternative has been begun in place of one that reads otherwise."""
        return one is not None and other is not None and one.start_m != other.start_m

    def _append(self, to: list[Kept], belief: MapBelief) -> None:
        """Keep a belief, unless all mass of its grid has left the area."""
        one = self._keep(belief)
        if not one.log_weight.size:
            return
        to.append(one)
        if to is self.kept:
            # A sum over all that is kept, at each epoch, would take longest of all in a long log.
            self._kept_bytes += _bytes_of(one)

    def _keep_only(self, kept: list[Kept]) -> None:
        self.kept, self._kept_bytes = kept, sum(map(_bytes_of, kept))

    def _read_in_another_unit(self, factor: float) -> None:
        """Lengthen all dead reckoning so far, and keep the beliefs that were moved in this unit.

        The last dead reckoning stays, as what follows is added to it.
        """
        end = np.array(self.moved[-1])
        scale = np.array([factor, factor, factor, factor**2])
        lengthened = end - scale * (end - np.array(self.moved))
        self.moved = [(float(e), float(n), float(s), float(v)) for e, n, s, v in lengthened]
        self._keep_only([self._moved_as(k) for k in self.alternative])
        self.alternative, self.alternative_is_whole = [], True

    def _moved_as(self, kept: Kept) -> Kept:
        east_m, north_m, travelled_m, sampling_m2 = self.moved[kept.epoch]
        return kept._replace(
            moved_m=(east_m, north_m), travelled_m=travelled_m, sampling_m2=sampling_m2
        )

    def _keep(self, belief: MapBelief) -> Kept:
        east_m, north_m, travelled_m, sampling_m2 = self.moved[-1]
        weight = belief.log_weight.astype(np.float32)
        epoch = len(self.moved) - 1
        # Lasting errors and deviations together are what leads a hypothesis on.
        state = belief.state[:_ROWS].copy()
        state[BIAS] += belief.state[TURN]
        state[LOG_SCALE] += belief.state[STRETCH]
        return Kept(epoch, state, weight, (east_m, north_m), travelled_m, sampling_m2)

    def close(self) -> None:
        """Keep the last belief, from which paths go back."""
        belief = belief_here(self.last) if self.last is not None else None
        if belief is not None and self.kept and self.kept[-1].epoch < len(self.moved) - 1:
            self._append(self.kept, belief)

    def smoothed(
        self,
        estimate: TrackEstimate,
        rng: np.random.Generator,
        *,
        paths: int = 200,
        jitter: tuple[float, ...] = (1.5, 1.5, 0.01, 0.006, 0.0),
    ) -> TrackEstimate:
        """Return the estimate with positions, radii and ways given the whole log.

        Parameters
        ----------
        estimate : TrackEstimate
            Of the forward pass; its statuses and unused readings stay.
        paths : int
            Number of paths.
        jitter : tuple of float
            Standard deviation by which an ancestor may differ beyond the motion's noise, for each
            row of the state; at least that of the jitter of copies in the forward pass.
        """
        self.close()
        area, kept = self.area, self.kept
        if not kept:
            return estimate
        moved = np.array(self.moved)
        states = _paths(kept, area, self.errors, rng, paths, jitter)
        west, south = area.origin_m
        bins = Bins.over((0.0, 0.0, *area.size_m))
        weight = np.full(paths, 1 / paths, dtype=np.float32)
        new = {name: getattr(estimate, name).copy() for name in _SMOOTHED}
        indices = range(kept[0].epoch, len(estimate))
        # The first belief at each epoch or after it: they are kept in the order of time.
        following = np.searchsorted([one.epoch for one in kept], indices)
        for index, after in zip(indices, np.minimum(following, len(kept) - 1), strict=True):
            place = _between(kept, states, moved, index, int(after))
            found = summarise(place, weight, bins)
            way = area.matched_way(place[0], place[1], weight)
            mean = found.mean[0] + west, found.mean[1] + south
            values = (*mean, found.covariance_m2, found.radii_m, found.mass_50m, *way)
            for name, value in zip(_SMOOTHED, values, strict=True):
                new[name][index] = value
        return replace(estimate, **new)


def _bytes_of(kept: Kept) -> int:
    return kept.state.nbytes + kept.log_weight.nbytes


def _paths(
    kept: list[Kept],
    area: AreaFrame,
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
    # An index of columns gives rows that are not contiguous: kernels are compiled anew for them.
    states = [np.take(last.state, chosen, axis=1)]
    width_m, height_m = area.size_m
    for later, earlier in zip(kept[:0:-1], kept[-2::-1], strict=True):
        length_m = later.travelled_m - earlier.travelled_m
        steps = length_m / errors.typical_step_m
        across = errors.typical_step_m * errors.white_rad
        place_var = steps * max(errors.step_sd_m, across) ** 2 + jitter[0] ** 2
        turn_var = errors.turn_sd_rad**2 * _new_share(length_m, errors.heading_m)
        stretch_var = errors.stretch_sd**2 * _new_share(length_m, errors.stretch_m)
        place_var += length_m**2 * max(turn_var, stretch_var) / 3
        place_var += later.sampling_m2 - earlier.sampling_m2
        bias_var = errors.bias_drift_rad_per_sqrt_m**2 * length_m + turn_var + jitter[2] ** 2
        scale_var = errors.scale_drift_per_sqrt_m**2 * length_m + stretch_var + jitter[3] ** 2
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
        states.append(np.take(earlier.state, chosen, axis=1))
    return states[::-1]


def _new_share(length_m: float, correlation_m: float) -> float:
    """Return the share of a deviation's variance that is new after a distance."""
    return 1 - exp(-2 * length_m / correlation_m)


def _between(
    kept: list[Kept], states: list[Floats32], moved: Floats, index: int, after: int
) -> Floats32:
    """Return where all paths are at an epoch.

    ``after`` is the index of the first belief that is kept at it or later, or that of the last one.
    """
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
