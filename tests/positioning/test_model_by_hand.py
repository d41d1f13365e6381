"""The map filter's model over the small area: what each part of a reading adds to the weights."""

from dataclasses import replace
from math import inf, log, nan

import numpy as np
import pytest
from made_radio import AREA, MODEL, at_places, gain_of, named, read, serving
from small_area import HEIGHT_M, OPTIONS, WIDTH_M

from mapfilter.filters.belief_models import Cloud
from mapfilter.filters.contract import MotionStep, Reason
from mapfilter.models.way_map import MapWeights
from mapfilter.positioning.bayes.beliefs.model import BayesModel
from mapfilter.positioning.bayes.sources.evidence import FixedTerm, RadioReading

TERM = FixedTerm(np.array([-1.5]))


def test_what_models_of_predicted_levels_have():
    assert MODEL.timed_by_sites
    assert not MODEL.serving_is_measured
    assert MODEL.usual_serving(3, nan) == -0.7
    with pytest.raises(NotImplementedError):
        MODEL.log_serving_at(np.zeros(1, np.int32), RadioReading())


def test_without_a_reading_nothing_is_added():
    gain, cloud, reason = gain_of(RadioReading())
    assert (gain.tolist(), reason, cloud.shared) == ([0.0] * 60, Reason.NO_READING, None)
    # Terms alone need no memory of levels.
    gain, cloud, reason = gain_of(RadioReading(terms=(TERM, TERM)))
    assert (gain.tolist(), reason, cloud.shared) == ([-3.0] * 60, Reason.USED, None)
    assert cloud.withheld == 0.0


def test_the_parts_of_a_report_are_added_up():
    whole = read(serving("A", -70.25), named("C", -82.0), named("D", -110.5, -1))[1]
    assert whole.levels is not None
    assert len(whole.bounds) == 1
    served = replace(whole, levels=None, bounds=())
    levels = replace(whole, serving=-1, serving_weight=0.0, bounds=())
    bounds = replace(whole, serving=-1, serving_weight=0.0, levels=None)
    parts = [gain_of(one) for one in (served, levels, bounds)]
    assert all(reason is Reason.USED for *_, reason in parts)
    assert all(np.ptp(gain) > 0.1 for gain, *_ in parts)
    total, _, _ = gain_of(replace(whole, terms=(TERM,)))
    np.testing.assert_allclose(total, sum(gain for gain, *_ in parts) - 1.5, atol=1e-4)
    # A band without a weight is looked up, and says nothing.
    silent, cloud, reason = gain_of(replace(served, serving_weight=0.0))
    assert (np.abs(silent).max(), reason) == (0.0, Reason.USED)
    assert cloud.shared is not None


def test_of_a_tracked_belief_a_part_of_the_levels_is_withheld():
    """Three tenths count; the rest is evidence, and not in the weights."""
    whole = read(serving("A", -70.25), named("C", -82.0))[1]
    served, _, _ = gain_of(replace(whole, levels=None))
    levels, _, _ = gain_of(replace(whole, serving=-1, serving_weight=0.0))
    tracked = replace(whole, tracked=True, terms=(TERM,))
    found, cloud, _ = gain_of(tracked)
    share = OPTIONS.levels.tracking_share
    assert share == 0.3
    np.testing.assert_allclose(found, served + share * levels - 1.5, atol=1e-4)
    full = served + levels - 1.5
    withheld = np.logaddexp.reduce(full) - np.logaddexp.reduce(found)
    assert cloud.withheld == pytest.approx(withheld, abs=1e-4)
    # Where errors of levels are not remembered nothing is withheld.
    plain, cloud, _ = gain_of(tracked, model=replace(MODEL, remember=False))
    np.testing.assert_allclose(plain, full, atol=1e-4)
    assert cloud.withheld == 0.0


