"""How often the walker of a journey turns round, and what a jump right round then means.

Where a heading jumps by half a circle, either the walker has turned round or the phone was turned.
Some walkers hardly ever turn round, others, as tourists and those who walk a dog, each minute. So
the rate at which one does is taken for exponentially distributed beforehand. Each half turn that
was the walker's then raises its expectation by as much as that was at first (gamma-Poisson), and
after *n* of them the odds that the next one is the phone's are the usual ones divided by 1 + *n*.

Whose a half turn was is told by its rival (:mod:`mapfilter.positioning.bayes.rivals.held`), by
their odds; while it is open, by those of now. A search has no rivals: there the hypotheses tell.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from math import exp

import numpy as np

from mapfilter.filters.particle import ParticleBelief
from mapfilter.models.street_motion import is_turned
from mapfilter.positioning.bayes.rivals.held import HeldOtherwise
from mapfilter.positioning.bayes.rivals.hold_rules import HoldRules

_LARGEST = 700.0


@dataclass(frozen=True, slots=True)
class HalfTurns:
    """Half turns of a journey that were the walker's.

    Parameters
    ----------
    walkers : float
        Expected number of those whose rival has been given up, or that a search has told.
    searched : int
        Number of all since the belief began to search, if it still does.
    """

    walkers: float = 0.0
    searched: int = 0

    def rules(self, usual: HoldRules) -> HoldRules:
        """Return the rules for the next half turn.

        In a search they are for hypotheses whose phone has not been turned.

        Examples
        --------
        >>> usual = HoldRules(around_probability=0.25)
        >>> [f"{HalfTurns(n).rules(usual).around_probability:.2f}" for n in (0.0, 1.0, 2.0)]
        ['0.25', '0.14', '0.10']
        """
        known = self.walkers + self.searched
        if not known:
            return usual
        odds = usual.around_probability / (1 - usual.around_probability) / (1 + known)
        return replace(usual, around_probability=odds / (1 + odds))

    def back_probability(self, usual: HoldRules) -> float:
        """Return the probability of the phone at the next half turn, if one in a search was its.

        It is turned back then, which is likely.
        """
        others = replace(self, searched=max(self.searched - 1, 0)).rules(usual)
        odds = usual.back_odds * others.around_probability / (1 - others.around_probability)
        return odds / (1 + odds)

    def in_search(self) -> HalfTurns:
        """Return the numbers with a half turn while the belief searches."""
        return replace(self, searched=self.searched + 1)

    def anew(self) -> HalfTurns:
        """Return the numbers for a belief that begins anew: it cannot tell what was before."""
        return replace(self, searched=0)

    def found(self, belief: ParticleBelief) -> HalfTurns:
        """Return the numbers once a search has found a place: one was the phone's if it is turned.

        Parameters
        ----------
        belief : ParticleBelief
        """
        if not self.searched:
            return self
        turned = float(np.dot(belief.weight, is_turned(belief.state)))
        return HalfTurns(self.walkers + self.searched - turned)

    def with_jumps(self, some: Iterable[HeldOtherwise], main: ParticleBelief) -> HalfTurns:
        """Return the numbers with further half turns, each by the odds of its rival.

        Parameters
        ----------
        some : iterable of HeldOtherwise
            Rivals; those that began at other jumps, or mirrored, are left out.
        main : ParticleBelief
        """
        odds = (one.log_odds(main) for one in some if one.tells_half_turn)
        more = sum(1 / (1 + exp(min(log_odds, _LARGEST))) for log_odds in odds)
        return replace(self, walkers=self.walkers + more)

    def with_refuted(self, refuted: Iterable[HeldOtherwise]) -> HalfTurns:
        """Return the numbers with the half turns of rivals that nothing speaks for any more."""
        more = sum(one.tells_half_turn for one in refuted)
        return replace(self, walkers=self.walkers + more) if more else self

    def after(
        self, before: Sequence[HeldOtherwise], kept: Sequence[HeldOtherwise], main: ParticleBelief
    ) -> HalfTurns:
        """Return the numbers with the half turns of rivals that are given up.

        Parameters
        ----------
        before, kept : sequence of HeldOtherwise
            Rivals of the main belief, and those of them that go on beside it.
        main : ParticleBelief
        """
        if len(before) == len(kept):
            return self
        own = {(one.start_m, one.hold) for one in kept}
        return self.with_jumps((x for x in before if (x.start_m, x.hold) not in own), main)
