"""From names, options and classes to a filter over a database."""

import numpy as np
import pytest
from belief_events import Event, run
from cross_world import make_database, walk_log

from mapfilter.errors import ConfigError
from mapfilter.evaluation.accuracy import accuracy
from mapfilter.evaluation.truth import Truth
from mapfilter.filters.candidate import CandidateSearch
from mapfilter.filters.contract import MotionStep
from mapfilter.filters.gaussian import METHODS
from mapfilter.positioning.bayes.options import BayesFilter, GridFilter
from mapfilter.positioning.candidate import CandidateFilter, cell_points
from mapfilter.positioning.kalman.filter import KalmanFilter
from mapfilter.positioning.locators import BUILT_IN, as_filter, filter_options
from mapfilter.positioning.loop import locate

OPTIONS = CandidateFilter(update_length_m=20.0, margin_db=0.0)


def test_options_locate_as_their_filter_of_beliefs(tmp_path):
    database, log = make_database(tmp_path), walk_log()
    rng = np.random.default_rng(0)
    search = CandidateSearch(cell_points(database, 0.0), OPTIONS, database.lattice.resolution_m)
    for ways in (True, False):
        found = locate(log, OPTIONS.over(database, ways=ways), rng).estimate
        assert found.filter == OPTIONS.name == "candidate"
        assert bool(found.way_id.any()) is ways
        truth = Truth.of_table(log.truth)
        assert accuracy(found, truth).switched
    serving = dict(zip(log.radio["time_s"], log.radio["cell"], strict=True))
    first = min(serving)
    events = [Event(first, reading=serving[first])]
    for time_s, *motion in log.motion[["time_s", "step_m", "heading_rad", "turn_rad"]].to_numpy():
        if time_s > first:
            events.append(Event(time_s, MotionStep(*motion), serving.get(time_s)))
    steps = list(run(search, search.init(serving[first], rng), events, rng))
    last = search.locate(steps[-1].belief)
    assert (found.east_m[-1], found.north_m[-1]) == (last.east_m, last.north_m)


def test_the_default_is_the_bayes_filter():
    assert filter_options() == BayesFilter()


def test_every_built_in_filter_has_its_name(tmp_path):
    database = make_database(tmp_path)
    kinds = {"bayes": BayesFilter, "grid": GridFilter, "candidate": CandidateFilter}
    kinds |= dict.fromkeys(METHODS, KalmanFilter)
    assert set(kinds) <= set(BUILT_IN)
    for name in BUILT_IN:
        options = filter_options(name)
        assert options.name == name
        assert type(options) is kinds.get(name, type(options))
        assert hash(options) == hash(filter_options(name))
        bound = as_filter(name, database)
        assert bound.name == name
        assert bound.crs == database.lattice.crs
        assert as_filter(bound, database) is bound


@pytest.mark.parametrize("name", ["bays", "", "kalman"])
def test_an_unknown_name_is_refused_with_those_that_there_are(name):
    with pytest.raises(ConfigError, match=f"filter: expected {', '.join(BUILT_IN)}, or .+found"):
        filter_options(name)


def test_what_is_no_filter_is_refused(tmp_path):
    with pytest.raises(ConfigError, match=r"filter: expected the name of a filter, .*found 3\.0"):
        as_filter(3.0, make_database(tmp_path))
