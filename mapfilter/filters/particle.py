"""The regularised particle filter, under the common contract.

It holds no equations: a model moves particles and weighs them. The filter keeps weights as
logarithms, resamples when too few particles carry them, adds noise to the copies (regularisation;
Musso, Oudjane & Le Gland 2001), spends as many particles as the belief is wide, and decides when it
has converged.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from math import isfinite, nan
from typing import Annotated, Any, Generic

import numpy as np
from annotated_types import Ge, Gt, Le

from mapfilter._kernels import draw_key
from mapfilter._threads import ONE, Threads
from mapfilter._types import Floats, Floats32
from mapfilter.errors import Faults
from mapfilter.filters.belief_models import Cloud, ParticleModel, PriorT, ReadingT
from mapfilter.filters.contract import Estimate, MotionStep, Reason, Status, UpdateInfo
from mapfilter.filters.copies import MADE_WHEN_READ, Copies, Kept, copies_of
from mapfilter.filters.hypotheses import BeliefSummary, Bins, empty_summary, flattened, summarise
from mapfilter.filters.resampling import (
    copy_with_jitter,
    normalise,
    normalise_by,
    systematic_by,
    taken,
)
from mapfilter.filters.switch_rule import switched
from mapfilter.options import NotNegative, Options, Positive, Probability, Share

_LEAST_WEIGHT = np.finfo(np.float32).tiny
_Count = Annotated[int, Ge(1)]


@dataclass(frozen=True, slots=True)
class ParticleOptions(Options):
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
    split_mass : float
        It searches again when less than this lies there.
    """

    max_particles: _Count = 20_000
    min_search_particles: _Count = 12_000
    min_particles: _Count = 3000
    particles_per_bin: Positive = 60.0
    resample_below: Probability = 0.5
    mass_exponent: Annotated[float, Gt(0), Le(1)] = 0.5
    jitter: tuple[NotNegative, ...] = (0.3, 0.3, 0.004, 0.002, 0.0, 0.004, 0.004, 1e-4)
    searching_jitter: tuple[NotNegative, ...] = (1.5, 1.5, 0.01, 0.006, 0.0, 0.01, 0.01, 1e-4)
    switch_mass: Probability = 0.99
    switch_hold_m: NotNegative = 14.0
    split_mass: Share = 0.5

    def check(self, faults: Faults) -> None:
        """Add a lower limit above the upper one."""
        if self.min_particles > self.max_particles:
            found = f"{self.min_particles} and {self.max_particles}"
            where = "ParticleOptions, min_particles and max_particles"
            faults.add(where, "min_particles <= max_particles", found)


@dataclass(frozen=True, eq=False)
class ParticleBelief:
    """Particles, their weights, and the status of the filter.

    Parameters
    ----------
    state : ndarray of float32, shape (R, N)
        The first two rows are east and north in the model's frame.
    log_weight : ndarray of float64, shape (N,)
        Logarithms of weights, which sum to one after an update.
    bins : Bins
        The area.
    kept : ndarray of float32, shape (W, N)
        As in :class:`~mapfilter.filters.belief_models.Cloud`; copies are made when it is first
        read.
    shared : object
        As in :class:`~mapfilter.filters.belief_models.Cloud`.
    travelled_m : float
        By dead reckoning since the start.
    log_evidence : float
        Log probability of all readings so far.
    agreement_start_m : float
        Distance travelled when the switch rule began to hold; NaN where it does not.
    """

    state: Floats32
    log_weight: Floats
    bins: Bins
    kept: Kept = MADE_WHEN_READ
    shared: Any = None
    travelled_m: float = 0.0
    log_evidence: float = 0.0
    status: Status = Status.SEARCHING
    agreement_start_m: float = nan

    @property
    def count(self) -> int:
        """Number of particles."""
        return self.log_weight.size

    @property
    def cloud(self) -> Cloud:
        """The hypotheses as models weigh them."""
        return Cloud(self.state, self.kept_unread, self.shared)

    @property
    def kept_unread(self) -> Floats32 | Copies:
        """What particles keep, without making copies of it."""
        kept: Floats32 | Copies = self.__dict__["kept"]
        return kept

    @cached_property
    def weight(self) -> Floats32:
        """Weights that sum to one, shape (N,)."""
        weight = np.empty(self.log_weight.size, dtype=np.float32)
        normalise(self.log_weight.copy(), weight)
        return weight

    @cached_property
    def summary(self) -> BeliefSummary:
        """Leading hypothesis, radii and runners-up."""
        if not self.log_weight.size:
            return empty_summary(self.state.shape[0])
        return summarise(self.state, self.weight, self.bins)

    def __getstate__(self) -> dict[str, object]:
        kept = {name: getattr(self, name) for name in self.__dataclass_fields__}
        # The summary before resampling does not follow from what is left.
        return kept | {name: one for name, one in vars(self).items() if name == "summary"}


