"""What follows for a belief when it is compared with its alternative: a table of transitions.

After each reading, the alternative has one outcome, and a table gives what follows. Searching or
found is the status of the belief that was there first:

===============  =========  ================  =========  =======  ===========
Outcome          Belief     Goes on, as       Reported   Null     Alternative
===============  =========  ================  =========  =======  ===========
none, undecided  any        belief            its own    kept     kept
confirmed        any        belief            its own    reset    dropped
abandoned        any        belief            its own    reset    dropped
ahead            searching  other, SEARCHING  SEARCHING  other's  took over
ahead            found      belief            LOST       kept     kept
ahead, suspect   searching  other, SEARCHING  SEARCHING  other's  took over
ahead, suspect   found      other, SEARCHING  LOST       other's  took over
won              searching  other, CONVERGED  CONVERGED  other's  took over
won              found      other, TRACKING   TRACKING   other's  took over
===============  =========  ================  =========  =======  ===========

Then, by the status reported before: ``LOST`` stays while the belief searches and becomes
``TRACKING`` when it converges; ``CONVERGED`` lasts for one epoch. A belief that had converged and
has less than half of it in one place is ``LOST`` and searches again; one that is there with less
than the probability of a claim, rivals included, is ``UNCERTAIN``, and so is one that was, or was
``LOST`` without a new search, until it has agreed for some way. While the null hypothesis is more
probable than the belief, one that had converged is ``LOST``, too, and ``OUTSIDE`` where it lies at
the edge of the area; one that searches is ``OUTSIDE``, and so is one that has left the area. A
belief does not converge while the null hypothesis is not improbable or the alternative close
behind, as the true position may have died out of it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from enum import Enum
from math import hypot, nan
from typing import Literal, NamedTuple

from mapfilter.filters.contract import Status
from mapfilter.filters.hypotheses import NEAR_M
from mapfilter.positioning.bayes.rivals.alternative import (
    AlternativeHypothesis,
    AlternativeRules,
    MapBelief,
    NullHypothesis,
)


class Outcome(Enum):
    """Outcome of the test of an alternative against a belief; the module's docstring has more."""

    UNDECIDED = "undecided"
    CONFIRMED = "confirmed"
    ABANDONED = "abandoned"
    AHEAD = "ahead"
    SUSPECT = "ahead, suspect"
    WON = "won"


class Transition(NamedTuple):
    """Row of the table.

    ``takes_over`` is the status of the alternative where it replaces the belief, else None.
    ``reported`` is the status to report; None for that of the belief. ``null`` is kept, reset or
    the other's; ``keeps`` is whether the alternative stays beside the belief.
    """

    takes_over: Status | None
    reported: Status | None
    null: Literal["kept", "reset", "other's"]
    keeps: bool


_SEARCHING, _CONVERGED = Status.SEARCHING, Status.CONVERGED
_TRACKING, _LOST, _OUTSIDE = Status.TRACKING, Status.LOST, Status.OUTSIDE

TRANSITIONS: Mapping[tuple[Outcome, bool], Transition] = {
    # Outcome, and whether the belief is still searching.
    (Outcome.UNDECIDED, True): Transition(None, None, "kept", True),
    (Outcome.UNDECIDED, False): Transition(None, None, "kept", True),
    (Outcome.CONFIRMED, True): Transition(None, None, "reset", False),
    (Outcome.CONFIRMED, False): Transition(None, None, "reset", False),
    (Outcome.ABANDONED, True): Transition(None, None, "reset", False),
    (Outcome.ABANDONED, False): Transition(None, None, "reset", False),
    (Outcome.AHEAD, True): Transition(_SEARCHING, _SEARCHING, "other's", False),
    (Outcome.AHEAD, False): Transition(None, _LOST, "kept", True),
    (Outcome.SUSPECT, True): Transition(_SEARCHING, _SEARCHING, "other's", False),
    (Outcome.SUSPECT, False): Transition(_SEARCHING, _LOST, "other's", False),
    (Outcome.WON, True): Transition(_CONVERGED, _CONVERGED, "other's", False),
    (Outcome.WON, False): Transition(_TRACKING, _TRACKING, "other's", False),
}

REPORTED: Mapping[tuple[Status, Status], Status] = {
    # Status reported before, and found now; others are reported as found.
    (_LOST, _SEARCHING): _LOST,
    (_TRACKING, _SEARCHING): _LOST,
    (_CONVERGED, _SEARCHING): _LOST,
    (_LOST, _CONVERGED): _TRACKING,
    (_CONVERGED, _CONVERGED): _TRACKING,
}


