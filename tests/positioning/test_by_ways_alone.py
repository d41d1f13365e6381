"""Steps without any direction follow the ways: which rules hold then, by hand."""

from types import SimpleNamespace

import pytest

from mapfilter.positioning.bayes.beliefs.belief_filters import BeliefFilters
from mapfilter.positioning.bayes.rivals.alternative import AlternativeRules
from mapfilter.positioning.gnss.source import GnssSource
from mapfilter.positioning.gnss.state import GnssState
from mapfilter.positioning.sensors.undirected import UndirectedWay

BLIND = UndirectedWay(rows=True, gone_m=500.0)
BY_FIXES = GnssState(compared_at_m=20.0)


def filters(corners_per_m=0.01, grid=False):
    model = SimpleNamespace(motion=SimpleNamespace(corners_per_m=corners_per_m))
    return BeliefFilters(model, rules=AlternativeRules(abandon_after_m=400.0), grid=grid)


def state(undirected=BLIND, gnss=None):
    sources = {GnssSource.name: GnssState() if gnss is None else gnss}
    watch = SimpleNamespace(undirected=undirected)
    return SimpleNamespace(watch=watch, sources=sources, compass=False)


@pytest.mark.parametrize(
    ("given", "of", "followed", "alone"),
    [
        (filters(), state(), True, True),
        # A position was there, used or not.
        (filters(), state(gnss=BY_FIXES), True, False),
        # There were directions; none has moved.
        (filters(), state(BLIND._replace(directed=True)), False, False),
        (filters(), state(BLIND._replace(gone_m=0.0)), False, False),
        # Filters that do not follow ways.
        (filters(corners_per_m=0.0), state(), False, False),
        (filters(grid=True), state(), False, False),
    ],
)
def test_alternatives_last_longer_where_nothing_but_ways_leads(given, of, followed, alone):
    assert given.followed_ways(of) is followed
    assert given.goes_by_ways(of) is alone
    assert given.rules_of(of).abandon_after_m == (3000.0 if alone else 400.0)
