"""What measurement models assume unless told otherwise, and where they stop taking input."""

import math

import numpy as np
import pytest
from fusion_world import MOVING_3D, MOVING_CLOCK_3D

from mapfilter.errors import InputError
from mapfilter.models.gaussian import stack
from mapfilter.models.ranging import (
    GSM_STEP_M,
    difference_covariance,
    position_fix,
    pseudoranges,
    range_differences,
    timing_advances,
)
from mapfilter.models.signal_strength import levels, sampled_pattern
from mapfilter.models.state import (
    MOVING,
    MOVING_CLOCK,
    POSITION,
    POSITION_CLOCK_3D,
    StateLayout,
)
from mapfilter.radio.antenna import MeasuredAntenna

ORIGIN = [[0.0, 0.0]]
LOSS = {"loss_at_km_db": 130.0, "exponent": 3.5}
NAN, INF = math.nan, math.inf


def test_the_columns_of_terms_are_those_of_the_table():
    advance = timing_advances(POSITION, [[3.0, 4.0, 5.0]], 2.0).rows
    assert advance.tolist() == [[0.0, 3.0, 4.0, 5.0, *[0.0] * 11]]
    ranges = pseudoranges(MOVING_CLOCK, [[1.0, 2.0, 3.0]], 2.0).rows
    assert ranges.tolist() == [[0.0, 1.0, 2.0, 3.0, 1.0, *[0.0] * 10]]
    pair = range_differences(POSITION, [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]], 2.0).rows
    assert pair.tolist() == [[2.0, 4.0, 5.0, 6.0, 1.0, 2.0, 3.0, *[0.0] * 8]]
    fix = position_fix(MOVING_3D, np.eye(3)).rows
    assert fix.tolist() == [[3.0, 0.0, 0.0, 0.0, slot, *[0.0] * 10] for slot in (0.0, 1.0, 2.0)]
    plain = levels(POSITION, [[1.0, 2.0]], 8.0, **LOSS).rows[0]
    expected = [1.0, 1.0, 2.0, 0.0, -130.0, -35.0, 0.0, 0.0, math.pi / 3, 20.0, 0.0, 0.0, 1.0]
    assert plain.tolist() == [*expected, 0.0, 0.0]
    pattern = levels(
        POSITION,
        [[1.0, 2.0]],
        8.0,
        **LOSS,
        eirp_dbm=50.0,
        boresight_rad=0.5,
        beamwidth_rad=0.7,
        max_attenuation_db=0.0,
        pattern_db=np.zeros(2),
        shortest_distance_m=3.0,
        quantity="loss",
    )
    expected = [1.0, 1.0, 2.0, 0.0, 80.0, 35.0, -1.0, 0.5, 0.7, 0.0, 0.0, 2.0, 3.0]
    assert pattern.rows[0].tolist() == [*expected, 0.0, 0.0]
    assert pattern.patterns.tolist() == [0.0, 0.0]


def test_a_fixed_height_is_taken_from_those_of_transmitters():
    low = StateLayout(2, 0, 1, height_m=2.0)
    here = np.array([0.0, 0.0])
    assert timing_advances(low, [[3.0, 0.0, 6.0]], 1.0).mean(here).tolist() == [5.0]
    model = range_differences(low, [[3.0, 0.0, 6.0], [0.0, 5.0, 14.0]], 1.0)
    assert model.mean(here).tolist() == [8.0]
    # Where the state has a height of its own, the layout's does not count.
    high = StateLayout(3, 0, 1, 2, height_m=2.0)
    above = np.array([0.0, 0.0, 2.0])
    assert timing_advances(high, [[3.0, 0.0, 6.0]], 1.0).mean(above).tolist() == [5.0]
    model = range_differences(high, [[3.0, 0.0, 6.0], [0.0, 5.0, 14.0]], 1.0)
    assert model.mean(above).tolist() == [8.0]


