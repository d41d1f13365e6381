"""Noticing that a belief is wrong, and finding the way again without throwing a right one away.

Each reading has a log probability under the belief, and one that it should have on average if the
belief is right. What is missing adds up, less a slack (the CUSUM of Page, 1954): that is the doubt.
When it is large a *challenger* starts from scratch beside the belief. Both then predict the same
readings, and the difference of their log evidence is the logarithm of the Bayes factor between
"one is where I thought" and "one is anywhere". The belief is LOST when the challenger is ahead, and
is replaced only once the challenger has converged; it is confirmed when both are at one place.
A belief that still searches is in doubt when the true place has died out of it: it does not
converge, and a challenger that is ahead goes on in its place.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from math import exp, hypot, nan

from mapfilter.filters.contract import Status
from mapfilter.filters.grid import GridBelief
from mapfilter.filters.hypotheses import NEAR_M
from mapfilter.filters.particle import ParticleBelief
from mapfilter.positioning.sky_memory import NO_SKY, SkyMemory

MapBelief = ParticleBelief | GridBelief

_USUAL, _LEAST_USUAL, _MOST_USUAL = 0.8, 0.5, 2.0
_SLACK = 1.5
_LEARNT_OVER_M = 300.0


@dataclass(frozen=True, slots=True)
class ChallengeRules:
    """When a challenger starts, wins and gives up.

    Parameters
    ----------
    doubt, doubt_of_cells : float
        Missing log probability at which it starts; and where only serving cells are told.
    ahead : float
        Log Bayes factor from which the belief is LOST, and may be replaced.
    confirmed_mass : float
        The belief is confirmed when so much of the challenger lies within 50 m of a place that is
        at most 50 m away.
    give_up : float
        A challenger that is so far behind gives up,
    give_up_m : float
        or one that has neither won nor lost after so many metres.
    converge_below : float
        No belief converges while the doubt is larger.
    """

    doubt: float = 5.0
    doubt_of_cells: float = 2.5
    ahead: float = 4.0
    confirmed_mass: float = 0.9
    give_up: float = -25.0
    give_up_m: float = 800.0
    converge_below: float = 2.5


@dataclass(frozen=True, eq=False)
class Challenger:
    """A second belief, from scratch.

    Parameters
    ----------
    belief : MapBelief
    began_at_m : float
        Distance travelled when it started.
    against : float
        Log evidence of the first belief then.
    began_s : float
        Time when it started.
    sky : SkyMemory
    by_satellites : float
        What satellites add to the logarithm of the Bayes factor; bounded, as all of them may be
        faulty.
    """

    belief: MapBelief
    began_at_m: float
    against: float
    began_s: float = nan
    sky: SkyMemory = NO_SKY
    by_satellites: float = 0.0

    def ahead(self, main: MapBelief) -> float:
        """Return the logarithm of the Bayes factor in its favour."""
        by_radio = self.belief.log_evidence - (main.log_evidence - self.against)
        return by_radio + self.by_satellites


class Verdict(Enum):
    """What became of a challenge so far."""

    OPEN = "open"
    AHEAD = "ahead"
    WON = "won"
    CONFIRMED = "confirmed"
    GAVE_UP = "gave up"


def judge(
    rules: ChallengeRules, main: MapBelief, challenger: Challenger, travelled_m: float
) -> Verdict:
    """Compare a belief and its challenger after both have seen the same readings."""
    ahead, other = challenger.ahead(main), challenger.belief.summary
    said = main.summary
    apart_m = hypot(other.mean[0] - said.mean[0], other.mean[1] - said.mean[1])
    if apart_m <= NEAR_M and other.mass_50m >= rules.confirmed_mass:
        return Verdict.CONFIRMED
    if ahead >= rules.ahead:
        converged = challenger.belief.status in (Status.CONVERGED, Status.TRACKING)
        return Verdict.WON if converged else Verdict.AHEAD
    gone_m = travelled_m - challenger.began_at_m
    if ahead <= rules.give_up or gone_m >= rules.give_up_m:
        return Verdict.GAVE_UP
    return Verdict.OPEN


@dataclass(frozen=True, slots=True)
class Doubt:
    """How much less probable readings were than they should have been.

    Parameters
    ----------
    sum : float
        Missing log probability.
    usual : float
        Log probability of a reading as a multiple of what the model expects; learnt slowly,
        because no network's errors are quite those of the model.
    """

    sum: float = 0.0
    usual: float = _USUAL

    def after(self, expected: float, gained: float, length_m: float) -> Doubt:
        """Take one reading in.

        Parameters
        ----------
        expected, gained : float
            Log probability of the reading that the model expects on average, and what it has.
        length_m : float
            Travelled since the last one.
        """
        if expected >= 0:
            return self
        total = max(0.0, self.sum + _SLACK * self.usual * expected - gained)
        # What is learnt while in doubt would make a wrong belief usual.
        share = 0.0 if total > 0 else 1.0 - exp(-length_m / _LEARNT_OVER_M)
        ratio = min(max(gained / expected, _LEAST_USUAL), _MOST_USUAL)
        return Doubt(total, self.usual + share * (ratio - self.usual))

    def none(self) -> Doubt:
        """Return no doubt, with what was learnt."""
        return replace(self, sum=0.0)
