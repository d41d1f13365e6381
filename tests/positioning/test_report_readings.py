"""Radio reports made ready for the model: serving cells, levels, bounds and absent cells."""

from dataclasses import asdict, replace
from math import exp, isnan, nan, sqrt

import numpy as np
import pytest
from made_radio import (
    AREA,
    START,
    A,
    B,
    C,
    D,
    absent,
    carrier,
    inside,
    named,
    others,
    read,
    serving,
    unknown_cells,
)
from small_area import CARRIERS, FLOOR_DBM, OPTIONS

from mapfilter.filters.contract import MotionStep, Reason
from mapfilter.positioning.bayes.beliefs.path import DeadReckoning
from mapfilter.positioning.bayes.sources.evidence_options import EvidenceOptions
from mapfilter.positioning.bayes.sources.radio import RadioSource
from mapfilter.positioning.epochs import Epoch, ReportRow
from mapfilter.positioning.step_output import UnusedReading


def test_neighbours_become_evidence_by_what_is_known_of_them():
    unknown, elsewhere = carrier(99, 3, -70.0), named("E", -70.0)
    nameless = carrier(None, None, -70.0)
    used, reading, reason, unused = read(
        serving("A", -70.0), carrier(61, 4, -80.0), carrier(61, 2, -85.0), carrier(61, None, -90.0),
        named("B", -75.0), unknown, elsewhere, nameless, carrier(61, 4, nan),
    )  # fmt: skip
    assert reason is Reason.USED
    assert reading.serving == A
    # D is known by its carrier and code, B by its name.
    assert inside(reading) == {A: -70.0, D: -80.0, B: -75.0}
    # One code of two cells; without a code all cells of the carrier.
    assert others(reading) == [([B, C], -85.0, 0), ([B, C, D], -90.0, 0)]
    assert unused == [
        *unknown_cells(unknown, elsewhere),
        UnusedReading(0.0, "neighbour", "", Reason.NO_CELL),
    ]
    assert used is START


def test_a_serving_cell_is_none_of_its_neighbours():
    _, reading, _, unused = read(serving("B", -70.0), carrier(61, 2, -80.0), carrier(60, 1, -85))
    assert inside(reading) == {B: -70.0, C: -80.0, A: -85.0}
    assert (reading.bounds, unused) == ((), [])


def test_a_cell_reported_twice_counts_once():
    _, reading, _, _ = read(serving("B", -70.0), named("B", -60.0), named("C", -80.0))
    assert inside(reading) == {B: -70.0, C: -80.0}


@pytest.mark.parametrize("side", [-1, 1])
def test_levels_at_an_end_of_the_scale_are_bounds_on_their_side(side):
    _, reading, _, _ = read(
        serving("A", -110.5, side), named("C", -47.5, -side), carrier(61, 2, -110.5, side)
    )
    assert reading.levels is None
    assert others(reading) == [([A], -110.5, side), ([C], -47.5, -side), ([B, C], -110.5, side)]
    for bound in reading.bounds:
        assert bound.sd_db == pytest.approx(8.0)
        # What is new in a bound after the metres that the first report counts for.
        assert bound.weight == pytest.approx(0.4 * (1 - exp(-2 * 20.0 / 50.0)))


@pytest.mark.parametrize(
    ("cell", "expected"), [("E", Reason.NO_POINTS_IN_CELL), ("X", Reason.UNKNOWN_CELL)]
)
def test_neighbours_count_where_the_serving_cell_is_unknown(cell, expected):
    _, reading, reason, _ = read(serving(cell, -70.0), named("C", -80.0))
    assert reason is expected
    assert (reading.serving, inside(reading)) == (-1, {C: -80.0})
    assert isnan(reading.timing_advance)


