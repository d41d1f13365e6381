"""Elementary functions of compiled loops in double precision, compared with SciPy's and NumPy's."""

import numpy as np
from numba import njit
from scipy.stats import norm

from mapfilter.positioning.normal_kernels import exp64, sin_cos64, tail64


@njit
def elementary(x, out):
    for i in range(x.size):
        out[0, i] = exp64(x[i])
        out[1, i], out[2, i] = sin_cos64(x[i])
        out[3, i] = tail64(x[i])


def values(x):
    out = np.empty((4, x.size))
    elementary(x, out)
    return out


def test_exponentials_are_good_to_the_tenth_digit():
    x = np.concatenate([np.linspace(-699.9, 699.9, 20_001), np.linspace(-1e-3, 1e-3, 11)])
    np.testing.assert_allclose(values(x)[0], np.exp(x), rtol=1e-10)
    assert (values(np.array([0.0]))[0] == 1.0).all()


def test_nothing_is_less_than_the_least_exponential():
    found = values(np.array([-700.0, -701.0, -1e9]))[0]
    np.testing.assert_allclose(found, np.exp(-700.0), rtol=1e-10)


def test_sines_and_cosines_within_a_quarter_of_a_turn():
    angle_rad = np.linspace(-np.pi / 2, np.pi / 2, 5001)
    found = values(angle_rad)
    np.testing.assert_allclose(found[1], np.sin(angle_rad), rtol=0, atol=1e-12)
    np.testing.assert_allclose(found[2], np.cos(angle_rad), rtol=0, atol=1e-12)


def test_tails_are_good_to_the_ninth_digit_far_out_too():
    z = np.concatenate([np.linspace(-37, 37, 20_001), np.linspace(-1e-3, 1e-3, 11)])
    np.testing.assert_allclose(values(z)[3], norm.sf(z), rtol=1e-9)


def test_what_is_farther_is_next_to_nothing():
    beyond = values(np.array([40.0, 1e3, 1e9]))[3]
    assert (beyond >= 0).all()
    assert (beyond < 1e-300).all()
    assert (values(np.array([-40.0, -1e3, -1e9]))[3] == 1.0).all()
