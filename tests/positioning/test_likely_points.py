"""How likely points of an area are by first evidence, and which reports make them equally so."""

from dataclasses import replace
from math import log, nan
from types import SimpleNamespace

import numpy as np
import pytest

from mapfilter.models.fingerprint import BoundReading
from mapfilter.models.level_errors import LevelReport
from mapfilter.positioning.bayes.area import likely_points as tested
from mapfilter.positioning.bayes.area.likely_points import (
    known_reading,
    likelihoods,
    likelihoods_on_ways,
)
from mapfilter.positioning.bayes.sources.evidence import FixedTerm, RadioReading

POINTS = np.array([[10.0, 20.0, 30.0, 40.0, 50.0], [1.0, 2.0, 3.0, 4.0, 5.0]], dtype=np.float32)
NATS = {10.0: -700.0, 20.0: -701.0, 30.0: -705.0, 40.0: -702.0, 50.0: -703.0}


class Model:
    """A model that weighs points by their place, each with its own north."""

    kept = 0

    def __init__(self, points=POINTS):
        self.whole = SimpleNamespace(points=points)

    def weigh(self, cloud, log_weight, reading):
        assert reading == "reading"
        east, north = cloud.state[:2]
        assert (east == 10.0 * north).all()
        assert not cloud.state[2:].any()
        assert cloud.kept.shape == (0, east.size)
        log_weight += [NATS[one] for one in east.tolist()]

    def kept_likelihoods(self, known):
        self.kept += 1
        return "kept", known.reading


@pytest.mark.parametrize("at_once", [1, 2, 4, 5, 50_000])
def test_points_have_shares_by_their_likelihood(monkeypatch, at_once):
    """However many are weighed at a time."""
    monkeypatch.setattr(tested, "_AT_ONCE", at_once)
    shares, log_mean = likelihoods(Model(), POINTS, "reading")
    likelihood = np.exp([0.0, -1.0, -5.0, -2.0, -3.0])
    np.testing.assert_allclose(shares, likelihood / likelihood.sum(), rtol=1e-6)
    assert log_mean == pytest.approx(-700.0 + log(likelihood.mean()))
    assert shares.dtype == np.float32


def test_points_that_are_out_of_the_question_have_no_share(monkeypatch):
    monkeypatch.setitem(NATS, 30.0, -2000.0)
    shares, log_mean = likelihoods(Model(), POINTS, "reading")
    likelihood = np.exp([0.0, -1.0, -1300.0, -2.0, -3.0])
    np.testing.assert_allclose(shares, likelihood / likelihood.sum(), rtol=1e-6)
    assert log_mean == pytest.approx(-700.0 + log(likelihood.mean()))


def test_fifty_thousand_points_are_weighed_at_a_time():
    """What a report expects of cells is a mean over those."""
    sizes = []
    model = SimpleNamespace(weigh=lambda cloud, *_: sizes.append(cloud.state.shape[1]))
    likelihoods(model, np.zeros((2, 100_001), dtype=np.float32), "reading")
    assert sizes == [50_000, 50_000, 1]


def test_without_evidence_all_points_are_alike():
    shares, log_mean = likelihoods(Model(), POINTS, None)
    np.testing.assert_allclose(shares, 0.2)
    assert log_mean == pytest.approx(0.0)


@pytest.mark.parametrize(("most", "kept"), [(4, False), (5, True)])
def test_likelihoods_of_reports_are_kept_for_areas_of_a_size(monkeypatch, most, kept):
    monkeypatch.setattr(tested, "_MOST_POINTS", most)
    monkeypatch.setattr(tested, "likelihoods", lambda _, points, reading: (points, reading))
    reading, model = RadioReading(0, 1.0), Model()
    found = likelihoods_on_ways(model, reading)
    assert (found == ("kept", reading)) if kept else (found == (POINTS, reading))
    assert model.kept == kept
    # Terms of other sources have no equals, and without evidence nothing is kept.
    timed = replace(reading, terms=(FixedTerm(np.zeros(1)),))
    assert likelihoods_on_ways(model, timed) == (POINTS, timed)
    assert likelihoods_on_ways(model, None) == (POINTS, None)
    assert model.kept == kept


def reading(**changes):
    cell, absent = np.array([1, 2], dtype=np.int32), np.array([3], dtype=np.int32)
    levels = LevelReport(
        cell, np.array([-70, -80], "f4"), absent, np.full(absent.size, -110, "f4"), 2.0
    )
    bound = BoundReading(np.array([1, 4], dtype=np.int32), -60.0, 1, 8.0, 0.5)
    return RadioReading(**({"serving": 1, "serving_weight": 0.5, "levels": levels,
                            "bounds": (bound,)} | changes))  # fmt: skip


def test_equal_reports_are_known_by_their_numbers():
    one, other = known_reading(reading()), known_reading(reading())
    assert one == other
    assert hash(one) == hash(other)
    assert one.reading is not other.reading
    assert known_reading(reading(terms=(FixedTerm(np.zeros(1)),))) is None
    levels, (bound,) = reading().levels, reading().bounds
    more = np.array([1, 5], dtype=np.int32)
    different = [
        {"serving": 2}, {"serving_weight": 0.6}, {"length_m": 3.0}, {"tracked": True},
        {"timing_advance": 2.0}, {"serving_under_null": -0.8}, {"under_null": -0.1},
        {"levels": None}, {"bounds": ()}, {"bounds": (bound, bound)},
        {"levels": levels._replace(cell=more)}, {"levels": levels._replace(absent=more)},
        {"levels": levels._replace(level_dbm=levels.level_dbm - 1)},
        {"levels": levels._replace(limit_dbm=levels.limit_dbm - 1)},
        {"levels": levels._replace(offset_db=3.0)},
        {"bounds": (bound._replace(cells=more),)}, {"bounds": (bound._replace(censored=-1),)},
        {"bounds": (bound._replace(level_dbm=-61.0),)}, {"bounds": (bound._replace(sd_db=9.0),)},
        {"bounds": (bound._replace(weight=0.4),)},
    ]  # fmt: skip
    keys = {known_reading(reading(**changes)) for changes in different}
    assert len(keys | {one}) == len(different) + 1
    # A missing timing advance equals itself.
    assert known_reading(reading(timing_advance=nan)) == one
