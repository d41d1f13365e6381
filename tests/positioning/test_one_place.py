"""When a belief in more than one place is LOST, and how evidence is collected, by hand."""

from dataclasses import dataclass, field, replace
from math import inf, isnan, nan
from types import SimpleNamespace

import numpy as np
import pytest

from mapfilter.filters.contract import Status
from mapfilter.filters.hypotheses import Bins
from mapfilter.filters.particle import ParticleBelief
from mapfilter.positioning.bayes import claims
from mapfilter.positioning.bayes.certainty import Recovery
from mapfilter.positioning.bayes.rivals.held import HeldOtherwise
from mapfilter.positioning.bayes.rivals.hold import Hold
from mapfilter.positioning.bayes.sources.evidence import EvidenceUpdate, FixedTerm
from mapfilter.positioning.bayes.sources.timing import TimingState, TimingTerm
from mapfilter.positioning.bayes.weighing import Weighing, weighed_by
from mapfilter.positioning.epochs import Epoch, ReportRow


@dataclass(frozen=True)
class Belief:
    mass: float = 1.0
    status: Status = Status.TRACKING
    agreement_start_m: float = 70.0

    @property
    def summary(self):
        return SimpleNamespace(mass_50m=self.mass)


class At(Belief):
    @property
    def summary(self):
        return SimpleNamespace(mass_50m=self.mass, mean=(0.0, 0.0))


@dataclass(frozen=True)
class State:
    belief: object = None
    status: Status = Status.TRACKING
    contested: bool = False
    alternative: object = None
    held: tuple = ()
    null: object = field(default_factory=lambda: SimpleNamespace(log_odds=-12.0))
    recovery: object = None
    proven: bool = True
    sources: dict = field(default_factory=dict)
    reckoning: object = field(default_factory=lambda: SimpleNamespace(travelled_m=40.0))
    watch: object = "of the epoch"

    @property
    def rivals(self):
        return self.held


def judged(
    state, *, weighed=True, positioned=False, contested=False, left=False, unheard=False,
    by_fixes=-inf, left_share=0.0, used_positions=False, claimed_from=0.95,
):  # fmt: skip
    rules = SimpleNamespace(claimed_from=claimed_from, lost_threshold=8.0, converge_log_odds=-12.0)
    beliefs = SimpleNamespace(
        options=SimpleNamespace(split_mass=0.4),
        options_of=lambda _: SimpleNamespace(switch_mass=0.99, switch_hold_m=14.0),
        rules_of=lambda _: rules,
        is_contested=lambda _: contested,
        may_have_left=lambda _: left,
        is_unheard=lambda _: unheard,
        log_odds_of_fixes=lambda _: by_fixes,
        used_positions=lambda _: used_positions,
        left_share=lambda own, watch: left_share if watch is own.watch else 1.0,
    )
    return claims.judged(beliefs, state, weighed=weighed, positioned=positioned)


@pytest.mark.parametrize(("mass", "claimed"), [(0.4, False), (0.94, False), (0.95, True)])
def test_a_position_is_claimed_if_it_is_certain_enough(mass, claimed):
    found = judged(State(Belief(mass)))
    assert found.status is (Status.TRACKING if claimed else Status.UNCERTAIN)
    assert not found.contested
    assert found.belief == Belief(mass)


@pytest.mark.parametrize(("mass", "share", "claimed"), [(1.0, 0.05, True), (0.99, 0.05, False)])
def test_who_may_have_left_unnoticed_leaves_a_doubt(mass, share, claimed):
    found = judged(State(Belief(mass)), left_share=share)
    assert found.status is (Status.TRACKING if claimed else Status.UNCERTAIN)
    assert not found.contested


def test_what_converges_is_judged_by_the_rule_of_convergence():
    given = State(Belief(0.6, Status.CONVERGED), Status.CONVERGED)
    assert judged(given) is given


def test_below_the_mass_of_a_split_it_has_to_converge_anew():
    found = judged(State(Belief(0.39)), contested=True)
    assert found.status is Status.LOST
    assert found.belief.status is Status.SEARCHING
    assert isnan(found.belief.agreement_start_m)
    assert not found.contested
    assert not found.proven


@pytest.mark.parametrize("mass", [1.0, 0.5])
def test_another_reading_of_headings_makes_it_contested(mass):
    found = judged(State(Belief(mass)), contested=True)
    assert (found.status, found.contested) == (Status.LOST, True)


