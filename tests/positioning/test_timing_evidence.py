"""Timing advances and time differences as evidence of places, by hand-worked numbers."""

from dataclasses import replace
from math import inf, nan

import numpy as np
import pandas as pd
import pytest
from cross_world import CRS, LATTICE, make_database, walk_log

from mapfilter.filters.contract import Reason
from mapfilter.positioning.bayes.area.opened_area import open_area
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.bayes.sources.evidence import EvidenceUpdate
from mapfilter.positioning.bayes.sources.timing import TimingSource, TimingState
from mapfilter.positioning.epochs import Difference, Epoch, ReportRow
from mapfilter.positioning.gnss.options import TimingOptions
from mapfilter.positioning.loop import locate
from mapfilter.tracks.log import make_log

LTE = TimingOptions(step_m=78.1, advance_sd_m=30.0, advance_memory_m=50.0)
WEST, SOUTH, *_ = LATTICE.bounds_m


@pytest.fixture(scope="module")
def area(tmp_path_factory):
    return open_area(make_database(tmp_path_factory.mktemp("timing")))


def state(*places):
    found = np.zeros((5, len(places)), dtype=np.float32)
    found[:2] = np.array(places).T
    return found


def read(area, epoch, before=(), travelled_m=0.0, options=LTE):
    return TimingSource(area, options).read(TimingState(*before), epoch, travelled_m)


def test_a_timing_advance_is_a_ring(area):
    epoch = Epoch(0.0, radio=(ReportRow("serving", "W", None, None, nan, 0, 1.0),))
    update = read(area, epoch)
    assert (update.state, update.unused) == (TimingState(0.0), [])
    # Cell W stands at (0, 150) and 28.5 m above the phone: 1.5 steps are 117.15 m.
    places = state((100.0, 150.0), (0.0, 263.6), (300.0, 150.0))
    gain = update.terms[0].log_likelihood(places)
    sigma = np.hypot(30.0, 78.1 / 12**0.5)
    away = np.hypot([100.0, 113.6, 300.0], 28.5)
    expected = -0.5 * np.minimum(((117.15 - away) / sigma) ** 2, 9.0)
    np.testing.assert_allclose(gain, expected, atol=1e-6)
    # Under the null hypothesis half as bad again as is expected at the true position.
    assert update.under_null == pytest.approx(-0.75)


def test_errors_that_last_count_once(area):
    epoch = Epoch(0.0, radio=(ReportRow("serving", "W", None, None, nan, 0, 1.0),))
    soon = read(area, epoch, (0.0, -inf), 5.0)
    place = state((300.0, 150.0))
    whole = read(area, epoch).terms[0].log_likelihood(place)
    share = 1 - np.exp(-2 * 5.0 / 50.0)
    np.testing.assert_allclose(soon.terms[0].log_likelihood(place), share * whole)
    still = read(area, epoch, (0.0, -inf), 0.0)
    assert (still.terms, still.under_null) == ((), 0)
    assert still.state == TimingState(0.0)


def timed(cell, steps):
    return ReportRow("serving", cell, None, None, nan, 0, steps)


def test_advances_of_one_report_are_one_term_beside_rows_without_any(area):
    epoch = Epoch(0.0, radio=(timed("W", nan), timed("E", 2.0), timed(None, 3.0), timed("W", 1.0)))
    update = read(area, epoch, (10.0, 20.0), 20.0)
    assert (update.state, update.unused) == (TimingState(20.0, 20.0), [])
    (term,) = update.terms
    # The middles of their steps; what is new of them after 10 m.
    np.testing.assert_allclose(term.reading_m, [2.5 * 78.1, 1.5 * 78.1])
    assert term.weight == pytest.approx(1 - np.exp(-2 * 10.0 / 50.0))
    # Two readings: half as bad again as is expected at the true position.
    assert update.under_null == pytest.approx(-0.5 * 1.5 * 2 * term.weight)
    # As far off as 3 deviations each, and no more.
    far = term.log_likelihood(state((5000.0, 5000.0)))
    np.testing.assert_allclose(far, -0.5 * 2 * 9.0 * term.weight)
    assert TimingSource(area, LTE).first(epoch).state == TimingState(0.0)
    # A measured map of timing advances stands in for distances.
    without = TimingSource(area, LTE, advances=False).read(TimingState(), epoch, 20.0)
    assert (without.terms, without.state) == ((), TimingState())


