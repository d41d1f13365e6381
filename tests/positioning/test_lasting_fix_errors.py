"""Fixes that err to the same side for a while, as positions from Wi-Fi scans do."""

import tracemalloc
from itertools import permutations

import numpy as np
import pandas as pd
import pytest

import mapfilter as mf
from mapfilter.evaluation.accuracy import position_errors_m
from mapfilter.evaluation.truth import Truth
from mapfilter.models.state import MOVING, POSITION
from mapfilter.positioning.fingerprints.lasting import _lag_sums, _stretches, fit_lasting
from mapfilter.positioning.fingerprints.reports import make_reports
from mapfilter.positioning.kalman.belief import SumBelief
from mapfilter.positioning.kalman.filter import KalmanFilter
from mapfilter.positioning.kalman.lasting import (
    extended_belief,
    extended_layout,
    extended_motion,
    fix_layout,
    white_part,
)
from mapfilter.positioning.loop import locate
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
    independent = KalmanFilter(smooth=smooth, fix_lasting_share=0.0)
    lasting = KalmanFilter(smooth=smooth, fix_lasting_m=LASTING_M, fix_lasting_s=MEMORY_S)
    assert _share_held(independent, walks) < 0.7
    assert _share_held(lasting, walks) > 0.9
    assert _share_held(KalmanFilter(smooth=smooth), walks) > 0.95


def test_radii_hold_without_dead_reckoning():
    rng = np.random.default_rng(4)
    walks = [_walk(rng, reckoned=False) for _ in range(20)]
    lasting = KalmanFilter(fix_lasting_m=LASTING_M, fix_lasting_s=MEMORY_S)
    assert _share_held(KalmanFilter(fix_lasting_share=0.0), walks) < 0.88
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
    seen = fix_layout(extended_layout(layout), n)
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


def test_pairs_within_the_longest_time_are_those_of_all_readings():
    """Against every pair of a log; times are uneven, unsorted and partly equal."""
    rng = np.random.default_rng(8)
    log = rng.integers(0, 3, 600)
    time_s = np.round(rng.uniform(0, 900, 600))
    off_m = rng.normal(0, 5, (600, 2)) + 6 * np.sin(time_s / 40)[:, None]
    order = np.lexsort((time_s, log))
    total, pairs = 0.0, 0
    for i, j in permutations(range(600), 2):
        if log[i] == log[j] and 0 < time_s[i] - time_s[j] < 60:
            total, pairs = total + off_m[i] @ off_m[j] / 2, pairs + 1
    sums = _lag_sums(log, time_s, off_m)
    assert int(sums.counts.sum()) == pairs
    assert sums.products.sum() == pytest.approx(total)
    again = _lag_sums(log[order], time_s[order], off_m[order])
    for one, other in zip(sums, again, strict=True):
        np.testing.assert_allclose(one, other)


def test_a_long_log_needs_no_table_of_all_pairs():
    count = 6000
    off_m = np.random.default_rng(1).normal(0, 5, (count, 2))
    tracemalloc.start()
    try:
        fit_lasting(np.zeros(count, int), 2.0 * np.arange(count), off_m)
        peak_bytes = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak_bytes < 5e6


def _logs(*lengths):
    """Return a database of logs, a report each second, in no order."""
    block = np.repeat(np.arange(len(lengths)), lengths)
    time_s = np.concatenate([np.arange(length) for length in lengths])
    shuffled = np.random.default_rng(4).permutation(len(block))
    return make_reports(
        "EPSG:32635", [], [], [], count=len(block), block=block[shuffled], time_s=time_s[shuffled]
    )


@pytest.mark.parametrize(
    ("lengths", "expected"),
    [
        ((50, 60), {0: 50, 1: 60}),
        ((9000,), {0: 2000}),
        ((9000, 100, 100, 100), {0: 500, 1: 100, 2: 100, 3: 100}),
        ((150,) * 60, {3 * i: 100 for i in range(20)}),
        ((50,) * 80, {2 * i: 50 for i in range(40)}),
        ((9000,) * 3, dict.fromkeys(range(3), 666)),
    ],
)
def test_a_stretch_of_each_log_is_taken_from_its_middle(lengths, expected):
    database = _logs(*lengths)
    taken = database.some(_stretches(database, 2000))
    logs, counts = np.unique(taken.block, return_counts=True)
    assert dict(zip(logs.tolist(), counts.tolist(), strict=True)) == expected
    for one, count in expected.items():
        time_s = np.sort(taken.time_s[taken.block == one])
        # Neighbours stay neighbours, and as much is left out before as after.
        assert np.diff(time_s).tolist() == [1.0] * (count - 1)
        assert abs(time_s[0] - (lengths[one] - 1 - time_s[-1])) <= 1
