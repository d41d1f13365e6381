"""The simulated worlds of the benchmark: their files, and what is made of them on a small map."""

import tomllib
from dataclasses import replace
from importlib.resources import files

import numpy as np
import pytest
from command_line import assert_refused, mapfilter
from pydantic import BaseModel

from mapfilter.config.sections import Config
from mapfilter.database.store import open_database
from mapfilter.errors import ConfigError
from mapfilter.propagation.models import GroundTruthErrors, PredictionModel
from mapfilter.simulation.reports import ReportModel
from mapfilter.simulation.walking import WalkerModel
from mapfilter.tracks.imu_noise import ImuNoise
from mapfilter.workflows.evaluate import _world as prepare_world
from mapfilter.workflows.evaluations.settings import WORLDS, load_benchmark
from mapfilter.workflows.inputs.filter_choice import filter_choice
from mapfilter.workflows.inputs.world import World
from mapfilter.workflows.simulate import simulation_settings

SMALL = [
    'area.map="manhattan"',
    "area.size_m=300,300",
    "area.resolution_m=5",
    "cells.sites=1",
    "cells.indoor=1",
]


def told(name):
    return tomllib.loads((files("mapfilter.data") / f"world-{name}.toml").read_text("utf-8"))


def keys(values, before=""):
    for name, value in values.items():
        if isinstance(value, dict):
            yield from keys(value, f"{before}{name}.")
        else:
            yield f"{before}{name}", value


@pytest.mark.parametrize("name", WORLDS)
def test_every_key_of_a_world_is_known_and_taken(name):
    config, fixed = load_benchmark(name, None, [])
    assert fixed == frozenset()
    given = list(keys(told(name)))
    assert len(given) > 5
    for key, value in given:
        owner = config
        for part in key.split("."):
            assert part in type(owner).model_fields, key
            owner = getattr(owner, part)
        assert owner == value, key
        assert not isinstance(owner, BaseModel)


def test_the_plain_world_is_what_it_says():
    """Sizes as its file gives them with their sources."""
    config, _ = load_benchmark("plain", None, [])
    assert config.prediction.of(PredictionModel) == PredictionModel(shadowing_db=0.0)
    assert config.prediction.ground_truth.of(GroundTruthErrors) == GroundTruthErrors(
        level_error_db=5.0,
        correlation_m=100.0,
        site_share=0.5,
        eirp_error_db=2.0,
        azimuth_error_deg=5.0,
        slope_error=0.05,
        clutter="own",
        local_share=0.5,
        local_correlation_m=15.0,
        model="tr38901_uma",
        street_width_m=15.0,
        building_separation_m=50.0,
        default_roof_height_m=15.0,
        roof_error=0.2,
        offset_db=5.0,
    )
    settings = simulation_settings(config)
    assert settings.imu == ImuNoise(
        sigma_trans_m=0.2,
        sigma_orient_deg=3.0,
        heading_correlation_s=20.0,
        step_scale_wander=0.1,
        step_scale_correlation_s=15.0,
        turns="gyro",
        gyro_noise_deg_per_sqrt_s=0.2,
        gyro_bias_deg_per_s=0.05,
    )
    assert settings.reports == ReportModel(fading_db=3.5, phone_offset_sd_db=4.0)
    assert settings.journey.walker == WalkerModel("pavement", 150.0, 300.0, 20.0)
    assert config.journeys.nlos_satellites is True
    assert (settings.journey.length_m, settings.imu.period_s) == (1940.0, 1.0)


def test_the_easy_world_is_the_one_of_before():
    config, _ = load_benchmark("easy", None, [])
    assert config.prediction.of(PredictionModel) == PredictionModel(shadowing_db=6.0)
    errors = config.prediction.ground_truth.of(GroundTruthErrors)
    assert errors == GroundTruthErrors(level_error_db=7.0, correlation_m=50.0, clutter="shared")
    settings = simulation_settings(config)
    assert settings.imu == ImuNoise(sigma_trans_m=0.2)
    assert settings.reports == ReportModel(fading_db=1.0)
    assert settings.journey.walker == WalkerModel()
    assert config.journeys.nlos_satellites is False


