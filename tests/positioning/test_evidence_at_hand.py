"""Which filter and which rules hold by the evidence that there is, and those of carriageways."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest
from small_area import make_area

from mapfilter._threads import ONE, Threads
from mapfilter.filters.hypotheses import Bins
from mapfilter.filters.particle import ParticleBelief, ParticleOptions
from mapfilter.models.street_motion import BIAS, EAST, NORTH, STATES, MotionErrors
from mapfilter.models.way_map import MapWeights
from mapfilter.positioning.bayes.beliefs.belief_filters import BeliefFilters
from mapfilter.positioning.bayes.beliefs.model import BayesModel
from mapfilter.positioning.bayes.carriageways import CarriagewayFilters, carriageway_filters
from mapfilter.positioning.bayes.rivals.alternative import AlternativeRules
from mapfilter.positioning.bayes.rivals.hold_rules import HoldRules
from mapfilter.positioning.gnss.source import GnssSource
from mapfilter.positioning.gnss.state import GnssState

MODEL = BayesModel(make_area(), MotionErrors(), MapWeights())
MAP_ALONE = ParticleOptions(max_particles=5000, min_search_particles=2000, min_particles=900)
POSITIONED = replace(MAP_ALONE, max_particles=700, min_search_particles=400, min_particles=300)
ON_LANES = replace(MAP_ALONE, max_particles=8000)
RULES, POSITIONED_RULES, LANE_RULES = (
    AlternativeRules(start_log_odds=odds) for odds in (-1.0, -2.0, -3.0)
)


@dataclass(frozen=True)
class Model:
    """A model whose area has no cells, but for its kernels."""

    motion: MotionErrors = MODEL.motion
    remember: bool = False
    threads: Threads = ONE

    @property
    def area(self):
        return SimpleNamespace(cell_ids=())


def filters(*, cells=False, **changes):
    lanes = CarriagewayFilters(Model(), ON_LANES, LANE_RULES)
    given = {"positioned": (POSITIONED, POSITIONED_RULES), "carriageways": lanes} | changes
    return BeliefFilters(MODEL if cells else Model(), MAP_ALONE, RULES, **given)


def state(travelled_m=500.0, *, compass=False, used_at_m=None, compared=False):
    """A state whose last position was used at a distance; with satellites that were compared."""
    gnss = GnssState()
    if used_at_m is not None:
        gnss = replace(gnss, fix_used_at_m=used_at_m, compared_at_m=used_at_m)
    if compared:
        gnss = replace(gnss, compared_at_m=0.0)
    reckoning = SimpleNamespace(travelled_m=travelled_m)
    sources = {GnssSource.name: gnss}
    return SimpleNamespace(reckoning=reckoning, compass=compass, sources=sources, alternative=None)


def chosen(beliefs, given):
    """The most particles of the filter, and the least odds of the rules, that hold."""
    filter_, rules = beliefs.filter_of(given), beliefs.rules_of(given)
    return filter_.options.max_particles, rules.start_log_odds


@pytest.mark.parametrize(
    ("given", "most", "odds"),
    [
        # Nothing but turns: on carriageways, with many headings.
        (state(), 6 * 8000, -3.0),
        # A compass, or satellites that were there at all: the map alone, on whole streets.
        (state(compass=True), 5000, -1.0),
        (state(compared=True), 6 * 5000, -1.0),
        # A position within the last 200 m.
        (state(used_at_m=300.0), 6 * 700, -2.0),
        (state(used_at_m=300.0, compass=True), 700, -2.0),
        (state(used_at_m=299.9), 6 * 5000, -1.0),
    ],
)
def test_the_evidence_decides_over_an_area_without_cells(given, most, odds):
    beliefs = filters()
    assert chosen(beliefs, given) == (most, odds)
    alone = {-1.0: MAP_ALONE, -2.0: POSITIONED, -3.0: ON_LANES}[odds]
    assert beliefs.options_of(given) is alone
    assert beliefs.by_map_alone(given) == (odds != -2.0)
    assert (beliefs.by_carriageways(given) is beliefs.carriageways) == (odds == -3.0)


def test_with_cells_or_on_a_grid_the_map_starts_nothing():
    for beliefs in (filters(cells=True), filters(grid=True)):
        assert not beliefs.map_may_start
        for given in (state(), state(used_at_m=400.0)):
            assert not beliefs.by_map_alone(given)
            assert beliefs.by_carriageways(given) is None
    assert chosen(filters(cells=True, positioned=None), state()) == (6 * 5000, -1.0)
    assert chosen(filters(cells=True), state()) == (6 * 700, -2.0)


def test_what_a_compass_is_may_be_asked_for_beforehand():
    beliefs = filters()
    assert beliefs.by_carriageways(state(compass=True), compass=False) is not None
    assert beliefs.by_carriageways(state(), compass=True) is None
    for compass, most in ((False, 6 * 8000), (True, 5000)):
        found = beliefs.moving_filter(state(compass=not compass), compass=compass)
        assert found.options.max_particles == most
    assert filters(carriageways=None).by_carriageways(state()) is None


def test_without_a_compass_there_are_more_hypotheses():
    known, unknown = (filters().by_compass[compass].options for compass in (True, False))
    assert known == MAP_ALONE
    assert unknown == replace(MAP_ALONE, max_particles=30_000, min_search_particles=6000)


@pytest.mark.parametrize(("particles", "few"), [(600, 600), (9000, 5000)])
def test_beliefs_with_a_turned_phone_are_smaller(particles, few):
    found = filters(holds=HoldRules(particles=particles)).held_otherwise.options
    assert (found.min_particles, found.min_search_particles) == (few, few)
    assert found.max_particles == 2 * few
    assert found.split_mass == MAP_ALONE.split_mass


def test_a_belief_that_loses_its_compass_has_all_headings():
    count = 400
    given = np.zeros((STATES, count), dtype=np.float32)
    given[EAST], given[NORTH] = 45.0, 35.0
    weight = np.arange(1.0, count + 1)
    belief = ParticleBelief(
        given, np.log(weight / weight.sum()), Bins.over((0.0, 0.0, 90.0, 70.0)),
        np.arange(count, dtype=np.float32)[None, :],
    )  # fmt: skip
    found = filters(cells=True).without_compass(belief, np.random.default_rng(1))
    assert found.state.shape == (STATES, 6 * count)
    np.testing.assert_array_equal(found.kept, np.tile(np.arange(count), 6)[None])
    np.testing.assert_allclose(np.exp(found.log_weight), np.tile(weight / weight.sum(), 6) / 6)
    bias = found.state[BIAS]
    assert np.abs(bias).max() <= np.pi
    assert np.histogram(bias, 4, (-np.pi, np.pi))[0] == pytest.approx([600] * 4, abs=5 * 21.3)
    # Spread over a pixel of 10 m.
    for row, middle_m in ((EAST, 45.0), (NORTH, 35.0)):
        assert np.abs(found.state[row] - middle_m).max() <= 5.0
        assert found.state[row].std() == pytest.approx(10 / 12**0.5, rel=0.05)


@dataclass(frozen=True)
class Whole:
    """An area with carriageways, or without."""

    lanes: object
    points: np.ndarray

    def of_carriageways(self):
        return self.lanes


@dataclass(frozen=True)
class LaneModel:
    area: object
    weights: MapWeights

    @property
    def whole(self):
        return self.area


@pytest.mark.parametrize(
    ("asked", "wanted"), [((0.9, 20.0), (0.99, 50.0)), ((0.995, 80.0), (0.995, 80.0))]
)
@pytest.mark.parametrize(("sd_m", "lane_sd_m"), [(1.5, 1.5), (6.0, 2.0)])
def test_filters_of_carriageways_are_narrower_and_stricter(asked, wanted, sd_m, lane_sd_m):
    lanes = Whole(None, np.zeros((2, 17)))
    model = LaneModel(Whole(lanes, np.zeros((2, 5))), MapWeights(sd_m=sd_m))
    mass, hold_m = asked
    given = replace(MAP_ALONE, switch_mass=mass, switch_hold_m=hold_m)
    found = carriageway_filters(model, MAP_ALONE, RULES, given)
    assert found.model.area is lanes
    assert found.model.weights == replace(model.weights, sd_m=lane_sd_m)
    assert (found.options.switch_mass, found.options.switch_hold_m) == wanted
    assert found.options == replace(
        MAP_ALONE, switch_mass=wanted[0], switch_hold_m=wanted[1]
    )  # fmt: skip
    # A metre costs more than at the true position, and less than off the roads.
    assert found.rules == replace(
        RULES, converge_log_odds=-3.0, map_nats_per_m=0.06, takes_over_searching=True
    )  # fmt: skip
    assert found.places == 17
    none = LaneModel(Whole(None, np.zeros((2, 5))), model.weights)
    assert carriageway_filters(none, MAP_ALONE, RULES, given) is None
