"""Vehicles off the roads: what a metre costs the null hypothesis, and when."""

from dataclasses import replace
from types import SimpleNamespace

import pytest
from made_filters import RULES, SEARCHING, TRACKING, belief

from mapfilter.models.way_map import MapWeights
from mapfilter.positioning.bayes.rivals.alternative import NullHypothesis
from mapfilter.positioning.bayes.rivals.rivals import challenged
from mapfilter.positioning.bayes.rivals.yards import off_nats_per_m
from mapfilter.positioning.bayes.sources.evidence import RadioReading

NULL = NullHypothesis(-4.0, 20.0)


def after_map(by_map, off_nats):
    """Log odds after 20 m in which the map has cost the belief so much, and levels gain 1."""
    before = belief(travelled_m=40.0)
    before = replace(before, log_weight=before.log_weight - by_map)
    after = belief(travelled_m=40.0, log_evidence=before.log_evidence - by_map + 1.0)
    return challenged(RULES, NULL, RadioReading(), before, after, off_nats).log_odds


@pytest.mark.parametrize(
    ("by_map", "off_nats", "expected"),
    [
        # The null hypothesis pays 0.1 a metre: whoever leaves the roads fast gains it 1.
        (3.0, 0.0, -4.0 - 2.0 + 3.0 - 1.0),
        # In a yard both pay the same,
        (3.0, 0.15, -4.0 - 1.0),
        # but what it costs to leave the roads still counts,
        (8.0, 0.15, -4.0 - 3.0 + 8.0 - 1.0),
        # and on them nothing changes.
        (0.5, 0.15, -4.0 - 2.0 + 0.5 - 1.0),
        (3.0, 0.05, -4.0 - 2.0 + 3.0 - 1.0),
    ],
)
def test_a_metre_off_the_roads_costs_both_the_same(by_map, off_nats, expected):
    assert after_map(by_map, off_nats) == pytest.approx(expected)


def test_without_a_way_the_map_says_nothing():
    still = belief(travelled_m=20.0)
    found = challenged(RULES, NULL, RadioReading(), still, still, 0.15)
    assert found == NULL


@pytest.mark.parametrize(
    ("last_mps", "mean_mps", "unit_m", "status", "cells", "expected"),
    [
        (3.0, 9.0, 1.0, TRACKING, ("A",), 0.15),
        # The first metres of a road after a yard, of which a report may tell late.
        (9.0, 6.0, 1.0, TRACKING, ("A",), 0.15),
        (7.0, 6.1, 1.0, TRACKING, ("A",), 0.0),
        (19.0, 20.0, 0.3, TRACKING, ("A",), 0.15),
        (3.0, 9.0, 1.0, SEARCHING, ("A",), 0.0),
        (3.0, 9.0, 1.0, TRACKING, (), 0.0),
        (3.0, 9.0, 1.0, None, ("A",), 0.0),
    ],
)
def test_who_may_be_in_a_yard(last_mps, mean_mps, unit_m, status, cells, expected):
    """A found position, over cells, at up to 6 m/s."""
    model = SimpleNamespace(
        weights=MapWeights(off_cost_per_m=0.15), area=SimpleNamespace(cell_ids=cells)
    )
    state = SimpleNamespace(
        belief=None if status is None else belief(status),
        hold=SimpleNamespace(step_unit_m=unit_m),
        watch=SimpleNamespace(pace=SimpleNamespace(last_mps=last_mps, speed_mps=mean_mps)),
    )
    assert off_nats_per_m(SimpleNamespace(model=model), state) == expected


def test_a_stricter_map_still_refutes_a_position_off_the_roads():
    """Of 2 nats a metre the null hypothesis pays what a vehicle's costs by default."""
    model = SimpleNamespace(
        weights=MapWeights(off_cost_per_m=2.0), area=SimpleNamespace(cell_ids=("A",))
    )
    pace = SimpleNamespace(last_mps=1.4, speed_mps=1.4)
    state = SimpleNamespace(
        belief=belief(TRACKING),
        hold=SimpleNamespace(step_unit_m=1.0),
        watch=SimpleNamespace(pace=pace),
    )
    assert off_nats_per_m(SimpleNamespace(model=model), state) == 0.15
