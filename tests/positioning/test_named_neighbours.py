"""Cells that a log names by carrier and BSIC alone, as fingerprints."""

import pandas as pd

from mapfilter.positioning.fingerprints.sources import named_neighbours, reports_of_logs
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
