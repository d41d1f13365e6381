"""Levels with errors that are components of the state: their mean and derivatives by hand."""

import numpy as np

from mapfilter.models.signal_strength import levels, with_errors
from mapfilter.models.state import StateLayout

STATE = StateLayout(5, 0, 1)
"""East, north and three errors in dB."""
AT_10_KM = np.array([1e4, 0.0, 3.0, -2.0, 0.5])


def test_a_level_grows_by_each_of_its_errors_and_falls_with_the_distance():
    sites = [[0.0, 0.0]] * 3
    plain = levels(STATE, sites, 8.0, loss_at_km_db=130.0, exponent=3.0, eirp_dbm=50)
    model = with_errors(plain, [(2, 4), (3, -1), (-1, 4)])
    # 50 - 130 - 30 dB at ten times a kilometre, and the errors of each.
    np.testing.assert_allclose(model.mean(AT_10_KM), [-106.5, -112.0, -109.5], atol=1e-9)
    per_m = -30.0 / np.log(10.0) / 1e4
    expected = [[per_m, 0, 1, 0, 1], [per_m, 0, 0, 1, 0], [per_m, 0, 0, 0, 1]]
    np.testing.assert_allclose(model.jacobian(AT_10_KM), expected, atol=1e-12)
    none = np.zeros((3, 3))
    np.testing.assert_array_equal(plain.jacobian(AT_10_KM)[:, 2:], none)
