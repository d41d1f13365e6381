"""Which beliefs positions lead, and which they are to prove, by hand."""

from dataclasses import replace

import pytest
from made_filters import SEARCHING, TRACKING, belief

from mapfilter.filters.contract import Status
from mapfilter.positioning.bayes.beliefs.belief_filters import BeliefFilters
from mapfilter.positioning.bayes.rivals.hold_rules import PullRules
from mapfilter.positioning.bayes.state import BayesState
from mapfilter.positioning.gnss.source import GnssSource
from mapfilter.positioning.gnss.state import GnssState
from mapfilter.positioning.sensors.undirected import UndirectedWay
from mapfilter.positioning.sensors.watch import SensorWatch

FILTERS = BeliefFilters(model=None)


def state_of(**changes):
    own = GnssState(fix_used_at_m=10.0)
    given = {"belief": belief(), "status": TRACKING, "sources": {GnssSource.name: own}}
    return BayesState(**given | changes)


class Unaided:
    """A belief without positions, begun from nothing or beside one that was followed."""

    def __init__(self, from_scratch):
        self.from_scratch = from_scratch


SCRATCH, FOLLOWED = Unaided(True), Unaided(False)


@pytest.mark.parametrize(
    ("proven", "unaided", "asks"),
    [
        (False, (), True),
        (True, (), False),
        # One that begins anew is the proof; others are none.
        (False, (SCRATCH,), False),
        (False, (FOLLOWED,), True),
        (False, (FOLLOWED, SCRATCH), False),
        (True, (SCRATCH,), False),
        (True, (FOLLOWED,), False),
    ],
)
def test_proof_is_asked_for_once_and_only_where_there_is_none(proven, unaided, asks):
    assert FILTERS.asks_for_proof(state_of(proven=proven, unaided=unaided)) is asks


@pytest.mark.parametrize(
    ("unaided", "leads"),
    [((), True), ((SCRATCH,), True), ((FOLLOWED,), False), ((SCRATCH, FOLLOWED), False)],
)
def test_of_a_belief_that_is_followed_one_is_begun_without_positions(unaided, leads):
    assert FILTERS.positions_lead(state_of(unaided=unaided)) is leads
    # Whether it was found without them or not.
    assert FILTERS.positions_lead(state_of(unaided=unaided, proven=True)) is leads


@pytest.mark.parametrize(
    ("found", "status", "led"),
    [
        (TRACKING, TRACKING, True), (TRACKING, Status.LOST, False),
        (TRACKING, Status.UNCERTAIN, False), (SEARCHING, Status.SEARCHING, True),
        (SEARCHING, Status.LOST, True), (SEARCHING, Status.OUTSIDE, True),
        (SEARCHING, TRACKING, False), (SEARCHING, Status.CONVERGED, False),
    ],
)  # fmt: skip
def test_beliefs_are_led_while_they_are_followed_or_sought(found, status, led):
    given = state_of(belief=belief(found), status=status)
    assert FILTERS.asks_for_proof(given) is led
    assert FILTERS.positions_lead(given) is (led and status is TRACKING)


def test_what_is_led_by_positions_alone_asks_for_nothing():
    blind = SensorWatch(undirected=UndirectedWay(gone_m=1.0))
    rejecting = GnssState(fix_used_at_m=10.0, rejected_since_s=3.0)
    for changes in (
        {"watch": blind},
        {"belief": None},
        {"sources": {GnssSource.name: GnssState()}},
        {"sources": {GnssSource.name: rejecting}},
    ):
        assert not FILTERS.asks_for_proof(state_of(**changes)), changes
    unwatched = replace(FILTERS, pulls=PullRules(watched=False))
    assert not unwatched.asks_for_proof(state_of())
