"""The regularised particle filter, under the common contract.

It knows no equations: a model moves particles and weighs them. The filter keeps weights as
logarithms, resamples when too few particles carry them, parts the copies by a little noise
(regularisation; Musso, Oudjane & Le Gland 2001), spends as many particles as the belief is wide,
and tells when it has found itself.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from math import isfinite, nan
from typing import Generic, Protocol, TypeVar

import numpy as np

from mapfilter._kernels import draw_key
from mapfilter._types import Floats, Floats32, Ints32
from mapfilter.errors import ConfigError, Faults
from mapfilter.filters.contract import Estimate, MotionStep, Reason, Status, UpdateInfo
from mapfilter.filters.hypotheses import BeliefSummary, Bins, empty_summary, flattened, summarise
from mapfilter.filters.resampling import copy_with_jitter, normalise, systematic


@dataclass(frozen=True, slots=True)
class ParticleOptions:
    """Numbers of particles, resampling and the switch rule.

    Parameters
    ----------
    max_particles, min_particles : int
        Limits of the number of particles.
    min_search_particles : int
        Lower limit until the filter has converged: a place that is improbable at first must keep
        enough of them to be followed.
    particles_per_bin : float
        Particles for each bin of 25 m that the belief covers (two to the power of its entropy).
    resample_below : float
        Share of the particles that the effective sample size must not fall below.
    mass_exponent : float
        Until the filter has converged, each bin of 25 m gets particles by its mass to this power,
        which keep the rest of it as weights: improbable places stay well covered. 1 for plain
        resampling.
    jitter : tuple of float
        Standard deviation of the noise added to resampled copies, for each row of the state.
    searching_jitter : tuple of float
        The same until the filter has converged: few copies stand for each place then, and must
        cover all headings and step lengths that are possible there.
    switch_mass : float
        The filter has converged when so much of the belief lies within 50 m of the leading
        hypothesis,
    switch_hold_m : float
        and has done so for so many metres travelled.
    """

    max_particles: int = 20_000
    min_search_particles: int = 12_000
    min_particles: int = 1000
    particles_per_bin: float = 60.0
    resample_below: float = 0.5
    mass_exponent: float = 0.5
    jitter: tuple[float, ...] = (0.2, 0.2, 0.005, 0.003, 0.0)
    searching_jitter: tuple[float, ...] = (1.5, 1.5, 0.015, 0.009, 0.0)
    switch_mass: float = 0.99
    switch_hold_m: float = 14.0

    def __post_init__(self) -> None:
        faults = Faults()
        if not 1 <= self.min_particles <= self.max_particles:
            got = f"{self.min_particles} and {self.max_particles}"
            faults.add(
                "particles, min_particles and max_particles",
                "1 <= min_particles <= max_particles",
                got,
            )
        if self.min_search_particles < 1:
            faults.add("particles, min_search_particles", ">= 1", self.min_search_particles)
        if not (isfinite(self.particles_per_bin) and self.particles_per_bin > 0):
            faults.add(
                "particles, particles_per_bin", "a finite number > 0", self.particles_per_bin
            )
        if not 0 < self.mass_exponent <= 1:
            faults.add("particles, mass_exponent", "a power in (0, 1]", self.mass_exponent)
        for name in ("resample_below", "switch_mass"):
            if not 0 < getattr(self, name) < 1:
                faults.add(f"particles, {name}", "a share between 0 and 1", getattr(self, name))
        if not (isfinite(self.switch_hold_m) and self.switch_hold_m >= 0):
            faults.add("particles, switch_hold_m", "metres >= 0", self.switch_hold_m)
        for name in ("jitter", "searching_jitter"):
            if not all(isfinite(sd) and sd >= 0 for sd in getattr(self, name)):
                faults.add(f"particles, {name}", "finite numbers >= 0", getattr(self, name))
        faults.raise_if_any(ConfigError)


def switched(
    status: Status, travelled_m: float, agreement_start_m: float, *, agrees: bool, hold_m: float
) -> tuple[Status, float]:
    """Return the status after an update, and since when the switch rule holds.

    Parameters
    ----------
    status : Status
        Before.
    travelled_m : float
    agreement_start_m : float
        Distance travelled when the rule began to hold; NaN where it does not.
    agrees : bool
        Whether it holds now.
    hold_m : float
        For how many metres it must.

    Examples
    --------
    >>> switched(Status.SEARCHING, 100.0, 85.0, agrees=True, hold_m=14.0)
    (<Status.CONVERGED: 'CONVERGED'>, 85.0)
    """
    if status is Status.CONVERGED:
        return Status.TRACKING, agreement_start_m
    if status is not Status.SEARCHING:
        return status, agreement_start_m
    if not agrees:
        return Status.SEARCHING, nan
    since_m = agreement_start_m if isfinite(agreement_start_m) else travelled_m
    if travelled_m - since_m >= hold_m:
        return Status.CONVERGED, since_m
    return Status.SEARCHING, since_m


PriorT = TypeVar("PriorT", contravariant=True)
ReadingT = TypeVar("ReadingT", contravariant=True)


class ParticleModel(Protocol[PriorT, ReadingT]):
    """What a particle filter needs to know of the world."""

    @property
    def bins(self) -> Bins:
        """The area, in bins."""

    def start(self, prior: PriorT, most: int, rng: np.random.Generator) -> tuple[Floats32, Floats]:
        """Return the first particles, shape (R, N), and their log weights, shape (N,)."""

    def move(
        self, state: Floats32, log_weight: Floats, motion: MotionStep, key: np.uint64
    ) -> tuple[Floats32, Floats]:
        """Return particles and log weights after a step of finite length."""

    def weigh(self, state: Floats32, log_weight: Floats, reading: ReadingT) -> Reason:
        """Add a reading's log-likelihood to the log weights, in place; say why if it has none."""

    def can_converge(self, summary: BeliefSummary) -> bool:
        """Tell whether a belief may count as having converged, if it agrees on a place."""


