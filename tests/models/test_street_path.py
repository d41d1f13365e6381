"""Paths laid through a map, against a plain sum over the two modes of the map."""

import numpy as np
import pytest

from mapfilter.models.street_path import weigh_path
from mapfilter.models.way_map import MapFactors

FACTORS = MapFactors(0.4, 0.6, 0.02, 0.05)


def plain(end_m, earlier_m, turned_rad, on_map, resolution_m, off):
    """Sum over all sequences of being on and off the map."""
    rows, cols = on_map.shape
    turn = np.array(
        [[np.cos(turned_rad), -np.sin(turned_rad)], [np.sin(turned_rad), np.cos(turned_rad)]]
    )
    mode = np.array([1 - off, off])
    change = np.array(
        [[1 - FACTORS.leave, FACTORS.leave], [FACTORS.come_back, 1 - FACTORS.come_back]]
    )
    for place in [*earlier_m, (0.0, 0.0)]:
        east_m, north_m = end_m + turn @ np.asarray(place, dtype=float)
        col = min(max(int(east_m / resolution_m), 0), cols - 1)
        row = min(max(rows - 1 - int(north_m / resolution_m), 0), rows - 1)
        mode = (mode @ change) * np.array([on_map[row, col], FACTORS.off])
    return np.log(mode.sum()), mode[1] / mode.sum()


@pytest.mark.parametrize("turned_rad", [0.0, 0.7, -2.9])
def test_a_path_is_weighed_like_all_sequences_of_modes(turned_rad):
    rng = np.random.default_rng(7)
    on_map = rng.uniform(1e-4, 1.0, (30, 40)).astype(np.float32)
    ends_m = (rng.random((2, 50)) * [[200.0], [150.0]]).astype(np.float32)
    earlier_m = np.float32([(5.0 * k - 60.0, 0.3 * k**2 - 40.0) for k in range(12)])
    found, off = np.empty(50, np.float32), np.full(50, 0.05, np.float32)
    weigh_path(ends_m, earlier_m, turned_rad, on_map, 5.0, FACTORS, found, off)
    wanted = [plain(end, earlier_m, turned_rad, on_map, 5.0, 0.05) for end in ends_m.T]
    same = np.isclose(found, [value for value, _ in wanted], atol=2e-4)
    # A place within a rounding of a pixel's edge may take that pixel's neighbour.
    assert same.mean() > 0.9
    assert np.allclose(off[same], [value for _, value in wanted] @ np.eye(50)[:, same], atol=2e-4)


def test_a_path_that_leaves_all_streets_is_as_likely_as_one_off_the_map():
    nowhere = np.full((10, 10), 1e-12, dtype=np.float32)
    ends_m = np.float32([[25.0], [25.0]])
    earlier_m = np.zeros((40, 2), dtype=np.float32)
    found, off = np.empty(1, np.float32), np.zeros(1, np.float32)
    weigh_path(ends_m, earlier_m, 0.0, nowhere, 5.0, FACTORS, found, off)
    expected = np.log(FACTORS.leave * FACTORS.off) + 40 * np.log(
        FACTORS.off * (1 - FACTORS.come_back)
    )
    assert found[0] == pytest.approx(expected, rel=1e-4)
    assert off[0] == pytest.approx(1.0, abs=1e-5)
