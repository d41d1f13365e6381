"""Cells of a log get the ids of a plan: by identity, by carrier and code, by technology."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.tracks.joining.identify import name_by_plan
from mapfilter.tracks.log import make_log

CRS = "EPSG:32635"


def cell(name, **values):
    return Cell(name, name, 385_000.0, 6_672_000.0, 30.0, None, 50.0, 1800.0, "omni", **values)


PLAN = CellPlan(
    CRS,
    (
        cell("gsm", technology="GSM", mcc=244, mnc=91, lac=3021, ci=117, arfcn=100, bsic=7),
        cell("lte", technology="LTE", mcc=244, mnc=91, lac=500, ci=9751830, arfcn=100, bsic=7),
        cell("umts", technology="UMTS", lac=3021, ci=4464, arfcn=10737, bsic=101),
        cell("nr", technology="NR", mcc=244, mnc=91, ci=68_719_476_735, arfcn=640_000, bsic=800),
        cell("244-91-77-12345"),
        cell("twin1", mcc=244, mnc=91, ci=99, arfcn=5, bsic=5),
        cell("twin2", mcc=244, mnc=91, ci=99, arfcn=5, bsic=5),
        cell("alone", arfcn=6, bsic=5),
    ),
)


def named(**row):
    """Return the cell and the notes of a log of one row."""
    rows = pd.DataFrame([{"time_s": 0.0, "role": "serving", "level_dbm": -80.0, **row}])
    log = name_by_plan(make_log(CRS, radio=rows), PLAN)
    value = log.radio["cell"].iloc[0]
    return (None if pd.isna(value) else value), log.notes


@pytest.mark.parametrize(
    ("row", "expected"),
    [
        ({"mcc": 244, "mnc": 91, "lac": 3021, "ci": 117, "technology": "GSM"}, "gsm"),
        ({"cell": "244-91-3021-117"}, "gsm"),
        ({"cell": "244/91/3021/117"}, "gsm"),
        # The area is part of the identity in GSM, and none of it in LTE.
        ({"mcc": 244, "mnc": 91, "lac": 3022, "ci": 117, "technology": "GSM"}, "244-91-3022-117"),
        ({"mcc": 244, "mnc": 91, "lac": 501, "ci": 9751830, "technology": "LTE"}, "lte"),
        ({"cell": "244-91-9751830"}, "lte"),
        ({"mcc": 244, "mnc": 5, "ci": 9751830}, "244-5-9751830"),
        ({"ci": 9751830}, "lte"),
        # RNC 57, 16-bit identity 4464; only within its location area.
        ({"mcc": 244, "mnc": 91, "lac": 3021, "ci": (57 << 16) + 4464}, "umts"),
        ({"lac": 3020, "ci": (57 << 16) + 4464}, f"3020-{(57 << 16) + 4464}"),
        ({"cell": "244-91-68719476735"}, "nr"),
        ({"cell": "244-91-12345"}, "244-91-77-12345"),
        ({"ci": 99}, "99"),
        ({"arfcn": 6, "bsic": 5}, "alone"),
        ({"arfcn": 5, "bsic": 5}, None),
        ({"arfcn": 100, "bsic": 7, "technology": "LTE"}, "lte"),
        ({"arfcn": 100, "bsic": 7, "technology": "GSM"}, "gsm"),
        ({"arfcn": 100, "bsic": 7}, None),
        ({"cell": "../new"}, "../new"),
        ({"cell": "alone"}, "alone"),
    ],
)
def test_serving_cells(row, expected):
    assert named(**row)[0] == expected


@pytest.mark.parametrize(
    ("row", "expected"),
    [
        # A neighbour of one candidate is the filter's business, unless another technology has it.
        ({"arfcn": 6, "bsic": 5}, None),
        ({"arfcn": 6, "bsic": 5, "technology": "LTE"}, None),
        ({"arfcn": 100, "bsic": 7, "technology": "LTE"}, "lte"),
        ({"arfcn": 10737, "bsic": 101, "technology": "LTE"}, "LTE carrier 10737, code 101"),
        ({"arfcn": 1, "bsic": 1, "technology": "LTE"}, None),
    ],
)
def test_neighbours(row, expected):
    assert named(role="neighbour", **row)[0] == expected


def test_notes_count_what_was_named_and_what_the_plan_lacks():
    rows = pd.DataFrame(
        {
            "time_s": np.arange(5.0),
            "role": "serving",
            "cell": ["244-91-3021-117", "gsm", "244-91-9751830", "244-91-9751830", "244-91-1-2"],
        }
    )
    log = make_log(CRS, radio=rows)
    again = name_by_plan(log, PLAN)
    assert again.radio["cell"].tolist() == ["gsm", "gsm", "lte", "lte", "244-91-1-2"]
    assert again.notes[-2:] == (
        "radio: 3 rows of 2 cells named by the plan's identities",
        "radio: 1 row of 1 cell that the plan lacks (244-91-1-2)",
    )
    assert log.radio["cell"].iloc[0] == "244-91-3021-117"


def test_a_log_with_ids_stays_the_same_object():
    rows = pd.DataFrame({"time_s": [0.0, 1.0], "role": "serving", "cell": ["gsm", "lte"]})
    log = make_log(CRS, radio=rows)
    assert name_by_plan(log, PLAN) is log
    unknown = make_log(CRS, radio=rows.assign(cell=["gsm", "elsewhere"]))
    assert name_by_plan(unknown, PLAN) is unknown
    empty = make_log(CRS)
    assert name_by_plan(empty, PLAN) is empty


numbers = st.none() | st.integers(0, 300)


@settings(max_examples=25)
@given(
    rows=st.lists(
        st.fixed_dictionaries(
            {
                "cell": st.none() | st.sampled_from(["gsm", "244-91-3021-117", "x"]),
                "lac": numbers,
                "ci": numbers | st.just(117),
                "arfcn": numbers | st.just(100),
                "bsic": st.none() | st.integers(0, 8),
                "technology": st.none() | st.sampled_from(["GSM", "LTE"]),
                "role": st.sampled_from(["serving", "neighbour"]),
            }
        ),
        min_size=1,
        max_size=6,
    )
)
def test_naming_is_row_by_row_and_naming_again_changes_nothing(rows):
    table = pd.DataFrame([{"time_s": float(i), **row} for i, row in enumerate(rows)])
    for name in ("lac", "ci", "arfcn", "bsic"):
        table[name] = table[name].astype("Int64")
    log = make_log(CRS, radio=table)
    once = name_by_plan(log, PLAN)
    again = name_by_plan(once, PLAN)
    assert again.radio["cell"].equals(once.radio["cell"])
    assert once.radio.drop(columns="cell").equals(log.radio.drop(columns="cell"))
    for i in range(len(rows)):
        alone = make_log(CRS, radio=table.iloc[[i]])
        one = name_by_plan(alone, PLAN).radio["cell"].tolist()
        assert one == once.radio["cell"].iloc[[i]].tolist()


def test_lost_cells_are_named_by_how_often_they_occur():
    often = {f"244-91-1-{i}": i + 1 for i in range(20)}
    cells = [cell for cell, count in often.items() for _ in range(count)] + [
        "alone",
        "244-91-9751830",
    ]
    rows = pd.DataFrame({"time_s": np.arange(len(cells)), "role": "serving", "cell": cells})
    log = make_log(CRS, radio=rows.assign(level_dbm=-80.0))
    (note,) = [note for note in name_by_plan(log, PLAN).notes if "lacks" in note]
    named_cells = ", ".join(f"244-91-1-{i}" for i in range(19, 11, -1))
    assert note == f"radio: 210 rows of 20 cells that the plan lacks ({named_cells} and 12 more)"


def _carriers(*rows):
    """Return the carriers of the rows of one report, and the log's notes."""
    table = pd.DataFrame(
        [{"time_s": 0.5, "role": "neighbour", "level_dbm": -90.0, **r} for r in rows]
    )
    log = name_by_plan(make_log(CRS, radio=table), PLAN)
    found = dict(zip(log.radio["level_dbm"], log.radio["arfcn"], strict=True))
    return [None if pd.isna(found[r["level_dbm"]]) else found[r["level_dbm"]] for r in rows], log


