"""First hypotheses row by row, of numbers that are known instead of random."""

from math import log, pi
from types import SimpleNamespace

import numpy as np
import pytest

from mapfilter.models.street_motion import (
    BIAS,
    EAST,
    LOG_SCALE,
    NORTH,
    OFF,
    RATE,
    STATES,
    STRETCH,
    TURN,
)
from mapfilter.positioning.bayes.beliefs import first_hypotheses as first

MOTION = SimpleNamespace(
    bias_sd_rad=0.3, scale_sd=0.1, turn_sd_rad=0.2, stretch_sd=0.05, rate_rad_per_m=0.004,
    rate_share=0.5,
)  # fmt: skip
SIZE_M = (100.0, 60.0)


class Known:
    """In the place of random numbers: the k-th call gives k, or k tenths, and a little more."""

    def __init__(self):
        self.calls = []

    def standard_normal(self, size):
        return self._numbers(size, 1.0)

    def random(self, size=1, dtype=np.float64):
        found = self._numbers(size, 0.1).astype(dtype)
        return found if size != 1 else float(found[0])

    def _numbers(self, size, unit):
        self.calls.append(size)
        more = 0.01 * np.arange(np.prod(size)).reshape(size)
        return unit * (len(self.calls) + more)


def beyond(state):
    east, north = state[:2]
    return (east < 0) | (east > SIZE_M[0]) | (north < 0) | (north > SIZE_M[1])


def model_of(points=((5.0, 15.0), (5.0, 25.0)), **area):
    lattice = SimpleNamespace(resolution_m=10.0)
    given = {"lattice": lattice, "size_m": SIZE_M, "beyond": beyond, "origin_m": (1000.0, 2000.0)}
    whole = SimpleNamespace(points=np.array(points, dtype=np.float32).reshape(2, -1))
    return SimpleNamespace(
        area=SimpleNamespace(**given | area), whole=whole, motion=MOTION, weights="weights",
        evidence=SimpleNamespace(levels="levels"),
    )  # fmt: skip


def test_an_unknown_start_of_a_compass_is_the_usual_one():
    start = first.Start(None)
    assert start.compass
    assert np.isnan([start.east_m, start.north_m, start.sd_m]).all()
    assert start.path is None


@pytest.mark.parametrize("compass", [True, False])
def test_hypotheses_about_a_known_start(compass):
    """Each row by its own numbers: places first, then errors of headings and of lengths."""
    rng, prior = Known(), first.Start(None, compass, 1040.0, 2030.0, 2.0)
    cloud, log_weight = first.first_hypotheses(model_of(), prior, 3, rng)
    state, more = cloud.state, 0.01 * np.arange(3)
    expected = np.zeros((STATES, 3))
    expected[EAST], expected[NORTH] = 40.0 + 2.0 * (1 + more), 30.0 + 2.0 * (1.03 + more)
    expected[OFF], expected[BIAS] = 0.05, 0.3 * (2 + more)
    if not compass:
        expected[BIAS] = pi * (0.6 + 0.2 * more - 1)
    k = 3 if compass else 4
    for row, sd in ((LOG_SCALE, 0.1), (TURN, 0.2), (STRETCH, 0.05)):
        expected[row] = sd * (k + more)
        k += 1
    # Half of all journeys have a rate: by numbers of 0.6 none has.
    assert rng.calls[-2:] == [3, 3]
    np.testing.assert_allclose(state, expected, rtol=1e-6, atol=1e-7)
    np.testing.assert_allclose(log_weight, -log(3))
    assert (cloud.kept.shape, cloud.kept.dtype) == ((0, 3), np.float32)


def test_a_part_of_all_has_a_rate(monkeypatch):
    """Those whose number is below the share: 0.6, 0.601 and 0.602 of which two are below 0.602."""
    monkeypatch.setattr(MOTION, "rate_share", 0.602)
    prior = first.Start(None, True, 1040.0, 2030.0, 2.0)
    cloud, _ = first.first_hypotheses(model_of(), prior, 3, Known())
    np.testing.assert_allclose(cloud.state[RATE], [0.004 * 7, 0.004 * 7.01, 0.0], rtol=1e-5)


