"""Hypotheses beyond the area: where they start, what they cost, and who comes in from there."""

from dataclasses import replace

import numpy as np
import pytest
import small_area
from made_town import CRS, PIXEL_M, SIDE_M, SOUTH_M, WEST_M, Town, slowed, walk_log
from small_area import BANDS, HEIGHT_M, OPTIONS, WIDTH_M, make_area

from mapfilter.filters.belief_models import Cloud
from mapfilter.filters.contract import MotionStep, Status
from mapfilter.lattice import Lattice
from mapfilter.models.level_errors import LevelReport
from mapfilter.models.street_motion import EAST, NORTH, OFF, STATES, MotionErrors
from mapfilter.models.way_map import MapWeights
from mapfilter.positioning.bayes.area.beyond_edge import beyond_edge
from mapfilter.positioning.bayes.beliefs.first_hypotheses import Start
from mapfilter.positioning.bayes.beliefs.model import BayesModel
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.bayes.sources.evidence import RadioReading
from mapfilter.positioning.epochs import Epoch
from mapfilter.positioning.loop import locate

STILL = MotionErrors(
    step_sd_m=0.0, heading_sd_rad=0.0, bias_sd_rad=0.0, bias_drift_rad_per_sqrt_m=0.0,
    disturbances_per_m=0.0, rate_share=0.0, scale_sd=0.0, stretch_sd=0.0,
)  # fmt: skip
MODEL = BayesModel(make_area(), STILL, MapWeights(), evidence=OPTIONS)
REPORT = LevelReport(
    np.array([BANDS["A"], BANDS["B"]], dtype=np.int32), np.array([-75, -83], dtype=np.float32),
    np.zeros(0, dtype=np.int32), np.zeros(0, dtype=np.float32), 0.0,
)  # fmt: skip


def cloud_at(*places):
    state = np.zeros((STATES, len(places)), dtype=np.float32)
    state[EAST], state[NORTH] = np.array(places).T
    return Cloud(state, np.empty((0, len(places)), dtype=np.float32))


def test_one_in_fifty_starts_within_300_m_of_the_area():
    cloud, log_weight = MODEL.start(Start(None), 20_000, np.random.default_rng(1))
    east, north = cloud.state[:2].astype(float)
    beside_m = np.maximum(np.maximum(-east, east - WIDTH_M), np.maximum(-north, north - HEIGHT_M))
    around = beside_m > 0
    assert np.exp(log_weight[around]).sum() == pytest.approx(0.02)
    assert 295 < beside_m.max() <= 300
    # On all sides: a square of 600 m and the area's width or height.
    assert np.all(np.abs(cloud.state[:2, around].mean(axis=1) - [WIDTH_M / 2, HEIGHT_M / 2]) < 20)
    known, _ = MODEL.start(
        Start(None, True, 5e5 + 40, 45e5 + 30, 5.0), 500, np.random.default_rng(1)
    )
    assert known.state[:2].min() > 0


@pytest.mark.parametrize("serving", [BANDS["A"], -1])
def test_there_predictions_of_the_edge_may_hold_or_not(serving):
    """The mean of two likelihoods: that of the nearest pixel, and that of the null hypothesis."""
    inside, outside = (WIDTH_M - small_area.PIXEL_M / 2, 25.0), (WIDTH_M + 80.0, 25.0)
    reading = RadioReading(serving, 0.4, REPORT)
    edge, found = np.zeros(1), np.zeros(2)
    MODEL.weigh(cloud_at(inside), edge, reading)
    cloud, _ = MODEL.weigh(cloud_at(inside, outside), found, reading)
    null = cloud.shared.other_log_likelihood + (-0.7 if serving >= 0 else 0.5) * 0.4
    assert found[0] == pytest.approx(edge[0], abs=1e-5)
    assert found[1] == pytest.approx(np.log((np.exp(edge[0]) + np.exp(null)) / 2), abs=1e-5)
    assert abs(found[1] - found[0]) > 0.01


def edge_and_null(model, readings):
    """Return the log-likelihoods of reports at the nearest pixel, and of the null hypothesis."""
    inside, edge, null = cloud_at((WIDTH_M - small_area.PIXEL_M / 2, 25.0)), [], []
    for reading in readings:
        found = np.zeros(1)
        inside, _ = model.weigh(inside, found, reading)
        edge.append(found[0])
        null.append(inside.shared.other_log_likelihood - 0.7 * 0.4)
    return edge, null


