"""Whether beliefs may wait at an epoch, as nothing is read of them: its steps are part of a leg."""

from __future__ import annotations

from collections.abc import Callable
from math import isfinite, nan

from mapfilter.filters.contract import Reason, Status
from mapfilter.filters.particle import ParticleBelief
from mapfilter.positioning.bayes.beliefs.belief_filters import BeliefFilters
from mapfilter.positioning.bayes.sources.evidence import EvidenceUpdate
from mapfilter.positioning.bayes.sources.radio import RadioSource
from mapfilter.positioning.bayes.sources.usable import UsableEpoch
from mapfilter.positioning.bayes.state import BayesState
from mapfilter.positioning.epochs import Epoch


def waits(
    beliefs: BeliefFilters, radio: RadioSource, state: BayesState, usable: UsableEpoch
) -> Callable[[float], bool] | None:
    """Return whether beliefs may wait, by the distance travelled after an epoch's motion.

    None where they may not, however far that is.

    They wait while all motion is measured, nothing but cells and levels comes, and neither a rival
    nor a silence or a rest puts the position in doubt.

    Parameters
    ----------
    beliefs : BeliefFilters
    radio : RadioSource
        What tells whether a report of the epoch is due.
    state : BayesState
        Before the epoch.
    usable : UsableEpoch
        What is usable of it, and the sensors after it.
    """
    if beliefs.map_may_start or not _may_wait(beliefs, state, usable):
        return None
    used, has_report = state.sources[radio.name], bool(usable.epoch.radio)
    return lambda travelled_m: not (has_report and radio.due(used, travelled_m))


def report_alone(
    radio: RadioSource, state: BayesState, epoch: Epoch
) -> list[EvidenceUpdate] | None:
    """Return the evidence of an epoch at which beliefs wait: why its report is not used.

    None where it has rows of other kinds, of which their sources tell.
    """
    if epoch.gnss is not None or epoch.pseudoranges or epoch.tdoa:
        return None
    return [radio.read(state.sources[radio.name], state.reckoning, epoch, nan)]


def _may_wait(beliefs: BeliefFilters, state: BayesState, usable: UsableEpoch) -> bool:
    """Return whether beliefs may wait, unless a report of the epoch is due."""
    if not isinstance(state.belief, ParticleBelief) or state.contested:
        return False
    known = state.reported
    judged = known is None or known.belief is state.belief
    if state.status is Status.CONVERGED or not judged:
        # The status is that of one epoch, or not of this belief.
        return False
    if usable.motion is not Reason.USED or _measures(usable.epoch):
        return False
    if beliefs.is_contested(state):
        return False
    before, after = state.watch, usable.watch
    in_doubt = after.rode_unheard or after.is_unheard(state.hold.step_unit_m)
    if after.rest is not None:
        # How certain a rest is changes with its time and its levels.
        told = beliefs.left_share(state, before) == 0 and beliefs.left_share(state, after) == 0
        return told and not (in_doubt or after.rest.is_doubtful)
    return before.rest is None and not in_doubt


def _measures(epoch: Epoch) -> bool:
    """Return whether an epoch measures something else than motion, cells and levels."""
    if epoch.gnss is not None:
        return True
    values = [row.timing_advance for row in epoch.radio]
    values += [one.pseudorange_m for one in epoch.pseudoranges]
    values += [one.difference_m for one in epoch.tdoa]
    return any(map(isfinite, values))
