"""Static fixes against the reference, and readings that do not determine a state."""

import numpy as np
import pytest
from fusion_world import CASES

from mapfilter.errors import InputError
from mapfilter.models.gaussian import stack
from mapfilter.models.ranging import (
    position_fix,
    pseudoranges,
    range_differences,
    timing_advances,
)
from mapfilter.models.state import POSITION, POSITION_CLOCK_3D
from mapfilter.positioning.kalman.static_fix import (
    BAD_GEOMETRY,
    NOT_CONVERGED,
    TOO_FEW,
    static_fix,
)

CASE = CASES["gauss_newton"]
GNSS = pseudoranges(POSITION_CLOCK_3D, CASE["sats"], CASE["s_pr"])
TDOA = range_differences(POSITION_CLOCK_3D, CASE["bs"], CASE["s_toa"], CASE["ref"])
Y = np.array(CASE["y"])
START = CASE["hybrid"]["start"]


@pytest.mark.parametrize(
    ("name", "model", "reading", "start", "unknowns"),
    [
        ("hybrid", stack([GNSS, TDOA]), Y, START, None),
        ("gnss_only", GNSS, Y[:5], START, None),
        ("tdoa_xy_z_fixed_1p5", TDOA, Y[5:], [0.0, 0.0, 1.5, 0.0], (0, 1)),
    ],
)
def test_fixes_are_those_of_the_reference(name, model, reading, start, unknowns):
    fix = static_fix(model, reading, start, unknowns)
    assert fix.ok
    # Ranges of 2e7 m leave 4e-9 m.
    np.testing.assert_allclose(fix.state, CASE[name]["x"], rtol=1e-10, atol=5e-8)
    np.testing.assert_allclose(fix.covariance, CASE[name]["cov"], rtol=1e-8)


def test_two_satellites_and_two_stations_determine_nothing():
    """Two pseudoranges and one difference for four unknowns."""
    few = stack(
        [
            pseudoranges(POSITION_CLOCK_3D, CASE["sats"][:2], CASE["s_pr"][:2]),
            range_differences(POSITION_CLOCK_3D, CASE["bs"][:2], CASE["s_toa"][:2]),
        ]
    )
    fix = static_fix(few, np.append(Y[:2], Y[5]), START)
    assert fix.ok is CASES["dlr_two_sats_two_bs_underdetermined_ok"]
    assert np.isnan(fix.state).all()
    assert fix.problem == TOO_FEW


def test_satellites_close_together_are_bad_geometry_where_that_is_asked_for():
    """Four satellites within a degree: solvable, with a deviation of kilometres."""
    near = np.radians([[60.0, 0.0], [60.6, 0.5], [59.5, 0.9], [60.1, -0.7]])
    away = 2.2e7 * np.column_stack([
        np.cos(near[:, 0]) * np.sin(near[:, 1]), np.cos(near[:, 0]) * np.cos(near[:, 1]),
        np.sin(near[:, 0]),
    ])  # fmt: skip
    model = pseudoranges(POSITION_CLOCK_3D, away, 3.0)
    reading = model.mean([10.0, 20.0, 1.0, 85.0])
    fix = static_fix(model, reading, np.zeros(4))
    deviation = np.sqrt(np.linalg.eigvalsh(fix.covariance)[-1])
    assert fix.ok
    assert fix.problem == ""
    assert deviation > 1000
    told = static_fix(model, reading, np.zeros(4), largest_deviation=100.0)
    assert (told.ok, told.problem) == (False, BAD_GEOMETRY)
    assert static_fix(model, reading, np.zeros(4), largest_deviation=1.01 * deviation).ok


def test_stations_in_a_line_do_not_tell_the_sides_apart():
    model = timing_advances(POSITION, [[0.0, 0.0], [1000.0, 0.0], [2000.0, 0.0]], 10.0)
    reading = model.mean(np.array([500.0, 400.0]))
    assert static_fix(model, reading, [500.0, 0.0]).problem == BAD_GEOMETRY
    fix = static_fix(model, reading, [500.0, 10.0])
    np.testing.assert_allclose(fix.state, [500.0, 400.0], atol=1e-6)


