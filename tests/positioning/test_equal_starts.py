"""Filters for scores give the same positions, and equal reports are weighed at all points once."""

import pickle
from copy import deepcopy
from dataclasses import replace

import numpy as np
import pytest
from cross_world import walk_log

from mapfilter.positioning.bayes.area.likely_points import (
    KEPT_REPORTS,
    known_reading,
    likelihoods,
    likelihoods_on_ways,
)
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.bayes.sources.evidence import FixedTerm
from mapfilter.positioning.bayes.sources.radio import RadioSource
from mapfilter.positioning.epochs import Epoch, ReportRow
from mapfilter.positioning.loop import locate

OPTIONS = BayesFilter(max_particles=2000, min_search_particles=1000, min_particles=500)
LEFT_OUT = ["way_id", "way_probability", "radius_99_m", "protection_m"]


def positioner(area):
    """Return a filter that has located nothing yet."""
    return OPTIONS.over_area(area)


def located(filter_, seed):
    return locate(walk_log(), filter_, np.random.default_rng(seed)).estimate.to_dataframe()


def report(area, level_dbm=-70.0, serving="W"):
    rows = (
        ReportRow("serving", serving, None, None, level_dbm, 0),
        ReportRow("neighbour", "E", None, None, -85.0, 0),
    )
    source = RadioSource(area, positioner(area).model.evidence)
    reading = source.first(Epoch(0.0, radio=rows)).radio
    assert reading is not None
    return reading


def test_for_scores_all_that_is_left_is_the_same_to_the_bit(area):
    whole = located(positioner(area), 5)
    scored = located(positioner(area).for_scores(), 5)
    rest = [name for name in whole.columns if name not in LEFT_OUT]
    assert whole[rest].equals(scored[rest])
    assert whole["status"].isin(["TRACKING", "UNCERTAIN"]).any()
    assert whole["protection_m"].notna().any()
    assert (whole["way_id"] > 0).any()
    assert scored["way_id"].eq(0).all()
    assert scored[LEFT_OUT[1:]].isna().all(axis=None)


def test_a_second_log_is_located_as_by_a_new_filter(area):
    shared = positioner(area)
    first = located(shared, 5)
    before = shared.model.kept_likelihoods.cache_info()
    again = located(shared, 6)
    after = shared.model.kept_likelihoods.cache_info()
    assert first.equals(located(positioner(area), 5))
    assert again.equals(located(positioner(area), 6))
    assert after.hits > before.hits
    assert after.misses == before.misses


@pytest.mark.parametrize("copied", [lambda one: pickle.loads(pickle.dumps(one)), deepcopy])
def test_a_filter_that_was_used_can_be_copied_and_locates_the_same(area, copied):
    used = positioner(area)
    expected = located(used, 5)
    assert used.model.kept_likelihoods.cache_info().currsize
    copy = copied(used)
    assert copy.model is not used.model
    assert copy.model.kept_likelihoods is not used.model.kept_likelihoods
    assert copy.model.kept_likelihoods.cache_info().currsize == 0
    assert located(copy, 5).equals(expected)


def test_points_are_as_likely_from_memory_as_weighed_anew(area):
    model = positioner(area).model
    for level_dbm in (-70.0, -71.0, -70.0):
        reading = report(area, level_dbm)
        expected, log_mean = likelihoods(model, model.whole.points, reading)
        shares, found = likelihoods_on_ways(model, reading)
        assert np.array_equal(shares, expected)
        assert found == log_mean
    counts = model.kept_likelihoods.cache_info()
    assert (counts.hits, counts.misses, counts.maxsize) == (1, 2, KEPT_REPORTS)


def test_reports_are_equal_by_their_numbers(area):
    reading, key = report(area), known_reading(report(area))
    assert key == known_reading(report(area))
    levels, limit_dbm = reading.levels, np.full(1, -99.0, dtype=np.float32)
    absent = levels._replace(absent=np.array([2], dtype=np.int32), limit_dbm=limit_dbm)
    others = [
        report(area, -71.0),
        report(area, serving="E"),
        replace(reading, serving_weight=2 * reading.serving_weight),
        replace(reading, length_m=3.0),
        replace(reading, tracked=True),
        replace(reading, timing_advance=2.0),
        replace(reading, serving_under_null=-3.0),
        replace(reading, levels=None),
        replace(reading, levels=absent._replace(limit_dbm=absent.limit_dbm - 1)),
        replace(reading, levels=levels._replace(offset_db=levels.offset_db + 1.0)),
        replace(reading, levels=absent),
    ]
    keys = [known_reading(other) for other in others]
    assert key not in keys
    assert len(set(keys)) == len(keys)


def test_what_is_weighed_by_other_sources_too_is_not_kept(area):
    reading = replace(report(area), terms=(FixedTerm(np.zeros(1)),))
    assert known_reading(reading) is None
    model = positioner(area).model
    expected, _ = likelihoods(model, model.whole.points, reading)
    assert np.array_equal(likelihoods_on_ways(model, reading)[0], expected)
    assert model.kept_likelihoods.cache_info().misses == 0
