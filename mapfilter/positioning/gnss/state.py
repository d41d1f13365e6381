"""What is known of GNSS beside one belief: receiver, rejections and how precise fixes are."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import inf, isfinite, nan

from mapfilter.positioning.gnss.options import GnssOptions
from mapfilter.positioning.gnss.receiver import Receiver
from mapfilter.positioning.gnss.trail import FixTrail
from mapfilter.positioning.gnss.wander import FixWander

_MEMORY_M, _MOST_OF_ONE = 100.0, 0.05
"""Way over which the precision of fixes is followed, and the largest share of one of them."""
_MIN_MOVED_M, _MIN_ELAPSED_S = 0.1, 0.1
_SHOWN, _MOST = 1.2, 9.0
"""Times that squared distances are larger than stated from which on variances are raised; those of
a fix that is still usual, and the most by which variances are raised."""


@dataclass(frozen=True, eq=False)
class GnssState:
    """State of GNSS beside one belief.

    Parameters
    ----------
    receiver : Receiver or None
        Clock and height; None before the first pseudorange.
    fix_used_at_m, fix_used_at_s : float
        Distance travelled and time when a fix was last used.
    compared_at_m, compared_at_s : float
        Distance travelled and time at the last comparison.
    probation_until_s : float
        Nothing is used before.
    rejected_since_s : float
        Start of the present series of rejections; NaN outside one.
    distrusted : bool
        Readings have led away: they are not used until they have agreed for some way.
    agrees_from_m : float
        Distance travelled since which distrusted readings agree; NaN if they do not.
    trail : FixTrail
        The last fixes that were compared with the main belief.
    excess : float
        Times that the squared distances of fixes from the belief have been larger than their
        variances say, of late.
    wander : FixWander
        How far they have wandered beside dead reckoning.
    """

    receiver: Receiver | None = None
    fix_used_at_m: float = -inf
    fix_used_at_s: float = -inf
    compared_at_m: float = -inf
    compared_at_s: float = -inf
    probation_until_s: float = -inf
    rejected_since_s: float = nan
    distrusted: bool = False
    agrees_from_m: float = nan
    trail: FixTrail = field(default_factory=FixTrail)
    excess: float = 1.0
    wander: FixWander = field(default_factory=FixWander)

    def due(self, options: GnssOptions, time_s: float, travelled_m: float) -> bool:
        """Return whether to compare again where no radio report asks for it."""
        gone_m = travelled_m - self.compared_at_m
        return gone_m >= options.spacing_m or time_s - self.compared_at_s >= options.pause_s

    @property
    def used_at_m(self) -> float:
        """Distance travelled when a fix or pseudoranges were last used; -inf before any were."""
        ranges_m = -inf if self.receiver is None else self.receiver.used_at_m
        return max(self.fix_used_at_m, ranges_m)

    @property
    def met(self) -> bool:
        """Whether a fix or pseudoranges were there at all, used or not."""
        return self.receiver is not None or isfinite(self.compared_at_m)

    def was_used(self, time_s: float) -> bool:
        """Return whether a fix or pseudoranges of that time were compared, and not rejected."""
        return self.compared_at_s == time_s >= self.probation_until_s and not self.rejecting

    def on_trial(self, options: GnssOptions, travelled_m: float) -> GnssState:
        """Return the state after distrusted readings that agree; trusted after some way of them."""
        from_m = self.agrees_from_m if isfinite(self.agrees_from_m) else travelled_m
        if travelled_m - from_m < options.trial_m:
            return replace(self, agrees_from_m=from_m)
        return replace(self, distrusted=False, agrees_from_m=nan)

    @property
    def understated(self) -> float:
        """Times that variances of fixes are taken for larger than stated."""
        by_one = self.excess if self.excess >= _SHOWN else 1.0
        return max(by_one, self.wander.before.understated)

    def repeats(self, options: GnssOptions, time_s: float, travelled_m: float) -> float:
        """Return how many fixes like one now have the error of one: 1 where it is all new.

        The error lasts for some way, as that of reflections does, and for some time, as that of
        satellites and of the receiver's own filter does: a car has soon left the house that
        reflects, but not these.
        """
        gone_m = max(travelled_m - self.fix_used_at_m, _MIN_MOVED_M)
        elapsed_s = max(time_s - self.fix_used_at_s, _MIN_ELAPSED_S)
        return max(options.fix_memory_m / gone_m, options.fix_memory_s / elapsed_s, 1.0)

    def after_fix(self, squared: float, time_s: float, travelled_m: float) -> GnssState:
        """Return the state after a fix that is used.

        Fixes that are off more often than their deviations say are less precise than they state
        (innovation-based estimation; Mehra 1970).

        Parameters
        ----------
        squared : float
            Squared distance of the fix from the belief per component, in deviations of both.
        time_s, travelled_m : float
            Time and distance travelled by then.
        """
        new = min((travelled_m - self.fix_used_at_m) / _MEMORY_M, _MOST_OF_ONE)
        excess = self.excess + new * (min(squared, _MOST) - self.excess)
        return replace(
            self,
            fix_used_at_m=travelled_m,
            fix_used_at_s=time_s,
            rejected_since_s=nan,
            excess=excess,
        )

    @property
    def rejecting(self) -> bool:
        """Whether the last readings contradicted the belief, or are on trial since."""
        return isfinite(self.rejected_since_s)

    @property
    def contradicting(self) -> bool:
        """Whether the last readings contradicted the belief."""
        return self.rejecting and not isfinite(self.agrees_from_m)
