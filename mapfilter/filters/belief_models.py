"""What particle and grid filters ask of a model, and the hypotheses that it weighs."""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol, TypeVar

import numpy as np

from mapfilter._types import Floats, Floats32
from mapfilter.filters.contract import MotionStep, Reason
from mapfilter.filters.copies import Copies
from mapfilter.filters.hypotheses import BeliefSummary, Bins

PriorT = TypeVar("PriorT", contravariant=True)
ReadingT = TypeVar("ReadingT", contravariant=True)


class Cloud(NamedTuple):
    """Hypotheses as a model weighs them.

    Parameters
    ----------
    state : ndarray of float32, shape (R, N)
        The first two rows are east and north in the model's frame.
    kept : ndarray of float32, shape (W, N), or Copies of that shape
        What each hypothesis keeps besides, such as errors that are summed out; W may be 0.
    shared : object
        What all of them share.
    withheld : float
        Log evidence of the last reading that is not in the weights.
    """

    state: Floats32
    kept: Floats32 | Copies
    shared: Any = None
    withheld: float = 0.0


class WeighingModel(Protocol[ReadingT]):
    """Map and measurements, as particle and grid filters need them."""

    @property
    def bins(self) -> Bins:
        """The area, in bins."""

    def weigh(self, cloud: Cloud, log_weight: Floats, reading: ReadingT) -> tuple[Cloud, Reason]:
        """Add a reading's log-likelihood to the log weights, in place.

        Returns the hypotheses with what they keep afterwards, and why nothing was added, if so.
        """

    def can_converge(self, summary: BeliefSummary, reading: ReadingT) -> bool:
        """Return whether a belief may count as having converged, if it agrees on a place."""


class ParticleModel(WeighingModel[ReadingT], Protocol[PriorT, ReadingT]):
    """Motion, map and measurements, as a particle filter needs them."""

    def start(self, prior: PriorT, most: int, rng: np.random.Generator) -> tuple[Cloud, Floats]:
        """Return the first particles, and their log weights, shape (N,)."""

    def move(
        self, state: Floats32, log_weight: Floats, motion: MotionStep, key: np.uint64
    ) -> tuple[Floats32, Floats]:
        """Return particles and log weights after a step of finite length."""
