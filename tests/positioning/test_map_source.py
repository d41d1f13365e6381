"""The map alone as evidence: when a belief starts, and when it is weighed again."""

from types import SimpleNamespace

import pytest

from mapfilter.filters.contract import MotionStep
from mapfilter.positioning.bayes.beliefs.path import DeadReckoning, RecentPath
from mapfilter.positioning.bayes.sources.map_source import MapSource
from mapfilter.positioning.epochs import Epoch

EPOCH = Epoch(1.0)


def state(travelled_m, path=None, last_m=0.0):
    reckoning, sources = DeadReckoning(travelled_m), {"map": last_m}
    return SimpleNamespace(reckoning=reckoning, path=path or RecentPath(), sources=sources)


def walked(way_m, step_m=1.0):
    path = RecentPath()
    for _ in range(round(way_m / step_m)):
        path = path.moved(MotionStep(step_m, 0.5))
    return path


def test_without_motion_a_map_says_nothing():
    source = MapSource()
    assert (source.begin(), source.spacing_m) == (0.0, 5.0)
    found = source.first(EPOCH)
    assert (found.state, found.terms, found.path) == (0.0, (), None)


def test_a_belief_starts_after_fifty_metres():
    for way_m, starts in ((49.0, False), (50.0, True), (80.0, True)):
        path = walked(way_m)
        found = MapSource().first_after(state(way_m, path), EPOCH)
        assert found.state == way_m
        assert (found.path is path) == bool(found.terms) == starts


@pytest.mark.parametrize("spacing_m", [5.0, 12.0])
def test_it_is_weighed_every_few_metres(spacing_m):
    source = MapSource(spacing_m)
    for gone_m, due in ((0.0, False), (spacing_m - 0.1, False), (spacing_m, True)):
        found = source.update(state(100.0 + gone_m, last_m=100.0), EPOCH, None)
        assert bool(found.terms) == due
        assert found.state == (100.0 + gone_m if due else 100.0)
        for term in found.terms:
            assert term.log_likelihood(None).tolist() == [0.0]