def test_names_and_steps_of_components():
    assert timing_advances(POSITION, [[0, 0], [1, 1]], 1.0).names == (
        "timing advance 0",
        "timing advance 1",
    )
    assert pseudoranges(MOVING_CLOCK, [[0, 0, 1]], 1.0).names == ("pseudorange 0",)
    differences = range_differences(POSITION, [[0, 0], [1, 1], [2, 2]], 1.0, 1)
    assert differences.names == ("difference 0", "difference 2")
    assert position_fix(MOVING, np.eye(2)).names == ("east", "north")
    assert position_fix(MOVING_3D, np.eye(3)).names == ("east", "north", "up")
    lossy, strong = (levels(POSITION, ORIGIN, 8.0, quantity=q, **LOSS) for q in ("loss", "level"))
    assert (lossy.names, strong.names) == (("loss 0",), ("level 0",))
    both = stack([lossy, differences])
    assert both.names == ("loss 0", "difference 0", "difference 2")
    for model in (differences, lossy, position_fix(MOVING, np.eye(2)), both):
        np.testing.assert_array_equal(model.step, np.zeros(model.size))
    np.testing.assert_array_equal(timing_advances(POSITION, [[0, 0]] * 2, 1.0).step, [0.0, 0.0])
    np.testing.assert_array_equal(timing_advances(POSITION, [[0, 0]] * 2, 1.0, 78.0).step, [78] * 2)
    np.testing.assert_array_equal(pseudoranges(MOVING_CLOCK, [[0, 0, 1]], 1.0).step, [0.0])


def test_a_stack_keeps_each_model_its_pattern():
    east, north = np.array([0.0, -10.0, -30.0, -10.0]), np.array([-1.0, -2.0, -3.0])
    antenna = {"loss_at_km_db": 0.0, "exponent": 0.0, "boresight_rad": 0.0}
    parts = [
        levels(POSITION, ORIGIN, 2.0, pattern_db=east, **antenna),
        timing_advances(POSITION, ORIGIN, 3.0),
        levels(POSITION, ORIGIN, 4.0, pattern_db=north, **antenna),
        levels(POSITION, ORIGIN, 5.0, pattern_db=east, **antenna),
    ]
    whole = stack(parts)
    for place in ([100.0, 0.0], [0.0, 50.0], [-30.0, -40.0]):
        found = [part.mean(place)[0] for part in parts]
        np.testing.assert_array_equal(whole.mean(place), found)
    np.testing.assert_array_equal(whole.covariance(), np.diag([4.0, 9.0, 16.0, 25.0]))
    # 4 of the first, a placeholder of the second, 3 of the third.
    np.testing.assert_array_equal(whole.rows[:, 10], [0, 4, 5, 8])
    assert whole.patterns.size == 12
    np.testing.assert_array_equal(stack([whole, whole]).mean([3.0, 4.0])[4:], whole.mean([3, 4]))


def test_the_steps_of_timing_advances():
    # 48/13 µs there and back.
    assert pytest.approx(553.4629994, abs=1e-6) == GSM_STEP_M


def test_a_drawn_step_is_the_middle_of_what_it_covers_and_never_below_the_first():
    model = timing_advances(POSITION, [[0.0, 0.0]] * 2, 1e-9, 100.0)
    both = stack([model, timing_advances(POSITION, ORIGIN, 1e-9)])
    drawn = both.sample(
        np.array([[99.0, 0.0], [101.0, 0.0], [350.0, 0.0]]), np.random.default_rng(1)
    )
    np.testing.assert_array_equal(drawn[:, :2], [[50.0] * 2, [150.0] * 2, [350.0] * 2])
    np.testing.assert_allclose(drawn[:, 2], [99.0, 101.0, 350.0], atol=1e-6)
    # Errors of a hundred metres bring half of these below 0.
    wide = timing_advances(POSITION, ORIGIN, 100.0, 1.0)
    assert wide.sample(np.zeros((400, 2)), np.random.default_rng(2)).min() == 0.5


def test_a_measured_pattern_is_sampled_anticlockwise():
    angle = np.arange(360.0)
    antenna = MeasuredAntenna(
        "made", angle, angle / 30, np.array([0.0, 10.0, 180.0]), np.array([0.0, 4.0, 6.0])
    )
    four = sampled_pattern(antenna, samples=4)
    assert four.shape == (4,)
    np.testing.assert_array_equal(sampled_pattern(antenna)[[0, 90, 180, 270]], four)
    # Angles of data sheets run clockwise.
    assert four[3] == pytest.approx(four[0] - 3.0)
    assert four[1] == pytest.approx(four[0] - 9.0)
    assert sampled_pattern(antenna, np.radians(5.0))[0] == pytest.approx(four[0] - 2.0)


