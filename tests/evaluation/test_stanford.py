"""Regions of the Stanford diagram against a table written by hand, and its bins."""

from math import inf, nan

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from mapfilter.errors import ConfigError
from mapfilter.evaluation.stanford import (
    BINS,
    REGIONS,
    IntegrityOptions,
    StanfordCounts,
    stanford_bins,
    stanford_counts,
    stanford_regions,
)

TABLE = {
    # error, level, with an alert limit of 50 m
    (0.0, 0.0): "available",
    (5.0, 20.0): "available",
    (20.0, 20.0): "available",
    (20.01, 20.0): "misleading",
    (50.0, 20.0): "misleading",
    (50.01, 20.0): "hazardous",
    (50.0, 50.0): "available",
    (50.01, 50.0): "hazardous",
    (900.0, 0.0): "hazardous",
    (5.0, 50.01): "unavailable",
    (60.0, 60.0): "unavailable",
    (60.01, 60.0): "unavailable_misleading",
    (5.0, inf): "unavailable",
    (1e9, inf): "unavailable",
    (5.0, nan): "unavailable",
}

AMOUNTS = arrays.arrays(float, 30, elements=st.floats(0, 300, width=32))


def by_hand(error, level, limit):
    """The regions by their definition, one condition after the other."""
    if np.isnan(level) or level > limit:
        return "unavailable_misleading" if error > level else "unavailable"
    if error <= level:
        return "available"
    return "misleading" if error <= limit else "hazardous"


def test_every_border_belongs_to_the_better_region():
    errors, levels = np.array(list(TABLE)).T
    found = [REGIONS[i] for i in stanford_regions(errors, levels, 50.0)]
    assert found == list(TABLE.values())


@given(AMOUNTS, AMOUNTS, st.floats(1, 200))
def test_each_epoch_is_in_the_region_that_the_table_gives_it(errors, levels, limit):
    found = stanford_regions(errors, levels, limit)
    assert [REGIONS[i] for i in found] == [
        by_hand(*pair, limit) for pair in zip(errors, levels, strict=True)
    ]


@given(AMOUNTS, AMOUNTS, st.floats(1, 200))
def test_counts_are_all_epochs_and_a_wider_limit_makes_none_unavailable(errors, levels, limit):
    counts = stanford_counts(errors, levels, limit)
    assert counts.epochs == errors.size
    assert counts.exceeded == np.sum(errors > levels)
    wider = stanford_counts(errors, levels, 2 * limit)
    assert wider.available + wider.misleading + wider.hazardous >= (
        counts.available + counts.misleading + counts.hazardous
    )
    assert wider.exceeded == counts.exceeded


def test_epochs_without_an_error_are_left_out():
    assert stanford_counts([nan, 5.0], [10.0, 10.0], 50.0) == StanfordCounts(available=1)
    assert stanford_bins([nan], [5.0], 50.0).shape == (0, 3)


@given(AMOUNTS, AMOUNTS)
def test_bins_hold_every_epoch_on_its_side_of_the_alert_limit(errors, levels):
    limit = 50.0
    bins = stanford_bins(errors, levels, limit)
    assert bins[:, 2].sum() == errors.size
    assert ((bins[:, :2] >= 0) & (bins[:, :2] < BINS)).all()
    half = BINS // 2
    assert bins[bins[:, 1] < half, 2].sum() == np.sum(levels <= limit)
    assert bins[bins[:, 0] < half, 2].sum() == np.sum(errors <= limit)
    assert bins[bins[:, 0] == BINS - 1, 2].sum() == np.sum(errors > 2 * limit - 1)


def test_infinite_levels_are_in_the_last_bin():
    assert stanford_bins([5.0], [inf], 50.0).tolist() == [[4, BINS - 1, 1]]
    assert stanford_bins([5.0], [nan], 50.0).tolist() == [[4, BINS - 1, 1]]


@pytest.mark.parametrize("wrong", [{"risk": 0.0}, {"risk": 1.0}, {"alert_limit_m": 0.0}])
def test_options_have_limits(wrong):
    with pytest.raises(ConfigError, match=next(iter(wrong))):
        IntegrityOptions(**wrong)