def test_level_and_timing_advance_are_those_of_the_row_that_names_the_serving_cell():
    nameless = ReportRow("serving", None, None, None, -50.0, 0, 9.0)
    for rows in ((nameless, serving("A", -70.0, 0, 3.0)), (serving("A", -70.0, 0, 3.0), nameless)):
        _, reading, reason, unused = read(*rows)
        assert (reading.serving, inside(reading), reason) == (A, {A: -70.0}, Reason.USED)
        assert (reading.timing_advance, unused) == (3.0, [])
    # Nor where the named row tells less.
    _, reading, _, _ = read(nameless, serving("B"), named("C", -80.0))
    assert (reading.serving, inside(reading)) == (B, {C: -80.0})
    assert isnan(reading.timing_advance)
    # Nor where no row names a cell, or an unknown one.
    for rows in ((nameless,), (nameless, serving("X", -60.0, 0, 4.0))):
        _, reading, _, _ = read(*rows, named("C", -80.0))
        assert (reading.serving, inside(reading)) == (-1, {C: -80.0})
        assert isnan(reading.timing_advance)


def test_only_the_first_serving_cell_serves():
    second = serving("B", -60.0, 0, 5.0)
    _, reading, reason, unused = read(serving("A", -70.0, 0, 3.0), second)
    assert (reading.serving, inside(reading), reason) == (A, {A: -70.0}, Reason.USED)
    assert unused == unknown_cells(second, why=Reason.SECOND_SERVING_CELL)
    assert reading.timing_advance == 3.0


def test_a_serving_cell_of_another_layer_is_a_level():
    """5G beside LTE, or a second card: which of them serves best, no level tells."""
    rows = serving("A", -70.0, 0, 3.0), serving("B", -60.0, 0, 5.0), serving("C", -65.0)
    _, reading, reason, unused = read(*rows, area=replace(AREA, layers=(0, 1, 0, 1)))
    assert (reading.serving, inside(reading), reason) == (A, {A: -70.0, B: -60.0}, Reason.USED)
    assert unused == unknown_cells(rows[2], why=Reason.SECOND_SERVING_CELL)
    assert reading.timing_advance == 3.0


def test_the_first_serving_cell_with_points_serves():
    """As that of LTE after one of 5G which the plan lacks, or which is received nowhere."""
    for name, why in (("X", Reason.UNKNOWN_CELL), ("E", Reason.NO_POINTS_IN_CELL)):
        lacking, known = serving(name, -80.0), serving("B", -60.0, 0, 5.0)
        _, reading, reason, unused = read(lacking, known, named("C", -90.0))
        assert (reading.serving, inside(reading), reason) == (B, {B: -60.0, C: -90.0}, Reason.USED)
        assert unused == unknown_cells(lacking, why=why)
        assert reading.timing_advance == 5.0


def test_of_serving_cells_without_points_the_first_tells_why():
    lacking = serving("E", -80.0), serving("X", -70.0)
    _, _, reason, unused = read(*lacking)
    assert reason is Reason.NO_POINTS_IN_CELL
    assert unused == unknown_cells(lacking[1], why=Reason.SECOND_SERVING_CELL)


def test_without_levels_only_the_serving_cell_counts():
    rows = (serving("A", -70.0), named("C", -80.0), named("D", -110.5, -1))
    _, reading, _, _ = read(*rows, options=replace(OPTIONS, use_levels=False))
    assert (reading.serving, reading.levels, reading.bounds) == (A, None, ())
    # No report expects anything of itself: its levels are compared by the null hypothesis.
    assert reading.under_null == read(*rows)[1].under_null == 0.0


def test_a_report_counts_by_the_metres_since_the_last_one():
    weights = {}
    for gone_m in (6.0, 12.0, 50.0):
        used, first, _, _ = read(serving("A"))
        moved = START.moved(MotionStep(gone_m, 0.3))
        used, reading, _, _ = read(serving("A"), used=used, moved=moved)
        weights[gone_m] = reading.serving_weight
        assert reading.length_m == gone_m
        assert used is moved
    assert weights == pytest.approx({6.0: 0.24, 12.0: 0.48, 50.0: 0.8})
    assert (first.serving_weight, first.length_m) == (pytest.approx(0.8), 0.0)


