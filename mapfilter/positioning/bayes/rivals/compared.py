"""Rivals of a belief compared with it: which stay, which is ahead, and which takes over.

Each is weighed by the same readings as the main belief, so that the difference of their log
evidence, with the odds of what it assumes, decides.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import isfinite, nan

from mapfilter._changes import changed
from mapfilter.filters.contract import Status
from mapfilter.filters.particle import ParticleBelief
from mapfilter.positioning.bayes.rivals.held import HeldOtherwise
from mapfilter.positioning.bayes.rivals.hold_rules import RivalRules

SPEAKS_NATS = 0.3
"""Log Bayes factor from which on something speaks for a rival that began at a bend."""
_BEND_M, _BEND_NATS = 200.0, -2.0
"""Distance after which one that nothing speaks for is given up, and log Bayes factor at which it is
refuted: bends are many, and to either side of one beliefs come apart soon."""
_LOOK_NATS, _LOOK_WINS_NATS = -25.0, 4.0
"""Log Bayes factors at which one that looks for another place is refuted, and takes over: it has
to learn anew what the main belief knows of levels and steps."""


def still_open(
    rules: RivalRules, held: Sequence[HeldOtherwise], main: ParticleBelief, travelled_m: float
) -> tuple[HeldOtherwise, ...]:
    """Return the beliefs that are neither refuted nor undecided for too long, most likely first.

    One that is likely enough for a LOST position, elsewhere, is undecided for longer.

    Parameters
    ----------
    rules : RivalRules
    held : sequence of HeldOtherwise
        Rivals of ``main``, weighed by the same readings.
    main : ParticleBelief
    travelled_m : float
        Distance travelled by now, by dead reckoning.
    """
    kept = [
        one
        for one in held
        if one.log_bayes_factor(main) > _refuted_at(rules, one)
        and travelled_m - one.start_m < _undecided_m(rules, one, main)
    ]
    kept.sort(key=lambda one: -one.log_odds(main))
    return tuple(_compared(rules, one, main, travelled_m) for one in kept[: rules.max_beliefs])


def _refuted_at(rules: RivalRules, one: HeldOtherwise) -> float:
    """Return the log Bayes factor at which a belief is refuted."""
    if one.is_look:
        return _LOOK_NATS
    return max(rules.abandon_threshold, _BEND_NATS) if one.at_bend else rules.abandon_threshold


def _undecided_m(rules: RivalRules, one: HeldOtherwise, main: ParticleBelief) -> float:
    """Return the distance for which a belief may stay undecided."""
    if _leads(rules, one, main) or (one.is_look and one.is_elsewhere(main)):
        return max(rules.abandon_after_m, rules.abandon_ahead_after_m)
    waits = not one.at_bend or one.log_bayes_factor(main) >= SPEAKS_NATS
    return rules.abandon_after_m if waits else min(rules.abandon_after_m, _BEND_M)


def _compared(
    rules: RivalRules, one: HeldOtherwise, main: ParticleBelief, travelled_m: float
) -> HeldOtherwise:
    """Return a belief with the distance since which it is likely enough."""
    if not _leads(rules, one, main):
        return changed(one, ahead_m=nan)
    return one if isfinite(one.ahead_m) else changed(one, ahead_m=travelled_m)


def is_ahead(
    rules: RivalRules, held: Sequence[HeldOtherwise], main: ParticleBelief, travelled_m: float
) -> bool:
    """Return whether one of the beliefs is likely enough, and elsewhere, for some way."""
    return any(
        travelled_m - one.ahead_m >= rules.lost_after_m and _leads(rules, one, main) for one in held
    )


def _leads(rules: RivalRules, one: HeldOtherwise, main: ParticleBelief) -> bool:
    """Return whether a belief is likely enough against the main one, and elsewhere."""
    return one.log_odds(main) > rules.lost_log_odds and one.is_elsewhere(main)


def winner(
    rules: RivalRules,
    held: Sequence[HeldOtherwise],
    main: ParticleBelief,
    max_null_log_odds: float,
) -> HeldOtherwise | None:
    """Return the belief that takes over: tracked, most likely, far ahead, and not in doubt.

    Parameters
    ----------
    rules : RivalRules
    held : sequence of HeldOtherwise
        Rivals of ``main``, weighed by the same readings.
    main : ParticleBelief
    max_null_log_odds : float
        Largest log odds of the null hypothesis beside it.
    """
    able = (
        one
        for one in held
        if _wins(rules, one, main)
        and one.belief.status is Status.TRACKING
        and one.null.log_odds <= max_null_log_odds
    )
    return max(able, key=lambda one: one.log_odds(main), default=None)


def _wins(rules: RivalRules, one: HeldOtherwise, main: ParticleBelief) -> bool:
    if one.is_look:
        return one.log_bayes_factor(main) >= _LOOK_WINS_NATS and one.is_elsewhere(main)
    return one.log_odds(main) >= rules.win_log_odds


def after_takeover(held: Sequence[HeldOtherwise], best: HeldOtherwise) -> tuple[HeldOtherwise, ...]:
    """Return the others, with odds against the one that has taken over; none is ahead of it yet.

    Those of the same jump no longer tell a half turn: whoever it is, the phone was moved there. One
    of a bend has odds as others have, so it is not given up sooner.
    """
    gained = best.log_prior
    return tuple(
        replace(
            one,
            log_prior=one.log_prior - gained,
            ahead_m=nan,
            at_bend=False,
            tells_half_turn=one.tells_half_turn and one.start_m != best.start_m,
        )
        for one in held
        if one is not best
    )
