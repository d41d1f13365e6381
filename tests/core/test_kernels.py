"""Numbers by counting, and functions that vectorise."""

import numpy as np
import pytest
from numba import float64, int64, njit, types
from numba.core import config
from numba.core.errors import TypingError
from scipy import stats

from mapfilter._kernels import (
    as_argument,
    cos_sin32,
    draw_key,
    exp32,
    hashed,
    log32,
    normals,
    on_demand,
    wrap32,
)


@njit
def fill_normals(key, out):
    for i in range(out.shape[1]):
        out[0, i], out[1, i] = normals(hashed(key, np.uint64(i)))


@njit
def elementary(x, out):
    for i in range(x.size):
        out[0, i] = log32(x[i])
        out[1, i] = exp32(-x[i])
        out[2, i], out[3, i] = cos_sin32(wrap32(x[i]))
        out[4, i] = wrap32(x[i])


@pytest.fixture(scope="module")
def drawn():
    out = np.empty((2, 200_000), dtype=np.float32)
    fill_normals(draw_key(np.random.default_rng(5)), out)
    return out


def test_normals_are_normal(drawn):
    for row in drawn:
        # Fixed numbers; at a random key each would fail once in ten thousand.
        assert stats.kstest(row, "norm").pvalue > 1e-4
    assert abs(np.corrcoef(drawn)[0, 1]) < 0.01


def test_neighbours_are_independent(drawn):
    for lag in (1, 2, 7, 64):
        assert abs(np.corrcoef(drawn[0, :-lag], drawn[0, lag:])[0, 1]) < 0.01


def test_same_key_same_numbers(drawn):
    again = np.empty_like(drawn)
    fill_normals(draw_key(np.random.default_rng(5)), again)
    assert again.tobytes() == drawn.tobytes()


@pytest.mark.parametrize("bits", [np.random.PCG64, np.random.PCG64DXSM, np.random.MT19937])
def test_a_key_is_a_whole_number_of_64_bits_whatever_the_generator(bits):
    one, other = np.random.Generator(bits(3)), np.random.Generator(bits(3))
    for _ in range(5):
        assert draw_key(one) == other.integers(0, 2**64, dtype=np.uint64)
    assert one.random() == other.random()


def test_functions_agree_with_numpy():
    x = np.linspace(1e-3, 20.0, 5001).astype(np.float32)
    out = np.empty((5, x.size), dtype=np.float32)
    elementary(x, out)
    exact = x.astype(np.float64)
    np.testing.assert_allclose(out[0], np.log(exact), rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(out[1], np.exp(-exact), rtol=1e-5)
    np.testing.assert_allclose(out[2], np.cos(exact), atol=2e-5)
    np.testing.assert_allclose(out[3], np.sin(exact), atol=2e-5)
    assert np.abs(out[4]).max() <= np.float32(np.pi) + 1e-6
    turns = (out[4] - exact) / (2 * np.pi)
    np.testing.assert_allclose(turns, np.round(turns), atol=1e-6)


def test_addresses_of_a_kernel_that_is_an_argument_are_looked_up_once(monkeypatch):
    of_one, asked = float64(float64), []
    double, triple = (njit([of_one])(one) for one in (lambda x: 2 * x, lambda x: 3 * x))
    call = njit([float64(types.FunctionType(of_one), float64)])(lambda function, x: function(x))
    library = type(triple.get_compile_result(of_one).library)
    look_up = library.get_pointer_to_function

    def counted(self, name):
        asked.append(name)
        return look_up(self, name)

    monkeypatch.setattr(library, "get_pointer_to_function", counted)
    assert as_argument(triple, of_one) is triple
    assert [call(triple, x) for x in (1.0, 2.0, 5.0)] == [3.0, 6.0, 15.0]
    assert len(asked) == len(set(asked)) == 2
    # The other one's are its own, at each call.
    assert [call(double, x) for x in (1.0, 2.0, 5.0)] == [2.0, 4.0, 10.0]
    assert len(asked) == 8
    with pytest.raises(TypingError):
        triple.get_compile_result(int64(int64))


def test_a_function_that_is_not_to_be_compiled_is_an_argument_as_it_is(monkeypatch):
    """With NUMBA_DISABLE_JIT, by which kernels are debugged, a decorator returns the function."""
    given = on_demand(float64(float64), lambda x: 2 * x, argument=True)
    monkeypatch.setattr(config, "DISABLE_JIT", True)
    assert given()(3.0) == 6.0
