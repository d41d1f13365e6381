"""What a reading says of places, beyond radio: log-likelihoods that a belief is weighed by."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from mapfilter._types import Floats, Floats32


class PlaceEvidence(Protocol):
    """A log-likelihood over hypotheses."""

    def log_likelihood(self, state: Floats32) -> Floats:
        """Return it for each of the hypotheses, shape (N,), or one number for all of them."""


@dataclass(frozen=True, eq=False)
class Given:
    """A log-likelihood that is known already.

    Parameters
    ----------
    value : (N,) array or (1,) array
        For the hypotheses of the belief that it was made for, or one for all.
    """

    value: Floats

    def log_likelihood(self, state: Floats32) -> Floats:  # noqa: ARG002
        """Return it."""
        return self.value
