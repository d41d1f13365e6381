"""Detection of a wrong belief, and its replacement by a more probable alternative.

Each reading has a log-likelihood under the belief, and an expected one if the belief is right. The
shortfall, less a slack, feeds a CUSUM (Page, 1954). When that is large, an *alternative* starts
from scratch beside the belief. Both then predict the same readings; the difference of their log
evidence is the logarithm of the Bayes factor between "the position is anywhere" and "the position
is where the belief has it". The alternative has a CUSUM, too: one that fails itself is *suspect*.

After each reading, the alternative has one outcome, and a table gives what follows. Searching or
found is the status of the belief that was there first:

===============  =========  ================  =========  =======  ===========
Outcome          Belief     Goes on, as       Reported   CUSUM    Alternative
===============  =========  ================  =========  =======  ===========
none, undecided  any        belief            its own    kept     kept
confirmed        any        belief            its own    reset    dropped
abandoned        any        belief            its own    reset    dropped
ahead            searching  other, SEARCHING  SEARCHING  reset    took over
ahead            found      belief            LOST       kept     kept
ahead, suspect   searching  other, SEARCHING  SEARCHING  other's  took over
ahead, suspect   found      other, SEARCHING  LOST       other's  took over
won              searching  other, CONVERGED  CONVERGED  reset    took over
won              found      other, TRACKING   TRACKING   reset    took over
===============  =========  ================  =========  =======  ===========

Then, by the status reported before: ``LOST`` stays while the belief searches and becomes
``TRACKING`` when it converges; ``CONVERGED`` lasts for one epoch. A belief does not converge while
its CUSUM is large or the alternative close behind, as the true position may have died out of it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import Enum
from math import exp, hypot, nan
from typing import Any, Literal, NamedTuple

from mapfilter.filters.contract import Status
from mapfilter.filters.grid import GridBelief
from mapfilter.filters.hypotheses import NEAR_M
from mapfilter.filters.particle import ParticleBelief
from mapfilter.options import NotNegative, Options, Share

MapBelief = ParticleBelief | GridBelief

_USUAL, _MIN_USUAL, _MAX_USUAL = 0.8, 0.5, 2.0
_SLACK = 1.5
_LEARNT_OVER_M = 300.0


@dataclass(frozen=True, slots=True)
class AlternativeRules(Options):
    """Thresholds for starting, preferring and abandoning an alternative.

    Log Bayes factors are in favour of the alternative.

    Parameters
    ----------
    start_cusum, start_cusum_cells : float
        CUSUM at which an alternative starts; the second where only serving cells are reported.
    search_threshold : float
        Log Bayes factor from which a belief that still searches is replaced.
    lost_threshold, lost_threshold_cells : float
        Log Bayes factor from which a belief that had converged is LOST and may be replaced: being
        carried away unmeasured is rare. The second where only serving cells are reported.
    confirm_mass : float
        Share of the alternative within 50 m of its leading position, at most 50 m from that of the
        belief, at which the belief is confirmed.
    abandon_threshold : float
        Log Bayes factor at which an alternative is abandoned.
    abandon_after_m : float
        Distance after which an undecided alternative is abandoned.
    converge_cusum : float
        Largest CUSUM with which a belief converges, or an alternative wins.
    converge_threshold : float
        Lead over its alternative, as a log Bayes factor, that a belief needs to converge.
    """

    start_cusum: NotNegative = 5.0
    start_cusum_cells: NotNegative = 2.5
    search_threshold: float = 4.0
    lost_threshold: float = 10.0
    lost_threshold_cells: float = 6.0
    confirm_mass: Share = 0.9
    abandon_threshold: float = -25.0
    abandon_after_m: NotNegative = 800.0
    converge_cusum: float = 2.5
    converge_threshold: float = 2.0

    def alarms(self, cusum: EvidenceCusum, *, cells_only: bool) -> bool:
        """Return whether a CUSUM is large enough to start an alternative."""
        return cusum.sum >= (self.start_cusum_cells if cells_only else self.start_cusum)


@dataclass(frozen=True, slots=True)
class EvidenceCusum:
    """Shortfall of the log-likelihood of readings against its expectation.

    Parameters
    ----------
    usual : float
        Ratio of log-likelihood to its expectation; learnt slowly, as the errors of no network are
        exactly those of the model.
    """

    sum: float = 0.0
    usual: float = _USUAL

    def after(self, expected: float, gained: float, length_m: float) -> EvidenceCusum:
        """Add a reading by its expected and actual log-likelihood, ``length_m`` after the last."""
        if expected >= 0:
            return self
        total = max(0.0, self.sum + _SLACK * self.usual * expected - gained)
        # Learning during a shortfall would make a wrong belief usual.
        share = 0.0 if total > 0 else 1.0 - exp(-length_m / _LEARNT_OVER_M)
        ratio = min(max(gained / expected, _MIN_USUAL), _MAX_USUAL)
        return EvidenceCusum(total, self.usual + share * (ratio - self.usual))

    def reset(self) -> EvidenceCusum:
        """Return a sum of 0, with the ratio learnt."""
        return replace(self, sum=0.0)


@dataclass(frozen=True, eq=False)
class AlternativeHypothesis:
    """A second belief, started from scratch.

    Parameters
    ----------
    start_m, start_s : float
        Distance travelled and time at its start.
    main_log_evidence : float
        Log evidence of the main belief at its start.
    sources : mapping of str to object
        State of the sources of evidence that depends on the belief.
    gnss_log_bayes_factor : float
        Contribution of rejected satellites to the log Bayes factor; bounded, as all may be faulty.
    cusum : EvidenceCusum
        Of the alternative itself.
    """

    belief: MapBelief
    start_m: float
    main_log_evidence: float
    start_s: float = nan
    sources: Mapping[str, Any] = field(default_factory=dict)
    gnss_log_bayes_factor: float = 0.0
    cusum: EvidenceCusum = field(default_factory=EvidenceCusum)

    def log_bayes_factor(self, main: MapBelief) -> float:
        """Return the logarithm of the Bayes factor in favour of the alternative."""
        by_readings = self.belief.log_evidence - (main.log_evidence - self.main_log_evidence)
        return by_readings + self.gnss_log_bayes_factor


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
    ``reported`` is the status to report; None for that of the belief. ``cusum`` is kept, reset or
    the other's; ``keeps`` is whether the alternative stays beside the belief.
    """

    takes_over: Status | None
    reported: Status | None
    cusum: Literal["kept", "reset", "other's"]
    keeps: bool


