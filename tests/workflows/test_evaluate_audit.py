"""The audit of the benchmark: one change at a time, and what it reports."""

import json
from dataclasses import fields, replace

import pytest
from command_line import assert_done, assert_refused, mapfilter, settings

from mapfilter.experiments.benchmarks.cases import CASES
from mapfilter.experiments.benchmarks.results import CaseResult
from mapfilter.propagation.models import GroundTruthErrors, PredictionModel
from mapfilter.simulation.reports import ReportModel
from mapfilter.simulation.walking import WalkerModel
from mapfilter.tracks.imu_noise import ImuNoise
from mapfilter.workflows.evaluate import _world as prepare_world
from mapfilter.workflows.evaluations.audit import CHANGES
from mapfilter.workflows.evaluations.settings import load_benchmark
from mapfilter.workflows.inputs.filter_choice import filter_choice
from mapfilter.workflows.inputs.world import World
from mapfilter.workflows.simulate import simulation_settings

EASY = (
    PredictionModel(shadowing_db=6.0),
    GroundTruthErrors(level_error_db=7.0, correlation_m=50.0, clutter="shared"),
    ImuNoise(sigma_trans_m=0.2),
    ReportModel(fading_db=1.0),
    WalkerModel(),
)
MODEL, ERRORS, IMU, REPORTS, WALKER = EASY
HARD = {
    "heading": {"sigma_orient_deg": 10, "heading_correlation_s": 20.0},
    "scale": {"step_scale_wander": 0.1, "step_scale_correlation_s": 15.0},
}
OWN = replace(ERRORS, clutter="own")

# Row by row: what of the easy world is another.
EXPECTED = {
    "easy": EASY,
    "own-clutter": (MODEL, OWN, IMU, REPORTS, WALKER),
    "no-clutter": (PredictionModel(), ERRORS, IMU, REPORTS, WALKER),
    # As far off as with 6 dB of clutter in the prediction and other 6 dB in the ground truth.
    "noisy-truth": (PredictionModel(), replace(ERRORS, level_error_db=9.22), IMU, REPORTS, WALKER),
    "heading": (MODEL, ERRORS, replace(IMU, **HARD["heading"]), REPORTS, WALKER),
    "gyro": (
        MODEL,
        ERRORS,
        replace(
            IMU,
            turns="gyro",
            gyro_noise_deg_per_sqrt_s=0.2,
            gyro_bias_deg_per_s=0.05,
        ),
        REPORTS,
        WALKER,
    ),
    "beside": (MODEL, ERRORS, IMU, REPORTS, WalkerModel(8.0)),
    "scale": (MODEL, ERRORS, replace(IMU, **HARD["scale"]), REPORTS, WALKER),
    "fading": (MODEL, ERRORS, IMU, ReportModel(fading_db=4.0), WALKER),
    "model": (
        MODEL,
        replace(
            ERRORS,
            model="tr38901_uma",
            offset_db=5.0,
            street_width_m=15.0,
            building_separation_m=50.0,
            default_roof_height_m=15.0,
            roof_error=0.2,
        ),
        IMU,
        REPORTS,
        WALKER,
    ),
    "lengths": (
        MODEL,
        replace(ERRORS, local_share=0.5, local_correlation_m=15.0, correlation_m=100.0),
        IMU,
        REPORTS,
        WALKER,
    ),
    "phone": (MODEL, ERRORS, IMU, replace(REPORTS, phone_offset_sd_db=4.0), WALKER),
    "stops": (MODEL, ERRORS, IMU, REPORTS, WalkerModel(stop_every_m=300.0, stop_s=20.0)),
    "all-but-gyro": (
        MODEL,
        OWN,
        replace(IMU, **HARD["heading"], **HARD["scale"]),
        ReportModel(fading_db=4.0),
        WalkerModel(8.0),
    ),
}


def load(name):
    change = CHANGES[name]
    given = [f"{key}={value}" for key, value in change.settings.items()]
    return load_benchmark(change.world, None, given)


def simulated(config):
    made = simulation_settings(config)
    return (
        config.prediction.of(PredictionModel),
        config.prediction.ground_truth.of(GroundTruthErrors),
        made.imu,
        made.reports,
        made.journey.walker,
    )


