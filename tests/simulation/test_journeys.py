"""Walking at one speed; driving within the limits of ways, turns and accelerations."""

import pickle

import numpy as np
import pytest

from mapfilter.errors import ConfigError
from mapfilter.simulation.journeys import JourneyPlan, journey, speed_profile
from mapfilter.simulation.routes import Route, route

NAMES = ("residential", "secondary")


def path_of(east_m, north_m, way_class=None):
    ways = len(east_m) - 1
    return Route(
        np.asarray(east_m, dtype=float),
        np.asarray(north_m, dtype=float),
        np.arange(ways) + 10,
        np.asarray(way_class or [0] * ways, dtype=np.int16),
        NAMES,
    )


def driving(**changes):
    return JourneyPlan(profile="driving", **changes)


def test_a_walk_by_hand():
    truth = journey(path_of([0, 7, 7], [0, 0, 7]), JourneyPlan(period_s=2.5))
    np.testing.assert_allclose(truth["time_s"], [0, 2.5, 5, 7.5, 10])
    np.testing.assert_allclose(truth["east_m"], [0, 3.5, 7, 7, 7])
    np.testing.assert_allclose(truth["north_m"], [0, 0, 0, 3.5, 7])
    assert truth["way_id"].tolist() == [10, 10, 11, 11, 11]


def test_the_walk_of_the_paper(town):
    plan = JourneyPlan()
    truth = journey(route(town, plan.length_m, np.random.default_rng(1)), plan)
    assert len(truth) == 1386
    assert truth["time_s"].iloc[-1] == 1385.0
    step_m = np.hypot(np.diff(truth["east_m"]), np.diff(truth["north_m"]))
    # Chords cut corners; on straight streets they are whole.
    assert step_m.max() <= 1.4 + 1e-9
    assert np.mean(step_m > 1.4 - 1e-6) > 0.95


def test_a_straight_drive_takes_the_time_of_a_trapezium():
    # Speeding up to v and braking each lose v / 2a against driving on at v.
    distance, time = speed_profile(path_of([0, 500], [0, 0], [1]), driving())
    assert distance[-1] == 500.0
    assert time[-1] == pytest.approx(500 / 14 + 14 / 2, rel=1e-3)


def test_a_short_drive_never_gets_fast():
    # Half the way up, half the way down: T = 2 √(L / a).
    _, time = speed_profile(path_of([0, 18], [0, 0], [1]), driving())
    assert time[-1] == pytest.approx(2 * np.sqrt(18 / 2), rel=1e-3)


def speeds(path, plan):
    distance, time = speed_profile(path, plan)
    return distance[1:] - np.diff(distance) / 2, np.diff(distance) / np.diff(time), time


def test_a_right_angle_is_taken_at_the_speed_of_a_six_metre_curve():
    place, speed, _ = speeds(path_of([0, 200, 200], [0, 0, 200], [1, 1]), driving())
    at_corner = speed[np.abs(place - 200) < 1].min()
    # v² = 2 m/s² · 6 m at the corner and 2·a·1 m more a metre on; the mean speed between.
    assert at_corner == pytest.approx((np.sqrt(12) + np.sqrt(16)) / 2)
    assert speed.max() == pytest.approx(14.0, abs=1e-6)


def test_turning_back_is_a_crawl_and_straight_on_no_limit():
    place, speed, _ = speeds(path_of([0, 200, 0], [0, 0, 0], [1, 1]), driving())
    assert speed[np.abs(place - 200) < 1].min() == pytest.approx((1 + np.sqrt(5)) / 2)
    place, speed, _ = speeds(path_of([0, 200, 400], [0, 0, 0], [1, 1]), driving())
    assert speed[np.abs(place - 200) < 50].min() == pytest.approx(14.0, abs=1e-6)


def test_the_slower_street_keeps_its_limit():
    place, speed, _ = speeds(path_of([0, 200, 400], [0, 0, 0], [1, 0]), driving())
    assert speed[place > 200].max() <= 8.3 + 1e-9
    assert speed[place < 200].max() == pytest.approx(14.0, abs=1e-6)
    assert (speed[place < 200][-1:] < 9).all()


def test_unknown_classes_are_driven_at_the_default():
    _, speed, _ = speeds(path_of([0, 400], [0, 0]), driving(driving_speed_mps={}))
    assert speed.max() == pytest.approx(8.3)


@pytest.mark.parametrize("seed", range(10))
def test_accelerations_are_bounded_on_any_route(town, seed):
    plan = driving(length_m=3000.0)
    path = route(town, plan.length_m, np.random.default_rng(seed))
    place, speed, time = speeds(path, plan)
    between_s = (time[2:] - time[:-2]) / 2
    assert np.max(np.abs(np.diff(speed)) / between_s) < 2.0 + 1e-6
    assert speed.max() <= 14.0 + 1e-9
    segment = np.searchsorted(path.corner_m, place) - 1
    assert (speed <= np.array([8.3, 14.0])[path.way_class[segment]] + 1e-9).all()
    truth = journey(path, plan)
    step_m = np.hypot(np.diff(truth["east_m"]), np.diff(truth["north_m"]))
    assert step_m.max() <= 14.0 + 1e-9
    assert step_m[0] < 1.5


def test_every_wrong_value_is_told():
    with pytest.raises(ConfigError) as caught:
        JourneyPlan(
            length_m=-1,
            speed_mps=np.inf,
            profile="flying",  # type: ignore[arg-type]
            leg_m=(500.0, 400.0),
            driving_speed_mps={"primary": 0.0},
        )
    message = str(caught.value)
    for part in ("length_m", "speed_mps", "'walking' or 'driving'", "leg_m", "primary"):
        assert part in message


def test_a_plan_travels_to_other_processes():
    plan = JourneyPlan(length_m=500.0, profile="driving")
    assert pickle.loads(pickle.dumps(plan)) == plan
