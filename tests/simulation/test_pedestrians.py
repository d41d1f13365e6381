"""Pedestrians who follow a gas: its field against theory, and walks that keep to the streets."""

import numpy as np
import pytest

from mapfilter.errors import InputError
from mapfilter.lattice import Lattice
from mapfilter.simulation.pedestrians import GasGround, gas_walk

CRS = "EPSG:32632"


@pytest.fixture(scope="module")
def ring():
    """A street of 10 m around a block of 40 m."""
    free = np.zeros((30, 30), dtype=bool)
    free[:, :5] = free[:, 25:] = free[:5] = free[25:] = True
    return GasGround(Lattice(CRS, 0.0, 60.0, 2.0, 30, 30), free, 30.0)


def test_gas_in_a_tube_decays_exponentially():
    tube = GasGround(Lattice(CRS, 0.0, 1.0, 1.0, 1, 400), np.ones((1, 400), dtype=bool), 50.0)
    ways = tube.ways([5.0, 0.5])
    # sinh(a / 2) = h / (2 L) is the decay of the discrete equation.
    decay = 2 * np.arcsinh(1.0 / (2 * 50.0))
    np.testing.assert_allclose(ways[0, 50:150, 0], -decay, rtol=1e-3)
    assert (ways[0, 2, 0], ways[0, 8, 0] < 0) == (pytest.approx(ways[0, 2, 0]), True)
    assert ways[0, 2, 0] > 0
    np.testing.assert_array_equal(ways[..., 1], 0.0)


def test_nothing_flows_through_walls(ring):
    ways = ring.ways([55.0, 30.0])
    # In the middle of the western street, walls stand to the west and the east.
    np.testing.assert_allclose(ways[15, [0, 4], 0], 0.0, atol=2e-3)
    assert (ways[~ring.free] == 0).all()


def test_walks_keep_to_the_streets_and_their_speed(ring):
    for seed in range(6):
        walk = gas_walk(ring, 120, 1.3, np.random.default_rng(seed))
        assert walk.shape == (120, 2)
        assert all(ring.is_free(place) for place in walk)
        strides = np.hypot(*np.diff(walk, axis=0).T)
        assert strides.max() <= 1.3 + 1e-9
        assert np.mean(strides) > 1.1


def test_walks_reach_their_target(ring):
    target = np.array([55.0, 55.0])
    ways, place = ring.ways(target), np.array([5.0, 20.0])
    for _ in range(200):
        place = place + 0.5 * ring.toward(ways, place)
    assert np.hypot(*(place - target)) < 3.0


def test_equal_seeds_give_equal_walks(ring):
    first, again, other = (gas_walk(ring, 50, 1.0, np.random.default_rng(s)) for s in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert (first != other).any()


def test_the_largest_part_is_the_ground():
    free = np.ones((10, 10), dtype=bool)
    free[:, 6] = False
    ground = GasGround(Lattice(CRS, 0.0, 10.0, 1.0, 10, 10), free)
    assert ground.free[:, :6].all()
    assert not ground.free[:, 6:].any()
    for _ in range(20):
        assert ground.is_free(ground.draw_place(np.random.default_rng(3)))


def test_faults_are_told_together(ring):
    lattice = Lattice(CRS, 0.0, 10.0, 1.0, 10, 10)
    with pytest.raises(InputError) as raised:
        GasGround(lattice, np.zeros((10, 10), dtype=bool), -1.0)
    assert len(raised.value.faults) == 2
    with pytest.raises(InputError, match="shape"):
        GasGround(lattice, np.ones((9, 10), dtype=bool))
    for bad in ([30.0, 30.0], [np.nan, 5.0], [-5.0, 5.0]):
        with pytest.raises(InputError, match="open ground"):
            ring.ways(bad)
    for bad in ((0, 1.0), (10, 0.0), (10, np.inf)):
        with pytest.raises(InputError, match="gas walk"):
            gas_walk(ring, *bad, np.random.default_rng(0))
