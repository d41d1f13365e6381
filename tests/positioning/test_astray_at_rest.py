"""Positions that contradicted the belief on the way show nothing of the rest that follows."""

from functools import cache

import numpy as np
import pandas as pd
import pytest
from made_town import CRS, Town, walk_log

from mapfilter.filters.contract import MotionStep, Reason, Status
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.epochs import Epoch, GnssFix
from mapfilter.positioning.loop import locate
from mapfilter.positioning.sensors.watch import SensorWatch
from mapfilter.positioning.sensors.watching import watched
from mapfilter.tracks.log import make_log


def driven(*, contradicted_s=(), used_s=(), speed_mps=10.0):
    """Return the reasons, by the second, of a drive of 30 s whose positions go on as it stands.

    Positions contradict the belief, or are used, at the times given.
    """
    watch, told = SensorWatch(), {}
    for time_s in range(1, 100):
        fix = GnssFix(5.0 * time_s, 0.1 * (time_s % 7), 25.0, 25.0, 0.0)
        step = MotionStep(speed_mps if time_s <= 30 else 0.0, 0.0)
        watch, _, (told[time_s], _) = watched(watch, Epoch(float(time_s), (step,), gnss=fix))
        if time_s in contradicted_s:
            watch = watch.contradicted()
        if time_s in used_s:
            watch = watch.positioned(float(time_s))
    return set(told.values())


@pytest.mark.parametrize("speed_mps", [1.4, 10.0])
def test_positions_that_contradict_before_a_rest_show_no_way_in_it(speed_mps):
    assert driven(contradicted_s=(20,), speed_mps=speed_mps) == {Reason.USED}
    assert driven(speed_mps=speed_mps) == {Reason.USED, Reason.MOTION_STUCK}


def test_they_do_once_one_was_used_or_where_they_contradict_the_rest():
    assert Reason.MOTION_STUCK in driven(contradicted_s=(20,), used_s=(25,))
    assert Reason.MOTION_STUCK in driven(contradicted_s=(20,), used_s=(50,))
    # A counter that stands still makes good positions contradict the belief, too.
    assert Reason.MOTION_STUCK in driven(contradicted_s=range(32, 100))


def test_without_motion_there_is_no_way_to_contradict():
    watch = SensorWatch(has_motion=False)
    assert watch.contradicted() is watch
    watch, _, _ = watched(watch, Epoch(1.0, gnss=GnssFix(0.0, 0.0, 25.0, 25.0, 0.0)))
    assert watch.contradicted() is watch


TOWN = Town.of(1)
AREA = TOWN.area()
GONE_S, BACK_S, STOP_S, GOES_S = 80.0, 110.0, 125.0, 185.0


def led_away(seed, off_m):
    """Return a drive of 900 m at 5 m/s that waits for a minute.

    Positions are missing for half a minute, and come again so far off, to the side of the next
    street, and lead away by 2 m/s from then on, also while it waits.
    """
    log, waits_s = walk_log(TOWN, seed, 900.0), GOES_S - STOP_S
    tables = {}
    for name in ("motion", "radio", "truth"):
        rows = getattr(log, name)
        late = waits_s * (rows["time_s"] > STOP_S)
        tables[name] = rows.assign(time_s=rows["time_s"] + late)
    rng = np.random.default_rng((seed, 4))
    time_s = np.arange(STOP_S + 1, GOES_S + 1)
    rest = {"time_s": time_s, "step_m": 0.0, "heading_rad": rng.normal(0, 0.02, time_s.size)}
    motion = pd.concat([tables["motion"], pd.DataFrame(rest)]).sort_values("time_s")
    truth = tables["truth"]
    time_s = np.arange(0.0, truth["time_s"].iloc[-1])
    time_s = time_s[(time_s < GONE_S) | (time_s >= BACK_S)]
    away_m = np.where(time_s < BACK_S, 0.0, off_m + 2.0 * (time_s - BACK_S)) / np.sqrt(2)
    place_m = {
        name: np.interp(time_s, truth["time_s"], truth[name])
        + away_m
        + rng.normal(0, 2, away_m.size)
        for name in ("east_m", "north_m")
    }
    variance = {"var_east_m2": 25.0, "var_north_m2": 25.0, "cov_east_north_m2": 0.0}
    gnss = pd.DataFrame({"time_s": time_s, **place_m, **variance})
    return make_log(
        CRS, motion=motion, radio=tables["radio"], gnss=gnss, truth=truth, start_utc_s=1.7e9
    )


@cache
def found(seed, off_m):
    log = led_away(seed, off_m)
    filter_ = BayesFilter(claim_mass=0.95).over_area(AREA)
    estimate = locate(log, filter_, np.random.default_rng(5)).estimate
    east_m, north_m = (np.interp(estimate.time_s, log.truth["time_s"], log.truth[name])
                       for name in ("east_m", "north_m"))  # fmt: skip
    error_m = np.hypot(estimate.east_m - east_m, estimate.north_m - north_m)
    claimed = np.array([one in (Status.TRACKING, Status.CONVERGED) for one in estimate.status])
    return estimate, error_m, claimed


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_who_waits_is_not_led_away_by_them(seed):
    estimate, error_m, claimed = found(seed, 60.0)
    waits = (estimate.time_s > STOP_S) & (estimate.time_s < GOES_S)
    assert claimed[waits].any()
    assert not any(one.reason is Reason.MOTION_STUCK for one in estimate.unused)
    assert not (claimed & (error_m > 50)).any()
