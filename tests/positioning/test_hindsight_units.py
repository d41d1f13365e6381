"""Smoothing a walk whose steps turned out to be in feet."""

import numpy as np
import pytest
from made_town import Town, slowed, walk_log

from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.loop import locate
from mapfilter.tracks.log import make_log

FOOT_M = 0.3048
TOWN = Town.of(1)


@pytest.mark.parametrize("seed", [6, 10])
def test_smoothed_positions_are_those_of_the_unit_that_was_found(seed):
    log = slowed(walk_log(TOWN, seed, error_db=3.0))
    motion = log.motion.assign(step_m=log.motion["step_m"] / FOOT_M)
    log = make_log(log.crs, motion=motion, radio=log.radio, truth=log.truth)
    off_m = {}
    for smooth in (False, True):
        positioner = BayesFilter(smooth=smooth).over_area(TOWN.area())
        found = locate(log, positioner, np.random.default_rng(5)).estimate
        off_m[smooth] = np.hypot(
            found.east_m - log.truth["east_m"], found.north_m - log.truth["north_m"]
        )
    # Read in metres the walk is three times as long, and no place fits; where one is stated, it is
    # wrong until the unit is found.
    early, middle = slice(0, 40), slice(40, 120)
    assert np.nanmedian(off_m[False][early]) > 60
    assert np.nanmedian(off_m[True][early]) < np.nanmedian(off_m[False][early]) / 2
    assert np.median(off_m[True][middle]) < 5
    assert np.isfinite(off_m[True]).sum() > np.isfinite(off_m[False]).sum()
    assert np.nanmedian(off_m[True][-60:]) < 15