_SEARCHING, _CONVERGED = Status.SEARCHING, Status.CONVERGED
_TRACKING, _LOST = Status.TRACKING, Status.LOST

TRANSITIONS: Mapping[tuple[Outcome, bool], Transition] = {
    # Outcome, and whether the belief is still searching.
    (Outcome.UNDECIDED, True): Transition(None, None, "kept", True),
    (Outcome.UNDECIDED, False): Transition(None, None, "kept", True),
    (Outcome.CONFIRMED, True): Transition(None, None, "reset", False),
    (Outcome.CONFIRMED, False): Transition(None, None, "reset", False),
    (Outcome.ABANDONED, True): Transition(None, None, "reset", False),
    (Outcome.ABANDONED, False): Transition(None, None, "reset", False),
    (Outcome.AHEAD, True): Transition(_SEARCHING, _SEARCHING, "reset", False),
    (Outcome.AHEAD, False): Transition(None, _LOST, "kept", True),
    (Outcome.SUSPECT, True): Transition(_SEARCHING, _SEARCHING, "other's", False),
    (Outcome.SUSPECT, False): Transition(_SEARCHING, _LOST, "other's", False),
    (Outcome.WON, True): Transition(_CONVERGED, _CONVERGED, "reset", False),
    (Outcome.WON, False): Transition(_TRACKING, _TRACKING, "reset", False),
}

REPORTED: Mapping[tuple[Status, Status], Status] = {
    # Status reported before, and found now; others are reported as found.
    (_LOST, _SEARCHING): _LOST,
    (_LOST, _CONVERGED): _TRACKING,
    (_CONVERGED, _CONVERGED): _TRACKING,
}


class Resolution(NamedTuple):
    """Belief, status and alternative after one reading."""

    belief: MapBelief
    status: Status
    cusum: EvidenceCusum
    alternative: AlternativeHypothesis | None = None
    taken_over: bool = False


def resolve_alternative(
    rules: AlternativeRules,
    before: Status,
    main: MapBelief,
    cusum: EvidenceCusum,
    alternative: AlternativeHypothesis | None,
    travelled_m: float,
    *,
    cells_only: bool,
) -> Resolution:
    """Apply the table after a belief and its alternative were weighed by the same reading.

    ``before`` is the status reported at the last epoch; ``cells_only`` is whether only serving
    cells are reported, no levels.
    """
    if main.status is _CONVERGED and (
        cusum.sum > rules.converge_cusum
        or (alternative and alternative.log_bayes_factor(main) > -rules.converge_threshold)
    ):
        main = replace(main, status=_SEARCHING)
    outcome = Outcome.UNDECIDED
    if alternative is not None:
        outcome = judge(rules, main, alternative, travelled_m, cells_only=cells_only)
    row = TRANSITIONS[outcome, main.status is _SEARCHING]
    belief, taken_over = main, row.takes_over is not None
    if row.cusum == "reset":
        cusum = cusum.reset()
    if row.takes_over and alternative:
        belief = replace(alternative.belief, status=row.takes_over)
        if row.takes_over is _SEARCHING:
            belief = replace(belief, agreement_start_m=nan)
        if row.cusum == "other's":
            cusum = alternative.cusum
    belief, status = report(before, belief, row.reported or belief.status)
    return Resolution(belief, status, cusum, alternative if row.keeps else None, taken_over)


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
    *,
    cells_only: bool,
) -> Outcome:
    """Compare a belief and its alternative after the same readings."""
    log_bayes_factor = alternative.log_bayes_factor(main)
    other, mean = alternative.belief.summary, main.summary.mean
    apart_m = hypot(other.mean[0] - mean[0], other.mean[1] - mean[1])
    if apart_m <= NEAR_M and other.mass_50m >= rules.confirm_mass:
        return Outcome.CONFIRMED
    needed = rules.lost_threshold_cells if cells_only else rules.lost_threshold
    if log_bayes_factor >= (rules.search_threshold if main.status is _SEARCHING else needed):
        converged = alternative.belief.status in (_CONVERGED, _TRACKING)
        if converged and alternative.cusum.sum <= rules.converge_cusum:
            return Outcome.WON
        suspect = rules.alarms(alternative.cusum, cells_only=cells_only)
        return Outcome.SUSPECT if suspect else Outcome.AHEAD
    gone_m = travelled_m - alternative.start_m
    if log_bayes_factor <= rules.abandon_threshold or gone_m >= rules.abandon_after_m:
        return Outcome.ABANDONED
    return Outcome.UNDECIDED
