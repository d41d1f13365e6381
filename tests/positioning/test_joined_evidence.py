"""Evidence of several sources joined to one reading, for the belief and for its alternative."""

import numpy as np
import pytest

from mapfilter.positioning.bayes.evidence import (
    EvidenceUpdate,
    FixedTerm,
    RadioReading,
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


def test_a_likelihood_under_the_null_hypothesis_counts_without_terms():
    found = joined((EvidenceUpdate(0, under_null=-3.0), EvidenceUpdate(1, radio=RADIO)))
    assert (found.terms, found.under_null) == ((), pytest.approx(-4.0))
