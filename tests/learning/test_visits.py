"""Visits of reports: medians, bounds, and which cell a neighbour is."""

from dataclasses import replace

import numpy as np
import pytest
from learning_world import CRS, EAST, NORTH

from mapfilter.database.field import RadioField
from mapfilter.lattice import Lattice
from mapfilter.learning.learn import unlisted_cells
from mapfilter.learning.visits import Placed, predicted_dbm, visits_of
from mapfilter.positioning.epochs import Epoch, ReportRow
from mapfilter.radio.cells import Cell, CellPlan

LATTICE = Lattice(CRS, EAST, NORTH + 400.0, 20.0, 20, 20)


def cell(name, arfcn, bsic=0):
    return Cell(name, name, EAST, NORTH, 30.0, None, 50.0, 1800.0, "omni", arfcn=arfcn, bsic=bsic)


PLAN = CellPlan(CRS, (cell("A", 1), cell("B", 2), cell("C", 3), cell("D", 3)))


def field(levels=(-70.0, -80.0, -75.0, -100.0)):
    grid = np.broadcast_to(np.array(levels, np.float32), (20, 20, 4)).copy()
    flat = np.zeros((20, 20))
    away = flat.astype(np.float32)
    return RadioField(LATTICE, PLAN.ids, grid, away, away, flat.astype(np.int64), flat == 0)


def serving(name, level):
    return ReportRow("serving", name, None, None, level, 0)


def neighbour(arfcn, level, censored=0):
    return ReportRow("neighbour", None, arfcn, 0, level, censored)


def journey(*reports, east=EAST + 50.0, radius=10.0):
    epochs = [Epoch(float(i), radio=rows) for i, rows in enumerate(reports)]
    count = len(epochs)
    return Placed(
        epochs, np.full(count, east), np.full(count, NORTH + 50.0), np.full(count, radius)
    )


def table(*journeys, of=None):
    found = visits_of(journeys, PLAN, of or field())
    rows = zip(found.journey, found.cell, found.level_dbm, found.received, strict=True)
    return {(int(j), PLAN.ids[c]): (float(level), bool(heard)) for j, c, level, heard in rows}


def test_the_level_of_a_visit_is_the_median_of_its_reports():
    reports = [(serving("A", level),) for level in (-70.0, -60.0, -90.0)]
    assert table(journey(*reports))[0, "A"] == (-70.0, True)


def test_a_cell_that_is_missing_in_most_reports_was_not_received():
    beside = (serving("A", -70.0), neighbour(3, -80.0))
    reports = [(serving("A", -70.0), neighbour(2, -85.0)), *[beside] * 3]
    assert table(journey(*reports))[0, "B"] == (-80.0, False)


def test_the_bound_is_the_weakest_of_a_full_report_else_the_weakest_of_all():
    full = (serving("A", -60.0), neighbour(2, -80.0))
    assert table(journey(full))[0, "C"] == (-80.0, False)
    fuller = (serving("A", -60.0), neighbour(1, -70.0), neighbour(3, -90.0))
    short = (serving("A", -60.0), neighbour(3, -65.0))
    at = EAST + np.array([50.0, 150.0])
    far = replace(journey(fuller, short), east_m=at)
    found = visits_of([far], PLAN, field())
    b = found.level_dbm[found.cell == PLAN.index("B")]
    assert b.tolist() == [-90.0, -90.0]
    assert not found.received[found.cell == PLAN.index("B")].any()


def test_reports_of_the_serving_cell_alone_say_nothing_of_other_cells():
    full = (serving("A", -60.0), neighbour(2, -80.0))
    alone = (serving("A", -60.0),)
    assert set(table(journey(alone), journey(full))) == {(0, "A")} | {(1, cell) for cell in "ABCD"}
    # Of a phone that lists neighbours now and then, reports without any say nothing either.
    found = table(journey(full, *[alone] * 4))
    assert found[0, "B"] == (-80.0, True)
    # One that nearly always does would have listed them.
    found = table(journey(alone, *[full] * 4, east=EAST + 50.0))
    assert found[0, "B"] == (-80.0, True)
    apart = replace(journey(*[full] * 4, alone), east_m=EAST + np.repeat([50.0, 150.0], [4, 1]))
    found = visits_of([apart], PLAN, field())
    b = found.cell == PLAN.index("B")
    assert found.received[b].tolist() == [True, False]


def test_what_a_report_can_hold_is_that_of_its_own_journey():
    small = (serving("A", -60.0), neighbour(2, -70.0))
    large = (serving("A", -60.0), neighbour(2, -80.0), neighbour(3, -100.0))
    assert table(journey(small), journey(large))[0, "C"] == (-70.0, False)


