"""Fields of sinusoids against their theory; intervals are four standard errors."""

import numpy as np
import pytest

from mapfilter.simulation.worlds.sinusoids import SinusoidField, gauss_markov

DRAWS = 3000
LENGTH_M = 50.0


@pytest.fixture(scope="module")
def drawn():
    """Values of many fields at five places on a line, at 0, 0.2, 0.5, 1 and 2 lengths."""
    rng = np.random.default_rng(1)
    east = 5e5 + LENGTH_M * np.array([0.0, 0.2, 0.5, 1.0, 2.0])
    north = np.full(5, 4.5e6)
    fields = (SinusoidField.draw(LENGTH_M, rng, count=96) for _ in range(DRAWS))
    return np.array([field.at(east, north) for field in fields])


def test_mean_and_variance(drawn):
    assert np.abs(drawn.mean(axis=0)).max() < 4 / np.sqrt(DRAWS)
    assert np.abs(drawn.var(axis=0) - 1).max() < 4 * np.sqrt(2 / DRAWS)


@pytest.mark.parametrize(("place", "lengths"), [(1, 0.2), (2, 0.5), (3, 1.0), (4, 2.0)])
def test_the_correlation_is_exponential(drawn, place, lengths):
    expected = np.exp(-lengths)
    found = np.mean(drawn[:, 0] * drawn[:, place])
    assert abs(found - expected) < 4 * np.sqrt((1 + expected**2) / DRAWS)


def test_the_correlation_is_the_same_in_all_directions():
    rng = np.random.default_rng(2)
    angle = np.linspace(0.0, np.pi, 4, endpoint=False)
    east, north = np.append(0.0, 30.0 * np.cos(angle)), np.append(0.0, 30.0 * np.sin(angle))
    fields = (SinusoidField.draw(LENGTH_M, rng, count=96) for _ in range(DRAWS))
    values = np.array([field.at(east, north) for field in fields])
    found = np.mean(values[:, :1] * values[:, 1:], axis=0)
    assert np.abs(found - np.exp(-0.6)).max() < 4 * np.sqrt(1.4 / DRAWS)


def test_values_are_nearly_normal(drawn):
    kurtosis = np.mean(drawn[:, 0] ** 4)
    # The fourth moment of a normal distribution is 3, with a variance of 96 / n.
    assert abs(kurtosis - 3) < 4 * np.sqrt(96 / DRAWS) + 3 / 96


def test_one_field_has_unit_variance_over_a_wide_area():
    rng = np.random.default_rng(3)
    field = SinusoidField.draw(20.0, rng)
    east, north = rng.uniform(0, 1e5, (2, 20_000))
    assert np.var(field.at(east, north)) == pytest.approx(1.0, abs=0.05)


def test_positions_are_evaluated_one_by_one_alike():
    field = SinusoidField.draw(20.0, np.random.default_rng(4))
    east, north = np.random.default_rng(5).uniform(0, 1e3, (2, 5000))
    together = field.at(east, north)
    assert np.array_equal(together[4000:4010], field.at(east[4000:4010], north[4000:4010]))


def test_gauss_markov_correlation():
    rng = np.random.default_rng(6)
    time = np.array([0.0, 1.0, 3.0, 8.0])
    drawn = np.array([gauss_markov(time, 4.0, rng) for _ in range(20_000)])
    found = drawn.T @ drawn / len(drawn)
    expected = np.exp(-np.abs(time[:, None] - time) / 4.0)
    assert np.abs(found - expected).max() < 4 * np.sqrt(2 / 20_000)


def test_gauss_markov_of_no_length_is_white():
    white = gauss_markov(np.arange(10_000.0), 0.0, np.random.default_rng(7))
    assert abs(np.mean(white[1:] * white[:-1])) < 4 / 100