@pytest.mark.parametrize("status", [Status.SEARCHING, Status.LOST, Status.OUTSIDE])
def test_only_what_claims_a_position_can_be_lost(status):
    given = State(Belief(0.1), status)
    assert replace(judged(given, contested=True), recovery=None) == given
    nothing = State(None)
    assert judged(nothing, contested=True) is nothing


def after_a_loss(gone_m, agrees_from_m=nan, *, mass=0.99, null=-12.0):
    """A position that was lost, tracked again, so far on."""
    null, reckoning = SimpleNamespace(log_odds=null), SimpleNamespace(travelled_m=gone_m)
    recovery = Recovery(agrees_from_m)
    return State(Belief(mass), null=null, reckoning=reckoning, recovery=recovery)


def test_what_was_lost_is_claimed_when_it_has_agreed_for_some_way():
    lost = judged(State(Belief(), Status.LOST))
    assert lost.recovery == Recovery()
    begins = judged(after_a_loss(100.0))
    assert (begins.status, begins.recovery) == (Status.UNCERTAIN, Recovery(100.0))
    ends = judged(after_a_loss(113.9, 100.0))
    assert (ends.status, ends.recovery) == (Status.UNCERTAIN, Recovery(100.0))
    over = judged(after_a_loss(114.0, 100.0))
    assert (over.status, over.recovery) == (Status.TRACKING, None)
    # Without a reading nothing agrees, and nothing disagrees.
    for given in (after_a_loss(114.0, 100.0), after_a_loss(114.0)):
        same = judged(given, weighed=False)
        assert same.status is Status.UNCERTAIN
        assert same.recovery is given.recovery


def uncertain_before(gone_m, doubted_m, *, mass=0.95):
    """A position that was not certain enough, so far on."""
    recovery = Recovery(doubted_m, lost=False)
    return replace(after_a_loss(gone_m, mass=mass, null=0.0), recovery=recovery)


def test_what_was_uncertain_is_claimed_when_it_has_been_certain_for_some_way():
    """At a rest only levels tell that it is one. The share is that of a claim."""
    doubt = judged(State(Belief(0.94)))
    assert (doubt.status, doubt.recovery) == (Status.UNCERTAIN, Recovery(40.0, lost=False))
    certain = judged(uncertain_before(104.9, 100.0))
    assert (certain.status, certain.recovery) == (Status.UNCERTAIN, Recovery(100.0, lost=False))
    # Whether by a reading or not: it is the belief that is not certain.
    for weighed in (True, False):
        over = judged(uncertain_before(105.0, 100.0), weighed=weighed)
        assert (over.status, over.recovery) == (Status.TRACKING, None)
        anew = judged(uncertain_before(105.0, 100.0, mass=0.94), weighed=weighed)
        assert (anew.status, anew.recovery) == (Status.UNCERTAIN, Recovery(105.0, lost=False))
    # A loss meanwhile asks for more.
    assert judged(uncertain_before(105.0, 100.0), contested=True).recovery == Recovery()


def test_what_agrees_as_it_would_to_converge_is_not_claimed_at_once_where_a_claim_asks_for_more():
    """From the last doubt on it has to be certain for 5 m, as any other that was uncertain."""
    agreed = judged(after_a_loss(114.0, 100.0), claimed_from=0.998)
    assert (agreed.status, agreed.recovery) == (Status.UNCERTAIN, Recovery(114.0, lost=False))
    for gone_m, claimed in ((114.0, False), (118.9, False), (119.0, True)):
        later = replace(after_a_loss(gone_m, mass=1.0), recovery=agreed.recovery)
        found = judged(later, claimed_from=0.998)
        assert found.status is (Status.TRACKING if claimed else Status.UNCERTAIN)
    positioned = judged(after_a_loss(114.0, 100.0), positioned=True, claimed_from=0.998)
    assert (positioned.status, positioned.recovery) == (Status.UNCERTAIN, None)


def test_a_measured_position_is_claimed_as_soon_as_it_is_certain():
    doubt = judged(State(Belief(0.94)), positioned=True)
    assert (doubt.status, doubt.recovery) == (Status.UNCERTAIN, None)
    found = judged(uncertain_before(100.0, 90.0), positioned=True)
    assert (found.status, found.recovery) == (Status.TRACKING, None)


