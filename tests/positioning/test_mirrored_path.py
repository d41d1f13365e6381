"""A belief by the map alone against the same motion with left and right exchanged."""

from dataclasses import replace
from math import log, pi

import numpy as np
import pandas as pd
import pytest
from block_town import CRS, LATTICE, as_log, drive, make_town, odometry
from hypothesis import given
from hypothesis import strategies as st

from mapfilter.database.build import build_roads
from mapfilter.database.field import RadioField
from mapfilter.database.sources import LayerRoutes
from mapfilter.filters.contract import MotionStep, Status
from mapfilter.filters.hypotheses import Bins
from mapfilter.filters.particle import ParticleBelief
from mapfilter.lattice import Lattice
from mapfilter.positioning.bayes.area.area_map import AreaMap
from mapfilter.positioning.bayes.area.opened_area import open_area
from mapfilter.positioning.bayes.beliefs.path import RecentPath
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.bayes.rivals.mirrored import MirroredTwin, MirrorRules, mirrored_step
from mapfilter.positioning.gnss.source import GnssSource
from mapfilter.positioning.gnss.state import GnssState
from mapfilter.positioning.merging import epochs
from mapfilter.radio.cells import CellPlan
from mapfilter.roads.route_points import RouteSource
from mapfilter.serving.state_file import decode, encode
from mapfilter.tracks.log import make_log

TOWN = make_town(5)
FEW = {"max_particles": 2000, "min_search_particles": 1500, "min_particles": 300}
PLACES, TURNED_RAD = 1000, 1.1 * pi


@pytest.fixture(scope="module")
def town(tmp_path_factory):
    source = RouteSource.of(TOWN.ways, None, None, 6.0)
    return build_roads(LayerRoutes(source, LATTICE), tmp_path_factory.mktemp("town") / "database")


@pytest.fixture(scope="module")
def vehicle(town):
    return BayesFilter(vehicle=True, **FEW).over(town)


def belief(log_evidence, travelled_m=500.0):
    state = np.zeros((8, 1), dtype=np.float32)
    return ParticleBelief(
        state,
        np.zeros(1),
        Bins.over((0.0, 0.0, 100.0, 100.0)),
        np.empty((0, 1), dtype=np.float32),
        travelled_m=travelled_m,
        log_evidence=log_evidence,
    )


def usual(travelled_m=500.0, rules=MirrorRules()):  # noqa: B008
    """The log evidence of a path that fits just as well as one on its own roads must."""
    return -log(PLACES) - rules.usual_nats_per_m * travelled_m - rules.margin_nats


def test_without_a_twin_nothing_is_proven():
    assert not MirrorRules().proven(belief(0.0), None, TURNED_RAD, PLACES)


@pytest.mark.parametrize(("lead", "proven"), [(5.9, False), (6.1, True), (-20.0, False)])
def test_a_belief_that_fits_has_to_lead_its_twin(lead, proven):
    main = belief(usual() + 0.1)
    twin = MirroredTwin(belief(main.log_evidence - lead), 0.0)
    assert MirrorRules().proven(main, twin, TURNED_RAD, PLACES) is proven
    assert not MirrorRules().proven(main, twin, 0.9 * pi, PLACES)


def test_limits_of_what_is_proven_count_as_proven():
    """From few places: 500 m at 0.03 nats each, and 4 nats; half a circle; a lead of 6 nats."""
    rules, turned_rad = MirrorRules(), pi
    for places in (0, 1):
        for log_evidence, lead, proven in (
            (-19.0, 6.0, True), (-19.0, 5.99, False), (-19.1, 6.0, False),
            # And 0.4 of what the twin has lost: (6 + 0.4 * 19.1) / (1 - 0.4) is 22.73.
            (-19.1, 22.7, False), (-19.1, 22.8, True),
        ):  # fmt: skip
            main = belief(log_evidence)
            twin = MirroredTwin(belief(log_evidence - lead), 0.0)
            assert rules.proven(main, twin, turned_rad, places) is proven
            assert not rules.proven(main, twin, turned_rad - 0.01, places)


