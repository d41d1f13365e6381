"""Why a plan may not have cells of a log: most of them, not one that fits by accident."""

import pytest

from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.tracks import foreign_cells as module
from mapfilter.tracks.foreign_cells import foreign_cells

IDENTITIES = ((3021, 11701), (3021, 11702), (3022, 11801))


@pytest.fixture
def plan():
    cells = (
        Cell(f"C{ci}", "S", 0.0, 0.0, 30.0, 0.0, 55.0, 1800.0, mcc=244, mnc=91, lac=lac, ci=ci)
        for lac, ci in IDENTITIES
    )
    return CellPlan("EPSG:32635", tuple(cells))


def test_one_accidental_match_does_not_hide_another_network(plan):
    others = [f"244-05-77-{ci}" for ci in range(100)]
    told = "they are of network 244-05, the database holds 244-91"
    assert foreign_cells(others, plan) == told
    assert foreign_cells([*others, "244-91-11701-3021"], plan) == told
    exchanged = [f"244-91-{ci}-{lac}" for lac, ci in IDENTITIES]
    assert foreign_cells([*exchanged, *others[:2]], plan).startswith("3 of them would be with lac")


def test_a_plan_is_not_looked_through_for_nothing(plan, monkeypatch):
    monkeypatch.setattr(module, "PlanNames", None)
    assert foreign_cells([], plan) == ""
    assert foreign_cells(["A", "B-7"], plan) == ""
