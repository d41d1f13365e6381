"""A way that bends: a phone that was mirrored before shows it there.

Along an axis of the mirror nothing tells a mirrored phone. At the next corner the belief turns to
the wrong side. Where the heading jumps, a rival goes on to the other one, see
:mod:`mapfilter.positioning.bayes.rivals.held`; but who walks takes some seconds for a corner,
streets bend slowly, and who has stood may have turned meanwhile. So where the heading differs from
that of the last metres, such a rival begins, too. Bends are many, so the next one takes its place
unless something speaks for it.
"""

from __future__ import annotations

from math import atan2, cos, exp, isfinite, log, nan, radians, sin
from typing import NamedTuple

import numpy as np

from mapfilter.angles import wrap_one_rad
from mapfilter.filters.contract import MotionStep
from mapfilter.filters.particle import ParticleBelief
from mapfilter.positioning.bayes.rivals.alternative import NullHypothesis
from mapfilter.positioning.bayes.rivals.compared import SPEAKS_NATS
from mapfilter.positioning.bayes.rivals.held import HeldOtherwise, smaller
from mapfilter.positioning.bayes.rivals.hold import Hold
from mapfilter.positioning.bayes.rivals.hold_rules import HoldRules

_MEMORY_M = 12.0
"""Way after which a heading counts 1/e of the last one."""
_LEAST_M = 8.0
"""Way of which the direction before is that, at least."""


class Straight(NamedTuple):
    """The direction of the last metres, as headings were measured.

    Parameters
    ----------
    east_m, north_m : float
        Sum of their steps, the older the less.
    way_m : float
        Their length since the last bend.
    """

    east_m: float = 0.0
    north_m: float = 0.0
    way_m: float = 0.0

    @property
    def heading_rad(self) -> float:
        """That direction; NaN before some metres."""
        return atan2(self.north_m, self.east_m) if self.way_m >= _LEAST_M else nan

    def bends(self, step: MotionStep, rules: HoldRules) -> bool:
        """Return whether a step leads far from that direction.

        Examples
        --------
        >>> straight, rules = Straight(9.0, 0.0, 9.0), HoldRules(bend_deg=35.0)
        >>> straight.bends(MotionStep(1.0, 0.5), rules), straight.bends(MotionStep(1.0, 0.7), rules)
        (False, True)
        """
        apart_rad = step.heading_rad - self.heading_rad
        if not (rules.watched and step.step_m > 0 and isfinite(apart_rad)):
            return False
        return abs(wrap_one_rad(apart_rad)) > radians(rules.bend_deg)

    def after(self, step: MotionStep, unit_m: float = 1.0) -> Straight:
        """Return it with a step; one without a direction changes nothing.

        ``unit_m`` is the unit of its length.
        """
        length_m, heading_rad = unit_m * step.step_m, step.heading_rad
        if not (length_m > 0 and isfinite(heading_rad)):
            return self
        kept = exp(-length_m / _MEMORY_M)
        east_m = kept * self.east_m + length_m * cos(heading_rad)
        north_m = kept * self.north_m + length_m * sin(heading_rad)
        return Straight(east_m, north_m, self.way_m + length_m)


NO_DIRECTION = Straight()
"""That of a way that has just begun."""


def mirrored_before(
    rules: HoldRules,
    belief: ParticleBelief,
    null: NullHypothesis,
    hold: Hold,
    straight_rad: float,
    travelled_m: float,
    white_rad: float,
    rng: np.random.Generator,
) -> HeldOtherwise:
    """Return the belief in which the phone was mirrored before a bend; parameters as of ``forked``.

    ``straight_rad`` is the direction before it, as measured.
    """
    probability = rules.probability
    log_prior = log(probability / (1 - probability)) + log(rules.mirrored_odds)
    own = smaller(rules, belief, white_rad, rng)
    mirrored = hold.mirrored_at(straight_rad)
    return HeldOtherwise(own, mirrored, log_prior, travelled_m, null, at_bend=True)


def without_earlier(
    held: tuple[HeldOtherwise, ...], main: ParticleBelief
) -> tuple[HeldOtherwise, ...]:
    """Return the rivals without those of earlier bends for which nothing speaks."""
    return tuple(
        one for one in held if not one.at_bend or one.log_bayes_factor(main) >= SPEAKS_NATS
    )
