"""Beliefs that fixes contradict, which agree with each other and with the motion between them.

An alternative that is begun there reads headings as these fixes show: a compass may be askew from
the start, as of a phone in a holder, or have been turned unseen.
"""

from __future__ import annotations

from dataclasses import replace
from math import radians

from mapfilter.angles import wrap_one_rad
from mapfilter.positioning.bayes.rivals.alternative import AlternativeHypothesis
from mapfilter.positioning.bayes.rivals.hold import Hold
from mapfilter.positioning.bayes.state import BayesState
from mapfilter.positioning.gnss.trail import Contradiction

_MISREAD_RAD = radians(60.0)
"""Angle from which on an alternative that reads headings otherwise is begun anew."""


def hold_of_next(
    state: BayesState, step_unit_m: float, contradiction: Contradiction | None
) -> Hold:
    """Return how the next alternative reads headings and lengths.

    Parameters
    ----------
    state : BayesState
    step_unit_m : float
        Unit in which it reads lengths.
    contradiction : Contradiction or None
        Headings are as measured without one, and where it does not show their direction.
    """
    hold = Hold()
    if contradiction is not None and state.compass:
        if contradiction.is_turned:
            hold = state.hold.turned_by(contradiction.turned_rad)
        elif contradiction.has_direction:
            hold = state.hold
    return replace(hold, step_unit_m=step_unit_m)


def misreads(
    alternative: AlternativeHypothesis | None,
    state: BayesState,
    contradiction: Contradiction | None,
) -> bool:
    """Return whether an alternative that goes on reads headings otherwise than the fixes show."""
    if alternative is None or contradiction is None:
        return False
    if not (state.compass and (contradiction.is_turned or contradiction.has_direction)):
        return False
    own = alternative.hold
    wanted = hold_of_next(state, own.step_unit_m, contradiction)
    off_rad = wrap_one_rad(wanted.offset_rad - own.offset_rad)
    return wanted.sign != own.sign or abs(off_rad) > _MISREAD_RAD
