"""Which options and rules a belief has by the evidence that there is, by hand."""

from dataclasses import replace
from math import inf
from types import SimpleNamespace

import pytest
from made_filters import belief

from mapfilter._threads import ONE
from mapfilter.filters.contract import Status
from mapfilter.filters.particle import ParticleOptions
from mapfilter.positioning.bayes.beliefs.belief_filters import BeliefFilters
from mapfilter.positioning.bayes.carriageways import CarriagewayFilters
from mapfilter.positioning.bayes.rivals.alternative import AlternativeRules
from mapfilter.positioning.bayes.rivals.hold_rules import HoldRules, PullRules
from mapfilter.positioning.bayes.state import BayesState
from mapfilter.positioning.gnss.source import GnssSource
from mapfilter.positioning.gnss.state import GnssState


def numbers(most):
    return ParticleOptions(max_particles=most, min_search_particles=most // 2, min_particles=50)


def rules(start):
    return AlternativeRules(start_log_odds=start)


def model(*cells):
    motion = SimpleNamespace(corners_per_m=0.0)
    return SimpleNamespace(area=SimpleNamespace(cell_ids=cells), threads=ONE, motion=motion)


OWN, BY_POSITIONS, LANES = (3000, -1.0), (1000, -2.0), (500, -3.0)
WITH_CELLS = BeliefFilters(model("A"), numbers(3000), rules(-1.0))
ROADS = BeliefFilters(
    model(), numbers(3000), rules(-1.0), positioned=(numbers(1000), rules(-2.0)),
    carriageways=CarriagewayFilters(model("lanes"), numbers(500), rules(-3.0)),
)  # fmt: skip
WALKER = replace(ROADS, carriageways=None)


def state_of(used_at_m=-inf, *, compass=True, met=None):
    met_at_m = used_at_m if met is None else 1.0 if met else -inf
    own = GnssState(fix_used_at_m=used_at_m, compared_at_m=met_at_m)
    reckoning = replace(BayesState().reckoning, travelled_m=1000.0)
    return BayesState(sources={GnssSource.name: own}, compass=compass, reckoning=reckoning)


@pytest.mark.parametrize(
    ("filters", "state", "settings"),
    [
        (WITH_CELLS, state_of(), OWN),
        (WITH_CELLS, state_of(900.0), OWN),
        # Over roads alone positions count for 200 m.
        (WALKER, state_of(), OWN),
        (WALKER, state_of(799.0), OWN),
        (WALKER, state_of(801.0), BY_POSITIONS),
        (replace(WALKER, model=model("A")), state_of(), BY_POSITIONS),
        # A vehicle is in a lane as long as nothing but its turns has located it.
        (ROADS, state_of(compass=False), LANES),
        (ROADS, state_of(compass=True), OWN),
        (ROADS, state_of(801.0, compass=False), BY_POSITIONS),
        (ROADS, state_of(799.0, compass=False), OWN),
        (ROADS, state_of(compass=False, met=True), OWN),
        (replace(ROADS, model=model("A")), state_of(compass=False), BY_POSITIONS),
    ],
)
def test_numbers_and_rules_by_what_is_measured(filters, state, settings):
    most, start = settings
    assert filters.options_of(state) == numbers(most)
    assert filters.rules_of(state) == rules(start)
    made = filters.filter_of(state)
    assert made.model is (filters.carriageways.model if settings == LANES else filters.model)
    # Every place times every heading, where no compass tells these.
    more = 1 if state.compass else 6
    assert made.options.max_particles == more * most
    assert made.options.min_search_particles == (1 if state.compass else 3) * most // 2
    assert made.options.min_particles == 50
    assert filters.log_odds_of_fixes(state) == -inf


def test_what_starts_and_moves_beliefs():
    for compass in (True, False):
        moving = ROADS.moving_filter(state_of(), compass=compass)
        assert moving.model is (ROADS.model if compass else ROADS.carriageways.model)
        assert WALKER.moving_filter(state_of(), compass=compass) is WALKER.by_compass[compass]


@pytest.mark.parametrize(("most", "few"), [(3000, 700), (600, 600)])
def test_beliefs_beside_the_main_one_are_smaller(most, few):
    filters = replace(
        WITH_CELLS, options=numbers(most), holds=HoldRules(particles=700),
        pulls=PullRules(particles=700),
    )  # fmt: skip
    for one in (filters.held_otherwise, filters.alone):
        found = one.options
        assert (found.max_particles, found.min_particles) == (2 * few, few)
        assert found.min_search_particles == few


@pytest.mark.parametrize(("most", "search", "least"), [(9000, 2100, 700), (600, 600, 600)])
def test_a_second_look_has_enough_hypotheses_for_what_is_near(most, search, least):
    filters = replace(WITH_CELLS, options=numbers(most), holds=HoldRules(particles=700))
    found = filters.around.options
    assert found.max_particles == min(4200, most)
    assert (found.min_search_particles, found.min_particles) == (search, least)


SEARCHED, FOUND = belief(Status.SEARCHING), belief(Status.CONVERGED)


@pytest.mark.parametrize(
    ("changes", "before", "taken_over", "asks"),
    [
        ({}, SEARCHED, False, True),
        ({"belief": belief(Status.TRACKING)}, SEARCHED, False, True),
        ({"belief": SEARCHED}, SEARCHED, True, False),
        ({}, FOUND, False, False),
        ({}, FOUND, True, True),
        ({"compass": False}, SEARCHED, False, False),
        ({"belief": None}, SEARCHED, False, False),
    ],
)
def test_who_has_just_found_a_place_looks_again(changes, before, taken_over, asks):
    state = replace(state_of(), **{"belief": FOUND, **changes})
    assert WITH_CELLS.asks_for_look(before, state, taken_over=taken_over) == asks
    unwatched = replace(WITH_CELLS, holds=HoldRules(watched=False))
    assert not unwatched.asks_for_look(before, state, taken_over=taken_over)


@pytest.mark.parametrize(("used_at_m", "asks"), [(800.0, False), (799.0, True)])
def test_positions_of_the_last_200_m_need_no_second_look(used_at_m, asks):
    state = replace(state_of(used_at_m), belief=FOUND)
    assert WITH_CELLS.asks_for_look(SEARCHED, state, taken_over=False) == asks


def test_the_map_may_start_where_there_are_no_cells():
    assert ROADS.map_may_start
    assert not WITH_CELLS.map_may_start
    assert not replace(ROADS, grid=True).map_may_start
