"""Logs and sessions in which nothing ever measures motion."""

from dataclasses import replace
from math import inf

import numpy as np
import pandas as pd
import pytest
from block_town import CRS as BLOCKS_CRS
from block_town import LATTICE, STEP_S, drive
from block_town import make_town as make_blocks
from hypothesis import given
from hypothesis import strategies as st
from made_town import CRS, Town, slowed, walk_log

from mapfilter.database.build import build_roads
from mapfilter.database.sources import LayerRoutes
from mapfilter.filters.contract import Reason, Status
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.epochs import GnssFix
from mapfilter.positioning.gnss.fixes import repeated
from mapfilter.positioning.loop import locate
from mapfilter.positioning.merging import epochs
from mapfilter.roads.route_points import RouteSource
from mapfilter.tracks.log import make_log

TOWN, BLOCKS = Town.of(1), make_blocks(5)
AREA = BayesFilter().over_area(TOWN.area())
CLAIMED = (Status.CONVERGED, Status.TRACKING)
PLACE = ("east_m", "north_m")


def fixes_of(truth, sd_m, seed):
    """Return positions that err independently."""
    noise_m = np.random.default_rng(seed).normal(0, sd_m, (2, len(truth)))
    return truth.assign(
        east_m=truth["east_m"] + noise_m[0],
        north_m=truth["north_m"] + noise_m[1],
        var_east_m2=sd_m**2,
        cov_east_north_m2=0.0,
        var_north_m2=sd_m**2,
    )


def walked(seed, *, every=1, sd_m=3.0, until_s=inf, radio=False):
    """Return a walk without motion rows; truth is known each 4 s."""
    log = slowed(walk_log(TOWN, seed))
    truth = log.truth
    seen = truth[truth["time_s"] <= until_s].iloc[::every]
    heard = log.radio if radio else None
    return make_log(CRS, radio=heard, gnss=fixes_of(seen, sd_m, seed), truth=truth)


def located(log, filter_=AREA, seed=0):
    """Return errors, radii of 95 % and whether positions are claimed, of those that there are."""
    estimate = locate(log, filter_, np.random.default_rng(seed)).estimate
    truth, at_s = log.truth, estimate.time_s
    east_m, north_m = (np.interp(at_s, truth["time_s"], truth[axis]) for axis in PLACE)
    error_m = np.hypot(estimate.east_m - east_m, estimate.north_m - north_m)
    claimed = np.isin(estimate.status, CLAIMED)
    return at_s, error_m, estimate.radii_m[:, 2], claimed


@pytest.mark.parametrize(("every", "radio"), [(1, False), (5, False), (1, True), (5, True)])
def test_positions_alone_are_followed(every, radio):
    """They were left behind: 200 m off within a radius of 12 m."""
    runs = [located(walked(seed, every=every, radio=radio)) for seed in (2, 3)]
    error_m, radius_m, claimed = (np.concatenate(k) for k in list(zip(*runs, strict=True))[1:])
    assert np.median(error_m) < (6 if every == 1 else 15)
    assert np.mean(error_m <= radius_m) > 0.9
    if not radio or every == 1:
        # Between rare positions reports alone hold the place, which may be off by then.
        assert np.mean(claimed) > 0.9
    assert not (claimed & (error_m > 50)).any()


@pytest.mark.parametrize("vehicle", [False, True])
def test_a_drive_is_followed_by_its_positions(tmp_path, vehicle):
    """At 8 m/s, over streets without any cells."""
    source = LayerRoutes(RouteSource.of(BLOCKS.ways, None, None, 6.0), LATTICE)
    database = build_roads(source, tmp_path / "database")
    path_m = drive(BLOCKS, 3, 1600.0)[:: round(1 / STEP_S)]
    truth = pd.DataFrame(path_m, columns=["east_m", "north_m"])
    truth.insert(0, "time_s", np.arange(len(truth), dtype=float))
    log = make_log(BLOCKS_CRS, gnss=fixes_of(truth, 4.0, 1), truth=truth)
    _, error_m, radius_m, claimed = located(log, BayesFilter(vehicle=vehicle).over(database))
    assert np.median(error_m) < 8
    assert np.mean(error_m <= radius_m) > 0.85
    assert claimed.mean() > 0.8
    assert not (claimed & (error_m > 50)).any()


