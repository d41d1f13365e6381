"""Filters that options made for an area or for sites take what a log states, as options do."""

import pickle
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from cross_world import WALK, walk_log

import mapfilter as mf
from mapfilter.positioning.bayes.rivals.alternative import AlternativeRules

LTE_M = 299_792_458 / 30.72e6 * 8


@pytest.fixture(scope="module")
def lte(database):
    """Half of the walk, with timing advances of LTE, true ones of the serving cell."""
    walk = walk_log(WALK[:2])
    radio, at = walk.radio.copy(), walk.truth.drop_duplicates("time_s").set_index("time_s")
    steps = []
    for row in radio.itertuples():
        known = row.role == "serving" and row.time_s in at.index
        site = database.plan[row.cell] if known else None
        east_m, north_m = at.loc[row.time_s, ["east_m", "north_m"]] if known else (0.0, 0.0)
        away_m = np.hypot(east_m - site.east_m, north_m - site.north_m) if site else 0.0
        steps.append(int(away_m / LTE_M) if site else None)
    radio = radio.assign(timing_advance=pd.array(steps, dtype="Int64"), technology="LTE")
    assert radio["timing_advance"].notna().sum() > 10
    return mf.make_log(walk.crs, motion=walk.motion, radio=radio, truth=walk.truth)


@pytest.mark.parametrize(
    "options", [mf.KalmanFilter(), mf.KalmanFilter(method="ukf", smooth=True), mf.BayesFilter()]
)
def test_a_bound_filter_is_fitted_as_its_options_are(options, database, lte):
    by_options = mf.locate(lte, database, options)
    bound = options.over(database)
    found = mf.locate(lte, database, bound)
    pd.testing.assert_frame_equal(found.to_dataframe(), by_options.to_dataframe())
    assert found.log.notes == by_options.log.notes
    assert "timing advance: steps of 78.07 m, by technology" in found.log.notes
    # What was made before stays as it was.
    assert bound.made_of == options
    in_steps_of_gsm = mf.locate(lte, database, replace(options, timing_step_m=553.6))
    assert not in_steps_of_gsm.to_dataframe().equals(found.to_dataframe())


@pytest.mark.parametrize("options", [mf.KalmanFilter, mf.BayesFilter])
def test_the_class_of_options_is_fitted_as_its_defaults_are(options, database, lte):
    found, by_defaults = mf.locate(lte, database, options), mf.locate(lte, database, options())
    pd.testing.assert_frame_equal(found.to_dataframe(), by_defaults.to_dataframe())
    assert found.log.notes == by_defaults.log.notes
    assert "timing advance: steps of 78.07 m, by technology" in found.log.notes


def test_sites_of_its_own_read_timing_advances_as_the_log_states(database, lte):
    found = mf.locate(lte, filter=mf.KalmanFilter().over_sites(database.plan))
    by_database = mf.locate(lte, database, "ekf")
    pd.testing.assert_frame_equal(found.to_dataframe(), by_database.to_dataframe())
    assert found.log.notes == by_database.log.notes


@pytest.mark.parametrize("options", [mf.KalmanFilter, mf.BayesFilter])
def test_an_option_of_the_user_goes_first(options, database, lte):
    bound = options(timing_step_m=100.0).over(database)
    found = mf.locate(lte, database, bound)
    assert not any("timing advance" in note for note in found.log.notes)


def test_other_options_keep_what_was_replaced_in_a_filter(database):
    options = mf.BayesFilter(level_error_db=7.0)
    rules = replace(AlternativeRules(), converge_log_odds=9.0)
    given = replace(options.over(database), rules=rules, scored=True)
    fitted = replace(options, timing_step_m=78.0, vehicle=True)
    found, plain = given.with_options(fitted), fitted.over(database)
    assert (found.rules, found.scored) == (rules, True)
    assert (found.timing, found.model.motion) == (plain.timing, plain.model.motion)
    assert found.area is given.area
    assert found.made_of == fitted
    assert given.with_options(options).timing == given.timing
    by_hand = replace(given, maker=None)
    assert by_hand.made_of is None
    assert by_hand.with_options(fitted) is by_hand
    assert pickle.loads(pickle.dumps(given)).made_of == options
