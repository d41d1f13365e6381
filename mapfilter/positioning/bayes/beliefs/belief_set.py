"""The main belief and those that are tested against it, moved by the same steps."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from mapfilter.filters.contract import MotionStep, Reason, Status
from mapfilter.filters.particle import ParticleBelief
from mapfilter.positioning.bayes.beliefs.belief_changes import (
    assumed,
    counted_from,
    moved_as_read,
    remounted,
    turned_at_jump,
)
from mapfilter.positioning.bayes.beliefs.belief_filters import BeliefFilters
from mapfilter.positioning.bayes.rivals.alternative import AlternativeHypothesis, MapBelief
from mapfilter.positioning.bayes.rivals.bends import mirrored_before, without_earlier
from mapfilter.positioning.bayes.rivals.compared import still_open
from mapfilter.positioning.bayes.rivals.half_turns import HalfTurns
from mapfilter.positioning.bayes.rivals.held import HeldOtherwise, forked
from mapfilter.positioning.bayes.rivals.mirrored import MirroredTwin, mirrored_step
from mapfilter.positioning.bayes.rivals.own_draws import OwnDraws
from mapfilter.positioning.bayes.state import BayesState


@dataclass(frozen=True, slots=True, eq=False)
class BeliefSet:
    """The main belief and those beside it.

    Parameters
    ----------
    main : MapBelief or None
    alternative : AlternativeHypothesis or None
    twin : MirroredTwin or None
    held : tuple of HeldOtherwise
    half_turns : HalfTurns
    unaided : tuple of HeldOtherwise
        All as of :class:`~mapfilter.positioning.bayes.state.BayesState`.
    """

    main: MapBelief | None
    alternative: AlternativeHypothesis | None
    twin: MirroredTwin | None
    held: tuple[HeldOtherwise, ...]
    half_turns: HalfTurns
    unaided: tuple[HeldOtherwise, ...]

    @classmethod
    def of(cls, state: BayesState) -> BeliefSet:
        """Return the beliefs of a state."""
        return cls(
            state.belief, state.alternative, state.twin,
            state.held, state.half_turns, state.unaided,
        )  # fmt: skip

    def by_step(
        self,
        filters: BeliefFilters,
        state: BayesState,
        measured: MotionStep,
        own: OwnDraws,
        rng: np.random.Generator,
        *,
        compass: bool,
    ) -> tuple[BeliefSet, Reason]:
        """Move all beliefs by a step, each as it reads it.

        Parameters
        ----------
        filters : BeliefFilters
            Filters of single beliefs.
        state : BayesState
            Before the epoch's motion.
        measured : MotionStep
        own : OwnDraws
            For the beliefs beside the main one.
        rng : numpy.random.Generator
        compass : bool
            Whether headings are those of a compass.

        Returns
        -------
        beliefs : BeliefSet
        why : Reason
            Whether the main belief used the step.
        """
        assert self.main is not None, "steps move a belief"
        predict = filters.moving_filter(state, compass=compass).predict
        held = tuple(moved_as_read(one, predict, measured, own.moving) for one in self.held)
        unaided = tuple(moved_as_read(one, predict, measured, own.unaided) for one in self.unaided)
        step = state.hold.read(measured)
        main, why = predict(self.main, assumed(step, self.main), rng)
        main = remounted(main, filters.model.motion, abs(step.step_m), rng)
        alternative, twin = self.alternative, self.twin
        if alternative is not None:
            other, as_read = alternative.belief, alternative.hold.read(measured)
            other, _ = predict(other, assumed(as_read, other), rng)
            alternative = replace(alternative, belief=other)
        if twin is not None:
            other, _ = predict(twin.belief, assumed(mirrored_step(step), twin.belief), rng)
            twin = replace(twin, belief=other)
        return BeliefSet(main, alternative, twin, held, self.half_turns, unaided), why

    def counted_from(self, heading_rad: float) -> BeliefSet:
        """Count what followed the ways from the first heading of a compass."""
        assert self.main is not None, "there is one to count"
        alternative = self.alternative
        if alternative is not None:
            other = counted_from(alternative.belief, heading_rad)
            alternative = replace(alternative, belief=other)
        main = counted_from(self.main, heading_rad)
        return replace(self, main=main, alternative=alternative)

    def at_jump(
        self,
        filters: BeliefFilters,
        state: BayesState,
        headings_rad: tuple[float, float],
        travelled_m: float,
        own: OwnDraws,
        *,
        positioned: bool,
    ) -> BeliefSet:
        """Begin beliefs in which the phone was turned where its heading jumps.

        A search takes them into itself.

        Parameters
        ----------
        filters : BeliefFilters
            Filters of single beliefs, and the rules of turned phones.
        state : BayesState
            Before the epoch's motion.
        headings_rad : tuple of float
            As measured, before and after the jump.
        travelled_m : float
            By dead reckoning.
        own : OwnDraws
        positioned : bool
            Whether the epoch has a position or satellites, which a search follows instead.
        """
        main = self.main
        if main is not None and main.status is Status.SEARCHING:
            return self if positioned else self._turned_in_search(filters, state, headings_rad, own)
        tracked = main is not None and state.status is main.status is Status.TRACKING
        if not (tracked and isinstance(main, ParticleBelief)):
            return self
        rules, white_rad = filters.holds, filters.model.motion.white_rad
        turns = self.half_turns.found(main)
        # What is still open tells something, too.
        around = turns.with_jumps(self.held, main).rules(rules).around_probability
        by = rules, main, state.null, state.hold, headings_rad, travelled_m, white_rad, own.forking
        beside = (*self.held, *forked(*by, around_probability=around))
        held = still_open(rules, beside, main, travelled_m)
        return replace(self, held=held, half_turns=turns.after(beside, held, main))

    def at_bend(
        self,
        filters: BeliefFilters,
        state: BayesState,
        straight_rad: float,
        travelled_m: float,
        own: OwnDraws,
    ) -> BeliefSet:
        """Begin a belief in which the phone was mirrored before a bend; as of :meth:`at_jump`.

        ``straight_rad`` is the direction before it, as measured.
        """
        main = self.main
        tracked = main is not None and state.status is main.status is Status.TRACKING
        rules, white_rad = filters.holds, filters.model.motion.white_rad
        if not (tracked and isinstance(main, ParticleBelief)):
            return self
        by = rules, main, state.null, state.hold, straight_rad, travelled_m, white_rad
        beside = (*without_earlier(self.held, main), mirrored_before(*by, own.forking))
        held = still_open(rules, beside, main, travelled_m)
        return replace(self, held=held, half_turns=self.half_turns.after(beside, held, main))

    def _turned_in_search(
        self,
        filters: BeliefFilters,
        state: BayesState,
        headings_rad: tuple[float, float],
        own: OwnDraws,
    ) -> BeliefSet:
        """Turn the phone of some hypotheses of a search; parameters as of :meth:`at_jump`."""
        assert self.main is not None, "it searches"
        before_rad, after_rad = headings_rad
        changed_rad = state.hold.sign * (after_rad - before_rad)
        usual, before, turns, back = filters.holds, self.half_turns, self.half_turns, None
        if usual.is_around(changed_rad):
            turns = before.in_search()
            if before.searched and filters.model.motion.tells_turned:
                back = before.back_probability(usual)
        rules = before.rules(usual)
        main = turned_at_jump(self.main, rules, changed_rad, own.forking, back_probability=back)
        return replace(self, main=main, half_turns=turns)
