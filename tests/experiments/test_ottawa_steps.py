"""Sessions of a phone read, turned into steps, and scored: a few rows by hand."""

import itertools
from math import nan, pi
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from mapfilter.errors import InputError
from mapfilter.experiments.benchmarks import ottawa
from mapfilter.experiments.benchmarks.ottawa_sessions import (
    ReckoningErrors,
    centroids,
    read_session,
    session_log,
    step_factor_of,
)
from mapfilter.filters.contract import Reason, Status
from mapfilter.geodesy import unproject
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.positioning.step_output import Fix
from mapfilter.tracks.joining.sampling import sampling_sd_m

# On the central meridian grid north is north.
CRS = "EPSG:32618"
EAST_M, NORTH_M = 500_000.0, 5_030_000.0
EXACT = ReckoningErrors(0.0, 0.0, 0.0)


def table(places, times_s, **columns):
    east, north = np.array(places, dtype=float).T
    lon, lat = unproject(CRS, EAST_M + east, NORTH_M + north)
    count = len(east)
    given = {
        "mcc": 302, "mnc": 720, "lac": 7, "cellid": 256, "lat": lat, "lon": lon,
        "signal": -90.0, "measured_at": 1000.0 * np.array(times_s), "rating": 5.0,
        "speed": 2.0, "direction": 90.0, "ta": 3.0,
    }  # fmt: skip
    return pd.DataFrame({name: np.broadcast_to(value, count) for name, value in
                         (given | columns).items()})  # fmt: skip


def session(tmp_path, places=((0, 0), (20, 0), (40, 0)), times_s=(100.0, 110.0, 120.0), **columns):
    path = tmp_path / "ride.csv"
    table(places, times_s, **columns).to_csv(path, index=False)
    return read_session(path)


def test_rows_are_read_in_order_of_time(tmp_path):
    one = session(
        tmp_path, ((0, 0), (20, 0), (40, 0), (60, 0), (80, 0)), (130.0, 110.0, 110.0, 100.0, 105.0),
        ta=[1282.0, 1283.0, 5.0, -1.0, 0.0], speed=[1.0, 2.0, 3.0, 4.0, 5.0],
        direction=[10.0, 20.0, 30.0, 40.0, 50.0], signal=[-91.0, -92.0, -93.0, -94.0, -95.0],
        rating=[1.0, 2.0, 3.0, 4.0, 5.0], cellid=[1, 2, 3, 4, 5],
    )  # fmt: skip
    assert len(one) == 4
    assert one.name == "ride"
    assert one.path == tmp_path / "ride.csv"
    # Of two rows of one time the first counts.
    assert one.time_s.tolist() == [100.0, 105.0, 110.0, 130.0]
    assert one.speed_mps.tolist() == [4.0, 5.0, 2.0, 1.0]
    assert one.azimuth_deg.tolist() == [40.0, 50.0, 20.0, 10.0]
    assert one.level_dbm.tolist() == [-94.0, -95.0, -92.0, -91.0]
    assert one.accuracy_m.tolist() == [4.0, 5.0, 2.0, 1.0]
    assert one.cell == ("302-720-7-4", "302-720-7-5", "302-720-7-2", "302-720-7-1")
    np.testing.assert_array_equal(one.timing_advance, [nan, 0.0, nan, 1282.0])
    np.testing.assert_allclose(one.places(CRS)[:, 0] - EAST_M, [60, 80, 20, 0], atol=1e-3)
    np.testing.assert_allclose(one.places(CRS)[:, 1], NORTH_M, atol=1e-3)


def test_rows_that_lack_what_is_needed_are_left_out(tmp_path):
    needed = ("lat", "lon", "measured_at", "mcc", "mnc", "lac", "cellid", "signal")
    for name, value in itertools.product(needed, ("none", "", "inf")):
        rows = table(((0, 0), (20, 0), (40, 0)), (1.0, 2.0, 3.0)).astype(object)
        rows.loc[1, name] = value
        rows.to_csv(tmp_path / "ride.csv", index=False)
        assert read_session(tmp_path / "ride.csv").time_s.size == 2
    assert session(tmp_path, speed=[nan, 1.0, 2.0]).time_s.size == 3
    with pytest.raises(InputError, match="two rows or more, found 1"):
        session(tmp_path, ((0, 0),), (1.0,))
    assert len(session(tmp_path, ((0, 0), (1, 1)), (1.0, 2.0))) == 2
    with pytest.raises(InputError, match="a readable file, found No such file"):
        read_session(tmp_path / "none.csv")


