"""Positioning by a map and dead reckoning alone, in a town of irregular blocks."""

from dataclasses import replace
from functools import cache

import numpy as np
import pandas as pd
import pytest
import rasterio
import shapely
from block_town import CRS, LATTICE, as_log, drive, make_town, odometry, wander
from hypothesis import given
from hypothesis import strategies as st

from mapfilter.angles import wrap_rad
from mapfilter.database.build import build_roads
from mapfilter.database.sources import LayerRoutes
from mapfilter.filters.contract import MotionStep, Reason, Status
from mapfilter.positioning.bayes.area.opened_area import open_area
from mapfilter.positioning.bayes.beliefs.path import LEG_M, PATH_M, RecentPath
from mapfilter.positioning.bayes.beliefs.path_start import ends_of_path, possible_turns_rad
from mapfilter.positioning.bayes.options import VEHICLE, BayesFilter
from mapfilter.positioning.epochs import Epoch, GnssFix
from mapfilter.positioning.loop import locate
from mapfilter.positioning.merging import epochs
from mapfilter.roads.raster import read_raster_ways
from mapfilter.roads.route_points import RouteSource
from mapfilter.testing import check_filter
from mapfilter.tracks.log import make_log

TOWN = make_town(5)
FOUND = (Status.CONVERGED, Status.TRACKING)
# A quarter of the usual number, which claims and finds as much in this town.
FEW = {"max_particles": 5000, "min_search_particles": 3000, "min_particles": 800}


def database_of(ways, folder):
    return build_roads(LayerRoutes(RouteSource.of(ways, None, None, 6.0), LATTICE), folder)


@pytest.fixture(scope="module")
def town(tmp_path_factory):
    return database_of(TOWN.ways, tmp_path_factory.mktemp("town") / "database")


@pytest.fixture(scope="module")
def vehicle(town):
    return BayesFilter(vehicle=True, **FEW).over(town)


def located(filter_, log, seed=1):
    """Return errors, and whether the position was claimed, at each epoch."""
    estimate = locate(log, filter_, np.random.default_rng(seed)).estimate
    truth = log.truth
    east_m = np.interp(estimate.time_s, truth["time_s"], truth["east_m"])
    north_m = np.interp(estimate.time_s, truth["time_s"], truth["north_m"])
    error_m = np.hypot(estimate.east_m - east_m, estimate.north_m - north_m)
    return estimate, error_m, np.isin(estimate.status, FOUND)


def drive_log(seed, compass_sd_deg):
    """Return the log of a drive of 2.5 km."""
    path = drive(TOWN, seed, 2500.0)
    return as_log(path, odometry(path, seed, compass_sd_deg=compass_sd_deg))


@pytest.fixture(scope="module")
def located_drive(vehicle):
    """Locate such a drive by the town's own map, each once."""

    @cache
    def of(seed, compass_sd_deg):
        return located(vehicle, drive_log(seed, compass_sd_deg))

    return of


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("compass_sd_deg", [None, 5.0])
def test_a_drive_from_an_unknown_start_is_found_and_followed(located_drive, seed, compass_sd_deg):
    _, error_m, found = located_drive(seed, compass_sd_deg)
    assert found[-1]
    assert found.mean() > 0.25
    assert np.median(error_m[found]) < 5
    assert np.mean(error_m[found] > 50) == 0


@pytest.mark.parametrize("seed", [1, 2])
def test_motion_that_fits_no_street_never_converges(vehicle, seed):
    path = wander(seed, 1600.0)
    estimate, _, found = located(vehicle, as_log(path, odometry(path, seed)))
    assert not found.any()
    assert set(estimate.status) <= {Status.SEARCHING, Status.OUTSIDE}
    assert estimate.status[-1] is Status.OUTSIDE


@pytest.mark.parametrize("seed", [1, 2])
def test_a_drive_of_another_town_never_converges(vehicle, seed):
    path = drive(make_town(77), seed, 2000.0)
    _, _, found = located(vehicle, as_log(path, odometry(path, seed)))
    assert not found.any()


