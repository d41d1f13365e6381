"""A belief and its alternative weighed by one epoch's evidence, with made filters."""

from dataclasses import replace
from types import SimpleNamespace

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
    Source,
    belief,
    gaining,
    rival,
    weighed,
)

from mapfilter.filters.contract import Reason, Status
from mapfilter.filters.grid import GridBelief
from mapfilter.models.level_errors import LevelReport
from mapfilter.positioning.bayes.beliefs.new_beliefs import NewBeliefs
from mapfilter.positioning.bayes.beliefs.path import RecentPath
from mapfilter.positioning.bayes.certainty import Recovery
from mapfilter.positioning.bayes.rivals.alternative import NullHypothesis
from mapfilter.positioning.bayes.rivals.bends import Straight
from mapfilter.positioning.bayes.rivals.held import HeldOtherwise
from mapfilter.positioning.bayes.rivals.hold import Hold
from mapfilter.positioning.bayes.sources.evidence import EvidenceUpdate, FixedTerm, RadioReading
from mapfilter.positioning.epochs import Epoch


def test_without_evidence_nothing_changes():
    beliefs = Beliefs()
    assert weighed(beliefs, updates=[EvidenceUpdate(7)]) == (STATE, Reason.USED)
    assert beliefs.filter.readings == []


def test_a_reading_that_is_not_used_changes_the_belief_alone():
    given = gaining(-2.0, reason=Reason.UPDATE_FAILED)
    found, reason = weighed(Beliefs(given))
    assert reason is Reason.UPDATE_FAILED
    assert found.belief.log_evidence == -12.0
    assert found.null is STATE.null


def drained(*_):
    """An update that leaves nothing in the area."""
    return SimpleNamespace(count=0), SimpleNamespace(reason=Reason.NO_CANDIDATES_LEFT)


@pytest.mark.parametrize(
    ("before", "after"),
    [(s, Status.LOST) for s in (CONVERGED, TRACKING, Status.UNCERTAIN)]
    + [(s, s) for s in (SEARCHING, Status.LOST, Status.OUTSIDE)],
)
def test_a_belief_of_which_nothing_is_left_begins_anew(before, after):
    given = replace(
        STATE, status=before, alternative=rival(-3.0), recovery=Recovery(3.0), takeovers=4
    )
    found, reason = weighed(Beliefs(SimpleNamespace(update=drained)), given)
    assert reason is Reason.NO_CANDIDATES_LEFT
    assert (found.belief, found.alternative, found.recovery, found.twin) == (None,) * 4
    assert (found.status, found.null, found.takeovers) == (after, NullHypothesis(), 4)
    assert found.sources is STATE.sources


def test_a_belief_that_agrees_with_nothing_stays():
    found, reason = weighed(Beliefs(gaining(-2.0, reason=Reason.NO_CANDIDATES_LEFT)))
    assert reason is Reason.NO_CANDIDATES_LEFT
    assert (found.belief.log_evidence, found.status) == (-12.0, TRACKING)
    assert found.null is STATE.null


def test_a_belief_is_weighed_and_the_null_hypothesis_beside_it():
    found, reason = weighed()
    assert (found.status, found.belief.log_evidence, reason) == (TRACKING, -12.0, Reason.USED)
    # -1.5 under it and -2 under the belief; 10 m on the map at 0.1 nats.
    assert found.null.log_odds == pytest.approx(-6.0 - 1.5 - 1.0 + 2.0)
    assert found.null.travelled_m == 40.0
    assert (found.alternative, found.takeovers, found.alternatives) == (None, 0, 0)
    assert found.sources is STATE.sources
    kept = replace(
        STATE, contested=True, walking_rad=0.3, heading_rad=0.2, compass=False, takeovers=4,
        alternatives=5, recovery=Recovery(3.0), hold=Hold(-1.0, 0.5),
        straight=Straight(3.0, 4.0, 9.0),
    )  # fmt: skip
    found, _ = weighed(state=kept)
    names = (
        "contested walking_rad straight heading_rad compass takeovers alternatives recovery hold "
        "watch"
    )
    for name in (*names.split(), "path", "reckoning", "reported", "last_fix"):
        assert getattr(found, name) == getattr(kept, name), name


@pytest.mark.parametrize(("searching", "least"), [(True, -12.0), (False, -12.0)])
def test_the_null_hypothesis_is_bounded(searching, least):
    status = SEARCHING if searching else TRACKING
    given = replace(STATE, belief=belief(status), null=NullHypothesis(-11.9, 40.0))
    found, _ = weighed(Beliefs(gaining(+5.0)), given)
    assert found.null.log_odds == least


@pytest.mark.parametrize(
    ("status", "measured", "tracked"),
    [(TRACKING, True, True), (TRACKING, False, False), (SEARCHING, True, False)],
)
def test_a_belief_is_tracked_where_motion_is_measured(status, measured, tracked):
    beliefs = Beliefs()
    weighed(beliefs, replace(STATE, belief=belief(status)), measured=measured)
    (reading,) = beliefs.filter.readings
    assert reading.tracked is tracked
    assert reading.belief.status is status
    assert reading.terms == (TERM,)