def test_half_of_an_interval_goes_by_each_of_its_ends(tmp_path):
    one = session(
        tmp_path, times_s=(100.0, 110.0, 130.0), speed=[1.0, 2.0, 4.0],
        direction=[90.0, 0.0, 180.0], ta=[1.0, nan, 2.0], signal=[-90, -91, -92.0],
    )  # fmt: skip
    log = session_log(one, CRS, EXACT, np.random.default_rng(0), step_factor=2.0)
    assert log.motion["time_s"].tolist() == [5.0, 10.0, 20.0, 30.0]
    np.testing.assert_allclose(log.motion["step_m"], [10.0, 20.0, 40.0, 80.0])
    heading = np.array([0.0, pi / 2, pi / 2, -pi / 2])
    np.testing.assert_allclose(log.motion["heading_rad"], heading, atol=1e-4)
    assert log.start_utc_s == 100.0
    assert log.radio["time_s"].tolist() == log.truth["time_s"].tolist() == [0.0, 10.0, 30.0]
    assert set(log.radio["role"]) == {"serving"}
    assert log.radio["level_dbm"].tolist() == [-90.0, -91.0, -92.0]
    np.testing.assert_array_equal(log.radio["timing_advance"], [1.0, nan, 2.0])
    assert log.radio["cell"].tolist() == list(one.cell)
    np.testing.assert_allclose(log.truth["east_m"] - EAST_M, [0, 20, 40], atol=1e-3)
    np.testing.assert_allclose(log.truth["north_m"], NORTH_M, atol=1e-3)


def test_the_longer_half_has_the_error_of_the_sampling(tmp_path):
    one = session(tmp_path, times_s=(0.0, 6.0, 12.0), speed=[9.0, 4.0, 4.0], direction=90.0)
    log = session_log(one, CRS, EXACT, np.random.default_rng(0), step_factor=2.0)
    first_m, second_m = 2 * sampling_sd_m(one.time_s, one.speed_mps, np.zeros(3))
    assert second_m > 0
    np.testing.assert_allclose(log.motion["sampling_sd_m"], [first_m, 0.0, second_m, 0.0])
    faster = session(tmp_path, times_s=(0.0, 6.0), places=((0, 0), (9, 9)), speed=[4.0, 9.0])
    log = session_log(faster, CRS, EXACT, np.random.default_rng(0))
    assert log.motion["sampling_sd_m"].gt(0).tolist() == [False, True]


def test_thirty_seconds_are_no_silence_yet(tmp_path):
    one = session(tmp_path, times_s=(0.0, 30.0, 60.5))
    log = session_log(one, CRS, EXACT, np.random.default_rng(0))
    np.testing.assert_array_equal(log.motion["step_m"], [30.0, 30.0, nan, nan])


def test_errors_have_their_stated_size(tmp_path):
    count = 4000
    along = np.arange(count) * 20.0
    one = session(tmp_path, np.column_stack([np.zeros(count), along]), 10.0 * np.arange(count),
                  direction=0.0)  # fmt: skip
    errors, sides = ReckoningErrors(0.2, 0.1, 0.3), set()
    for seed in range(4):
        log = session_log(one, CRS, errors, np.random.default_rng(seed))
        share = log.motion["step_m"].to_numpy() / 10.0
        assert share.mean() == pytest.approx(1.0, abs=0.012)
        assert share.std() == pytest.approx(0.2, rel=0.05)
        off = log.motion["heading_rad"].to_numpy() - pi / 2
        assert abs(off.mean()) == pytest.approx(0.3, abs=0.006)
        assert off.std() == pytest.approx(0.1, rel=0.05)
        sides.add(np.sign(off.mean()))
    assert sides == {-1.0, 1.0}


def test_how_much_longer_true_ways_are(tmp_path):
    def factor(step_m=30.0, **columns):
        places = [(step_m * k, 0) for k in range(4)]
        return step_factor_of([session(tmp_path, places, (0.0, 10.0, 20.0, 30.0), **columns)], CRS)

    # 2 m/s over 10 s are 20 m.
    assert factor() == pytest.approx(1.5, rel=1e-3)
    assert factor(rating=20.0) == pytest.approx(1.5, rel=1e-3)
    assert factor(rating=20.1) == 1.0
    # Either end spoils an interval: here all three of them.
    assert factor(rating=[5.0, 30.0, 30.0, 5.0]) == 1.0
    assert factor(speed=0.41) == pytest.approx(30 / 4.1, rel=1e-3)
    assert factor(speed=0.4) == 1.0
    # A corner: half the way east, half of it north.
    corner = factor(direction=[90.0, 0.0, 90.0, 0.0])
    assert corner == pytest.approx(30 / np.hypot(10, 10), rel=1e-3)
    assert step_factor_of([], CRS) == 1.0
    both = [session(tmp_path, ((0, 0), (25, 0)), (0.0, 10.0)),
            session(tmp_path, ((0, 0), (35, 0)), (0.0, 10.0))]  # fmt: skip
    assert step_factor_of(both, CRS) == pytest.approx(1.5, rel=1e-3)


