"""Correlated shadowing: exact statistics and independence of what is added."""

from unittest.mock import Mock

import numpy as np
import pytest

from mapfilter.errors import InputError
from mapfilter.lattice import Lattice
from mapfilter.propagation import shadowing
from mapfilter.propagation.shadowing import correlated_field, site_shadowing
from mapfilter.radio.cells import Cell, CellPlan

LATTICE = Lattice("EPSG:32635", 0.0, 240.0, 5.0, 48, 40)
DRAWS = 400


def _interval(samples: np.ndarray) -> tuple[float, float]:
    """Return the mean and four of its standard errors: one test in 16 000 fails by chance."""
    return float(samples.mean()), 4.0 * float(samples.std(ddof=1)) / np.sqrt(len(samples))


@pytest.fixture(scope="module")
def fields() -> np.ndarray:
    return np.array(
        [correlated_field(LATTICE, 8.0, 20.0, np.random.default_rng(i)) for i in range(DRAWS)],
        dtype=np.float64,
    )


def test_mean_and_variance(fields: np.ndarray) -> None:
    mean, error = _interval(fields.mean(axis=(1, 2)))
    assert abs(mean) < error
    variance, error = _interval((fields**2).mean(axis=(1, 2)))
    assert error < 0.05 * 64
    assert abs(variance - 64.0) < error


@pytest.mark.parametrize(
    ("down", "right"), [(0, 1), (1, 0), (0, 4), (4, 0), (3, 4), (8, 6), (20, 0)]
)
def test_correlation_at_lags(fields: np.ndarray, down: int, right: int) -> None:
    rows, cols = fields.shape[1:]
    here, there = fields[:, : rows - down, : cols - right], fields[:, down:, right:]
    covariance, error = _interval((here * there).mean(axis=(1, 2)))
    expected = 64.0 * np.exp(-5.0 * np.hypot(down, right) / 20.0)
    assert abs(covariance - expected) < error


def test_opposite_edges_are_not_joined(fields: np.ndarray) -> None:
    covariance, error = _interval((fields[:, 0] * fields[:, -1]).mean(axis=1))
    assert abs(covariance) < error


def test_corner_points_have_the_variance_of_all_others(fields: np.ndarray) -> None:
    for row, col in ((0, 0), (0, -1), (-1, 0), (24, 20)):
        variance, error = _interval(fields[:, row, col] ** 2)
        assert abs(variance - 64.0) < error


def test_white_noise_and_nothing() -> None:
    white = correlated_field(LATTICE, 3.0, 0.0, np.random.default_rng(0))
    assert np.std(white) == pytest.approx(3.0, rel=0.1)
    assert abs(np.corrcoef(white[:, :-1].ravel(), white[:, 1:].ravel())[0, 1]) < 0.1
    assert not correlated_field(LATTICE, 0.0, 50.0, np.random.default_rng(0)).any()


def _plan(*names: str) -> CellPlan:
    return CellPlan(
        "EPSG:32635",
        tuple(Cell(name, name[0], 0, 0, 30, None, 50, 1800, "omni") for name in names),
    )


def test_sectors_share_what_their_site_has() -> None:
    products, squares, strangers = [], [], []
    for seed in range(200):
        drawn = dict(site_shadowing(_plan("A1", "A2", "B1"), LATTICE, 6.0, 15.0, 0.3, seed))
        a1, a2, b1 = (drawn[name].astype(np.float64) for name in ("A1", "A2", "B1"))
        products.append((a1 * a2).mean())
        strangers.append((a1 * b1).mean())
        squares.append((a1**2).mean())
    for samples, expected in ((products, 0.3 * 36), (strangers, 0.0), (squares, 36.0)):
        mean, error = _interval(np.array(samples))
        assert abs(mean - expected) < error


def test_adding_or_reordering_cells_changes_no_other() -> None:
    few = dict(site_shadowing(_plan("A1", "B1"), LATTICE, 6.0, 15.0, 0.5, 1))
    many = dict(site_shadowing(_plan("B2", "B1", "C1", "A2", "A1"), LATTICE, 6.0, 15.0, 0.5, 1))
    for name, field in few.items():
        np.testing.assert_array_equal(field, many[name])


def test_seeds_and_streams_are_independent() -> None:
    plan = _plan("A1")
    draws = [
        next(iter(site_shadowing(plan, LATTICE, 6.0, 15.0, 0.5, seed, stream=stream)))[1]
        for seed, stream in ((1, "a"), (2, "a"), (1, "b"), (1, "a"))
    ]
    np.testing.assert_array_equal(draws[0], draws[3])
    assert not np.allclose(draws[0], draws[1])
    assert not np.allclose(draws[0], draws[2])


def test_full_share_makes_sectors_alike() -> None:
    drawn = dict(site_shadowing(_plan("A1", "A2"), LATTICE, 6.0, 15.0, 1.0, 1))
    np.testing.assert_array_equal(drawn["A1"], drawn["A2"])


def test_wrong_parameters_are_told_together() -> None:
    with pytest.raises(InputError) as caught:
        list(site_shadowing(_plan("A1"), LATTICE, -1.0, float("nan"), 50.0, -1))
    for name in ("deviation_db", "correlation_m", "site_share", "seed", "per cent"):
        assert name in str(caught.value)


@pytest.mark.parametrize("correlation_m", [20_000.0, 1e5])
def test_a_torus_larger_than_the_memory_is_refused(correlation_m: float) -> None:
    with pytest.raises(InputError, match="shadowing, correlation_m: expected area and ten"):
        correlated_field(LATTICE, 8.0, correlation_m, np.random.default_rng(0))


def test_fields_of_one_network_share_their_spectrum(monkeypatch: pytest.MonkeyPatch) -> None:
    """It took half of the time of each field."""
    computed = Mock(side_effect=shadowing._spectral_amplitude)
    monkeypatch.setattr(shadowing, "_spectral_amplitude", computed)
    cells = tuple(Cell(name, name, 0.0, 0.0, 30.0, 0.0, 50.0, 1800.0) for name in "ABC")
    assert len(list(site_shadowing(CellPlan("EPSG:32635", cells), LATTICE, 8.0, 20.0, 0.5, 1))) == 3
    assert computed.call_count == 1
