"""Fingerprints of logs that name cells by carrier and BSIC alone, and of predicted levels."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from mapfilter.errors import InputError
from mapfilter.positioning.fingerprints.sources import (
    STRONGEST,
    named_neighbours,
    reports_of_database,
    reports_of_logs,
    simulated_reports,
)
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.tracks.log import make_log

CRS = "EPSG:32635"
CARRIERS = {"A": (10, 1), "B": (10, 2), "C": (20, 1), "D": (20, 1), "E": (30, None), "F": (None, 4)}
PLAN = CellPlan(
    CRS,
    tuple(
        Cell(name, name, 500_000.0, 4_000_000.0, 30.0, None, 50.0, 900.0, "omni", arfcn=arfcn,
             bsic=bsic)
        for name, (arfcn, bsic) in CARRIERS.items()
    ),
)  # fmt: skip
ROWS = [
    # Cell, ARFCN and BSIC as reported, and the cell that is meant.
    ("X", 10, 1, "X"),
    (None, 10, 1, "A"),
    (None, 10, 2, "B"),
    (None, 20, 1, None),
    (None, 20, 2, None),
    (None, 30, None, None),
    (None, 10, None, None),
    ("A", None, None, "A"),
]


def log():
    cell, arfcn, bsic, _ = zip(*ROWS, strict=True)
    radio = pd.DataFrame(
        {
            "time_s": [float(k // 4) for k in range(8)],
            "role": ["serving", *["neighbour"] * 3] * 2,
            "cell": pd.Series(cell, dtype=object),
            "arfcn": pd.array(arfcn, dtype="Int64"),
            "bsic": pd.array(bsic, dtype="Int64"),
            "level_dbm": [-60.0 - k for k in range(8)],
        }
    )
    truth = pd.DataFrame(
        {"time_s": [0.0, 1.0], "east_m": [500_010.0, 500_020.0], "north_m": 4_000_030.0}
    )
    return make_log(CRS, radio=radio, truth=truth)


def by_level(table):
    return {
        level: None if pd.isna(cell) else cell
        for level, cell in zip(table["level_dbm"], table["cell"], strict=True)
    }


def test_a_cell_without_id_is_the_only_one_of_its_carrier_and_bsic():
    """Not one of two; not one whose BSIC is not known; and ids that are given stay."""
    found = by_level(named_neighbours(log(), PLAN).radio)
    assert found == {-60.0 - k: wanted for k, (*_, wanted) in enumerate(ROWS)}


def test_names_count_in_the_reports_where_a_plan_is_given():
    own, plain = reports_of_logs([log()], PLAN), reports_of_logs([log()])
    assert set(plain.cell_ids) == {"X", "A"}
    assert set(own.cell_ids) == {"X", "A", "B"}
    assert len(own) == len(plain) == 2
    for reports, counts in ((own, [3, 1]), (plain, [1, 1])):
        assert [len(reports.readings(k)[0]) for k in range(2)] == counts
    cell, level_dbm = own.readings(0)
    named = {own.cell_ids[n]: level for n, level in zip(cell, level_dbm, strict=True)}
    assert named == {"X": -60.0, "A": -61.0, "B": -62.0}


def test_logs_are_blocks_of_their_own():
    both = reports_of_logs([log(), log()], PLAN)
    assert both.block.tolist() == [0, 0, 1, 1]


def database(**points):
    """A database of a plan's cells, on a lattice of 10 columns of 50 m."""

    def east_north(row, col):
        return 500_000.0 + 50.0 * col, 4_000_000.0 - 50.0 * row

    def cell_points(cell_id, _):
        return tuple(np.array(one) for one in points[cell_id])

    return SimpleNamespace(
        measured=lambda: None, plan=PLAN, path=Path("made"), cell_ids=tuple(points),
        lattice=SimpleNamespace(crs=CRS, cols=10, east_north=east_north), cell_points=cell_points,
    )  # fmt: skip


def test_predicted_levels_err_by_6_db_unless_stated():
    made = database(A=([0, 2], [3, 4], [-60.0, -70.0]), B=([2], [4], [-80.0]))
    found = reports_of_database(made)
    assert found.places.tolist() == [[500_150.0, 4_000_000.0], [500_200.0, 3_999_900.0]]
    assert [one.tolist() for one in (found.first, found.cell, found.level_dbm, found.sd_db)] == [
        [0, 1, 3], [0, 0, 1], [-60.0, -70.0, -80.0], [6.0] * 3,
    ]  # fmt: skip
    assert found.predicted
    assert reports_of_database(made, 3.5).sd_db.tolist() == [3.5] * 3


@pytest.mark.parametrize("points", [{}, {"A": ([], [], [])}])
def test_a_database_in_which_nothing_is_received_tells_so(points):
    with pytest.raises(InputError, match="made: expected points with levels"):
        reports_of_database(database(**points))


def test_a_phone_reports_a_serving_cell_and_six_neighbours():
    assert STRONGEST == 1 + 6


def test_drawn_reports_are_served_by_their_strongest_cell_and_have_no_timing_advance_unasked():
    """One carrier of LTE; of each place another cell is the strongest."""
    cells = tuple(replace(cell, technology="LTE", arfcn=6200) for cell in PLAN.cells[:3])
    at = [1, 2, 3], [5, 6, 7]
    levels_dbm = [-60.0, -80.0, -90.0], [-70.0, -61.0, -91.0], [-75.0, -76.0, -62.0]
    made = database(**{name: (*at, own) for name, own in zip("ABC", levels_dbm, strict=True)})
    made.plan = CellPlan(CRS, cells)
    known = reports_of_database(made)
    assert known.planned.layer.tolist() == [0, 0, 0]
    exact = replace(known, sd_db=np.zeros(9), planned=replace(known.planned, common_db=0.0))
    found = simulated_reports(exact, 3, 7, 0.0, np.random.default_rng(1))
    assert np.isnan(found.timing_advance).all()
    strongest = {known.places[k, 0]: "ABC"[k] for k in range(3)}
    for k in range(3):
        assert found.cell_ids[found.serving[k]] == strongest[found.places[k, 0]]
        own = slice(found.first[k], found.first[k + 1])
        assert found.serving[k] == found.cell[own][np.argmax(found.level_dbm[own])]
    timed = simulated_reports(exact, 3, 7, 0.0, np.random.default_rng(1), 1.0)
    assert np.isfinite(timed.timing_advance).all()
