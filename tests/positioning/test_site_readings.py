"""Levels and timing advances of a report that Kalman-type filters use, and why not the others."""

from itertools import permutations
from math import nan

import pytest

from mapfilter.filters.contract import Reason
from mapfilter.positioning.epochs import Epoch, ReportRow
from mapfilter.positioning.kalman.models import KalmanOptions, SiteModels
from mapfilter.positioning.kalman.readings import site_readings
from mapfilter.radio.cells import Cell, CellPlan

FAR_M = KalmanOptions().reach_m + 1.0


def cell(name, arfcn, bsic, east_m=0.0):
    return Cell(
        name, "S", 500_000.0 + east_m, 4_000_000.0, 30.0, None, 50.0, 1800.0, antenna="omni",
        arfcn=arfcn, bsic=bsic,
    )  # fmt: skip


SITES = SiteModels(
    CellPlan(
        "EPSG:32629",
        (cell("A", 10, 1), cell("B", 11, 1), cell("C", 11, 2), cell("D", 11, 2, 500.0),
         cell("E", 12, 1), cell("F", 12, 1, FAR_M), cell("G", 13, 1, FAR_M)),
    ),
    KalmanOptions(),
)  # fmt: skip


def row(role, name, level_dbm=-70.0, arfcn=None, bsic=None, censored=0, steps=nan):
    return ReportRow(role, name, arfcn, bsic, level_dbm, censored, steps)


def read(*rows):
    return site_readings(SITES, Epoch(3.0, radio=rows))


def reasons(found):
    assert all(one.time_s == 3.0 for one in found.unused)
    return [(one.kind, one.what, one.reason) for one in found.unused]


@pytest.mark.parametrize("order", list(permutations(range(4))))
def test_levels_are_those_of_known_cells_whatever_their_order(order):
    """A filter begins at the first cell: 30 m aside where that was any of them."""
    given = (
        row("serving", "A", -71.0), row("neighbour", "B", -62.0, steps=3.0),
        row("neighbour", "C", -80.0, steps=5.0), row("neighbour", "D", nan, steps=4.0),
    )  # fmt: skip
    found = read(*(given[at] for at in order))
    assert (found.cells, found.levels_dbm) == (("A", "B", "C"), (-71.0, -62.0, -80.0))
    assert (found.timed, found.steps, found.unused) == (("B", "C", "D"), (3, 5, 4), ())


def test_of_several_serving_cells_the_first_comes_first():
    assert read(row("serving", "B", -80.0), row("serving", "A", -71.0)).cells == ("B", "A")


def test_an_unknown_cell_is_named():
    found = read(row("serving", "X"), row("neighbour", "Y"))
    assert found.cells == ()
    assert reasons(found) == [
        ("serving", "X", Reason.UNKNOWN_CELL), ("neighbour", "Y", Reason.UNKNOWN_CELL),
    ]  # fmt: skip


@pytest.mark.parametrize("given", [{"level_dbm": nan}, {"censored": -1}, {"censored": 1}])
def test_missing_levels_and_bounds_are_not_used(given):
    assert reasons(read(row("serving", "A", **given))) == [
        ("serving", "A", Reason.NOT_USED_BY_FILTER)
    ]
    # But a timing advance without a level is.
    timed = read(row("serving", "A", steps=3.0, **given))
    assert (timed.cells, timed.timed, timed.steps, timed.unused) == ((), ("A",), (3,), ())


def test_timing_advances_of_known_cells():
    found = read(row("serving", "A", steps=2.0), row("neighbour", "X", steps=5.0))
    assert (found.timed, found.steps) == (("A",), (2,))
    assert reasons(found) == [("neighbour", "X", Reason.UNKNOWN_CELL)]


@pytest.mark.parametrize(
    ("arfcn", "bsic", "name", "reason"),
    [
        (11, 1, "B", None),
        (11, 2, None, Reason.AMBIGUOUS_CELL),
        (11, None, None, Reason.AMBIGUOUS_CELL),
        # Of two the one within reach of the serving cell, and none beyond it.
        (12, 1, "E", None),
        (13, 1, None, Reason.UNKNOWN_CELL),
        # The serving cell is no neighbour of itself.
        (10, 1, None, Reason.UNKNOWN_CELL),
        (99, 1, None, Reason.UNKNOWN_CELL),
    ],
)
def test_neighbours_are_named_by_carrier_and_bsic(arfcn, bsic, name, reason):
    found = read(row("serving", "A", -71.0), row("neighbour", None, -85.0, arfcn, bsic))
    if name is not None:
        assert (found.cells, found.levels_dbm) == (("A", name), (-71.0, -85.0))
        assert found.unused == ()
        return
    assert found.cells == ("A",)
    what = f"ARFCN {arfcn}, BSIC {'unknown' if bsic is None else bsic}"
    assert reasons(found) == [("neighbour", what, reason)]


def test_without_a_serving_cell_all_of_a_carrier_may_be_meant():
    found = read(row("neighbour", None, -85.0, 12, 1), row("serving", None, -70.0))
    assert reasons(found) == [
        ("serving", "", Reason.NO_CELL), ("neighbour", "ARFCN 12, BSIC 1", Reason.AMBIGUOUS_CELL),
    ]  # fmt: skip
    assert read(row("neighbour", None, -85.0, 13, 1)).cells == ("G",)


def test_the_serving_cell_is_not_the_first_one_that_is_named():
    """Near the serving cell there is E; near the neighbour that stands before it F's namesake."""
    found = read(row("neighbour", "F"), row("serving", "A"), row("neighbour", None, -80.0, 12, 1))
    assert found.cells == ("A", "F", "E")


def test_a_cell_that_is_reported_twice_counts_once():
    """By its name, or by its carrier and code."""
    found = read(row("serving", "A", -71.0, steps=2.0), row("neighbour", "B", -80.0),
                 row("neighbour", "A", -75.0, steps=3.0),
                 row("neighbour", None, -83.0, 11, 1))  # fmt: skip
    assert (found.cells, found.levels_dbm) == (("A", "B"), (-71.0, -80.0))
    assert (found.timed, found.steps) == (("A",), (2,))
    assert reasons(found) == [
        ("neighbour", "A", Reason.SECOND_READING),
        ("neighbour", "ARFCN 11, BSIC 1", Reason.SECOND_READING),
    ]
