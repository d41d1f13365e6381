"""Measured maps in the map filter's model: deviations of levels, and serving cells by place."""

from dataclasses import dataclass, field, replace
from math import log, nan

import numpy as np
import pytest
from small_area import ON_WAY, OPTIONS, make_area

from mapfilter.filters.belief_models import Cloud
from mapfilter.filters.contract import Reason
from mapfilter.models.street_motion import EAST, NORTH, STATES
from mapfilter.positioning.bayes.sources.evidence import RadioReading
from mapfilter.positioning.bayes.sources.measured_model import MeasuredMapModel

AREA = make_area()


@dataclass
class Statistics:
    """Served the less the farther back a pixel comes; each step of timing costs 2 nats."""

    asked: list = field(default_factory=list)

    def log_serving(self, serving, pixel):
        self.asked.append(pixel.tolist())
        return -(serving + 1) * pixel / 10.0

    def log_advance(self, _, pixel, steps):
        return np.full(pixel.size, -2.0 * steps)


def model(**more):
    return MeasuredMapModel(AREA, evidence=OPTIONS, **more)


def test_what_a_measured_map_adds_to_the_deviation_of_levels():
    """8 dB are in the options: 10 dB are 6 more, less are none, and 25.5 dB are the most."""
    sd_db = np.full((4, 7, 9), 8.0, dtype=np.float32)
    sd_db[0, 2, 3], sd_db[1, 6, 8], sd_db[3, 0, 0] = 10.0, 5.0, 60.0
    found = model(level_sd_db=sd_db).rough_db()
    assert found.dtype == np.uint8
    expected = np.zeros((7, 9, 6))
    expected[2, 3, 0], expected[0, 0, 3] = 60, 255
    np.testing.assert_array_equal(found.reshape(7, 9, 6), expected)
    plain = model()
    np.testing.assert_array_equal(plain.rough_db(), AREA.flat_rough_db)


def test_the_strongest_levels_of_a_place_have_no_deviation_of_their_own():
    """Though the options have less than 1 dB."""
    small = replace(OPTIONS.levels, slow_db=0.1, fast_db=0.1, white_db=0.5)
    sd_db = np.ones((4, 7, 9), dtype=np.float32)
    found = MeasuredMapModel(AREA, evidence=replace(OPTIONS, levels=small), level_sd_db=sd_db)
    rough_db = found.rough_db().reshape(7, 9, 6)
    np.testing.assert_array_equal(rough_db[..., :4], round(10 * (1 - 0.27) ** 0.5))
    assert not rough_db[..., 4:].any()


def test_statistics_of_serving_cells_are_all_that_weighs_them():
    state = np.zeros((STATES, 3), dtype=np.float32)
    state[EAST], state[NORTH] = [5.0, 35.0, 62.0], [66.0, 41.0, 12.0]
    statistics, weight = Statistics(), np.full(3, 7.0)
    reading = RadioReading(1, 0.5, timing_advance=3.0)
    cloud = Cloud(state, np.empty((0, 3), np.float32))
    _, reason = model(serving_model=statistics).weigh(cloud, weight, reading)
    assert reason is Reason.USED
    ((first, second, third),) = statistics.asked
    assert first < second < third
    np.testing.assert_allclose(weight, [4.0 - first / 10, 4.0 - second / 10, 4.0 - third / 10])


def test_serving_cells_are_compared_by_their_statistics():
    pixel = np.array([0, 10, 30], dtype=np.int32)
    found = model(serving_model=Statistics())
    assert found.serving_is_measured
    assert not found.timed_by_sites
    reading = RadioReading(1, 0.5, timing_advance=3.0)
    np.testing.assert_allclose(found.log_serving_at(pixel, reading), [-3.0, -4.0, -6.0])
    untimed = replace(reading, timing_advance=nan)
    np.testing.assert_allclose(found.log_serving_at(pixel, untimed), [0.0, -1.0, -3.0])
    assert model().timed_by_sites
    assert not model().serving_is_measured


@pytest.mark.parametrize("steps", [nan, 2.0])
def test_the_usual_probability_of_a_serving_cell_is_the_mean_over_all_ways(steps):
    """Found once for each cell and timing advance."""
    statistics = Statistics()
    found = model(serving_model=statistics)
    ways = np.flatnonzero(ON_WAY)
    expected = log(np.mean(np.exp(-(2 + 1) * ways / 10.0))) - (4.0 if steps == 2.0 else 0.0)
    for _ in range(2):
        assert found.usual_serving(2, steps) == pytest.approx(expected)
    assert statistics.asked == [ways.tolist()]
    # Another missing advance is the same, and another one is not.
    assert found.usual_serving(2, float("nan") if steps != 2.0 else 2.0) == pytest.approx(expected)
    assert len(statistics.asked) == 1
    for more in (3.0, 4.0):
        timed = found.usual_serving(2, more)
        assert timed == pytest.approx(log(np.mean(np.exp(-3.0 * ways / 10.0))) - 2.0 * more)
    statistics.asked.clear()
    found.usual_serving(2, steps)
    assert not statistics.asked
    assert found.usual_serving(1, steps) > expected
    assert len(statistics.asked) == 1
    assert model().usual_serving(2, steps) == -0.7
    nowhere = replace(AREA, on_way=np.zeros_like(AREA.on_way))
    without = MeasuredMapModel(nowhere, evidence=OPTIONS, serving_model=Statistics())
    assert without.usual_serving(2, steps) == -0.7