@pytest.mark.parametrize("name", EXPECTED)
def test_a_row_differs_from_the_easy_world_in_what_it_says(name):
    config, fixed = load(name)
    assert simulated(config) == EXPECTED[name]
    # The filter is not told.
    assert filter_choice(config.filter) == filter_choice(load("easy")[0].filter)
    change = CHANGES[name]
    assert change.world == "easy"
    assert change.case == ("levels-nocompass" if name == "gyro" else "levels-6")
    errors = CASES[change.case].errors_in(simulation_settings(config).imu, fixed)
    expected_deg = 10.0 if name in ("heading", "all-but-gyro") else 6.0
    assert errors.sigma_orient_deg == expected_deg
    assert CASES[change.case].data_sheet == {"heading_sd_deg": 6.0}


def test_the_rows_of_the_plain_world():
    plain, _ = load_benchmark("plain", None, [])
    assert simulated(load("plain")[0]) == simulated(plain)
    model, *others = simulated(load("plain-clutter")[0])
    assert model == PredictionModel(shadowing_db=6.0)
    assert others == list(simulated(plain)[1:])
    assert {name for name, change in CHANGES.items() if change.world == "plain"} == {
        "plain",
        "plain-clutter",
        "plain-noisy-truth",
    }
    noisy, _ = load_benchmark("plain", None, ["prediction.ground_truth.level_error_db=7.81"])
    assert simulated(load("plain-noisy-truth")[0]) == simulated(noisy)
    assert set(CHANGES) == {*EXPECTED, "plain", "plain-clutter", "plain-noisy-truth"}
    assert all(name == change.name for name, change in CHANGES.items())


def audit(world, out, *more):
    given = ["-c", world.benchmark_toml, "--filter", "candidate", "--runs", 2, "--workers", 1]
    place = [] if out is None else ["--out", out]
    return mapfilter("evaluate", "audit", *given, *place, "--json", *more)


def test_a_table_of_two_rows(world, tmp_path):
    more = ["--case", "fading", "--case", "easy", "--case", "fading", "--seed", 7]
    found = assert_done(audit(world, tmp_path, *more)).json
    assert set(found) == {"map", "seed", "rows", "seconds", "out"}
    assert found["seed"] == 7
    assert [row["name"] for row in found["rows"]] == ["fading", "easy"]
    for row in found["rows"]:
        assert set(row) == {"name", "change", "world", "case", "settings", "result"}
        assert set(row["result"]) == {field.name for field in fields(CaseResult)}
        assert (row["world"], row["case"], row["result"]["name"]) == (
            "easy",
            "levels-6",
            "levels-6",
        )
        assert (row["result"]["runs"], row["result"]["filter"]) == (2, "candidate")
        assert (tmp_path / row["name"] / "table.json").is_file()
    fading, easy = found["rows"]
    assert (fading["settings"], easy["settings"]) == ({"journeys.fading_db": "4"}, {})
    assert fading["change"] == "4 dB of fading"
    assert json.loads((tmp_path / "table.json").read_text()) == found
    again = assert_done(audit(world, tmp_path, *more, "--resume")).json
    assert [row["result"] for row in again["rows"]] == [row["result"] for row in found["rows"]]


def test_a_row_is_the_benchmark_with_its_settings(world, tmp_path):
    row = assert_done(audit(world, tmp_path / "a", "--case", "fading")).json["rows"][0]
    given = ["-c", world.benchmark_toml, "--filter", "candidate", "--runs", 2, "--workers", 1]
    given += ["--case", "levels-6", "--world", "easy", *settings(journeys__fading_db=4)]
    told = mapfilter("evaluate", "global-positioning", *given, "--out", tmp_path / "b", "--json")
    (case,) = assert_done(told).json["cases"]
    times = {f"seconds_per_track{end}": None for end in ("", "_low", "_high")}
    assert {**case, **times} == {**row["result"], **times}
    # Of the same world, which is not the unchanged one.
    ran, alone = (
        json.loads((folder / "benchmark.json").read_text())
        for folder in (tmp_path / "a" / "fading", tmp_path / "b")
    )
    assert ran == alone
    unchanged = load_benchmark("easy", world.benchmark_toml, [])[0]
    made, _ = prepare_world(World.of(unchanged), tmp_path / "easy", 0)
    assert made.sha256 != ran["world"]


def test_the_audit_goes_to_the_output_folder_that_is_set(world, tmp_path):
    more = ["--case", "easy", *settings(output__dir=tmp_path / "mine")]
    found = assert_done(audit(world, None, *more, "--runs", 1)).json
    assert found["out"] == str(tmp_path / "mine" / "audit")


def test_a_row_that_is_not_there_is_refused(world, tmp_path):
    told = audit(world, tmp_path / "out", "--case", "levels-6", "--case", "darkness")
    assert_refused(told, "--case", "own-clutter", "darkness")
    assert not (tmp_path / "out").exists()
