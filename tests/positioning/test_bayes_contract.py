"""The map filters keep the contract, live and in replay; hostile logs are told, never fatal."""

import pickle
from dataclasses import fields, replace
from functools import cached_property
from math import nan, pi

import numpy as np
import pandas as pd
import pytest
from cross_world import CRS, EAST, WALK, walk_log, walk_tables

from mapfilter.filters.contract import MotionStep, Reason, Status, UpdateInfo
from mapfilter.filters.grid import GridFilter
from mapfilter.filters.particle import ParticleFilter, ParticleOptions
from mapfilter.positioning.bayes.beliefs.first_hypotheses import Start
from mapfilter.positioning.bayes.beliefs.model import BayesModel
from mapfilter.positioning.bayes.filter import BayesPositioner
from mapfilter.positioning.bayes.grid import StreetGrid
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.bayes.options import GridFilter as GridOptions
from mapfilter.positioning.bayes.sources.evidence import RadioReading
from mapfilter.positioning.bayes.sources.timing import TimingSource
from mapfilter.positioning.loop import estimate_of, locate
from mapfilter.positioning.merging import epochs
from mapfilter.positioning.step_output import UnusedReading
from mapfilter.testing import ContractError, check_belief_filter
from mapfilter.tracks.log import make_log

FEW = ParticleOptions(max_particles=4000, min_search_particles=2000, min_particles=500)
READING = RadioReading(0, 0.5, under_null=-0.3, length_m=5.0)


@pytest.fixture(scope="module")
def positioner(area):
    return BayesFilter(max_particles=4000, min_search_particles=2000, min_particles=500).over_area(
        area
    )


def filters(area):
    model = BayesModel(area)
    return {
        "bayes": lambda: ParticleFilter(model, FEW),
        "grid": lambda: GridFilter(StreetGrid(model), FEW),
    }


@pytest.mark.parametrize("name", ["bayes", "grid"])
def test_the_contract(area, name):
    motions = [MotionStep(5.0, 0.1 * i, nan) for i in range(12)]
    readings = [READING if i % 3 else None for i in range(12)]
    check_belief_filter(filters(area)[name], Start(READING), motions, readings)


def test_measurements_that_no_source_uses_are_labelled(positioner):
    class WithoutTiming(BayesPositioner):
        @cached_property
        def sources(self):
            return tuple(one for one in super().sources if not isinstance(one, TimingSource))

    rows = pd.DataFrame({"time_s": [3.0, 4.0], "cell": "W", "reference": "E", "difference_m": 0.0})
    log = walk_log([(EAST, 50)], tdoa=rows)
    given = {field.name: getattr(positioner, field.name) for field in fields(positioner)}
    unused = locate(log, WithoutTiming(**given), np.random.default_rng(0)).estimate.unused
    labelled = [one for one in unused if one.reason is Reason.NOT_USED_BY_FILTER]
    assert labelled == [UnusedReading(3.0, "tdoa", "", Reason.NOT_USED_BY_FILTER, 2)]
    assert {"motion", "serving", "neighbour", "gnss", "pseudorange", "tdoa"} <= positioner.uses


def test_a_grid_uses_no_pseudoranges(area):
    """It said that it does, so that each satellite of each epoch was listed as not used."""
    rows = {"time_s": [3.0, 3.0, 4.5], "satellite": ["G01", "G02", "G01"], "pseudorange_m": 2e7}
    rows |= {"sigma_m": 3.0, "x_m": 2e7, "y_m": 1e7, "z_m": 1e7}
    log = walk_log([(EAST, 50)], pseudoranges=pd.DataFrame(rows))
    grid = GridOptions().over_area(area)
    assert "pseudorange" not in grid.uses
    assert grid.uses | {"pseudorange"} == BayesFilter().over_area(area).uses
    found = locate(log, grid, np.random.default_rng(0)).estimate
    labelled = [one for one in found.unused if one.kind == "pseudorange"]
    assert labelled == [UnusedReading(3.0, "pseudorange", "", Reason.NOT_USED_BY_FILTER, 3)]
    assert 4.5 not in found.time_s


