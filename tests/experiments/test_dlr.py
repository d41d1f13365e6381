"""DLR's scene by hand, its readings, and its claims on few tracks with few particles."""

import json
from pathlib import Path

import numpy as np
import pytest

from mapfilter._parallel import SerialExecutor
from mapfilter.experiments.papers.dlr import experiment as dlr
from mapfilter.experiments.papers.dlr import filters, scene
from mapfilter.experiments.papers.dlr import paper as dlr_table
from mapfilter.experiments.papers.dlr.pictures import over_threshold
from mapfilter.experiments.papers.dlr.scene import ASSUMPTIONS
from mapfilter.experiments.papers.paper import PaperSettings
from mapfilter.models.state import POSITION_CLOCK_3D
from mapfilter.positioning.kalman.static_fix import TOO_FEW

CASES = json.loads((Path(__file__).parents[1] / "fusion_cases.json").read_text(encoding="utf-8"))
CASE = CASES["gauss_newton"]
SATELLITES, STATIONS = np.array(CASE["sats"]), np.array(CASE["bs"])


@pytest.fixture(scope="module")
def place():
    return scene.dlr_scene()


@pytest.fixture(scope="module")
def track(place):
    return scene.draw_track(place, np.random.default_rng(21))


def test_the_page_tells_all_assumptions():
    page = Path(__file__).parents[2] / "docs" / "explanation" / "canyon.rst"
    told = " ".join(page.read_text(encoding="utf-8").split())
    assert [one for one in ASSUMPTIONS if one not in told] == []


def test_the_canyon_and_its_network(place, track):
    assert len(place.houses) == 25
    assert {round(house.area) for house in place.houses} == {6400}
    edge, near = (
        np.sort(np.hypot(*place.stations_m[where][:, :2].T)) for where in ("edge", "near")
    )
    np.testing.assert_allclose(edge[:3], 1500 / np.sqrt(3))
    assert near[0] == pytest.approx(200.0)
    assert near[1] > 1200
    assert track.place_m.shape == (290, 3)
    assert np.hypot(*np.diff(track.place_m[:, :2], axis=0).T).max() < 1.6
    assert (np.abs(track.place_m[:, :2]) <= 170).all()


def test_houses_hide_satellites_and_stations_alike(place, track):
    assert 10 < track.gps.size < 25
    assert 3 < track.seen.sum(axis=1).mean() < 9
    assert track.seen.sum() < 0.6 * track.seen.size
    for where in ("edge", "near"):
        assert track.stations_seen[where].mean() < 0.3
    # In the middle of a street, what stands low across it is hidden.
    middle = np.array([[52.5, 0.0, 1.5]])
    low, along = np.array([[2e7, 0.0, 1e7]]), np.array([[0.0, 2e7, 1e7]])
    assert not place.skyline.seen(middle, scene.directions(low))[0, 0]
    assert place.skyline.seen(middle, scene.directions(along))[0, 0]


def test_readings_are_what_the_models_say(place, track):
    readings = scene.draw_readings(place, track, np.random.default_rng(22))
    assert (np.isfinite(readings.ranges_m) == track.seen).all()
    away = np.linalg.norm(track.satellites_m - track.place_m[:, None], axis=2)
    off = readings.open_m - away
    free = off - off.mean(axis=1, keepdims=True)
    assert free.std() == pytest.approx(np.sqrt(np.mean(track.sigma_m**2)), rel=0.1)
    echo = (readings.ranges_m - readings.open_m)[track.seen]
    assert (echo >= 0).all()
    assert echo.mean() == pytest.approx(3.0, abs=0.6)
    distance = np.linalg.norm(place.stations_m["edge"] - track.place_m[:, None], axis=2)
    wrong = readings.times_m["edge"] - distance
    strong = track.sinr_db["edge"] > -10
    assert np.median(wrong[strong]) > 0
    assert np.abs(wrong[strong]).max() < 200
    assert np.abs(wrong[track.sinr_db["edge"] < -28]).max() > 1000


def test_differences_refer_to_the_best_station():
    layout, times = filters.FLAT, np.arange(4.0)[None] * 100
    sinr = np.array([[-12.0, -3.0, -20.0, -15.0]])
    three = filters.differences(layout, STATIONS, sinr, times)[0]
    assert three.reading.tolist() == [-100.0, 200.0]
    sigma = np.hypot(scene.ARRIVAL.sigma_m(sinr[0]), scene.DETOUR_M)
    # As in the reference: the reference's variance is common to all.
    np.testing.assert_allclose(
        three.model.covariance(), np.diag(sigma[[0, 3]] ** 2) + sigma[1] ** 2, rtol=1e-12
    )
    above = filters.differences(layout, STATIONS, sinr, times, -17.0)[0]
    assert above.reading.size == 2
    assert filters.differences(layout, STATIONS, sinr, times, -5.0)[0].model is None


def test_two_satellites_and_two_stations_are_not_enough():
    seen = filters.satellites(
        POSITION_CLOCK_3D, SATELLITES[:2], np.array(CASE["s_pr"][:2]), np.array([CASE["y"][:2]])
    )
    heard = filters.differences(
        POSITION_CLOCK_3D, STATIONS[:2], np.zeros((1, 2)), np.array([[0.0, CASE["y"][5]]])
    )
    fix = filters.run_static(POSITION_CLOCK_3D, filters.joined(seen, heard))[0]
    assert fix.ok is CASES["dlr_two_sats_two_bs_underdetermined_ok"]
    assert fix.problem == TOO_FEW


