"""What a step on a device hands to its kernels, which add known numbers here."""

from dataclasses import replace
from math import exp, nan
from types import SimpleNamespace

import numpy as np
import pytest
from made_kernels import Placed, noted_kernels
from small_area import HEIGHT_M, OPTIONS, PIXEL_M, WIDTH_M, make_area

from mapfilter.filters.belief_models import Cloud
from mapfilter.filters.contract import MotionStep, Reason
from mapfilter.models import level_memory
from mapfilter.models.level_errors import LevelReport
from mapfilter.models.way_map import MapWeights
from mapfilter.positioning.bayes.beliefs import device_step
from mapfilter.positioning.bayes.beliefs.device_step import DeviceStep
from mapfilter.positioning.bayes.beliefs.model import BayesModel
from mapfilter.positioning.bayes.sources.evidence import FixedTerm, RadioReading

AREA = make_area()
WEIGHTS = MapWeights(weight_per_m=0.1, off_cost_per_m=0.2)
MODEL = BayesModel(AREA, weights=WEIGHTS, evidence=OPTIONS)


@pytest.fixture
def calls(monkeypatch):
    return noted_kernels(monkeypatch)


def named(calls, name):
    return [given for one, given in calls if one == name]


def cloud_at(*places_m, count=None):
    state = np.zeros((8, count or len(places_m)), dtype=np.float32)
    state[:2] = np.array(places_m).T if count is None else [[45.0], [35.0]]
    return Cloud(state, np.empty((0, state.shape[1]), dtype=np.float32))


INSIDE = cloud_at((45.0, 35.0), (5.0, 5.0))


@pytest.mark.parametrize("step_m", [6.0, -6.0])
@pytest.mark.parametrize("cells", [True, False])
@pytest.mark.parametrize("per_m", [0.1, 0.0])
def test_a_step_is_moved_and_weighed_by_the_map(calls, step_m, cells, per_m):
    """Beyond the area a metre costs 0.03 nats, or among no cells what is lost off the map."""
    area = AREA if cells else replace(
        AREA, cell_ids=(), level_dbm=np.zeros((7, 9, 2), dtype=np.float32), carriers={}
    )  # fmt: skip
    model = BayesModel(area, weights=replace(WEIGHTS, weight_per_m=per_m))
    before, motion = np.array([-1.0, -2.0]), MotionStep(step_m, 0.5, sampling_sd_m=3.0, rows=4.0)
    moved, weighed = DeviceStep(model, Placed()).move(INSIDE.state, before, motion, np.uint64(9))
    ((state, *rest, key, into, sampling_sd_m, rows),) = named(calls, "move")
    assert (state is INSIDE.state, rest) == (True, [step_m, 0.5, model.motion])
    assert (key, into is moved, sampling_sd_m, rows) == (np.uint64(9), True, 3.0, 4.0)
    assert moved is not INSIDE.state
    ((given, log_map, *more, over, beyond, into),) = named(calls, "weigh_by_ways")
    assert (given is moved, into is weighed) == (True, True)
    np.testing.assert_array_equal(log_map, model.log_map)
    assert more == [PIXEL_M, (WIDTH_M, HEIGHT_M)]
    assert over == model.weights.over(6.0)
    cost = (0.03 if cells else 0.2) / 0.1
    assert beyond == pytest.approx(-cost if per_m else nan, nan_ok=True)
    assert before.tolist() == [-1.0, -2.0]
    assert weighed.tolist() == [-1.25, -2.25]


LEVELS = LevelReport(
    np.array([0, 2], dtype=np.int32), np.array([-70.0, -82.0], dtype=np.float32),
    np.array([1, 3], dtype=np.int32), np.full(2, -95.0, dtype=np.float32), 1.5,
)  # fmt: skip
BOUND = SimpleNamespace(
    cells=np.array([1, 2], np.int32), level_dbm=-84.0, censored=-1, sd_db=8.0, weight=0.4
)
TERM = FixedTerm(np.array([-0.5]))


