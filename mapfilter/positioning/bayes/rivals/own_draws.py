"""Random numbers of what lies beside the main belief, whose draws do not depend on it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum, unique
from functools import cached_property

import numpy as np

_MILLISECONDS, _SEEDS = 1000.0, 2**32


@unique
class Purpose(IntEnum):
    """What draws are for: each has a generator of its own in an epoch."""

    FORKED = 1
    """Beliefs in which the phone was turned, as they begin."""
    MOVED = 2
    """The same as they move."""
    WEIGHED = 3
    """The same as they are weighed."""
    AWAY = 4
    """Hypotheses that were carried on."""
    UNAIDED_BEGUN = 5
    """A belief without positions, as it begins."""
    UNAIDED_WEIGHED = 6
    """The same as it is weighed."""
    UNAIDED_MOVED = 7
    """The same as it moves."""
    ALONE = 8
    """A belief that begins from scratch, without positions."""
    AROUND = 9
    """One that begins about the place that a search has found."""


def own_rng(time_s: float, purpose: Purpose) -> np.random.Generator:
    """Return the generator of an epoch for a purpose."""
    return np.random.default_rng((purpose, round(_MILLISECONDS * abs(time_s)) % _SEEDS))


@dataclass(frozen=True)
class OwnDraws:
    """Generators of an epoch for what its motion changes beside the main belief.

    Each is made when it is first asked for, which few epochs do: it takes 10 µs.
    """

    time_s: float

    @cached_property
    def forking(self) -> np.random.Generator:
        """For beliefs that begin."""
        return own_rng(self.time_s, Purpose.FORKED)

    @cached_property
    def beginning(self) -> np.random.Generator:
        """For a belief without positions that begins."""
        return own_rng(self.time_s, Purpose.UNAIDED_BEGUN)

    @cached_property
    def unaided(self) -> np.random.Generator:
        """For one that moves."""
        return own_rng(self.time_s, Purpose.UNAIDED_MOVED)

    @cached_property
    def moving(self) -> np.random.Generator:
        """For beliefs that move."""
        return own_rng(self.time_s, Purpose.MOVED)

    @cached_property
    def carrying(self) -> np.random.Generator:
        """For hypotheses that were carried on."""
        return own_rng(self.time_s, Purpose.AWAY)