@pytest.mark.parametrize(("travelled_m", "is_ahead"), [(20.0, False), (20.1, True)])
def test_a_twin_that_starts_within_twenty_metres_is_as_old(travelled_m, is_ahead):
    main = belief(-3.0, travelled_m)
    for places, ahead_nats in ((PLACES, log(PLACES)), (2, log(2)), (1, 0.0), (0, 0.0)):
        twin = MirroredTwin.beside(main, belief(0.0, 0.0), places)
        assert twin.ahead_nats == pytest.approx(ahead_nats if is_ahead else 0.0)
        assert twin.main_log_evidence == -3.0


def test_the_lead_of_a_path_that_fits_no_road_has_to_grow_with_the_way():
    """Where both paths fit badly, their log evidences part by chance: 20 nats in 2 km."""
    rules, main = MirrorRules(), belief(usual() - 60.0)
    lost = main.log_evidence
    assert not rules.proven(main, MirroredTwin(belief(lost - 20.0), 0.0), TURNED_RAD, PLACES)
    enough = (rules.least_lead - rules.lead_share * lost) / (1 - rules.lead_share)
    for more, proven in ((-0.1, False), (0.1, True)):
        twin = MirroredTwin(belief(lost - enough - more), 0.0)
        assert rules.proven(main, twin, TURNED_RAD, PLACES) is proven


def test_a_twin_that_starts_later_owes_nothing_for_finding_its_place():
    main, twin = belief(-30.0), belief(0.0, 0.0)
    late = MirroredTwin.beside(main, twin, PLACES)
    assert late.lead_of(main) == pytest.approx(-log(PLACES))
    assert late.lead_of(replace(main, log_evidence=-35.0)) == pytest.approx(-log(PLACES) - 5.0)
    first = belief(-2.0, 5.0)
    assert MirroredTwin.beside(first, twin, PLACES).lead_of(first) == 0.0


@given(st.lists(st.tuples(st.floats(0.1, 6.0), st.floats(-3.0, 3.0)), min_size=1, max_size=60))
def test_the_path_of_mirrored_steps_is_the_mirrored_path(steps):
    path, other = RecentPath(), RecentPath()
    for step_m, heading_rad in steps:
        step = MotionStep(step_m, heading_rad)
        path, other = path.moved(step), other.moved(mirrored_step(step))
    np.testing.assert_allclose(path.mirrored.earlier_m, other.earlier_m, atol=1e-5)
    assert path.mirrored.turned_rad == path.turned_rad
    assert other.turned_rad == pytest.approx(path.turned_rad)


def test_left_and_right_of_a_step_are_exchanged_and_nothing_else():
    step = MotionStep(1.5, 0.5, -0.1, 2.0, 0.3)
    assert mirrored_step(step) == MotionStep(1.5, -0.5, 0.1, 2.0, 0.3)


def stepped(filter_, log, until_m, seed=1):
    """Yield the state after each epoch."""
    state, rng = filter_.begin(), np.random.default_rng(seed)
    for epoch in epochs(log):
        state, _ = filter_.step(state, epoch, rng)
        yield state
        if state.reckoning.travelled_m > until_m:
            return


def test_no_position_is_claimed_that_leads_its_twin_by_too_little(vehicle):
    path = drive(TOWN, 2, 1500.0)
    rules, before, claimed = vehicle.carriageways.mirror, None, 0
    for state in stepped(vehicle, as_log(path, odometry(path, 2)), 1500.0):
        if state.status is Status.CONVERGED:
            claimed += 1
            assert before.twin.lead_of(before.belief) >= rules.least_lead
            assert state.path.turned_rad >= rules.least_turned_rad
        if state.status is Status.TRACKING:
            assert state.twin is None
        elif state.belief is not None and state.belief.travelled_m > 10:
            assert state.twin is not None or state.status is Status.CONVERGED
        before = state
    assert claimed == 1
    assert state.status is Status.TRACKING