def test_pseudoranges_and_differences_give_the_reference_fix():
    seen = filters.satellites(
        POSITION_CLOCK_3D, SATELLITES, np.array(CASE["s_pr"]), np.array([CASE["y"][:5]])
    )
    fix = filters.run_static(POSITION_CLOCK_3D, seen)[0]
    np.testing.assert_allclose(fix.state, CASE["gnss_only"]["x"], rtol=1e-10, atol=5e-8)


@pytest.mark.parametrize("mobility", ["diagonal", "discretised"])
def test_mobility(mobility):
    moving = filters.motion(filters.HYBRID, mobility)
    np.testing.assert_allclose(moving.transition[0, :2], [1.0, 1.0])
    assert moving.transition[6, 6] == 1
    block = moving.noise[:2, :2] / filters.DRIFT_MPS**2
    expected = np.diag([(filters.DRIFT_M / filters.DRIFT_MPS) ** 2, 1.0])
    np.testing.assert_allclose(
        block, expected if mobility == "diagonal" else [[1 / 3, 1 / 2], [1 / 2, 1]]
    )
    assert moving.noise[6, 6] == pytest.approx(scene.CLOCK_M**2)


def test_claims_hold_on_few_tracks():
    keys = (
        dlr.STATIC, dlr.PKF, dlr.EKF, dlr.AT_EDGE, dlr.TDOA_EKF, dlr.TDOA_EKF_NEAR,
        dlr.Run("ekf", open_sky=True),
    )  # fmt: skip
    found = np.stack([dlr.track_errors(trial, 31, runs=keys).errors_m for trial in range(4)], 1)
    errors = dict(zip(keys, found, strict=True))
    fixed = np.isfinite(errors[dlr.STATIC])
    at_90 = {key: np.quantile(own[fixed], 0.9) for key, own in errors.items()}
    assert 0.6 < fixed.mean() < 1
    assert at_90[dlr.STATIC] > 1.3 * at_90[dlr.PKF] > 1.3 * at_90[dlr.EKF]
    assert at_90[dlr.AT_EDGE] < 0.9 * at_90[dlr.EKF]
    assert at_90[dlr.TDOA_EKF] < 0.5 * at_90[dlr.TDOA_EKF_NEAR]
    assert at_90[dlr.Run("ekf", open_sky=True)] < 3


def test_particles_tell_what_the_kalman_filter_does():
    kalman, particles = dlr.track_errors(2, 31, 6000, (dlr.EKF, dlr.PF)).errors_m
    assert np.quantile(particles, 0.9) == pytest.approx(np.quantile(kalman, 0.9), rel=0.25)


def test_equal_seeds_give_equal_errors():
    keys = (dlr.AT_EDGE, dlr.TDOA_PF)
    first, again, other = (dlr.track_errors(0, seed, 50, keys).errors_m for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert (first != other).all(axis=1).any()
    one, two = (dlr.errors_over_time(draw, 0, 1) for draw in (0, 1))
    assert one.shape == (3, 290)
    assert (one != two).any()


def made(trial, seed):
    """Ten epochs a track; track 1 has a quarter critical, and four epochs without a fix."""
    rng = np.random.default_rng([trial, seed])
    errors = rng.exponential(10.0, (len(dlr.RUNS), 10))
    seen = np.full(10, 6)
    if trial == 1:
        seen[:2] = 3
        errors[dlr.RUNS.index(dlr.STATIC), :4] = np.nan
    return dlr.TrackErrors(errors, seen, seen - 3)


@pytest.mark.parametrize("executor", [SerialExecutor(), None])
def test_a_paper_run_and_its_table(executor, monkeypatch):
    monkeypatch.setattr(dlr, "track_errors", made)
    monkeypatch.setattr(
        dlr, "errors_over_time", lambda draw, trial, seed: np.full((3, 10), draw + trial + seed)
    )
    monkeypatch.setattr(dlr, "DRAWS", 2)
    told = []
    given = PaperSettings(3, 5, executor, progress=lambda *done: told.append(done))
    run = dlr.run_paper(given)
    assert told == [(1, 5), (2, 5), (3, 5), (4, 5), (5, 5)]
    assert run.shown == 1
    assert run.over_time_m[:, 0, 0].tolist() == [6, 7]
    assert [run.epochs[name].sum() for name in ("critical", "fixed", "every")] == [2, 26, 30]
    found = dlr_table.figures(run)
    assert found["all"]["ekf"].epochs == found["all"]["static"].epochs == 26
    assert found["critical"]["edge"].epochs == 2
    assert np.isnan(found["every_epoch"]["static"].value)
    assert found["every_epoch"]["ekf"].value == found["hybrid"]["ekf_gnss"].value
    ratios = dlr_table.ratios(run)
    at = {name: one.value for name, one in found["hybrid"].items()}
    assert ratios["edge_over_gnss"].value == pytest.approx(at["ekf_edge"] / at["ekf_gnss"])
    rows = dlr_table.rows(run)
    assert len(rows) == 4 * len(dlr.RUNS)
    static = next(row for row in rows if row["filter"] == "static" and row["epochs"] == "every")
    assert static["located"] == pytest.approx(26 / 30)
    assert len(over_threshold(run, "edge")) == len(dlr.THRESHOLDS_DB)
    assert set(dlr.PUBLISHED) == set(found) - {"every_epoch"}
    for group, names in dlr.PUBLISHED.items():
        assert set(names) == set(found[group])
