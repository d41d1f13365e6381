"""Tracks are the same to the byte for any number of threads."""

import pickle
import threading
from dataclasses import replace

import numpy as np
import pytest
from made_town import Town, walk_log

from mapfilter._threads import ONE
from mapfilter.positioning.bayes.options import BayesFilter, GridFilter
from mapfilter.positioning.loop import locate
from mapfilter.positioning.merging import epochs

MANY = BayesFilter(max_particles=60_000, min_search_particles=60_000, min_particles=60_000)
AREA = Town.of(3).area()


def digest(threads, log, *, start):
    """Return all that a track tells, with the hypotheses at its end, and its last state."""
    filter_, rng = replace(MANY, threads=threads).over_area(AREA), np.random.default_rng(1)
    first, outputs = log.truth.iloc[0], []
    place = float(first["east_m"]), float(first["north_m"]), 10.0
    track = filter_.begin_at(*place, rng) if start else filter_.begin()
    for epoch in epochs(log):
        track, output = filter_.step(track, epoch, rng)
        outputs.append(repr(output))
    arrays = track.belief.state, track.belief.kept, track.belief.log_weight
    return [*outputs, *(array.tobytes() for array in arrays)], track


@pytest.fixture(scope="module")
def walk():
    return walk_log(Town.of(3), 5, 60.0)


@pytest.mark.parametrize(("start", "status"), [(True, "TRACKING"), (False, "SEARCHING")])
def test_a_track_does_not_depend_on_threads(walk, start, status):
    expected, track = digest(1, walk, start=start)
    assert (track.belief.log_weight.size, track.status.name) == (60_000, status)
    for threads in (2, 3, 7):
        assert digest(threads, walk, start=start)[0] == expected
    names = [one.name for one in threading.enumerate()]
    assert sum(name.startswith("mapfilter-part") for name in names) >= 2


def test_a_filter_with_threads_can_be_sent_elsewhere(walk):
    few = BayesFilter(max_particles=500, min_search_particles=300, min_particles=200, threads=3)
    filter_ = few.over_area(AREA)
    expected = located(filter_, walk)
    sent = pickle.loads(pickle.dumps(filter_))
    assert sent.model.threads == filter_.model.threads
    assert sent.beliefs.by_compass[True].threads.count == 3
    assert located(sent, walk).equals(expected)


def located(filter_, log):
    return locate(log, filter_, np.random.default_rng(2)).estimate.to_dataframe()


@pytest.mark.parametrize("compass", [True, False])
def test_a_grid_is_not_divided(compass):
    filter_ = GridFilter(threads=4).over_area(AREA)
    assert filter_.model.threads.count == 4
    assert filter_.beliefs.by_compass[compass].model.model.threads == ONE
