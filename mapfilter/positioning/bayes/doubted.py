"""Readings that were used, and are reported as doubtful all the same."""

from __future__ import annotations

from collections.abc import Sequence

from mapfilter.filters.contract import Reason
from mapfilter.filters.particle import ParticleBelief
from mapfilter.positioning.bayes.beliefs.belief_filters import BeliefFilters
from mapfilter.positioning.bayes.rivals.held import HeldOtherwise
from mapfilter.positioning.bayes.rivals.hold import Hold
from mapfilter.positioning.bayes.state import BayesState
from mapfilter.positioning.epochs import Epoch
from mapfilter.positioning.step_output import UnusedReading


def doubted(
    beliefs: BeliefFilters,
    state: BayesState,
    before: Hold,
    epoch: Epoch,
    unused: Sequence[UnusedReading],
    *,
    moves: bool,
) -> list[UnusedReading]:
    """Return the motion, or the positions, of an epoch that the belief now contradicts.

    Parameters
    ----------
    beliefs : BeliefFilters
    state : BayesState
        After the epoch.
    before : Hold
        How the phone was held before it.
    epoch : Epoch
    unused : sequence of UnusedReading
        Those that are reported already.
    moves : bool
        Whether the epoch's motion was used.
    """
    other_unit = state.hold.step_unit_m != before.step_unit_m
    read_anew = state.hold != before and not other_unit
    taken_over = read_anew and not state.hold.is_as_measured
    if moves and state.contested and beliefs.may_have_left(state):
        return [_motion(epoch, Reason.MOTION_STUCK)]
    if state.contested and beliefs.is_pulled(state):
        return positions_in_doubt(epoch, unused)
    leading = _leading_elsewhere(state) if state.contested and not taken_over else None
    if leading is not None and leading.is_look:
        # Another place near by, by the same readings.
        return []
    if moves and (taken_over or (epoch.motion and state.contested)):
        # One that reads headings as the belief does is of a walk of which no step was counted.
        stuck = leading is not None and leading.hold == state.hold
        return [_motion(epoch, Reason.MOTION_STUCK if stuck else Reason.PHONE_TURNED)]
    return [_motion(epoch, Reason.OTHER_UNIT)] if other_unit else []


def _leading_elsewhere(state: BayesState) -> HeldOtherwise | None:
    """Return the likeliest of the rivals that lie elsewhere, positions apart."""
    main = state.belief
    if not isinstance(main, ParticleBelief):
        return None
    return next((one for one in state.held if one.is_elsewhere(main)), None)


def _motion(epoch: Epoch, why: Reason) -> UnusedReading:
    return UnusedReading(epoch.time_s, "motion", "", why)


def positions_in_doubt(epoch: Epoch, unused: Sequence[UnusedReading]) -> list[UnusedReading]:
    """Return the positions of an epoch as rejected, but for those that are unused already."""
    given = [("gnss", "")] if epoch.gnss is not None else []
    given += [("pseudorange", one.satellite) for one in epoch.pseudoranges]
    known = {(one.kind, one.what) for one in unused}
    why = Reason.REJECTED_BY_EVIDENCE
    return [UnusedReading(epoch.time_s, *one, why) for one in given if one not in known]