@dataclass(frozen=True, eq=False)
class ParticleBelief:
    """Particles, their weights, and how the filter stands.

    Parameters
    ----------
    state : ndarray of float32, shape (R, N)
        The first two rows are east and north in the model's frame.
    log_weight : ndarray of float64, shape (N,)
        After an update they sum to one.
    bins : Bins
    travelled_m : float
        By dead reckoning since the start.
    log_evidence : float
        Log probability of all readings so far.
    status : Status
    agreement_start_m : float
        Distance travelled when the switch rule began to hold; NaN where it does not.
    """

    state: Floats32
    log_weight: Floats
    bins: Bins
    travelled_m: float = 0.0
    log_evidence: float = 0.0
    status: Status = Status.SEARCHING
    agreement_start_m: float = nan

    @cached_property
    def weight(self) -> Floats32:
        """Weights that sum to one, shape (N,)."""
        weight = np.empty(self.log_weight.size, dtype=np.float32)
        normalise(self.log_weight.copy(), weight)
        return weight

    @cached_property
    def summary(self) -> BeliefSummary:
        """What the belief says."""
        if not self.log_weight.size:
            return empty_summary(self.state.shape[0])
        return summarise(self.state, self.weight, self.bins)

    def __getstate__(self) -> dict[str, object]:
        return {name: self.__dict__[name] for name in self.__dataclass_fields__}