def test_a_report_too_soon_leaves_the_last_one():
    used, _, _, _ = read(serving("A", -70.0))
    moved = START.moved(MotionStep(5.9, 0.0))
    after, reading, reason, _ = read(serving("A", -71.0), used=used, moved=moved)
    assert after is used
    assert reason is Reason.NOT_MOVED_ENOUGH
    assert reading is None


def test_a_report_without_anything_known_is_not_the_last_one():
    used, _, _, _ = read(serving("A", -70.0))
    moved = START.moved(MotionStep(9.0, 0.0))
    for rows in ((), (carrier(None, None, -60.0),), (ReportRow("serving", *[None] * 3, -50.0, 0),)):
        after, reading, _, _ = read(*rows, used=used, moved=moved)
        assert (after, reading) == (used, None)


def test_a_serving_cell_may_count_less_beside_levels():
    given = replace(OPTIONS, serving_with_levels=0.25)
    for options, share in ((OPTIONS, 1.0), (given, 0.25)):
        _, reading, _, _ = read(serving("A", -70.0), options=options)
        assert reading.serving_weight == pytest.approx(0.8 * share)
        _, reading, _, _ = read(serving("A"), options=options)
        assert reading.serving_weight == pytest.approx(0.8)


# Absent cells


def test_cells_are_absent_where_a_phone_reports_neighbours():
    """One neighbour may be all that a phone measures; with two the list is taken for whole."""
    for neighbours in ((), (named("B", -80.0),)):
        _, reading, _, _ = read(serving("A", -70.0), *neighbours)
        assert reading.levels.absent.size == 0
    _, reading, _, _ = read(serving("A", -70.0), named("B", -80.0), named("X", -99.0))
    assert absent(reading) == ([C, D], FLOOR_DBM)
    assert reading.levels.absent.dtype == np.int32
    # A second serving cell is no neighbour.
    _, reading, _, _ = read(serving("A", -70.0), serving("B", -80.0), named("C", -90.0))
    assert reading.levels.absent.size == 0


def test_a_full_list_leaves_out_what_is_weaker_than_its_weakest():
    rows = serving("A", -98.0), named("B", -80.0), named("X", -92.5), named("E", -85.0)
    _, reading, _, _ = read(*rows)
    # A serving cell may be weaker than its neighbours.
    assert absent(reading) == ([C, D], -98.0)
    _, reading, _, _ = read(serving("A", -70.0), *rows[1:])
    assert absent(reading) == ([C, D], -92.5)
    # A row without a level fills the list, too.
    _, reading, _, _ = read(serving("A", -70.0), *rows[1:3], named("X", nan))
    assert absent(reading) == ([C, D], -92.5)
    longer = replace(OPTIONS, full_list=4)
    _, reading, _, _ = read(*rows, options=longer)
    assert absent(reading) == ([C, D], FLOOR_DBM)


LAYERED = replace(AREA, layers=(0, 1, 0, 1))
"""A and C on one carrier, B and D on another."""


