"""What a smoother keeps where lengths are read anew, and how paths go back, by hand."""

from dataclasses import dataclass
from math import exp, log, nan
from types import SimpleNamespace

import numpy as np
import pytest
from small_area import SOUTH_M, WEST_M, make_area

from mapfilter.positioning.bayes.beliefs import smoothing
from mapfilter.positioning.bayes.beliefs.legs import NO_LEG
from mapfilter.positioning.bayes.beliefs.smoothing import BayesSmoother, Kept

AREA = make_area()
STILL = SimpleNamespace(
    step_sd_m=0.5, typical_step_m=2.0, white_rad=0.1, turn_sd_rad=0.2, heading_m=40.0,
    stretch_sd=0.1, stretch_m=20.0, bias_drift_rad_per_sqrt_m=0.03, scale_drift_per_sqrt_m=0.02,
)  # fmt: skip
JITTER = (1.0, 2.0, 0.05, 0.025, 0.0)


def belief_at(*places_m):
    """Hypotheses of equal weights, which have no errors."""
    state = np.zeros((8, len(places_m)), dtype=np.float32)
    state[:2] = np.array(places_m).T
    return SimpleNamespace(state=state, log_weight=np.zeros(len(places_m)))


def after_epoch(reckoned, belief, unit_m=1.0, **more):
    """The part of the filter's state that is kept, by east, north, distance and sampling."""
    east_m, north_m, travelled_m, sampling_m2 = reckoned
    way = SimpleNamespace(
        east_m=east_m, north_m=north_m, travelled_m=travelled_m, sampling_m2=sampling_m2
    )
    usual = {
        "alternative": None,
        "takeovers": 0,
        "held": (),
        "alone_from_m": nan,
        "hold": held_in(unit_m),
        "leg": NO_LEG,
    }
    return SimpleNamespace(reckoning=way, belief=belief, **(usual | more))


def held_in(unit_m):
    return SimpleNamespace(step_unit_m=unit_m)


def rival_at(place_m, start_m):
    return SimpleNamespace(belief=belief_at(place_m), start_m=start_m)


def recorded(states, every_m=1.0):
    history = BayesSmoother(AREA, STILL, every_m=every_m)
    for before, after in zip([states[0], *states], states, strict=False):
        history.add(before, after)
    return history


def test_a_takeover_in_another_unit_lengthens_the_way_so_far_back_from_its_end():
    """From half metres to two metres: fourfold. Beliefs are those of what has taken over."""
    main, rival = belief_at((1.0, 1.0)), rival_at((9.0, 8.0), 2.0)
    ways = [(0.0, 0.0, 0.0, 0.0), (2.0, 0.0, 2.0, 0.5), (2.0, 3.0, 5.0, 1.0), (4.0, 3.0, 7.0, 1.5)]
    states = [after_epoch(ways[0], main, 0.5)]
    states += [after_epoch(way, main, 0.5, alternative=rival) for way in ways[1:3]]
    states += [after_epoch(ways[3], belief_at((20.0, 30.0)), 2.0, takeovers=1)]
    history = recorded(states)
    # Before the end by four times as much, and by 16 times its variance.
    expected = [(-12.0, -9.0, -21.0, -22.5), (-4.0, -9.0, -13.0, -14.5), (-4.0, 3.0, -1.0, -6.5)]
    assert history.moved == [*expected, ways[3]]
    assert [one.epoch for one in history.kept] == [1, 2, 3]
    assert [one.state[:2, 0].tolist() for one in history.kept] == [[9.0, 8.0]] * 2 + [[20.0, 30.0]]
    found = [(*one.moved_m, one.travelled_m, one.sampling_m2) for one in history.kept]
    assert found == history.moved[1:]
    assert history.alternative == []
    assert history._kept_bytes == 3 * 24


def test_a_takeover_in_the_same_unit_leaves_the_way_as_it_was():
    main, rival = belief_at((1.0, 1.0)), rival_at((9.0, 8.0), 2.0)
    ways = [(2.0 * k, 0.0, 2.0 * k, 0.0) for k in range(3)]
    states = [after_epoch(ways[0], main, 0.5), after_epoch(ways[1], main, 0.5, alternative=rival)]
    history = recorded([*states, after_epoch(ways[2], main, 0.5, takeovers=1)])
    assert history.moved == ways
    assert [one.state[0, 0] for one in history.kept] == [1.0, 9.0, 1.0]


