"""What a belief keeps of satellites from one epoch to the next."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isfinite, nan

from mapfilter.positioning.gnss.options import GnssOptions
from mapfilter.positioning.gnss.receiver import Receiver


@dataclass(frozen=True, eq=False)
class GnssState:
    """What a belief keeps of satellites.

    Parameters
    ----------
    receiver : Receiver or None
        Clock and height; None before the first pseudorange.
    fix_at_m : float
        Distance travelled when a fix was last used.
    heard_at_m, heard_at_s : float
        Distance travelled, and time, when satellites or fixes were last listened to.
    until_s : float
        Nothing is used before.
    since_s : float
        Since when all is rejected; NaN where it is not.
    """

    receiver: Receiver | None = None
    fix_at_m: float = -inf
    heard_at_m: float = -inf
    heard_at_s: float = -inf
    until_s: float = -inf
    since_s: float = nan

    def due(self, options: GnssOptions, time_s: float, travelled_m: float) -> bool:
        """Tell whether it is time to listen again, if nothing else is heard."""
        gone_m = travelled_m - self.heard_at_m
        return gone_m >= options.spacing_m or time_s - self.heard_at_s >= options.pause_s

    @property
    def rejects(self) -> bool:
        """Whether what satellites told last went against the belief."""
        return isfinite(self.since_s)


NO_GNSS_STATE = GnssState()
"""Nothing heard yet."""
