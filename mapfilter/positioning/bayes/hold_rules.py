"""Rules by which a phone is believed to be held otherwise."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from annotated_types import Ge

from mapfilter.options import NotNegative, Options, Positive, Probability


@dataclass(frozen=True, slots=True)
class HoldRules(Options):
    """When a phone may have been turned, and when that is believed.

    Log odds of such a belief are against the main one, with the log Bayes factor since.

    Parameters
    ----------
    watched : bool
        Whether jumps of headings are looked at.
    jump_deg : float
        Change of the heading from one row of a walk to the next that may be the phone's.
    around_deg : float
        Change from which on it is one right round, which is rare in walks.
    longest_row_m : float
        Longer rows may hold a corner, so their changes are no jumps.
    longest_pause_s : float
        Who stood for longer may have turned there, so the change over it is no jump.
    probability, around_probability : float
        That such a change, or one right round, is that of a phone being turned.
    mirrored_odds : float
        Odds of its being mirrored against its being turned.
    lost_log_odds : float
        Log odds from which on the main belief is LOST.
    lost_after_m : float
        Distance for which they last before it is: odds about that value come and go.
    win_log_odds : float
        Log odds from which on it is replaced.
    abandon_threshold : float
        Log Bayes factor at which the phone was not turned.
    abandon_after_m : float
        Distance after which that stays undecided,
    abandon_ahead_after_m : float
        and the same where it is likely enough for a LOST position.
    max_beliefs : int
        Largest number of beliefs at a time.
    particles : int
        Least number of hypotheses of each of them; twice as many where it is wide.
    """

    watched: bool = True
    jump_deg: Positive = 60.0
    around_deg: Positive = 150.0
    longest_row_m: Positive = 3.0
    longest_pause_s: Positive = 3.0
    probability: Probability = 0.006
    around_probability: Probability = 0.25
    mirrored_odds: Positive = 0.25
    lost_log_odds: float = -1.0
    lost_after_m: NotNegative = 7.0
    win_log_odds: float = 8.0
    abandon_threshold: float = -4.0
    abandon_after_m: NotNegative = 400.0
    abandon_ahead_after_m: NotNegative = 1200.0
    max_beliefs: Annotated[int, Ge(1)] = 6
    particles: Annotated[int, Ge(10)] = 1000
