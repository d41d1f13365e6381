"""A phone that is held otherwise from one step to the next: turned, or its axes mapped anew.

A compass heading that jumps between two rows of a walk has two explanations: the walker turned
there, or walks on and the phone was turned. The belief follows the first; beside it, smaller
beliefs follow the second, with the same readings: one for a phone that was *turned* (all further
headings are off by the jump) and one for a phone whose headings are *mirrored* from there on. The
difference of their log evidence, with the odds of such an event, decides: where one of these is
ahead, the position is LOST; where it is clearly ahead, it takes over, and headings are read as it
reads them. Walks without a jump have no such beliefs.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import hypot, isfinite, log, radians

import numpy as np

from mapfilter.filters.contract import MotionStep, Status
from mapfilter.filters.hypotheses import NEAR_M
from mapfilter.filters.particle import ParticleBelief
from mapfilter.geodesy import wrap_rad
from mapfilter.models.street_motion import BIAS
from mapfilter.options import NotNegative, Options, Positive, Probability, Share
from mapfilter.positioning.bayes.alternative import NullHypothesis

_USUAL_RAD = radians(30.0)


@dataclass(frozen=True, slots=True)
class HoldRules(Options):
    """When a phone may have been turned, and when that is believed.

    Parameters
    ----------
    jump_deg : float
        Change of the heading from one row of a walk to the next that may be the phone's.
    around_deg : float
        Change from which on it is as good as a turn right round, which is rare in walks.
    longest_row_m : float
        Longer rows may hold a corner, so their changes are no jumps.
    probability, around_probability : float
        That such a change, or one right round, is the phone's.
    mirrored_odds : float
        Odds of a phone being mirrored against being turned.
    lost_odds : float
        Log odds against the belief from which on it is LOST.
    win_odds : float
        Log odds from which on the belief is replaced.
    abandon_threshold : float
        Log Bayes factor at which the phone was not turned.
    abandon_after_m : float
        Distance after which an undecided one is dropped.
    particles : int
        Of each.
    """

    jump_deg: Positive = 60.0
    around_deg: Positive = 150.0
    longest_row_m: Positive = 3.0
    probability: Share = 0.006
    around_probability: Probability = 0.25
    mirrored_odds: Positive = 0.25
    lost_odds: float = 1.0
    win_odds: float = 4.0
    abandon_threshold: float = -4.0
    abandon_after_m: NotNegative = 400.0
    most: int = 4
    particles: int = 1000


@dataclass(frozen=True, slots=True)
class Hold:
    """How headings are read: their sign, and what is added to them."""

    sign: float = 1.0
    offset_rad: float = 0.0

    def read(self, step: MotionStep) -> MotionStep:
        """Return a step with the direction that its heading stands for."""
        if (self.sign == 1.0 and self.offset_rad == 0.0) or not isfinite(step.heading_rad):
            return step
        return replace(
            step, heading_rad=self.direction_rad(step.heading_rad), turn_rad=self.sign * step.turn_rad
        )

    @property
    def is_usual(self) -> bool:
        """Whether headings are read nearly as they are."""
        return self.sign > 0 and abs(self.offset_rad) < _USUAL_RAD

    def direction_rad(self, heading_rad: float) -> float:
        """Return the direction that a heading stands for."""
        return float(wrap_rad(self.sign * heading_rad + self.offset_rad))


@dataclass(frozen=True, eq=False)
class HeldOtherwise:
    """A belief with a phone that is held otherwise since a jump of its heading.

    Parameters
    ----------
    belief : ParticleBelief
    hold : Hold
        How it reads headings.
    log_prior : float
        Log odds of the phone having been turned.
    start_m : float
        Distance travelled at the jump.
    main_log_evidence : float
        Log evidence of both beliefs there.
    null : NullHypothesis
        Beside this belief.
    """

    belief: ParticleBelief
    hold: Hold
    log_prior: float
    start_m: float
    main_log_evidence: float
    null: NullHypothesis = field(default_factory=NullHypothesis)

    def log_odds(self, main: ParticleBelief) -> float:
        """Return the log odds against the main belief."""
        return self.log_prior + self.belief.log_evidence - main.log_evidence


def holds_after(hold: Hold, before_rad: float, after_rad: float) -> tuple[Hold, ...]:
    """Return the ways to read headings if a walk went straight on where they jumped.

    Parameters
    ----------
    before_rad, after_rad : float
        Headings as measured, before and after the jump.
    """
    ahead_rad, sign = hold.direction_rad(before_rad), hold.sign
    turned = Hold(sign, float(wrap_rad(ahead_rad - sign * after_rad)))
    mirrored = Hold(-sign, float(wrap_rad(ahead_rad + sign * after_rad)))
    return turned, mirrored


def jump_rad(before_rad: float, step: MotionStep, rules: HoldRules) -> float:
    """Return by how much the heading of a row jumps; 0 where that is no jump."""
    if not (isfinite(before_rad) and isfinite(step.heading_rad)):
        return 0.0
    if not 0 < abs(step.step_m) <= rules.longest_row_m:
        return 0.0
    jump = abs(float(wrap_rad(step.heading_rad - before_rad)))
    return jump if jump > radians(rules.jump_deg) else 0.0


def forked(
    belief: ParticleBelief,
    null: NullHypothesis,
    hold: Hold,
    before_rad: float,
    after_rad: float,
    travelled_m: float,
    white_rad: float,
    rules: HoldRules,
    rng: np.random.Generator,
) -> list[HeldOtherwise]:
    """Return the beliefs in which the phone was turned where its heading jumped."""
    jump = abs(float(wrap_rad(after_rad - before_rad)))
    around = jump > radians(rules.around_deg)
    holds = holds_after(hold, before_rad, after_rad)
    found = []
    for one in holds:
        likely = around or (hold != Hold() and one.is_usual)
        p = rules.around_probability if likely else rules.probability
        times = rules.mirrored_odds if one.sign != hold.sign else 1.0
        log_prior = log(times * p / (1 - p)) if 0 < p < 1 else -np.inf
        count = min(rules.particles, belief.log_weight.size)
        chosen = rng.choice(belief.log_weight.size, count, p=_shares(belief))
        state = belief.state[:, chosen].copy()
        # The two headings at the jump have white noise, which is in the new offset.
        noise = rng.standard_normal(count) * (2**0.5 * white_rad)
        state[BIAS] = wrap_rad(state[BIAS] + noise).astype(np.float32)
        own = replace(
            belief,
            state=state,
            log_weight=np.full(count, -log(count)),
            kept=belief.kept[:, chosen],
        )
        found.append(HeldOtherwise(own, one, log_prior, travelled_m, belief.log_evidence, null))
    return found


def _shares(belief: ParticleBelief) -> np.ndarray:
    weight = np.exp(belief.log_weight - belief.log_weight.max())
    return weight / weight.sum()


def still_open(
    others: tuple[HeldOtherwise, ...],
    main: ParticleBelief,
    travelled_m: float,
    rules: HoldRules,
) -> tuple[HeldOtherwise, ...]:
    """Return the beliefs that are not refuted, too old, or where the main one is."""
    found = []
    for one in others:
        gone_m = travelled_m - one.start_m
        gained = one.log_odds(main) - one.log_prior
        if gained <= rules.abandon_threshold or gone_m >= rules.abandon_after_m:
            continue
        found.append(one)
    found.sort(key=lambda one: -one.log_odds(main))
    return tuple(found[: rules.most])


def apart_m(one: HeldOtherwise, main: ParticleBelief) -> float:
    """Return how far the positions of two beliefs are apart."""
    mine, other = one.belief.summary.mean, main.summary.mean
    return hypot(float(mine[0] - other[0]), float(mine[1] - other[1]))


def contested(others: tuple[HeldOtherwise, ...], main: ParticleBelief, rules: HoldRules) -> bool:
    """Return whether a belief elsewhere is ahead."""
    return any(
        one.log_odds(main) > rules.lost_odds and apart_m(one, main) > NEAR_M for one in others
    )


def winner(
    others: tuple[HeldOtherwise, ...],
    main: ParticleBelief,
    rules: HoldRules,
    most_null_log_odds: float,
) -> HeldOtherwise | None:
    """Return the belief that takes over; the null hypothesis must be improbable beside it."""
    best = max(others, key=lambda one: one.log_odds(main), default=None)
    if best is None or best.log_odds(main) < rules.win_odds:
        return None
    agrees = best.null.log_odds <= most_null_log_odds
    return best if agrees and best.belief.status is Status.TRACKING else None