def drawn_ways(lattice):
    """Paint the pixels whose middle is within half a pixel of a street; look near each only."""
    drawn, half_m = np.zeros((lattice.rows, lattice.cols), np.uint8), 0.5 * lattice.resolution_m
    for line in TOWN.ways.geometry:
        west, south, east, north = line.bounds
        top, left = lattice.row_col(west - half_m, north + half_m)
        bottom, right = lattice.row_col(east + half_m, south - half_m)
        row, col = np.mgrid[top : bottom + 1, left : right + 1]
        away_m = shapely.distance(shapely.points(*lattice.east_north(row, col)), line)
        drawn[row, col] |= away_m <= half_m
    return drawn


@pytest.mark.long
def test_a_road_raster_gives_the_result_of_its_ways(town, located_drive, tmp_path):
    side_m = 1.0
    fine = replace(LATTICE, resolution_m=side_m, rows=5 * LATTICE.rows, cols=5 * LATTICE.cols)
    drawn = drawn_ways(fine)
    file = tmp_path / "roads.tif"
    with rasterio.open(
        file, "w", driver="GTiff", height=fine.rows, width=fine.cols, count=1, dtype="uint8",
        crs=CRS, transform=rasterio.Affine.from_gdal(*fine.gdal_transform),
    ) as target:  # fmt: skip
        target.write(drawn, 1)
    ways = read_raster_ways(file, {"road": 1}, CRS, LATTICE.bounds_m)
    painted = database_of(ways, tmp_path / "database")
    one, other = open_area(town), open_area(painted)
    apart_m = np.abs(one.distance_m - other.distance_m)
    assert apart_m[one.on_way & other.on_way].max() <= side_m
    # Points come and go at the edge of the ways, by a pixel of the lattice.
    assert apart_m.max() <= LATTICE.resolution_m + side_m
    _, by_lines_m, found = located_drive(2, None)
    by_raster = BayesFilter(vehicle=True, **FEW).over(painted)
    _, by_raster_m, also = located(by_raster, drive_log(2, None))
    assert also[-1]
    both = found & also
    assert both.mean() > 0.2
    difference_m = abs(np.median(by_lines_m[both]) - np.median(by_raster_m[both]))
    assert difference_m < LATTICE.resolution_m


def test_the_walkers_defaults_do_not_claim_a_wrong_position(town):
    path = drive(TOWN, 4, 1500.0)
    _, error_m, found = located(BayesFilter().over(town), as_log(path, odometry(path, 4)))
    assert not np.any(error_m[found] > 50)


def test_a_fix_starts_the_belief_where_there_is_one(vehicle):
    path = drive(TOWN, 3, 600.0)
    log = as_log(path, odometry(path, 3))
    fix = pd.DataFrame({"time_s": [0.25], "east_m": [path[1, 0]], "north_m": [path[1, 1]]})
    fix = fix.assign(var_east_m2=25.0, var_north_m2=25.0, cov_east_north_m2=0.0)
    log = make_log(CRS, motion=log.motion, truth=log.truth, gnss=fix)
    estimate, error_m, _ = located(vehicle, log)
    assert np.all(estimate.hypotheses > 0)
    assert np.median(error_m) < 10


def with_fixes(log, east_m, north_m, sd_m=3.0):
    fixes = log.truth[["time_s"]].assign(east_m=east_m, north_m=north_m, cov_east_north_m2=0.0)
    fixes = fixes.assign(var_east_m2=sd_m**2, var_north_m2=sd_m**2)
    return make_log(CRS, motion=log.motion, truth=log.truth, gnss=fixes)


def test_where_positions_are_measured_the_rules_of_the_map_alone_do_not_hold(vehicle):
    """Three right angles and 200 m of agreement are asked of the map alone only."""
    path = drive(TOWN, 3, 250.0)
    log = as_log(path, odometry(path, 3))
    rng = np.random.default_rng(4)
    east_m, north_m = (log.truth[c] + 3.0 * rng.standard_normal(len(log.truth))
                       for c in ("east_m", "north_m"))  # fmt: skip
    _, error_m, found = located(vehicle, with_fixes(log, east_m, north_m))
    assert found[-1]
    assert log.motion["step_m"][: int(np.argmax(found))].abs().sum() < 120
    assert np.max(error_m[found]) < 15
    assert not located(vehicle, log)[2].any()