@pytest.mark.parametrize(
    ("reading", "reported"),
    [
        (RadioReading(0, 0.0), True), (RadioReading(-1, 0.5), True), (RadioReading(), False),
        (RadioReading(levels=LEVELS), True), (RadioReading(bounds=(BOUND,)), True),
    ],
)  # fmt: skip
@pytest.mark.parametrize("terms", [(), (TERM, FixedTerm(np.array([-3.0, -4.0])))])
def test_what_is_a_report(monkeypatch, reading, reported, terms):
    """A band, a weight, levels and bounds; terms are added after it."""
    seen = []

    def noted(_, cloud, log_weight, given):
        seen.append(given)
        log_weight -= 1.0
        return cloud._replace(shared="after")

    monkeypatch.setattr(DeviceStep, "_reported", noted)
    device, weight = Placed(), np.zeros(2)
    reading = replace(reading, terms=terms)
    cloud, reason = DeviceStep(MODEL, device).weigh(INSIDE, weight, reading)
    assert seen == [reading] * reported
    assert cloud.shared == ("after" if reported else INSIDE.shared)
    assert reason is (Reason.USED if reported or terms else Reason.NO_READING)
    more = np.array([-3.5, -4.5]) if terms else np.zeros(2)
    np.testing.assert_allclose(weight, more - reported)
    assert len(device.noted) == len(terms)


def test_a_report_is_weighed_part_by_part(calls):
    reading = RadioReading(0, 0.2, LEVELS, (BOUND, BOUND))
    device, weight = Placed(), np.zeros(2)
    DeviceStep(MODEL, device).weigh(INSIDE, weight, reading)
    names = ["pixels", "weigh_by_serving", "weigh_by_levels", "weigh_by_absence"]
    assert [name for name, _ in calls] == [*names, "weigh_by_bound", "weigh_by_bound"]
    np.testing.assert_allclose(weight, -1.0 - 2.0 - 4.0 - 16.0)
    ((state, frame, pixel),) = named(calls, "pixels")
    assert (state is INSIDE.state, frame, pixel.dtype) == (True, AREA.frame, np.int32)
    ((at, predicted, serving, strongest, table, serving_weight, odds, fault, _),) = named(
        calls, "weigh_by_serving"
    )
    assert (at is pixel, serving, serving_weight) == (True, 0, 0.2)
    assert strongest == len(AREA.cell_ids)
    assert fault == -OPTIONS.serving.fault_nats
    assert odds.shape == (2,)
    np.testing.assert_array_equal(predicted.level_dbm, MODEL.prediction.level_dbm)
    ((at, predicted, bound, cells, table, _), _) = named(calls, "weigh_by_bound")
    assert (at is pixel, bound, cells is BOUND.cells) == (True, BOUND, True)
    assert any(one is table for one in device.noted)


@pytest.mark.parametrize(("serving", "weight", "count"), [(0, 0.0, 0), (-1, 0.5, 0), (3, 0.5, 1)])
def test_a_serving_cell_counts_with_a_band_and_a_weight(calls, serving, weight, count):
    cloud, _ = DeviceStep(MODEL, Placed()).weigh(INSIDE, np.zeros(2), RadioReading(serving, weight))
    assert len(named(calls, "weigh_by_serving")) == count
    assert (serving in cloud.shared.slot_of) == (serving >= 0)


