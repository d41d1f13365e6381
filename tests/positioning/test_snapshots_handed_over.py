"""Snapshots are handed over as soon as there will be no more of them."""

import time

import numpy as np
import pytest
from cross_world import EAST, NORTH, make_database, walk_log

from mapfilter.filters.contract import Status
from mapfilter.positioning.bayes.area.opened_area import open_area
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.candidate import CandidateFilter
from mapfilter.positioning.loop import locate


class Counter:
    """Counts the epochs that a filter has taken."""

    epochs = 0

    def record(self, *_):
        self.epochs += 1


@pytest.fixture(scope="module")
def database(tmp_path_factory):
    return make_database(tmp_path_factory.mktemp("snapshots"))


def told_by(filter_, log, **given):
    told, counter = [], Counter()

    def note(snapshots, has_evidence):
        told.append((counter.epochs, snapshots, has_evidence))

    found = locate(
        log, filter_, np.random.default_rng(0), recorder=counter, on_snapshots=note, **given
    )
    return told, found, counter.epochs


def test_they_are_handed_over_once_when_the_filter_tracks(database):
    log = walk_log(((EAST, 150.0), (NORTH, 100.0)))
    filter_ = BayesFilter().over_area(open_area(database))
    told, found, epochs = told_by(filter_, log, snapshots=True)
    ((at, snapshots, has_evidence),) = told
    assert snapshots == found.snapshots
    assert len(snapshots) >= 2
    assert has_evidence
    searching = (Status.SEARCHING, Status.CONVERGED)
    first = next(k for k, status in enumerate(found.estimate.status) if status not in searching)
    assert at == first + 1 < epochs


def test_they_are_handed_over_at_the_end_where_it_never_does(database):
    log = walk_log(((EAST, 5.0),))
    filter_ = BayesFilter().over_area(open_area(database))
    ((at, snapshots, _),), found, epochs = told_by(filter_, log, snapshots=True)
    assert at == epochs
    assert snapshots == found.snapshots


def test_nothing_is_handed_over_where_there_are_none(database):
    filter_ = BayesFilter().over_area(open_area(database))
    assert told_by(filter_, walk_log(((EAST, 5.0),)))[0] == []


def test_candidates_have_no_evidence(database):
    log = walk_log(((EAST, 150.0),))
    ((_, _, has_evidence),), found, _ = told_by(
        CandidateFilter().over(database), log, snapshots=True
    )
    assert has_evidence is (found.estimate.evidence is not None) is False


def test_its_time_is_not_that_of_the_filter(database, monkeypatch):
    log = walk_log(((EAST, 150.0), (NORTH, 100.0)))
    filter_ = BayesFilter().over_area(open_area(database))
    clock = [0.0]
    monkeypatch.setattr(time, "process_time", lambda: clock[0])

    def slow(*_):
        clock[0] += 10.0

    found = locate(log, filter_, np.random.default_rng(0), snapshots=True, on_snapshots=slow)
    assert clock == [10.0]
    assert found.filter_s == 0.0