@pytest.mark.parametrize("tracked", [False, True])
def test_beyond_the_edge_nothing_that_is_predicted_may_hold(tracked):
    """Even odds at first: the mean of what the pixel at the edge says, and of no prediction."""
    reading = read(serving("A", -70.25), named("C", -82.0))[1]
    inside, beyond = (1.0, 35.0), (-30.0, 35.0)
    gain, cloud, _ = gain_of(reading, at_places(inside, beyond))
    unknown = reading.radio_under_null(cloud.shared.other_log_likelihood)
    assert gain[1] == pytest.approx(np.logaddexp(gain[0], unknown) - log(2.0), abs=1e-4)
    if tracked:
        part, after, _ = gain_of(replace(reading, tracked=True), at_places(inside, beyond))
        levels, _, _ = gain_of(replace(reading, serving=-1, serving_weight=0.0),
                               at_places(inside))  # fmt: skip
        held = gain[0] - 0.7 * levels[0]
        assert part[0] == pytest.approx(held, abs=1e-4)
        counted = reading.radio_under_null(0.3 * cloud.shared.other_log_likelihood)
        assert part[1] == pytest.approx(np.logaddexp(held, counted) - log(2.0), abs=1e-4)
        withheld = np.logaddexp.reduce(gain) - np.logaddexp.reduce(part)
        assert after.withheld == pytest.approx(withheld, abs=1e-4)
    # By the next report it is known better which of both holds.
    again, weight = replace(reading, length_m=1e-6), np.zeros(2)
    MODEL.weigh(cloud, weight, again)
    odds = unknown - gain[0]
    expected = np.logaddexp(weight[0], odds + again.radio_under_null(0.0)) - np.logaddexp(0.0, odds)
    assert np.isfinite(expected)
    assert weight[1] != pytest.approx(weight[0], abs=1e-3)


@pytest.mark.parametrize("tracked", [False, True])
def test_a_hypothesis_without_weight_stays_without_beyond_the_edge(tracked):
    """It is none that makes the weights of all others no numbers."""
    reading = replace(read(serving("A", -70.25), named("C", -82.0))[1], tracked=tracked)
    states = at_places((1.0, 35.0), (-30.0, 35.0), (-30.0, 35.0))
    alike, weight = np.zeros(3), np.array([0.0, -inf, 0.0])
    cloud = Cloud(states, np.empty((0, 3), dtype=np.float32))
    MODEL.weigh(cloud, alike, reading)
    MODEL.weigh(cloud, weight, reading)
    assert weight.tolist() == [alike[0], -inf, alike[2]]


@pytest.mark.parametrize("length_m", [10.0, -4.0])
@pytest.mark.parametrize("per_m", [1 / 12, 0.3])
def test_each_metre_beyond_the_area_costs_as_much(length_m, per_m):
    """0.03 nats among cells; without them what hypotheses off the map lose."""
    weights = MapWeights(weight_per_m=per_m, off_cost_per_m=0.2, leave_per_m=0.0)
    streets = replace(
        AREA, cell_ids=(), level_dbm=np.zeros((7, 9, 2), dtype=np.float32), carriers={}
    )
    state = at_places((-500.0, -500.0), (WIDTH_M + 500.0, HEIGHT_M + 500.0))
    for area, cost in ((AREA, 0.03), (streets, 0.2)):
        model, before = BayesModel(area, weights=weights), np.array([-1.0, -2.0])
        motion = MotionStep(length_m, 0.3)
        moved, weighed = model.move(state, before, motion, np.uint64(7))
        np.testing.assert_allclose(weighed - before, -cost * abs(length_m), rtol=1e-5)
        assert np.hypot(*(moved - state)[:2].mean(axis=1)) == pytest.approx(abs(length_m), rel=0.5)
    # Where the map weighs nothing, hypotheses beyond it lose nothing either.
    model = BayesModel(AREA, weights=replace(weights, weight_per_m=0.0))
    _, weighed = model.move(state, np.zeros(2), MotionStep(length_m, 0.3), np.uint64(7))
    np.testing.assert_allclose(weighed, 0.0, atol=1e-6)


