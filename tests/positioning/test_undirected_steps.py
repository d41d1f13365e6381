"""Motion without any direction: speeds alone, or counted steps alone."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from block_town import CRS, LATTICE, STEP_M, STEP_S, drive, make_town

import mapfilter as mf
from mapfilter.database.build import build_roads
from mapfilter.database.sources import LayerRoutes
from mapfilter.filters.contract import MotionStep, Reason
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.epochs import Epoch, GnssFix
from mapfilter.positioning.merging import epochs
from mapfilter.positioning.sensors.undirected import UndirectedWay
from mapfilter.roads.route_points import RouteSource
from mapfilter.tracks.log import make_log

TOWN = make_town(5)
FOUND = ("CONVERGED", "TRACKING")
FEW = {"max_particles": 5000, "min_search_particles": 3000, "min_particles": 800}


def driven(turn_rad=np.nan, heading_rad=np.nan, fixes_s=40.0):
    """A drive whose receiver fails after some time, and whose wheels tell lengths alone."""
    path_m = drive(TOWN, 3, 1200.0)
    time_s = STEP_S * np.arange(len(path_m))
    places = pd.DataFrame({"time_s": time_s, "east_m": path_m[:, 0], "north_m": path_m[:, 1]})
    motion = pd.DataFrame({"time_s": time_s, "step_m": STEP_M, "turn_rad": turn_rad})
    motion = motion.assign(heading_rad=heading_rad)
    motion.loc[0, "turn_rad"] = 0.0
    rng = np.random.default_rng(0)
    seen = places[places["time_s"] < fixes_s].iloc[::4]
    noise_m = rng.normal(0, 3, (2, len(seen)))
    seen = seen.assign(east_m=seen["east_m"] + noise_m[0], north_m=seen["north_m"] + noise_m[1])
    fixes = seen.assign(var_east_m2=9.0, var_north_m2=9.0) if len(seen) else None
    return make_log(CRS, motion=motion, gnss=fixes, truth=places, vehicle=True)


@pytest.fixture(scope="module")
def town(tmp_path_factory):
    source = LayerRoutes(RouteSource.of(TOWN.ways, None, None, 6.0), LATTICE)
    return build_roads(source, tmp_path_factory.mktemp("town") / "database")


def claimed_errors_m(log, town):
    track = mf.locate(log, town, filter=BayesFilter(vehicle=True, **FEW))
    table = track.to_dataframe()
    claimed = table[table["status"].isin(FOUND)]
    truth = log.truth
    east_m, north_m = (
        np.interp(claimed["time_s"], truth["time_s"], truth[name]) for name in ("east_m", "north_m")
    )
    return track, np.hypot(claimed["east_m"] - east_m, claimed["north_m"] - north_m)


def test_a_drive_without_turns_is_not_claimed_where_its_fixes_ended(town):
    """It was TRACKING for a minute, hundreds of metres behind the vehicle."""
    log = driven()
    track, error_m = claimed_errors_m(log, town)
    # Fixes end with the 160th epoch.
    assert 100 < len(error_m) < 230
    # It follows the street for some way, and is not claimed where the next ones branch off.
    assert error_m.index.max() < 230
    assert np.median(error_m) < 15
    assert error_m.max() < 60
    assert any("no headings and no turns at all" in note for note in track.log.notes)
    assert track.log.motion is log.motion


def test_a_drive_without_turns_is_followed_by_its_fixes(town):
    """Small steps to all sides did not come along with the vehicle: 230 m off, in the median."""
    _, error_m = claimed_errors_m(driven(fixes_s=1e9), town)
    assert len(error_m) > 100
    assert error_m.max() < 40


def test_a_drive_without_turns_is_smoothed_by_its_fixes(town):
    """As if it stood between positions, smoothed places were off, in half the radii."""
    log, away_m = driven(fixes_s=1e9), {}
    truth = log.truth
    for smooth in (False, True):
        options = BayesFilter(vehicle=True, smooth=smooth, **FEW)
        found = mf.locate(log, town, filter=options).to_dataframe()
        east_m, north_m = (
            np.interp(found["time_s"], truth["time_s"], truth[name])
            for name in ("east_m", "north_m")
        )
        away_m[smooth] = np.hypot(found["east_m"] - east_m, found["north_m"] - north_m)
        assert np.mean(away_m[smooth] <= found["radius_95_m"]) > 0.88
    assert away_m[True].median() < away_m[False].median() < 4.0
    assert away_m[True].max() < 25


def step(length_m=STEP_M, heading_rad=np.nan, turn_rad=np.nan):
    return MotionStep(length_m, heading_rad, turn_rad)


def fix_at(east_m, sd_m=5.0):
    return GnssFix(east_m, 0.0, sd_m**2, sd_m**2)


def test_steps_after_a_position_are_parts_of_one_way():
    way, far_m2 = UndirectedWay().positioned(), 0.0
    for number in range(1, 101):
        way, epoch, _ = way.spread(Epoch(float(number), (step(),)))
        far_m2 += epoch.motion[0].spread_m ** 2
        assert epoch.motion[0].step_m == STEP_M
    gone_m = 100 * STEP_M
    # A way whose direction is forgotten after 84 m, in closed form.
    assert far_m2 == pytest.approx(2 * 84 * (gone_m - 84 * (1 - np.exp(-gone_m / 84))))
    assert way.since_m == way.gone_m == pytest.approx(gone_m)
    assert way.is_blind
    way = way.positioned()
    way, epoch, _ = way.spread(Epoch(200.0, (step(),)))
    assert epoch.motion[0].spread_m == pytest.approx(STEP_M, rel=0.01)


def test_steps_with_directions_or_before_any_position_stay_as_they_are():
    unplaced, placed = UndirectedWay(), UndirectedWay(since_m=0.0)
    for way, rows in (
        (unplaced, [step(), step()]),
        (placed, [step(turn_rad=0.0), step(turn_rad=0.0)]),
        (placed, [step(heading_rad=0.5), step(heading_rad=0.6)]),
        (placed, [step(0.0), step(turn_rad=0.1)]),
        (placed, [step(np.nan)]),
    ):
        for number, row in enumerate(rows):
            given = Epoch(float(number), (row,), gnss=fix_at(0.0))
            way, epoch, unused = way.spread(given)
            assert (epoch, unused) == (given, [])
        assert not way.is_blind


def test_along_ways_steps_become_legs_and_no_position_is_left_out():
    way, lengths_m = UndirectedWay(), []
    for number in range(1, 11):
        way, epoch, unused = way.spread(Epoch(float(number), (step(3.0),)), by_ways=True)
        (one,) = epoch.motion
        assert (one.is_undirected, unused) == (True, [])
        lengths_m.append(one.step_m)
    assert lengths_m == [0.0, 0.0, 9.0] * 3 + [0.0]
    assert way.is_blind
    # What waits goes before a position, and each position is used.
    for number in range(11, 14):
        given = Epoch(float(number), (step(1.0),), gnss=fix_at(float(number)))
        way, epoch, unused = way.spread(given, by_ways=True)
        assert (epoch.gnss, unused) == (given.gnss, [])
        assert epoch.motion[0].step_m == (4.0 if number == 11 else 1.0)
    # Way back is none that waits.
    way, epoch, _ = way.spread(Epoch(20.0, (step(5.0), step(-5.0))), by_ways=True)
    assert [one.step_m for one in epoch.motion] == [0.0, 0.0]
    assert way.waiting_m == 0
    # For some way after a position nothing waits.
    way = way.positioned()
    way, epoch, _ = way.spread(Epoch(21.0, (step(1.0), step(198.5))), by_ways=True)
    assert [one.step_m for one in epoch.motion] == [1.0, 198.5]
    way, epoch, _ = way.spread(Epoch(22.0, (step(1.0),)), by_ways=True)
    assert epoch.motion[0].step_m == 1.0
    way, epoch, _ = way.spread(Epoch(23.0, (step(1.0),)), by_ways=True)
    assert epoch.motion[0].step_m == 0.0
    # Where directions end, it is as for walkers: near positions are left out.
    directed, _, _ = UndirectedWay().spread(Epoch(0.0, (step(heading_rad=0.1),)), by_ways=True)
    way, epoch, _ = directed.spread(Epoch(1.0, (step(20.0),)), by_ways=True)
    assert np.isfinite(epoch.motion[0].spread_m)
    way = way.positioned()
    _, epoch, unused = way.spread(Epoch(2.0, (step(1.0),), gnss=fix_at(21.0)), by_ways=True)
    assert (epoch.gnss, len(unused)) == (None, 1)


@pytest.mark.parametrize("rest", [(), (step(0.0),)])
def test_what_waits_goes_before_a_position_at_rest(rest):
    way, lengths_m = UndirectedWay(), []
    for number in range(3):
        way, epoch, _ = way.spread(Epoch(float(number), (step(2.5),)), by_ways=True)
        lengths_m += [one.step_m for one in epoch.motion]
    way, epoch, _ = way.spread(Epoch(3.0, rest, gnss=fix_at(7.5)), by_ways=True)
    assert sum(lengths_m) + sum(one.step_m for one in epoch.motion) == 7.5
    assert way.waiting_m == 0
    assert all(one.is_undirected for one in epoch.motion)


def test_what_waits_is_a_part_of_the_first_step_with_a_direction():
    way, _, _ = UndirectedWay().spread(Epoch(0.0, (step(3.0),)), by_ways=True)
    way, epoch, _ = way.spread(Epoch(1.0, (step(2.0, heading_rad=0.5),)), by_ways=True)
    assert epoch.motion[0].step_m == 5.0
    assert (way.waiting_m, way.is_blind) == (0.0, False)


def test_courses_become_errors_of_the_first_heading(town):
    """Who went along the streets, by courses from 0, goes the same way with a compass."""
    log = driven(fixes_s=40.0)
    bayes = BayesFilter(vehicle=True, **FEW).over(mf.open_database(town.path))
    state, rng = bayes.begin(), np.random.default_rng(3)
    for epoch in epochs(log)[:150]:
        state, _ = bayes.step(state, epoch, rng)
    courses = state.belief.state[2]
    usual = np.arctan2(
        np.average(np.sin(courses), weights=state.belief.weight),
        np.average(np.cos(courses), weights=state.belief.weight),
    )
    before = state.belief.summary.mean[:2]
    heading = float(usual)
    for number in range(10):
        step_on = MotionStep(2.0, heading)
        epoch = Epoch(epochs(log)[150].time_s + number, (step_on,))
        state, _ = bayes.step(state, epoch, rng)
    weight = state.belief.weight
    gone = np.array([np.dot(weight, state.belief.state[row]) for row in (0, 1)]) - before
    along = gone @ [np.cos(heading), np.sin(heading)]
    assert along > 12


@pytest.mark.parametrize(("heading_rad", "turn_rad"), [(0.5, np.nan), (np.nan, 0.5)])
def test_a_direction_holds_for_some_metres(heading_rad, turn_rad):
    way, _, _ = UndirectedWay().spread(Epoch(0.0, (step(0.0, turn_rad=0.0),)))
    way, directions, used = (
        way.spread(Epoch(1.0, (step(heading_rad=heading_rad, turn_rad=turn_rad),)))[0],
        [],
        [],
    )
    for number in range(2, 14):
        way, epoch, _ = way.spread(Epoch(float(number), (step(),), gnss=fix_at(0.0)))
        (one,) = epoch.motion
        directions.append((one.heading_rad, one.turn_rad))
        used.append(epoch.gnss is not None)
    ahead, unknown = [(heading_rad, 0.0)] * 5, [(np.nan, np.nan)] * 7
    np.testing.assert_array_equal(directions, ahead + unknown)
    # Then the next position is that after 14 m, as 12.5 m apart is far enough.
    assert used == [True] * 5 + [False] * 6 + [True]
    way, _, _ = way.spread(Epoch(20.0, (step(heading_rad=0.5),)))
    assert (way.gone_m, way.is_blind) == (0.0, False)


@pytest.mark.parametrize(
    ("apart_m", "sd_m", "used"),
    [
        (2.0, 5.0, [14.0, 28.0, 42.0, 56.0]),
        (2.0, 20.0, [26.0, 52.0]),
        (10.0, 20.0, [30.0, 60.0]),
        (18.0, 20.0, [18.0, 36.0, 54.0]),
        (40.0, 20.0, [40.0]),
    ],
)
def test_positions_less_than_some_deviations_of_way_apart_are_left_out(apart_m, sd_m, used):
    way, found = UndirectedWay().positioned(), []
    for number in range(1, 31):
        at_m = number * STEP_M
        has_fix = at_m % apart_m == 0
        given = Epoch(float(number), (step(),), gnss=fix_at(at_m, sd_m) if has_fix else None)
        way, epoch, unused = way.spread(given)
        if epoch.gnss is not None:
            found.append(at_m)
            way = way.positioned()
        left_out = has_fix and epoch.gnss is None
        assert [one.reason for one in unused] == [Reason.NOT_MOVED_ENOUGH] * left_out
    assert found == used


def test_a_live_session_gives_what_a_replay_gives(town):
    """Steps were joined in the log alone: live, places hundreds of metres behind were claimed."""
    log = paced(1.4, 5.0, 400.0)
    bayes = BayesFilter(vehicle=False, **FEW).over(town)
    state, rng, found = bayes.begin(), np.random.default_rng(0), []
    for epoch in epochs(log):
        state, output = bayes.step(state, epoch, rng)
        found.append((output.fix.east_m, output.fix.north_m, output.fix.status))
    track = mf.locate(log, town, filter=BayesFilter(vehicle=False, **FEW), seed=0).to_dataframe()
    np.testing.assert_array_equal([one[0] for one in found], track["east_m"])
    off_m = np.hypot(
        [one[0] for one in found] - log.truth["east_m"],
        [one[1] for one in found] - log.truth["north_m"],
    )
    claimed = np.array([one[2] in FOUND for one in found])
    assert claimed.sum() > 200
    assert off_m[claimed].max() < 40


def test_a_walk_whose_compass_dies_is_followed_by_its_fixes(town):
    """From there on it fell behind: 240 m off, TRACKING."""
    log = paced(1.4, 5.0, 500.0)
    path = log.truth[["east_m", "north_m"]].diff().bfill()
    headings_rad = np.arctan2(path["north_m"], path["east_m"])
    motion = log.motion.assign(heading_rad=headings_rad.where(log.motion["time_s"] <= 150))
    log = make_log(CRS, motion=motion, gnss=log.gnss, truth=log.truth)
    track = mf.locate(log, town, filter=BayesFilter(vehicle=False, **FEW))
    score = mf.score(track, log.truth)
    assert score.error_mean_m < 12
    assert score.within_95 > 0.8


def test_a_known_start_is_left_by_steps_without_directions(town):
    """Small steps to all sides stayed there: TRACKING, hundreds of metres behind."""
    log = paced(1.4, 5.0, 400.0)
    bayes, rng = BayesFilter(vehicle=False, **FEW).over(town), np.random.default_rng(0)
    first = log.truth.iloc[0]
    state = bayes.begin_at(first["east_m"], first["north_m"], 10.0, rng)
    for number, epoch in enumerate(epochs(log)):
        state, output = bayes.step(state, replace(epoch, gnss=None), rng)
        fix, true_m = output.fix, log.truth.iloc[number]
        off_m = np.hypot(fix.east_m - true_m["east_m"], fix.north_m - true_m["north_m"])
        assert fix.status not in FOUND or off_m < 60
    assert output.fix.status not in FOUND


def paced(pace_mps, fix_sd_m, lasts_s, seed=3):
    """A way with a fix each second, and lengths alone."""
    path_m = drive(TOWN, seed, lasts_s * pace_mps)
    rng = np.random.default_rng(seed + 4)
    count = int(len(path_m) * STEP_M / pace_mps)
    at = pace_mps * np.arange(count) / STEP_M
    east_m, north_m = (np.interp(at, np.arange(len(path_m)), axis) for axis in path_m.T)
    places = pd.DataFrame({"time_s": np.arange(count) * 1.0, "east_m": east_m, "north_m": north_m})
    noise_m = rng.normal(0, fix_sd_m, (2, count))
    fixes = places.assign(
        east_m=east_m + noise_m[0],
        north_m=north_m + noise_m[1],
        var_east_m2=fix_sd_m**2,
        var_north_m2=fix_sd_m**2,
    )
    motion = pd.DataFrame({"time_s": places["time_s"], "step_m": pace_mps})
    return make_log(CRS, motion=motion, gnss=fixes, truth=places)


@pytest.mark.parametrize("fix_sd_m", [5.0, 10.0])
def test_a_walk_of_lengths_alone_is_followed_by_its_fixes(town, fix_sd_m):
    """Fixes a step apart were all ahead, and then rejected: hundreds of metres off."""
    within_95 = []
    for seed in range(3, 5):
        log = paced(1.4, fix_sd_m, 500.0, seed)
        track = mf.locate(log, town, filter=BayesFilter(vehicle=False, **FEW))
        score = mf.score(track, log.truth)
        assert score.error_mean_m < 2.5 * fix_sd_m
        within_95.append(score.within_95)
        assert any("of way apart only the first is used" in note for note in track.log.notes)
        left_out = [one for one in track.estimate.unused if one.reason is Reason.NOT_MOVED_ENOUGH]
        assert len(left_out) > 300
    assert np.mean(within_95) > 0.8


@pytest.mark.parametrize("wrong", [1, 3, 20])
def test_first_fixes_that_are_wrong_do_not_part_later_ones_from_the_way(wrong):
    """As far from the first place as no way leads, they were lagged behind: by 115 m for 400 s."""
    log = paced(1.4, 10.0, 500.0)
    gnss = log.gnss.copy()
    gnss.loc[gnss.index[:wrong], "east_m"] += 600.0
    found = mf.locate(replace(log, gnss=gnss), filter="ekf").to_dataframe()
    off_m = np.hypot(*(found[name] - log.truth[name] for name in ("east_m", "north_m")))[100:]
    assert off_m.mean() < 15.0
    assert (off_m <= found["radius_95_m"][100:]).mean() > 0.9


@pytest.mark.parametrize("fault", ["ended", "no lengths", "gap"])
def test_positions_stay_where_the_way_between_them_is_not_known(town, fault):
    """They were left out, as if one stood, and the walk went on without any: 180 m off."""
    log = paced(1.4, 10.0, 500.0)
    time_s, step_m = log.motion["time_s"], log.motion["step_m"]
    blind = (time_s > 150) & ((time_s < 350) | (fault == "ended"))
    motion = log.motion.assign(step_m=step_m.mask(blind))
    motion = motion if fault == "no lengths" else motion[~blind]
    log = replace(log, motion=motion.reset_index(drop=True))
    track = mf.locate(log, town, filter=BayesFilter(vehicle=False, **FEW))
    near_s = {one.time_s for one in track.estimate.unused if one.reason is Reason.NOT_MOVED_ENOUGH}
    # Some seconds without rows are not known to be a way.
    assert not near_s & set(time_s[blind & (time_s > 160)])
    assert len([one for one in near_s if one <= 150]) > 100
    score = mf.score(track, log.truth)
    assert score.error_mean_m < 40.0


@pytest.mark.parametrize(("pace_mps", "fix_sd_m"), [(1.4, 3.0), (1.4, 10.0), (9.0, 10.0)])
def test_without_a_map_fixes_are_followed_by_whom_has_lengths_alone(pace_mps, fix_sd_m):
    """Fixes that are all ahead were taken for errors that last: up to 80 m behind, within 30 m."""
    log = paced(pace_mps, fix_sd_m, 700.0)
    east_m, north_m = (log.truth[name] for name in ("east_m", "north_m"))
    found = mf.locate(log, filter="ekf").to_dataframe()
    off_m = np.hypot(found["east_m"] - east_m, found["north_m"] - north_m)[10:]
    assert len(off_m) > 500
    assert off_m.mean() < 1.5 * fix_sd_m
    assert (off_m <= found["radius_95_m"][10:]).mean() > 0.9
