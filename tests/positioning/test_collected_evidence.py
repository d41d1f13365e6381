"""What is collected of an epoch's sources, and what of it the state after the weighing keeps."""

from dataclasses import dataclass, field, replace
from types import SimpleNamespace
from unittest.mock import patch

import numpy as np
import pytest
from made_filters import (
    CONVERGED,
    SEARCHING,
    STATE,
    TERM,
    TRACKING,
    UPDATES,
    Area,
    Beliefs,
    belief,
    gaining,
    rival,
    weighed,
)

from mapfilter.filters.contract import Status
from mapfilter.positioning.bayes.beliefs.new_beliefs import NewBeliefs
from mapfilter.positioning.bayes.rivals.held import HeldOtherwise
from mapfilter.positioning.bayes.rivals.hold import Hold
from mapfilter.positioning.bayes.rivals.mirrored import MirroredTwin
from mapfilter.positioning.bayes.rivals.rivals import Rivals
from mapfilter.positioning.bayes.sources.evidence import EvidenceUpdate, FixedTerm
from mapfilter.positioning.bayes.weighing import Weighing, weighed_by
from mapfilter.positioning.epochs import Epoch, ReportRow

HEARD = (ReportRow("serving", "A", None, None, -70.0, False),)


@dataclass
class Asked:
    """A source that notes what it is asked for, and answers as it is told."""

    name: str
    answer: EvidenceUpdate
    asked: list = field(default_factory=list)

    def first_after(self, state, epoch):
        self.asked.append(("first", state.belief, epoch.time_s))
        return EvidenceUpdate("anew")

    def update(self, state, epoch, context):
        assert epoch.time_s == 9.0
        self.asked.append((state.belief, state.alternative, context))
        return self.answer


def collected(*sources, state=STATE, radio=HEARD, due=True):
    travelled = []

    def is_due(history, travelled_m):
        travelled.append((history, travelled_m))
        return due

    by_reports = SimpleNamespace(name="two", due=is_due)
    weighing = Weighing(Beliefs(), by_reports, sources)
    found, updates = weighing.collected(state, Epoch(9.0, radio=radio), 7.0)
    return found, updates, travelled


def test_a_belief_has_the_evidence_of_all_sources():
    one, two = Asked("one", EvidenceUpdate("after", (TERM,))), Asked("two", EvidenceUpdate(2))
    found, updates, travelled = collected(one, two)
    assert [update.state for update in updates] == ["after", 2]
    assert found.sources == {"one": "after", "two": 2}
    assert (found.belief, found.status, found.null) == (STATE.belief, TRACKING, STATE.null)
    (context,) = (asked[2] for asked in one.asked)
    assert (context.particle_spacing_m, context.report_due) == (7.0, True)
    assert travelled == [(2, 40.0)]
    # Where no source has changed neither has the state.
    same = (Asked("one", EvidenceUpdate("before")), two)
    assert collected(*same)[0] is STATE


@pytest.mark.parametrize(("radio", "due"), [((), True), (HEARD, False)])
def test_a_report_is_due_where_there_is_one_and_it_is_its_time(radio, due):
    one = Asked("one", EvidenceUpdate("before"))
    collected(one, radio=radio, due=due)
    assert one.asked[0][2].report_due is False


def test_without_a_belief_sources_read_as_for_the_first_one():
    one = Asked("one", EvidenceUpdate("after"))
    found, updates, _ = collected(one, state=replace(STATE, belief=None))
    assert one.asked == [("first", None, 9.0)]
    assert [update.state for update in updates] == ["anew"]
    assert found.sources == {"one": "anew", "two": 2}


def test_beliefs_that_a_source_has_changed_are_those_of_the_next_source():
    changed, other = belief(log_evidence=-3.0), rival(-4.0)
    for answer, expected in (
        (EvidenceUpdate("before", belief=changed), (changed, None)),
        (EvidenceUpdate("before", alternative=other), (STATE.belief, other)),
    ):
        next_one = Asked("two", EvidenceUpdate(2))
        found, _, _ = collected(Asked("one", answer), next_one)
        assert next_one.asked[0][:2] == expected
        assert (found.belief, found.alternative) == expected


def test_a_position_that_refutes_the_belief_begins_the_search_anew():
    refuting = Asked("one", EvidenceUpdate("lost", refuted=True))
    other = Asked("two", EvidenceUpdate("later", belief=belief(log_evidence=-3.0)))
    found, updates, _ = collected(refuting, other)
    assert found.belief is None
    assert found.status is Status.LOST
    # Of before the refuted reading.
    assert [one.asked[-1] for one in (refuting, other)] == [("first", None, 9.0)] * 2
    assert [update.state for update in updates] == ["anew", "anew"]


@pytest.mark.parametrize(
    ("positions", "proven", "expected"),
    [(False, False, True), (True, False, False), (True, True, True)],
)
def test_a_belief_that_converges_without_positions_is_proven(positions, proven, expected):
    given = replace(STATE, belief=belief(SEARCHING), status=SEARCHING, proven=proven)
    beliefs = Beliefs(gaining(-2.0, status=CONVERGED), positions=positions)
    assert weighed(beliefs, given)[0].proven is expected


