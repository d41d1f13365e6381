"""A walk of which no step was counted: a rival of the belief that has rested meanwhile.

A step counter that has died for a while leaves a belief where it was, and short rests and dead
counters look alike. So where a rest has ended that levels have not shown, and one could have come
far, a smaller belief goes on beside the main one from where such a walk may have led, along the
ways that there are. Ways, levels and turns afterwards tell which of them is right, as they do of a
phone that was turned (:mod:`mapfilter.positioning.bayes.rivals.held`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import log
from typing import Any

import numpy as np

from mapfilter.filters.particle import ParticleBelief
from mapfilter.positioning.bayes.rivals.alternative import NullHypothesis
from mapfilter.positioning.bayes.rivals.held import HeldOtherwise, smaller
from mapfilter.positioning.bayes.rivals.hold import Hold
from mapfilter.positioning.bayes.rivals.hold_rules import RivalRules
from mapfilter.positioning.sensors.rest import Rest
from mapfilter.positioning.sensors.unmeasured import unmeasured_step


def walked_on(
    rules: RivalRules,
    belief: ParticleBelief,
    null: NullHypothesis,
    hold: Hold,
    rest: Rest,
    time_s: float,
    share: float,
    travelled_m: float,
    predict: Callable[..., Any],
    rng: np.random.Generator,
) -> HeldOtherwise:
    """Return the belief that has walked on, at the pace before, during a rest.

    Parameters
    ----------
    rules : RivalRules
    belief, null : ParticleBelief and NullHypothesis
        The main belief, and what speaks against it.
    hold : Hold
        How it reads headings.
    rest : Rest
        It has ended.
    time_s : float
        Now.
    share : float
        Probability of such a walk, by its levels.
    travelled_m : float
        By dead reckoning.
    predict : callable
        Moves a belief by a step.
    rng : numpy.random.Generator
        For the draws of this belief alone.
    """
    own, gone_s = smaller(rules, belief, 0.0, rng), time_s - rest.since_s
    step = replace(unmeasured_step(rest.missed_mps(gone_s), 0.0, gone_s), turned_sd_rad=0.0)
    moved = predict(own, step, rng)[0]
    # Where it has led is no evidence against it: nobody rests beside the ways.
    moved = replace(moved, log_weight=own.log_weight)
    # Nor is it one against the null hypothesis, which each metre costs something.
    gone_m = moved.travelled_m - own.travelled_m
    null = replace(null, travelled_m=null.travelled_m + gone_m)
    return HeldOtherwise(moved, hold, log(share / (1 - share)), travelled_m, null)
