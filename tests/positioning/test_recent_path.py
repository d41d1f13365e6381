"""Dead reckoning and the path of the last metres, by hand."""

from dataclasses import replace
from math import cos, hypot, nan, pi, radians, sin

import numpy as np
import pytest

from mapfilter.filters.contract import MotionStep
from mapfilter.positioning.bayes.beliefs.path import LEG_M, PATH_M, DeadReckoning, RecentPath


def after(*steps, path=None):
    path = path or RecentPath()
    for step in steps:
        path = path.moved(MotionStep(*step))
    return path


def test_steps_add_up():
    here = DeadReckoning()
    for step_m, heading_rad, sd_m in ((3.0, 0.0, 0.5), (4.0, pi / 2, 0.0), (-1.0, pi / 2, 0.2)):
        here = here.moved(MotionStep(step_m, heading_rad, sampling_sd_m=sd_m))
    # A step backwards is a way, too.
    assert here.travelled_m == 8.0
    assert (here.east_m, here.north_m) == pytest.approx((3.0, 3.0))
    assert here.sampling_m2 == pytest.approx(0.25 + 0.04)
    assert here.moved(MotionStep(0.0, 1.0, sampling_sd_m=9.0)) is here
    assert here.gaps == 0
    assert here.moved(MotionStep(nan, 1.0)) == replace(here, gaps=1)
    blind = here.moved(MotionStep(-2.0, nan, sampling_sd_m=9.0))
    assert (blind.travelled_m, blind.east_m, blind.north_m) == (10.0, here.east_m, here.north_m)
    # Ten metres to one side, or as far as it is spread.
    assert (blind.sampling_m2, blind.gaps) == (here.sampling_m2 + 2.0 * 10.0 / 2, 1)
    long = here.moved(MotionStep(30.0, nan))
    assert long.sampling_m2 == here.sampling_m2 + 30.0**2 / 2
    spread = here.moved(MotionStep(2.0, nan, spread_m=3.0))
    assert spread.sampling_m2 == here.sampling_m2 + 3.0**2 / 2


def test_points_lie_a_leg_apart_and_the_last_eleven_are_kept():
    path = after(*[(1.0, 0.0)] * 100)
    assert (LEG_M, PATH_M) == (5.0, 50.0)
    assert [point.travelled_m for point in path.points] == [50.0 + 5 * k for k in range(11)]
    assert path.earlier_m.dtype == np.float32
    np.testing.assert_allclose(path.earlier_m, [[5.0 * k - 50, 0.0] for k in range(11)], atol=1e-4)
    path = after((1.0, 0.0), (1.0, 0.0), path=path)
    assert path.here.travelled_m == 102.0
    assert path.points[-1].travelled_m == 100.0
    np.testing.assert_allclose(path.earlier_m[-1], [-2.0, 0.0], atol=1e-4)


@pytest.mark.parametrize(("steps", "whole"), [(49, False), (50, True), (51, True)])
def test_a_path_of_fifty_metres_is_whole(steps, whole):
    assert after(*[(1.0, 0.3)] * steps).whole == whole


def test_a_path_is_as_long_as_the_way_from_its_first_point():
    path = RecentPath(DeadReckoning(60.0), (DeadReckoning(20.0),))
    assert not path.whole
    assert RecentPath(DeadReckoning(70.0), path.points).whole


def test_points_are_relative_to_the_end_in_both_directions():
    path = after((6.0, 0.0), (8.0, pi / 2), (1.0, pi / 2))
    expected = [[-6.0, -9.0], [0.0, -9.0], [0.0, -1.0]]
    np.testing.assert_allclose(path.earlier_m, expected, atol=1e-6)


def test_a_step_of_unknown_length_or_direction_begins_another_path():
    path = after(*[(1.0, 0.0)] * 30)
    assert path.moved(MotionStep(0.0, nan)) is path
    for step in ((nan, 0.0), (1.0, nan)):
        assert after(step, path=path) == RecentPath()


def legs(*bends_deg, leg_m=5.0):
    heading, steps = 0.0, [(leg_m, 0.0)]
    for bend in bends_deg:
        heading += radians(bend)
        steps.append((leg_m, heading))
    return after(*steps)


def test_bends_add_up_without_the_first_three_degrees_of_each():
    assert legs(0.0, 0.0).turned_rad == 0.0
    assert legs(2.9, -2.9, 2.9).turned_rad == 0.0
    assert legs(90.0).turned_rad == pytest.approx(radians(87.0))
    assert legs(90.0, -90.0, 10.0).turned_rad == pytest.approx(radians(87 + 87 + 7))
    # Right round: 170 degrees and not 190.
    assert legs(100.0, 100.0, 170.0).turned_rad == pytest.approx(radians(97 + 97 + 167))


def test_three_right_angles_are_distinctive():
    assert RecentPath(turned_rad=radians(270.0)).is_distinctive
    assert not legs(90.0, 90.0, 90.0).is_distinctive
    assert not legs(93.0, 93.0, 92.9).is_distinctive
    assert legs(93.0, -93.0, 93.1).is_distinctive


def test_a_mirrored_path_goes_the_other_way_round():
    path = legs(30.0, 40.0, -10.0)
    other = path.mirrored
    np.testing.assert_allclose(other.earlier_m, path.earlier_m * [1, -1], atol=1e-5)
    assert other.here.north_m == -path.here.north_m != 0
    assert other.turned_rad == path.turned_rad
    assert other.mirrored == path


def test_a_path_of_odd_steps_has_points_where_a_leg_is_full():
    path = after(*[(1.4, 0.1 * k) for k in range(12)])
    travelled = [point.travelled_m for point in path.points]
    assert travelled == pytest.approx([0.0, 5.6, 11.2, 16.8])
    east = sum(1.4 * cos(0.1 * k) for k in range(12))
    north = sum(1.4 * sin(0.1 * k) for k in range(12))
    assert hypot(*path.earlier_m[0]) == pytest.approx(hypot(east, north), rel=1e-5)