@pytest.mark.parametrize(("count", "every"), [(100, 1), (511, 1), (512, 2), (800, 3)])
def test_absent_cells_are_expected_by_a_sample_of_256_or_more(monkeypatch, calls, count, every):
    asked = []

    def expected(*given):
        asked.append(given[1:])
        return given[2].with_absent([0])

    monkeypatch.setattr(device_step, "expected_absent", expected)
    step, cloud = DeviceStep(MODEL, Placed()), cloud_at(count=count)
    found, _ = step.weigh(cloud, np.zeros(count), RadioReading(levels=LEVELS))
    ((pixel, report),) = asked
    np.testing.assert_array_equal(pixel, (np.arange(count) % 63)[::every])
    assert report == LEVELS
    ((*_, terms, _, weight, _),) = named(calls, "weigh_by_absence")
    assert terms.cell.tolist() == [1]
    assert weight == MODEL.level_weight(RadioReading())
    ((kept, _, _, terms, weight, _),) = named(calls, "weigh_by_levels")
    assert (terms.cell.tolist(), terms.level_dbm.tolist()) == ([0, 2], [-70.0, -82.0])
    assert (kept is found.kept, weight) == (True, 0.6)
    assert sorted(found.shared.slot_of) == [0, 1, 2]


def test_levels_or_absent_cells_alone_and_none(monkeypatch, calls):
    monkeypatch.setattr(device_step, "expected_absent", lambda *given: given[2])
    none = np.zeros(0, dtype=np.int32)
    for report, names in (
        (LEVELS.with_absent([]), ["weigh_by_levels"]),
        (LEVELS._replace(cell=none, level_dbm=np.zeros(0, "f4")), ["weigh_by_absence"]),
        (LEVELS._replace(cell=none, level_dbm=np.zeros(0, "f4")).with_absent([]), []),
    ):
        calls.clear()
        DeviceStep(MODEL, Placed()).weigh(INSIDE, np.zeros(2), RadioReading(levels=report))
        assert [name for name, _ in calls] == ["pixels", *names]


def test_what_wrong_predictions_say_is_the_weighted_sum_of_levels_and_absent_cells(
    monkeypatch, calls
):
    monkeypatch.setattr(device_step, "expected_absent", lambda *given: given[2])
    cloud, _ = DeviceStep(MODEL, Placed()).weigh(INSIDE, np.zeros(2), RadioReading(levels=LEVELS))
    ((*_, levels, weight, _),) = named(calls, "weigh_by_levels")
    ((*_, absent, _, _, _),) = named(calls, "weigh_by_absence")
    assert weight == 0.6
    assert absent.other.tolist() == pytest.approx([np.log(0.7)] * 2)
    total = 0.6 * (float(levels.other.sum()) + 2 * np.log(0.7))
    assert cloud.shared.other_log_likelihood == pytest.approx(total)


def test_of_more_cells_than_slots_the_first_ones_count(monkeypatch, calls):
    monkeypatch.setattr(level_memory, "SLOTS", 2)
    report = LEVELS._replace(
        cell=np.array([3, 1, 0], "i4"), level_dbm=np.array([-70.0, -71.0, -72.0], "f4"),
        absent=np.zeros(0, "i4"),
    )  # fmt: skip
    cloud, _ = DeviceStep(MODEL, Placed()).weigh(INSIDE, np.zeros(2), RadioReading(levels=report))
    ((*_, terms, _, _),) = named(calls, "weigh_by_levels")
    assert (terms.cell.tolist(), terms.level_dbm.tolist()) == ([3, 1], [-70.0, -71.0])
    assert sorted(cloud.shared.slot_of) == [1, 3]


def test_errors_age_from_report_to_report(calls):
    step = DeviceStep(MODEL, Placed())
    first, _ = step.weigh(INSIDE, np.zeros(2), RadioReading(2, 0.2))
    assert not named(calls, "age")
    before = first.kept.copy()
    then, _ = step.weigh(first, np.zeros(2), RadioReading(3, 0.2, length_m=12.0))
    ((kept, decay, keep, odds),) = named(calls, "age")
    np.testing.assert_array_equal(first.kept, before)
    assert kept is not first.kept
    np.testing.assert_array_equal(decay, first.shared.after(12.0)[1])
    assert keep == exp(-12.0 / OPTIONS.levels.fault_m)
    assert odds == OPTIONS.levels.fault_log_odds
    assert sorted(then.shared.slot_of) == [2, 3]
    # Where nothing is remembered, each report begins with none.
    calls.clear()
    step = DeviceStep(replace(MODEL, remember=False), Placed())
    then, _ = step.weigh(first, np.zeros(2), RadioReading(3, 0.2, length_m=12.0))
    assert not named(calls, "age")
    assert sorted(then.shared.slot_of) == [3]
    assert then.kept.shape == (then.shared.width, 2)


