"""Rules by which a rival of the belief is believed: a turned phone, or positions pulled away."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import log, radians
from typing import Annotated

from annotated_types import Ge

from mapfilter.angles import wrap_one_rad
from mapfilter.options import NotNegative, Options, Positive, Probability


@dataclass(frozen=True, slots=True)
class RivalRules(Options):
    """When a belief that began as the main one is believed in its place.

    Log odds are against the main belief, with the log Bayes factor since.

    Parameters
    ----------
    watched : bool
        Whether there are such beliefs.
    probability : float
        Of what the rival assumes, beforehand.
    lost_log_odds : float
        Log odds from which on the main belief is LOST.
    lost_after_m : float
        Distance for which they last before it is: odds about that value come and go.
    win_log_odds : float
        Log odds from which on it is replaced.
    abandon_threshold : float
        Log Bayes factor at which a rival is refuted.
    abandon_after_m : float
        Distance after which one that stays undecided is given up,
    abandon_ahead_after_m : float
        and the same where it is likely enough for a LOST position.
    max_beliefs : int
        Largest number of beliefs at a time.
    particles : int
        Least number of hypotheses of each of them; twice as many where it is wide.
    """

    watched: bool = True
    probability: Probability = 0.006
    lost_log_odds: float = -1.0
    lost_after_m: NotNegative = 7.0
    win_log_odds: float = 8.0
    abandon_threshold: float = -4.0
    abandon_after_m: NotNegative = 400.0
    abandon_ahead_after_m: NotNegative = 1200.0
    max_beliefs: Annotated[int, Ge(1)] = 6
    particles: Annotated[int, Ge(10)] = 1000


@dataclass(frozen=True, slots=True)
class HoldRules(RivalRules):
    """When a phone may have been turned, and when that is believed.

    Parameters
    ----------
    jump_deg : float
        Change of the heading from one row of a walk to the next that may be the phone's.
    around_deg : float
        Change from which on it is one right round, which is rare in walks.
    bend_deg : float
        Difference of a heading from the direction of the last metres that is a bend, at which a
        phone may turn out to have been mirrored.
    longest_row_m : float
        Longer rows may hold a corner, so their changes are no jumps.
    longest_pause_s : float
        Who stood for longer may have turned there, so the change over it is no jump.
    around_probability : float
        That a change right round is that of a phone being turned, of a walker who has not turned
        round before; ``probability`` is of others.
    back_odds : float
        Odds of its being turned back, where it is turned, against its being turned, where it is
        not; for hypotheses of a search.
    mirrored_odds : float
        Odds of its being mirrored against its being turned.
    misplaced_probability : float
        That a search has converged to another place than the right one, which is near.
    misplaced_sd_m : float
        Deviation of the right place from that, to either side.
    confirm_mass : float
        Share of one that looks for it, within 50 m of the main belief, at which it has found none.
    """

    jump_deg: Positive = 60.0
    around_deg: Positive = 150.0
    bend_deg: Positive = 35.0
    longest_row_m: Positive = 3.0
    longest_pause_s: Positive = 3.0
    around_probability: Probability = 0.25
    back_odds: Positive = 4.0
    mirrored_odds: Positive = 0.25
    misplaced_probability: Probability = 0.02
    misplaced_sd_m: Positive = 100.0
    confirm_mass: Probability = 0.95

    def is_around(self, changed_rad: float) -> bool:
        """Return whether a change of the heading is one right round."""
        return abs(wrap_one_rad(changed_rad)) > radians(self.around_deg)


@dataclass(frozen=True, slots=True)
class PullRules(RivalRules):
    """When positions may lead away from where the phone is, and when that is believed.

    A rival without positions is undecided for longer: who leads away slowly takes minutes.

    Parameters
    ----------
    search_threshold : float
        Log Bayes factor at which one that began with a report alone is refuted: to find a place
        costs it what the others know.
    """

    probability: Probability = 1e-4
    abandon_after_m: NotNegative = 1200.0
    max_beliefs: Annotated[int, Ge(1)] = 1
    search_threshold: float = -25.0

    @property
    def log_prior(self) -> float:
        """Log odds of positions that lead away, beforehand."""
        return log(self.probability / (1 - self.probability))

    def of(self, *, from_scratch: bool) -> RivalRules:
        """Return the rules of a rival by how it began."""
        return replace(self, abandon_threshold=self.search_threshold) if from_scratch else self
