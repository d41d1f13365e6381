"""What a log states in place of defaults, at the limits of what counts."""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.kalman.filter import KalmanFilter
from mapfilter.positioning.log_options import by_streets_alone, fitted_to_log, level_step_db
from mapfilter.positioning.logged_errors import _usual_mps, _usual_row_m
from mapfilter.tracks.imu_noise import ImuNoise
from mapfilter.tracks.log import make_log

CRS = "EPSG:32635"
LTE_M = 299_792_458 / 30.72e6 * 8


def log(**columns):
    rows = {"time_s": np.arange(4.0), "role": "serving", "cell": "A", "level_dbm": -80.0}
    rows |= {"timing_advance": 3, "technology": "LTE"} | columns
    return make_log(CRS, radio=pd.DataFrame(rows))


def moved(step_m, *, time_s=None, **given):
    time_s = np.arange(float(len(step_m))) if time_s is None else time_s
    rows = {"time_s": time_s, "step_m": step_m, "heading_rad": 0.0}
    return make_log(CRS, motion=pd.DataFrame(rows), **given)


@pytest.mark.parametrize(
    ("off_m", "changes"), [(0.9, False), (-0.9, False), (1.1, True), (-1.5, True)]
)
def test_a_step_of_timing_advance_within_a_metre_of_the_default_is_the_same(off_m, changes):
    @dataclass(frozen=True)
    class Own:
        timing_step_m: float = LTE_M + off_m

    fitted, notes = fitted_to_log(Own(), log())
    assert fitted.timing_step_m == pytest.approx(LTE_M if changes else LTE_M + off_m, abs=1e-3)
    assert len(notes) == changes


def test_rows_that_state_no_step_of_levels_have_none():
    assert level_step_db(log(level_step_db=[np.nan, np.nan, np.nan, 4.0])) == 0.0
    assert level_step_db(log(level_step_db=[np.nan, 4.0, 4.0, 4.0])) == 4.0


def test_streets_alone_start_where_some_row_moves():
    database = SimpleNamespace(cell_ids=("A",))
    for step_m, alone in (([np.nan, 1.0, np.nan], True), ([np.nan] * 3, False)):
        assert by_streets_alone(BayesFilter(), moved(step_m), database) is alone


def test_rows_move_above_5_centimetres_and_speeds_above_20_a_second():
    """What is exactly that stands still."""
    assert _usual_row_m(moved([0.05, 0.05, 0.05, 3.0, -5.0])) == 4.0
    assert _usual_mps(moved([1.0, 0.2, 0.2, 0.2, 3.0])) == 3.0
    assert _usual_mps(moved([1.0])) == _usual_row_m(moved([0.01])) == 0.0


def test_filters_assume_half_a_degree_and_5_centimetres_at_least():
    stated = ImuNoise(sigma_orient_deg=0.1, sigma_trans_m=0.01)
    fitted, _ = fitted_to_log(KalmanFilter(), moved([0.7] * 5, imu=stated))
    assert (fitted.heading_sd_deg, fitted.step_sd_m) == (0.5, 0.05)
