"""A belief as a Gaussian sum whose parts are Kalman-type filters, step by step over a log.

A start with an uncertainty of a kilometre is cut into narrow parts (see
:mod:`mapfilter.filters.gaussian_sum`); a start from a fix is one part. Parts without weight are
dropped, and parts that have come to lie on a heavier one are merged into it, so that a converged
belief is one Gaussian again.

Parts never branch: each that is left at the end has one past, which the Rauch-Tung-Striebel
smoother goes back over, and which counts by the part's weight at the end.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from mapfilter._types import Floats, Ints
from mapfilter.filters.gaussian import Gaussian, Method
from mapfilter.filters.gaussian_sum import split
from mapfilter.filters.kalman import Taken, smooth
from mapfilter.filters.trials import CompiledMeasurement, run_trials

_LEAST_WEIGHT, _LEAST_SHARE = 1e-6, 1e-4
"""Weight of the lightest part that is kept; where there are many, of all that are dropped."""
_MANY = 64
_NEAR, _NEAR_OF_MANY = 0.1, 2.0
"""Squared distance, in a heavier part's deviations, at which another is the same."""
_ALIKE, _ALIKE_OF_MANY = 0.2, 0.5
"""Largest difference of the logarithms of their volumes then."""


@dataclass(frozen=True, eq=False)
class SumBelief:
    """Gaussians of weights (c,) that sum to one, means (c, n) and covariances (c, n, n).

    ``parts`` (c,) is the index of each of them among the parts of the start.
    """

    weights: Floats
    means: Floats
    covariances: Floats
    parts: Ints

    @classmethod
    def start(
        cls, mean: ArrayLike, covariance: ArrayLike, cut: Mapping[int, int] | None = None
    ) -> SumBelief:
        """Return a first belief, cut into parts along some components of the state.

        Examples
        --------
        >>> belief = SumBelief.start([0.0, 0.0], np.diag([4.0, 4.0]), {0: 3, 1: 3})
        >>> belief.weights.size, belief.moments.covariance.round(6).tolist()
        (9, [[4.0, 0.0], [0.0, 4.0]])
        """
        mixture = split(mean, covariance, cut or {})
        count = mixture.weights.size
        covariances = np.tile(mixture.covariance, (count, 1, 1))
        return cls(mixture.weights, mixture.means, covariances, np.arange(count))

    @classmethod
    def around(cls, mean: Floats, covariance: Floats, places: Mapping[int, Floats]) -> SumBelief:
        """Return equal parts that differ from a mean in some components: where each has them."""
        count = next(iter(places.values())).size
        means = np.tile(mean, (count, 1))
        for index, values in places.items():
            means[:, index] = values
        covariances = np.tile(covariance, (count, 1, 1))
        return cls(np.full(count, 1 / count), means, covariances, np.arange(count))

    @cached_property
    def moments(self) -> Gaussian:
        """Mean and covariance of the whole."""
        if self.weights.size == 1 and self.weights[0] == 1.0:
            # A sum of one is itself; a sum has no negative zero.
            return Gaussian(self.means[0] + 0.0, np.add(self.covariances[0], 0.0, order="C"))
        mean = self.weights @ self.means
        off = self.means - mean
        spread = self.covariances + off[:, :, None] * off[:, None, :]
        return Gaussian(mean, np.einsum("c,cij->ij", self.weights, spread))

    @property
    def leading(self) -> Gaussian:
        """The part of the largest weight."""
        most = int(np.argmax(self.weights))
        return Gaussian(self.means[most], self.covariances[most])

    def predict(self, transition: Floats, process: Floats, shift: ArrayLike = 0.0) -> SumBelief:
        """Return the belief after linear motion: ``Φ m + u``, ``Φ P Φᵀ + Q`` of each part."""
        means = self.means @ transition.T + np.asarray(shift, dtype=np.float64)
        covariances = transition @ self.covariances @ transition.T + process
        return replace(
            self, means=means, covariances=0.5 * (covariances + covariances.transpose(0, 2, 1))
        )

    def update(
        self,
        measurement: CompiledMeasurement,
        reading: ArrayLike,
        method: Method,
        compared: int | None = None,
    ) -> tuple[SumBelief, Taken]:
        """Return the belief after a reading (NaN where absent), and the outcome of the update.

        Each part is updated by the method and weighed by its evidence; a part whose update fails
        loses its weight. Where all updates fail, nothing changes. Parts that are the same in the
        first ``compared`` components (all by default) become one: the others follow from these.

        Raises
        ------
        InputError
            Sizes do not fit or the reading is infinite.
        """
        count, n = self.means.shape
        given = np.tile(np.asarray(reading, dtype=np.float64), (count, 1))[:, None]
        still, start = (np.eye(n), np.zeros((n, n))), (self.means, self.covariances)
        run = run_trials(measurement, *still, method, *start, given, covariances=True)
        own = run.evidence[:, 0]
        taken = np.isfinite(own)
        if not taken.any():
            return self, Taken(float("nan"), float("nan"))
        most = own[taken].max()
        gained = self.weights * np.where(taken, np.exp(own - most), 0.0)
        total = float(gained.sum())
        if not total > 0:
            return self, Taken(float("nan"), float("nan"))
        weights = gained / total
        nis = float(weights[taken] @ run.nis[taken, 0])
        updated = SumBelief(weights, run.means[:, 0], run.covariances[:, 0], self.parts)
        return updated._lessened(compared), Taken(float(most + np.log(total)), nis)

    def _lessened(self, compared: int | None) -> SumBelief:
        """Drop parts without weight, and merge parts that lie on heavier ones into these.

        What lies on a heavier part widens it: second moments about its mean stay as they are.
        """
        if self.weights.size == 1:
            return self
        order = np.argsort(-self.weights, kind="stable")
        many = order.size > _MANY
        if many:
            order = order[np.cumsum(self.weights[order[::-1]])[::-1] > _LEAST_SHARE]
        else:
            order = order[self.weights[order] >= min(_LEAST_WEIGHT, self.weights.max())]
        weights, means = self.weights[order], self.means[order]
        covariances, own = self.covariances[order], slice(compared)
        size, at = covariances[:, own, own], means[:, own]
        volume = np.linalg.slogdet(size)[1]
        off = at - at[:, None]
        # einsum would search anew for the order of the products.
        apart = (off @ np.linalg.inv(size) * off).sum(axis=2)
        near, differing = (_NEAR_OF_MANY, _ALIKE_OF_MANY) if many else (_NEAR, _ALIKE)
        alike = (apart < near) & (np.abs(volume - volume[:, None]) < differing)
        left = np.ones(order.size, dtype=np.bool_)
        kept = []
        for heavy in range(order.size):
            if not left[heavy]:
                continue
            kept.append(heavy)
            same = left & alike[heavy]
            left[heavy] = same[heavy] = False
            if not same.any():
                continue
            left &= ~same
            whole = weights[heavy] + weights[same].sum()
            beside = means[same] - means[heavy]
            moments = covariances[same] + beside[:, :, None] * beside[:, None, :]
            both = weights[heavy] * covariances[heavy] + np.tensordot(weights[same], moments, 1)
            weights[heavy], covariances[heavy] = whole, both / whole
        weights = weights[kept] / weights[kept].sum()
        return SumBelief(weights, means[kept], covariances[kept], self.parts[order][kept])


