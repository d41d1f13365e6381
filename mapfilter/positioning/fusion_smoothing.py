"""A log's whole track in hindsight, by the smoother of each part of a Gaussian sum.

Parts never branch: each that is left at the end has one past, which the Rauch-Tung-Striebel
smoother goes back over; the weights at the end say which past it was.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from mapfilter._types import Floats
from mapfilter.filters.gaussian import Gaussian
from mapfilter.filters.smoothing import smooth
from mapfilter.positioning.fusion_belief import SumBelief


@dataclass(eq=False)
class FusionHistory:
    """Beliefs after each epoch, and the motion that led to them; grows as the filter goes."""

    beliefs: list[SumBelief] = field(default_factory=list)
    transitions: list[Floats] = field(default_factory=list)
    processes: list[Floats] = field(default_factory=list)
    shifts: list[Floats] = field(default_factory=list)

    def add(self, belief: SumBelief, transition: Floats, process: Floats, shift: Floats) -> None:
        """Take in an epoch: how one moved to it, and what is known after its readings."""
        self.beliefs.append(belief)
        self.transitions.append(transition)
        self.processes.append(process)
        self.shifts.append(shift)

    def smoothed(self) -> list[Gaussian]:
        """Return mean and covariance of each epoch, given all readings."""
        if not self.beliefs:
            return []
        last = self.beliefs[-1]
        phi = np.array(self.transitions[1:]).reshape(-1, *self.transitions[0].shape)
        noise = np.array(self.processes[1:]).reshape(phi.shape)
        # Known shifts are taken off, so that what is left is linear.
        moved = _moved(self.transitions, self.shifts)
        means, covariances = [], []
        for belief in self.beliefs:
            at = [int(np.flatnonzero(belief.parts == part)[0]) for part in last.parts]
            means.append(belief.means[at])
            covariances.append(belief.covariances[at])
        found = smooth(phi, noise, np.stack(means, axis=1) - moved, np.stack(covariances, axis=1))
        return [
            SumBelief(last.weights, found.means[:, k] + moved[k], found.covariances[:, k],
                      last.parts).moments
            for k in range(len(self.beliefs))
        ]  # fmt: skip


def _moved(transitions: list[Floats], shifts: list[Floats]) -> Floats:
    """Return where shifts alone lead from 0, (K, n)."""
    at, found = np.zeros_like(shifts[0]), []
    for k, (phi, shift) in enumerate(zip(transitions, shifts, strict=True)):
        at = phi @ at + shift if k else at
        found.append(at)
    return np.array(found)
