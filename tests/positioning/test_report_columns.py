"""Each column of reports stays with its report: made, thinned, renamed and joined."""

from dataclasses import replace
from math import nan

import numpy as np
import pytest
from made_fingerprints import CRS

from mapfilter.errors import InputError
from mapfilter.positioning.fingerprints.joining import joined_reports
from mapfilter.positioning.fingerprints.reports import make_reports

READINGS = [
    # Report, cell, level, error and bound.
    (2, "b", -70.0, 1.0, 0),
    (0, "c", -80.0, 2.0, -1),
    (0, "a", nan, 3.0, 0),
    (2, "b", -65.0, 4.0, 1),
    (2, "a", -90.0, 5.0, 0),
    (0, "a", -75.0, 6.0, 1),
]
"""The cell b twice in the last report, a twice in the first, once without a level."""


def made(**more):
    report, cell, level_dbm, sd_db, censored = zip(*READINGS, strict=True)
    given = {
        "places": [(1.0, 2.0), (3.0, 4.0), (5.0, 6.0)], "time_s": [10.0, 20.0, 30.0],
        "block": [4, 5, -1], "serving": ["d", "", "b"], "timing_advance": [7.0, 8.0, nan],
        "notes": ("one", "3 rows left out: odd"),
    } | more  # fmt: skip
    return make_reports(
        CRS, report, cell, level_dbm, sd_db=sd_db, censored=censored, count=3, **given
    )


def columns(reports):
    """The readings by report, and what each report has besides."""
    names = [*reports.cell_ids, ""]
    rows = []
    for k in range(len(reports)):
        own = slice(reports.first[k], reports.first[k + 1])
        readings = zip(
            [names[n] for n in reports.cell[own]], reports.level_dbm[own].tolist(),
            reports.sd_db[own].tolist(), reports.censored[own].tolist(), strict=True,
        )  # fmt: skip
        rows.append((
            tuple(readings), names[reports.serving[k]], str(reports.timing_advance[k]),
            reports.time_s[k], reports.east_m[k], reports.north_m[k], int(reports.block[k]),
        ))  # fmt: skip
    return rows


FIRST = ((("a", -75.0, 6.0, 1), ("c", -80.0, 2.0, -1)), "d", "7.0", 10.0, 1.0, 2.0, 4)
SECOND = ((), "", "8.0", 20.0, 3.0, 4.0, 5)
THIRD = ((("a", -90.0, 5.0, 0), ("b", -65.0, 4.0, 1)), "b", "nan", 30.0, 5.0, 6.0, -1)


def test_of_several_readings_of_a_cell_the_strongest_counts():
    found = made()
    assert found.cell_ids == ("a", "b", "c", "d")
    assert columns(found) == [FIRST, SECOND, THIRD]
    again = "2 readings left out: a cell twice in one report"
    assert found.notes == ("one", "3 rows left out: odd", again)
    assert (len(found), found.report.tolist()) == (3, [0, 0, 2, 2])
    assert found.places.tolist() == [[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]]
    assert repr(found) == "Reports(3, 3 with position; 4 readings of 4 transmitters)"
    assert found.cell.dtype == found.serving.dtype == found.block.dtype == np.int32
    own = [[one.tolist() for one in found.readings(k)] for k in range(3)]
    assert own == [[[0, 2], [-75.0, -80.0]], [[], []], [[0, 1], [-90.0, -65.0]]]


def test_what_is_not_given():
    found = make_reports(CRS, [0, 1], ["a", "b"], [-60.0, -70.0], count=2)
    assert columns(found)[1][:4] == ((("b", -70.0, 0.0, 0),), "", "nan", 1.0)
    assert np.isnan(found.places).all()
    assert (found.block.tolist(), found.serving.tolist()) == ([-1, -1], [-1, -1])
    assert found.notes == ()