def test_the_rules_of_the_map_alone_hold_again_after_the_last_position(vehicle):
    path = drive(TOWN, 3, 600.0)
    log = as_log(path, odometry(path, 3))
    first = log.truth.iloc[:1]
    fixed = with_fixes(log, first["east_m"].iloc[0], first["north_m"].iloc[0])
    fixed = replace(fixed, gnss=fixed.gnss.iloc[:1])
    state, rng = vehicle.begin(), np.random.default_rng(1)
    alone = []
    for epoch in epochs(fixed):
        state, _ = vehicle.step(state, epoch, rng)
        alone.append((state.reckoning.travelled_m, vehicle.beliefs.by_map_alone(state)))
    assert all(by_map == (travelled_m > 200.0) for travelled_m, by_map in alone)


def test_a_repeated_fix_is_one_measurement(vehicle):
    """A receiver that repeats its last fix while the vehicle drives on tells nothing new."""
    path = drive(TOWN, 3, 400.0)
    log = as_log(path, odometry(path, 3))
    first = log.truth.iloc[0]
    again = with_fixes(log, first["east_m"], first["north_m"])
    once = replace(again, gnss=again.gnss.iloc[:1])
    estimate, error_m, _ = located(vehicle, again)
    _, error_by_one_m, _ = located(vehicle, once)
    assert error_m[-1] < 10
    np.testing.assert_array_equal(error_m, error_by_one_m)
    reasons = [one.reason for one in estimate.unused if one.kind == "gnss"]
    assert reasons == [Reason.REPEATED_FIX] * (len(again.gnss) - 1)


def test_a_fix_that_was_not_used_yet_is_no_repetition(vehicle):
    """On probation nothing is used: what a waiting receiver repeats afterwards is news."""
    path = drive(TOWN, 3, 100.0)
    fix = GnssFix(float(path[0, 0]), float(path[0, 1]), 9.0, 9.0, 0.0)
    state, rng = vehicle.begin(), np.random.default_rng(1)
    state, _ = vehicle.step(state, Epoch(0.0, (MotionStep(0.0, 0.0),), gnss=fix), rng)
    assert state.last_fix == fix
    gnss = replace(state.sources["gnss"], probation_until_s=30.0)
    state = replace(state, sources={**state.sources, "gnss": gnss})
    other, reasons = replace(fix, east_m=fix.east_m + 1.0), {}
    for time_s in range(1, 61):
        state, output = vehicle.step(
            state, Epoch(float(time_s), (MotionStep(0.0, 0.0),), gnss=other), rng
        )
        reasons[time_s] = {one.reason for one in output.unused if one.kind == "gnss"}
        if time_s <= 29:
            assert state.last_fix == fix
    assert Reason.ON_PROBATION in set().union(*(reasons[time_s] for time_s in range(1, 30)))
    assert state.last_fix == other
    repeated = [time_s for time_s in reasons if Reason.REPEATED_FIX in reasons[time_s]]
    assert 30 < repeated[0] <= 42
    assert repeated == list(range(repeated[0], 61))


def test_too_short_or_broken_a_path_starts_nothing(vehicle):
    state, rng = vehicle.begin(), np.random.default_rng(0)
    for k in range(100):
        # A step without a length every 20 m ends the path each time.
        length_m = np.nan if k % 20 == 19 else 1.0
        motion = MotionStep(length_m, np.nan, 0.0 if k else np.nan)
        state, output = vehicle.step(state, Epoch(float(k), (motion,)), rng)
        assert output.fix.status is Status.SEARCHING
        assert state.belief is None
        assert [one.reason for one in output.unused] == (
            [Reason.NO_STEP] if np.isnan(length_m) else []
        )


def test_standing_still_changes_nothing(vehicle):
    rng, state = np.random.default_rng(3), vehicle.begin()
    for k in range(60):
        state, _ = vehicle.step(state, Epoch(float(k), (MotionStep(1.0, np.nan, 0.0),)), rng)
    before = state
    state, output = vehicle.step(state, Epoch(60.0, (MotionStep(0.0, np.nan, 0.0),)), rng)
    assert output.fix.reason is Reason.NO_READING
    assert np.array_equal(state.belief.state, before.belief.state)
    assert (state.path, state.null) == (before.path, before.null)


def test_the_filter_keeps_the_contract(town):
    path = drive(TOWN, 6, 300.0)
    few = {"max_particles": 600, "min_search_particles": 200, "min_particles": 100}
    small = BayesFilter(vehicle=True, **few)
    check_filter(small, town, as_log(path, odometry(path, 6)))


