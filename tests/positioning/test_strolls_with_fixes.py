"""A stroll whose positions are measured: levels that deviate put no doubt on its slow steps."""

import numpy as np
import pandas as pd
import pytest
from made_town import Town, walk_log

from mapfilter.filters.contract import Reason, Status
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.merging import epochs
from mapfilter.tracks.log import make_log

TOWN = Town.of(1)
AREA = BayesFilter().over_area(TOWN.area())
FAST_ROWS, SLOW_ROWS, SLOWER, ROW_S, FIX_S, FIX_M = 60, 20, 6, 4.0, 8.0, 4.0


def strolled(seed, wild_db, *, fixes=True):
    """Return a walk that is six times slower from ``FAST_ROWS`` on, and when it begins to be.

    Levels deviate anew every 5 m, and a position is measured every 8 s.
    """
    log, rng = walk_log(TOWN, seed), np.random.default_rng(seed)
    path, heard = (
        log.truth[["east_m", "north_m"]].to_numpy(),
        dict(list(log.radio.groupby("time_s"))),
    )
    now_s, motion, radio, truth = 0.0, [], [], [(0.0, *path[0])]

    def hear(row, wild):
        if float(row) in heard:
            report = heard[float(row)]
            level_dbm = report["level_dbm"] + wild + rng.normal(0, 2.0, len(report))
            radio.append(report.assign(time_s=now_s, level_dbm=level_dbm))

    for row in range(FAST_ROWS + SLOW_ROWS):
        parts = SLOWER if row >= FAST_ROWS else 1
        wild = [rng.normal(0, wild_db, len(heard.get(float(row + k), ()))) for k in (0, 1)]
        for part in range(1, parts + 1):
            now_s += ROW_S
            step = log.motion.iloc[row]
            motion.append((now_s, step["step_m"] / parts, step["heading_rad"]))
            share = part / parts
            truth.append((now_s, *(path[row] + share * (path[row + 1] - path[row]))))
            after = int(share > 0.5)
            hear(row + after, wild[after])
    truth = pd.DataFrame(truth, columns=["time_s", "east_m", "north_m"])
    at = truth[(truth["time_s"] > 0) & (truth["time_s"] % FIX_S == 0)]
    gnss = at.assign(var_east_m2=FIX_M**2, cov_east_north_m2=0.0, var_north_m2=FIX_M**2)
    for name in ("east_m", "north_m"):
        gnss[name] += rng.normal(0, FIX_M, len(at))
    log = make_log(
        log.crs,
        motion=pd.DataFrame(motion, columns=["time_s", "step_m", "heading_rad"]),
        radio=pd.concat(radio),
        gnss=gnss if fixes else None,
        truth=truth,
        start_utc_s=1.7e9,
    )
    return log, FAST_ROWS * ROW_S


def followed(seed, wild_db):
    log, slow_s = strolled(seed, wild_db)
    rng, state, rows = np.random.default_rng(seed), AREA.begin(), []
    truth = {name: log.truth[name].to_numpy() for name in ("time_s", "east_m", "north_m")}
    for epoch in epochs(log):
        state, output = AREA.step(state, epoch, rng)
        fix = output.fix
        if fix is None or fix.time_s <= slow_s:
            continue
        off_m = np.hypot(
            fix.east_m - np.interp(fix.time_s, truth["time_s"], truth["east_m"]),
            fix.north_m - np.interp(fix.time_s, truth["time_s"], truth["north_m"]),
        )
        stuck = any(one.reason is Reason.MOTION_STUCK for one in output.unused)
        rows.append((fix.status, off_m, stuck))
    return rows, state


@pytest.mark.parametrize("wild_db", [3.0, 6.0])
def test_a_stroll_with_fixes_is_tracked_though_levels_deviate(wild_db):
    for seed in (1, 4, 6):
        rows, state = followed(seed, wild_db)
        lost = sum(status is Status.LOST for status, _, _ in rows)
        assert lost <= 0.02 * len(rows), (seed, lost)
        assert not any(stuck for _, _, stuck in rows), seed
        assert np.median([off_m for _, off_m, _ in rows]) < 6
        # The usual speed is still that before: the stroll was noticed, and its steps were believed.
        assert state.watch.pace.speed_mps > 1.0
        assert state.watch.pace.recent_mps < 0.3 * state.watch.pace.speed_mps
