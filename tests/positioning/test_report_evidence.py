"""Evidence of radio reports and fixes, by hand and by the scalar oracle."""

from dataclasses import replace
from math import exp, nan

import numpy as np
import pytest
import scalar_oracle as oracle
from made_radio import (
    AREA,
    SPACING_M,
    START,
    A,
    B,
    C,
    D,
    carrier,
    hypotheses,
    inside,
    named,
    read,
    serving,
)
from small_area import (
    COLS,
    LEVEL_DBM,
    OPTIONS,
    PIXEL_M,
    ROWS,
    SITE,
    SOUTH_M,
    WEST_M,
)

from mapfilter.filters.belief_models import Cloud
from mapfilter.filters.contract import MotionStep, Reason
from mapfilter.positioning.bayes.beliefs.model import BayesModel
from mapfilter.positioning.bayes.sources.evidence import RadioReading
from mapfilter.positioning.epochs import Epoch, GnssFix
from mapfilter.positioning.gnss.source import FirstFix


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
    update = FirstFix(AREA.origin_m).first(Epoch(0.0, gnss=fix))
    reading = RadioReading(terms=update.terms)
    _, reason = BayesModel(AREA).weigh(Cloud(state, np.empty((0, 50), "f4")), log_weight, reading)
    assert reason is Reason.USED
    for east, north in state[:2].T.astype(float):
        off = np.array([east - 40.0, north - 30.0])
        expected.append(-0.5 * min(off @ np.linalg.solve(np.array(covariance), off), 25.0))
    np.testing.assert_allclose(log_weight, expected, rtol=1e-4, atol=1e-5)
