"""Parts of a state that are drawn, by hand: their gain, and the covariance that is left."""

import numpy as np
import pytest

from mapfilter.filters._rao_blackwell import propagate

NONE = np.zeros((3, 3))
ALL = np.eye(3)


@pytest.mark.parametrize("scale", [1e-12, 1.0, 1e12])
def test_drawn_parts_of_any_unit(scale):
    """Of variances 4 and 9, and a covariance of 3 with the first: 3 / 2, and 9 - 9 / 4 are left."""
    process = scale * np.array([[4.0, 3.0, 0.0], [3.0, 9.0, 0.0], [0.0, 0.0, 5.0]])
    gain, left = propagate(NONE, ALL, process, np.array([0]))
    assert gain[:, 0].tolist() == pytest.approx(np.sqrt(scale) * np.array([2, 1.5, 0]), abs=0)
    expected = scale * np.array([[0, 0, 0], [0, 6.75, 0], [0, 0, 5]])
    np.testing.assert_allclose(left, expected, rtol=1e-12, atol=0)


@pytest.mark.parametrize("scale", [1e-12, 1.0, 1e12])
def test_what_was_drawn_already_leaves_nothing(scale):
    """Two parts of one error, 2 and 3 times it: the second has no draw of its own."""
    one = np.array([2.0, 3.0, 1.0])
    gain, left = propagate(NONE, ALL, scale * np.outer(one, one), np.array([0, 1]))
    expected = np.sqrt(scale) * np.array([[2, 0], [3, 0], [1, 0]])
    np.testing.assert_allclose(gain, expected, rtol=1e-12, atol=0)
    np.testing.assert_allclose(left, NONE, atol=1e-12 * scale)


def test_a_part_that_is_moved_by_another():
    """A place that a speed of variance 4 moves for 3 s: by 36, and by 12 with the speed."""
    move = np.array([[1.0, 3.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    before = np.diag([1.0, 4.0, 0.0])
    gain, left = propagate(before, move, NONE, np.array([0]))
    # 37 in all; the speed's covariance is 12.
    root = 37**0.5
    assert gain[:, 0].tolist() == pytest.approx([root, 12 / root, 0])
    assert left[1, 1] == pytest.approx(4 - 144 / 37)
    assert left[0].tolist() == [0, 0, 0]
    assert left[:, 0].tolist() == [0, 0, 0]
