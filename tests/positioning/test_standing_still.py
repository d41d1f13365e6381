"""A phone that stands still costs little time and memory, and is reported as it was."""

import pickle
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from cross_world import make_database, walk_log

from mapfilter.positioning.bayes import outputs
from mapfilter.positioning.bayes.area.opened_area import open_area
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.loop import locate
from mapfilter.positioning.merging import epochs
from mapfilter.tracks.log import make_log

STOOD = 400


@pytest.fixture(scope="module")
def positioner(tmp_path_factory):
    area = open_area(make_database(tmp_path_factory.mktemp("cross")))
    return BayesFilter(max_particles=3000, min_search_particles=1500).over_area(area)


@pytest.fixture(scope="module")
def log():
    """A walk, after which the phone lies on a table and its modem goes on reporting."""
    walk = walk_log()
    end_s, radio = float(walk.motion["time_s"].iloc[-1]), walk.radio
    time_s = end_s + 1.0 + np.arange(STOOD)
    still = {"time_s": time_s, "step_m": 0.0, "heading_rad": np.nan, "turn_rad": 0.0}
    last = radio[radio["time_s"] == radio["time_s"].max()]
    again = pd.concat([last.assign(time_s=moment) for moment in time_s])
    return make_log(
        walk.crs,
        motion=pd.concat([walk.motion, pd.DataFrame(still)]),
        radio=pd.concat([radio, again]),
    )


def test_a_belief_that_stays_is_summarised_once(positioner, log, monkeypatch):
    counts = []
    tail = outputs.sample_tail
    monkeypatch.setattr(
        outputs, "sample_tail", lambda *args, **more: counts.append(1) or tail(*args, **more)
    )
    estimate = locate(log, positioner, np.random.default_rng(3)).estimate
    assert len(estimate) > STOOD
    assert len(counts) <= len(estimate) - STOOD + 2


def test_what_is_reported_is_what_a_new_summary_says(positioner, log):
    rng, other = np.random.default_rng(3), np.random.default_rng(3)
    state = again = positioner.begin()
    for epoch in epochs(log):
        state, output = positioner.step(state, epoch, rng)
        again, afresh = positioner.step(replace(again, reported=None), epoch, other)
        for name in ("time_s", "east_m", "protection_m", "radius_99_m", "status", "reason"):
            found, expected = getattr(output.fix, name), getattr(afresh.fix, name)
            assert found == expected or (found != found and expected != expected), name
        assert output.unused == afresh.unused
        np.testing.assert_equal(output.evidence, afresh.evidence)


def test_equal_rows_of_reports_are_one_object(log):
    rows = [row for epoch in epochs(log)[-STOOD:] for row in epoch.radio]
    assert len({id(row) for row in rows}) == len(set(map(repr, rows))) < len(rows)


def test_a_state_does_not_grow_while_one_stands(positioner, log):
    rng, state, sizes = np.random.default_rng(3), positioner.begin(), []
    merged = epochs(log)
    for number, epoch in enumerate(merged, 1):
        state, _ = positioner.step(state, epoch, rng)
        if len(merged) - number in (3 * STOOD // 4, 0):
            sizes.append(len(pickle.dumps(state)))
    assert len(sizes) == 2
    assert sizes[1] <= sizes[0] + 200
