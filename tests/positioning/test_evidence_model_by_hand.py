"""How a model of radio maps alone weighs hypotheses by reports, with numbers by hand."""

from dataclasses import replace
from math import log

import numpy as np
import pytest
from made_radio import AREA, at_places, cloud_of, hypotheses, named, read, serving
from small_area import OPTIONS

from mapfilter.filters.contract import Reason
from mapfilter.positioning.bayes.sources.evidence import RadioReading
from mapfilter.positioning.bayes.sources.evidence_model import EvidenceModel

MODEL = EvidenceModel(AREA, evidence=OPTIONS)
REPORT = read(serving("A", -70.25), named("C", -82.0))[1]
NOBODY = RadioReading()
"""A report of nothing, to be filled."""


def weighed(reading, cloud, model=MODEL):
    """What a reading adds to the weights of equal hypotheses, and these afterwards."""
    log_weight = np.zeros(cloud.state.shape[1])
    cloud, reason = model.weigh(cloud, log_weight, reading)
    return log_weight, cloud, reason


def test_a_serving_cell_that_the_map_lacks_is_a_reading_that_weighs_all_alike():
    for weight, reason in ((0.4, Reason.USED), (0.0, Reason.NO_READING)):
        given = replace(NOBODY, serving_weight=weight)
        gain, cloud, why = weighed(given, cloud_of(hypotheses(9)))
        assert (gain.tolist(), why) == ([0.0] * 9, reason)
        assert (cloud.shared is None) == (weight == 0.0)


@pytest.mark.parametrize(
    "later",
    [
        replace(REPORT, levels=None, length_m=5.0),
        replace(REPORT, levels=None, serving_weight=0.0, length_m=5.0),
        replace(REPORT, serving=-1, serving_weight=0.0, length_m=5.0),
        # Bounds alone: what hypotheses keep is aged all the same.
        replace(read(named("D", -110.5, -1))[1], length_m=5.0),
    ],
)
def test_hypotheses_are_weighed_as_if_each_were_alone(later):
    """By three reports, of which the second ages what they keep in its own way."""
    state = hypotheses(40)
    errors = replace(OPTIONS.levels, fault_probability=0.1, fault_m=200.0)
    model = EvidenceModel(AREA, evidence=replace(OPTIONS, levels=errors))
    some = slice(33, 40)
    found = {}
    for name, chosen in (("all", state), ("some", state[:, some])):
        cloud, gains = cloud_of(chosen), []
        for reading in (REPORT, later, replace(REPORT, length_m=5.0)):
            gain, cloud, _ = weighed(reading, cloud, model)
            gains.append(gain)
        found[name] = np.array(gains)
    np.testing.assert_allclose(found["all"][:, some], found["some"], atol=1e-4)
    assert np.ptp(found["all"][2]) > 1.0


def test_a_serving_cell_may_be_at_fault():
    """Two in ten are: such a cell serves anywhere, at a cost."""
    served = replace(REPORT, levels=None)
    errors = replace(OPTIONS.levels, fault_probability=0.2)
    faulty = EvidenceModel(AREA, evidence=replace(OPTIONS, levels=errors))
    state = hypotheses(60)
    right, found = (weighed(served, cloud_of(state), one)[0] for one in (MODEL, faulty))
    cost = REPORT.serving_weight * OPTIONS.serving.fault_nats
    np.testing.assert_allclose(found, np.logaddexp(log(0.8) + right, log(0.2) - cost), atol=2e-3)
    assert np.ptp(right) > 1.0


FULL = read(serving("A", -70.25), named("B", -75.0), named("C", -82.0))[1]
"""A list that is full: what it lacks is weaker than -110 dBm, at most."""


def test_a_cell_that_is_absent_counts_where_it_is_expected():
    levels = FULL.levels
    assert (levels.absent.tolist(), levels.limit_dbm.tolist()) == ([3], [-110.0])
    state = hypotheses(60)
    without = replace(FULL, levels=levels.with_absent([]))
    (gain, cloud, _), (plain, other, _) = (weighed(one, cloud_of(state)) for one in (FULL, without))
    # If the prediction is wrong about it, seven in ten such cells are not in a report.
    apart = cloud.shared.other_log_likelihood - other.shared.other_log_likelihood
    assert apart == pytest.approx(OPTIONS.levels.weight * log(0.7), abs=1e-5)
    level_dbm = AREA.level_dbm[(6 - state[1] // 10).astype(int), (state[0] // 10).astype(int), 3]
    strong = level_dbm > -80.0
    assert 5 < strong.sum() < 55
    assert (gain - plain)[strong].max() < -1.0
    # Errors of the same site leave some doubt.
    assert (gain - plain)[strong].mean() < -6.0
    assert (gain - plain)[level_dbm < -110.0].mean() > -2.0


@pytest.mark.parametrize("tracked", [False, True])
def test_beyond_the_edge_each_report_tells_which_of_both_holds(tracked):
    """Odds that no prediction holds: even ones at first, then by what either has explained."""
    reading = replace(REPORT, tracked=tracked)
    inside, beyond = (1.0, 35.0), (-30.0, 35.0)
    both, alone = cloud_of(at_places(inside, beyond)), cloud_of(at_places(inside))
    # What the pixel at the edge says in full.
    full, cloud, _ = weighed(REPORT, alone)
    unknown = reading.radio_under_null(cloud.shared.other_log_likelihood)
    log_odds = float(np.clip(unknown - full[0], -8.0, 8.0))
    _, both, _ = weighed(reading, both)
    assert abs(log_odds) > 0.2
    later = replace(REPORT, tracked=False, length_m=0.0)
    gain, both, _ = weighed(later, both)
    unknown = later.radio_under_null(both.shared.other_log_likelihood)
    expected = np.logaddexp(gain[0], log_odds + unknown) - np.logaddexp(0.0, log_odds)
    assert gain[1] == pytest.approx(expected, abs=2e-3)
    assert abs(gain[1] - gain[0]) > 0.01


def test_a_copy_computes_anew():
    assert MODEL.prediction is MODEL.prediction
    assert set(MODEL.__getstate__()) == {"area", "_", "evidence", "remember", "threads"} - {"_"}


def test_the_whole_of_an_area_by_tiles_is_not_held():
    with pytest.raises(AssertionError, match="held by tiles"):
        _ = EvidenceModel(object(), evidence=OPTIONS).whole
    assert MODEL.whole is AREA