@pytest.mark.parametrize(
    ("starts_m", "epochs"), [((3.0, 5.0), [0, 1, 4]), ((7.0,), [0, 1, 2, 3, 4]), ((), [0, 4])]
)
def test_beliefs_are_dropped_from_the_first_start_of_what_is_held_the_new_way(starts_m, epochs):
    """Without one of these, from the start of the alternative, at 1.5 m."""
    main, turned = belief_at((1.0, 1.0)), SimpleNamespace(step_unit_m=1.0, turned=True)
    held = tuple(SimpleNamespace(hold=turned, start_m=start_m) for start_m in starts_m)
    held += (SimpleNamespace(hold=held_in(1.0), start_m=0.5),)
    more = {"alternative": rival_at((9.0, 8.0), 1.5), "held": held}
    ways = [(2.0 * k, 0.0, 2.0 * k, 0.0) for k in range(5)]
    states = [after_epoch(ways[0], main), *(after_epoch(way, main, **more) for way in ways[1:4])]
    history = recorded([*states, after_epoch(ways[4], main, takeovers=1, hold=turned)])
    assert [one.epoch for one in history.kept] == epochs


def test_no_more_than_400_mebibytes_are_kept():
    for more, every_m, count in ((0, 1.0, 2), (1, 2.0, 1)):
        history = BayesSmoother(AREA, STILL, every_m=1.0, _kept_bytes=400 * 1024**2 - 48 + more)
        for k in range(2):
            state = after_epoch((2.0 * k, 0.0, 2.0 * k, 0.0), belief_at((1.0, 1.0)))
            history.add(state, state)
        assert (history.every_m, len(history.kept)) == (every_m, count)


def test_the_last_belief_is_kept_once_where_beliefs_are_kept_at_all():
    ways = [(0.0, 0.0, 0.0, 0.0), (8.0, 0.0, 8.0, 0.0), (9.0, 0.0, 9.0, 0.0)]
    states = [after_epoch(way, belief_at((1.0 + k, 1.0))) for k, way in enumerate(ways)]
    history = recorded(states, every_m=5.0)
    assert [one.epoch for one in history.kept] == [0, 1]
    for _ in range(2):
        history.close()
        assert [one.epoch for one in history.kept] == [0, 1, 2]
    at_last = recorded(states[:2], every_m=5.0)
    at_last.close()
    assert [one.epoch for one in at_last.kept] == [0, 1]
    nothing = BayesSmoother(AREA, STILL)
    nothing.close()
    nothing.last, nothing.moved = states[0], [ways[0]]
    nothing.close()
    assert nothing.kept == []
    ended = recorded([*states[:2], after_epoch(ways[2], None)], every_m=5.0)
    ended.close()
    assert [one.epoch for one in ended.kept] == [0, 1]


@dataclass(frozen=True)
class Track:
    """The part of an estimate that is smoothed."""

    east_m: np.ndarray
    north_m: np.ndarray
    covariance_m2: np.ndarray
    radii_m: np.ndarray
    mass_50m: np.ndarray
    way_id: np.ndarray
    way_probability: np.ndarray

    def __len__(self):
        return len(self.east_m)

    @property
    def places(self):
        return np.column_stack([self.east_m - WEST_M, self.north_m - SOUTH_M]).tolist()


def smoothed(history, count, paths=20):
    one = np.zeros(count)
    track = Track(
        one, one, np.zeros((count, 2, 2)), np.zeros((count, 3)), one, one.astype(int), one
    )
    return history.smoothed(track, np.random.default_rng(1), paths=paths, jitter=JITTER)


def test_a_track_ends_at_the_last_belief():
    ways = [(0.0, 0.0, 0.0, 0.0), (8.0, 0.0, 8.0, 0.0), (9.0, 0.0, 9.0, 0.0)]
    places = [(20.0, 30.0), (28.5, 31.0), (29.0, 33.0)]
    states = [after_epoch(*each) for each in zip(ways, map(belief_at, places), strict=True)]
    found = smoothed(recorded(states, every_m=5.0), 3)
    np.testing.assert_allclose(found.places, places, atol=1e-4)


def test_at_rest_a_path_is_at_its_later_place_after_the_epoch_of_the_earlier_one():
    ways = [(5.0, 0.0, 5.0, 0.0)] * 3
    places = [(20.0, 30.0), (20.5, 30.0), (21.0, 31.0)]
    states = [after_epoch(*each) for each in zip(ways, map(belief_at, places), strict=True)]
    found = smoothed(recorded(states, every_m=5.0), 3)
    np.testing.assert_allclose(found.places, [places[0], places[2], places[2]], atol=1e-4)


def test_a_path_is_bent_over_half_a_metre_too():
    ways = [(0.0, 0.0, 0.0, 0.0), (0.1, 0.0, 0.1, 0.0), (0.5, 0.0, 0.5, 0.0)]
    beliefs = [belief_at((20.0, 30.0)), None, belief_at((20.5, 31.0))]
    history = recorded([after_epoch(*each) for each in zip(ways, beliefs, strict=True)])
    np.testing.assert_allclose(smoothed(history, 3).places[1], (20.1, 30.2), atol=1e-4)


