"""Evidence of radio reports and fixes, by hand and by the scalar oracle."""

from math import cos, exp, hypot, inf, isnan, nan, pi, sin, sqrt

import numpy as np
import pytest
import scalar_oracle as oracle
from small_area import BANDS, COLS, LEVEL_DBM, OPTIONS, PIXEL_M, ROWS, SOUTH_M, WEST_M, make_area

from mapfilter.filters.contract import MotionStep, Reason
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


def read(*rows, history=None, moved=START, options=OPTIONS):
    """Read a report after a history, and as many metres as were moved."""
    source = RadioSource(AREA, options)
    history = source.begin() if history is None else history
    update = source.read(history, moved, Epoch(0.0, radio=rows), SPACING_M)
    return update.state, update.radio, update.reason, update.unused


def unknown_cells(*rows, why=Reason.UNKNOWN_CELL):
    return [UnusedReading(0.0, row.role, name_of(row), why) for row in rows]


def inside(reading):
    """Band and ``r - ρ r'`` of the levels within the scale."""
    return dict(zip(reading.levels.cell.tolist(), reading.levels.offset_db.tolist(), strict=True))


def others(reading):
    return [(b.cells.tolist(), b.level_dbm, b.censored) for b in reading.bounds]


def test_neighbours_become_evidence_by_what_is_known_of_them():
    unknown, elsewhere = carrier(99, 3, -70.0), named("E", -70.0)
    nameless = carrier(None, None, -70.0)
    history, reading, reason, unused = read(
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
    assert history.level_dbm[[A, B, D]].tolist() == [-70.0, -75.0, -80.0]
    assert isnan(history.level_dbm[C])
    assert history.received_at_m.tolist() == [0.0, 0.0, -inf, 0.0]


def test_a_serving_cell_is_none_of_its_neighbours():
    _, reading, _, unused = read(serving("B", -70.0), carrier(61, 2, -80.0), carrier(60, 1, -85))
    assert inside(reading) == {B: -70.0, C: -80.0, A: -85.0}
    assert (reading.bounds, unused) == ((), [])


def test_a_cell_reported_twice_counts_once():
    _, reading, _, _ = read(serving("B", -70.0), named("B", -60.0), named("C", -80.0))
    assert inside(reading) == {B: -70.0, C: -80.0}


@pytest.mark.parametrize("side", [-1, 1])
def test_levels_at_an_end_of_the_scale_are_bounds_on_their_side(side):
    history, reading, _, _ = read(
        serving("A", -110.5, side), named("C", -47.5, -side), carrier(61, 2, -110.5, side)
    )
    assert reading.levels is None
    assert others(reading) == [([A], -110.5, side), ([C], -47.5, -side), ([B, C], -110.5, side)]
    errors = OPTIONS.levels
    for bound in reading.bounds:
        assert bound.sd_db == pytest.approx(hypot(errors.sd_db, errors.measurement_db))
        # What is new in a level after the metres that the first report counts for.
        assert bound.weight == pytest.approx(0.6 * (1 - exp(-20.0 / 40.0) ** 2))
    assert history.received_at_m.tolist() == [-inf] * 4


@pytest.mark.parametrize(
    ("cell", "expected"), [("E", Reason.NO_POINTS_IN_CELL), ("X", Reason.UNKNOWN_CELL)]
)
def test_neighbours_count_where_the_serving_cell_is_unknown(cell, expected):
    _, reading, reason, _ = read(serving(cell, -70.0), named("C", -80.0))
    assert reason is expected
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
    options = EvidenceOptions(OPTIONS.serving, OPTIONS.levels, 6.0, 20.0, use_levels=False)
    _, reading, _, _ = read(*rows, options=options)
    assert (reading.serving, reading.levels, reading.bounds) == (A, None, ())
    _, whole, _, _ = read(*rows)
    # Each level whose error is new is expected to cost half a weight.
    assert whole.expected - reading.expected == pytest.approx(-0.5 * 0.6 * 2)


def test_a_report_counts_by_the_metres_since_the_last_one():
    weights = {}
    for gone_m in (6.0, 12.0, 50.0):
        history, first, _, _ = read(serving("A"))
        moved = START.moved(MotionStep(gone_m, 0.3))
        history, reading, _, _ = read(serving("A"), history=history, moved=moved)
        weights[gone_m] = reading.serving_weight
        assert reading.length_m == gone_m
        assert history.used is moved
    assert weights == pytest.approx({6.0: 0.24, 12.0: 0.48, 50.0: 0.8})
    assert (first.serving_weight, first.length_m) == (pytest.approx(0.8), 0.0)


def test_a_report_too_soon_leaves_the_history():
    history, _, _, _ = read(serving("A", -70.0))
    moved = START.moved(MotionStep(5.9, 0.0))
    after, reading, reason, _ = read(serving("A", -71.0), history=history, moved=moved)
    assert after is history
    assert reason is Reason.NOT_MOVED_ENOUGH
    assert reading is None


def three_reports():
    """Displacement, reading, and the report by hand, of three reports along a bent way.

    Bounds lie within the eight deviations that their table holds.
    """
    history, moved, found = None, START, []
    ways = [(), (MotionStep(9.0, 0.2), MotionStep(7.0, 1.9)), (MotionStep(8.0, -2.8),)]
    rows = [
        (serving("A", -70.25), carrier(61, 4, -80.5), carrier(61, 2, -85.0),
         named("C", -110.5, -1)),
        (serving("B", -72.0), carrier(60, 1, -77.75), named("C", -57.0, 1),
         carrier(61, None, -90.0)),
        (serving("B", -68.5), carrier(60, 1, -79.0), carrier(61, 4, -88.25), named("C", -99.0)),
    ]  # fmt: skip
    by_hand = [
        {"serving": A, "levels": [(A, -70.25, None, inf), (D, -80.5, None, inf)],
         "bounds": [((B, C), -85.0, 0), ((C,), -110.5, -1)]},
        {"serving": B, "levels": [(B, -72.0, None, inf), (A, -77.75, -70.25, 16.0)],
         "bounds": [((C,), -57.0, 1), ((C, D), -90.0, 0)]},
        {"serving": B, "levels": [(B, -68.5, -72.0, 8.0), (A, -79.0, -77.75, 8.0),
                                  (D, -88.25, None, 24.0), (C, -99.0, None, inf)],
         "bounds": []},
    ]  # fmt: skip
    for way, report in zip(ways, rows, strict=True):
        for step in way:
            moved = moved.moved(step)
        back_m = [sum(s.step_m * f(s.heading_rad) for s in way) for f in (cos, sin)]
        history, reading, _, _ = read(*report, history=history, moved=moved)
        found.append((back_m, reading))
    return [(*one, report) for one, report in zip(found, by_hand, strict=True)]


def hypotheses(count=500):
    """Places within the area, a little inside their pixels."""
    rng = np.random.default_rng(21)
    state = np.zeros((5, count), dtype=np.float32)
    state[0], state[1] = (
        rng.uniform(0, COLS * PIXEL_M, count),
        rng.uniform(0, ROWS * PIXEL_M, count),
    )
    state[2], state[3] = rng.uniform(-pi, pi, count), rng.normal(0, 0.2, count)
    return state


@pytest.mark.parametrize("index", [0, 1, 2])
def test_a_whole_report_has_the_likelihood_of_the_oracle(index):
    back_m, reading, report = three_reports()[index]
    counted_m = (20.0, 16.0, 8.0)[index]
    state = hypotheses()
    log_weight = np.zeros(state.shape[1])
    assert BayesModel(AREA, evidence=OPTIONS).weigh(state, log_weight, reading) is Reason.USED
    compared = 0
    for one, found in zip(state.T, log_weight, strict=True):
        east, north, bias, scale = (float(x) for x in one[:4])
        before = oracle.came_from(east, north, bias, scale, *back_m)
        within = np.array([east, north, *before]) / PIXEL_M
        if np.abs(within - np.round(within)).min() < 1e-4:
            continue
        now, then = (
            oracle.pixel_of(*place, PIXEL_M, ROWS, COLS) for place in ((east, north), before)
        )
        expected = oracle.report_log_likelihood(
            LEVEL_DBM, now, then, report, OPTIONS, counted_m, SPACING_M
        )
        # An ambiguous level counts as four deviations at most: exp(-8) beside the others.
        assert found == pytest.approx(expected, rel=2e-4, abs=4e-4)
        compared += 1
    assert compared > 490


def test_the_innovation_of_a_slow_error_is_small_and_sharp():
    """The closer the last report, the less a lasting error counts, and the rest by its variance."""
    history, _, _, _ = read(serving("A", -70.0))
    moved = START.moved(MotionStep(10.0, 0.0))
    _, reading, _, _ = read(serving("A", -75.0), history=history, moved=moved)
    rho, errors = exp(-10.0 / 40.0), OPTIONS.levels
    assert reading.levels.rho.tolist() == pytest.approx([rho])
    assert inside(reading)[A] == pytest.approx(-75.0 + 70.0 * rho)
    deviation = sqrt(oracle.innovation_variance(errors, rho, SPACING_M))
    assert reading.levels.scale.tolist() == pytest.approx([1 / deviation])
    assert (reading.levels.back_east_m, reading.levels.back_north_m) == (10.0, 0.0)


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
    assert BayesModel(AREA).weigh(state, log_weight, reading) is Reason.USED
    for east, north in state[:2].T.astype(float):
        off = np.array([east - 40.0, north - 30.0])
        expected.append(-0.5 * min(off @ np.linalg.solve(np.array(covariance), off), 25.0))
    np.testing.assert_allclose(log_weight, expected, rtol=1e-4, atol=1e-5)
