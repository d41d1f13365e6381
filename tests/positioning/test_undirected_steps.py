"""Motion without any direction: speeds alone, or counted steps alone."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from block_town import CRS, LATTICE, STEP_M, STEP_S, drive, make_town

import mapfilter as mf
from mapfilter.database.build import build_roads
from mapfilter.database.sources import LayerRoutes
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.candidate import CandidateFilter
from mapfilter.positioning.undirected_steps import with_joined_steps
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
    assert 20 < len(error_m) < 60
    assert np.median(error_m) < 15
    assert error_m.max() < 60
    assert any("no headings and no turns at all" in note for note in track.log.notes)
    assert track.log.motion is log.motion


def test_a_drive_without_turns_is_followed_by_its_fixes(town):
    """Small steps to all sides did not come along with the vehicle: 230 m off, in the median."""
    _, error_m = claimed_errors_m(driven(fixes_s=1e9), town)
    assert len(error_m) > 100
    assert error_m.max() < 40


def test_steps_are_joined_between_positions_and_unknown_far_from_them():
    log = driven()
    given, (note,) = with_joined_steps(log, BayesFilter())
    motion = given.motion
    by_fixes = motion["time_s"] <= 39.0
    assert motion["time_s"][by_fixes].tolist() == list(range(40))
    np.testing.assert_allclose(motion["step_m"][by_fixes], [STEP_M, *[4 * STEP_M] * 39])
    after = motion[~by_fixes]
    # 15 steps of 2 m are one, and all others are rows without a length.
    assert after["step_m"].iloc[0] == pytest.approx(30.0)
    assert after["time_s"].iloc[0] == pytest.approx(39.0 + 15 * STEP_S)
    assert after["step_m"].iloc[1:].isna().all()
    assert len(after) == (log.motion["time_s"] > 39.0 + 15 * STEP_S).sum() + 1
    assert "joined from each position to the next" in note
    assert given.gnss is log.gnss


def test_motion_with_directions_or_without_positions_stays_as_it_is():
    options, plain = BayesFilter(), driven()
    for log in (
        driven(turn_rad=0.0),
        driven(heading_rad=0.5),
        driven(fixes_s=0.0),
        make_log(CRS, motion=plain.motion.assign(step_m=0.0), gnss=plain.gnss),
    ):
        assert with_joined_steps(log, options) == (log, ())
    # These leave out such steps themselves.
    assert with_joined_steps(plain, CandidateFilter()) == (plain, ())


def paced(pace_mps, fix_sd_m, lasts_s):
    """A way with a fix each second, and lengths alone."""
    path_m = drive(TOWN, 3, lasts_s * pace_mps)
    rng = np.random.default_rng(7)
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
    log = paced(1.4, fix_sd_m, 500.0)
    track = mf.locate(log, town, filter=BayesFilter(vehicle=False, **FEW))
    score = mf.score(track, log.truth)
    assert score.error_mean_m < 2.5 * fix_sd_m
    assert score.within_95 > 0.8
    assert any("m of way after another one" in note for note in track.log.notes)


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
    given, _ = with_joined_steps(log, BayesFilter())
    kept_s = given.gnss["time_s"]
    assert set(time_s[blind]) <= set(kept_s)
    assert (kept_s <= 150).sum() < 20
    score = mf.score(mf.locate(log, town, filter=BayesFilter(vehicle=False, **FEW)), log.truth)
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