def test_a_filter_that_breaks_the_contract_is_found(area):
    class Greedy(ParticleFilter):
        def update(self, belief, reading, rng):  # noqa: ARG002
            belief.state[0] += 1.0
            return belief, UpdateInfo(Reason.USED, Status.SEARCHING, 1)

    motions = [MotionStep(5.0, 0.0, nan)] * 12
    with pytest.raises(ContractError, match="in place"):
        check_belief_filter(
            lambda: Greedy(BayesModel(area), FEW), Start(READING), motions, [READING] * 12
        )


def found(positioner, log, seed=0, *, smooth=False):
    bound = replace(positioner, smooth=smooth)
    return locate(log, bound, np.random.default_rng(seed)).estimate


def test_live_gives_the_bytes_of_the_replay(positioner):
    log, rng = walk_log(), np.random.default_rng(3)
    track, told = positioner.begin(), []
    for epoch in epochs(log):
        # What is known survives a stop of the program.
        track, rng = pickle.loads(pickle.dumps((track, rng)))
        track, news = positioner.step(track, epoch, rng)
        told.append(news)
    live, replayed = estimate_of(positioner, told), found(positioner, log, 3)
    for name in ("east_m", "north_m", "radii_m", "covariance_m2", "mass_50m", "way_id"):
        assert getattr(live, name).tobytes() == getattr(replayed, name).tobytes(), name
    assert live.status == replayed.status


def test_same_seed_same_bytes_another_seed_others(positioner):
    one, same, other = (found(positioner, walk_log(), seed).east_m for seed in (1, 1, 2))
    assert one.tobytes() == same.tobytes()
    assert one.tobytes() != other.tobytes()


def test_the_walk_is_found_and_matched_to_its_way(positioner):
    log = walk_log()
    estimate = found(positioner, log)
    truth = log.truth
    off_m = np.hypot(estimate.east_m - truth["east_m"], estimate.north_m - truth["north_m"])
    assert estimate.converged_at is not None
    assert off_m[estimate.converged_at :].mean() < 10
    assert estimate.way_id[-1] == 11
    assert 0 <= estimate.way_probability.min() <= estimate.way_probability.max() <= 1


def test_turns_alone_find_the_walk(positioner):
    tables = walk_tables()
    heading = tables["motion"]["heading_rad"].to_numpy()
    turn = np.diff(heading, prepend=np.nan)
    motion = tables["motion"].assign(heading_rad=nan, turn_rad=(turn + pi) % (2 * pi) - pi)
    estimate = found(positioner, walk_log(motion=motion))
    assert np.isfinite(estimate.east_m).all()
    assert not [u for u in estimate.unused if u.kind == "motion"]


def test_smoothing_knows_the_start(positioner):
    log = walk_log()
    forward, hindsight = (found(positioner, log, smooth=smooth) for smooth in (False, True))
    off = [np.hypot(e.east_m - log.truth["east_m"], e.north_m - log.truth["north_m"])
           for e in (forward, hindsight)]  # fmt: skip
    assert off[1][:60].mean() < 0.5 * off[0][:60].mean()
    assert forward.status == hindsight.status


def test_a_rotated_heading_bias_wraps(positioner):
    """West is as good as east: a walk whose headings lie at ±π."""
    log = walk_log(((EAST, 90.0), (pi, 60.0), (-pi, 100.0)))
    estimate = found(positioner, log)
    assert np.isfinite(estimate.radii_m).all()


