"""Where the exact filter is after a long way without readings, and whether fixes find it there."""

from math import isfinite, nan, pi

import numpy as np
import pytest
from cross_world import LATTICE, STREET_ROW, make_database

from mapfilter.filters.contract import MotionStep
from mapfilter.positioning.bayes.area.opened_area import open_area
from mapfilter.positioning.bayes.options import GridFilter
from mapfilter.positioning.epochs import Epoch, GnssFix

START_M = LATTICE.east_north(STREET_ROW, 7)


@pytest.fixture(scope="module")
def positioner(tmp_path_factory):
    area = open_area(make_database(tmp_path_factory.mktemp("cross")), whole=True)
    return GridFilter().over_area(area)


def after(positioner, heading_rad):
    """State and positions from a known start, 100 m after each other, without any reading."""
    rng, fixes = np.random.default_rng(0), []
    state = positioner.begin_at(*START_M, 3.0, rng)
    for k in range(6):
        step = MotionStep(100.0, heading_rad)
        state, output = positioner.step(state, Epoch(60.0 * (k + 1), (step,)), rng)
        fixes.append(output.fix)
    return state, fixes


@pytest.mark.parametrize("heading_rad", [nan, pi], ids=["to all sides", "out of the area"])
def test_a_fix_finds_the_phone_again(positioner, heading_rad):
    state, _ = after(positioner, heading_rad)
    east_m, north_m = START_M[0] + 150.0, START_M[1]
    epoch = Epoch(400.0, (MotionStep(10.0, heading_rad),), gnss=GnssFix(east_m, north_m, 9.0, 9.0))
    _, output = positioner.step(state, epoch, np.random.default_rng(0))
    assert np.hypot(output.fix.east_m - east_m, output.fix.north_m - north_m) < 5
    assert output.fix.radii_m[2] < 20


def test_a_belief_grows_as_long_as_nothing_is_measured(positioner):
    """What each metre costs all of the mass says nothing of a place."""
    state, fixes = after(positioner, nan)
    radius_m = [fix.radii_m[2] for fix in fixes]
    assert all(map(isfinite, radius_m))
    assert radius_m == sorted(radius_m)
    assert state.belief.weight.sum() == pytest.approx(1.0, abs=1e-4)
