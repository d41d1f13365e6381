"""The notes on motion without directions and on fixes without errors, by hand."""

import numpy as np
import pandas as pd
import pytest

from mapfilter.positioning.assumed_errors import assumed_note, undirected_notes
from mapfilter.positioning.bayes.options import BayesFilter, GridFilter
from mapfilter.positioning.kalman.filter import KalmanFilter
from mapfilter.tracks.log import make_log

CRS = "EPSG:32635"
LACKING = "motion: no headings and no turns at all (a yaw rate, turns or a compass)"
BY_WAYS = f"{LACKING}: hypotheses follow the ways, and are soon on many of them"
THINNED = (
    f"{LACKING}: of positions less than 2.5 of their deviations, or 25 m, of way apart only the "
    "first is used: without directions the others would be taken for errors that last"
)


def fixes(variance_m2=25.0, north_m2=None):
    columns = {"time_s": [0.0, 1.0, 2.0], "east_m": 385_000.0, "north_m": 6_672_000.0}
    north_m2 = variance_m2 if north_m2 is None else north_m2
    variances = {"var_east_m2": variance_m2, "var_north_m2": north_m2, "cov_east_north_m2": 0.0}
    return pd.DataFrame(columns).assign(**variances)


def moved(step_m=(1.0, 2.0, 0.0), **columns):
    motion = pd.DataFrame({"time_s": [0.0, 1.0, 2.0], "step_m": step_m})
    return motion.assign(**columns)


@pytest.mark.parametrize(
    ("motion", "options", "note"),
    [
        (moved(), BayesFilter(vehicle=True), BY_WAYS),
        # The first row turns by nothing.
        (moved(turn_rad=[0.0, np.nan, np.nan]), BayesFilter(vehicle=True), BY_WAYS),
        (moved(), BayesFilter(), THINNED),
        (moved((np.nan, 1.0, np.nan)), BayesFilter(), THINNED),
        (moved(), GridFilter(), THINNED),
        (moved(), GridFilter(vehicle=True), THINNED),
        (moved(turn_rad=[np.nan, 0.0, np.nan]), BayesFilter(), None),
        (moved(heading_rad=[0.5, np.nan, np.nan]), BayesFilter(vehicle=True), None),
        (moved((0.0, 0.0, np.nan)), BayesFilter(), None),
        (moved(), KalmanFilter(), None),
        (moved(), object(), None),
    ],
)
def test_what_follows_from_motion_without_directions(motion, options, note):
    log = make_log(CRS, motion=motion, gnss=fixes())
    assert undirected_notes(log, options) == (() if note is None else (note,))


def test_walkers_without_positions_have_none_that_are_left_out():
    log = make_log(CRS, motion=moved())
    assert undirected_notes(log, BayesFilter()) == ()
    assert undirected_notes(log, BayesFilter(vehicle=True)) == (BY_WAYS,)


def test_ranges_are_positions_too():
    ranges = pd.DataFrame({
        "time_s": [0.0], "satellite": ["G01"], "pseudorange_m": [2.1e7],
        "x_m": [1.5e7], "y_m": [1e7], "z_m": [2e7],
    })  # fmt: skip
    log = make_log(CRS, motion=moved(), pseudoranges=ranges)
    assert undirected_notes(log, BayesFilter()) == (THINNED,)


@pytest.mark.parametrize(
    ("options", "assumed", "by"),
    [
        (KalmanFilter(fix_sd_m=7.5), "7.5", "filter.kalman.fix_sd_m; "),
        (BayesFilter(), "10", ""),
        (GridFilter(), "10", ""),
    ],
)
def test_the_error_that_is_assumed_is_that_of_the_filter(options, assumed, by):
    # One of the two variances is as little as none.
    log = make_log(CRS, gnss=fixes(north_m2=[25.0, np.nan, 0.0]))
    assert assumed_note(log, options, {"gnss", "motion"}) == (
        f"gnss: 2 fixes without an error: a standard deviation of {assumed} m east and north is "
        f"assumed ({by}in a CSV a column accuracy_m gives it)",
    )


@pytest.mark.parametrize("options", [KalmanFilter(), BayesFilter()])
def test_no_note_where_no_error_is_assumed(options):
    unstated, stated = (make_log(CRS, gnss=fixes(one)) for one in (np.nan, 25.0))
    assert len(assumed_note(unstated, options, {"gnss"})) == 1
    assert assumed_note(unstated, options, {"motion", "pseudorange"}) == ()
    assert assumed_note(stated, options, {"gnss"}) == ()
    assert assumed_note(unstated, object(), {"gnss"}) == ()
    assert assumed_note(make_log(CRS, motion=moved()), options, {"gnss"}) == ()