def test_the_twin_of_a_mirrored_drive_lies_on_the_roads(vehicle):
    """The difference of the two log evidences changes its sign with left and right."""
    path = drive(TOWN, 2, 900.0)
    motion = odometry(path, 2)
    leads = []
    for table in (motion, motion.assign(turn_rad=-motion["turn_rad"])):
        quiet = replace(vehicle.carriageways.rules, start_log_odds=1e9)
        strict = replace(vehicle.carriageways.mirror, least_lead=1e9)
        never = replace(vehicle.carriageways, rules=quiet, mirror=strict)
        *_, state = stepped(replace(vehicle, carriageways=never), as_log(path, table), 890.0)
        leads.append(state.twin.lead_of(state.belief))
    assert leads[0] > 6.0
    assert leads[1] < -6.0


def test_where_positions_are_measured_there_is_no_twin(vehicle):
    path = drive(TOWN, 3, 150.0)
    log = as_log(path, odometry(path, 3))
    fix = log.truth.iloc[:1].assign(var_east_m2=9.0, var_north_m2=9.0, cov_east_north_m2=0.0)
    log = make_log(CRS, motion=log.motion, truth=log.truth, gnss=pd.DataFrame(fix))
    for state in stepped(vehicle, log, 150.0):
        assert state.twin is None
    assert vehicle.beliefs.by_carriageways(state) is None
    assert vehicle.beliefs.filter_of(state) is not vehicle.beliefs._by_carriageways


def test_satellites_that_are_compared_but_not_used_yet_end_it_too(vehicle):
    state = vehicle.begin()
    assert vehicle.beliefs.by_carriageways(state, compass=False) is not None
    sources = {**state.sources, GnssSource.name: GnssState(compared_at_m=0.0)}
    state = replace(state, sources=sources)
    assert vehicle.beliefs.by_carriageways(state, compass=False) is None


def test_headings_of_a_compass_and_walkers_have_no_twin(town, vehicle):
    path = drive(TOWN, 3, 150.0)
    compass = as_log(path, odometry(path, 3, compass_sd_deg=5.0))
    turns = as_log(path, odometry(path, 3))
    walker = BayesFilter(vehicle=False, **FEW).over(town)
    for filter_, recorded in ((vehicle, compass), (walker, turns)):
        assert all(state.twin is None for state in stepped(filter_, recorded, 150.0))


def test_a_twin_goes_on_from_a_saved_state(vehicle):
    path = drive(TOWN, 3, 150.0)
    *_, state = stepped(vehicle, as_log(path, odometry(path, 3)), 150.0)
    again = decode(encode({"state": state}), "a file")["state"]
    assert again.twin.lead_of(again.belief) == state.twin.lead_of(state.belief)
    assert np.array_equal(again.twin.belief.state, state.twin.belief.state)


def test_carriageways_are_narrower_than_ways(town):
    area = open_area(town)
    lanes = area.of_carriageways()
    assert np.all(lanes.distance_m >= area.distance_m)
    assert np.array_equal(lanes.on_way, area.on_way)
    # Half a way is 6 m wide, its carriageways 2 m: what lies between is beside them.
    assert lanes.distance_m[area.on_way].max() == pytest.approx(4.0, abs=1.0)
    assert replace(area, carriageway_m=None).of_carriageways() is None


@pytest.mark.parametrize(("half_width_m", "edge_m"), [(1.0, 1.0), (5.0, 2.0), (10.0, 3.0)])
def test_a_carriageway_is_no_wider_than_its_way(half_width_m, edge_m):
    """0.3 of the way, at least 2 m, and never more than the way."""
    away_m = np.array([[0.0, 20.0]], dtype=np.float32)
    on_way = away_m == 0
    field = RadioField(
        Lattice(CRS, 0.0, 20.0, 20.0, 1, 2), (), np.empty((1, 2, 0), dtype=np.float32), away_m,
        np.full_like(away_m, half_width_m), np.ones((1, 2), dtype=np.int64), on_way,
    )  # fmt: skip
    area = AreaMap.of_field(field, CellPlan(CRS, ()), -110.0).of_carriageways()
    assert area.distance_m.tolist() == [[0.0, 20.0 - edge_m]]