@pytest.mark.parametrize(
    ("away_m", "used_positions", "claimed"),
    [(60.0, False, False), (40.0, False, True), (60.0, True, True)],
)
def test_while_an_alternative_elsewhere_is_tested_nothing_is_claimed(
    away_m, used_positions, claimed
):
    """However far behind it is: it has to pay for all places that it might have been in."""
    place = SimpleNamespace(summary=SimpleNamespace(mean=(0.0, away_m)))
    other = SimpleNamespace(log_bayes_factor=lambda _: -20.0, belief=place)
    found = judged(State(At(1.0), alternative=other), used_positions=used_positions)
    assert found.status is (Status.TRACKING if claimed else Status.UNCERTAIN)
    assert found.recovery == (None if claimed else Recovery(40.0, lost=False))


@pytest.mark.parametrize("status", [Status.LOST, Status.OUTSIDE])
def test_a_loss_begins_a_recovery_unless_a_rest_alone_is_in_doubt(status):
    given = State(Belief(), status, recovery=Recovery(30.0))
    assert judged(given).recovery == Recovery()
    assert judged(State(Belief()), contested=True).recovery == Recovery()
    assert judged(State(Belief()), left=True).recovery is None
    assert judged(State(Belief()), unheard=True).recovery is None
    assert judged(State(Belief()), left=True, contested=True).recovery == Recovery()


@pytest.mark.parametrize(
    ("lead", "away_m", "agrees"),
    [(3.0, 60.0, True), (4.0, 60.0, False), (4.0, 40.0, True)],
)
def test_an_alternative_leaves_a_doubt_by_its_odds_elsewhere(lead, away_m, agrees):
    """A lead of 8 makes it as probable: of 3, 1 / (1 + exp(-5)) = 0.9933 are left, of 4 0.982."""
    place = SimpleNamespace(summary=SimpleNamespace(mean=(0.0, away_m)))
    other = SimpleNamespace(log_bayes_factor=lambda _: lead, belief=place)
    found = judged(replace(after_a_loss(100.0), alternative=other, belief=At(1.0)))
    assert found.status is Status.UNCERTAIN
    assert isnan(found.recovery.agrees_from_m) != agrees


def hypotheses(east_m, log_evidence=-50.0):
    """A tracked belief with all its hypotheses at one place."""
    place = np.array([[east_m] * 100, [1000.0] * 100], dtype=np.float32)
    belief = ParticleBelief(
        place,
        np.full(100, -np.log(100.0)),
        Bins.over((0.0, 0.0, 2000.0, 2000.0)),
        np.empty((0, 100), dtype=np.float32),
        log_evidence=log_evidence,
    )
    return replace(belief, status=Status.TRACKING)


def turned(log_odds, east_m):
    """A phone turned on the way, whose belief is at one place."""
    prior = -2.0
    own = hypotheses(east_m, -50.0 + log_odds - prior)
    return HeldOtherwise(own, Hold(1.0, 3.0), prior, 0.0)


@pytest.mark.parametrize(
    ("log_odds", "claimed", "agrees"),
    [(-6.0, True, True), (-4.0, True, False), (-2.0, False, False)],
)
def test_a_turned_phone_elsewhere_contradicts_a_claim(log_odds, claimed, agrees):
    """By its odds: 1 in 400 hinders nothing, 1 in 55 a claim after a loss, 1 in 7 any claim."""
    main = hypotheses(500.0)
    far, near = turned(log_odds, 700.0), turned(log_odds, 520.0)
    usual = State(main, held=(far,))
    assert judged(usual).status is (Status.TRACKING if claimed else Status.UNCERTAIN)
    lost = replace(after_a_loss(300.0, 100.0), belief=main)
    for held, over in (((far,), agrees), ((near, far), agrees), ((near,), True), ((), True)):
        found = judged(replace(lost, held=held))
        assert found.status is (Status.TRACKING if over else Status.UNCERTAIN)
        assert found.recovery == (None if over else Recovery())


@pytest.mark.parametrize("doubt", [{"mass": 0.98}, {"null": -11.9}])
def test_what_does_not_agree_as_it_would_to_converge_begins_anew(doubt):
    found = judged(after_a_loss(300.0, 100.0, **doubt))
    assert found.status is Status.UNCERTAIN
    assert isnan(found.recovery.agrees_from_m)
    usual = replace(after_a_loss(300.0, 100.0, **doubt), recovery=None)
    assert judged(usual).status is Status.TRACKING