def test_by_a_path_its_ends_are_taken(monkeypatch):
    """Their error of headings holds what the deviation has of it, around the circle."""
    asked = []
    ends = SimpleNamespace(
        place_m=np.array([[1.0, 2.0], [3.0, 4.0]]), off=np.array([0.25, 0.5]),
        log_weight=np.array([-1.0, -2.0]), turned_rad=np.array([0.5, -3.1]),
    )  # fmt: skip
    monkeypatch.setattr(first, "possible_turns_rad", lambda sd, *, compass: (sd, compass))
    monkeypatch.setattr(first, "ends_of_path", lambda *given: asked.append(given) or ends)
    model, rng = model_of(), Known()
    cloud, log_weight = first.first_hypotheses(model, first.Start(None, False, path="path"), 2, rng)
    assert asked == [(model.whole, "weights", "path", (0.3, False), 2, rng)]
    assert cloud.state[EAST : NORTH + 1].tolist() == ends.place_m.tolist()
    assert cloud.state[OFF].tolist() == [0.25, 0.5]
    assert log_weight.tolist() == [-1.0, -2.0]
    turn = 0.2 * np.array([4.0, 4.01])
    np.testing.assert_allclose(cloud.state[TURN], turn, rtol=1e-6)
    np.testing.assert_allclose(
        cloud.state[BIAS], [0.5 - turn[0], 2 * pi - 3.1 - turn[1]], rtol=1e-5
    )


def spread(model, most, rng=None, reading=None):
    state, log_weight = np.zeros((STATES, most), dtype=np.float32), np.zeros(most)
    first._spread(model, state, log_weight, reading, rng or np.random.default_rng(1))
    return state, log_weight


def test_shares_on_ways_off_them_and_around():
    """Of 40: 26 on ways, 8 off them, 6 around the area, with the probability of each kind."""
    state, log_weight = spread(model_of(), 40)
    kinds = [slice(0, 26), slice(26, 34), slice(34, 40)]
    chances = (0.98 * 0.95, 0.98 * 0.05, 0.02)
    for part, off, chance in zip(kinds, (0.0, 1.0, 0.05), chances, strict=True):
        np.testing.assert_allclose(state[OFF, part], off)
        np.testing.assert_allclose(np.exp(log_weight[part]).sum(), chance)
        assert np.ptp(log_weight[part]) == 0.0
    on, off, around = (state[:2, part] for part in kinds)
    # Anywhere in the pixels of both points, each of which is drawn as often.
    middle = np.array([[5.0] * 13 + [15.0] * 13, [5.0] * 13 + [25.0] * 13])
    assert np.abs(on - middle).max() <= 5.0
    assert np.ptp(on - middle) > 8.0
    assert not beyond(off).any()
    assert beyond(around).all()


def test_places_on_ways_lie_beside_their_points_by_a_number_each():
    state, _ = spread(model_of(), 4, Known())
    points = np.array([[5.0, 5.0, 15.0, 15.0], [5.0, 5.0, 25.0, 25.0]])
    beside = 0.3 + 0.001 * np.arange(8).reshape(2, 4) - 0.5
    np.testing.assert_allclose(state[EAST : NORTH + 1], points + 10.0 * beside, rtol=1e-5)


def test_a_few_hypotheses_are_all_on_ways():
    """Of 4 no whole one is off them or around; of 5 one is off them, of 7 another one around."""
    for most, (off, around) in ((4, (0, 0)), (5, (1, 0)), (7, (1, 1))):
        state, log_weight = spread(model_of(), most)
        assert (state[OFF] == 1.0).sum() == off
        assert (np.isclose(state[OFF], 0.05)).sum() == around
        assert np.isfinite(log_weight).all()


def test_without_ways_no_hypothesis_is_on_them():
    state, log_weight = spread(model_of(()), 40)
    assert np.isneginf(log_weight[:26]).all()
    assert np.isfinite(log_weight[26:]).all()
    assert not state[:, :26].any()
    cloud, _ = first.first_hypotheses(model_of(()), first.Start(None), 40, Known())
    assert not cloud.state[[EAST, NORTH, OFF], :26].any()


class Tiles:
    """In the place of an area that is held by tiles."""

    def __init__(self, **area):
        self.__dict__.update(area)


@pytest.fixture
def tiled(monkeypatch):
    """A model over tiles, and what is asked of its search."""
    noted = []

    def weighed(_, points, reading):
        noted.append((points.tolist(), reading))
        return np.full(points.shape[1], 1 / points.shape[1], dtype=np.float32), -1.0

    monkeypatch.setattr(first, "TiledArea", Tiles)
    monkeypatch.setattr(first, "likelihoods", weighed)
    monkeypatch.setattr(first, "likelihoods_on_ways", lambda *_: pytest.fail("held as a whole"))
    model = model_of()
    model.area, model.whole = Tiles(**vars(model.area)), None
    return model, noted