def test_cells_of_layers_that_a_phone_does_not_measure_are_not_absent():
    """With two neighbours of a layer, each is; and they are weaker than the weakest of it."""
    rows = serving("A", -70.0), named("C", -95.5), named("C", -96.0)
    _, reading, _, _ = read(*rows, area=replace(LAYERED, layers=(0, 1, 0, 0)))
    assert absent(reading) == ([D], FLOOR_DBM)
    _, reading, _, _ = read(*rows, area=LAYERED)
    assert absent(reading) == ([], set())
    # One neighbour of another layer is not all that is there.
    _, reading, _, _ = read(*rows, named("B", -80.0), area=LAYERED)
    assert absent(reading) == ([], set())
    shared = replace(LAYERED, layers=(0, 1, 0, 0), interfering=frozenset(range(4)))
    _, reading, _, _ = read(*rows, named("B", -99.0), area=shared)
    assert absent(reading) == ([D], -96.0)
    three = replace(AREA, layers=(0, 1, 1, 1), interfering=frozenset({A, B, C, D}))
    two = named("B", -80.25), named("B", -91.5)
    _, reading, _, _ = read(serving("A", -99.0), *two, area=three)
    assert absent(reading) == ([C, D], -91.5)
    both = replace(AREA, layers=(0, 1, 0, 1))
    _, reading, _, _ = read(*two, *rows[1:], area=both, options=replace(OPTIONS, full_list=6))
    assert absent(reading) == ([A, D], FLOOR_DBM)
    both = replace(both, interfering=frozenset({A, C}))
    _, reading, _, _ = read(*two, *rows[1:], area=both, options=replace(OPTIONS, full_list=6))
    bands, limit_dbm = reading.levels.absent.tolist(), reading.levels.limit_dbm.tolist()
    assert (bands, limit_dbm) == ([A, D], [-96.0, FLOOR_DBM])


def test_a_neighbour_of_an_unknown_code_is_of_the_layer_of_its_carrier():
    """A cell that no plan has tells of no layer, where there are several."""
    arfcn, layers = CARRIERS["B"][0], replace(AREA, layers=(0, 1, 1, 1))
    rows = serving("A", -70.0), carrier(arfcn, 7, -88.0), carrier(arfcn, 8, -90.0)
    _, reading, _, _ = read(*rows, area=layers)
    assert absent(reading) == ([B, C, D], FLOOR_DBM)
    both = [replace(row, cell="X") for row in rows[1:]]
    _, reading, _, _ = read(rows[0], *both, area=layers)
    assert absent(reading) == ([B, C, D], FLOOR_DBM)
    _, reading, _, _ = read(rows[0], named("X", -88.0), named("Y", -90.0), area=layers)
    assert absent(reading) == ([], set())


def test_cells_on_one_carrier_may_be_drowned_by_those_of_the_report():
    """A phone finds them by what is left beside the stronger ones, and not down to the floor."""
    rows = serving("A", -70.0), named("B", -80.0), named("X", -84.5)
    for bands, limit_dbm in (({A, B, C, D}, -84.5), ((), FLOOR_DBM)):
        _, reading, _, _ = read(*rows, area=replace(AREA, interfering=frozenset(bands)))
        assert absent(reading) == ([C, D], limit_dbm)
    # One neighbour may still be all that a phone measures.
    _, reading, _, _ = read(*rows[:2], area=replace(AREA, interfering=frozenset({A})))
    assert reading.levels.absent.size == 0


def test_cells_may_be_drowned_by_those_of_which_no_one_cell_is_known():
    """Ambiguous codes, and codes that no cell of the plan has, are received all the same."""
    both = replace(AREA, layers=(0, 1, 1, 1), interfering=frozenset({A, B, C, D}))
    arfcn = CARRIERS["B"][0]
    rows = carrier(arfcn, 7, -88.0), carrier(arfcn, 8, -90.0)
    _, reading, _, _ = read(serving("A", -70.0), *rows, area=both)
    assert absent(reading) == ([B, C, D], -90.0)


def test_no_cell_of_a_report_is_absent_however_it_is_named():
    serves = serving("A", -70.0)
    for rows, expected in (
        ((named("B", -80.0), named("C", -80.0)), [D]),
        # A bound, an ambiguous code, a carrier without a code.
        ((named("B", -80.0), named("C", -110.5, -1)), [D]),
        ((named("X", -80.0), carrier(61, 2, -80.0)), [D]),
        ((named("X", -80.0), carrier(61, None, -80.0)), []),
        # A code that no cell has says that it is none of them.
        ((named("B", -80.0), carrier(61, 9, -80.0)), [C, D]),
        # A row without a level still says that the cell was received.
        ((named("B", -80.0), named("C", nan)), [D]),
        ((named("B", -80.0), carrier(61, 4, nan)), [C]),
        ((named("X", -80.0), carrier(61, 2, nan)), [D]),
        # So does a second serving cell, as phones with two radios report it.
        ((serving("D", -75.0), named("B", -80.0), named("X", -80.0)), [C]),
        # A row that may be any cell may be any of those.
        ((named("B", -80.0), named("X", -80.0), carrier(None, None, -80.0)), []),
    ):
        _, reading, _, _ = read(serves, *rows)
        assert reading.levels.absent.tolist() == expected, rows


