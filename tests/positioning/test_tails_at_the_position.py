"""Shares beyond no distance at all, and beyond each distance of a sample."""

import numpy as np
import pytest

from mapfilter.positioning.gaussian_tail import GaussianTail
from mapfilter.positioning.integrity import SampleTail


@pytest.mark.parametrize("radius_m", [0.0, -3.0])
def test_all_of_a_mixture_is_beyond_no_distance(radius_m):
    tail = GaussianTail(
        np.array([0.3, 0.7]), np.array([[3.0, 4.0], [0.0, 0.0]]), np.tile(np.eye(2), (2, 1, 1))
    )
    assert tail.outside(radius_m) == 1.0


def test_the_share_of_samples_beyond_a_radius():
    """What lies at the radius itself is within it."""
    tail = SampleTail(np.array([1.0, 4.0, 9.0]), np.array([0.5, 0.3, 0.2]), 0.1, 40.0)
    for radius_m, share in ((0.5, 1.0), (1.0, 0.5), (4.0, 0.2), (8.9, 0.2), (9.0, 0.0)):
        assert tail.outside(radius_m) == pytest.approx(share)