def test_a_step_without_a_heading_leads_to_all_sides():
    """Where the map tells nothing; else along ways (``tests/models/test_way_spread``)."""
    model = replace(MODEL, weights=MapWeights(weight_per_m=0.0))
    state = at_places(*[(45.0, 35.0)] * 20_000)
    moved, _ = model.move(state, np.zeros(20_000), MotionStep(6.0, nan), np.uint64(3))
    off_m = (moved - state)[:2]
    assert np.mean(np.sum(off_m**2, axis=0)) == pytest.approx(36.0, rel=0.03)
    assert off_m.std(axis=1) == pytest.approx([6 / 2**0.5] * 2, rel=0.03)
    spread, _ = model.move(
        state, np.zeros(20_000), MotionStep(6.0, nan, spread_m=2.0), np.uint64(3)
    )
    assert (spread - state)[:2].std(axis=1) == pytest.approx([2**0.5] * 2, rel=0.03)


def test_a_step_without_a_heading_is_no_evidence():
    """Each metre of it costs what one off the map does, on a way, beside it and beyond the area."""
    state = at_places((35.0, 45.0), (80.0, 5.0), (-500.0, 35.0))
    given = np.array([-1.0, -2.0, -3.0])
    for step in (MotionStep(6.0, nan), MotionStep(-6.0, nan, spread_m=30.0)):
        _, weighed = MODEL.move(state, given, step, np.uint64(3))
        cost = 6.0 * MODEL.weights.off_cost_per_m
        np.testing.assert_allclose(weighed, given - cost)


@pytest.mark.parametrize(("length_m", "share"), [(0.0, 1.0), (25.0, 1 - np.exp(-1.0)), (inf, 1.0)])
def test_the_weight_of_levels_that_are_not_remembered(length_m, share):
    reading = RadioReading(length_m=length_m)
    assert MODEL.level_weight(reading) == 0.6
    assert replace(MODEL, remember=False).level_weight(reading) == pytest.approx(0.6 * share)


def test_levels_that_no_prediction_has_count_by_the_weight_of_levels():
    reading = read(serving("A", -70.25), named("B", -80.0), named("X", -90.0))[1]
    light = replace(OPTIONS, levels=replace(OPTIONS.levels, weight=0.3))
    _, heavy, _ = gain_of(reading)
    _, other, _ = gain_of(reading, model=BayesModel(AREA, evidence=light))
    assert heavy.shared.other_log_likelihood < -1.0
    assert heavy.shared.other_log_likelihood == pytest.approx(
        2 * other.shared.other_log_likelihood, rel=1e-6
    )


def test_the_map_at_a_place_is_that_of_its_pixel_whatever_the_shape_of_the_area():
    """At centres, row 0 in the north; beyond the edge that of the nearest pixel."""
    rows, cols = MODEL.log_map.shape
    assert (rows, cols) == (7, 9)
    east_m, north_m = 10.0 * np.arange(cols) + 5.0, HEIGHT_M - 10.0 * np.arange(rows) - 5.0
    places = np.array(np.meshgrid(east_m, north_m), dtype=np.float32).reshape(2, -1)
    found = MODEL._log_map_at(places).reshape(rows, cols)
    np.testing.assert_allclose(found, MODEL.log_map, atol=1e-5)
    assert np.ptp(found[:, 4]) > 0.1
    beyond = np.array([[45.0, 45.0], [HEIGHT_M + 50.0, -50.0]], dtype=np.float32)
    np.testing.assert_allclose(MODEL._log_map_at(beyond), MODEL.log_map[[0, -1], 4], atol=1e-5)
    between = np.array([[45.0], [HEIGHT_M - 10.0]], dtype=np.float32)
    mean = MODEL.log_map[:2, 4].mean()
    np.testing.assert_allclose(MODEL._log_map_at(between), [mean], atol=1e-5)