@dataclass(frozen=True, slots=True)
class ParticleFilter(Generic[PriorT, ReadingT]):
    """A regularised particle filter.

    Parameters
    ----------
    model : ParticleModel
    options : ParticleOptions
    """

    model: ParticleModel[PriorT, ReadingT]
    options: ParticleOptions = field(default_factory=ParticleOptions)

    def init(self, prior: PriorT, rng: np.random.Generator) -> ParticleBelief:
        """Draw the first particles."""
        state, log_weight = self.model.start(prior, self.options.max_particles, rng)
        weight = np.empty(log_weight.size, dtype=np.float32)
        log_total, _ = normalise(log_weight, weight)
        if not isfinite(log_total):
            log_weight[:] = -np.log(max(log_weight.size, 1))
        return ParticleBelief(state, log_weight, self.model.bins)

    def predict(
        self, belief: ParticleBelief, motion: MotionStep, rng: np.random.Generator
    ) -> tuple[ParticleBelief, Reason]:
        """Move all particles and weigh them by the map.

        Without a heading they spread to all sides, as far as the step is long.
        """
        if not isfinite(motion.step_m):
            return belief, Reason.NO_STEP
        reason = Reason.USED if isfinite(motion.heading_rad) else Reason.NO_HEADING
        if motion.step_m == 0:
            return belief, reason
        key = draw_key(rng)
        state, log_weight = self.model.move(belief.state, belief.log_weight, motion, key)
        moved = ParticleBelief(
            state,
            log_weight,
            belief.bins,
            belief.travelled_m + abs(motion.step_m),
            belief.log_evidence,
            belief.status,
            belief.agreement_start_m,
        )
        return moved, reason

    def update(
        self, belief: ParticleBelief, reading: ReadingT, rng: np.random.Generator
    ) -> tuple[ParticleBelief, UpdateInfo]:
        """Weigh all particles, resample where that is due, and look whether they agree."""
        log_weight = belief.log_weight.copy()
        reason = self.model.weigh(belief.state, log_weight, reading)
        if reason is not Reason.USED:
            return belief, UpdateInfo(reason, belief.status, belief.log_weight.size)
        weight = np.empty(log_weight.size, dtype=np.float32)
        log_total, effective = normalise(log_weight, weight)
        if not isfinite(log_total):
            return belief, UpdateInfo(
                Reason.NO_CANDIDATES_LEFT, belief.status, belief.log_weight.size
            )
        weighed = ParticleBelief(
            belief.state,
            log_weight,
            belief.bins,
            belief.travelled_m,
            belief.log_evidence + log_total,
        )
        weighed.__dict__["weight"] = weight
        said = weighed.summary
        status, agreement_start_m = switched(
            belief.status,
            belief.travelled_m,
            belief.agreement_start_m,
            agrees=said.mass_50m >= self.options.switch_mass and self.model.can_converge(said),
            hold_m=self.options.switch_hold_m,
        )
        wanted = self._wanted(said, status)
        state = weighed.state
        searching = status is Status.SEARCHING
        flat = weight
        if searching and self.options.mass_exponent < 1:
            flat = flattened(state, weight, belief.bins, self.options.mass_exponent)
            effective = 1.0 / float(np.dot(flat, flat))
        if effective < self.options.resample_below * weight.size or 2 * wanted < weight.size:
            state, chosen = self._resampled(state, flat, wanted, status, rng)
            log_weight = _left_over(log_weight[chosen], flat[chosen])
        now = ParticleBelief(
            state,
            log_weight,
            belief.bins,
            belief.travelled_m,
            weighed.log_evidence,
            status,
            agreement_start_m,
        )
        # The summary before resampling is the better one of the same belief.
        now.__dict__["summary"] = said
        return now, UpdateInfo(Reason.USED, status, int(now.log_weight.size))

    def locate(self, belief: ParticleBelief) -> Estimate:
        """Return the leading hypothesis."""
        said = belief.summary
        return Estimate(float(said.mean[0]), float(said.mean[1]), said.covariance_m2, said.radii_m)

    def _wanted(self, summary: BeliefSummary, status: Status) -> int:
        options = self.options
        least = (
            options.min_search_particles if status is Status.SEARCHING else options.min_particles
        )
        return int(
            min(
                max(options.particles_per_bin * summary.effective_bins, least),
                options.max_particles,
            )
        )

    def _resampled(
        self,
        state: Floats32,
        weight: Floats32,
        wanted: int,
        status: Status,
        rng: np.random.Generator,
    ) -> tuple[Floats32, Ints32]:
        chosen = np.empty(wanted, dtype=np.int32)
        systematic(weight, rng.random(), chosen)
        copies = np.empty((state.shape[0], wanted), dtype=np.float32)
        options, searching = self.options, status is Status.SEARCHING
        jitter = np.asarray(
            options.searching_jitter if searching else options.jitter, dtype=np.float32
        )
        copy_with_jitter(state, chosen, jitter, draw_key(rng), copies)
        return copies, chosen


def _left_over(log_weight: Floats, chosen_by: Floats32) -> Floats:
    """Return the log weights of copies that were chosen by other weights than their own."""
    # Rounding may choose the last one though its weight is none.
    left = log_weight - np.log(np.maximum(chosen_by, np.finfo(np.float32).tiny))
    normalise(left, np.empty(left.size, dtype=np.float32))
    return left
