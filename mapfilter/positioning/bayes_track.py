"""What the Bayes map filter knows after an epoch, and what is new."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import inf, nan

from mapfilter.filters.contract import Status
from mapfilter.positioning.challenger import Challenger, Doubt, MapBelief
from mapfilter.positioning.estimate import Fix, UnusedReading
from mapfilter.positioning.memory import Memory
from mapfilter.positioning.sky_memory import NO_SKY, SkyMemory


@dataclass(frozen=True, eq=False)
class BayesTrack:
    """What is known after an epoch.

    Parameters
    ----------
    memory : Memory
        Of dead reckoning and levels.
    belief : MapBelief or None
        None before the first report that can be placed.
    heading_rad : float
        Of the last step; without a compass counted from the first one.
    compass : bool
        Whether headings are a compass's.
    status : Status
    doubt : Doubt
    challenger : Challenger or None
        Beside a belief in doubt.
    wins : int
        How many challengers have taken over.
    sky : SkyMemory
        Of the belief.
    timed_at_m : (float, float)
        Distance travelled when timing advances and time differences were last used.
    """

    memory: Memory
    belief: MapBelief | None = None
    heading_rad: float = nan
    compass: bool = True
    status: Status = Status.SEARCHING
    doubt: Doubt = field(default_factory=Doubt)
    challenger: Challenger | None = None
    wins: int = 0
    sky: SkyMemory = NO_SKY
    timed_at_m: tuple[float, float] = (-inf, -inf)

    @property
    def leading(self) -> MapBelief | None:
        """The belief to go by: the challenger's where the first one is lost."""
        lost = self.status is Status.LOST and self.challenger is not None
        return self.challenger.belief if lost and self.challenger else self.belief


@dataclass(frozen=True, slots=True)
class News:
    """What one epoch brought.

    Parameters
    ----------
    fix : Fix
    evidence : tuple of float
        Runner-up's east, north and mass, entropy in bits, log evidence.
    unused : tuple of UnusedReading
    """

    fix: Fix
    evidence: tuple[float, float, float, float, float]
    unused: tuple[UnusedReading, ...]
