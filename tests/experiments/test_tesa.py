"""TESA's scene by hand, and its claims on few trials with few particles."""

import json
from pathlib import Path

import numpy as np
import pytest

from mapfilter._parallel import SerialExecutor
from mapfilter.errors import InputError
from mapfilter.experiments.papers.paper import PaperSettings
from mapfilter.experiments.papers.tesa import experiment as tesa
from mapfilter.experiments.papers.tesa import scene
from mapfilter.experiments.papers.tesa.paper import estimate
from mapfilter.models.signal_strength import levels
from mapfilter.models.state import POSITION_CLOCK_3D
from mapfilter.simulation.drives import (
    ahead_and_left,
    clock_walk_m,
    shadowing_db,
    straight_drive,
)

CASES = json.loads((Path(__file__).parents[1] / "fusion_cases.json").read_text(encoding="utf-8"))
RUNS = (
    tesa.Run(1, "identity"), tesa.Run(1, "identity", 1.0), tesa.Run(2, "identity"),
    tesa.Run(2, "identity", 1.0), tesa.Run(2, "velocity", 1.0),
    tesa.Run(2, "known-bearing", 1.0), tesa.Run(3, "velocity"), tesa.Run(3, "velocity", 1.0),
)  # fmt: skip


@pytest.mark.parametrize("case", CASES["friis_dbm"], ids=lambda case: str(case["d"]))
def test_power_of_the_reference(case):
    model = levels(
        POSITION_CLOCK_3D, [[0.0, 0.0, 0.0]], 1.0, loss_at_km_db=scene.loss_at_km_db(),
        exponent=2.0, eirp_dbm=scene.EIRP_DBM,
    )  # fmt: skip
    assert model.mean([case["d"], 0.0, 0.0, 9.0])[0] == pytest.approx(case["dbm"], rel=1e-10)


def test_the_scene():
    found = scene.tesa_scene()
    assert found.drive.time_s[[0, -1]].tolist() == [1.0, 720.0]
    assert np.hypot(*found.drive.place_m[-1, :2]) == pytest.approx(9456.0)
    assert np.diff(found.drive.travelled_m) == pytest.approx(9456 / 720)
    assert found.outage.sum() == 200
    assert found.satellites_m.shape == (720, 5, 3)
    # The five highest are well above the horizon, so their noise is small and alike.
    assert 2.0 < found.range_sigma_m.min() < found.range_sigma_m.max() < 4.0
    aside = found.stations_m[:, :2] @ [-np.cos(np.radians(200)), np.sin(np.radians(200))]
    np.testing.assert_allclose(aside, scene.STATIONS_LEFT_M, atol=1e-9)


def test_readings_are_what_filters_take_them_for():
    found, rng = scene.tesa_scene(), np.random.default_rng(1)
    ranges, level, shadow = scene.draw_readings(found, rng)
    model = tesa.measurements(found, "identity", 1.0)[300]
    clock = ranges[300] - np.linalg.norm(found.satellites_m[300] - found.drive.place_m[300], axis=1)
    state = np.array([*found.drive.place_m[300], clock.mean()])
    mean, slope = np.empty((12, 1)), np.zeros((12, 4, 1))
    model.measure(state[:, None], model.slots, model.rows, model.patterns, mean, slope, False)
    np.testing.assert_allclose(mean[5:, 0], level[300], atol=1e-9)
    assert np.abs(mean[:5, 0] - ranges[300]).max() < 15
    assert shadow.std() == pytest.approx(1.0, abs=0.2)
    assert np.diag(model.noise)[5:] == pytest.approx(1.0)


def test_only_the_known_bearing_model_depends_on_the_bearing():
    east_north = np.ix_((0, 1), (0, 1))
    for beta in (None, 1.0):
        identity = tesa.assumed("identity", beta).motion.noise
        np.testing.assert_array_equal(identity[east_north], 25.0**2 * np.eye(2))
        noise = tesa.assumed("velocity", beta).motion.noise
        np.testing.assert_array_equal(noise[:2, :2], noise[2:4, 2:4])
        assert not noise[:2, 2:4].any()
    known = tesa.assumed("known-bearing").motion.noise[east_north]
    ahead, left = ahead_and_left(scene.BEARING_DEG)
    assert (ahead @ known @ ahead, left @ known @ left) == pytest.approx((625.0, 25.0))


def test_shadowing_is_a_state_of_each_station_in_the_velocity_model():
    known = tesa.assumed("velocity", 4.0)
    assert known.layout.size == 13
    # Stationary: the process keeps the variance that it starts with.
    phi, noise, first = known.motion.transition, known.motion.noise, known.first_covariance
    own = np.ix_(known.shadowing, known.shadowing)
    np.testing.assert_allclose((phi @ first @ phi.T + noise)[own], 16.0 * np.eye(7))
    assert phi[6, 6] == pytest.approx(np.exp(-50 / 3.6 / 100))
    adds = known.loading(12)
    assert not adds[:5].any()
    np.testing.assert_array_equal(adds[5:, 6:], np.eye(7))
    for motion, beta in (("velocity", None), ("identity", 4.0)):
        assert tesa.assumed(motion, beta).loading(12) is None
    model = tesa.measurements(scene.tesa_scene(), "velocity", 4.0)[0]
    assert np.sqrt(np.diag(model.noise)[5:]) == pytest.approx(0.29)


