"""Fixes that err to the same side for a while, as positions from Wi-Fi scans do."""

import numpy as np
import pandas as pd
import pytest

import mapfilter as mf
from mapfilter.evaluation.accuracy import Truth, position_errors_m
from mapfilter.models.state import MOVING, POSITION
from mapfilter.positioning.filter import locate
from mapfilter.positioning.fingerprints.lasting import fit_lasting
from mapfilter.positioning.kalman.belief import SumBelief
from mapfilter.positioning.kalman.filter import KalmanFilter
from mapfilter.positioning.kalman.lasting import (
    extended_belief,
    extended_layout,
    extended_motion,
    fix_layout,
    white_part,
)
from mapfilter.radio.cells import CellPlan

CRS = "EPSG:32635"
ORIGIN_M = np.array([385_000.0, 6_672_000.0])
LASTING_M, MEMORY_S, WHITE_M = 6.0, 30.0, 5.0


def _errors_m(count, interval_s, rng):
    kept = np.exp(-interval_s / MEMORY_S)
    lasting = LASTING_M * rng.standard_normal((count, 2))
    for i in range(1, count):
        lasting[i] = kept * lasting[i - 1] + (1 - kept**2) ** 0.5 * lasting[i]
    return lasting + WHITE_M * rng.standard_normal((count, 2))


def _walk(rng, *, reckoned=True):
    """Return a walk of a minute, a step of 0.7 m each half second and a fix each two seconds."""
    time_s = 0.5 * np.arange(121)
    heading_rad = np.cumsum(rng.normal(0, 0.1, 121))
    steps = 0.7 * np.column_stack([np.cos(heading_rad), np.sin(heading_rad)])
    place = ORIGIN_M + np.vstack([[0.0, 0.0], np.cumsum(steps[1:], axis=0)])
    fixed = place[::4] + _errors_m(len(place[::4]), 2.0, rng)
    variance = LASTING_M**2 + WHITE_M**2
    gnss = {
        "time_s": time_s[::4],
        "east_m": fixed[:, 0],
        "north_m": fixed[:, 1],
        "var_east_m2": variance,
        "var_north_m2": variance,
        "cov_east_north_m2": 0.0,
    }
    motion = {"time_s": time_s[1:], "step_m": 0.7, "heading_rad": heading_rad[1:]}
    truth = {"time_s": time_s, "east_m": place[:, 0], "north_m": place[:, 1]}
    tables = {"gnss": gnss, "truth": truth} | ({"motion": motion} if reckoned else {})
    return mf.make_log(CRS, **{name: pd.DataFrame(table) for name, table in tables.items()})


def _share_held(options, walks):
    held = []
    for number, log in enumerate(walks):
        tracker = options.over_sites(CellPlan(CRS, ()))
        found = locate(log, tracker, np.random.default_rng(number)).estimate
        truth = Truth.of_table(log.truth)
        error_m = position_errors_m(found, truth)
        known = np.isfinite(error_m)
        held.append((error_m <= found.radii_m[:, 2])[known])
    return float(np.mean(np.concatenate(held)))


@pytest.mark.parametrize("smooth", [False, True])
def test_radii_hold_where_errors_of_fixes_last(smooth):
    rng = np.random.default_rng(3)
    walks = [_walk(rng) for _ in range(20)]
    white = _share_held(KalmanFilter(smooth=smooth), walks)
    lasting = KalmanFilter(smooth=smooth, fix_lasting_m=LASTING_M, fix_lasting_s=MEMORY_S)
    assert white < 0.7
    assert 0.9 < _share_held(lasting, walks) < 0.99


def test_radii_hold_without_dead_reckoning():
    rng = np.random.default_rng(4)
    walks = [_walk(rng, reckoned=False) for _ in range(20)]
    lasting = KalmanFilter(fix_lasting_m=LASTING_M, fix_lasting_s=MEMORY_S)
    assert _share_held(KalmanFilter(), walks) < 0.88
    assert _share_held(lasting, walks) > 0.9


@pytest.mark.parametrize("layout", [POSITION, MOVING])
def test_without_time_the_place_of_fixes_moves_with_the_position(layout):
    n = layout.size
    first = SumBelief.start(np.arange(n, dtype=float), np.eye(n))
    wide = extended_belief(first, layout, 6.0)
    where = [layout.east, layout.north]
    assert wide.means[0, -2:].tolist() == first.means[0, where].tolist()
    off = wide.covariances[0][-2:, -2:] - wide.covariances[0][np.ix_(where, where)]
    assert off.tolist() == [[36.0, 0.0], [0.0, 36.0]]
    shift = np.zeros(n)
    shift[where] = 3.0, 4.0
    moved = wide.predict(
        *extended_motion((np.eye(n), np.zeros((n, n)), shift), layout, 6.0, 30.0, 0.0)
    )
    assert (moved.means - wide.means)[0, [*where, -2, -1]].tolist() == [3.0, 4.0, 3.0, 4.0]
    assert moved.covariances == pytest.approx(wide.covariances)
    seen = fix_layout(extended_layout(layout))
    assert (seen.size, seen.east, seen.north) == (n + 2, n, n + 1)


def test_after_long_the_error_is_as_before_any_fix():
    motion = (np.eye(2), np.zeros((2, 2)), np.zeros(2))
    first = SumBelief.start([0.0, 0.0], np.eye(2))
    wide = extended_belief(first, POSITION, 6.0)
    later = wide.predict(*extended_motion(motion, POSITION, 6.0, 30.0, 1e4))
    assert later.covariances == pytest.approx(wide.covariances)


def test_of_each_fix_some_noise_stays_white():
    assert white_part(np.eye(2), 100.0) == pytest.approx(0.3 * np.eye(2))


def test_what_lasts_is_found_in_the_errors():
    rng = np.random.default_rng(5)
    off_m = np.vstack([_errors_m(100, 2.0, rng) for _ in range(40)])
    log = np.repeat(np.arange(40), 100)
    found = fit_lasting(log, np.tile(2.0 * np.arange(100), 40), off_m)
    assert found.sd_m == pytest.approx(LASTING_M, rel=0.15)
    assert found.memory_s == pytest.approx(MEMORY_S, rel=0.35)


def test_independent_errors_do_not_last():
    rng = np.random.default_rng(6)
    log, time_s = np.repeat(np.arange(40), 100), np.tile(2.0 * np.arange(100), 40)
    assert fit_lasting(log, time_s, 5.0 * rng.standard_normal((4000, 2))).sd_m < 1.5


def test_few_errors_tell_nothing():
    assert fit_lasting(np.zeros(3, int), np.arange(3.0), np.ones((3, 2))) is None
    assert fit_lasting(np.zeros(0, int), np.zeros(0), np.zeros((0, 2))) is None
