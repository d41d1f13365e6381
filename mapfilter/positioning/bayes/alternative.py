"""Detection of a wrong belief, and its replacement by a more probable alternative.

Two hypotheses compete with the belief. The *null hypothesis* is that it describes none of what is
measured: the position is outside the map, or database and network do not belong together. It has
likelihoods of its own, which fit every reading moderately well. Its log odds against the belief are
bounded from below, as it may become true at any time: so they are a CUSUM (Page, 1954).

When they are large, most of the belief has left the area, where nothing can refute it, or a turned
phone is more probable, an *alternative* starts from scratch beside the belief. Both then predict
the same readings; the difference of their log evidence is the logarithm of the Bayes factor between
"the position is anywhere" and "the position is where the belief has it". The alternative has a null
hypothesis, too: one that is improbable beside it is *suspect*.

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
has less than half of it in one place is ``LOST`` and searches again; one that has less than 95 %
there, rivals included, is ``UNCERTAIN``, and so is one that was ``LOST`` without a new search,
until it has agreed for some way. While the null hypothesis is more probable than the belief, one
that had converged is ``LOST``, too, and ``OUTSIDE`` where it lies at the edge of the area; one that
searches is ``OUTSIDE``, and so is one that has left the area. A belief does not converge while the
null hypothesis is not improbable or the alternative close behind, as the true position may have
died out of it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import Enum
from math import exp, hypot, log, nan
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from mapfilter.filters.contract import Status
from mapfilter.filters.grid import GridBelief
from mapfilter.filters.hypotheses import NEAR_M
from mapfilter.filters.particle import ParticleBelief
from mapfilter.options import NotNegative, Options, Share
from mapfilter.positioning.bayes.hold import Hold

if TYPE_CHECKING:
    from mapfilter.positioning.bayes.evidence import RadioReading

MapBelief = ParticleBelief | GridBelief

LEAST_LOG_ODDS = -12.0
_MOST_LOG_ODDS, _MARGIN_NATS = 12.0, 3.0
"""Bounds of the log odds; how far below the threshold of convergence that of a search is."""
_PRIOR_LOG_ODDS = log(0.05 / 0.95)
MAP_NATS_PER_M = 0.04
"""Negative log-likelihood of the map for each metre, under the null hypothesis."""


@dataclass(frozen=True, slots=True)
class AlternativeRules(Options):
    """Thresholds for starting, preferring and abandoning an alternative.

    Log Bayes factors are in favour of the alternative.

    Parameters
    ----------
    start_log_odds : float
        Log odds of the null hypothesis at which an alternative starts.
    search_threshold : float
        Log Bayes factor from which a belief that still searches is replaced.
    lost_threshold : float
        Log Bayes factor from which a belief that had converged is LOST and may be replaced: being
        carried away unmeasured is rare.
    confirm_mass : float
        Share of the alternative within 50 m of its leading position, at most 50 m from that of the
        belief, at which the belief is confirmed.
    abandon_threshold : float
        Log Bayes factor at which an alternative is abandoned.
    abandon_after_m : float
        Distance after which an undecided alternative is abandoned.
    converge_log_odds : float
        Largest log odds of the null hypothesis with which a belief converges, or an alternative
        wins.
    converge_threshold : float
        Lead over its alternative, as a log Bayes factor, that a belief needs to converge.
    map_nats_per_m : float
        Negative log-likelihood of the map for each metre under the null hypothesis.
    claimed_from : float
        Least probability of being within 50 m with which a tracked position is claimed; with less
        it is UNCERTAIN.
    takes_over_searching : bool
        An alternative that is ahead of a belief that had converged replaces it at once, and has to
        converge anew.
    """

    start_log_odds: float = -1.0
    search_threshold: float = 4.0
    lost_threshold: float = 8.0
    confirm_mass: Share = 0.9
    abandon_threshold: float = -25.0
    abandon_after_m: NotNegative = 800.0
    converge_log_odds: float = -12.0
    converge_threshold: float = 2.0
    map_nats_per_m: NotNegative = MAP_NATS_PER_M
    claimed_from: Share = 0.95
    takes_over_searching: bool = False

    def least_log_odds(self, *, searching: bool) -> float:
        """Return the bound of the null hypothesis, lower while a belief has to refute it."""
        return min(LEAST_LOG_ODDS, self.converge_log_odds - _MARGIN_NATS if searching else 0.0)


@dataclass(frozen=True, slots=True)
class NullHypothesis:
    """Log odds that a belief describes none of what is measured.

    ``travelled_m`` is the distance that the belief had travelled at the last reading.
    """

    log_odds: float = _PRIOR_LOG_ODDS
    travelled_m: float = 0.0

    @property
    def probability(self) -> float:
        """Its probability beside the belief."""
        return 1 / (1 + exp(-self.log_odds))

    def after(
        self,
        reading: RadioReading,
        other_log_likelihood: float,
        gained: float,
        travelled_m: float,
        map_nats_per_m: float = MAP_NATS_PER_M,
        least_log_odds: float = LEAST_LOG_ODDS,
    ) -> NullHypothesis:
        """Add a reading.

        Parameters
        ----------
        other_log_likelihood : float
            Of its levels, if the prediction is wrong about all cells.
        gained : float
            Log-likelihood of the reading, and of the map since the last one, under the belief.
        travelled_m : float
            By the belief.
        map_nats_per_m : float
            Negative log-likelihood of the map for each metre, under the null hypothesis.
        least_log_odds : float
            Bound from below: the null hypothesis may become true at any time.
        """
        expected = reading.radio_under_null(other_log_likelihood) + reading.under_null
        expected -= map_nats_per_m * (travelled_m - self.travelled_m)
        log_odds = self.log_odds + expected - gained
        return NullHypothesis(min(max(log_odds, least_log_odds), _MOST_LOG_ODDS), travelled_m)

    def reset(self) -> NullHypothesis:
        """Return it as at the start, unless it is less probable."""
        return replace(self, log_odds=min(self.log_odds, _PRIOR_LOG_ODDS))


@dataclass(frozen=True, eq=False)
class AlternativeHypothesis:
    """A second belief, started from scratch.

    Parameters
    ----------
    start_m, start_s : float
        Distance travelled and time at its start.
    main_log_evidence : float
        Log evidence of the main belief at its start; less the log odds of a turned phone whose
        belief has taken over since.
    sources : mapping of str to object
        State of the sources of evidence that depends on the belief.
    gnss_log_bayes_factor : float
        Contribution of rejected satellites to the log Bayes factor; bounded, as all may be faulty.
    null : NullHypothesis
        Beside the alternative itself.
    hold : Hold
        How it reads headings, and the unit in which it reads lengths of steps.
    """

    belief: MapBelief
    start_m: float
    main_log_evidence: float
    start_s: float = nan
    sources: Mapping[str, Any] = field(default_factory=dict)
    gnss_log_bayes_factor: float = 0.0
    null: NullHypothesis = field(default_factory=NullHypothesis)
    hold: Hold = field(default_factory=Hold)

    def log_bayes_factor(self, main: MapBelief) -> float:
        """Return the logarithm of the Bayes factor in favour of the alternative."""
        by_readings = self.belief.log_evidence - (main.log_evidence - self.main_log_evidence)
        return by_readings + self.gnss_log_bayes_factor

    def beside(self, log_prior: float) -> AlternativeHypothesis:
        """Return it beside a belief that has taken over, which had such log odds beforehand."""
        return replace(self, main_log_evidence=self.main_log_evidence - log_prior)


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