def test_a_measured_position_ends_what_was_lost():
    given = after_a_loss(100.0)
    found = judged(given, positioned=True)
    assert (found.status, found.recovery) == (Status.TRACKING, None)
    searching = replace(given, belief=Belief(0.3, Status.SEARCHING), status=Status.LOST)
    # It has to converge anew, which is enough.
    assert judged(searching).recovery is None


@dataclass
class Source:
    """Notes what it is asked for, and answers as it is told."""

    name: str
    answer: EvidenceUpdate
    asked: list = field(default_factory=list)

    def first_after(self, state, epoch):  # noqa: ARG002
        self.asked.append(("first", state.belief))
        return self.answer

    def update(self, state, epoch, context):  # noqa: ARG002
        self.asked.append(("update", state.belief, context))
        return self.answer


def test_each_source_sees_the_belief_as_the_one_before_has_left_it():
    """And the states of those that changed are replaced."""
    kept, changed, later = object(), object(), Belief(0.7)
    one = Source("one", EvidenceUpdate(changed, belief=later))
    other = Source("other", EvidenceUpdate(kept))
    radio = SimpleNamespace(name="other", due=lambda _, gone_m: gone_m == 40.0)
    weighing_ = Weighing(None, radio, (one, other))
    state = State(Belief(), sources={"one": "before", "other": kept})
    row = ReportRow("serving", "A", None, None, -70.0, 0)
    for rows, due in (((row,), True), ((), False)):
        found, updates = weighing_.collected(state, Epoch(0.0, (), rows), 6.0)
        assert updates == [one.answer, other.answer]
        assert found.sources == {"one": changed, "other": kept}
        assert found.belief is later
        (kind, belief, context), (_, second, _) = one.asked[-1], other.asked[-1]
        assert (kind, belief, second) == ("update", state.belief, later)
        assert (context.particle_spacing_m, context.report_due) == (6.0, due)
    searching = replace(state, belief=None)
    weighing_.collected(searching, Epoch(0.0, ()), 6.0)
    # What the first has started the second updates.
    assert [source.asked[-1][0] for source in (one, other)] == ["first", "update"]
    quiet = Weighing(None, radio, (other,))
    same, _ = quiet.collected(state, Epoch(0.0, ()), 6.0)
    assert same is state


@pytest.mark.parametrize(
    ("status", "measured", "tracked"),
    [(Status.TRACKING, True, True), (Status.TRACKING, False, False),
     (Status.SEARCHING, True, False), (Status.CONVERGED, True, False)],
)  # fmt: skip
def test_evidence_is_of_a_tracked_belief_where_motion_is_measured(status, measured, tracked):
    update = EvidenceUpdate(None, (FixedTerm(np.zeros(1)),))
    found = weighed_by(Belief(status=status), [update], measured=measured)
    assert found.tracked is tracked
    assert weighed_by(Belief(), [EvidenceUpdate(None)], measured=True) is None


class Line:
    """Distances from a line to the north, with covariance."""

    noise = np.array([[4.0, 1.0], [1.0, 9.0]])

    def mean(self, places):
        return np.column_stack([places[:, 0], 2 * places[:, 0]])


@pytest.mark.parametrize("weight", [1.0, 0.25])
def test_terms_of_timing_are_clipped_normal_densities(weight):
    state = np.zeros((5, 4), dtype=np.float32)
    state[0] = [1.0, 2.0, 3.0, 400.0]
    reading = np.array([2.0, 5.0])
    term = TimingTerm(Line(), reading, weight, 3.0)
    off = reading - np.column_stack([state[0], 2 * state[0]])
    square = np.einsum("ni,ij,nj->n", off, np.linalg.inv(Line.noise), off)
    expected = -0.5 * weight * np.minimum(square, 2 * 3.0**2)
    np.testing.assert_allclose(term.log_likelihood(state), expected, rtol=1e-5)
    assert square[3] > 18 > square[2]
    assert term.under_null == pytest.approx(-0.5 * 1.5 * weight * 2)
    assert TimingState()[:2] == (-inf, -inf)


def test_a_rest_in_doubt_makes_it_contested():
    silent = judged(State(Belief(0.99)), unheard=True)
    assert (silent.status, silent.contested) == (Status.LOST, True)
    found = judged(State(Belief(0.99)), left=True)
    assert (found.status, found.contested) == (Status.LOST, True)
