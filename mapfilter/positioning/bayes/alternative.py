"""Noticing that a belief is wrong, and finding the way again without throwing a right one away.

Each reading has a log probability under the belief, and one that it should have on average if the
belief is right. What is missing adds up, less a slack (the CUSUM of Page, 1954): that is the doubt.
When it is large a *challenger* starts from scratch beside the belief. Both then predict the same
readings, and the difference of their log evidence is the logarithm of the Bayes factor between
"one is where I thought" and "one is anywhere". The belief is LOST when the challenger is far ahead,
and is replaced only once the challenger has converged; it is confirmed when both are at one place.
A challenger is in doubt of itself, too: then it goes on in the lost belief's place, and is
challenged in its turn.
A belief that still searches is in doubt when the true place has died out of it: it does not
converge, and a challenger that is ahead goes on in its place.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import Enum
from math import exp, hypot, nan

from mapfilter.filters.contract import Status
from mapfilter.filters.grid import GridBelief
from mapfilter.filters.hypotheses import NEAR_M
from mapfilter.filters.particle import ParticleBelief
from mapfilter.positioning.gnss.state import NO_GNSS_STATE, GnssState

MapBelief = ParticleBelief | GridBelief

_USUAL, _LEAST_USUAL, _MOST_USUAL = 0.8, 0.5, 2.0
_SLACK = 1.5
_LEARNT_OVER_M = 300.0


@dataclass(frozen=True, slots=True)
class AlternativeRules:
    """When a challenger starts, wins and gives up.

    Parameters
    ----------
    doubt, doubt_of_cells : float
        Missing log probability at which it starts; and where only serving cells are told.
    ahead : float
        Log Bayes factor from which a belief that still searches is replaced.
    lost, lost_of_cells : float
        And from which one that had converged is LOST, and may be replaced: nobody is often carried
        away. The second where only serving cells are told.
    confirmed_mass : float
        The belief is confirmed when so much of the challenger lies within 50 m of a place that is
        at most 50 m away.
    abandon_threshold : float
        A challenger that is so far behind gives up,
    abandon_after_m : float
        or one that has neither won nor lost after so many metres.
    converge_below : float
        No belief converges while the doubt of it is larger,
    converge_behind : float
        or its challenger less than so far behind.
    """

    doubt: float = 5.0
    doubt_of_cells: float = 2.5
    ahead: float = 4.0
    lost: float = 10.0
    lost_of_cells: float = 6.0
    confirmed_mass: float = 0.9
    abandon_threshold: float = -25.0
    abandon_after_m: float = 800.0
    converge_below: float = 2.5
    converge_behind: float = 2.0


@dataclass(frozen=True, slots=True)
class EvidenceCusum:
    """How much less probable readings were than they should have been.

    Parameters
    ----------
    sum : float
        Missing log probability.
    usual : float
        Log probability of a reading as a multiple of what the model expects; learnt slowly,
        because no network's errors are quite those of the model.
    """

    sum: float = 0.0
    usual: float = _USUAL

    def after(self, expected: float, gained: float, length_m: float) -> EvidenceCusum:
        """Take one reading in.

        Parameters
        ----------
        expected, gained : float
            Log probability of the reading that the model expects on average, and what it has.
        length_m : float
            Travelled since the last one.
        """
        if expected >= 0:
            return self
        total = max(0.0, self.sum + _SLACK * self.usual * expected - gained)
        # What is learnt while in doubt would make a wrong belief usual.
        share = 0.0 if total > 0 else 1.0 - exp(-length_m / _LEARNT_OVER_M)
        ratio = min(max(gained / expected, _LEAST_USUAL), _MOST_USUAL)
        return EvidenceCusum(total, self.usual + share * (ratio - self.usual))

    def none(self) -> EvidenceCusum:
        """Return no doubt, with what was learnt."""
        return replace(self, sum=0.0)


@dataclass(frozen=True, eq=False)
class AlternativeHypothesis:
    """A second belief, from scratch.

    Parameters
    ----------
    belief : MapBelief
    began_at_m : float
        Distance travelled when it started.
    against : float
        Log evidence of the first belief then.
    began_s : float
        Time when it started.
    sky : GnssState
    by_satellites : float
        What satellites add to the logarithm of the Bayes factor; bounded, as all of them may be
        faulty.
    doubt : EvidenceCusum
        Of itself.
    """

    belief: MapBelief
    began_at_m: float
    against: float
    began_s: float = nan
    sky: GnssState = NO_GNSS_STATE
    by_satellites: float = 0.0
    doubt: EvidenceCusum = field(default_factory=EvidenceCusum)

    def ahead(self, main: MapBelief) -> float:
        """Return the logarithm of the Bayes factor in its favour."""
        by_radio = self.belief.log_evidence - (main.log_evidence - self.against)
        return by_radio + self.by_satellites


class Verdict(Enum):
    """What became of a challenge so far."""

    OPEN = "open"
    AHEAD = "ahead"
    WON = "won"
    CONFIRMED = "confirmed"
    GAVE_UP = "gave up"


@dataclass(frozen=True, slots=True)
class Resolution:
    """What became of a belief and its challenger by one reading.

    Parameters
    ----------
    belief : MapBelief
    status : Status
        For the user: LOST until something is found again.
    doubt : EvidenceCusum
    challenger : AlternativeHypothesis or None
    taken_over : bool
        Whether the belief is the challenger's.
    """

    belief: MapBelief
    status: Status
    doubt: EvidenceCusum
    challenger: AlternativeHypothesis | None = None
    taken_over: bool = False


def resolve_alternative(
    rules: AlternativeRules,
    before: Status,
    main: MapBelief,
    doubt: EvidenceCusum,
    challenger: AlternativeHypothesis | None,
    travelled_m: float,
    *,
    cells_only: bool,
) -> Resolution:
    """Decide after a belief and its challenger have seen the same reading.

    Parameters
    ----------
    rules : AlternativeRules
    before : Status
        What the user was told last.
    main : MapBelief
    doubt : EvidenceCusum
    challenger : AlternativeHypothesis or None
    travelled_m : float
    cells_only : bool
        Whether only serving cells are told.
    """
    if main.status is Status.CONVERGED and not _may_converge(rules, main, doubt, challenger):
        # All agree, and what is heard does not: the truth may have died out.
        main = replace(main, status=Status.SEARCHING)
    if challenger is None:
        return _told(before, Resolution(main, main.status, doubt))
    verdict = judge(rules, main, challenger, travelled_m, cells_only=cells_only)
    if verdict in (Verdict.CONFIRMED, Verdict.GAVE_UP):
        return _told(before, Resolution(main, main.status, doubt.none()))
    searching, other = main.status is Status.SEARCHING, challenger.belief
    if verdict is Verdict.WON:
        found = Status.CONVERGED if searching else Status.TRACKING
        return _told(
            before, Resolution(replace(other, status=found), found, doubt.none(), None, True)
        )
    doubted = challenger.doubt.sum >= (rules.doubt_of_cells if cells_only else rules.doubt)
    if verdict is Verdict.AHEAD and (searching or doubted):
        # Nothing found yet can be lost: whoever is ahead goes on with the search at once. So it
        # does in doubt of itself, and is challenged in its turn.
        status = Status.SEARCHING if searching else Status.LOST
        left = challenger.doubt if doubted else doubt.none()
        other = replace(other, status=Status.SEARCHING, agreement_start_m=nan)
        return _told(before, Resolution(other, status, left, None, True))
    lost = verdict is Verdict.AHEAD and not searching
    return _told(before, Resolution(main, Status.LOST if lost else main.status, doubt, challenger))


def _told(before: Status, now: Resolution) -> Resolution:
    """Return what the user is told: once lost, one is LOST until found, and then TRACKING."""
    if before is not Status.LOST or now.status in (Status.LOST, Status.TRACKING):
        return now
    if now.status is Status.SEARCHING:
        return replace(now, status=Status.LOST)
    belief = replace(now.belief, status=Status.TRACKING)
    return replace(now, belief=belief, status=Status.TRACKING)


def _may_converge(
    rules: AlternativeRules,
    main: MapBelief,
    doubt: EvidenceCusum,
    challenger: AlternativeHypothesis | None,
) -> bool:
    rivalled = challenger is not None and challenger.ahead(main) > -rules.converge_behind
    return doubt.sum <= rules.converge_below and not rivalled


def judge(
    rules: AlternativeRules,
    main: MapBelief,
    challenger: AlternativeHypothesis,
    travelled_m: float,
    *,
    cells_only: bool,
) -> Verdict:
    """Compare a belief and its challenger after both have seen the same readings."""
    ahead, other = challenger.ahead(main), challenger.belief.summary
    said = main.summary
    apart_m = hypot(other.mean[0] - said.mean[0], other.mean[1] - said.mean[1])
    if apart_m <= NEAR_M and other.mass_50m >= rules.confirmed_mass:
        return Verdict.CONFIRMED
    needed = rules.lost_of_cells if cells_only else rules.lost
    if ahead >= (rules.ahead if main.status is Status.SEARCHING else needed):
        agreed = challenger.belief.status in (Status.CONVERGED, Status.TRACKING)
        sure = agreed and challenger.doubt.sum <= rules.converge_below
        return Verdict.WON if sure else Verdict.AHEAD
    gone_m = travelled_m - challenger.began_at_m
    if ahead <= rules.abandon_threshold or gone_m >= rules.abandon_after_m:
        return Verdict.GAVE_UP
    return Verdict.OPEN