def reports(length_m):
    """Return the report, and one after a distance that is less like the edge's prediction."""
    weaker = REPORT._replace(level_dbm=REPORT.level_dbm - np.float32(9.0))
    return [
        RadioReading(BANDS["A"], 0.4, REPORT),
        RadioReading(BANDS["A"], 0.4, weaker, length_m=length_m),
        RadioReading(BANDS["A"], 0.4, weaker, length_m=length_m),
    ]


def weighed_beyond(model, readings):
    cloud, gained = cloud_at((WIDTH_M + 80.0, 25.0)), []
    for reading in readings:
        found = np.zeros(1)
        cloud, _ = model.weigh(cloud, found, reading)
        gained.append(found[0])
    return gained


def test_what_holds_there_holds_for_all_reports():
    """The mean of two products: a hypothesis does not choose again at each report."""
    readings = reports(0.0)
    edge, null = edge_and_null(MODEL, readings)
    gained = weighed_beyond(MODEL, readings)
    assert sum(gained) == pytest.approx(np.logaddexp(sum(edge), sum(null)) - np.log(2), abs=1e-4)
    chosen_anew = sum(np.logaddexp(e, n) - np.log(2) for e, n in zip(edge, null, strict=True))
    assert abs(sum(gained) - chosen_anew) > 0.05


def test_what_holds_there_is_forgotten_as_faults_are():
    readings = reports(150.0)
    edge, null = edge_and_null(MODEL, readings)
    gained = weighed_beyond(MODEL, readings)
    odds = 0.0
    for k in range(3):
        odds *= np.exp(-150.0 / MODEL.evidence.levels.fault_m) if k else 1.0
        likelihood = (np.exp(edge[k]) + np.exp(odds + null[k])) / (1 + np.exp(odds))
        assert gained[k] == pytest.approx(np.log(likelihood), abs=1e-4)
        odds += null[k] - edge[k]
    far = weighed_beyond(MODEL, [readings[0], replace(readings[1], length_m=1e6)])
    edge, null = edge_and_null(MODEL, [readings[0], replace(readings[1], length_m=1e6)])
    assert far[1] == pytest.approx(np.logaddexp(edge[1], null[1]) - np.log(2), abs=1e-4)


def test_neither_is_ever_certain():
    held = np.array([-100.0, 100.0, -1.0])
    found = beyond_edge(np.array([0.0, 0.0, 0.5]), held, 0.0)
    np.testing.assert_allclose(found.log_odds, [8.0, -8.0, 1.5])
    mixed = np.log([0.5, np.exp(100.0) / 2, (np.exp(-1.0) + np.exp(0.5)) / (1 + np.exp(0.5))])
    np.testing.assert_allclose(found.gained, mixed, rtol=1e-12)


def test_in_the_area_nothing_is_chosen():
    cloud, _ = MODEL.weigh(cloud_at((25.0, 25.0), (-80.0, 25.0)), np.zeros(2), reports(0.0)[0])
    inside, outside = cloud.shared.beyond_odds(cloud.kept)
    assert inside == 0.0
    assert outside != 0.0


def test_a_memory_of_one_report_chooses_anew():
    model = replace(MODEL, remember=False)
    first, second, _ = reports(0.0)
    gained = weighed_beyond(model, [first, second])
    assert gained[1] == pytest.approx(weighed_beyond(model, [second])[0], abs=1e-6)


@pytest.mark.parametrize("length_m", [0.0, 20.0])
def test_a_tracked_belief_withholds_a_part_there_too(length_m):
    """The weights count a part of the levels; what holds there is judged by all of them."""
    first, second, third = (replace(one, tracked=True) for one in reports(length_m))
    share = MODEL.evidence.levels.tracking_share
    assert 0 < share < 1
    levels_only = [replace(one, serving=-1, serving_weight=0.0) for one in (first, second, third)]
    edge, null = [], []
    inside = cloud_at((WIDTH_M - small_area.PIXEL_M / 2, 25.0))
    for one in levels_only:
        found = np.zeros(1)
        inside, _ = MODEL.weigh(inside, found, replace(one, tracked=False))
        edge.append(found[0])
        null.append(inside.shared.other_log_likelihood)
    gained, odds = weighed_beyond(MODEL, levels_only), 0.0
    for k in range(3):
        odds *= np.exp(-length_m / MODEL.evidence.levels.fault_m) if k else 1.0
        both = np.exp(share * edge[k]) + np.exp(odds + share * null[k])
        assert gained[k] == pytest.approx(np.log(both / (1 + np.exp(odds))), abs=1e-4)
        odds += null[k] - edge[k]


