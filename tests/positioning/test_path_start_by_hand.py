"""Starts by a path whose likelihood at each place and turn is given."""

from types import SimpleNamespace

import numpy as np
import pytest

from mapfilter.positioning.bayes.beliefs import path_start

POINTS = np.array([[5.0, 25.0], [15.0, 35.0]], dtype=np.float32)
AREA = SimpleNamespace(
    points=POINTS, lattice=SimpleNamespace(resolution_m=10.0),
    log_map=lambda sd_m: np.float32([[0.0, -sd_m]]),
)  # fmt: skip
WEIGHTS = SimpleNamespace(sd_m=3.0, over=lambda leg_m: SimpleNamespace(exponent=0.1 * leg_m))


class Known:
    """In the place of random numbers: the first, then 0.6 and 0.7 with a little more for each."""

    def __init__(self, first):
        self._first, self._calls = first, 0

    def random(self, size=None):
        self._calls += 1
        if size is None:
            return self._first
        return 0.4 + 0.1 * self._calls + 0.01 * np.arange(np.prod(size)).reshape(size)


def ends(monkeypatch, nats, first=0.5, prior=None):
    """Four ends of a path with log-likelihoods for each turn and point."""
    nats, asked = np.float32(nats), []

    def weigh(points, earlier_m, turned_rad, on_map, pixel_m, factors, found, off):
        assert (points is POINTS, earlier_m, pixel_m) == (True, "earlier", 10.0)
        np.testing.assert_allclose(on_map, np.exp(-factors.exponent * np.array([[0.0, 3.0]])))
        np.testing.assert_allclose(off, 0.05)
        found[:], off[:] = nats[len(asked)], [0.25, 0.5]
        asked.append(turned_rad)

    monkeypatch.setattr(path_start, "weigh_path", weigh)
    turned = 1.0 * np.arange(len(nats))
    prior = np.zeros(len(nats)) if prior is None else np.array(prior)
    path = SimpleNamespace(earlier_m="earlier")
    found = path_start.ends_of_path(AREA, WEIGHTS, path, (turned, prior, 0.2), 4, Known(first))
    assert asked == turned.tolist()
    return found


def test_ends_lie_beside_their_points_and_turns_by_a_number_each(monkeypatch):
    found = ends(monkeypatch, [[0.0, 0.0]])
    points = POINTS[:, [0, 0, 1, 1]]
    beside = 0.01 * np.arange(8).reshape(2, 4) + 0.6 - 0.5
    np.testing.assert_allclose(found.place_m, points + 10.0 * beside, rtol=1e-5)
    np.testing.assert_allclose(found.turned_rad, 0.2 * (0.2 + 0.01 * np.arange(4)))
    assert found.off.tolist() == [0.25, 0.25, 0.5, 0.5]
    np.testing.assert_allclose(found.log_weight, -np.log(4.0))
    assert (found.place_m.dtype, found.off.dtype) == (np.float32, np.float32)


@pytest.mark.parametrize(("nats", "there"), [(-13.9, True), (-14.0, False)])
def test_an_end_that_is_fourteen_nats_below_the_best_is_left_out(monkeypatch, nats, there):
    """The last of the numbers that ends are drawn by is that of the last end."""
    found = ends(monkeypatch, [[0.0, nats]], first=0.99999)
    assert (found.off[-1] == 0.5) == there
    # A better turn comes later: what was near the best before stays.
    found = ends(monkeypatch, [[-20.0, -20.0], [0.0, nats]], first=0.99999)
    assert (found.off[-1] == 0.5) == there


def test_the_prior_of_a_turn_counts_as_its_likelihood(monkeypatch):
    """Drawn by the root of 1 and of a ninth: three to one. The rest of it is in the weights."""
    found = ends(monkeypatch, [[0.0, -50.0], [0.0, -50.0]], prior=[0.0, -np.log(9.0)])
    assert np.round(found.turned_rad).tolist() == [0.0, 0.0, 0.0, 1.0]
    weight = np.array([1.0, 1.0, 1.0, 1 / 3])
    np.testing.assert_allclose(np.exp(found.log_weight), weight / weight.sum(), rtol=1e-5)
