"""Steps that state the error of their sampling: read, moved by, and smoothed with."""

from dataclasses import replace
from math import hypot, nan, pi

import numpy as np
import pandas as pd
import pytest
from cross_world import CRS

from mapfilter.filters.contract import MotionStep, Status
from mapfilter.filters.grid import GridFilter
from mapfilter.models.street_motion import STATES, MotionErrors, move
from mapfilter.positioning.bayes.beliefs.first_hypotheses import Start
from mapfilter.positioning.bayes.beliefs.model import BayesModel
from mapfilter.positioning.bayes.beliefs.path import DeadReckoning
from mapfilter.positioning.bayes.grid import StreetGrid
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.epochs import Epoch, headed
from mapfilter.positioning.kalman.filter import KalmanFilter
from mapfilter.positioning.kalman.reckoning import Reckoning
from mapfilter.positioning.merging import epoch_columns, epochs, make_epoch
from mapfilter.tracks.log import make_log

EXACT = MotionErrors(
    step_sd_m=0.0, heading_sd_rad=0.0, bias_sd_rad=0.0, bias_drift_rad_per_sqrt_m=0.0,
    rate_rad_per_m=0.0, scale_sd=0.0, stretch_sd=0.0, disturbances_per_m=0.0,
)  # fmt: skip
ROUGH = 12.0
STEP = MotionStep(10.0, 0.4, sampling_sd_m=ROUGH)


@pytest.fixture(scope="module")
def positioner(area):
    few = BayesFilter(max_particles=4000, min_search_particles=2000, min_particles=500)
    return few.over_area(area)


def motion(**columns):
    return pd.DataFrame({"time_s": [0.0, 6.0], "step_m": 9.0, "heading_rad": 0.5, **columns})


def test_a_log_without_the_column_has_no_such_error():
    log = make_log(CRS, motion=motion())
    assert "sampling_sd_m" not in log.motion
    assert [one.motion[0].sampling_sd_m for one in epochs(log)] == [0.0, 0.0]


def test_the_column_of_a_log_is_that_of_its_steps():
    log = make_log(CRS, motion=motion(sampling_sd_m=[nan, 4.5]))
    assert [one.motion[0].sampling_sd_m for one in epochs(log)] == [0.0, 4.5]


def test_rows_as_they_arrive_may_have_it():
    assert epoch_columns("motion") == ("step_m", "heading_rad", "turn_rad", "sampling_sd_m")
    with_it, without = ((9.0, 0.5, 0.1, 4.5), (9.0, 0.5, 0.1))
    steps = make_epoch(1.0, {"motion": [with_it, without]}).motion
    assert [one.sampling_sd_m for one in steps] == [4.5, 0.0]


def test_a_table_without_a_usual_column_is_not_read_by_the_next_one():
    log = make_log(CRS, motion=motion(sampling_sd_m=4.5))
    lacking = replace(log, motion=log.motion.drop(columns="turn_rad"))
    with pytest.raises(KeyError, match="turn_rad"):
        epochs(lacking)


def test_turns_keep_it():
    step, heading_rad = headed(MotionStep(9.0, nan, 0.25, sampling_sd_m=4.5, rows=3.0), 1.0)
    assert step == MotionStep(9.0, heading_rad, 0.25, step.spread_m, 4.5, rows=3.0)


def test_hypotheses_spread_to_all_sides_by_it():
    still = np.zeros((STATES, 40_000), dtype=np.float32)
    key = np.uint64(5)
    for errors, along_m in ((EXACT, ROUGH), (replace(EXACT, step_sd_m=9.0), hypot(9.0, ROUGH))):
        errors = replace(errors, typical_step_m=10.0)
        gone = move(still, 10.0, pi / 2, errors, key, ROUGH)[:2].astype(float)
        assert gone.mean(axis=1).tolist() == pytest.approx([0.0, 10.0], abs=0.3)
        assert gone[0].std() == pytest.approx(ROUGH, rel=0.02)
        assert gone[1].std() == pytest.approx(along_m, rel=0.02)


def test_the_grid_spreads_by_it(area):
    grid = GridFilter(StreetGrid(BayesModel(area)))
    belief = grid.init(Start(None, True, *area.origin_m, 50.0), np.random.default_rng(0))
    moved, _ = grid.predict(belief, STEP, np.random.default_rng(0))
    assert moved.waiting[3] - belief.waiting[3] == pytest.approx(ROUGH**2)


def radius_m(positioner, sd_m, step):
    west, south = positioner.area.origin_m
    middle = [
        origin + size / 2
        for origin, size in zip((west, south), positioner.area.size_m, strict=True)
    ]
    state = positioner.begin_at(*middle, sd_m, np.random.default_rng(1))
    status = state.belief.status
    state, output = positioner.step(state, Epoch(1.0, (step,)), np.random.default_rng(2))
    return status, output.fix.radii_m[2], state


def test_a_belief_that_is_tracked_assumes_it_and_one_that_searches_does_not(positioner):
    fine = replace(STEP, sampling_sd_m=0.0)
    for sd_m, expected in ((2.0, Status.TRACKING), (100.0, Status.SEARCHING)):
        status, rough_m, rough = radius_m(positioner, sd_m, STEP)
        _, fine_m, _ = radius_m(positioner, sd_m, fine)
        assert status is expected
        # Smoothing goes by what the steps say, whether or not the belief was tracked.
        assert rough.reckoning.sampling_m2 == ROUGH**2
        if expected is Status.TRACKING:
            assert rough_m > 3 * fine_m
        else:
            assert rough_m == fine_m


def test_a_row_of_length_0_is_a_rest_without_such_an_error(positioner):
    rest = replace(STEP, step_m=0.0)
    still = np.zeros((STATES, 100), dtype=np.float32)
    assert np.array_equal(move(still, 0.0, 0.4, MotionErrors(), np.uint64(5), ROUGH), still)
    assert DeadReckoning().moved(rest) == DeadReckoning()
    _, _, after = radius_m(positioner, 2.0, rest)
    _, _, fine = radius_m(positioner, 2.0, replace(rest, sampling_sd_m=0.0))
    assert after.reckoning.sampling_m2 == 0.0
    assert np.array_equal(after.belief.state, fine.belief.state)


def test_kalman_filters_add_it_to_steps_and_not_to_rests():
    for step, expected in ((STEP, ROUGH**2), (replace(STEP, step_m=0.0), 0.0)):
        fine = replace(step, sampling_sd_m=0.0)
        rough_m2, fine_m2 = (
            Reckoning().moved(one, 0.0, KalmanFilter(), np.zeros(3))[1][1][:2, :2]
            for one in (step, fine)
        )
        np.testing.assert_allclose(rough_m2 - fine_m2, expected * np.eye(2), atol=1e-9)


def test_variances_of_steps_add_up():
    here = DeadReckoning().moved(STEP).moved(replace(STEP, sampling_sd_m=5.0))
    assert here.sampling_m2 == ROUGH**2 + 25.0
    assert here.moved(MotionStep(nan, nan)).sampling_m2 == here.sampling_m2