def test_the_antenna_and_the_shortest_distance_unless_told_otherwise():
    model = levels(POSITION, ORIGIN, 8.0, **LOSS, boresight_rad=0.0)
    around = 1000.0 * np.array([[1, 0], [np.cos(np.pi / 6), np.sin(np.pi / 6)], [-1, 0]])
    # Half the beamwidth of 60° costs 3 dB, behind it is 20 dB.
    np.testing.assert_allclose(model.mean(around)[:, 0], [-130.0, -133.0, -150.0], atol=1e-9)
    # Without a boresight there is no antenna.
    plain = levels(POSITION, ORIGIN, 8.0, **LOSS)
    np.testing.assert_allclose(plain.mean(around)[:, 0], -130.0)
    near = np.array([[0.5, 0.0], [1.0, 0.0], [0.0, 0.0], [2.0, 0.0]])
    at_metre = -130.0 + 35.0 * 3
    np.testing.assert_allclose(
        plain.mean(near)[:, 0], [at_metre] * 3 + [at_metre - 35.0 * math.log10(2)], atol=1e-9
    )
    slopes = plain.jacobian(near)[:, 0, 0]
    np.testing.assert_array_equal(slopes[:3], 0.0)
    assert slopes[3] == pytest.approx(-35.0 / math.log(10) / 2.0)
    assert levels(POSITION, ORIGIN, 8.0, **LOSS, shortest_distance_m=10.0).mean(near)[3, 0] == (
        pytest.approx(-130.0 + 35.0 * 2)
    )


def test_where_position_and_clock_stand():
    assert POSITION.uses == (0, 1)
    assert POSITION_CLOCK_3D.uses == (0, 1, 2, 3)
    assert (MOVING.uses, MOVING.velocity) == ((0, 2), (1, 3))
    assert (MOVING_CLOCK.uses, MOVING_CLOCK.velocity) == ((0, 2, 4), (1, 3))
    assert (MOVING_3D.uses, MOVING_3D.velocity) == ((0, 2, 4), (1, 3, 5))
    assert (MOVING_CLOCK_3D.uses, MOVING_CLOCK_3D.velocity) == ((0, 2, 4, 6), (1, 3, 5))
    sizes = [s.size for s in (POSITION, MOVING, MOVING_CLOCK, MOVING_3D, MOVING_CLOCK_3D)]
    assert sizes == [2, 4, 6, 6, 8]
    assert StateLayout(2, 0, 1).height_m == POSITION_CLOCK_3D.height_m == 0.0
    slots = [timing_advances(s, ORIGIN, 1.0).slots.tolist() for s in (POSITION, MOVING_CLOCK_3D)]
    assert slots == [[0, 1, -1, -1], [0, 1, 2, 3]]
    assert timing_advances(MOVING_CLOCK, ORIGIN, 1.0).slots.tolist() == [0, 1, -1, 2]


def test_what_lies_on_the_border_is_taken():
    assert levels(POSITION, ORIGIN, 1e-9, **LOSS, max_attenuation_db=0.0).size == 1
    assert levels(POSITION, ORIGIN, 1.0, **LOSS, max_attenuation_db=INF).size == 1
    assert levels(POSITION, ORIGIN, 1.0, **LOSS, beamwidth_rad=0.01).size == 1
    assert levels(POSITION, ORIGIN, 1.0, **LOSS, shortest_distance_m=0.01).size == 1
    assert timing_advances(POSITION, [5.0, 6.0], 0.5).mean([5.0, 6.0]).tolist() == [0.0]
    assert range_differences(POSITION, [[0, 0], [1, 0]], [1.0, 2.0], 1).size == 1
    assert difference_covariance([1.0, 2.0], 1).tolist() == [[5.0]]
    assert StateLayout(2, 1, 0).uses == (1, 0)
    # Rounding leaves a matrix symmetric, and it is made so.
    skewed = position_fix(POSITION, [[1.0, 0.5], [0.5 * (1 + 9e-10), 1.0]]).covariance()
    assert skewed[0, 1] == skewed[1, 0] == pytest.approx(0.5 * (1 + 4.5e-10), rel=1e-12)