def test_differences_count_by_what_is_new_of_them(area):
    rows = (Difference("E", "W", 120.0, 5.0, 8.0), Difference("W", "E", -115.0, 5.0, 8.0))
    options = replace(LTE, difference_memory_m=20.0)
    update = read(area, Epoch(0.0, tdoa=rows), (7.0, 30.0), 34.0, options)
    assert update.state == TimingState(7.0, 34.0)
    share = 1 - np.exp(-2 * 4.0 / 20.0)
    assert [term.weight for term in update.terms] == pytest.approx([share] * 2)
    assert [term.reading_m.tolist() for term in update.terms] == [[120.0], [-115.0]]
    # Nothing of them is new where they were used.
    same = read(area, Epoch(0.0, tdoa=rows), (7.0, 34.0), 34.0, options)
    assert (same.terms, same.state) == ((), TimingState(7.0, 34.0))


def test_deviations_that_are_not_stated_are_the_usual_ones(area):
    """30 m of each time of arrival, as a distance."""
    options = replace(LTE, difference_sd_m=30.0)
    usual = read(area, Epoch(0.0, tdoa=(Difference("E", "W", 120.0),)), options=options)
    np.testing.assert_allclose(usual.terms[0].model.noise, [[2 * 30.0**2]])
    stated = Difference("E", "W", 120.0, 5.0, 8.0)
    found = read(area, Epoch(0.0, tdoa=(stated,)), options=options)
    np.testing.assert_allclose(found.terms[0].model.noise, [[5.0**2 + 8.0**2]])


def test_differences_share_the_error_of_their_reference(area):
    rows = (Difference("E", "W", 120.0, 5.0, 8.0), Difference("NW", "W", -40.0, 12.0, 8.0))
    update = read(area, Epoch(0.0, tdoa=rows))
    assert (update.state, update.unused) == (TimingState(-inf, 0.0), [])
    place = state((150.0, 150.0))
    sites = np.array([[400.0, 150.0], [0.0, 300.0]])
    away = np.sqrt(np.sum((sites - 150.0) ** 2, axis=1) + 28.5**2)
    off = np.array([120.0, -40.0]) - (away - np.hypot(150.0, 28.5))
    noise = np.diag([25.0, 144.0]) + 64.0
    (term,) = update.terms
    assert term.stations == ("W", "E", "NW")
    np.testing.assert_allclose(term.sigma_m, [8.0, 5.0, 12.0])
    stated = next(case for case in term.cases if case.factor == 1.0 and case.at_fault is None)
    density = term.log_densities(place)[term.cases.index(stated)]
    square = float(off @ np.linalg.solve(noise, off))
    np.testing.assert_allclose(density, -0.5 * min(square, 2 * 9.0), rtol=1e-5)


def test_readings_of_unknown_cells_are_reported_unused(area):
    rows = (
        Difference("E", "??", 10.0), Difference("E", "W", nan), Difference("E", "W", 3.0),
        Difference("E", "W", 4.0), Difference("W", "W", 0.0),
    )  # fmt: skip
    heard = (ReportRow("serving", "??", None, None, nan, 0, 2.0),)
    update = read(area, Epoch(0.0, radio=heard, tdoa=rows))
    assert len(update.terms) == 1
    assert [(u.kind, u.what, u.reason) for u in update.unused] == [
        ("ta", "??", Reason.UNKNOWN_CELL),
        ("tdoa", "??", Reason.UNKNOWN_CELL),
        ("tdoa", "E", Reason.SECOND_READING),
    ]
    untimed = Epoch(0.0, radio=(ReportRow("serving", "W", None, None, nan, 0),))
    assert read(area, untimed) == EvidenceUpdate(TimingState(), unused=[])


def test_times_of_arrival_shorten_the_search(area):
    log = walk_log()
    sites = {"W": (WEST, SOUTH + 150), "E": (LATTICE.bounds_m[2], SOUTH + 150),
             "NW": (WEST, LATTICE.bounds_m[3])}  # fmt: skip
    away = {
        cell: np.sqrt((log.truth["east_m"] - x) ** 2 + (log.truth["north_m"] - y) ** 2 + 28.5**2)
        for cell, (x, y) in sites.items()
    }
    rng = np.random.default_rng(0)
    rows = [
        pd.DataFrame({"time_s": log.truth["time_s"], "cell": cell, "reference": "W",
                      "difference_m": away[cell] - away["W"] + rng.normal(0, 8, len(log.truth)),
                      "sigma_m": 6.0, "reference_sigma_m": 6.0})
        for cell in ("E", "NW")
    ]  # fmt: skip
    with_them = replace(log, tdoa=make_log(CRS, tdoa=pd.concat(rows)).tdoa)
    few = BayesFilter(max_particles=2000, min_search_particles=1000, min_particles=300)
    positioner = few.over_area(area)
    switch = [
        locate(one, positioner, np.random.default_rng(1)).estimate.converged_at
        for one in (log, with_them)
    ]
    assert switch[1] is not None
    assert switch[1] < 0.8 * (switch[0] or len(log.truth))
