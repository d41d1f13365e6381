"""When a belief in more than one place is LOST, and how evidence is collected, by hand."""

from dataclasses import dataclass, field, replace
from math import inf, isnan
from types import SimpleNamespace

import numpy as np
import pytest

from mapfilter.filters.contract import Status
from mapfilter.positioning.bayes.evidence import EvidenceUpdate, FixedTerm
from mapfilter.positioning.bayes.timing import TimingState, TimingTerm
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


@dataclass(frozen=True)
class State:
    belief: object = None
    status: Status = Status.TRACKING
    unclear: bool = False
    contested: bool = False
    alternative: object = None
    sources: dict = field(default_factory=dict)
    reckoning: object = field(default_factory=lambda: SimpleNamespace(travelled_m=40.0))


def weighing(contested=False, left=False):
    rules = SimpleNamespace(unclear_below_mass=0.8, clear_from_mass=0.95)
    beliefs = SimpleNamespace(
        options=SimpleNamespace(split_mass=0.4),
        rules_of=lambda _: rules,
        is_contested=lambda _: contested,
        may_have_left=lambda _: left,
    )
    return Weighing(beliefs, None, ())


@pytest.mark.parametrize(
    ("mass", "measured", "was_unclear", "unclear"),
    [
        # Measured motion may spread it as far as it searches again; else it has to gather.
        (0.4, True, False, False),
        (0.79, False, False, True),
        (0.8, False, False, False),
        # What was unclear is clear from a larger mass on, however it moves.
        (0.94, True, True, True),
        (0.94, False, True, True),
        (0.95, True, True, False),
        (0.95, False, True, False),
    ],
)
@pytest.mark.parametrize("status", [Status.TRACKING, Status.CONVERGED])
def test_a_belief_that_is_spread_is_lost_until_it_has_gathered(
    mass, measured, was_unclear, unclear, status
):
    given = State(Belief(mass), status)
    found = weighing().in_one_place(given, measured=measured, was_unclear=was_unclear)
    assert found.unclear is unclear
    assert not found.contested
    assert found.status is (Status.LOST if unclear else status)
    assert found.belief is given.belief


@pytest.mark.parametrize("measured", [True, False])
def test_below_the_mass_of_a_split_it_has_to_converge_anew(measured):
    given = State(Belief(0.39))
    found = weighing(True).in_one_place(given, measured=measured, was_unclear=True)
    assert found.status is Status.LOST
    assert found.belief.status is Status.SEARCHING
    assert isnan(found.belief.agreement_start_m)
    assert (found.unclear, found.contested) == (False, False)


def test_another_reading_of_headings_makes_it_contested():
    found = weighing(True).in_one_place(State(Belief(1.0)), measured=True, was_unclear=False)
    assert (found.status, found.unclear, found.contested) == (Status.LOST, False, True)
    both = weighing(True).in_one_place(State(Belief(0.5)), measured=False, was_unclear=False)
    assert (both.status, both.unclear, both.contested) == (Status.LOST, True, True)


@pytest.mark.parametrize("status", [Status.SEARCHING, Status.LOST, Status.OUTSIDE])
def test_only_what_claims_a_position_can_be_lost(status):
    given = State(Belief(0.1), status)
    assert weighing(True).in_one_place(given, measured=False, was_unclear=True) is given
    nothing = State(None)
    assert weighing(True).in_one_place(nothing, measured=False, was_unclear=True) is nothing


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
    assert TimingState() == (-inf, -inf)


def test_a_rest_in_doubt_makes_it_contested():
    found = weighing(left=True).in_one_place(State(Belief(0.99)), measured=True, was_unclear=False)
    assert (found.status, found.unclear, found.contested) == (Status.LOST, False, True)