@pytest.mark.parametrize("seed", range(4))
def test_hostile_logs_are_told_and_never_abort(positioner, seed):
    rng = np.random.default_rng(seed)
    tables = walk_tables(WALK)
    motion, radio = tables["motion"].copy(), tables["radio"].copy()
    count = len(motion)
    motion["turn_rad"] = 0.0
    motion.loc[rng.random(count) < 0.1, "step_m"] = np.nan
    motion.loc[rng.random(count) < 0.1, "heading_rad"] = np.nan
    lost = rng.random(count) < 0.05
    motion.loc[lost, ["heading_rad", "turn_rad"]] = np.nan
    motion.loc[rng.integers(count), "step_m"] = 5000.0
    motion = motion[rng.random(count) > 0.1]
    radio["level_dbm"] = rng.choice([-60.0, -110.5, -47.5, np.nan], len(radio))
    radio["censored"] = np.select(
        [radio["level_dbm"] == -110.5, radio["level_dbm"] == -47.5], [-1, 1], 0
    )
    radio["cell"] = rng.choice(np.array(["W", "E", "NW", "??", None], dtype=object), len(radio))
    stray = pd.DataFrame({"time_s": [30.0, 30.0, 500.0], "role": "neighbour", "arfcn": [7, 7, 9],
                          "level_dbm": [-70.0, nan, -80.0]})  # fmt: skip
    radio = pd.concat([radio, stray])
    radio.loc[radio["time_s"] > 150, "time_s"] += 4000.0
    motion.loc[motion["time_s"] > 150, "time_s"] += 4000.0
    gnss = pd.DataFrame({"time_s": [200.0, 4200.0], "east_m": [531_000.0, 99_000.0],
                         "north_m": [4_556_000.0, 0.0]})  # fmt: skip
    log = make_log(CRS, motion=motion, radio=radio, gnss=gnss)
    estimate = found(positioner, log, seed)
    reasons = {reading.reason for reading in estimate.unused}
    assert {Reason.NO_STEP, Reason.UNKNOWN_CELL} <= reasons
    assert np.isfinite(estimate.time_s).all()
    assert len(estimate) == len(epochs(log))
    # From the start on there is a position, but where nothing on the map explains what is measured.
    outside = np.array([status is Status.OUTSIDE for status in estimate.status])
    started = np.flatnonzero(np.isfinite(estimate.east_m))[0]
    placed = np.isfinite(np.column_stack([estimate.east_m, estimate.north_m, estimate.radii_m]))
    np.testing.assert_array_equal(placed[started:].all(axis=1), ~outside[started:])
    np.testing.assert_array_equal(placed[started:].any(axis=1), ~outside[started:])


def test_a_log_without_anything_is_an_empty_track(positioner):
    assert len(found(positioner, make_log(CRS))) == 0
    only = make_log(CRS, motion=walk_tables()["motion"])
    estimate = found(positioner, only)
    assert {u.reason for u in estimate.unused} == {Reason.NOT_STARTED}
    assert np.isnan(estimate.east_m).all()


def test_a_fix_pulls_the_belief(positioner):
    log = walk_log()
    place = log.truth.iloc[5]
    gnss = pd.DataFrame({"time_s": [5.0], "east_m": [place.east_m], "north_m": [place.north_m],
                         "var_east_m2": [9.0], "var_north_m2": [9.0]})  # fmt: skip
    estimate = found(positioner, replace(log, gnss=make_log(CRS, gnss=gnss).gnss))
    assert estimate.radii_m[5, 2] < 15


def test_a_belief_that_has_left_the_area_has_an_alternative_in_it(positioner, area):
    """Nothing refutes a belief beyond the map; the phone may have come back nevertheless."""
    log = walk_log()
    rng = np.random.default_rng(0)
    east_m, north_m = area.origin_m[0] - 200.0, area.origin_m[1] + area.size_m[1] / 2
    state = positioner.begin_at(east_m, north_m, 5.0, rng)
    state = replace(state, null=replace(state.null, log_odds=-15.0))
    for epoch in epochs(log)[:12]:
        state, output = positioner.step(state, epoch, rng)
        if output.fix.status is Status.OUTSIDE and epoch.radio:
            break
    assert output.fix.status is Status.OUTSIDE
    assert state.null.log_odds < positioner.rules.start_log_odds
    assert state.alternative is not None
