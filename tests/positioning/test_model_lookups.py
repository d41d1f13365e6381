"""How the map filter's model starts, converges, and looks up what a reading needs of an area."""

from dataclasses import dataclass, field, replace
from math import nan
from types import SimpleNamespace

import numpy as np
import pytest
from made_radio import AREA, MODEL, gain_of, named, read, serving
from small_area import LEVEL_DBM, OPTIONS

from mapfilter.filters.hypotheses import BeliefSummary
from mapfilter.models.level_errors import LevelReport
from mapfilter.models.level_kernels import Prediction
from mapfilter.models.street_motion import OFF, STATES
from mapfilter.positioning.bayes.area.tiled_area import TiledArea
from mapfilter.positioning.bayes.beliefs.first_hypotheses import Start, first_hypotheses
from mapfilter.positioning.bayes.beliefs.model import BayesModel
from mapfilter.positioning.bayes.sources.evidence import RadioReading
from mapfilter.positioning.bayes.sources.sampled_cells import expected_absent, mean_rough_db2


@pytest.mark.parametrize("known", [True, False])
def test_what_starts_a_belief_is_in_its_weights_once(known):
    """About a known start a reading weighs hypotheses; else they are drawn by it."""
    reading = read(serving("A", -70.25), named("C", -82.0))[1]
    place = {"east_m": 500_045.0, "north_m": 4_500_035.0, "sd_m": 15.0} if known else {}
    prior = Start(reading, True, **place)
    cloud, log_weight = MODEL.start(prior, 300, np.random.default_rng(1))
    plain, before = first_hypotheses(MODEL, prior, 300, np.random.default_rng(1))
    np.testing.assert_array_equal(cloud.state, plain.state)
    gain, weighed, _ = gain_of(reading, cloud.state)
    assert np.ptp(gain) > 1.0
    np.testing.assert_allclose(log_weight - before, gain if known else 0.0, atol=1e-4)
    # Either way hypotheses keep what it says of the errors of levels.
    np.testing.assert_allclose(cloud.kept, weighed.kept)


@pytest.mark.parametrize(
    ("off", "doubted", "edge", "expected"),
    [(0.4, False, False, True), (0.5, False, False, False), (nan, False, False, False),
     (0.4, True, False, False), (0.4, False, True, False)],
)  # fmt: skip
def test_when_a_belief_may_converge(off, doubted, edge, expected):
    mean = np.zeros(STATES)
    mean[OFF] = off
    summary = BeliefSummary(mean, np.eye(2), np.ones(3), 1.0, np.empty((0, 3)), 0.0)
    place = np.array([1.0 if edge else 45.0, 35.0, *[0.0] * 6])
    own = SimpleNamespace(summary=summary._replace(mean=place))
    reading = RadioReading(doubted=doubted, belief=own)
    assert MODEL.can_converge(summary, reading) is expected
    assert MODEL.can_converge(summary, RadioReading(doubted=doubted)) is (expected or edge)


def test_the_mean_roughness_of_predicted_levels():
    """Of all pixels, where they are few; half of its variance is added."""
    rough = replace(OPTIONS, levels=replace(OPTIONS.levels, roughness=0.5))
    predicted = BayesModel(AREA, evidence=rough).prediction
    pixel, cell = np.arange(63, dtype=np.int32), np.array([2, 0], dtype=np.int32)
    squares = (AREA.flat_rough_db.reshape(63, 6)[:, cell] / 10.0) ** 2
    found = mean_rough_db2(predicted, pixel, cell)
    np.testing.assert_allclose(found, 0.5 * squares.mean(axis=0), rtol=1e-5)
    # 600 hypotheses are looked at by every second.
    many = np.resize(pixel, 600)
    squares = (AREA.flat_rough_db.reshape(63, 6)[many[::2]][:, cell] / 10.0) ** 2
    found = mean_rough_db2(predicted, many, cell)
    np.testing.assert_allclose(found, 0.5 * squares.mean(axis=0), rtol=1e-5)


@pytest.mark.parametrize("limit_dbm", [-101.0, -80.0, -63.0, -50.0])
def test_absent_cells_that_hypotheses_expect_come_by_how_many_do(limit_dbm):
    pixel, absent = np.arange(63, dtype=np.int32), np.array([0, 1, 2, 3], dtype=np.int32)
    none = np.zeros(0, dtype=np.int32)
    limits_dbm = np.full(absent.size, limit_dbm, dtype=np.float32)
    report = LevelReport(none, none.astype(np.float32), absent, limits_dbm, 0.0)
    share = (LEVEL_DBM.reshape(63, 4) > limit_dbm).mean(axis=0)
    order = [k for k in np.argsort(-share, kind="stable").tolist() if share[k] > 0.02]
    assert expected_absent(MODEL.prediction, pixel, report).absent.tolist() == order
    nothing = report.with_absent([])
    assert expected_absent(MODEL.prediction, pixel, nothing).absent.tolist() == []


@dataclass(frozen=True, eq=False)
class Tiled(TiledArea):
    """An area by tiles that looks up what the whole one has, and notes what it is asked for."""

    asked: list = field(default_factory=list)

    def predicted(self, pixel, cell, share, *, rough=True):
        self.asked.append((cell.tolist(), rough))
        level_dbm = AREA.level_dbm.reshape(63, 6)[pixel][:, cell].ravel()
        rough_db = AREA.flat_rough_db.reshape(63, 6)[pixel][:, cell].ravel()
        found = Prediction(level_dbm, rough_db if rough else rough_db[:0], cell.size, share)
        own = np.arange(pixel.size, dtype=np.int32)
        return found, own, np.arange(cell.size, dtype=np.int32)

    def shares_above(self, pixel, cell, limit_dbm):
        return (AREA.level_dbm.reshape(63, 6)[pixel][:, cell] > limit_dbm).mean(axis=0)


def test_over_an_area_by_tiles_the_cells_of_a_reading_alone_are_looked_up():
    """The serving cell with the two strongest of all; levels with their roughness."""
    rough = replace(OPTIONS, levels=replace(OPTIONS.levels, roughness=0.5))
    names = ("lattice", "cell_ids", "known_ids", "carriers", "floor_dbm", "sites")
    tiled = Tiled(*(getattr(AREA, name) for name in names), tiles=None)
    whole = read(
        serving("B", -70.25), named("C", -82.0), named("A", -99.0), named("D", -110.5, -1)
    )[1]
    expected, _, _ = gain_of(whole, model=BayesModel(AREA, evidence=rough))
    found, _, _ = gain_of(whole, model=BayesModel(tiled, evidence=rough))
    np.testing.assert_allclose(found, expected, atol=1e-4)
    assert np.ptp(expected) > 5.0
    assert tiled.asked[0] == ([1, 4, 5], False)
    assert ([1, 2, 0], True) in tiled.asked
    assert tiled.asked[-1] == ([3], False)