@dataclass(frozen=True, slots=True)
class ParticleFilter(Generic[PriorT, ReadingT]):
    """A regularised particle filter for a model.

    Copies are divided among ``threads``; a model has its own.
    """

    model: ParticleModel[PriorT, ReadingT]
    options: ParticleOptions = field(default_factory=ParticleOptions)
    threads: Threads = ONE

    def init(self, prior: PriorT, rng: np.random.Generator) -> ParticleBelief:
        """Draw the first particles."""
        cloud, log_weight = self.model.start(prior, self.options.max_particles, rng)
        log_total, _ = normalise(log_weight, np.empty(log_weight.size, dtype=np.float32))
        if not isfinite(log_total):
            log_weight[:] = -np.log(max(log_weight.size, 1))
        return ParticleBelief(cloud.state, log_weight, self.model.bins, cloud.kept, cloud.shared)

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
        travelled_m = belief.travelled_m + abs(motion.step_m)
        return ParticleBelief(
            state,
            log_weight,
            belief.bins,
            belief.kept_unread,
            belief.shared,
            travelled_m,
            belief.log_evidence,
            belief.status,
            belief.agreement_start_m,
        ), reason

    def update(
        self, belief: ParticleBelief, reading: ReadingT, rng: np.random.Generator
    ) -> tuple[ParticleBelief, UpdateInfo]:
        """Weigh all particles, apply the switch rule, and resample where that is due."""
        options, log_weight = self.options, belief.log_weight.copy()
        (state, kept, shared, withheld), reason = self.model.weigh(
            belief.cloud, log_weight, reading
        )
        weight = np.empty(log_weight.size, dtype=np.float32)
        if reason is Reason.USED:
            log_total, effective = normalise_by(self.threads, log_weight, weight)
            if not isfinite(log_total):
                reason = Reason.NO_CANDIDATES_LEFT
        if reason is not Reason.USED:
            return belief, UpdateInfo(reason, belief.status, log_weight.size)
        summary = summarise(state, weight, belief.bins)
        status, agreement_start_m = switched(
            belief.status,
            belief.travelled_m,
            belief.agreement_start_m,
            # Whether all agrees counts only while the filter searches.
            agrees=belief.status is Status.SEARCHING
            and summary.mass_50m >= options.switch_mass
            and self.model.can_converge(summary, reading),
            splits=summary.mass_50m < options.split_mass,
            hold_m=options.switch_hold_m,
        )
        searching = status is Status.SEARCHING
        if searching and options.mass_exponent < 1:
            weight = flattened(state, weight, belief.bins, options.mass_exponent)
            effective = 1.0 / float(np.dot(weight, weight))
        least = options.min_search_particles if searching else options.min_particles
        by_bins = options.particles_per_bin * summary.effective_bins
        wanted = int(min(max(by_bins, least), options.max_particles))
        if effective < options.resample_below * weight.size or 2 * wanted < weight.size:
            chosen = np.empty(wanted, dtype=np.int32)
            systematic_by(self.threads, weight, rng.random(), chosen)
            sd = np.array(options.searching_jitter if searching else options.jitter, np.float32)
            copies = np.empty((state.shape[0], wanted), dtype=np.float32)
            key = draw_key(rng)
            # Copies keep the part of their weight that they were not chosen by. Rounding may choose
            # the last one though its weight is none.
            log_of, chosen_by = np.empty(wanted), np.empty(wanted, dtype=np.float32)
            self.threads.over(
                wanted,
                (copy_with_jitter, state, chosen, sd, key, copies),
                (taken, log_weight, weight, chosen, log_of, chosen_by),
            )
            state, kept = copies, copies_of(kept, chosen)
            if 2 * wanted < weight.size:
                # What most of them kept would be held until the next report.
                kept = kept.made()
            np.maximum(chosen_by, _LEAST_WEIGHT, out=chosen_by)
            log_weight = np.subtract(log_of, np.log(chosen_by, out=chosen_by), out=log_of)
            normalise_by(self.threads, log_weight, np.empty(wanted, dtype=np.float32))
        now = ParticleBelief(
            state,
            log_weight,
            belief.bins,
            kept,
            shared,
            belief.travelled_m,
            belief.log_evidence + log_total + withheld,
            status,
            agreement_start_m,
        )
        # The summary before resampling is the better one of the same belief.
        now.__dict__["summary"] = summary
        return now, UpdateInfo(Reason.USED, status, log_weight.size)

    def locate(self, belief: ParticleBelief) -> Estimate:
        """Return the leading hypothesis."""
        return belief.summary.estimate