def test_a_search_of_all_tiles(monkeypatch, tiled):
    model, noted = tiled
    points = np.array([[5.0], [5.0]], dtype=np.float32)
    monkeypatch.setattr(first, "searched_tiles", lambda *_: None)
    monkeypatch.setattr(first, "points_everywhere", lambda _: points)
    state, log_weight = spread(model, 20, reading="reading")
    (on, off, around) = (np.array(places) for places, _ in noted)
    assert [reading for _, reading in noted] == ["reading"] * 3
    assert on.tolist() == points.tolist()
    # Twice as many places off the map are compared as are taken.
    assert (off.shape, around.shape) == ((2, 8), (2, 3))
    assert not beyond(off).any()
    assert beyond(around).all()
    assert np.exp(log_weight).sum() == pytest.approx(np.exp(-1.0))
    assert (state[OFF] == 0.0).sum() == 13


@pytest.mark.parametrize("at_edge", [True, False])
def test_a_search_of_some_tiles(monkeypatch, tiled, at_edge):
    """Where none of them lies at the edge, more are on ways instead of around the area."""
    model, noted = tiled
    asked, points = [], np.array([[5.0, 15.0], [5.0, 25.0]], dtype=np.float32)
    anywhere, around = points + 1.0, (points + 2.0 if at_edge else points[:, :0])
    found = SimpleNamespace(
        points=points,
        anywhere=lambda drawn: asked.append(drawn.shape) or anywhere,
        around=lambda *given: asked.append(given[:3]) or around,
    )
    monkeypatch.setattr(first, "searched_tiles", lambda *given: asked.append(given[1:]) or found)
    state, log_weight = spread(model, 20, reading="reading")
    assert asked == [("reading", "levels"), (8, 2), (SIZE_M, 300.0, 3)]
    assert (state[OFF] == 0.0).sum() == (13 if at_edge else 16)
    assert (state[OFF] == 1.0).sum() == 4
    assert [places for places, _ in noted][:2] == [points.tolist(), anywhere.tolist()]
    assert len(noted) == (3 if at_edge else 2)
    # Places off the map and around the area are taken as they are.
    for part, places in ((state[OFF] == 1.0, anywhere), (state[OFF] == np.float32(0.05), around)):
        found_at = set(zip(*state[:2, part].tolist(), strict=True))
        assert found_at == set(zip(*places.tolist(), strict=True))
    expected = 1.0 if at_edge else 0.98
    assert np.exp(log_weight).sum() == pytest.approx(np.exp(-1.0) * expected)


def test_places_around_lie_in_a_belt_of_three_hundred_metres():
    area = model_of().area
    east, north = first._around(area, 500, np.random.default_rng(3)).astype(float)
    assert east.size == 500
    assert (east.min(), east.max()) == pytest.approx((-300.0, 400.0), abs=10.0)
    assert (north.min(), north.max()) == pytest.approx((-300.0, 360.0), abs=10.0)


@pytest.mark.parametrize(("share", "draws"), [(1.0, 1), (0.25, 1), (0.125, 2)])
def test_as_many_places_are_drawn_as_it_takes(share, draws):
    """Four for each at a time; those beyond the area are taken, in their order."""
    asked = []

    def random(size):
        asked.append(size)
        return np.random.default_rng(len(asked)).random(size)

    def some(places):
        return np.arange(places.shape[1]) < share * places.shape[1]

    area = SimpleNamespace(size_m=SIZE_M, beyond=some)
    found = first._around(area, 8, SimpleNamespace(random=random))
    assert (found.shape, found.dtype) == ((2, 8), np.float32)
    assert asked == [(2, 32)] * draws
    drawn = np.random.default_rng(1).random((2, 32))[:, : min(8, round(32 * share))]
    expected = np.array([[700.0], [660.0]]) * drawn - 300.0
    np.testing.assert_allclose(found[:, : expected.shape[1]], expected, rtol=1e-5, atol=1e-3)


def test_copies_of_any_heading():
    state = np.arange(2.0 * STATES, dtype=np.float32).reshape(STATES, 2)
    turned = first.any_heading(model_of(), state, 2, Known())
    more = 0.001 * np.arange(8).reshape(2, 4)
    expected = np.concatenate([state, state], axis=1)
    expected[EAST : NORTH + 1] += 10.0 * (0.1 + more - 0.5)
    expected[BIAS] = pi * (2 * (0.2 + more[0]) - 1)
    np.testing.assert_allclose(turned, expected, rtol=1e-5)
