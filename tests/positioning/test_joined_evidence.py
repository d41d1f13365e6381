"""Evidence of several sources joined to one reading, for the belief and for its alternative."""

from dataclasses import replace
from math import nan
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import norm

from mapfilter.filters.hypotheses import Bins
from mapfilter.filters.particle import ParticleBelief
from mapfilter.models.fingerprint import BoundReading
from mapfilter.positioning.bayes.sources.evidence import (
    EvidenceUpdate,
    FixedTerm,
    RadioReading,
    bound_under_null,
    joined,
)

A, B, C, D = (FixedTerm(np.full(1, value)) for value in (1.0, 2.0, 3.0, 4.0))
RADIO, OTHER = RadioReading(2, 0.5, under_null=-1.0), RadioReading(3)


def test_nothing_joins_to_nothing():
    assert joined(()) is None
    assert joined((EvidenceUpdate(0), EvidenceUpdate(1))) is None


def test_a_report_alone_stays_as_it_is():
    assert joined((EvidenceUpdate(0, radio=RADIO), EvidenceUpdate(1))) is RADIO
    # The first report counts.
    assert (
        joined((EvidenceUpdate(0), EvidenceUpdate(0, radio=RADIO), EvidenceUpdate(0, radio=OTHER)))
        is RADIO
    )


def test_terms_are_added_in_the_reverse_order_of_the_sources():
    updates = (
        EvidenceUpdate(0, (A, B), under_null=-2.0),
        EvidenceUpdate(1, radio=RADIO),
        EvidenceUpdate(2, (C,), under_null=-4.0),
    )
    found = joined(updates)
    assert found.terms == (C, A, B)
    assert found.under_null == pytest.approx(-7.0)
    assert (found.serving, found.serving_weight) == (2, 0.5)
    alone = joined(updates[::2])
    assert (alone.terms, alone.serving) == ((C, A, B), -1)
    assert alone.under_null == pytest.approx(-6.0)


def test_the_alternative_has_terms_of_its_own_where_they_are_given():
    updates = (
        EvidenceUpdate(0, (A,), under_null=-2.0),
        EvidenceUpdate(1, (B,), (C, D), -4.0, alternative_under_null=-8.0),
        EvidenceUpdate(2, (D,), (), -16.0),
    )
    found = joined(updates)
    assert (found.terms, found.under_null) == ((D, B, A), pytest.approx(-22.0))
    other = joined(updates, alternative=True)
    # The third has none for the alternative; its log-likelihood differs from none.
    assert other.terms == (C, D, A)
    assert other.under_null == pytest.approx(-2.0 - 8.0 - 16.0)


def test_no_likelihood_for_the_alternative_is_one_of_its_own():
    update = EvidenceUpdate(0, (A,), (B,), -2.0, alternative_under_null=0.0)
    assert not update.disputed
    assert joined((update,)).under_null == -2.0
    assert joined((update,), alternative=True).under_null == 0.0


def test_a_likelihood_under_the_null_hypothesis_counts_without_terms():
    found = joined((EvidenceUpdate(0, under_null=-3.0), EvidenceUpdate(1, radio=RADIO)))
    assert (found.terms, found.under_null) == ((), pytest.approx(-4.0))


class OwnTerm:
    """A term of a kind that is computed for any hypotheses."""

    value = np.zeros(3)

    def log_likelihood(self, state):
        return np.zeros(state.shape[1])


def test_terms_of_one_beliefs_hypotheses_hold_for_no_other():
    one, two, each = FixedTerm(np.zeros(1)), FixedTerm(np.zeros(2)), FixedTerm(np.zeros(7))
    other = OwnTerm()
    found = replace(RADIO, terms=(two, one, other, each)).for_other_hypotheses()
    assert found == replace(RADIO, terms=(one, other))
    kept = replace(RADIO, terms=(one, other))
    assert kept.for_other_hypotheses() is kept


def test_nothing_is_read_unless_it_is_given():
    reading = RadioReading()
    assert (reading.length_m, reading.under_null, reading.serving_under_null) == (0.0, 0.0, -0.7)
    assert (reading.serving, reading.serving_weight) == (-1, 0.0)
    assert (reading.doubted, reading.tracked, reading.belief) == (False, False, None)


@pytest.mark.parametrize(("tracked", "doubted"), [(True, False), (False, True)])
def test_a_reading_keeps_its_numbers_whatever_belief_it_weighs(tracked, doubted):
    bound = BoundReading(np.array([1, 2]), -80.0, 0, 8.0, 0.5)
    given = RadioReading(
        2, 0.5, object(), (bound,), (A, B), -3.0, length_m=7.0, timing_advance=4.0,
        serving_under_null=-0.9,
    )  # fmt: skip
    belief = SimpleNamespace()
    found = given.weighing(belief, tracked=tracked, doubted=doubted)
    assert found.belief is belief
    assert replace(found, belief=None) == replace(given, tracked=tracked, doubted=doubted)


@pytest.mark.parametrize("edge", [True, False])
def test_a_belief_is_at_the_edge_by_its_mean_unless_all_of_it_is_clear(edge):
    asked = []
    area = SimpleNamespace(
        at_edge=lambda mean: asked.append(mean) or edge,
        clear_of_edge=lambda state: bool(np.all(state[0] > 60.0)),
    )
    assert not replace(RADIO, belief=None).at_edge(area)
    grid = SimpleNamespace(summary=SimpleNamespace(mean=(3.0, 4.0)))
    assert replace(RADIO, belief=grid).at_edge(area) is edge
    assert asked == [(3.0, 4.0)]
    for east_m, looks in ((500.0, False), (50.0, True)):
        asked.clear()
        state = np.full((2, 10), east_m, dtype=np.float32)
        bins, kept = Bins.over((0.0, 0.0, 900.0, 900.0)), np.empty((0, 10), dtype=np.float32)
        particles = ParticleBelief(state, np.full(10, -np.log(10.0)), bins, kept)
        assert replace(RADIO, belief=particles).at_edge(area) is (edge and looks)
        assert bool(asked) is looks


@pytest.mark.parametrize(
    ("level_dbm", "cells", "sd_db", "weight"),
    [(-90.0, 1, 8.0, 1.0), (-70.0, 1, 8.0, 0.5), (-104.0, 5, 6.0, 0.4)],
)
def test_a_level_of_one_of_several_cells_is_one_that_phones_report(level_dbm, cells, sd_db, weight):
    """About -90 dBm, give or take 15 dB; against a level that is predicted without an error."""
    bound = BoundReading(np.arange(cells), level_dbm, 0, sd_db, weight)
    any_level = norm.logpdf(level_dbm, -90.0, np.hypot(15.0, sd_db)) - norm.logpdf(0.0, 0.0, sd_db)
    expected = weight * (any_level - np.log(cells))
    assert bound_under_null(bound) == pytest.approx(expected)
    for censored in (-1, 1):
        assert bound_under_null(bound._replace(censored=censored)) == 0.0
    both = replace(RADIO, bounds=(bound, bound._replace(censored=1), bound))
    assert both.radio_under_null(-2.0) == pytest.approx(-2.0 - 0.7 * 0.5 + 2 * expected)
    assert RadioReading(0, 0.5).radio_under_null(-2.0) == pytest.approx(-2.0 - 0.7 * 0.5)
    unknown = RadioReading(-1, 0.3, serving_under_null=nan)
    assert unknown.radio_under_null(-2.0) == pytest.approx(-2.0 + 0.5 * 0.3)
