"""Maps that lack ways: how many, which points go with them, and which stay."""

import numpy as np
import shapely

from mapfilter.experiments.benchmarks.world import without_ways
from mapfilter.lattice import Lattice
from mapfilter.roads.lattice import RouteLattice
from mapfilter.roads.ways import Ways

CRS = "EPSG:32629"
WEST_M, NORTH_M = 500_000.0, 4_500_000.0


def ways_of(lines, ids=None):
    count = len(lines)
    return Ways(
        CRS,
        np.arange(1, count + 1) if ids is None else np.asarray(ids),
        np.zeros(count, np.int16),
        ("residential",),
        np.array([shapely.LineString(line) for line in lines], dtype=object),
        np.zeros(count, bool),
        np.zeros(count, np.int8),
    )


def street(row, cols=40):
    """A straight street along one row of a lattice of 10 m."""
    north = NORTH_M - 10.0 * (row + 0.5)
    return [(WEST_M + 5.0, north), (WEST_M + 10.0 * cols - 5.0, north)]


def lattice_of(rows, way_ids, *, cols=40, on_square=None):
    """All points of some rows, each a way's."""
    lattice = Lattice(CRS, WEST_M, NORTH_M, 10.0, max(rows) + 2, cols)
    count = len(rows) * cols
    return RouteLattice(
        lattice,
        np.repeat(np.asarray(rows, np.int32), cols),
        np.tile(np.arange(cols, dtype=np.int32), len(rows)),
        np.repeat(np.asarray(way_ids, np.int64), cols),
        np.zeros(count, np.int16),
        ("residential", "square"),
        np.zeros(count, np.float32),
        np.zeros(count, bool) if on_square is None else on_square,
    )


class Chosen:
    """A generator whose first numbers are these."""

    def __init__(self, *numbers):
        self.numbers = numbers

    def random(self, size):
        assert size == len(self.numbers)
        return np.array(self.numbers)


def test_about_a_tenth_of_the_ways_is_missing():
    rows = list(range(0, 600, 3))
    routes = lattice_of(rows, range(1, 201), cols=4)
    ways = ways_of([street(row, 4) for row in rows])
    gone = []
    for seed in range(40):
        left = without_ways(routes, ways, 0.1, 6.0, np.random.default_rng(seed))
        missing = set(range(1, 201)) - set(left.way_id.tolist())
        # All points of a way go together.
        assert len(left) == 4 * (200 - len(missing))
        gone.append(len(missing))
    assert abs(np.mean(gone) - 20) < 4 * np.sqrt(200 * 0.1 * 0.9 / 40)
    assert min(gone) > 0


def test_a_share_of_nothing_and_of_all():
    routes, ways = lattice_of([0, 3], [1, 2]), ways_of([street(0), street(3)])
    rng = np.random.default_rng(1)
    assert len(without_ways(routes, ways, 0.0, 6.0, rng)) == 80
    assert len(without_ways(routes, ways, 1.0, 6.0, rng)) == 0


def test_the_points_of_a_missing_way_by_hand():
    routes, ways = lattice_of([0, 3], [1, 2]), ways_of([street(0), street(3)])
    left = without_ways(routes, ways, 0.1, 6.0, Chosen(0.5, 0.05))
    assert set(left.row.tolist()) == {0}
    assert set(left.way_id.tolist()) == {1}
    left = without_ways(routes, ways, 0.1, 6.0, Chosen(0.0999, 0.1))
    assert set(left.row.tolist()) == {3}


def test_parts_of_one_way_go_together():
    routes = lattice_of([0, 3], [7, 7])
    ways = ways_of([street(0), street(3)], [7, 7])
    assert len(without_ways(routes, ways, 0.5, 6.0, Chosen(0.4))) == 0
    assert len(without_ways(routes, ways, 0.5, 6.0, Chosen(0.6))) == 80


def test_points_near_another_way_become_its_own():
    """A way across the first street: where they cross, points stay."""
    across = [(WEST_M + 105.0, NORTH_M), (WEST_M + 105.0, NORTH_M - 50.0)]
    routes, ways = lattice_of([0], [1]), ways_of([street(0), across])
    left = without_ways(routes, ways, 0.5, 12.0, Chosen(0.1, 0.9))
    assert left.col.tolist() == [9, 10, 11]
    assert left.way_id.tolist() == [2, 2, 2]
    np.testing.assert_allclose(left.distance_to_way_m, [10.0, 0.0, 10.0])


def test_points_of_squares_stay_but_are_of_no_way():
    square = np.zeros(80, bool)
    square[40:45] = True
    routes = lattice_of([0, 3], [1, 2], on_square=square)
    left = without_ways(routes, ways_of([street(0), street(3)]), 0.5, 6.0, Chosen(0.9, 0.1))
    assert len(left) == 45
    on = left.row == 3
    assert left.way_id[on].tolist() == [0] * 5
    np.testing.assert_allclose(left.distance_to_way_m[on], 30.0)