@pytest.mark.parametrize(
    ("changes", "state", "doubted"),
    [
        ({}, {}, False),
        ({}, {"null": NullHypothesis(-4.9, 30.0)}, True),
        # By the map alone a path has to be distinctive.
        ({"by_map": True}, {}, True),
        # An alternative close behind, or one in another unit that keeps up.
        ({}, {"alternative": rival(-1.0)}, True),
        ({}, {"alternative": rival(-9.0)}, False),
        ({"unit_m": 0.3}, {"alternative": rival(-9.0, hold=Hold(step_unit_m=0.3))}, True),
        ({"unit_m": 0.3}, {"alternative": rival(-11.0, hold=Hold(step_unit_m=0.3))}, False),
    ],
)
def test_when_a_belief_does_not_converge(changes, state, doubted):
    beliefs = Beliefs(**changes)
    weighed(beliefs, replace(STATE, belief=belief(SEARCHING, -10.0), **state))
    assert beliefs.filter.readings[0].doubted is doubted


@pytest.mark.parametrize("positioned", [False, True])
def test_without_motion_and_positions_none_converges(positioned):
    beliefs, searching = Beliefs(positioned=positioned), belief(SEARCHING, -10.0)
    given = replace(STATE, belief=searching, alternative=rival(-19.0, null=-5.0))
    weighed(beliefs, given, measured=False)
    assert [one.doubted for one in beliefs.filter.readings] == [not positioned] * 2


@pytest.mark.parametrize("null", [-4.9, -5.0])
def test_an_alternative_is_weighed_by_its_own_terms(null):
    own = FixedTerm(np.full(1, -7.0))
    updates = [EvidenceUpdate(None, (TERM,), (own,), -1.5, alternative_under_null=-3.0)]
    beliefs = Beliefs()
    found, _ = weighed(beliefs, replace(STATE, alternative=rival(-3.0, null=null)), updates)
    main, other = beliefs.filter.readings
    assert (main.terms, other.terms) == ((TERM,), (own,))
    assert other.doubted is (null > -5.0)
    assert not other.tracked
    assert found.alternative.belief.log_evidence == -5.0
    assert found.alternative.null.log_odds == pytest.approx(null - 3.0 - 1.0 + 2.0)
    assert (found.takeovers, found.status) == (0, TRACKING)


def test_an_alternative_that_has_won_takes_over_with_its_sources():
    other = rival(9.0, status=CONVERGED, hold=Hold(step_unit_m=0.3))
    given = replace(
        STATE, alternative=other, recovery=Recovery(3.0), hold=Hold(-1.0, 0.5), takeovers=2,
        held=(HeldOtherwise(belief(), Hold(1.0, 3.0), -2.0, 0.0),),
    )  # fmt: skip
    found, _ = weighed(state=given)
    assert (found.status, found.belief.status, found.takeovers) == (TRACKING, TRACKING, 3)
    assert found.belief.log_evidence == 7.0
    assert found.sources == {"one": "other's", "two": 2}
    assert (found.alternative, found.recovery, found.held) == (None, None, ())
    # It reads headings as they are, and lengths in its unit.
    assert found.hold == Hold(1.0, 0.0, 0.3)
    assert found.null.log_odds == pytest.approx(-6.0 - 1.5 - 1.0 + 2.0)


@pytest.mark.parametrize(
    ("changes", "state", "disputed", "starts"),
    [
        ({}, {}, False, False),
        ({}, {}, True, True),
        # 0.5 nats less under it than under the belief: from -0.5 to -1, the odds for a start.
        ({}, {"null": NullHypothesis(-0.5, 30.0)}, False, True),
        ({}, {"null": NullHypothesis(-0.6, 30.0)}, False, False),
        ({"area": Area(inside=False)}, {}, False, True),
        # A search in metres whose speed is a walker's in feet.
        ({"unit_m": 0.3}, {"belief": belief(SEARCHING), "status": SEARCHING}, False, True),
        ({"unit_m": 0.3}, {}, False, False),
        # Beside another one none starts, nor at the moment of convergence.
        ({}, {"alternative": rival(-9.0)}, True, False),
        ({"filter": gaining(-2.0, status=CONVERGED)}, {"status": SEARCHING}, True, False),
    ],
)
def test_when_an_alternative_starts(changes, state, disputed, starts):
    given = replace(STATE, alternatives=1, **state)
    if "unit_m" in changes:
        given = replace(given, alternatives=0)
    beliefs = Beliefs(**changes)
    found, _ = weighed(beliefs, given, [UPDATES[0]._replace(disputed=disputed)])
    assert (len(beliefs.filter.priors) == 1) is starts
    assert found.alternatives - given.alternatives == starts
    if starts:
        other = found.alternative
        assert (other.start_m, other.start_s, other.sources) == (40.0, 9.0, {"one": "started"})
        unit = changes.get("unit_m", 1.0)
        # One in another unit is improbable beforehand.
        assert other.main_log_evidence == -12.0 + (0.0 if unit == 1.0 else -4.0)
        assert other.hold == Hold(step_unit_m=unit)
        assert other.null.log_odds == pytest.approx(np.log(1 / 19))