LTE = {"role": "serving", "cell": "lte", "level_dbm": -80.0}
NR = {"role": "serving", "cell": "nr", "level_dbm": -81.0}
BARE = {"bsic": 9, "level_dbm": -91.0}


@pytest.mark.parametrize(
    ("rows", "carrier"),
    [
        # The plan states the serving cell's carrier, or the report does.
        ([LTE, BARE], 100),
        ([{**LTE, "cell": "1-2-3-4", "technology": "LTE", "arfcn": 0}, BARE], 0),
        ([{**LTE, "cell": "1-2-3-4", "technology": "LTE"}, BARE], None),
        ([LTE, {**BARE, "technology": "LTE"}], 100),
        ([LTE, {**BARE, "technology": "NR"}], None),
        ([LTE, NR, BARE], None),
        ([LTE, NR, {**BARE, "technology": "NR"}], 640_000),
        ([{**LTE, "arfcn": 300}, {**LTE, "level_dbm": -82.0}, BARE], None),
        # In GSM neighbours are on carriers of their own; a row with an identity needs none.
        ([{**LTE, "cell": "gsm"}, BARE], None),
        ([LTE, {**BARE, "ci": 4}], None),
        ([LTE, {**BARE, "arfcn": 7}], 7),
        ([{**LTE, "role": "neighbour"}, BARE], None),
    ],
)
def test_a_code_without_a_carrier_is_of_the_serving_cells(rows, carrier):
    carriers, log = _carriers(*rows)
    assert carriers[-1] == carrier
    assert name_by_plan(log, PLAN) is log
    taken = "radio: 1 neighbour has no carrier, taken to be on the serving cell's"
    assert (taken in log.notes) == (carrier is not None and "arfcn" not in rows[-1])


