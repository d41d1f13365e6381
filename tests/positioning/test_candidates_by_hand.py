"""What the candidate filter and any filter are made of over a database, by stand-ins."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from mapfilter.errors import ConfigError
from mapfilter.filters.contract import Reason
from mapfilter.positioning.candidate import CandidateFilter, CandidateTracker, startable
from mapfilter.positioning.epochs import Epoch, ReportRow
from mapfilter.positioning.kalman.filter import KalmanFilter, KalmanTracker
from mapfilter.positioning.locators import as_filter
from mapfilter.radio.cells import CellPlan

DATABASE = SimpleNamespace(
    plan=CellPlan("EPSG:32629", ()), cell_ids=(), lattice=SimpleNamespace(resolution_m=10.0)
)


class Points:
    """Points of a cell, and what was asked of them."""

    def __init__(self, count):
        self.count, self.asked = count, []

    def __len__(self):
        return self.count

    def nearest(self, *given):
        self.asked.append(given)


def test_each_candidate_has_the_same_weight():
    east, north = np.array([1.0, 2.0, 3.0, 4.0]), np.array([5.0, 6.0, 7.0, 8.0])
    state = SimpleNamespace(belief=SimpleNamespace(east_m=east, north_m=north))
    found = CandidateTracker.hypotheses(None, state)
    np.testing.assert_array_equal(found.east_m, east)
    np.testing.assert_array_equal(found.north_m, north)
    np.testing.assert_array_equal(found.weight, 0.25)
    none = SimpleNamespace(belief=SimpleNamespace(east_m=east[:0], north_m=north[:0]))
    assert CandidateTracker.hypotheses(None, none).weight.size == 0
    assert CandidateTracker.hypotheses(None, SimpleNamespace(belief=None)) is None


def test_points_of_serving_cells_are_read_before_the_journey():
    """Once each, and those of unknown cells not at all."""
    points = {"A": Points(3), "B": Points(2)}
    search = SimpleNamespace(points_of=points.get)
    tracker = CandidateTracker(
        search, DATABASE, startable(points.get), lambda epoch: epoch.radio[0].cell, "candidate",
        takes=("serving",), ways=False,
    )  # fmt: skip
    epochs = [
        Epoch(float(k), radio=(ReportRow("serving", cell, None, None, -70.0, 0),))
        for k, cell in enumerate(["A", "X", "A", "B"])
    ]
    tracker.warm_up(epochs)
    assert [len(one.asked) for one in points.values()] == [1, 1]
    # Those that positions are matched to are read as well.
    read = []
    database = SimpleNamespace(points=lambda: read.append(1) or [][0])
    with pytest.raises(IndexError):
        replace(tracker, database=database, ways=True).warm_up(epochs)
    assert read == [1]


@pytest.mark.parametrize(
    ("count", "reason"),
    [(None, Reason.UNKNOWN_CELL), (0, Reason.NO_POINTS_IN_CELL), (1, Reason.USED)],
)
def test_a_filter_starts_from_a_cell_that_has_points(count, reason):
    assert startable(lambda _: None if count is None else Points(count))("A") is reason


def test_positions_are_matched_to_ways_unless_that_is_not_wanted():
    assert CandidateFilter().over(DATABASE).ways
    assert not CandidateFilter().over(DATABASE, ways=False).ways
    asked = SimpleNamespace(over=lambda database, ways: (database, ways))
    assert as_filter(asked, DATABASE) == (DATABASE, True)
    assert as_filter(asked, DATABASE, ways=False) == (DATABASE, False)


def test_a_class_of_options_stands_for_its_defaults():
    found = as_filter(KalmanFilter, DATABASE)
    assert isinstance(found, KalmanTracker)
    assert found.name == "ekf"


def test_what_a_function_makes_of_a_database_has_to_be_a_filter():
    with pytest.raises(ConfigError, match="made"):
        as_filter(made, DATABASE)


def made(_):
    return 5