@pytest.mark.parametrize("every", [1, 5])
def test_a_session_follows_positions_while_no_motion_comes(every):
    """Nobody states there that none will: positions that leave the first one show it."""
    errors_m, radii_m = [], []
    for seed in (2, 3):
        log, state, rng = (
            walked(seed, every=every, radio=True),
            AREA.begin(),
            np.random.default_rng(0),
        )
        found = []
        for epoch in epochs(log):
            state, output = AREA.step(state, epoch, rng)
            found.append((epoch.time_s, output.fix.east_m, output.fix.north_m))
            radii_m.append(output.fix.radii_m[2])
        time_s, *place_m = np.array(found).T
        truth_m = [np.interp(time_s, log.truth["time_s"], log.truth[axis]) for axis in PLACE]
        errors_m.extend(np.hypot(*np.subtract(place_m, truth_m)))
    assert np.median(errors_m) < (6 if every == 1 else 15)
    assert np.mean(np.array(errors_m) <= radii_m) > 0.85


def test_motion_that_comes_late_is_used():
    log, rng, state = slowed(walk_log(TOWN, 2)), np.random.default_rng(0), AREA.begin()
    seen = log.truth[log.truth["time_s"] < 200]
    rows = log.motion[log.motion["time_s"] >= 200]
    for epoch in epochs(make_log(CRS, motion=rows, gnss=fixes_of(seen, 3.0, 0), truth=log.truth)):
        state, output = AREA.step(state, epoch, rng)
        missing = any(one.reason is Reason.MOTION_MISSING for one in output.unused)
        if not 0 < epoch.time_s < 60:
            assert missing == (60 <= epoch.time_s < 200)


def test_nothing_is_claimed_after_the_last_position():
    at_s, error_m, _, claimed = located(walked(4, until_s=300.0, radio=True))
    assert claimed[at_s < 300].mean() > 0.8
    late = at_s > 420
    assert late.sum() > 100
    assert claimed[late].mean() < 0.05
    assert not (claimed & (error_m > 50)).any()


def test_reports_alone_do_not_converge_where_the_way_is_not_measured():
    """Hypotheses that spread to all sides agree on a place by chance."""
    log = walked(5, radio=True)
    last = log.gnss[log.gnss["time_s"] > log.truth["time_s"].iloc[-1] - 60]
    at_s, _, _, claimed = located(replace(log, gnss=last))
    assert not claimed[at_s < last["time_s"].iloc[0]].any()
    assert claimed[at_s > last["time_s"].iloc[0] + 30].any()


def test_a_known_start_is_given_up_where_levels_show_a_walk():
    """A session whose sensors never report was TRACKING at its start for good."""
    lost = 0
    for seed in (2, 3, 6):
        log, rng = slowed(walk_log(TOWN, seed)), np.random.default_rng(0)
        truth, late = log.truth, []
        state = AREA.begin_at(truth["east_m"][0], truth["north_m"][0], 5.0, rng)
        for epoch in epochs(make_log(CRS, radio=log.radio, truth=truth)):
            state, output = AREA.step(state, epoch, rng)
            if epoch.time_s > 200:
                late.append(output.fix.status in CLAIMED)
        lost += not any(late)
    assert lost == 3


def test_a_known_start_is_kept_by_one_who_stands():
    """Soon not claimed, as one may leave unnoticed, nor again without a way; but never LOST."""
    statuses, rng = {}, np.random.default_rng(0)
    log = slowed(walk_log(TOWN, 2))
    report = log.radio[log.radio["time_s"] == 0]
    state = AREA.begin_at(log.truth["east_m"][0], log.truth["north_m"][0], 5.0, rng)
    for second in range(0, 600, 4):
        level_dbm = report["level_dbm"] + rng.normal(0, 2, len(report))
        heard = report.assign(time_s=float(second), level_dbm=level_dbm)
        (epoch,) = epochs(make_log(CRS, radio=heard))
        state, output = AREA.step(state, replace(epoch, time_s=float(second)), rng)
        statuses[second] = output.fix.status
    assert {statuses[second] for second in range(0, 16, 4)} == {Status.TRACKING}
    assert set(statuses.values()) == {Status.TRACKING, Status.UNCERTAIN}
    assert {one for second, one in statuses.items() if second > 180} == {Status.UNCERTAIN}


class _Belief:
    def __init__(self, variance_m2):
        self.summary = self
        self.covariance_m2 = variance_m2 * np.eye(2)


@given(st.floats(0.1, 1e4), st.floats(0.1, 1e4))
def test_a_repeated_error_restores_the_place_at_most(belief_m2, fix_m2):
    times = repeated(_Belief(belief_m2), GnssFix(0.0, 0.0, fix_m2, fix_m2, 0.0))
    if belief_m2 <= fix_m2:
        assert times == inf
    else:
        after_m2 = 1 / (1 / belief_m2 + 1 / (times * fix_m2))
        assert after_m2 == pytest.approx(fix_m2, rel=1e-6)
