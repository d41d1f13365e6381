"""A belief that begins anew at a fix, of which no part of the error lasts: numbers by hand."""

import numpy as np
import pytest

from mapfilter.filters.gaussian import EKF
from mapfilter.models.state import MOVING
from mapfilter.positioning.epochs import GnssFix
from mapfilter.positioning.kalman.belief import SumBelief
from mapfilter.positioning.kalman.disputed import Ruling
from mapfilter.positioning.kalman.fix_errors import FixErrors
from mapfilter.positioning.kalman.fixing import FixWeighing
from mapfilter.positioning.kalman.models import KalmanOptions
from mapfilter.positioning.kalman.reckoning import RECKONED


@pytest.mark.parametrize("own", [RECKONED, MOVING])
def test_between_a_new_belief_and_a_fix_nothing_lasts_that_is_not_assumed(own):
    """A fix of 4 m, 900 m east of a belief that has just begun: the middle, out to both."""
    options = KalmanOptions(fix_lasting_share=0.0, fix_lasting_m=0.0)
    how = FixWeighing(options, own, own, EKF, own.size)
    belief, fix = SumBelief.start(np.zeros(own.size), np.eye(own.size)), GnssFix(900.0, 0.0, 16, 16)
    found = how.weighed(belief, FixErrors(), fix, 0.0, drift_deg_per_sqrt_m=0.6)
    assert found.ruling is Ruling.EITHER
    where, moments = [own.east, own.north], found.belief.moments
    np.testing.assert_allclose(moments.mean[where], [450.0, 0.0])
    covariance_m2 = moments.covariance[np.ix_(where, where)]
    np.testing.assert_allclose(covariance_m2, [[450.0**2 + 16, 0.0], [0.0, 16.0]])
    assert found.errors.lasting_m == 0.0
