"""Levels count less for a belief that is tracked, but in full as evidence for or against it."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import logsumexp
from small_area import BANDS, COLS, OPTIONS, PIXEL_M, ROWS, make_area

from mapfilter.filters.belief_models import Cloud
from mapfilter.filters.contract import Status
from mapfilter.filters.particle import ParticleBelief, ParticleFilter, ParticleOptions
from mapfilter.models.street_motion import STATES
from mapfilter.positioning.bayes.beliefs.model import BayesModel
from mapfilter.positioning.bayes.sources.evidence import FixedTerm
from mapfilter.positioning.bayes.sources.radio import RadioSource
from mapfilter.positioning.bayes.state import DeadReckoning
from mapfilter.positioning.epochs import Epoch, ReportRow

AREA, COUNT = make_area(), 400
MODEL = BayesModel(AREA, evidence=OPTIONS)


@pytest.fixture(scope="module")
def reading():
    """Levels of the serving cell and a neighbour."""
    first, second = list(BANDS)[:2]
    nan = float("nan")
    rows = (
        ReportRow("serving", first, None, None, -72.0, 0, nan),
        ReportRow("neighbour", second, None, None, -81.0, 0, nan),
    )
    source = RadioSource(AREA, OPTIONS)
    return source.read(None, DeadReckoning(), Epoch(0.0, radio=rows), 3.0).radio


def particles():
    rng = np.random.default_rng(4)
    state = np.zeros((STATES, COUNT), dtype=np.float32)
    state[0] = rng.uniform(0, COLS * PIXEL_M, COUNT)
    state[1] = rng.uniform(0, ROWS * PIXEL_M, COUNT)
    return Cloud(state, np.empty((0, COUNT), "f4")), rng.normal(0, 1, COUNT)


def weighed(reading):
    cloud, log_weight = particles()
    found = log_weight.copy()
    cloud, _ = MODEL.weigh(cloud, found, reading)
    return log_weight, found, cloud.withheld


def test_a_share_of_the_levels_is_in_the_weights_and_the_rest_in_the_evidence(reading):
    before, full, none = weighed(reading)
    _, alone, _ = weighed(replace(reading, levels=None))
    _, tracked, withheld = weighed(replace(reading, tracked=True))
    share = OPTIONS.levels.tracking_share
    assert none == 0.0
    assert 0 < share < 1
    # What the serving cell says counts in full.
    np.testing.assert_allclose(tracked, alone + share * (full - alone), atol=1e-5)
    assert np.ptp(full - alone) > 1.0
    assert withheld == pytest.approx(logsumexp(full) - logsumexp(tracked), abs=1e-6)
    assert np.ptp(before) > 1.0


def test_the_log_evidence_of_a_tracked_belief_is_that_of_the_whole_report(reading):
    """Also with other evidence, and with hypotheses beyond the area."""
    cloud, log_weight = particles()
    cloud.state[0, :40] = -30.0
    log_weight -= logsumexp(log_weight)
    fix = FixedTerm(np.random.default_rng(2).normal(0, 2, COUNT))
    reading = replace(reading, terms=(fix,))
    options = ParticleOptions(max_particles=COUNT, min_search_particles=COUNT, min_particles=COUNT)
    positioner = ParticleFilter(MODEL, options)
    belief = ParticleBelief(cloud.state, log_weight, MODEL.bins, cloud.kept, status=Status.TRACKING)
    evidence = [
        positioner.update(belief, given, np.random.default_rng(1))[0].log_evidence
        for given in (reading, replace(reading, tracked=True))
    ]
    assert evidence[1] == pytest.approx(evidence[0], abs=1e-5)
    assert abs(evidence[0]) > 1.0


def test_beyond_the_area_the_same_share_counts(reading):
    """There a prediction holds or not: both sides of the mixture count alike."""
    cloud, _ = particles()
    cloud.state[0] = -30.0
    found = {}
    for tracked in (False, True):
        weight = np.zeros(COUNT)
        after, _ = MODEL.weigh(cloud, weight, replace(reading, tracked=tracked))
        found[tracked] = weight
    whole, share = after.shared.other_log_likelihood, OPTIONS.levels.tracking_share
    unknown = reading.radio_under_null(whole), reading.radio_under_null(share * whole)
    # What the prediction at the edge says, from the mixture of the whole report.
    inside = np.log(2 * np.exp(found[False]) - np.exp(unknown[0]))
    alone = np.zeros(COUNT)
    MODEL.weigh(cloud, alone, replace(reading, levels=None))
    serving = np.log(2 * np.exp(alone) - np.exp(reading.radio_under_null(0.0)))
    expected = np.logaddexp(serving + share * (inside - serving), unknown[1]) - np.log(2)
    np.testing.assert_allclose(found[True], expected, atol=1e-4)


def test_a_hypothesis_without_weight_keeps_none(reading):
    cloud, log_weight = particles()
    log_weight[::2] = -np.inf
    cloud, _ = MODEL.weigh(cloud, log_weight, replace(reading, tracked=True))
    assert np.isneginf(log_weight[::2]).all()
    assert np.isfinite(log_weight[1::2]).all()
    assert np.isfinite(cloud.withheld)
