"""What a belief keeps of satellites from one epoch to the next."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isfinite, nan

from mapfilter.positioning.receiver import Receiver


@dataclass(frozen=True, eq=False)
class SkyMemory:
    """What a belief keeps of satellites.

    Parameters
    ----------
    receiver : Receiver or None
        Clock and height; None before the first pseudorange.
    fix_at_m : float
        Distance travelled when a fix was last used.
    until_s : float
        Nothing is used before.
    since_s : float
        Since when all is rejected; NaN where it is not.
    """

    receiver: Receiver | None = None
    fix_at_m: float = -inf
    until_s: float = -inf
    since_s: float = nan

    @property
    def rejects(self) -> bool:
        """Whether what satellites told last went against the belief."""
        return isfinite(self.since_s)


NO_SKY = SkyMemory()
"""Nothing heard yet."""