class Resolution(NamedTuple):
    """Belief, status and alternative after one reading."""

    belief: MapBelief
    status: Status
    null: NullHypothesis
    alternative: AlternativeHypothesis | None = None
    taken_over: bool = False


def resolve_alternative(
    rules: AlternativeRules,
    before: Status,
    main: MapBelief,
    null: NullHypothesis,
    alternative: AlternativeHypothesis | None,
    travelled_m: float,
    *,
    at_edge: bool,
    gone: bool = False,
) -> Resolution:
    """Apply the table after a belief and its alternative were weighed by the same reading.

    ``before`` is the status reported at the last epoch; ``at_edge`` whether the belief lies at the
    edge of the area, ``gone`` whether most of it lies beyond.
    """
    if main.status is _CONVERGED and doubted(rules, main, null, alternative):
        main = replace(main, status=_SEARCHING)
    outcome = Outcome.UNDECIDED
    if alternative is not None:
        outcome = judge(rules, main, alternative, travelled_m)
    row = TRANSITIONS[outcome, main.status is _SEARCHING]
    belief, taken_over = main, row.takes_over is not None
    if row.null == "reset":
        null = null.reset()
    if row.takes_over and alternative:
        belief = replace(alternative.belief, status=row.takes_over)
        if row.takes_over is _SEARCHING:
            belief = replace(belief, agreement_start_m=nan)
        if row.null == "other's":
            null = alternative.null
    found = row.reported or belief.status
    belief, status = report(before, belief, found)
    status = _OUTSIDE if gone else under_null(rules, before, status, null, at_edge=at_edge)
    return Resolution(belief, status, null, alternative if row.keeps else None, taken_over)


def under_null(
    rules: AlternativeRules, before: Status, found: Status, null: NullHypothesis, *, at_edge: bool
) -> Status:
    """Return the status to report where the null hypothesis may be more probable."""
    was = before in (_LOST, _OUTSIDE)
    if null.log_odds <= (rules.converge_log_odds if was else 0.0):
        return found
    if found is _SEARCHING or before is _OUTSIDE or at_edge:
        return _OUTSIDE
    return _LOST


def doubted(
    rules: AlternativeRules,
    main: MapBelief,
    null: NullHypothesis,
    alternative: AlternativeHypothesis | None,
) -> bool:
    """Return whether the null hypothesis or an alternative is too probable to converge."""
    if null.log_odds > rules.converge_log_odds:
        return True
    ahead = -rules.converge_threshold
    return alternative is not None and alternative.log_bayes_factor(main) > ahead


def report(before: Status, belief: MapBelief, found: Status) -> tuple[MapBelief, Status]:
    """Return the status to report, and the belief with it where it has converged before."""
    status = REPORTED.get((before, found), found)
    if found is _CONVERGED and status is _TRACKING:
        tracking = replace(belief, status=_TRACKING)
        # The estimate stays that before resampling, which the belief carries along.
        tracking.__dict__["summary"] = belief.summary
        return tracking, status
    return belief, status


def judge(
    rules: AlternativeRules,
    main: MapBelief,
    alternative: AlternativeHypothesis,
    travelled_m: float,
) -> Outcome:
    """Compare a belief and its alternative after the same readings."""
    log_bayes_factor = alternative.log_bayes_factor(main)
    other, mean = alternative.belief.summary, main.summary.mean
    apart_m = hypot(other.mean[0] - mean[0], other.mean[1] - mean[1])
    if apart_m <= NEAR_M and other.mass_50m >= rules.confirm_mass:
        return Outcome.CONFIRMED
    searching = main.status is _SEARCHING
    if log_bayes_factor >= (rules.search_threshold if searching else rules.lost_threshold):
        converged = alternative.belief.status in (_CONVERGED, _TRACKING)
        if converged and alternative.null.log_odds <= rules.converge_log_odds:
            return Outcome.WON
        suspect = alternative.null.log_odds > 0 or rules.takes_over_searching
        return Outcome.SUSPECT if suspect else Outcome.AHEAD
    gone_m = travelled_m - alternative.start_m
    if log_bayes_factor <= rules.abandon_threshold or gone_m >= rules.abandon_after_m:
        return Outcome.ABANDONED
    return Outcome.UNDECIDED
