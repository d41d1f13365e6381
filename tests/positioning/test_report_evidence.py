"""Evidence of radio reports and fixes, by hand and by the scalar oracle."""

from dataclasses import replace
from math import exp, isnan, nan, sqrt

import numpy as np
import pytest
import scalar_oracle as oracle
from small_area import (
    BANDS,
    COLS,
    FLOOR_DBM,
    LEVEL_DBM,
    OPTIONS,
    PIXEL_M,
    ROWS,
    SITE,
    SOUTH_M,
    WEST_M,
    make_area,
)

from mapfilter.filters.contract import MotionStep, Reason
from mapfilter.filters.particle import Cloud
from mapfilter.models.street_motion import STATES
from mapfilter.positioning.bayes.evidence import RadioReading
from mapfilter.positioning.bayes.model import BayesModel
from mapfilter.positioning.bayes.radio import EvidenceOptions, RadioSource, name_of
from mapfilter.positioning.bayes.state import DeadReckoning
from mapfilter.positioning.epochs import Epoch, GnssFix, ReportRow
from mapfilter.positioning.estimate import UnusedReading
from mapfilter.positioning.gnss.source import FirstFix

AREA = make_area()
A, B, C, D = BANDS.values()
SPACING_M = 3.0


def serving(cell, level_dbm=nan, censored=0, timing_advance=nan):
    return ReportRow("serving", cell, None, None, level_dbm, censored, timing_advance)


def named(cell, level_dbm, censored=0):
    return ReportRow("neighbour", cell, None, None, level_dbm, censored)


def carrier(arfcn, bsic, level_dbm, censored=0):
    return ReportRow("neighbour", None, arfcn, bsic, level_dbm, censored)


START = DeadReckoning()


def read(*rows, used=None, moved=START, options=OPTIONS):
    """Read a report after the last one that was used, and as many metres as were moved."""
    source = RadioSource(AREA, options)
    update = source.read(used, moved, Epoch(0.0, radio=rows), SPACING_M)
    return update.state, update.radio, update.reason, update.unused


def unknown_cells(*rows, why=Reason.UNKNOWN_CELL):
    return [UnusedReading(0.0, row.role, name_of(row), why) for row in rows]


def inside(reading):
    """Band and level of the levels within the scale."""
    return dict(zip(reading.levels.cell.tolist(), reading.levels.level_dbm.tolist(), strict=True))


def absent(reading):
    """Bands of absent cells, and what they are weaker than."""
    return reading.levels.absent.tolist(), reading.levels.limit_dbm


def others(reading):
    return [(b.cells.tolist(), b.level_dbm, b.censored) for b in reading.bounds]


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


@pytest.mark.parametrize("cell", ["E", "X"])
def test_a_serving_cell_that_the_map_lacks_weighs_all_hypotheses_alike(cell):
    """It starts no belief, but tells a belief that its map may be another network's."""
    assert read(serving(cell, -60.0))[1] is None
    used, _, _, _ = read(serving("A", -70.0))
    moved = START.moved(MotionStep(9.0, 0.0))
    after, reading, _, _ = read(serving(cell, -60.0), used=used, moved=moved)
    assert after is moved
    assert (reading.serving, reading.levels, reading.bounds) == (-1, None, ())
    assert reading.serving_weight == pytest.approx(9.0 * 0.04)
    log_weight, cloud = np.full(50, -2.0), Cloud(hypotheses(50), np.empty((0, 50), "f4"))
    weighed, why = BayesModel(AREA, evidence=OPTIONS).weigh(cloud, log_weight, reading)
    assert why is Reason.USED
    np.testing.assert_array_equal(weighed.state, cloud.state)
    np.testing.assert_array_equal(log_weight, -2.0)
    # Beside levels of known cells it counts, too; without any serving cell nothing does.
    _, reading, _, _ = read(serving(cell, -60.0), named("C", -80.0), used=used, moved=moved)
    assert (reading.serving, inside(reading)) == (-1, {C: -80.0})
    assert reading.serving_weight == pytest.approx(9.0 * 0.04)
    _, reading, _, _ = read(named("C", -80.0), used=used, moved=moved)
    assert (reading.serving, reading.serving_weight) == (-1, 0.0)


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