def test_one_source_is_enough_to_dispute_a_belief():
    updates = [UPDATES[0]._replace(disputed=True), EvidenceUpdate(None), EvidenceUpdate(None)]
    assert weighed(updates=updates)[0].alternative is not None


@pytest.mark.parametrize(("shared", "other"), [(None, 0.0), (-6.0, -6.0)])
def test_levels_count_under_the_null_hypothesis_as_no_prediction_has_them(shared, other):
    kept = None if shared is None else SimpleNamespace(other_log_likelihood=shared)
    given = replace(STATE, belief=replace(belief(), shared=kept))
    none = np.zeros(0, dtype=np.int32)
    levels = LevelReport(none, none.astype("f4"), none, none.astype("f4"), 0.0)
    found, _ = weighed(
        state=given, updates=[EvidenceUpdate(None, radio=RadioReading(levels=levels))]
    )
    assert found.null.log_odds == pytest.approx(-6.0 + other - 1.0 + 2.0)
    # Without levels there is nothing to compare.
    found, _ = weighed(state=given)
    assert found.null.log_odds == pytest.approx(-6.0 - 1.5 - 1.0 + 2.0)


@pytest.mark.parametrize(("count", "status"), [(1, TRACKING), (0, Status.OUTSIDE)])
def test_masses_on_a_grid_lie_in_the_area(count, status):
    mass = np.zeros((1, 2, 2), dtype=np.float32)
    mass[0, 0, :count] = 1.0
    model = SimpleNamespace(bias_rad=np.zeros(1), states=lambda row, *_: np.zeros((8, row.size)))
    grid = GridBelief(mass, np.zeros_like(mass), model, status=TRACKING, travelled_m=40.0)
    grid.__dict__["summary"] = belief().summary
    found = weighed(Beliefs(with_summary(grid)), replace(STATE, belief=grid))[0]
    assert found.status is status


def with_summary(grid):
    """A filter that leaves masses as they are."""
    return SimpleNamespace(
        update=lambda *_: (grid, SimpleNamespace(reason=Reason.USED)), init=gaining(0.0).init
    )


def test_a_turned_phone_that_is_ahead_starts_an_alternative_that_is_not_counted():
    found, _ = weighed(Beliefs(contested=True))
    assert found.alternative is not None
    assert found.alternatives == 0
    both, _ = weighed(Beliefs(contested=True), updates=[UPDATES[0]._replace(disputed=True)])
    assert both.alternatives == 1


def test_without_evidence_of_its_own_no_alternative_starts():
    silent = Source(at_first=EvidenceUpdate(None))
    found, _ = weighed(updates=[UPDATES[0]._replace(disputed=True)], source=silent)
    assert (found.alternative, found.alternatives) == (None, 0)


def test_by_the_map_alone_what_speaks_for_no_street_is_not_forgotten():
    given = replace(STATE, null=NullHypothesis(1.0, 30.0))
    found, _ = weighed(Beliefs(by_map=True), given)
    assert found.alternative.null.log_odds == 1.0
    plain, _ = weighed(Beliefs(), given)
    assert plain.alternative.null.log_odds == pytest.approx(np.log(1 / 19))
    # Nor is it where an alternative that is given up would have it begin anew.
    for by_map, log_odds in ((True, 0.5), (False, np.log(1 / 19))):
        other = replace(given, alternative=rival(-40.0))
        found, _ = weighed(Beliefs(by_map=by_map), other)
        assert found.alternative is None
        assert found.null.log_odds == pytest.approx(log_odds)


@pytest.mark.parametrize(("edge", "inside"), [(True, True), (True, False), (False, True)])
def test_at_the_edge_and_beyond(edge, inside):
    given = replace(STATE, null=NullHypothesis(4.0, 30.0))
    found, _ = weighed(Beliefs(area=Area(edge, inside)), given)
    assert found.status is (Status.OUTSIDE if edge or not inside else Status.LOST)
    calm, _ = weighed(Beliefs(area=Area(edge, inside)))
    assert calm.status is (TRACKING if inside else Status.OUTSIDE)


def started_by(path=None, own="started"):
    beliefs, source = Beliefs(), Source(own=own)
    new_beliefs = NewBeliefs(beliefs, (source,))
    updates = [EvidenceUpdate(None, (TERM,), path=path)]
    found = new_beliefs.from_evidence(updates, STATE, Epoch(9.0), np.random.default_rng(1))
    return beliefs.filter.priors, found


def test_a_belief_starts_by_the_evidence_of_all_sources():
    path = RecentPath()
    (prior,), (_, sources) = started_by(path)
    assert (prior.reading.terms, prior.compass, prior.path) == ((TERM,), True, path)
    assert sources == {"one": "started"}
    assert started_by(own=None)[1][1] == {}
    nothing = NewBeliefs(Beliefs(), ()).from_evidence(
        [EvidenceUpdate(None)], STATE, Epoch(9.0), np.random.default_rng(1)
    )
    assert nothing is None
