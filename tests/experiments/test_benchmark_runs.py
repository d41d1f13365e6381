"""Runs of the benchmark: which ground truth, which map, which options, and which log."""

from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from grid_town import CRS, levels, streets

from mapfilter.experiments.benchmarks import global_positioning
from mapfilter.experiments.benchmarks.cases import CASES, USUAL
from mapfilter.experiments.benchmarks.global_positioning import Batch, informed, run_batch
from mapfilter.experiments.benchmarks.plain_runs import PlainCity
from mapfilter.filters.contract import Reason, Status
from mapfilter.positioning.bayes.options import BayesFilter
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.positioning.positioned_track import PositionedTrack
from mapfilter.positioning.step_output import Fix
from mapfilter.simulation.journeys import JourneyPlan
from mapfilter.simulation.reports import ReportModel
from mapfilter.simulation.satellites import ReceptionModel
from mapfilter.simulation.simulate import SimulationSettings
from mapfilter.tracks.imu_noise import ImuNoise

CHOICE = BayesFilter()
WORLD = SimulationSettings(journey=JourneyPlan(length_m=70.0))


@dataclass
class RecordedWorld:
    """A world whose ground truths shift all levels by a number, and whose filter is perfect."""

    settings: SimulationSettings = WORLD
    truths: list = field(default_factory=list)
    opened: list = field(default_factory=list)
    logs: list = field(default_factory=list)
    draws: list = field(default_factory=list)
    reception: ReceptionModel = field(default_factory=ReceptionModel)
    streets = streets()

    def ground_truth(self, seed, level_error_db=None):
        self.truths.append((seed, level_error_db))
        shift_db = float(seed % 20) + (100.0 if level_error_db else 0.0)
        return lambda east_m, north_m: levels(east_m, north_m) - shift_db / 10

    def skyline(self, _case):
        return None

    def filter(self, choice, *, thinned):
        self.opened.append((choice, thinned))

        def locate(log, rng):
            self.logs.append(log)
            self.draws.append(rng.random())
            table = log.truth
            fixes = [
                Fix(
                    float(t), float(e), float(n), np.eye(2), np.ones(3), Status.CONVERGED,
                    1, 1.0, 0, 0.0, Reason.USED,
                )
                for t, e, n in table[["time_s", "east_m", "north_m"]].to_numpy()
            ]  # fmt: skip
            return PositionedTrack(TrackEstimate.of_fixes(CRS, "bayes", fixes), (), 0.1)

        return locate


@pytest.fixture(autouse=True)
def located_by_the_world(monkeypatch):
    def locate(log, perfect, rng, *, risk):
        assert risk == 1e-3
        return perfect(log, rng)

    monkeypatch.setattr(global_positioning, "locate", locate)


def run(*cases, world=None, first=0, end=1, choice=CHOICE, seed=3, fixed=frozenset()):
    world = world or RecordedWorld()
    rows = run_batch(Batch(PlainCity(world, seed), choice, cases, first, end, fixed))
    return world, rows


def test_every_route_has_a_ground_truth_of_its_own():
    world, rows = run("levels-6", "cell-6", end=4)
    seeds = [seed for seed, _ in world.truths]
    # Drawn once for all cases of a route.
    assert len(seeds) == len(set(seeds)) == 4
    assert {error for _, error in world.truths} == {None}
    assert [row["route"] for row in rows] == [0, 0, 1, 1, 2, 2, 3, 3]
    assert [row["case"] for row in rows] == ["levels-6", "cell-6"] * 4
    # Numbers of the routes tell them, not the batch; another seed has others.
    assert run("levels-6", first=2, end=3)[0].truths == world.truths[2:3]
    assert run("levels-6", seed=4)[0].truths[0] not in world.truths


def test_only_one_case_has_10_db_in_the_same_ground_truth():
    names = [name for name in USUAL if not CASES[name].recovery_within_m]
    world, _ = run(*names)
    (seed, none), (again, error_db) = world.truths
    assert (none, error_db) == (None, 10.0)
    assert seed == again
    by_case = dict(zip(names, world.logs, strict=True))
    strange = by_case.pop("levels-error10").radio["level_dbm"].mean()
    usual = {by_case[n].radio["level_dbm"].mean() for n in by_case if CASES[n].levels}
    assert len(usual) == 1
    assert usual.pop() - strange == pytest.approx(10.0, abs=0.5)