def test_after_the_last_belief_paths_go_on_by_dead_reckoning():
    ways = [(0.0, 0.0, 0.0, 0.0), (4.0, 0.0, 4.0, 0.0), (4.0, 2.0, 6.0, 0.0)]
    beliefs = [belief_at((20.0, 30.0)), belief_at((24.0, 30.0)), None]
    history = recorded([after_epoch(*each) for each in zip(ways, beliefs, strict=True)])
    np.testing.assert_allclose(
        smoothed(history, 3).places, [(20, 30), (24, 30), (24, 32)], atol=1e-4
    )


def test_a_single_belief_is_where_the_track_stays():
    ways = [(0.0, 0.0, 0.0, 0.0), (4.0, 0.0, 4.0, 0.0)]
    history = recorded([after_epoch(ways[0], belief_at((20.0, 30.0))), after_epoch(ways[1], None)])
    np.testing.assert_allclose(smoothed(history, 2).places, [(20, 30)] * 2, atol=1e-4)


def test_the_way_is_that_at_the_place():
    """Of two places in the row of a way the second one is east of its end."""
    for place, way in (((75.0, 25.0), 7), ((85.0, 25.0), 0), ((35.0, 65.0), 7)):
        history = recorded([after_epoch((0.0, 0.0, 0.0, 0.0), belief_at(place))])
        assert smoothed(history, 1).way_id.tolist() == [way]


@pytest.mark.parametrize("axis", [0, 1])
def test_places_are_compared_by_squares_of_the_area(axis):
    """Places at 24.5 and 50.5 m are in squares that do not touch; each weighs less than a third."""
    apart, far = [(24.5, 5.0), (50.5, 5.0)], (85.0, 65.0)
    if axis == 1:
        apart, far = [(5.0, 24.5), (5.0, 50.5)], (85.0, 5.0)
    belief = belief_at(*apart, far)
    belief.log_weight = np.log([0.3, 0.3, 0.4])
    found = smoothed(recorded([after_epoch((0.0, 0.0, 0.0, 0.0), belief)]), 1)
    np.testing.assert_allclose(found.places, [far], atol=1e-3)


@pytest.mark.parametrize("nats", [0.0, -95.0, 95.0])
def test_weights_of_the_last_belief_are_relative(nats):
    belief = belief_at((20.0, 30.0), (24.0, 30.0), (50.0, 30.0))
    belief.log_weight = np.array([nats, nats + log(3.0), nats - 150.0])
    found = smoothed(recorded([after_epoch((0.0, 0.0, 0.0, 0.0), belief)]), 1)
    assert found.places[0] == pytest.approx([23.0, 30.0], abs=1e-4)


def kept_at(moved_m, travelled_m, sampling_m2):
    return Kept(0, np.zeros((5, 1), "f4"), np.zeros(1, "f4"), moved_m, travelled_m, sampling_m2)


@pytest.mark.parametrize(
    ("changes", "place_var", "turn_var", "stretch_var"),
    [
        # Five steps of 0.5 m; the deviation of headings leads aside by a third of 100 m² times it.
        ({}, 5 * 0.25, 0.04 * (1 - exp(-0.5)), 0.01 * (1 - exp(-1.0))),
        # Five steps that are 0.6 m aside.
        ({"white_rad": 0.3}, 5 * 0.36, 0.04 * (1 - exp(-0.5)), 0.01 * (1 - exp(-1.0))),
        ({"stretch_sd": 0.4}, 5 * 0.25, 0.04 * (1 - exp(-0.5)), 0.16 * (1 - exp(-1.0))),
    ],
)
def test_what_motion_adds_between_two_beliefs(
    monkeypatch, changes, place_var, turn_var, stretch_var
):
    seen = []

    def draw(later, *given):
        seen.append(given[2:5])
        return np.zeros(later.shape[1], dtype=np.int32)

    monkeypatch.setattr(smoothing, "draw_ancestors", draw)
    beliefs = [kept_at((1.0, 2.0), 20.0, 1.0), kept_at((7.0, 10.0), 30.0, 3.0)]
    errors, rng = SimpleNamespace(**vars(STILL) | changes), np.random.default_rng(1)
    area = SimpleNamespace(size_m=(90.0, 70.0))
    states = smoothing._paths(beliefs, area, errors, rng, 3, JITTER)
    assert [one.shape for one in states] == [(5, 3)] * 2
    ((moved_m, variances, log_jump),) = seen
    place_var += 100.0 * max(turn_var, stretch_var) / 3 + 1.0 + 2.0
    assert moved_m == (6.0, 8.0)
    assert variances == pytest.approx(
        (place_var, 0.0009 * 10 + turn_var + 0.0025, 0.0004 * 10 + stretch_var + 0.000625)
    )
    # Anywhere in the area, with a ten-thousandth of the probability.
    assert log_jump == pytest.approx(log(1e-4 * place_var / 6300.0))


def test_a_belief_is_kept_without_sampling_where_none_is_told():
    assert Kept(0, np.zeros((5, 1)), np.zeros(1), (0.0, 0.0), 0.0).sampling_m2 == 0.0
