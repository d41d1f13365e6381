"""Lines along the middle of streets."""

import numpy as np
from scipy.ndimage import label

from mapfilter.viewing.streets import middle_lines, thinned

EIGHT = np.ones((3, 3))


def town():
    """Streets three pixels wide along rows, two along columns, and a square."""
    there = np.zeros((80, 90), dtype=bool)
    there[10:13, 5:85] = there[50:53, 5:85] = True
    there[5:75, 20:22] = there[5:75, 70:72] = True
    there[30:40, 40:55] = True
    return there


def test_lines_are_thin_and_as_connected_as_the_streets():
    there = town()
    thin = thinned(there)
    assert np.all(there[thin])
    assert label(thin, EIGHT)[1] == label(there, EIGHT)[1] == 2
    # Nowhere four pixels in a square.
    assert not np.any(thin[:-1, :-1] & thin[1:, :-1] & thin[:-1, 1:] & thin[1:, 1:])
    assert thin.sum() < 0.5 * there.sum()


def test_lines_run_along_the_middle_and_keep_their_way():
    way = np.zeros((80, 90), dtype=np.int64)
    way[10:13, 5:85] = 7
    way[40:43, 5:85] = 8
    lines, owners = middle_lines(way)
    assert sorted(set(owners)) == [7, 8]
    for line, owner in zip(lines, owners, strict=True):
        assert np.all(np.abs(line[:, 0] - {7: 11, 8: 41}[owner]) <= 1)
    length = sum(np.abs(np.diff(line[:, 1])).sum() for line in lines)
    assert length > 2 * 70


def test_no_street_no_line():
    assert middle_lines(np.zeros((4, 4), dtype=np.int64)) == ([], [])