def test_the_start_holds_the_true_place_and_direction(town):
    area, path = open_area(town), drive(TOWN, 8, 120.0)
    motion = odometry(path, 8, scale=0.0, walk_deg=0.0)
    recent, heading_rad = RecentPath(), 0.0
    for row in motion.itertuples():
        heading_rad += row.turn_rad
        recent = recent.moved(MotionStep(row.step_m, heading_rad))
    true_turn_rad = np.arctan2(*(path[1] - path[0])[::-1])
    turns = possible_turns_rad(0.1, compass=False)
    weights = BayesFilter(vehicle=True).over_area(area).model.weights
    rng = np.random.default_rng(1)
    ends = ends_of_path(area, weights, recent, turns, 200_000, rng)
    assert np.exp(ends.log_weight).sum() == pytest.approx(1.0)
    west, south = area.origin_m
    away_m = np.hypot(*(ends.place_m.T - (path[-1] - [west, south])).T)
    right = (away_m < 10) & (np.abs(wrap_rad(ends.turned_rad - true_turn_rad)) < 0.1)
    assert right.sum() > 10
    # Of all places on ways and all directions, so many are as near.
    near = np.hypot(*(area.points.T - (path[-1] - [west, south])).T) < 10
    share = near.mean() * 0.2 / (2 * np.pi)
    assert np.exp(ends.log_weight)[right].sum() > 5 * share


@given(st.lists(st.tuples(st.floats(0.1, 6.0), st.floats(-3.0, 3.0)), min_size=1, max_size=80))
def test_a_recent_path_is_that_of_its_steps(steps):
    recent, at_m, gone_m = RecentPath(), np.zeros(2), 0.0
    for step_m, heading_rad in steps:
        recent = recent.moved(MotionStep(step_m, heading_rad))
        at_m = at_m + step_m * np.array([np.cos(heading_rad), np.sin(heading_rad)])
        gone_m += step_m
    first = recent.points[0]
    assert np.allclose((recent.here.east_m, recent.here.north_m), at_m)
    spacing_m = np.diff([point.travelled_m for point in recent.points])
    assert np.all(spacing_m >= LEG_M - 1e-9)
    assert recent.is_distinctive == (recent.turned_rad >= 1.5 * np.pi)
    assert recent.whole == (gone_m - first.travelled_m >= PATH_M)
    start_m = np.array([first.east_m, first.north_m])
    assert np.allclose(recent.earlier_m[0], start_m - at_m, atol=1e-3)


@pytest.mark.parametrize(("corners", "distinctive"), [(3, False), (4, True)])
def test_a_path_is_distinctive_after_some_right_angles(corners, distinctive):
    recent = RecentPath()
    for k in range(60 * (corners + 1)):
        recent = recent.moved(MotionStep(1.0, np.pi / 2 * (k // 60)))
    # Of each corner, the 3 degrees of a leg that counts as straight are lost, up to twice.
    assert recent.turned_rad == pytest.approx(corners * np.pi / 2, abs=corners * 0.11)
    assert recent.is_distinctive == distinctive
    assert not recent.moved(MotionStep(np.nan, 0.0)).is_distinctive


def test_a_long_drive_along_a_straight_road_is_not_claimed(vehicle):
    path = np.stack([np.arange(0.0, 1100.0, 2.0), np.zeros(550)], axis=-1)
    path = path + np.array([455_000.0, 5_430_600.0])
    _, _, found = located(vehicle, as_log(path, odometry(path, 1)))
    assert not found.any()


def test_possible_turns_cover_the_circle_or_three_deviations():
    turned, prior, width = possible_turns_rad(0.2, compass=False)
    assert np.all(prior == 0)
    assert turned.size * width == pytest.approx(2 * np.pi)
    turned, prior, width = possible_turns_rad(0.2, compass=True)
    assert turned.max() >= 0.6 - 1e-9
    assert prior[np.argmin(np.abs(turned - 0.2))] == pytest.approx(-0.5, abs=0.3)
    turned, prior, _ = possible_turns_rad(0.0, compass=True)
    assert turned.size >= 1
    assert prior.max() == 0


def test_options_of_a_vehicle_replace_defaults_only():
    given_ = BayesFilter(vehicle=True, heading_sd_deg=4.0).resolved
    assert given_.heading_sd_deg == 4.0
    assert given_.drift_deg_per_sqrt_m == VEHICLE["drift_deg_per_sqrt_m"]
    assert BayesFilter().resolved == BayesFilter()
