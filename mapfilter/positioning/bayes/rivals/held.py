"""A phone that is held otherwise from one step to the next: turned, or its axes mapped anew.

A compass heading that jumps between two rows of a walk has two explanations: the walker turned
there, or walks straight on and the phone was turned. The belief follows the first. Beside it,
smaller beliefs follow the second, weighed by the same readings: one for a phone that was *turned*,
so that all further headings are off by the jump, one for a phone whose headings are *mirrored*
from there on, and one for a phone that was mirrored before, along an axis of the mirror, where the
walker has turned to the other side. The difference of their log evidence, with the odds of such an
event, decides: while one of them is ahead elsewhere, the position is LOST; when it is far ahead, it
takes over, and headings are read as it reads them. Slow corners have the last of them, too
(:mod:`mapfilter.positioning.bayes.rivals.bends`). While the belief searches, some of its own
hypotheses have a turned phone instead
(:func:`mapfilter.positioning.bayes.beliefs.belief_changes.turned_at_jump`).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import hypot, isfinite, log, nan, radians

import numpy as np

from mapfilter.angles import wrap_one_rad, wrap_rad
from mapfilter.filters.contract import MotionStep
from mapfilter.filters.copies import copies_of
from mapfilter.filters.hypotheses import NEAR_M
from mapfilter.filters.particle import ParticleBelief
from mapfilter.models.street_motion import BIAS, STATES
from mapfilter.positioning.bayes.rivals.alternative import NullHypothesis
from mapfilter.positioning.bayes.rivals.hold import Hold
from mapfilter.positioning.bayes.rivals.hold_rules import HoldRules, RivalRules


@dataclass(frozen=True, eq=False)
class HeldOtherwise:
    """A rival: a belief with a phone that is held otherwise, or one that takes no positions.

    Parameters
    ----------
    belief : ParticleBelief
        Its log evidence begins with that of the main belief.
    hold : Hold
        How it reads headings.
    log_prior : float
        Log odds of what it assumes, beforehand.
    start_m : float
        Distance travelled at the jump of the heading, or at its start.
    null : NullHypothesis
        Beside this belief.
    ahead_m : float
        Distance travelled since which it is likely enough, and elsewhere; NaN if not.
    from_scratch : bool
        It began with one report alone, and not as the main belief.
    tells_half_turn : bool
        It began at a jump right round, as one of a turned phone: what becomes of it tells whether
        the walker has turned round.
    at_bend : bool
        It began at a bend of the way, as one of a phone that was mirrored before.
    near_at_start : float
        Of one that looks for another place near by, its share within 50 m of the main belief at its
        start; NaN of others.
    """

    belief: ParticleBelief
    hold: Hold
    log_prior: float
    start_m: float
    null: NullHypothesis = field(default_factory=NullHypothesis)
    ahead_m: float = nan
    from_scratch: bool = False
    tells_half_turn: bool = False
    at_bend: bool = False
    near_at_start: float = nan

    @property
    def is_look(self) -> bool:
        """Whether it looks for another place near by."""
        return isfinite(self.near_at_start)

    def log_bayes_factor(self, main: ParticleBelief) -> float:
        """Return the logarithm of the Bayes factor against the main belief."""
        return self.belief.log_evidence - main.log_evidence

    def log_odds(self, main: ParticleBelief) -> float:
        """Return the log odds against the main belief."""
        return self.log_prior + self.log_bayes_factor(main)

    def is_elsewhere(self, main: ParticleBelief) -> bool:
        """Return whether its position is another one."""
        own, other = self.belief.summary.mean, main.summary.mean
        return hypot(own[0] - other[0], own[1] - other[1]) > NEAR_M


def jumps(before_rad: float, step: MotionStep, rules: HoldRules, unit_m: float = 1.0) -> bool:
    """Return whether the heading of a row is far from that of the row before.

    Parameters
    ----------
    before_rad : float
        Heading of the row before, as measured; NaN where there is none.
    step : MotionStep
        The row, as measured.
    rules : HoldRules
    unit_m : float
        Unit of its length.
    """
    if not (rules.watched and isfinite(before_rad) and isfinite(step.heading_rad)):
        return False
    changed = abs(wrap_one_rad(step.heading_rad - before_rad))
    return 0 < unit_m * step.step_m <= rules.longest_row_m and changed > radians(rules.jump_deg)


def forked(
    rules: HoldRules,
    belief: ParticleBelief,
    null: NullHypothesis,
    hold: Hold,
    headings_rad: tuple[float, float],
    travelled_m: float,
    white_rad: float,
    rng: np.random.Generator,
    *,
    around_probability: float | None = None,
) -> tuple[HeldOtherwise, ...]:
    """Return the beliefs in which the phone was turned, or mirrored, where its heading jumped.

    Parameters
    ----------
    rules : HoldRules
    belief, null : ParticleBelief and NullHypothesis
        The main belief before the jump, and what speaks against it.
    hold : Hold
        How it reads headings.
    headings_rad : tuple of float
        As measured, before and after the jump.
    travelled_m : float
        By dead reckoning.
    white_rad : float
        White noise of a heading, which is in the jump twice.
    rng : numpy.random.Generator
        For the draws of these beliefs alone.
    around_probability : float, optional
        That a change right round is the phone's; by default that of the rules.
    """
    before_rad, after_rad = headings_rad
    around = rules.is_around(after_rad - before_rad)
    at_half_turn = rules.around_probability if around_probability is None else around_probability
    found = []
    ways: tuple[Hold, ...] = hold.straight_on(before_rad, after_rad)
    if not around:
        # It may have been mirrored before, and this is the corner that shows it.
        ways = (*ways, hold.mirrored_at(before_rad))
    for one in ways:
        # Who has turned a phone is likely to turn it back.
        back = one.is_usual and not hold.is_usual
        probability = rules.around_probability if back else rules.probability
        probability = at_half_turn if around else probability
        log_prior = log(probability / (1 - probability))
        log_prior += log(rules.mirrored_odds) if one.sign != hold.sign else 0.0
        own = smaller(rules, belief, white_rad, rng)
        tells = around and one.sign == hold.sign
        rival = HeldOtherwise(own, one, log_prior, travelled_m, null, tells_half_turn=tells)
        found.append(rival)
    return tuple(found)


def as_measured(
    rules: HoldRules,
    belief: ParticleBelief,
    null: NullHypothesis,
    hold: Hold,
    travelled_m: float,
    white_rad: float,
    rng: np.random.Generator,
) -> HeldOtherwise:
    """Return the belief in which headings are as measured; parameters as of :func:`forked`."""
    log_prior = log(rules.around_probability / (1 - rules.around_probability))
    own = smaller(rules, belief, white_rad, rng)
    plain = Hold(step_unit_m=hold.step_unit_m)
    return HeldOtherwise(own, plain, log_prior, travelled_m, null)


def smaller(
    rules: RivalRules, belief: ParticleBelief, white_rad: float, rng: np.random.Generator
) -> ParticleBelief:
    """Return fewer hypotheses of a belief, with the white noise of two headings.

    Parameters as of :func:`forked`.
    """
    share = np.exp(belief.log_weight - belief.log_weight.max())
    count = min(rules.particles, share.size)
    chosen = rng.choice(share.size, count, p=share / share.sum())
    # A satellite receiver stays with the main belief, and so do the rows of its errors.
    state = belief.state[:STATES, chosen].copy()
    state[BIAS] = wrap_rad(state[BIAS] + 2**0.5 * white_rad * rng.standard_normal(count))
    log_weight = np.full(count, -log(count))
    kept = copies_of(belief.kept_unread, chosen.astype(np.int32))
    return replace(belief, state=state, log_weight=log_weight, kept=kept)