def test_carriers_are_those_of_the_same_report():
    rows = [
        {"time_s": 1.0, "role": "serving", "cell": "lte"},
        {"time_s": 1.5, "role": "neighbour", "bsic": 9},
        {"time_s": 2.0, "role": "serving", "cell": "umts"},
        {"time_s": 2.0, "role": "neighbour", "bsic": 9},
    ]
    log = name_by_plan(make_log(CRS, radio=pd.DataFrame(rows)), PLAN)
    assert log.radio["arfcn"].isna().tolist() == [True, True, True, False]
    assert log.radio["arfcn"].iloc[3] == 10737


UNCARRIED = CellPlan(
    CRS,
    tuple(
        replace(cell(name, technology=family, bsic=bsic, arfcn=arfcn), east_m=385_000.0 + away_m)
        for name, family, bsic, arfcn, away_m in [
            ("here", "LTE", 1, None, 0.0),
            ("near", "LTE", 2, None, 1_000.0),
            ("far", "LTE", 2, None, 2_100.0),
            ("one", "LTE", 3, None, -1_000.0),
            ("other", "LTE", 3, None, 1_900.0),
            ("away", "LTE", 4, None, 36_000.0),
            ("gsm", "GSM", 5, None, 100.0),
            ("stated", "LTE", 6, 700, 100.0),
            ("bare", "LTE", 6, None, 200.0),
            ("5g", "NR", 2, None, 100.0),
        ]
    ),
)


@pytest.mark.parametrize(
    ("bsic", "arfcn", "technology", "expected"),
    [
        (2, None, None, "near"),
        (2, 6300, None, "near"),
        (2, 6300, "NR", None),
        (3, 6300, None, None),
        (4, 6300, None, None),
        (5, 6300, None, None),
        (1, 6300, None, None),
        # A cell whose carrier the plan states is preferred, and left to the filter.
        (6, 700, None, None),
        (6, 701, None, "bare"),
    ],
)
def test_a_plan_without_carriers_tells_neighbours_by_code_and_distance(
    bsic, arfcn, technology, expected
):
    rows = [
        {"time_s": 0.0, "role": "serving", "cell": "here"},
        {"role": "neighbour", "bsic": bsic, "arfcn": arfcn, "technology": technology},
    ]
    table = pd.DataFrame([{"time_s": 0.0, "level_dbm": -90.0, **row} for row in rows])
    log = name_by_plan(make_log(CRS, radio=table), UNCARRIED)
    assert [None if pd.isna(one) else one for one in log.radio["cell"]] == ["here", expected]
    taken = "radio: 1 neighbour named by code alone, as the plan lacks carriers"
    assert (taken in log.notes) == (expected is not None)


