"""Proof by a mirrored path that a belief by the map alone is no chance.

Any path fits some streets of a large map for a while, one that lies on none of them, too. How well
a path like the measured one fits by chance is found by experiment: the same motion with left and
right exchanged has the same lengths, turns and errors, and lies on none of the roads. A second
belief, the *twin*, locates it on the same map. Where the motion lies on the roads, the log evidence
of the belief leaves that of the twin behind; where it does not, the two differ by chance alone,
either way.

On paths that fit badly the chance difference grows with the way. So either the belief also fits as
well as a path on its own roads usually does, no worse than the log number of places that it was
drawn from and the usual cost of each metre; or its lead has to grow with what the twin has lost.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import log, pi

from mapfilter.filters.contract import MotionStep
from mapfilter.options import NotNegative, Options
from mapfilter.positioning.bayes.rivals.alternative import MapBelief

_SAME_START_M = 20.0
"""A twin that starts at most this much later than its belief is as old as it."""


@dataclass(frozen=True, slots=True)
class MirrorRules(Options):
    """What a belief by the map alone must show before it converges.

    Parameters
    ----------
    least_lead : float
        Lead of its log evidence over that of the mirrored twin, in nats.
    lead_share : float
        What a belief that fits worse than usual must lead by in addition, as a share of the twin's
        negative log evidence.
    usual_nats_per_m : float
        Negative log-likelihood of a metre at the true position.
    margin_nats : float
        How much worse than the usual it may fit over the whole way.
    least_turned_rad : float
        Sum of bends before which no path is distinctive.
    """

    least_lead: float = 6.0
    lead_share: NotNegative = 0.4
    usual_nats_per_m: NotNegative = 0.03
    margin_nats: NotNegative = 4.0
    least_turned_rad: NotNegative = pi

    def proven(
        self, belief: MapBelief, twin: MirroredTwin | None, turned_rad: float, places: int
    ) -> bool:
        """Return whether a belief may converge.

        Parameters
        ----------
        belief : MapBelief
        twin : MirroredTwin or None
            None where there is none yet.
        turned_rad : float
            Sum of all bends of the path.
        places : int
            Number of points of the map that the belief was drawn from.
        """
        if twin is None or turned_rad < self.least_turned_rad:
            return False
        usual = -log(max(places, 1)) - self.usual_nats_per_m * belief.travelled_m
        fits = belief.log_evidence >= usual - self.margin_nats
        more = 0.0 if fits else -self.lead_share * twin.belief.log_evidence
        return twin.lead_of(belief) >= self.least_lead + more


@dataclass(frozen=True, eq=False)
class MirroredTwin:
    """A belief of the mirrored motion.

    Parameters
    ----------
    belief : MapBelief
    main_log_evidence : float
        Log evidence of the main belief when the twin was started.
    ahead_nats : float
        What the main belief was ahead by then: it had found its place already.
    """

    belief: MapBelief
    main_log_evidence: float
    ahead_nats: float = 0.0

    @classmethod
    def beside(cls, main: MapBelief, belief: MapBelief, places: int) -> MirroredTwin:
        """Return the twin of a main belief that goes on already.

        Finding one of ``places`` costs their log number in evidence. A main belief that is older
        may have paid it, so that much of its lead does not count.
        """
        ahead = log(max(places, 1)) if main.travelled_m > _SAME_START_M else 0.0
        return cls(belief, main.log_evidence, ahead)

    def lead_of(self, main: MapBelief) -> float:
        """Return the lead of the main belief's log evidence over the twin's, in nats."""
        gained = main.log_evidence - self.main_log_evidence
        return gained - self.belief.log_evidence - self.ahead_nats


def mirrored_step(step: MotionStep) -> MotionStep:
    """Return a step with left and right exchanged.

    Examples
    --------
    >>> step = mirrored_step(MotionStep(1.0, 0.5, 0.1))
    >>> step.step_m, step.heading_rad, step.turn_rad
    (1.0, -0.5, -0.1)
    """
    return replace(step, heading_rad=-step.heading_rad, turn_rad=-step.turn_rad)