# Whole reports


def four_reports():
    """Distances between reports, their rows, and the reports by hand.

    A cell is absent from the last one only, as what it tells of errors is not Gaussian. Bounds
    lie within the eight deviations that their table holds.
    """
    ways = [(), (MotionStep(9.0, 0.2), MotionStep(7.0, 1.9)), (MotionStep(8.0, -2.8),),
            (MotionStep(31.0, 0.4),)]  # fmt: skip
    rows = [
        (serving("A", -70.25), carrier(61, 4, -80.5), carrier(61, 2, -85.0),
         named("C", -110.5, -1)),
        (serving("B", -72.0), carrier(60, 1, -77.75), named("C", -57.0, 1),
         carrier(61, None, -90.0)),
        (serving("B", -68.5), carrier(60, 1, -79.0), carrier(61, 4, -88.25),
         carrier(61, None, nan)),
        (serving("A", -71.5), named("B", -76.0), named("X", -79.5), named("C", -83.75)),
    ]  # fmt: skip
    by_hand = [
        {"serving": A, "levels": [(A, -70.25), (D, -80.5)], "absent": [],
         "bounds": [((B, C), -85.0, 0), ((C,), -110.5, -1)]},
        {"serving": B, "levels": [(B, -72.0), (A, -77.75)], "absent": [],
         "bounds": [((C,), -57.0, 1), ((C, D), -90.0, 0)]},
        {"serving": B, "levels": [(B, -68.5), (A, -79.0), (D, -88.25)], "absent": [],
         "bounds": []},
        {"serving": A, "levels": [(A, -71.5), (B, -76.0), (C, -83.75)], "absent": [D],
         "limit": -83.75, "bounds": []},
    ]  # fmt: skip
    used, moved, found = None, START, []
    for way, report in zip(ways, rows, strict=True):
        for step in way:
            moved = moved.moved(step)
        used, reading, _, _ = read(*report, used=used, moved=moved)
        found.append((moved.travelled_m, reading))
    return [(*one, report) for one, report in zip(found, by_hand, strict=True)]


def hypotheses(count=500, seed=21):
    """Places within the area, a little inside their pixels."""
    rng = np.random.default_rng(seed)
    state = np.zeros((STATES, count), dtype=np.float32)
    col, row = rng.integers(COLS, size=count), rng.integers(ROWS, size=count)
    state[0] = PIXEL_M * (col + rng.uniform(0.01, 0.99, count))
    state[1] = PIXEL_M * (row + rng.uniform(0.01, 0.99, count))
    return state


def places(state):
    return [oracle.pixel_of(float(x), float(y), PIXEL_M, ROWS, COLS) for x, y in state[:2].T]


def test_whole_reports_have_the_likelihood_of_the_oracle():
    """Each hypothesis keeps the errors of its own path, wherever that leads."""
    model, cloud, paths = BayesModel(AREA, evidence=OPTIONS), None, [[] for _ in range(200)]
    reports = []
    for index, (at_m, reading, report) in enumerate(four_reports()):
        state = hypotheses(200, seed=21 + index)
        before = Cloud(state, np.empty((0, 200), "f4")) if cloud is None else cloud
        log_weight = np.full(200, -3.0)
        cloud, reason = model.weigh(before._replace(state=state), log_weight, reading)
        assert reason is Reason.USED
        reports.append(report)
        counted_m = (20.0, 16.0, 8.0, 20.0)[index]
        for found, path, place in zip(log_weight + 3.0, paths, places(state), strict=True):
            path.append((place, at_m))
            expected = oracle.report_log_likelihood(
                LEVEL_DBM, SITE, path, reports, OPTIONS, (counted_m, SPACING_M)
            )
            # An ambiguous level counts as four deviations at most: exp(-8) beside the others; the
            # table of absences has steps of 1/32 of a deviation.
            rounding = 0.08 if report["absent"] else 4e-4
            assert found == pytest.approx(expected, rel=5e-4, abs=rounding)
    assert np.ptp(log_weight) > 10


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


