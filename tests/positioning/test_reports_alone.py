"""Logs of cells without motion and positions: what locates them is named, whatever happened."""

from dataclasses import replace
from types import SimpleNamespace

import pytest
from cross_world import CRS, walk_log, walk_tables

import mapfilter as mf
from mapfilter.positioning.log_lacks import follows_positions, is_of_reports_alone

CONVERGED, NEVER = SimpleNamespace(converged_at=3), SimpleNamespace(converged_at=None)


def reports(**tables):
    made = walk_tables()
    return mf.make_log(CRS, radio=made["radio"], truth=made["truth"], **tables)


def test_reports_that_a_filter_started_by_are_no_positions_that_it_followed():
    log = reports()
    for options in (mf.BayesFilter(), mf.GridFilter(), mf.CandidateFilter()):
        assert is_of_reports_alone(log, options, CONVERGED)
        assert not is_of_reports_alone(log, options, NEVER)
        assert not follows_positions(log, options, CONVERGED)
    assert not is_of_reports_alone(log, mf.KalmanFilter(), CONVERGED)
    assert not is_of_reports_alone(walk_log(), mf.BayesFilter(), CONVERGED)
    placed = reports(gnss=log.truth[["time_s", "east_m", "north_m"]])
    assert not is_of_reports_alone(placed, mf.BayesFilter(), CONVERGED)
    assert follows_positions(placed, mf.BayesFilter(), CONVERGED)


@pytest.mark.parametrize(
    ("name", "remedy"),
    [
        ("bayes", "no motion (mf.locate_reports needs none)"),
        ("candidate", "no motion (mf.locate_reports needs none)"),
        ("ekf", "too little was measured (mf.locate_reports locates each report by itself)"),
    ],
)
def test_what_locates_single_reports_is_named(name, remedy, database):
    log = mf.make_log(CRS, radio=walk_tables()["radio"].iloc[:40])
    track = mf.locate(log, database, name)
    assert track.log.notes[-1] == f"nothing is located: {remedy}"


def test_a_log_that_a_filter_started_by_says_so(database, monkeypatch):
    log = reports()
    found = mf.locate(log, database, "candidate").positioned
    begun = replace(found, estimate=_converged(found.estimate))
    monkeypatch.setattr("mapfilter.positioning.loop.locate", lambda *_, **__: begun)
    told = "no motion and no positions: a track needs one of them (mf.locate_reports locates each"
    assert mf.locate(log, database, "candidate").log.notes[-1].startswith(told)


def _converged(estimate):
    status = [mf.Status.CONVERGED, *[mf.Status.LOST] * (len(estimate) - 1)]
    return replace(estimate, status=type(estimate.status)(status))
