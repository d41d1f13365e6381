"""Displacements of the benchmark: real, and not measured by anything but the radio."""

from dataclasses import replace

import numpy as np
import pytest
from grid_town import levels, streets

from mapfilter.errors import InputError
from mapfilter.experiments.benchmarks.cases import CASES
from mapfilter.experiments.benchmarks.journeys import displaced_walk, log_of
from mapfilter.simulation.journeys import JourneyPlan
from mapfilter.simulation.reports import ReportModel
from mapfilter.simulation.simulate import SimulationSettings
from mapfilter.simulation.walking import WalkerModel
from mapfilter.tracks.deadreckoning import dead_reckon
from mapfilter.tracks.imu_noise import ImuNoise

SEED = 5
NUMBERS = range(12)
FIXED = frozenset({"imu.sigma_orient_deg"})


@pytest.fixture(scope="module")
def town():
    return streets()


@pytest.fixture(scope="module")
def walks(town):
    return [displaced_walk(town, JourneyPlan(), SEED, number) for number in NUMBERS]


def steps(walked):
    table = walked.truth
    return np.hypot(np.diff(table["east_m"]), np.diff(table["north_m"]))


def test_one_walks_800_m_is_carried_and_walks_1_km(walks):
    carried_m = []
    for walked in walks:
        step_m, time_s = steps(walked), walked.truth["time_s"].to_numpy()
        np.testing.assert_allclose(np.diff(time_s), 1.0)
        cut = round(walked.displaced_at_s)
        assert time_s[cut] == walked.displaced_at_s
        assert walked.arrived_at_s == walked.displaced_at_s + 1.0
        carried_m.append(step_m[cut])
        assert np.delete(step_m, cut).max() <= 1.4 + 1e-6
        assert 800.0 <= step_m[:cut].sum() < 802.0
        assert 998.0 < step_m[cut + 1 :].sum() < 1000.1
    # As far as was drawn, and at most a step farther.
    assert min(carried_m) >= 200.0
    assert max(carried_m) < 1001.4
    assert np.ptp(carried_m) > 200.0


def test_a_block_is_too_small_to_be_displaced_in(monkeypatch):
    monkeypatch.setattr("grid_town.SIZE", 2)
    monkeypatch.setattr("mapfilter.experiments.benchmarks.journeys._ATTEMPTS", 3)
    with pytest.raises(InputError, match=r"streets over 200 m and more.*found 1\d\d x 1\d\d m"):
        displaced_walk(streets(), JourneyPlan(), SEED, 0)


def test_displaced_walks_are_drawn_by_number_and_seed(town, walks):
    again = displaced_walk(town, JourneyPlan(), SEED, 3)
    assert again.truth.equals(walks[3].truth)
    other = displaced_walk(town, JourneyPlan(), SEED + 1, 3)
    assert not other.truth.equals(walks[3].truth)


def test_walkers_who_stop_are_displaced_after_as_many_metres(town):
    plan = JourneyPlan(walker=WalkerModel(5.0, stop_every_m=100.0, stop_s=20.0))
    walked = displaced_walk(town, plan, SEED, 1)
    step_m, cut = steps(walked), round(walked.displaced_at_s)
    assert cut > 800 / 1.4 + 30
    assert 200.0 <= step_m[cut] < 1001.4
    assert 800.0 <= step_m[:cut].sum() < 802.0


def logged(town, walked, period_s=1.0, name="recovery-levels", **imu):
    errors = ImuNoise(**{"sigma_trans_m": 0.0, "sigma_orient_deg": 0.0, **imu})
    settings = SimulationSettings(
        imu=replace(errors, period_s=period_s), reports=ReportModel(fading_db=0.0, quantise=False)
    )
    return log_of(CASES[name], walked, levels, town, settings, SEED, 0, FIXED)


@pytest.mark.parametrize("period_s", [0.3, 0.5, 0.7, 1.0, 2.0, 3.0])
@pytest.mark.parametrize("turns", ["headings", "gyro"])
def test_no_step_and_no_turn_measures_it(town, walks, period_s, turns):
    for walked in walks[:4]:
        log = logged(town, walked, period_s, turns=turns)
        step_m, heading = log.motion["step_m"].to_numpy(), log.motion["heading_rad"].to_numpy()
        assert step_m.max() <= 1.4 * period_s + 1e-6
        # Without it, one would be at the end by as much beside the truth as one was carried.
        start = walked.truth[["east_m", "north_m"]].iloc[0]
        east, north = dead_reckon(*start, step_m, heading)
        time_s, truth = log.motion["time_s"].to_numpy(), walked.truth
        cut = round(walked.displaced_at_s)
        gap = np.diff(truth[["east_m", "north_m"]].to_numpy()[cut : cut + 2], axis=0)[0]
        moved = time_s >= walked.arrived_at_s
        missing_east = np.interp(time_s, truth["time_s"], truth["east_m"]) - east
        missing_north = np.interp(time_s, truth["time_s"], truth["north_m"]) - north
        np.testing.assert_allclose(missing_east[moved], gap[0], atol=1e-4)
        np.testing.assert_allclose(missing_north[moved], gap[1], atol=1e-4)
        np.testing.assert_allclose(missing_east[time_s <= walked.displaced_at_s], 0.0, atol=1e-4)
        # Turns lead from each heading to the next, that of the displacement not among them.
        turned = np.angle(np.exp(1j * (heading[0] + np.cumsum(log.motion["turn_rad"][1:]))))
        np.testing.assert_allclose(np.cos(turned - heading[1:]), 1.0, atol=1e-9)
        way = np.arctan2(gap[1], gap[0])
        about = np.abs(time_s - walked.arrived_at_s) <= max(period_s, 1.0)
        assert np.abs(np.sin((heading[about] - way) / 2)).min() > 1e-6


def test_being_carried_makes_no_noisy_steps(town, walks):
    log = logged(town, walks[0], sigma_trans_m=0.2)
    step_m = log.motion["step_m"].to_numpy()
    assert np.flatnonzero(step_m == 0).tolist() == [round(walks[0].displaced_at_s)]


def test_the_radio_is_received_where_one_really_is(town, walks):
    walked = walks[0]
    log = logged(town, walked)
    for at_s in (walked.displaced_at_s, walked.arrived_at_s, walked.arrived_at_s + 100):
        there = walked.truth[walked.truth["time_s"] == at_s]
        level = levels(there["east_m"].to_numpy(), there["north_m"].to_numpy())[0]
        row = log.radio[(log.radio["time_s"] == at_s) & (log.radio["role"] == "serving")].iloc[0]
        assert row["level_dbm"] == pytest.approx(level[int(row["cell"][1:])], abs=1e-6)
    assert log.truth.equals(walked.truth)


def test_cells_alone_after_a_displacement(town, walks):
    log = logged(town, walks[0], name="recovery-cell")
    assert set(log.radio["role"]) == {"serving"}
    assert log.radio["level_dbm"].isna().all()