@pytest.mark.parametrize("name", WORLDS)
def test_a_world_tells_the_filter_nothing(name):
    config, _ = load_benchmark(name, None, [])
    usual = Config.model_validate({"filter": {"name": "bayes"}})
    assert filter_choice(config.filter) == filter_choice(usual.filter)


def test_what_is_given_goes_before_the_world(tmp_path):
    file = tmp_path / "area.toml"
    file.write_text("[imu]\nturns = 'headings'\n[journeys]\nfading_db = 2.0\n")
    config, _ = load_benchmark("plain", file, ["journeys.fading_db=1.5"])
    assert (config.imu.turns, config.journeys.fading_db) == ("headings", 1.5)
    assert config.imu.heading_correlation_s == 20.0
    assert config.prediction.ground_truth.offset_db == 5.0


def test_a_world_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(ConfigError, match="easy, plain, foreign, harsh or sensors"):
        load_benchmark("nice", None, [])
    out = tmp_path / "out"
    told = mapfilter("evaluate", "global-positioning", "--world", "nice", "--out", out)
    assert_refused(told, "--world", "easy, plain, foreign, harsh or sensors", "nice")
    told = mapfilter("evaluate", "audit", "--world", "easy", "--out", out)
    assert_refused(told, "--world", "audit takes none")
    told = mapfilter("evaluate", "ottawa", "--data", tmp_path, "--world", "easy")
    assert_refused(told, "--world", "ottawa takes none")
    for name in ("audit", "ottawa", "kitti"):
        given = () if name == "audit" else ("--data", tmp_path)
        told = mapfilter("evaluate", name, "--one-case", *given, "--out", out)
        assert_refused(told, "--one-case", f"{name} takes none")
    assert not out.exists()


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """The plain world and the easy one on two by two blocks."""
    found = {}
    for name in WORLDS:
        config, _ = load_benchmark(name, None, SMALL)
        world = World.of(config)
        found[name] = world, prepare_world(world, tmp_path_factory.mktemp(name), 1)
    return found


def off_db(world):
    """Ground truths of some routes less the prediction."""
    streets = world.streets
    rows, cols = np.indices((streets.lattice.rows, streets.lattice.cols))
    places = streets.lattice.east_north(rows.ravel(), cols.ravel())
    exact = replace(
        world, errors=GroundTruthErrors(0.0, 50.0, 0.5, 0.0, 0.0, 0.0, clutter="shared")
    ).ground_truth(0)(*places)
    return np.array([world.ground_truth(seed)(*places) - exact for seed in range(8)])


@pytest.mark.parametrize(
    ("name", "least_db", "most_db"), [("easy", 5.5, 9.0), ("plain", 7.0, 20.0)]
)
def test_the_ground_truth_is_not_the_prediction(made, name, least_db, most_db):
    _, (world, _) = made[name]
    off = off_db(world)
    assert least_db < np.sqrt(np.mean(off**2)) < most_db
    # Every route's is another one.
    between = np.corrcoef(off.reshape(8, -1))[np.triu_indices(8, 1)]
    assert between.max() < 0.999
    assert np.abs(off[0] - off[1]).mean() > 1.0


def test_a_tenth_of_the_ways_lacks_in_one_database_only(tmp_path):
    """Few ways, but seven seeds."""
    size = [setting.replace("300,300", "800,800").replace("=5", "=10") for setting in SMALL]
    config, _ = load_benchmark("plain", None, size)
    world = World.of(config)
    every, lacking = set(np.unique(world.ways.way_id).tolist()), []
    for seed in range(7):
        made, count = prepare_world(world, tmp_path / str(seed), seed)
        full, thinned = (
            open_database(made.folder / name) for name in ("database", "database-thinned")
        )
        ways = [
            {way for way in np.unique(one.points().way_id).tolist() if way > 0}
            for one in (full, thinned)
        ]
        assert count == full.manifest["counts"]["points"] == len(world.routes)
        assert ways[0] == every
        assert ways[1] <= every
        lacking.append(len(every - ways[1]))
    total = 7 * len(every)
    assert abs(sum(lacking) - 0.1 * total) < 4 * np.sqrt(0.09 * total)
    assert sum(lacking) > 0
