"""Errors of levels that last, in the state of Kalman-type filters; by hand and by plain NumPy."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapfilter.errors import InputError
from mapfilter.filters.gaussian import CKF, EKF, IEKF, RBUKF, UKF, factor_of, factors_of
from mapfilter.models.gaussian import stack
from mapfilter.models.ranging import timing_advances
from mapfilter.models.signal_strength import levels, with_errors
from mapfilter.models.state import MOVING, POSITION, StateLayout
from mapfilter.positioning.kalman.belief import SumBelief
from mapfilter.positioning.kalman.level_errors import (
    CellSlots,
    LastingLevels,
    with_levels,
    with_own_spread,
)
from mapfilter.positioning.kalman.models import KalmanOptions, compiled

SITES = [[0.0, 0.0], [400.0, 100.0], [-300.0, 500.0]]
LOSS = {"loss_at_km_db": 130.0, "exponent": 3.5, "eirp_dbm": 50.0}
LASTING = LastingLevels(6.0, 3000.0, 9.0, 300.0)


def test_the_usual_errors():
    assert KalmanOptions().lasting_levels == LastingLevels(10.0, 3000.0, 12.0, 300.0)


def test_cells_give_way_that_were_not_heard_within_the_memory():
    heard = CellSlots.empty(3).after_report(["A", "B", "A"], 0.0, 300.0)
    assert heard.slots.cells == ("A", "B", "")
    assert (heard.growth, heard.renewed) == ({"A": 1.0, "B": 1.0}, {0: 1.0, 1: 1.0})
    heard = heard.slots.after_report(["C", "A"], 100.0, 300.0)
    assert (heard.slots.cells, heard.renewed) == (("A", "B", "C"), {2: 1.0})
    # B was heard 299 m ago: D has no place.
    heard = heard.slots.after_report(["D", "A"], 199.0, 300.0)
    assert (heard.slots.cells, heard.renewed) == (("A", "B", "C"), {})
    assert heard.growth == {"D": 1.0, "A": 600 / 199}
    assert heard.slots.ago_m == {"A": 0.0, "B": 299.0, "C": 199.0, "D": 0.0}
    # B gives way, not C, which was heard later; D counts as if it had been heard once.
    heard = heard.slots.after_report(["D", "E"], 100.0, 300.0)
    assert (heard.slots.cells, heard.renewed) == (("A", "D", "C"), {1: 6.0})
    assert heard.slots.ago_m["B"] == 399.0
    # Of a report, no cell takes the place of another one.
    heard = heard.slots.after_report(["E", "C", "D", "A"], 1e6, 300.0)
    assert (heard.slots.cells, heard.renewed) == (("A", "D", "C"), {})
    assert heard.growth == dict.fromkeys("ECDA", 1.0)
    heard = heard.slots.after_report(["E", "F", "G", "H"], 600.0, 300.0)
    assert set(heard.slots.cells) == {"E", "F", "G"}
    assert CellSlots.empty(0).after_report(["A"], 0.0, 300.0) == (CellSlots.empty(0), {}, {})


def test_a_cell_that_is_heard_again_on_the_spot_tells_nothing():
    heard = CellSlots.empty(1).after_report(["A", "B"], 0.0, 300.0)
    heard = heard.slots.after_report(["A", "B"], 0.0, 300.0)
    assert (heard.slots.cells, heard.growth["B"]) == (("A",), 6000.0)
    # An error that lasts for less than that is another one each time.
    heard = heard.slots.after_report(["A", "B"], 0.0, 1e-3)
    assert heard.growth == {"A": 1.0, "B": 1.0}


@given(
    st.lists(
        st.tuples(
            st.lists(st.sampled_from("ABCDEFG"), max_size=5),
            st.sampled_from([0.0, 100.0, 299.0, 300.0, 1000.0]),
        ),
        max_size=12,
    )
)
def test_slots_never_hold_a_cell_twice(reports):
    slots, at_m, last_m = CellSlots.empty(3), 0.0, dict[str, float]()
    for names, moved_m in reports:
        at_m += moved_m
        before = slots
        slots, growth, renewed = before.after_report(names, moved_m, 300.0)
        held = [one for one in slots.cells if one]
        assert len(set(held)) == len(held)
        assert growth.keys() == set(names)
        for slot in range(3):
            if slot in renewed:
                assert slots.cells[slot] in names
                old = before.cells[slot]
                assert old not in names
                assert not old or at_m - last_m[old] >= 300.0
            else:
                assert slots.cells[slot] == before.cells[slot]
        for name in names:
            ago_m = at_m - last_m[name] if name in last_m else 600.0
            assert growth[name] == max(600.0 / max(ago_m, 0.1), 1.0)
        last_m |= dict.fromkeys(names, at_m)


def test_components_are_behind_the_others():
    slots = CellSlots(("B", "A"))
    layout = with_levels(MOVING, slots)
    assert (layout.size, layout.east, layout.north) == (7, 0, 2)
    assert slots.components(["A", "Z", "B"], layout) == [(4, 6), (4, -1), (4, 5)]
    assert with_levels(MOVING, CellSlots.empty(0)) == MOVING


def test_a_belief_begins_with_what_is_assumed():
    slots = CellSlots.empty(2)
    belief = SumBelief.start([1.0, 2.0], np.diag([4.0, 9.0]), {0: 3})
    wide = LASTING.extended_belief(belief, slots)
    assert wide.means[:, :2].tolist() == belief.means.tolist()
    assert not wide.means[:, 2:].any()
    for own, all_ in zip(belief.covariances, wide.covariances, strict=True):
        expected = np.zeros((5, 5))
        expected[:2, :2] = own
        expected[[2, 3, 4], [2, 3, 4]] = 36.0, 81.0, 81.0
        np.testing.assert_array_equal(all_, expected)


def test_errors_fade_along_the_way_and_renewed_ones_begin_anew():
    slots = CellSlots(("A", "B"))
    rng = np.random.default_rng(1)
    mean, root = rng.normal(size=5), rng.normal(size=(5, 5))
    belief = SumBelief.start(mean, root @ root.T)
    motion = np.eye(2), 0.5 * np.eye(2), np.array([3.0, -1.0])
    moved = belief.predict(*LASTING.extended_motion(motion, slots, {1: 2.5}, 30.0))
    kept = np.array([1.0, 1.0, np.exp(-0.01), np.exp(-0.1), 0.0])
    np.testing.assert_allclose(moved.means[0], kept * mean + [3.0, -1.0, 0.0, 0.0, 0.0])
    expected = np.outer(kept, kept) * (root @ root.T)
    expected += np.diag([0.5, 0.5, *(1 - kept[2:] ** 2) * [36.0, 81.0, 2.5 * 81.0]])
    np.testing.assert_allclose(moved.covariances[0], expected, atol=1e-12)
    still = belief.predict(*LASTING.extended_motion(motion, slots, {}, 0.0))
    np.testing.assert_allclose(still.covariances[0][2:, 2:], (root @ root.T)[2:, 2:])


def test_levels_contain_the_errors_of_the_state():
    layout = StateLayout(6, 0, 1)
    plain = levels(layout, SITES, 8.0, **LOSS, boresight_rad=[0.1, 1.0, 2.0])
    model = with_errors(plain, [(2, 4), (2, -1), (-1, 5)])
    assert model.errors == (2, 4, 5)
    rng = np.random.default_rng(2)
    states = np.column_stack([rng.uniform(-900, 900, (20, 2)), rng.normal(0, 9, (20, 4))])
    expected = plain.mean(states)
    expected += states[:, [2, 2, 5]] + np.column_stack([states[:, 4], np.zeros((20, 2))])
    np.testing.assert_allclose(model.mean(states), expected, rtol=1e-12)
    numeric = np.empty((20, 3, 6))
    for j in range(6):
        step = 1e-4 * np.eye(6)[j]
        numeric[:, :, j] = (model.mean(states + step) - model.mean(states - step)) / 2e-4
    np.testing.assert_allclose(model.jacobian(states), numeric, atol=1e-6)


def test_levels_with_errors_are_put_together_with_others():
    layout = StateLayout(6, 0, 1)
    one, other = (levels(layout, [site], 8.0, **LOSS) for site in SITES[:2])
    advance = timing_advances(layout, [SITES[2]], 200.0)
    apart = [with_errors(one, [(5, 3)]), advance, with_errors(other, [(2, -1)])]
    whole = stack(apart)
    assert whole.errors == (2, 3, 5)
    states = np.random.default_rng(3).normal(0, 300, (10, 6))
    expected = np.column_stack([model.mean(states)[:, 0] for model in apart])
    np.testing.assert_array_equal(whole.mean(states), expected)
    slope = np.concatenate([model.jacobian(states) for model in apart], axis=1)
    np.testing.assert_array_equal(whole.jacobian(states), slope)


def test_errors_that_the_state_lacks_are_refused():
    layout = StateLayout(4, 0, 1)
    model = levels(layout, SITES[:2], 8.0, **LOSS)
    for components in ([(4, -1)], [(2, 1)], [(2, 3)] * 3):
        with pytest.raises(InputError, match="components: expected"):
            with_errors(model, components)
    timed = stack([model, timing_advances(layout, [SITES[2]], 200.0)])
    with pytest.raises(InputError, match="at most a pair for each of 2 levels, found 3"):
        with_errors(timed, [(2, 3)] * 3)
    assert with_errors(timed, [(2, 3)] * 2).errors == (2, 3)


def plain_ekf(model, mean, covariance, reading):
    """Textbook, with an inverse."""
    slope = model.jacobian(mean)
    gain = covariance @ slope.T @ np.linalg.inv(slope @ covariance @ slope.T + model.noise)
    left = np.eye(mean.size) - gain @ slope
    return mean + gain @ (reading - model.mean(mean)), left @ covariance


def test_an_update_is_that_of_the_textbook():
    layout = with_levels(POSITION, CellSlots.empty(3))
    model = levels(layout, SITES, 8.0, **LOSS)
    model = with_errors(model, [(2, 3), (2, 4), (2, 5)])
    mean = np.array([250.0, -120.0, 1.0, -2.0, 0.0, 3.0])
    covariance = np.diag([400.0, 900.0, 36.0, 81.0, 81.0, 81.0])
    reading = np.array([-60.0, -75.0, -90.0])
    belief, news = SumBelief.start(mean, covariance).update(compiled(model), reading, EKF, 2)
    expected = plain_ekf(model, mean, covariance, reading)
    np.testing.assert_allclose(belief.means[0], expected[0], rtol=1e-9)
    np.testing.assert_allclose(belief.covariances[0], expected[1], rtol=1e-8, atol=1e-8)
    assert news.used


@pytest.mark.parametrize("method", [UKF, CKF, RBUKF], ids=lambda one: one.name)
def test_errors_that_are_known_change_nothing(method):
    """Sigma points lie where they lay without errors in the state: so do results."""
    slots = CellSlots.empty(3)
    wide, narrow = with_levels(POSITION, slots), POSITION
    model, small = levels(wide, SITES, 8.0, **LOSS), levels(narrow, SITES, 8.0, **LOSS)
    model = with_errors(model, [(2, 3), (2, 4), (2, 5)])
    covariance = np.diag([2500.0, 3600.0, *[1e-12] * 4])
    mean, reading = np.array([250.0, -120.0, *[0.0] * 4]), np.array([-60.0, -75.0, -90.0])
    own = with_own_spread(method, slots.size)
    found, _ = SumBelief.start(mean, covariance).update(compiled(model), reading, own)
    alone = SumBelief.start(mean[:2], covariance[:2, :2])
    alone, _ = alone.update(compiled(small), reading, method)
    np.testing.assert_allclose(found.means[0, :2], alone.means[0], rtol=1e-6)
    np.testing.assert_allclose(found.covariances[0, :2, :2], alone.covariances[0], rtol=1e-5)


def test_linear_methods_have_no_sigma_points():
    for method in (EKF, IEKF):
        assert with_own_spread(method, 4) is method
    assert with_own_spread(UKF, 0) is UKF


def test_parts_at_one_place_fall_together_and_keep_their_spread():
    """Places and weights count, not the errors that follow from them; second moments stay."""
    covariance = np.diag([100.0, 100.0, 81.0])
    means = np.array([[0.0, 0.0, 20.0], [3.0, 0.0, -20.0], [500.0, 0.0, 0.0]])
    weights = np.array([0.5, 0.3, 0.2])
    belief = SumBelief(weights, means, np.tile(covariance, (3, 1, 1)), np.arange(3))
    found = belief._lessened(2)
    assert found.weights.tolist() == pytest.approx([0.8, 0.2])
    assert found.parts.tolist() == [0, 2]
    off = means[1] - means[0]
    np.testing.assert_allclose(found.covariances[0], covariance + 0.375 * np.outer(off, off))
    assert belief._lessened(None).weights.size == 3


def test_of_many_parts_the_lightest_are_dropped_together():
    weights = 70 * np.array([*[1 / 70] * 70, 4e-5, 5e-5, 2e-5])
    means = 1e4 * np.arange(146.0).reshape(73, 2)
    belief = SumBelief(
        weights / weights.sum(), means, np.tile(np.eye(2), (73, 1, 1)), np.arange(73)
    )
    # Of the last three, the lighter ones have less than 1e-4 together.
    assert set(belief._lessened(None).parts) == {*range(70), 71}


def test_factors_of_many_are_those_of_each():
    rng = np.random.default_rng(3)
    root = rng.normal(size=(7, 4, 4))
    many = root @ root.transpose(0, 2, 1) * np.outer([1.0, 1e3, 1e-3, 1.0], [1.0, 1e3, 1e-3, 1.0])
    found = factors_of(many, 4)
    for one, expected in zip(found, many, strict=True):
        np.testing.assert_allclose(one, factor_of(expected, 4), rtol=1e-9)
    many[2] = np.diag([1.0, 0.0, 2.0, 0.0])
    np.testing.assert_allclose(factors_of(many, 4)[2] @ factors_of(many, 4)[2].T, many[2])
    for fault in (np.nan, -1.0):
        wrong = many.copy()
        wrong[5, 1, 1] = fault
        with pytest.raises(InputError):
            factors_of(wrong, 4)
    wrong = many.copy()
    wrong[5, 0, 1] += 1.0
    with pytest.raises(InputError, match="symmetric"):
        factors_of(wrong, 4)
    with pytest.raises(InputError, match="shape"):
        factors_of(many[:, :3, :3], 4)