@dataclass(eq=False)
class FusionHistory:
    """Beliefs after each epoch, and the motion that led to them."""

    beliefs: list[SumBelief] = field(default_factory=list)
    transitions: list[Floats] = field(default_factory=list)
    processes: list[Floats] = field(default_factory=list)
    shifts: list[Floats] = field(default_factory=list)

    def add(self, belief: SumBelief, transition: Floats, process: Floats, shift: Floats) -> None:
        """Record an epoch: the belief after it, and the motion that led to it."""
        self.beliefs.append(belief)
        self.transitions.append(transition)
        self.processes.append(process)
        self.shifts.append(shift)

    def smoothed(self) -> list[Gaussian]:
        """Return mean and covariance of each epoch, given all readings."""
        if not self.beliefs:
            return []
        last = self.beliefs[-1]
        phi = np.array(self.transitions[1:]).reshape(
            len(self.beliefs) - 1, *self.transitions[0].shape
        )
        noise = np.array(self.processes[1:]).reshape(phi.shape)
        # Without the shifts, which are given, the motion is linear.
        moved = _moved(self.transitions, self.shifts)
        means, covariances = [], []
        for belief in self.beliefs:
            at = [int(np.flatnonzero(belief.parts == part)[0]) for part in last.parts]
            means.append(belief.means[at])
            covariances.append(belief.covariances[at])
        found = smooth(phi, noise, np.stack(means, axis=1) - moved, np.stack(covariances, axis=1))
        later = (
            SumBelief(last.weights, found.means[:, k] + shift, found.covariances[:, k], last.parts)
            for k, shift in enumerate(moved)
        )
        return [belief.moments for belief in later]


def _moved(transitions: list[Floats], shifts: list[Floats]) -> Floats:
    """Return where shifts alone lead from 0, (K, n)."""
    at, found = np.zeros_like(shifts[0]), []
    for k, (phi, shift) in enumerate(zip(transitions, shifts, strict=True)):
        at = phi @ at + shift if k else at
        found.append(at)
    return np.array(found)