def test_a_code_alone_without_a_known_serving_place():
    """Only a code that one cell of the plan has is told then."""
    rows = [
        {"time_s": 0.0, "role": "serving", "cell": "new", "technology": "LTE", "arfcn": 6300},
        {"time_s": 0.0, "role": "neighbour", "bsic": 2},
        {"time_s": 0.0, "role": "neighbour", "bsic": 4},
        {"time_s": 1.0, "role": "serving", "cell": "here"},
        {"time_s": 1.0, "role": "neighbour", "bsic": 2},
    ]
    log = name_by_plan(make_log(CRS, radio=pd.DataFrame(rows)), UNCARRIED)
    found = [None if pd.isna(one) else one for one in log.radio["cell"]]
    # The serving cell of each report counts, not that of another one.
    assert found == ["new", None, "away", "here", "near"]


@pytest.mark.parametrize(
    ("away_m", "next_m", "expected"),
    [(35_000.0, 90_000.0, "one"), (35_001.0, 90_000.0, None), (1_000.0, 2_000.0, "one"),
     (1_000.0, 1_999.0, None)],
)  # fmt: skip
def test_the_nearest_cell_of_a_code_is_clearly_nearest(away_m, next_m, expected):
    cells = (
        cell("here", technology="LTE", bsic=1),
        replace(cell("one", technology="LTE", bsic=2), north_m=6_672_000.0 + away_m),
        replace(cell("other", technology="LTE", bsic=2), north_m=6_672_000.0 - next_m),
    )
    rows = [{"role": "serving", "cell": "here"}, {"role": "neighbour", "bsic": 2}]
    table = pd.DataFrame([{"time_s": 0.0, **row} for row in rows])
    log = name_by_plan(make_log(CRS, radio=table), CellPlan(CRS, cells))
    assert (None if pd.isna(log.radio["cell"].iloc[1]) else log.radio["cell"].iloc[1]) == expected


def test_a_neighbour_with_an_id_or_an_identity_keeps_it():
    rows = [
        {"role": "serving", "cell": "here"},
        {"role": "neighbour", "cell": "unknown", "bsic": 2},
        {"role": "neighbour", "ci": 77, "bsic": 2},
    ]
    table = pd.DataFrame([{"time_s": 0.0, **row} for row in rows])
    log = name_by_plan(make_log(CRS, radio=table), UNCARRIED)
    assert log.radio["cell"].tolist() == ["here", "unknown", "77"]
    assert log.radio["arfcn"].isna().all()


def test_two_cells_of_a_code_at_one_place_are_not_told_apart():
    """Carriers of one sector often share it."""
    cells = tuple(cell(name, technology="LTE", bsic=2 - (name == "S")) for name in "SMN")
    rows = [{"role": "serving", "cell": "S"}, {"role": "neighbour", "bsic": 2}]
    table = pd.DataFrame([{"time_s": 0.0, **row} for row in rows])
    log = name_by_plan(make_log(CRS, radio=table), CellPlan(CRS, cells))
    assert pd.isna(log.radio["cell"].iloc[1])


def test_a_second_serving_row_without_a_name_hides_none_that_has_one():
    rows = [
        {"role": "serving", "cell": "here", "arfcn": 100},
        {"role": "serving", "technology": "LTE", "arfcn": 100, "level_dbm": -99.0},
        {"role": "neighbour", "bsic": 2, "arfcn": 100},
    ]
    table = pd.DataFrame([{"time_s": 0.0, "level_dbm": -80.0, **row} for row in rows])
    log = name_by_plan(make_log(CRS, radio=table), UNCARRIED)
    assert "near" in log.radio["cell"].tolist()