def test_reports_say_nothing_of_layers_of_which_a_phone_measures_nothing():
    """A and B are of LTE, C and D of GSM: one neighbour of these is not all that is there."""
    kinds = zip(PLAN.cells, (("LTE", 5), ("LTE", 5), ("GSM", 3), ("GSM", 3)), strict=True)
    cells = (replace(one, technology=kind, arfcn=arfcn, bsic=None) for one, (kind, arfcn) in kinds)
    plan = CellPlan(CRS, tuple(cells))

    def heard(*rows):
        found = visits_of([journey(rows)], plan, field())
        return {plan.ids[c]: bool(one) for c, one in zip(found.cell, found.received, strict=True)}

    def named(name, level):
        return ReportRow("neighbour", name, None, None, level, 0)

    alone = serving("A", -70.0), named("A", -70.0)
    assert heard(*alone) == {"A": True, "B": False}
    assert heard(*alone, named("C", -90.0)) == {"A": True, "B": False, "C": True}
    other = named("C", -90.0), named("C", -91.0)
    assert heard(*alone, *other) == {"A": True, "B": False, "C": True, "D": False}
    assert heard(serving("D", -80.0), named("A", -70.0)) == {"D": True, "C": False, "A": True}


def test_of_cells_with_one_carrier_it_is_the_one_that_is_clearly_stronger():
    report = (serving("A", -60.0), neighbour(3, -77.0))
    found = table(journey(report))
    assert found[0, "C"] == (-77.0, True)
    # The phone says nothing of the weaker one.
    assert (0, "D") not in found
    unclear = table(journey(report), of=field((-70.0, -80.0, -75.0, -79.0)))
    assert not {(0, "C"), (0, "D")} & {key for key, (_, heard) in unclear.items() if heard}


def test_a_level_below_the_scale_is_a_bound():
    report = (serving("A", -60.0), neighbour(2, -110.0, censored=-1))
    assert table(journey(report))[0, "B"][1] is False


@pytest.mark.parametrize("placed", [journey((serving("A", -60.0),), radius=200.0), journey()])
def test_reports_in_unknown_places_make_no_visit(placed):
    assert len(visits_of([placed], PLAN, field())) == 0


def test_no_journeys_make_no_visits():
    found = visits_of([], PLAN, field())
    assert len(found) == 0
    assert found.received.dtype == bool


def test_cells_without_identity_or_of_other_networks_are_passed_over():
    rows = (
        serving("A", -60.0),
        ReportRow("neighbour", None, None, None, -70.0, 0),
        neighbour(99, -70.0),
        ReportRow("neighbour", "Z", None, None, -70.0, 0),
    )
    heard = {key for key, (_, is_level) in table(journey(rows)).items() if is_level}
    assert heard == {(0, "A")}


@pytest.mark.parametrize(
    ("row", "missing"),
    [
        (neighbour(2, -85.0), "CDE"),
        (ReportRow("neighbour", None, None, None, -85.0, 0), ""),
        (ReportRow("neighbour", None, None, 0, -85.0, 0), ""),
        (ReportRow("neighbour", None, 2, None, -85.0, 0), "CD"),
        (ReportRow("neighbour", None, 2, 7, -85.0, 0), "BCD"),
        (neighbour(99, -85.0), "BCD"),
        (neighbour(99, -85.0, censored=-1), "BCDE"),
        (ReportRow("neighbour", "B", None, None, np.nan, 0), "CDE"),
        (ReportRow("neighbour", "Z", None, None, -85.0, 0), "BCDE"),
    ],
)
def test_a_cell_that_a_neighbour_may_be_is_not_missing(row, missing):
    """E has neither carrier nor code in the plan: as a neighbour it is one that no cell fits."""
    plan = CellPlan(CRS, (*PLAN.cells, replace(PLAN.cells[0], id="E", arfcn=None, bsic=None)))
    grid = np.full((20, 20, 5), -80.0, np.float32)
    wider = replace(field(), cell_ids=plan.ids, level_dbm=grid)
    report = (serving("A", -60.0), neighbour(1, -90.0), row)
    found = visits_of([journey(report)], plan, wider)
    assert "".join(plan.ids[c] for c in found.cell[~found.received]) == missing


def test_serving_cells_that_the_plan_lacks_are_listed_by_their_number():
    reports = [(serving("X", -70.0),)] * 3 + [(serving("Y", -70.0),), (serving("A", -70.0),)]
    found = unlisted_cells([journey(*reports), journey((serving("X", -60.0),))], PLAN)
    assert [(one.cell, one.journeys) for one in found] == [("X", 2), ("Y", 1)]
    assert found[0].east_m == EAST + 50.0


def test_what_the_database_does_not_hold_is_unknown():
    grid = field()
    grid.level_dbm[:, :, 1] = np.nan
    level = predicted_dbm(grid, PLAN, np.array([EAST + 50.0]), np.array([NORTH + 50.0]))
    assert np.isnan(level[0, 1])
    assert level[0, 0] == -70.0