DOORS = {
    "covariance_m2: expected a symmetric": lambda: position_fix(
        POSITION, [[1.0, 0.5], [0.5 * (1 + 1.5e-9), 1.0]]
    ),
    "covariance_m2: expected finite numbers, shape .2, 2.": lambda: position_fix(MOVING, 1.0),
    "covariance_m2: expected finite numbers": lambda: position_fix(MOVING, [[NAN, 0], [0, 1.0]]),
    "covariance_m2: expected a positive definite": lambda: position_fix(MOVING, np.zeros((2, 2))),
    "covariance_m2: expected 2 x 2": lambda: position_fix(MOVING, np.eye(3)),
    "sites_m: expected positions": lambda: timing_advances(MOVING, [[1.0] * 4], 1.0),
    "sites_m: expected positions, shape": lambda: timing_advances(MOVING, [[[1.0, 2.0]]], 1.0),
    "sites_m: expected positions, .*m, 2": lambda: timing_advances(MOVING, np.zeros((0, 3)), 1.0),
    "sites_m: expected positions.*1,": lambda: timing_advances(MOVING, [[1.0]], 1.0),
    "sites_m: expected finite metres": lambda: levels(MOVING, [[INF, 0.0]], 1.0, **LOSS),
    "sigma_m: expected one deviation or 1": lambda: timing_advances(MOVING, ORIGIN, [1.0, 2.0]),
    "sigma_m: expected deviations": lambda: timing_advances(MOVING, [[0, 0]] * 2, [1.0, 0.0]),
    "sigma_m: expected deviations above 0": lambda: timing_advances(MOVING, ORIGIN, INF),
    "sigma_db: expected deviations": lambda: levels(MOVING, ORIGIN, -1.0, **LOSS),
    "step_m: expected metres": lambda: timing_advances(MOVING, ORIGIN, 1.0, INF),
    "step_m: expected metres >= 0": lambda: timing_advances(MOVING, ORIGIN, 1.0, -1e-9),
    "beamwidth_rad": lambda: levels(MOVING, ORIGIN, 1.0, **LOSS, beamwidth_rad=0.0),
    "beamwidth_rad: exp": lambda: levels(MOVING, ORIGIN, 1.0, **LOSS, beamwidth_rad=INF),
    "shortest: expected": lambda: levels(MOVING, ORIGIN, 1.0, **LOSS, shortest_distance_m=0.0),
    "shortest: exp": lambda: levels(MOVING, ORIGIN, 1.0, **LOSS, shortest_distance_m=NAN),
    "max_attenuation_db": lambda: levels(MOVING, ORIGIN, 1.0, **LOSS, max_attenuation_db=-0.1),
    "max_attenuation_db: e": lambda: levels(MOVING, ORIGIN, 1.0, **LOSS, max_attenuation_db=NAN),
    "pattern_db": lambda: levels(MOVING, ORIGIN, 1.0, **LOSS, pattern_db=np.array([0.0, NAN])),
    "pattern_db: exp": lambda: levels(MOVING, ORIGIN, 1.0, **LOSS, pattern_db=np.zeros((2, 2))),
    "eirp_dbm": lambda: levels(MOVING, ORIGIN, 1.0, **LOSS, eirp_dbm=[1.0, 2.0]),
    "boresight_rad": lambda: levels(MOVING, ORIGIN, 1.0, **LOSS, boresight_rad=NAN),
    "exponent": lambda: levels(MOVING, ORIGIN, 1.0, loss_at_km_db=1.0, exponent=INF),
    "stations_m: expected at least two": lambda: range_differences(MOVING, [[0, 0]], 1.0),
    "reference: expected an index in 0..1, found 2": lambda: range_differences(
        MOVING, [[0, 0], [1, 1]], 1.0, 2
    ),
    "reference.*found -1": lambda: range_differences(MOVING, [[0, 0], [1, 1]], 1.0, -1),
    "pseudorange: expected a state with a clock": lambda: pseudoranges(MOVING, [[0, 0, 1]], 1.0),
    "satellites_m": lambda: pseudoranges(MOVING_CLOCK, [[0, 0, NAN]], 1.0),
    "state layout: expected different indices in 0..1": lambda: StateLayout(2, 0, 2),
    "state layout.*-1": lambda: StateLayout(2, -1, 1),
    "state layout": lambda: StateLayout(4, 0, 1, 2, 2),
    "measurements: expected at least one": lambda: stack([]),
    "measurements: expected states": lambda: stack(
        [timing_advances(s, ORIGIN, 1.0) for s in (POSITION, POSITION, MOVING)]
    ),
    "state: expected shape .*, 2., found": lambda: timing_advances(POSITION, ORIGIN, 1).mean(3),
    "state: expected shape": lambda: timing_advances(POSITION, ORIGIN, 1).jacobian(np.zeros(4)),
}


@pytest.mark.parametrize(("said", "make"), DOORS.items(), ids=range(len(DOORS)))
def test_what_lies_beyond_is_told(said, make):
    with pytest.raises(InputError, match=said):
        make()
