"""Why a plan may not have cells of a log: most of them, not one that fits by accident."""

from dataclasses import replace

import pandas as pd
import pytest

from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.tracks.checks import foreign_cells as module
from mapfilter.tracks.checks.foreign_cells import foreign_cells, unknown_neighbours_note

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


def neighbours(*codes):
    rows = [("neighbour", None, arfcn, bsic) for arfcn, bsic in codes]
    radio = pd.DataFrame(rows, columns=["role", "cell", "arfcn", "bsic"])
    return radio.astype({"arfcn": "Int64", "bsic": "Int64"})


def with_codes(plan, arfcns, bsic=7):
    cells = (replace(c, arfcn=a, bsic=bsic) for c, a in zip(plan.cells, arfcns, strict=True))
    return CellPlan(plan.crs, tuple(cells))


def test_neighbours_on_carriers_that_the_plan_lacks(plan):
    radio = neighbours((6300, 1), (6300, 2), (24300, 1), (1300, 1), (None, 3))
    (note,) = unknown_neighbours_note(radio, with_codes(plan, (24300, 24300, 19300)))
    assert note == (
        "3 of 5 neighbours can be no cell of the plan: they are on carriers (arfcn, EARFCN) 6300, "
        "1300, and its cells on 24300, 19300 (likely: carriers of the uplink in one of them)"
    )
    (note,) = unknown_neighbours_note(radio, with_codes(plan, (70, 70, 71)))
    assert note.startswith("4 of 5 neighbours")
    assert "uplink" not in note
    assert unknown_neighbours_note(radio, with_codes(plan, (6300, 24300, 19300))) == ()


def test_a_plan_without_codes_or_with_cells_of_any_carrier(plan):
    radio = neighbours((6300, 1), (6300, 2))
    (note,) = unknown_neighbours_note(radio, plan)
    assert note == "2 neighbours can be no cell of the plan, as it states no codes (bsic)"
    assert unknown_neighbours_note(radio, with_codes(plan, (70, 70, None))) == ()
    assert unknown_neighbours_note(neighbours(), plan) == ()
    assert unknown_neighbours_note(radio.assign(cell="C1"), plan) == ()
    assert unknown_neighbours_note(radio.assign(role="serving"), plan) == ()