def test_absent_components_are_left_out():
    model = timing_advances(POSITION, [[0.0, 0.0], [1000.0, 0.0], [0.0, 900.0]], [5.0, 8.0, 9.0])
    reading = model.mean(np.array([300.0, 400.0]))
    reading[2] = np.nan
    fix = static_fix(model, reading, [200.0, 200.0])
    np.testing.assert_allclose(fix.state, [300.0, 400.0], atol=1e-6)
    assert not static_fix(model, [np.nan, np.nan, 3.0], [200.0, 200.0]).ok
    assert not static_fix(model, np.full(3, np.nan), [200.0, 200.0]).ok


def test_readings_that_no_place_explains_give_the_place_that_explains_them_best():
    model = timing_advances(POSITION, [[0.0, 0.0], [1000.0, 0.0], [0.0, 900.0]], 10.0)
    fix = static_fix(model, [300.0, 900.0, 500.0], [5000.0, 5000.0])
    assert fix.ok
    cost = np.sum((np.array([300.0, 900.0, 500.0]) - model.mean(fix.state)) ** 2)
    for shift in ([1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]):
        assert cost < np.sum((np.array([300.0, 900, 500]) - model.mean(fix.state + shift)) ** 2)


def test_the_covariance_is_that_of_many_fixes():
    sites = [[0.0, 0.0], [1000.0, 0.0], [0.0, 900.0]]
    model = timing_advances(POSITION, sites, [5.0, 8.0, 9.0])
    truth = np.array([300.0, 400.0])
    rng = np.random.default_rng(8)
    fixes = [static_fix(model, model.sample(truth, rng), [200.0, 200.0]) for _ in range(1500)]
    spread = np.cov(np.array([fix.state for fix in fixes]).T)
    np.testing.assert_allclose(spread, fixes[0].covariance, rtol=0.12, atol=4)


def test_what_is_wrong_is_said():
    with pytest.raises(InputError, match="start"):
        static_fix(GNSS, Y[:5], [np.nan, 0, 0, 0])
    with pytest.raises(InputError, match="reading"):
        static_fix(GNSS, Y[:5] * np.inf, START)


@pytest.mark.parametrize("count", [4, 6])
def test_readings_of_another_length_are_refused(count):
    with pytest.raises(InputError, match=rf"reading: expected shape \(5,\), found \({count},\)"):
        static_fix(GNSS, np.resize(Y, count), START)


def test_steps_are_counted_until_one_changes_nothing():
    """A plain position is found by the first step; the second shows it."""
    model = position_fix(POSITION, np.diag([4.0, 9.0]))
    fix = static_fix(model, [3.0, 4.0], [3.0, 0.0])
    np.testing.assert_allclose(fix.state, [3.0, 4.0])
    np.testing.assert_allclose(fix.covariance, np.diag([4.0, 9.0]))
    assert (fix.ok, fix.iterations, fix.problem) == (True, 2, "")
    few = static_fix(model, [3.0, np.nan], [3.0, 0.0])
    assert (few.iterations, few.problem, few.covariance.shape) == (0, TOO_FEW, (2, 2))


class Backwards:
    """A measurement whose derivative has the wrong sign: each step leads away."""

    def __init__(self):
        self.derivatives = 0

    def mean(self, state):
        return np.asarray(state)

    def jacobian(self, state):
        self.derivatives += 1
        return -np.eye(len(state))

    def covariance(self):
        return np.eye(2)


def test_steps_that_never_end_are_given_up():
    backwards = Backwards()
    fix = static_fix(backwards, [3.0, 4.0], [0.0, 0.0])
    assert (fix.ok, fix.problem, fix.iterations) == (False, NOT_CONVERGED, 50)
    assert backwards.derivatives == 50
    assert np.isnan(fix.state).all()


def test_nearly_in_a_line_is_bad_geometry_too():
    """A millionth of a metre beside the line: the sides differ by some 1e-9 of the way along it."""
    model = timing_advances(POSITION, [[0.0, 0.0], [1000.0, 0.0], [2000.0, 0.0]], 10.0)
    fix = static_fix(model, model.mean(np.array([500.0, 400.0])), [500.0, 1e-6])
    assert (fix.problem, fix.iterations) == (BAD_GEOMETRY, 1)