def test_it_stays_so_until_it_is_lost_or_another_one_takes_over():
    proven = replace(STATE, proven=True)
    assert weighed(state=proven)[0].proven
    assert not weighed()[0].proven
    assert not weighed(Beliefs(gaining(-2.0, status=SEARCHING)), proven)[0].proven
    searching = replace(proven, belief=belief(SEARCHING))
    assert weighed(state=searching)[0].proven
    taken = replace(proven, alternative=rival(9.0, status=CONVERGED))
    found, _ = weighed(state=taken)
    assert (found.takeovers, found.proven) == (1, False)


def test_an_alternative_that_is_behind_leaves_the_sources():
    assert weighed(state=replace(STATE, alternative=rival(-3.0)))[0].sources is STATE.sources


def test_other_beliefs_stay_but_for_a_takeover():
    turned = HeldOtherwise(belief(TRACKING, -30.0), Hold(1.0, 3.0), -2.0, 0.0)
    alone = HeldOtherwise(belief(TRACKING, -30.0), Hold(), -9.0, 0.0)
    seen = []

    def noted(_, state, *more, measured):
        assert measured
        seen.append((state.held, state.unaided, *more))
        return state

    with patch.multiple(Rivals, turned=noted, unaided=noted):
        given = replace(STATE, held=(turned,), unaided=(alone,))
        weighed(state=given)
        weighed(state=replace(given, alternative=rival(9.0, status=CONVERGED)))
    kept, _, taken, _ = seen
    assert kept[:2] == ((turned,), (alone,))
    assert taken[0] == ()
    # It began as the main belief, and goes with that.
    assert taken[1] == ()


def test_rivals_are_weighed_by_their_terms_too():
    more, seen = FixedTerm(np.full(1, -7.0)), []

    def noted(_, state, evidence, time_s, *, measured):
        seen.append((evidence.terms, time_s, measured))
        return state

    with patch.object(Rivals, "turned", noted):
        weighed(updates=[UPDATES[0]._replace(rival_terms=(more,)), EvidenceUpdate(None)])
        weighed()
    assert seen == [((TERM, more), 9.0, True), ((TERM,), 9.0, True)]


class Half(Area):
    """An area that holds most of a belief, and not all of it."""

    def holds_all(self, *_):
        return False


class Whole(Area):
    """An area that is asked for all places alone."""

    def holds(self, *_):
        return False


def test_most_of_a_belief_in_the_area_is_enough():
    assert weighed(Beliefs(area=Whole()))[0].status is TRACKING
    assert weighed(Beliefs(area=Half()))[0].status is TRACKING
    assert weighed(Beliefs(area=Half(inside=False)))[0].status is Status.OUTSIDE


def test_the_terms_of_an_alternative_are_its_own():
    own = FixedTerm(np.full(1, -7.0))
    updates = [EvidenceUpdate(None, (TERM,), (own,))]
    assert weighed_by(belief(), updates, measured=True).terms == (TERM,)
    assert weighed_by(belief(), updates, measured=True, alternative=True).terms == (own,)
    assert weighed_by(belief(), [EvidenceUpdate(None)], measured=True) is None


@pytest.mark.parametrize("proven", [True, False])
def test_on_carriageways_a_belief_converges_once_it_is_ahead_of_its_twin(proven):
    asked = []

    def is_proven(*given):
        asked.append(given)
        return proven

    lanes = SimpleNamespace(mirror=SimpleNamespace(proven=is_proven), places=17)
    beliefs, searching = Beliefs(lanes=lanes), belief(SEARCHING)
    twin = MirroredTwin(belief(SEARCHING), -3.0)
    weighed(beliefs, replace(STATE, belief=searching, twin=twin))
    assert asked == [(searching, twin, STATE.path.turned_rad, 17)]
    assert beliefs.filter.readings[0].doubted is not proven
    # One is asked for where there is none yet.
    with patch.object(NewBeliefs, "twin", return_value=twin):
        assert weighed(Beliefs(lanes=lanes), replace(STATE, belief=searching))[0].twin is twin


def test_without_carriageways_there_is_no_twin():
    assert weighed(state=replace(STATE, twin=MirroredTwin(belief(), -3.0)))[0].twin is None
    assert weighed()[0].twin is None


def test_an_alternative_starts_with_what_contradicts_the_belief():
    way, seen = object(), []

    def noted(_, state, main, epoch, contradiction, rng):  # noqa: ARG001
        seen.append((main.log_evidence, epoch.time_s, contradiction))

    disputed = UPDATES[0]._replace(disputed=True)
    with patch.object(NewBeliefs, "alternative", noted):
        weighed(updates=[disputed, EvidenceUpdate(None, contradiction=way)])
        weighed(updates=[disputed])
    assert seen == [(-12.0, 9.0, way), (-12.0, 9.0, None)]