def test_filters_start_around_a_drawn_start():
    rng = np.random.default_rng(4)
    starts = np.array([scene.draw_start_m(rng) for _ in range(2000)])
    assert starts.std(axis=0) == pytest.approx([50.0, 50.0, 10.0], rel=0.06)
    # 3.6 standard deviations of the mean.
    assert (np.abs(starts.mean(axis=0)) < [4.0, 4.0, 0.8]).all()
    for motion in ("velocity", "identity", "known-bearing"):
        known = tesa.assumed(motion, 1.0)
        mean = known.first_mean(starts[0])
        np.testing.assert_array_equal(mean[list(known.sampled)], starts[0])
        assert np.count_nonzero(mean) == 3


def test_a_halt_on_the_way():
    steady, halted = scene.tesa_scene().drive, scene.tesa_scene(halt=True).drive
    np.testing.assert_allclose(halted.travelled_m[:240], steady.travelled_m[:240])
    speed_mps = np.diff(halted.travelled_m)
    assert speed_mps[254:298] == pytest.approx(0.0)
    assert speed_mps[314:] == pytest.approx(9456 / 720)
    assert np.abs(np.diff(speed_mps)).max() < 1.0 + 1e-9
    assert np.hypot(*halted.place_m[-1, :2]) == pytest.approx(halted.travelled_m[-1])


def test_claims_hold_with_few_particles():
    outage = scene.tesa_scene().outage
    errors = np.stack([tesa.trial_errors_m(trial, 3, 1500, RUNS) for trial in range(2)], axis=1)
    gnss, hybrid, alone, identity, velocity, bearing, halted_alone, halted = errors
    assert hybrid.mean() < gnss.mean() + 0.5 < 7.5
    assert alone[:, outage].mean() == pytest.approx(1313, abs=80)
    assert identity[:, outage].mean() < 250
    assert max(velocity[:, outage].mean(), bearing[:, outage].mean()) < 150
    assert halted[:, outage].mean() < 0.5 * halted_alone[:, outage].mean()
    assert (alone < 100).mean() == pytest.approx(0.72, abs=0.03)
    assert (velocity[:, 500:] < 50).all()
    # Before the outage both scenarios are alike.
    assert np.abs(gnss[:, 20:199].mean() - alone[:, 20:199].mean()) < 0.5


def test_equal_seeds_give_equal_errors():
    first, again, other = (tesa.trial_errors_m(0, seed, 50, RUNS[2:3]) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert (first != other).any()


@pytest.mark.parametrize("executor", [SerialExecutor(), None])
def test_a_paper_run_holds_all_runs(executor, monkeypatch):
    monkeypatch.setattr(
        tesa, "trial_errors_m", lambda trial, seed: np.full((14, 720), trial + seed)
    )
    done = []
    given = PaperSettings(3, 1, executor, progress=lambda *told: done.append(told))
    run = tesa.run_paper(given)
    assert len(run.errors_m) == len(tesa.RUNS) == 14
    assert run.errors_m[tesa.RUNS[5]][:, 7].tolist() == [1, 2, 3]
    assert done == [(1, 3), (2, 3), (3, 3)]


def test_estimates_of_means():
    rng = np.random.default_rng(5)
    inside = 0
    for _ in range(400):
        found = estimate(rng.normal(3.0, 2.0, 50))
        inside += found.low < 3.0 < found.high
    assert 0.91 < inside / 400 < 0.98
    whole, cut = (estimate(np.array([0.7, 0.9, 1.0]), 0.0, most) for most in (2.0, 1.0))
    assert whole.high > 1.0
    assert cut == (whole.value, whole.low, 1.0)


def test_drives():
    drive, rng = straight_drive(7000.0, 30.0, 500.0, 0.5), np.random.default_rng(2)
    assert drive.time_s.size == 1000
    shadow = shadowing_db(drive, 300, 4.0, 100.0, rng)
    assert shadow.std() == pytest.approx(4.0, abs=0.1)
    lag = np.mean(shadow[20:] * shadow[:-20]) / 16
    assert lag == pytest.approx(np.exp(-140 / 100), abs=0.04)
    walk = clock_walk_m(1000, 0.5, 100.0, rng)
    assert np.diff(walk).std() == pytest.approx(0.5, abs=0.05)
    for bad in ((0.0, 0.0, 1.0), (1.0, np.nan, 1.0), (1.0, 0.0, -1.0), (1.0, 0.0, 1.0, 0.0)):
        with pytest.raises(InputError, match="drive"):
            straight_drive(*bad)