def test_the_middles_of_cells(tmp_path):
    one = session(tmp_path, cellid=[1, 1, 2], rating=[20.0, 10.0, 21.0])
    found = centroids([one], CRS, 20.0)
    assert set(found) == {"302-720-7-1"}
    np.testing.assert_allclose(found["302-720-7-1"], [EAST_M + 10, NORTH_M], atol=1e-3)
    every = centroids([one, one], CRS, np.inf)
    np.testing.assert_allclose(every["302-720-7-2"], [EAST_M + 40, NORTH_M], atol=1e-3)
    # Fixes that are good enough, of cells that others have seen.
    own = session(tmp_path, ((10, 30), (10, 40), (10, 50)), cellid=[1, 9, 1],
                  rating=[20.0, 5.0, 20.5])  # fmt: skip
    np.testing.assert_allclose(ottawa.centroid_errors_m(own, [one], CRS), [30.0], atol=1e-3)


S, C, T, L = Status.SEARCHING, Status.CONVERGED, Status.TRACKING, Status.LOST


def scored(tmp_path, method, statuses, errors_m, accuracy_m, radius_m=25.0):
    count = len(statuses)
    places = [(100.0 * k, 0) for k in range(count)]
    one = session(tmp_path, places, 10.0 * np.arange(count), rating=accuracy_m)
    log = session_log(one, CRS, EXACT, np.random.default_rng(0))
    # An epoch every 5 s; rows fall on every second one.
    fixes = []
    for k in range(2 * count - 1):
        at, status, error = k // 2, statuses[k // 2], errors_m[k // 2]
        if k % 2:
            status, error = (T if C in statuses[: at + 1] else S), 777.0
        place, radii = (EAST_M + 100.0 * at, NORTH_M + error), np.array([1.0, 2.0, radius_m])
        fixes.append(Fix(5.0 * k, *place, np.eye(2), radii, status, 1, 1.0, 0, 0.0, Reason.USED))
    estimate = TrackEstimate.of_fixes(CRS, "bayes", fixes)
    points = np.array([[0.0, 100.0, 400.0], [50.0, 51.0, 0.0]])
    area = SimpleNamespace(points=points, origin_m=(EAST_M, NORTH_M))
    return ottawa._scored(
        "carling", one, method, log, estimate, SimpleNamespace(model=SimpleNamespace(whole=area))
    )


def test_a_session_is_scored_at_its_good_fixes(tmp_path):
    statuses, errors = (S, S, C, T, L), (900.0, 60.0, 50.0, 20.0, 30.0)
    found = scored(tmp_path, "bayes", statuses, errors, [5.0, 20.0, 20.0, 5.0, 20.1])
    assert (found.part, found.session, found.method) == ("carling", "ride", "bayes")
    assert (found.converged, found.success, found.lost) == (True, True, 1)
    assert found.error_at_switch_m == pytest.approx(50.0, abs=1e-3)
    np.testing.assert_allclose(found.error_m, [50.0, 20.0], atol=1e-3)
    assert found.covered.tolist() == [False, True]
    # 2 m/s until 20 s.
    assert found.switch_m == pytest.approx(40.0)
    # Of four good fixes at 0, 100, 200 and 300 m the first lies 50 m from the map.
    assert found.on_map == pytest.approx(0.25)
    whole = scored(tmp_path, "smoothed", statuses, errors, [5.0, 20.0, 20.0, 5.0, 20.1])
    np.testing.assert_allclose(whole.error_m, [900.0, 60.0, 50.0, 20.0], atol=1e-3)
    assert whole.covered.tolist() == [False, False, False, True]
    late = scored(tmp_path, "bayes", statuses, errors, [5.0, 5.0, 30.0, 5.0, 5.0])
    assert late.error_at_switch_m == pytest.approx(20.0, abs=1e-3)
    wrong = scored(tmp_path, "bayes", statuses, (0, 0, 50.1, 0, 0), 5.0)
    assert (wrong.converged, wrong.success) == (True, False)


def test_a_session_that_never_converges(tmp_path):
    found = scored(tmp_path, "bayes", (S, S, S), (10.0, nan, 30.0), 5.0)
    assert (found.converged, found.success, found.lost) == (False, False, 0)
    assert np.isnan([found.switch_m, found.error_at_switch_m]).all()
    assert found.error_m.size == found.covered.size == 0
    whole = scored(tmp_path, "smoothed", (S, S, S), (10.0, nan, 30.0), 5.0)
    np.testing.assert_allclose(whole.error_m, [10.0, 30.0], atol=1e-3)
    assert np.isnan(scored(tmp_path, "bayes", (S, S), (1.0, 1.0), 99.0).on_map)
