"""Reports that repeat themselves on the way: a radio that stands still."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from made_town import CRS, Town, walk_log
from made_watch import STEP, STILL, report, told, walked

from mapfilter.filters.contract import MotionStep, Reason
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.epochs import Epoch
from mapfilter.positioning.loop import locate
from mapfilter.positioning.sensors.watch import SensorWatch
from mapfilter.positioning.sensors.watching import watched
from mapfilter.tracks.log import make_log

TOWN = Town.of(1)
AREA = BayesFilter().over_area(TOWN.area())


def test_a_timing_advance_that_changes_is_no_stale_report():
    rows = report([-80, -85, -90])
    epochs_ = [
        Epoch(float(k), STEP, tuple(replace(row, timing_advance=float(k // 8)) for row in rows))
        for k in range(60)
    ]
    assert {why for _, _, why in told(epochs_)[1]} == {Reason.USED}


@pytest.mark.parametrize(("levels", "least_m", "most_m"), [(1, 60, 70), (3, 20, 26), (7, 20, 26)])
def test_a_report_that_repeats_itself_on_the_way_is_stale(levels, least_m, most_m):
    rows = report(range(-90, -90 + levels))
    _, found = told([Epoch(float(k), STEP, rows) for k in range(80)])
    stale = [k for k, (_, _, why) in enumerate(found) if why is Reason.STALE_RADIO]
    assert least_m < 1.4 * stale[0] < most_m
    assert stale == list(range(stale[0], 80))
    assert all(not found[k][0].radio for k in stale)
    assert found[stale[0] - 1][0].radio == rows


def test_a_report_is_stale_after_as_many_metres_whatever_the_unit_of_steps():
    """Lengths in feet are read in metres; read as metres they would be stale within 7 m."""
    foot_m, rows = 0.3048, report([-90, -91, -92])
    lengths_m, stale_at = {1.0: 1.4, foot_m: 1.4 / foot_m}, {}
    for unit_m, step_m in lengths_m.items():
        watch, reasons = SensorWatch(), []
        for second in range(40):
            epoch = Epoch(float(second), (MotionStep(step_m, 0.0),), rows)
            watch, _, (_, why) = watched(watch, epoch, unit_m)
            reasons.append(why)
        stale_at[unit_m] = reasons.index(Reason.STALE_RADIO)
    assert stale_at[foot_m] == stale_at[1.0] > 10


def test_one_level_that_repeats_every_seven_seconds_of_a_walk_is_stale_within_a_minute():
    step = MotionStep(9.8, 0.0)
    _, found = told([Epoch(7.0 * k, (step,), report([-90])) for k in range(20)])
    stale = [7.0 * k for k, (_, _, why) in enumerate(found) if why is Reason.STALE_RADIO]
    assert 40.0 < stale[0] < 60.0


def test_a_pair_of_equal_reports_far_apart_is_not_stale_yet():
    step = MotionStep(150.0, 0.0)
    _, found = told([Epoch(10.0 * k, (step,), report([-90])) for k in range(4)])
    assert {why for _, _, why in found} == {Reason.USED}


def test_another_level_makes_it_fresh_again_and_rest_never_makes_it_stale():
    rows, other = report([-80, -85, -90]), report([-80, -85, -91])
    moving = [Epoch(float(k), STEP, rows) for k in range(40)]
    _, found = told([*moving, Epoch(40.0, STEP, other), Epoch(41.0, STEP, rows)])
    assert [why for _, _, why in found[39:]] == [Reason.STALE_RADIO, Reason.USED, Reason.USED]
    _, found = told([*walked(), *(Epoch(20.0 + k, STILL, rows) for k in range(600))])
    assert {why for _, _, why in found} == {Reason.USED}
    cells_only = report([np.nan] * 3)
    _, found = told([Epoch(float(k), STEP, cells_only) for k in range(300)])
    assert {why for _, _, why in found} == {Reason.USED}


def test_levels_beyond_the_scale_are_never_stale():
    rows = tuple(replace(row, censored=-1) for row in report([-110.0] * 7))
    _, found = told([Epoch(float(k), STEP, rows) for k in range(300)])
    assert {why for _, _, why in found} == {Reason.USED}


def test_radio_that_stands_still_leaves_dead_reckoning_alone():
    """The radius grows, instead of the belief being held where the radio stood still."""
    log = walk_log(TOWN, 2, error_db=3.0)
    radio = log.radio
    last = radio[radio["time_s"] == 120.0]
    frozen = [last.assign(time_s=float(k)) for k in range(121, 240)]
    radio = pd.concat([radio[radio["time_s"] <= 120.0], *frozen], ignore_index=True)
    log = make_log(CRS, motion=log.motion, radio=radio, truth=log.truth)
    found = locate(log, AREA, np.random.default_rng(2)).estimate
    stale = [one for one in found.unused if one.reason is Reason.STALE_RADIO]
    # 5 m a second, three levels: 0.6 nats each and repeat, so that the fifth repeat is stale.
    assert min(one.time_s for one in stale) == 125.0
    assert {one.kind for one in stale} == {"serving", "neighbour"}
    assert found.reason[-1] is Reason.STALE_RADIO
