"""Which run of a case is the worst, and what is said about it."""

from dataclasses import replace

import numpy as np
from walked_line import estimate, line, truth_of

from mapfilter.experiments.benchmarks.worst_run import explain, worst_row
from mapfilter.positioning.estimate import TrackEvidence


def row(route, **changed):
    usual = {"claimed": 100, "within_50m": 100, "worst_100m_m": 9.0, "switch_m": 90.0}
    return usual | {"route": route} | changed


def story(statuses, errors_m, **more):
    table = line(len(statuses) - 1)
    return explain(estimate(table, statuses, errors_m, **more), truth_of(table))


def test_most_wrong_claims_are_the_worst():
    rows = [
        row(0, worst_100m_m=500.0),
        row(1, within_50m=90, worst_100m_m=60.0),
        row(2, within_50m=80, worst_100m_m=55.0),
        row(3, claimed=0, within_50m=0, worst_100m_m=None, switch_m=None),
    ]
    assert worst_row(rows)["route"] == 2
    assert worst_row(rows[:1] + rows[3:])["route"] == 3
    assert worst_row([row(0), row(1, worst_100m_m=30.0), row(2)])["route"] == 1
    # Of equal runs the first.
    assert worst_row([row(4), row(5)])["route"] == 4


def test_a_wrong_place_from_the_start():
    found = story("SSCTTT", [900, 900, 300, 320, 310, 5], levels_m=40.0)
    assert (found.index, found.first, found.last) == (3, 2, 4)
    assert found.what == "a wrong place was claimed (CONVERGED after SEARCHING)"
    assert found.reason.startswith("More than 50 m off from 2 s to 4 s (2 s); then within 50 m")
    assert "Worst at 3 s, after 30 m: TRACKING, 320 m off." in found.reason
    assert "95 % within 30 m" in found.reason
    assert "protection level 40 m" in found.reason


def test_a_position_that_went_astray_until_it_was_lost():
    found = story("SCTTTLL", [900, 5, 30, 60, 90, 90, 90], levels_m=np.inf)
    assert (found.index, found.first, found.last) == (4, 3, 4)
    assert found.what == "the position went astray while TRACKING"
    assert "; then LOST." in found.reason
    assert "protection level none" in found.reason


def test_a_wrong_place_after_lost_and_to_the_end():
    found = story("CTLTTT", [5, 5, 5, 70, 80, 60])
    assert found.what == "a wrong place was claimed (TRACKING after LOST)"
    assert "it lasted to the end" in found.reason
    assert "protection" not in found.reason


def test_a_run_without_wrong_claims():
    found = story("SCTT", [900, 5, 12, 3])
    assert (found.index, found.first, found.last) == (2, 2, 2)
    assert found.what == "no claim is more than 50 m off"
    assert found.reason.startswith("Worst at 2 s, after 20 m: TRACKING, 12 m off.")


def test_a_run_that_never_claimed_a_position():
    table = line(3)
    searched = estimate(table, "SSSL", 400.0)
    flat = np.full(4, 6.0)
    evidence = TrackEvidence(
        searched.east_m + 30.0, searched.north_m + 40.0, np.full(4, 0.25), flat, flat
    )
    found = explain(replace(searched, evidence=evidence), truth_of(table))
    assert found.what == "no position was ever claimed"
    assert found.index == 3
    assert "LOST, leading hypothesis 400 m off, the belief covers 40000 m²." in found.reason
    assert "runner-up 25.0 %, 50 m away" in found.reason


def test_epochs_outside_the_truth_are_no_run():
    table = line(3)
    assert explain(estimate(table, "CT", 5.0, time_s=[50.0, 51.0]), truth_of(table)) is None


def test_another_city_is_kilometres_off():
    assert "Worst at 1 s, after 10 m: TRACKING, 50 km off." in story("CT", [50_000, 50_100]).reason