def test_an_error_of_the_levels_that_was_set_holds_in_all_cases():
    world, _ = run("levels-6", "levels-error10", fixed=frozenset({"level_error_db"}))
    assert [error_db for _, error_db in world.truths] == [None]


def test_only_one_case_lacks_ways():
    world, _ = run(*USUAL)
    thinned = [name for name, (_, less) in zip(USUAL, world.opened, strict=True) if less]
    assert thinned == ["levels-missing10"]


def test_each_case_is_run_with_its_own_sheet():
    names = ("levels-3", "levels-bias20", "smooth-6", "levels-nocompass")
    world, _ = run(*names)
    for name, (choice, _) in zip(names, world.opened, strict=True):
        assert choice == informed(CHOICE, CASES[name])
    assert world.opened[2][0].smooth
    sheetless = frozenset({"heading_sd_deg", "bias_sd_deg"})
    world, _ = run("levels-bias20", fixed=sheetless)
    choice = world.opened[0][0]
    assert choice.heading_sd_deg == CHOICE.heading_sd_deg
    assert choice.bias_sd_deg == CHOICE.bias_sd_deg
    assert choice.scale == 0.1


def test_errors_of_the_world_never_reach_the_filter():
    harsh = replace(
        WORLD,
        imu=ImuNoise(
            period_s=2.0, sigma_trans_m=1.0, heading_correlation_s=20.0, step_scale_wander=0.2
        ),
        reports=ReportModel(fading_db=8.0, phone_offset_sd_db=9.0, hysteresis_db=1.0),
    )
    easy, _ = run(*USUAL)
    hard, _ = run(*USUAL, world=RecordedWorld(harsh))
    assert hard.opened == easy.opened
    for one, other in zip(easy.logs, hard.logs, strict=True):
        assert not one.motion.equals(other.motion)
        assert not one.radio.equals(other.radio)


def test_options_of_the_filter_never_reach_the_world():
    other = BayesFilter(step_sd_m=3.0, bias_sd_deg=57.0)
    first, _ = run("levels-6", "levels-nocompass")
    second, _ = run("levels-6", "levels-nocompass", choice=other)
    assert first.opened != second.opened
    assert first.truths == second.truths
    for one, again in zip(first.logs, second.logs, strict=True):
        assert one.motion.equals(again.motion)
        assert one.radio.equals(again.radio)
        assert one.truth.equals(again.truth)


def test_displaced_walks_are_those_of_recovery_only():
    world, rows = run("levels-6", "recovery-levels", "recovery-cell")
    lengths = [len(log.truth) for log in world.logs]
    assert lengths[0] == 51
    assert lengths[1] == lengths[2] > 1000
    assert [row["km"] for row in rows] == pytest.approx([0.07, 0.8, 0.8], abs=0.002)
    assert [row["switch_m"] for row in rows] == pytest.approx([0, 0, 0], abs=1e-6)


def test_each_run_of_a_filter_has_draws_of_its_own():
    world, _ = run("levels-6", "cell-6", "levels-10", end=2)
    assert len(set(world.draws)) == 6
    assert run("levels-6", "cell-6", "levels-10", end=2)[0].draws == world.draws


def test_fixed_errors_of_the_unit_hold_in_the_logs():
    settings = replace(WORLD, imu=ImuNoise(sigma_trans_m=0.0, sigma_orient_deg=0.0))
    world, _ = run(
        "levels-20", world=RecordedWorld(settings), fixed=frozenset({"imu.sigma_orient_deg"})
    )
    truth, motion = world.logs[0].truth, world.logs[0].motion
    heading = np.arctan2(np.diff(truth["north_m"]), np.diff(truth["east_m"]))
    np.testing.assert_allclose(np.cos(motion["heading_rad"] - heading), 1.0)


def test_windows_are_scored_with_satellites_only():
    world, rows = run("levels-6", "satellites-2")
    assert "window_median_m" not in rows[0]
    assert rows[1]["window_median_m"] == 0.0
    assert world.logs[0].pseudoranges.empty
    assert not world.logs[1].pseudoranges.empty


def test_satellites_are_received_as_in_the_world():
    noisy = RecordedWorld(reception=ReceptionModel(zenith_m=50.0))
    usual, _ = run("satellites-2")
    other, _ = run("satellites-2", world=noisy)
    ranges = [world.logs[0].pseudoranges["pseudorange_m"].to_numpy() for world in (usual, other)]
    assert 30.0 < (ranges[1] - ranges[0]).std() < 300.0
