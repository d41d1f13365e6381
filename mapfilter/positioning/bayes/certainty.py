"""How certain a tracked position is, with all that competes with its belief.

The share of a belief near its leading hypothesis is a probability given that the belief describes
what is measured at all. Beside it stand beliefs in which the phone was turned, one that takes no
positions, and an alternative from scratch, each with its odds against the belief. The share of all
of them together within 50 m is the probability that the position is right. With too low a
probability a position is reported but not claimed. The null hypothesis has no position, and
statuses of its own. A position that was lost without a new search, or was not certain enough, is
claimed again when it has agreed for some way.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import exp, hypot, inf, isfinite, nan

from mapfilter._same import EqualByValue
from mapfilter.filters.hypotheses import NEAR_M
from mapfilter.filters.particle import ParticleBelief
from mapfilter.positioning.bayes.rivals.alternative import (
    AlternativeHypothesis,
    AlternativeRules,
    MapBelief,
)
from mapfilter.positioning.bayes.rivals.held import HeldOtherwise
from mapfilter.positioning.bayes.rivals.nearby import misplaced_log_odds, share_near

_NEGLIGIBLE, _CERTAIN = -9.0, 30.0
"""Log odds below which a rival is not looked at; bound above which they make no difference."""


@dataclass(frozen=True, slots=True, eq=False)
class Recovery(EqualByValue):
    """Way over which a position has agreed since it was last not to be claimed.

    Parameters
    ----------
    agrees_from_m : float
        Distance travelled since which the belief agrees; NaN if it does not. For what is uncertain
        it is that of the last doubt.
    lost : bool
        Whether it was lost without a new search, and not just uncertain.
    """

    agrees_from_m: float = nan
    lost: bool = True

    def after(self, travelled_m: float, hold_m: float, *, agrees: bool) -> Recovery | None:
        """Return it after a reading; None where the belief has agreed for ``hold_m``.

        Examples
        --------
        >>> Recovery().after(100.0, 20.0, agrees=True)
        Recovery(agrees_from_m=100.0, lost=True)
        >>> Recovery(100.0).after(120.0, 20.0, agrees=True) is None
        True
        """
        if not agrees:
            return Recovery() if self.lost else Recovery(travelled_m, lost=False)
        from_m = self.agrees_from_m if isfinite(self.agrees_from_m) else travelled_m
        return None if travelled_m - from_m >= hold_m else Recovery(from_m, self.lost)


def certainty(
    rules: AlternativeRules,
    main: MapBelief,
    alternative: AlternativeHypothesis | None = None,
    rivals: Iterable[HeldOtherwise] = (),
    enough: float = inf,
    by_fixes: float = -inf,
) -> float:
    """Return the probability that the position lies within 50 m of a belief's leading hypothesis.

    Parameters
    ----------
    rules : AlternativeRules
        An alternative has prior odds that its threshold for taking over makes even, but at fixes.
    main : MapBelief
    alternative : AlternativeHypothesis or None
    rivals : iterable of HeldOtherwise
        Beliefs in which the phone was turned, and the one without positions.
    enough : float
        Where even a bound from below is so large, that is returned: where rivals lie takes longer
        than how probable they are.
    by_fixes : float
        Log odds beforehand of an alternative at fixes that contradict the belief; -inf without such
        fixes. Where that makes it more probable, they replace the threshold's, and the fixes' own
        part of its lead.
    """
    near, total = main.summary.mass_50m, 1.0
    if alternative is not None:
        lead = alternative.log_bayes_factor(main)
        log_odds = lead - rules.lost_threshold
        if isfinite(by_fixes):
            log_odds = max(log_odds, by_fixes + lead - alternative.gnss_log_bayes_factor)
        if log_odds > _NEGLIGIBLE and is_elsewhere(alternative, main):
            total += exp(min(log_odds, _CERTAIN))
    likely: list[tuple[float, ParticleBelief]] = []
    if isinstance(main, ParticleBelief):
        rivals = list(rivals)
        total += sum(
            exp(min(misplaced_log_odds(one, main), _CERTAIN)) for one in rivals if one.is_look
        )
        by_log_odds = ((one.log_odds(main), one.belief) for one in rivals if not one.is_look)
        likely = [(exp(min(k, _CERTAIN)), one) for k, one in by_log_odds if k > _NEGLIGIBLE]
        total += sum(odds for odds, _ in likely)
    if near / total >= enough:
        return near / total
    return (near + sum(odds * share_near(one, main) for odds, one in likely)) / total


def is_elsewhere(alternative: AlternativeHypothesis, main: MapBelief) -> bool:
    """Return whether the leading hypotheses lie farther than 50 m apart."""
    own, mean = alternative.belief.summary.mean, main.summary.mean
    return hypot(own[0] - mean[0], own[1] - mean[1]) > NEAR_M
