"""A known start is claimed from its first epoch on where it is certain enough, and not else."""

from functools import cache

import numpy as np
import pytest
from made_town import Town

from mapfilter.filters.contract import MotionStep, Status
from mapfilter.positioning.bayes.certainty import Recovery
from mapfilter.positioning.bayes.options import BayesFilter, GridFilter
from mapfilter.positioning.epochs import Epoch, GnssFix

TOWN = Town.of(1)
EAST_M, NORTH_M = 500_300.0, 4_500_300.0
STEP, REST = MotionStep(1.0, 0.3), MotionStep(0.0, 0.3)


@cache
def positioner(kind=BayesFilter, **options):
    few = {"max_particles": 400, "min_search_particles": 400, "min_particles": 200}
    return kind(**few, **options).over_area(TOWN.area())


@pytest.mark.parametrize("kind", [BayesFilter, GridFilter])
@pytest.mark.parametrize("motion", [(STEP,), (REST,), ()])
@pytest.mark.parametrize(("sd_m", "expected"), [(5.0, Status.TRACKING), (25.0, Status.UNCERTAIN)])
def test_a_wide_start_is_followed_but_not_claimed(kind, motion, sd_m, expected):
    """Of a start with 25 m 0.86 lie within 50 m, and claims ask for 0.998; nothing else comes."""
    rng = np.random.default_rng(1)
    state = positioner(kind).begin_at(EAST_M, NORTH_M, sd_m, rng)
    assert state.status is expected
    for time_s in range(4):
        state, output = positioner(kind).step(state, Epoch(float(time_s), motion), rng)
        assert output.fix.status is expected
    assert output.fix.mass_50m < 0.9 or expected is Status.TRACKING


def test_how_certain_it_has_to_be_is_an_option():
    rng = np.random.default_rng(1)
    state = positioner(claim_mass=0.8).begin_at(EAST_M, NORTH_M, 25.0, rng)
    assert state.status is Status.TRACKING
    state = positioner().begin_at(EAST_M, NORTH_M, 100.0, rng)
    assert (state.status, state.recovery) == (Status.SEARCHING, None)


def test_a_wide_start_has_to_be_certain_for_some_way():
    """As any position that was not: who stands there is not claimed by what levels tell alone."""
    state = positioner().begin_at(EAST_M, NORTH_M, 25.0, np.random.default_rng(1))
    assert state.recovery == Recovery(0.0, lost=False)


def test_a_fix_at_a_wide_start_is_claimed_at_once():
    rng = np.random.default_rng(1)
    state = positioner().begin_at(EAST_M, NORTH_M, 25.0, rng)
    fix = GnssFix(EAST_M + 5.0, NORTH_M, 16.0, 16.0, 0.0)
    _, output = positioner().step(state, Epoch(0.0, (REST,), gnss=fix), rng)
    assert output.fix.status is Status.TRACKING