@pytest.mark.usefixtures("calls")
def test_beyond_each_edge_nothing_that_is_predicted_may_hold():
    """Even odds at first: a mean of -8 by the bound, and of 0 without a prediction."""
    inside = [(0.0, 0.0), (WIDTH_M, HEIGHT_M), (45.0, 35.0)]
    beyond = [(-1.0, 35.0), (WIDTH_M + 1.0, 35.0), (45.0, -1.0), (45.0, HEIGHT_M + 1.0)]
    reading, weight = RadioReading(bounds=(BOUND,)), np.full(7, 3.0)
    cloud, _ = DeviceStep(MODEL, Placed()).weigh(cloud_at(*inside, *beyond), weight, reading)
    np.testing.assert_allclose(weight[:3], 3.0 - 8.0)
    np.testing.assert_allclose(weight[3:], 3.0 + np.log((np.exp(-8.0) + 1.0) / 2), rtol=1e-6)
    odds = cloud.shared.beyond_odds(cloud.kept)
    np.testing.assert_allclose(odds, [0.0] * 3 + [8.0] * 4, atol=1e-4)
    # Levels have a likelihood of their own there.
    weight[:] = 0.0
    reading = RadioReading(levels=LEVELS)
    cloud, _ = DeviceStep(MODEL, Placed()).weigh(cloud_at(*inside, *beyond), weight, reading)
    held, unknown = weight[0], reading.radio_under_null(cloud.shared.other_log_likelihood)
    assert unknown < -1.0
    np.testing.assert_allclose(weight[3:], np.log((np.exp(held) + np.exp(unknown)) / 2), rtol=1e-5)


def test_serving_cells_of_measured_maps_are_looked_up_by_the_processor(calls):
    measured = SimpleNamespace(
        serving_is_measured=True, log_serving_at=lambda pixel, _: -2.0 * pixel
    )
    step, weight = DeviceStep(measured, Placed()), np.zeros(3)
    step._weigh_serving(INSIDE, np.arange(3), weight, RadioReading(1, 0.5))
    assert weight.tolist() == [0.0, -2.0, -4.0]
    assert not calls


def test_resampling_takes_as_many_copies_by_their_weights(calls):
    state = np.arange(32, dtype=np.float32).reshape(8, 4)
    cloud = Cloud(state, np.array([[5.0, 6.0, 7.0, 8.0]], dtype=np.float32))
    weight, jitter = np.log([0.25, 0.5, 1e-9, 0.25]), np.full(8, 0.5, dtype=np.float32)
    copies, kept = DeviceStep(MODEL, Placed()).resample(
        cloud, weight, jitter, np.random.default_rng(1)
    )
    np.testing.assert_array_equal(copies, state[:, [0, 1, 1, 3]])
    np.testing.assert_array_equal(kept, [[5.0, 6.0, 6.0, 8.0]])
    ((given, _),) = named(calls, "copy")
    assert given is jitter


def test_hypotheses_are_placed_with_what_they_keep():
    device = Placed()
    placed = DeviceStep(MODEL, device).placed(INSIDE)
    assert placed.state is INSIDE.state
    assert [one.shape for one in device.noted] == [(8, 2), (0, 2)]
    step = DeviceStep(MODEL, device)
    _ = step._log_map
    assert set(step.__getstate__()) == {"model", "device"}