def test_a_neighbour_that_no_code_tells_may_be_any_cell_without_one():
    rows = serving("A", -70.0), named("B", -80.0), carrier(61, 9, -80.0)
    assert absent(read(*rows)[1]) == ([C, D], FLOOR_DBM)
    # The plan has no code of D; and of none, as a survey without a plan.
    told = {key: tuple(b for b in bands if b != D) for key, bands in AREA.carriers.items()}
    told = {key: bands for key, bands in told.items() if bands}
    assert absent(read(*rows, area=replace(AREA, carriers=told))[1]) == ([C], FLOOR_DBM)
    _, reading, _, _ = read(*rows, area=replace(AREA, carriers={}))
    assert absent(reading)[0] == []


def test_levels_and_what_they_are_compared_with():
    used, first, _, _ = read(serving("A", -70.0))
    moved = START.moved(MotionStep(10.0, 0.0))
    _, reading, _, _ = read(serving("A", -75.0), used=used, moved=moved)
    assert inside(first) == {A: -70.0}
    assert inside(reading) == {A: -75.0}
    assert (reading.levels.cell.dtype, reading.levels.level_dbm.dtype) == (np.int32, np.float32)
    # Predictions 3 m apart, of a process of 5 dB and 40 m.
    beside_db = sqrt(2 * 25.0 * (1 - exp(-3.0 / 40.0)))
    assert reading.levels.offset_db == pytest.approx(beside_db)
    assert EvidenceOptions(beside_db=0.0).offset_db(100.0) == 0.0
    assert EvidenceOptions(beside_db=6.0).offset_db(1e9) == pytest.approx(6.0 * sqrt(2))


def test_the_usual_weights_of_reports():
    usual = asdict(EvidenceOptions())
    del usual["serving"], usual["levels"]
    assert usual == {
        "spacing_m": 5.0, "first_m": 25.0, "use_levels": True, "serving_with_levels": 1.0,
        "full_list": 6, "bound_weight": 0.5, "beside_db": 6.0, "beside_m": 50.0,
    }  # fmt: skip


def test_a_report_is_due_after_its_spacing_since_the_last_one():
    source, used = RadioSource(AREA, OPTIONS), DeadReckoning(travelled_m=100.0)
    assert [source.due(used, m) for m in (100.0, 105.9, 106.0, 200.0)] == [False, False, True, True]
    assert source.due(None, 0.0)


def test_a_serving_cell_is_as_probable_as_the_model_says_under_the_null_hypothesis():
    source = RadioSource(AREA, OPTIONS, lambda band, advance: -10.0 * band - advance)
    for cell, steps, nats in (("A", 3.0, -3.0), ("C", 4.0, -24.0), ("X", 3.0, nan)):
        rows = (serving(cell, -70.0, 0, steps), named("D", -80.0))
        reading = source.read(None, START, Epoch(0.0, radio=rows), 3.0).radio
        assert reading.serving_under_null == pytest.approx(nats, nan_ok=True)
    assert read(serving("A", -70.0))[1].serving_under_null == -0.7


def test_names_of_cells_in_messages():
    assert named("B", -80.0).name == "B"
    assert carrier(61, 2, -80.0).name == "ARFCN 61, BSIC 2"
    assert carrier(61, None, -80.0).name == "ARFCN 61, BSIC unknown"
    assert carrier(None, 2, -80.0).name == ""