def test_what_is_not_remembered_counts_by_what_is_new_in_it():
    """As on the grid: each report is a first one, whose weight grows with the metres."""
    model = BayesModel(AREA, evidence=OPTIONS, remember=False)
    levels = replace(OPTIONS, serving=replace(OPTIONS.serving, weight_per_m=0.0))
    used, first, _, _ = read(serving("A", -70.0), named("C", -82.0), options=levels)
    state, nothing = hypotheses(), np.empty((0, 500), "f4")
    log_weight = np.zeros(500)
    cloud, _ = model.weigh(Cloud(state, nothing), log_weight, first)
    for gone_m in (6.0, 40.0, 500.0):
        moved = START.moved(MotionStep(gone_m, 0.0))
        rows = serving("A", -70.0), named("C", -82.0)
        _, reading, _, _ = read(*rows, used=used, moved=moved, options=levels)
        again = np.zeros(500)
        model.weigh(cloud, again, reading)
        share = 1 - exp(-2 * gone_m / 50.0)
        np.testing.assert_allclose(again, share * log_weight, rtol=1e-5, atol=1e-6)


def test_where_the_prediction_is_rough_levels_count_less():
    """Half of the variance of the predictions about a pixel is added to that of its levels."""
    rough = replace(OPTIONS, levels=replace(OPTIONS.levels, roughness=0.5))
    _, reading, _, _ = read(serving("A", -70.0), options=rough)
    reading = replace(reading, serving=-1)
    state, log_weight = hypotheses(300), np.zeros(300)
    BayesModel(AREA, evidence=rough).weigh(Cloud(state, np.empty((0, 300), "f4")), log_weight,
                                           reading)  # fmt: skip
    errors = rough.levels
    variance = errors.slow_db**2 + errors.fast_db**2 + errors.white_db**2 + errors.device_db**2
    variance += reading.levels.offset_db**2
    # Two pixels of 10 m to each side; beyond the edge those inside, mirrored.
    padded = np.pad(LEVEL_DBM[..., A], 2, "symmetric")
    for found, (row, col) in zip(log_weight, places(state), strict=True):
        here = variance + 0.5 * round(padded[row : row + 5, col : col + 5].std(), 1) ** 2
        off = -70.0 - LEVEL_DBM[row, col, A]
        expected = 0.6 * -0.5 * (off**2 / here + np.log(here))
        assert found == pytest.approx(expected, rel=2e-3, abs=2e-3)


@pytest.mark.parametrize(
    ("fix", "covariance"),
    [
        (GnssFix(WEST_M + 40.0, SOUTH_M + 30.0, 90.0, 40.0, 35.0), [[90.0, 35.0], [35.0, 40.0]]),
        (GnssFix(WEST_M + 40.0, SOUTH_M + 30.0), [[100.0, 0.0], [0.0, 100.0]]),
    ],
)
def test_a_fix_is_a_clipped_gaussian_about_its_place(fix, covariance):
    state, expected = hypotheses(50), []
    log_weight = np.zeros(50)
    update = FirstFix(AREA.origin_m).first(Epoch(0.0, fix=fix))
    reading = RadioReading(terms=update.terms)
    _, reason = BayesModel(AREA).weigh(Cloud(state, np.empty((0, 50), "f4")), log_weight, reading)
    assert reason is Reason.USED
    for east, north in state[:2].T.astype(float):
        off = np.array([east - 40.0, north - 30.0])
        expected.append(-0.5 * min(off @ np.linalg.solve(np.array(covariance), off), 25.0))
    np.testing.assert_allclose(log_weight, expected, rtol=1e-4, atol=1e-5)