def test_a_cell_that_the_map_lacks_is_likelier_there():
    """By half of what the null hypothesis gains from it: 0.5 nats at full weight."""
    found = np.zeros(2)
    MODEL.weigh(cloud_at((25.0, 25.0), (WIDTH_M + 80.0, 25.0)), found, RadioReading(-1, 0.4))
    assert found == pytest.approx([0.0, np.log((1 + np.exp(0.2)) / 2)], abs=1e-6)


@pytest.mark.parametrize("off", [0.0, 0.3, 1.0])
def test_a_metre_costs_the_same_on_and_off_ways_there(off):
    state = cloud_at((-50.0, 20.0)).state
    state[OFF] = off
    moved, log_weight = MODEL.move(state, np.zeros(1), MotionStep(2.0, 0.5), np.uint64(7))
    cost = 0.03 * 2.0
    away = off * np.exp(-0.02) + (1 - off) * (1 - np.exp(-0.002))
    likelihood = away * np.exp(-0.04 * 2.0) + (1 - away) * np.exp(-cost)
    assert log_weight[0] == pytest.approx(np.log(likelihood), abs=1e-5)
    assert moved[OFF, 0] == pytest.approx(away * np.exp(-0.08) / likelihood, abs=1e-5)


def eastern_half(town):
    """Return the map of a town without its western 300 m."""
    area = town.area()
    cut = round(300.0 / PIXEL_M)
    lattice = area.lattice
    east = Lattice(CRS, WEST_M + 300.0, SOUTH_M + SIDE_M, PIXEL_M, lattice.rows, lattice.cols - cut)
    part = {name: np.ascontiguousarray(getattr(area, name)[:, cut:])
            for name in ("level_dbm", "distance_m", "way_id", "on_way")}  # fmt: skip
    return replace(area, lattice=east, **part)


def walk_in(town, seed):
    """Return a walk that starts more than 100 m west of the map, and ends 300 m in it."""
    for number in range(seed, seed + 400):
        log = walk_log(town, number, 1200.0, error_db=3.0)
        east_m = log.truth["east_m"].to_numpy() - WEST_M - 300.0
        inside = np.flatnonzero(east_m > 0)
        stays = inside.size > 130 and (east_m[inside[0] :] > 0).all()
        if east_m[0] < -100 and stays:
            return slowed(log), inside[0]
    raise AssertionError("no such walk")


def test_who_comes_in_from_beyond_is_found():
    town = Town.of(1)
    few = BayesFilter(max_particles=6000, min_search_particles=4000, min_particles=800)
    positioner = few.over_area(eastern_half(town))
    right = 0
    for seed in (0, 1000, 2000, 3000):
        log, entered = walk_in(town, seed)
        found = locate(log, positioner, np.random.default_rng(seed)).estimate
        off_m = np.hypot(found.east_m - log.truth["east_m"], found.north_m - log.truth["north_m"])
        claimed = np.array([one in (Status.CONVERGED, Status.TRACKING) for one in found.status])
        wrong = claimed & (np.asarray(off_m) > 50)
        assert wrong.mean() < 0.05, seed
        right += bool(claimed[entered:].any()) and not wrong[-1]
    assert right >= 2


def test_who_walks_out_is_outside():
    """Tracked from a known start to the edge and 200 m beyond it, by dead reckoning alone."""
    positioner = BayesFilter(max_particles=2000, min_particles=500).over_area(
        eastern_half(Town.of(1))
    )
    rng = np.random.default_rng(0)
    state = positioner.begin_at(WEST_M + 400.0, SOUTH_M + 450.0, 3.0, rng)
    for second in range(60):
        state, _ = positioner.step(state, Epoch(float(second), (MotionStep(5.0, np.pi),)), rng)
    belief = state.belief
    assert float(belief.weight @ belief.state[EAST]) == pytest.approx(-200.0, abs=40.0)
    assert not positioner.area.holds(belief.state[0], belief.state[1], belief.weight)
    assert np.isfinite(belief.log_weight).all()