def test_readings_of_cells_that_others_lack_are_left_out_and_counted():
    cells, level_dbm = list("abxyxa"), [-60.0, -61.0, -62.0, -63.0, -64.0, -65.0]
    given = make_reports(CRS, [0, 0, 0, 1, 1, 2], cells, level_dbm, count=3)
    found, unknown = given.named_as(("b", "a"))
    assert unknown.tolist() == [1, 2, 0]
    assert found.first.tolist() == [0, 2, 2, 3]
    assert (found.cell.tolist(), found.level_dbm.tolist()) == ([1, 0, 1], [-60.0, -61.0, -65.0])


def test_some_of_the_reports_in_any_order():
    found = made().some(np.array([2, 0]), "thinned")
    assert columns(found) == [THIRD, FIRST]
    assert found.notes[-1] == "thinned"
    assert found.first.tolist() == [0, 2, 4]
    # The second has no reading; by flags they stay in their order.
    assert columns(made().some(np.array([False, True, True]))) == [SECOND, THIRD]
    assert columns(made().some(np.array([1, 1, 2]))) == [SECOND, SECOND, THIRD]
    predicted = replace(made(), predicted=True, planned="plan").some(np.array([0]))
    assert (predicted.predicted, predicted.planned) == (True, "plan")


class Plan:
    """What a plan states of cells, by their indices."""

    def __init__(self, *cells):
        self.cells = cells

    def some(self, kept):
        return Plan(*(self.cells[k] for k in kept))


def test_reports_over_other_cells():
    found, unknown = made().named_as(["z", "c", "b"])
    assert columns(found) == [
        ((("c", -80.0, 2.0, -1),), "", *FIRST[2:]), SECOND,
        ((("b", -65.0, 4.0, 1),), "b", *THIRD[2:]),
    ]  # fmt: skip
    assert unknown.tolist() == [1, 0, 1]
    assert found.notes == made().notes
    assert not found.predicted
    known = replace(made(), predicted=True, planned=Plan("a", "b", "c", "d"))
    again, _ = known.named_as(["d", "b"])
    assert (again.predicted, again.planned.cells) == (True, ("d", "b"))


@pytest.mark.parametrize(("east_m", "north_m"), [(nan, 2.0), (1.0, nan)])
def test_reports_without_a_whole_position_are_not_placed(east_m, north_m):
    given = made(places=[(east_m, north_m), (3.0, 4.0), (5.0, 6.0)])
    found = given.placed()
    assert found.time_s.tolist() == [30.0]
    assert found.cell_ids == ("a", "b")
    assert found.notes[-1] == "2 reports left out: no position, or nothing received"
    assert repr(given).startswith(f"Reports(3, {3 if east_m == 1.0 else 2} with position;")


def test_joined_reports_have_blocks_of_their_own():
    other = make_reports(
        CRS, [1], ["z"], [-50.0], count=2, block=[0, 2], serving=["z", ""], time_s=[1.0, 2.0],
        notes=("two", "4 rows left out: odd"), sd_db=[9.0], censored=[-1],
        timing_advance=[1.0, 2.0], places=[(7.0, 8.0), (9.0, 10.0)],
    )  # fmt: skip
    found = joined_reports([made(), other, made()])
    blocks = [4, 5, -1, 6, 8, 13, 14, -1]
    assert [one[:-1] for one in columns(found)] == [
        *(one[:-1] for one in (FIRST, SECOND, THIRD)),
        ((), "z", "1.0", 1.0, 7.0, 8.0), ((("z", -50.0, 9.0, -1),), "", "2.0", 2.0, 9.0, 10.0),
        *(one[:-1] for one in (FIRST, SECOND, THIRD)),
    ]  # fmt: skip
    assert found.block.tolist() == blocks
    assert found.notes == (
        "one", "10 rows left out: odd", "4 readings left out: a cell twice in one report", "two",
    )  # fmt: skip
    assert columns(joined_reports([made()]))[0][:-1] == FIRST[:-1]
    with pytest.raises(InputError, match="at least one log"):
        joined_reports([])
    with pytest.raises(InputError, match="EPSG:32636"):
        joined_reports([made(), other, replace(other, crs="EPSG:32636")])
    plain = make_reports(CRS, [], [], [], count=0)
    assert joined_reports([plain, made()]).block.tolist() == [4, 5, -1]
