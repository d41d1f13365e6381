"""Changes of single beliefs: hypotheses carried on after a rest, phones turned, steps as read."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import sqrt
from typing import Any

import numpy as np

from mapfilter._changes import changed
from mapfilter.angles import wrap_rad
from mapfilter.filters.contract import MotionStep, Status
from mapfilter.filters.grid import GridBelief
from mapfilter.filters.particle import ParticleBelief
from mapfilter.models.street_motion import BIAS, NORTH, MotionErrors, is_turned
from mapfilter.models.street_motion import remounted as remounted_states
from mapfilter.positioning.bayes.rivals.alternative import MapBelief
from mapfilter.positioning.bayes.rivals.held import HeldOtherwise
from mapfilter.positioning.bayes.rivals.hold_rules import HoldRules
from mapfilter.positioning.sensors.rest import Rest
from mapfilter.positioning.sensors.unmeasured import spread_m2


def carried_on(belief: MapBelief, rest: Rest, gone_s: float, rng: np.random.Generator) -> MapBelief:
    """Move some hypotheses to where they may be by now, once steps are counted as before.

    ``rest`` was the rest, ``gone_s`` the time without steps, or with few. A rest whose levels were
    in doubt may have been a way, a stroll a longer one.
    """
    if not isinstance(belief, ParticleBelief):
        return belief
    count = belief.log_weight.size
    gone = rng.random(count) < rest.left_probability
    far_m = sqrt(spread_m2(rest.missed_mps(gone_s), gone_s) / 2)
    moved = belief.state.copy()
    moved[: NORTH + 1, gone] += far_m * rng.standard_normal((NORTH + 1, int(gone.sum())))
    return replace(belief, state=moved)


def turned_at_jump(
    belief: MapBelief,
    rules: HoldRules,
    changed_rad: float,
    rng: np.random.Generator,
    *,
    back_probability: float | None = None,
) -> MapBelief:
    """Turn the phone of some hypotheses of a search where its heading jumped.

    They walk straight on; the others have turned a corner there.

    Parameters
    ----------
    belief : MapBelief
        Before the step; one on a grid is returned as it is.
    rules : HoldRules
    changed_rad : float
        Change of the direction that headings stand for, from the row before.
    rng : numpy.random.Generator
    back_probability : float, optional
        That a change right round is the phone's, of hypotheses in which it is turned; by default as
        of the others.
    """
    if isinstance(belief, GridBelief):
        return belief
    around = rules.is_around(changed_rad)
    probability = np.full(belief.log_weight.size, rules.probability)
    if around:
        probability[:] = rules.around_probability
        if back_probability is not None:
            probability[is_turned(belief.state)] = back_probability
    chosen = rng.random(belief.log_weight.size) < probability
    state = belief.state.copy()
    state[BIAS, chosen] = wrap_rad(state[BIAS, chosen] - changed_rad)
    return replace(belief, state=state)


def counted_from(belief: MapBelief, heading_rad: float) -> MapBelief:
    """Return a belief whose courses are errors of a heading, the first one that is measured."""
    if not isinstance(belief, ParticleBelief):
        return belief
    state = belief.state.copy()
    state[BIAS] = wrap_rad(state[BIAS] - np.float32(heading_rad))
    return replace(belief, state=state)


def remounted(
    belief: MapBelief, motion: MotionErrors, length_m: float, rng: np.random.Generator
) -> MapBelief:
    """Turn the phone of some hypotheses, once a position is tracked.

    A search would find more places that fit.
    """
    if isinstance(belief, GridBelief) or belief.status is not Status.TRACKING:
        return belief
    if not (length_m > 0 and motion.remounts_per_m > 0):
        return belief
    state = remounted_states(belief.state, length_m, motion, rng)
    return belief if state is belief.state else replace(belief, state=state)


def moved_as_read(
    one: HeldOtherwise, predict: Callable[..., Any], measured: MotionStep, rng: np.random.Generator
) -> HeldOtherwise:
    """Return a belief beside the main one, moved by a step as it reads it."""
    as_read = one.hold.read(measured)
    return changed(one, belief=predict(one.belief, assumed(as_read, one.belief), rng)[0])


def assumed(step: MotionStep, belief: MapBelief) -> MotionStep:
    """Return a step with the errors that a belief assumes: that of its sampling once it is tracked.

    With it a belief that still searches would be too wide to be in one place for some way.
    """
    if step.sampling_sd_m == 0 or belief.status is Status.TRACKING:
        return step
    return replace(step, sampling_sd_m=0.0)
