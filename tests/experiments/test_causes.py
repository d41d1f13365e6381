"""Causes of the worst stretch of a journey are found in what was recorded."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from walked_line import estimate, line, truth_of

from mapfilter.experiments.benchmarks.causes import causes_of, turning_deg
from mapfilter.experiments.benchmarks.worst_run import explain
from mapfilter.filters.contract import Reason
from mapfilter.positioning.estimate import TrackEvidence
from mapfilter.positioning.step_output import UnusedReading

COUNT = 60


def _journey(statuses="S" * 5 + "C" + "T" * (COUNT - 6), errors_m=60.0, reasons=None, **more):
    table = line(COUNT - 1)
    found = estimate(table, statuses, errors_m)
    if reasons is not None:
        found = replace(found, reason=tuple(reasons))
    return replace(found, **more), truth_of(table)


def _causes(found, truth, map_m=None):
    return causes_of(found, truth, explain(found, truth), map_m)


def test_a_straight_way_without_turns():
    causes = _causes(*_journey())
    assert causes == ("no corner: the way turns by 0° over 590 m",)


def test_a_way_off_the_map():
    found, truth = _journey()
    beside = np.column_stack([truth.east_m, truth.north_m + 20.0])
    assert not any("off the map" in one for one in _causes(found, truth, beside))
    half = beside[: COUNT // 2]
    (first, *_) = _causes(found, truth, half)
    assert first.startswith("off the map: 4")


@pytest.mark.parametrize(
    ("reason", "words"),
    [
        (Reason.STALE_RADIO, "radio frozen: 100 % of the reports are stale"),
        (Reason.UNKNOWN_CELL, "the database does not have the serving cell of 100 %"),
        (Reason.MOTION_STUCK, "motion missing or stuck in 100 % of the epochs"),
    ],
)
def test_reasons_of_the_epochs(reason, words):
    causes = _causes(*_journey(reasons=[reason] * COUNT))
    assert any(one.startswith(words) for one in causes)
    assert not any(one.startswith(words) for one in _causes(*_journey()))


def test_epochs_without_a_report_do_not_count():
    reasons = [Reason.STALE_RADIO if i % 9 == 0 else Reason.NO_READING for i in range(COUNT)]
    causes = _causes(*_journey(reasons=reasons))
    assert "radio frozen: 100 % of the reports are stale" in causes
    assert not any(
        "radio" in one for one in _causes(*_journey(reasons=[Reason.NO_READING] * COUNT))
    )


def test_readings_that_were_not_used_in_the_stretch_alone():
    # Wrong from 50 s on; looked at are 200 m before, which is from 30 s on.
    errors_m = np.where(np.arange(COUNT) >= 50, 60.0, 5.0)
    silent = [Reason.USED] * 30 + [Reason.NO_READING] * (COUNT - 30)
    assert any(
        "no radio reading was used" in one
        for one in _causes(*_journey(errors_m=errors_m, reasons=silent))
    )
    never = [Reason.NO_READING] * COUNT
    assert not any(
        "radio reading" in one for one in _causes(*_journey(errors_m=errors_m, reasons=never))
    )


def test_fixes_that_are_off_themselves():
    found, truth = _journey()
    fixes = np.column_stack([truth.time_s, truth.east_m, truth.north_m + 40.0])[::10]
    story = explain(found, truth)
    causes = causes_of(found, truth, story, None, fixes)
    assert "the 6 fixes there are themselves 40 m off (median)" in causes
    assert "the only fix there is itself 40 m off" in causes_of(
        found, truth, story, None, fixes[:1]
    )
    right = fixes - [0.0, 0.0, 30.0]
    assert not any("fixes" in one for one in causes_of(found, truth, story, None, right))


def test_satellites_that_contradict():
    unused = tuple(
        UnusedReading(float(t), "pseudorange", name, Reason.REJECTED_BY_EVIDENCE)
        for t in (10, 11)
        for name in ("G01", "G02")
    )
    causes = _causes(*_journey(unused=unused))
    assert "fixes or satellites contradict the belief and were rejected at 2 moments" in causes


def test_an_error_along_the_way_and_another_place():
    found, truth = _journey(errors_m=0.0)
    ahead = replace(found, east_m=found.east_m + 40.0)
    assert any("the error is along the way (40 of 40 m)" in one for one in _causes(ahead, truth))
    aside = replace(found, north_m=found.north_m + 40.0)
    assert not any("along" in one for one in _causes(aside, truth))
    numbers = np.full(COUNT, 0.2)
    evidence = TrackEvidence(numbers, numbers, numbers, numbers, numbers)
    causes = _causes(replace(found, evidence=evidence), truth)
    assert "ambiguous: another place has 20 % of the belief" in causes


def test_a_short_way_that_was_never_claimed():
    table = line(20)
    found = estimate(table, "S" * 21, 100.0)
    causes = _causes(found, truth_of(table))
    assert "short: 200 m in all" in causes


def test_turns_are_summed_over_legs():
    east = np.concatenate([np.arange(0.0, 200.0, 5), np.full(40, 200.0)])
    north = np.concatenate([np.zeros(40), np.arange(0.0, 200.0, 5)])
    table = pd.DataFrame({"time_s": np.arange(80.0), "east_m": east, "north_m": north})
    assert turning_deg(truth_of(table), np.array([0.0, 79.0])) == pytest.approx(90.0, abs=1.0)


def test_two_legs_have_a_turn_and_one_has_none():
    """20 m east and 40 m north at 10 m/s; the times end after 60, 40, 20 and 0 m."""
    table = line(6)
    table["east_m"] = np.minimum(table["east_m"], 20.0)
    table["north_m"] = np.maximum(10.0 * table["time_s"] - 20.0, 0.0)
    turned = [turning_deg(truth_of(table), np.array([0.0, last_s])) for last_s in (6, 4, 2, 0)]
    np.testing.assert_allclose(turned, [90.0, 0.0, 0.0, 0.0], atol=1e-9)
