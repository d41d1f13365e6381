"""Every setting of a configuration: the benchmark honours it or refuses it."""

import json
import re
from dataclasses import replace
from functools import reduce

import numpy as np
import pytest
from benchmark_settings import (
    GROUND_TRUTH_BESIDE,
    OF_BAYES,
    OF_JOURNEYS,
    OF_KALMAN,
    OF_THE_CANDIDATE,
    OF_THE_GROUND_TRUTH,
    OF_THE_MAP,
    OTHERWISE,
    READ_AS_FOR_A_BUILD,
    REFUSED,
    REFUSED_SECTIONS,
    toml,
)
from pydantic import BaseModel

from mapfilter._io import sha256_file
from mapfilter.config.sections import Config
from mapfilter.errors import ConfigError
from mapfilter.experiments.benchmarks.cases import CASES
from mapfilter.experiments.benchmarks.global_positioning import informed
from mapfilter.lattice import Lattice
from mapfilter.positioning.bayes.area.area_map import AreaMap
from mapfilter.positioning.candidate import CandidateFilter
from mapfilter.tracks.imu_noise import ImuNoise
from mapfilter.workflows.evaluate import _world as prepare_world
from mapfilter.workflows.evaluations.settings import _refused, load_benchmark
from mapfilter.workflows.inputs.filter_choice import filter_choice
from mapfilter.workflows.inputs.world import World

LATTICE = Lattice("EPSG:32629", 500_000.0, 4_500_000.0, 10.0, 2, 2)
EMPTY = np.zeros((2, 2), dtype=np.float32)
AREA = AreaMap(
    LATTICE, ("A",), frozenset(), EMPTY[..., None], EMPTY, EMPTY.astype(int), EMPTY > 0, {}, -110.0
)
SMALL = {
    "area.map": "manhattan",
    "area.size_m": [200.0, 200.0],
    "area.resolution_m": 10.0,
    "cells.sites": 1,
    "cells.sectors": 1,
    "cells.indoor": 1,
}


FURTHER = re.compile(r"filter\.\w+\.\w+$")


def leaves(model=Config, before=""):
    for name, field in model.model_fields.items():
        inner = field.annotation
        if isinstance(inner, type) and issubclass(inner, BaseModel):
            yield from leaves(inner, f"{before}{name}.")
        else:
            yield f"{before}{name}"


def load(given, world="plain"):
    return load_benchmark(world, None, [f"{key}={toml(value)}" for key, value in given.items()])


def at(owner, path):
    return reduce(getattr, path.split("."), owner)


def is_refused(key):
    return key in REFUSED or key.startswith(REFUSED_SECTIONS)


@pytest.fixture(scope="module")
def world_of(tmp_path_factory):
    """Return the benchmark's world for settings; each is made once."""
    made = {}

    def world(given):
        key = repr(sorted(given.items()))
        if key not in made:
            config, _ = load(given)
            folder = tmp_path_factory.mktemp("world")
            made[key] = prepare_world(World.of(config), folder, 1)[0]
        return made[key]

    return world


def test_every_setting_is_known_to_be_honoured_or_refused():
    honoured = {
        *OF_THE_MAP,
        *OF_JOURNEYS,
        *OTHERWISE,
        *(f"prediction.ground_truth.{name}" for name in OF_THE_GROUND_TRUTH),
        *(f"filter.{name}" for name in OF_THE_CANDIDATE),
        *(f"filter.bayes.{name}" for name in OF_BAYES),
        *(f"filter.kalman.{name}" for name in OF_KALMAN),
    }
    every = list(leaves())
    # The sections of further filters are taken as they are.
    known = ("filter.bayes.", "filter.kalman.")
    honoured |= {key for key in every if FURTHER.match(key) and not key.startswith(known)}
    as_for_a_build = {key for key in every if key.startswith(READ_AS_FOR_A_BUILD)}
    refused = {key for key in every if is_refused(key)}
    assert honoured | as_for_a_build | refused == set(every)
    assert not honoured & as_for_a_build
    assert not refused & (honoured | as_for_a_build)


@pytest.mark.parametrize("key", [key for key in leaves() if is_refused(key)])
@pytest.mark.parametrize("world", ["easy", "plain"])
def test_what_has_no_meaning_is_refused_by_name(key, world, tmp_path):
    file = tmp_path / "area.toml"
    *sections, name = key.split(".")
    # The value may be of another kind: then it is refused as such, or what it goes with is missing.
    file.write_text(f"[{'.'.join(sections)}]\n{name} = 1\n")
    with pytest.raises(ConfigError) as caught:
        load_benchmark(world, file, [])
    assert key in str(caught.value) or "rasters" in key
    assert _refused(key, Config())


@pytest.mark.parametrize(
    ("given", "why"),
    [
        ("journeys.count=3", "--runs"),
        ("journeys.seed=3", "--seed"),
        ('journeys.radio="ground_truth"', "ground truth"),
        ("prediction.ground_truth.write=true", "ground truth"),
        ("prediction.ground_truth.seed=2", "--seed"),
        ('rasters.path="there.tif"', "predicted here"),
        ('prediction.model="survey"', "predicted here"),
        ('track.path="there"', "simulated here"),
        ("filter.smooth=true", "--case"),
        ("filter.kalman.fix_sd_m=3", "bayes has no such option"),
        ("filter.bayes.timing_sd_m=100.0", "no timing advances"),
        ("sweep.scale=[0.1]", "mapfilter sweep"),
        ('database.path="there"', "built here"),
        ("filter.threshold=3", "bayes has no such option"),
    ],
)
def test_refusals_say_why(given, why):
    with pytest.raises(ConfigError) as caught:
        load_benchmark("plain", None, [given])
    message = str(caught.value)
    assert given.partition("=")[0] in message
    assert why in message


def test_all_that_is_refused_is_told_together():
    with pytest.raises(ConfigError) as caught:
        load({"journeys.count": 3, "track.path": "there", "filter.threshold": 2})
    assert all(key in str(caught.value) for key in ("count", "track.path", "threshold"))


@pytest.mark.parametrize(("name", "entry"), OF_BAYES.items())
def test_options_of_the_bayes_filter(name, entry):
    value, path, *other = entry
    key = f"filter.bayes.{name}"
    config, fixed = load({key: value})
    choice = filter_choice(config.filter)
    expected = pytest.approx(other[0] if other else value)
    for case in ("levels-bias20", "satellites-2", "levels-6"):
        known = informed(choice, CASES[case], fixed)
        assert getattr(known, name) == value
        wide = replace(known, bias_sd_deg=0.0) if "particles" in name else known
        assert at(wide.over_area(AREA), path) == expected
    usual = filter_choice(load({})[0].filter)
    assert at(usual.over_area(AREA), path) != expected
    with pytest.raises(ConfigError, match="candidate has no such option"):
        load({key: value, "filter.name": "candidate"})


@pytest.mark.parametrize("name", ["max_particles", "min_search_particles", "min_particles"])
def test_a_grid_has_no_particles(name):
    with pytest.raises(ConfigError, match="grid has no such option"):
        load({f"filter.bayes.{name}": 5000, "filter.name": "grid"})
    config, _ = load({"filter.bayes.switch_mass": 0.9, "filter.name": "grid"})
    assert filter_choice(config.filter).switch_mass == 0.9


@pytest.mark.parametrize(("name", "entry"), OF_THE_CANDIDATE.items())
def test_options_of_the_candidate_filter(name, entry):
    value, path = entry
    config, _ = load({f"filter.{name}": value, "filter.name": "candidate"})
    choice = filter_choice(config.filter)
    assert at(choice, path) == value
    assert at(CandidateFilter(), path) != value
    for other in ("bayes", "grid", "mine:Filter"):
        with pytest.raises(ConfigError, match="has no such option"):
            load({f"filter.{name}": value, "filter.name": other})


@pytest.mark.parametrize("name", OF_KALMAN)
def test_options_of_the_kalman_type_filters(name):
    key, value = f"filter.kalman.{name}", 0.5 if name == "fix_lasting_share" else 7
    config, _ = load({key: value, "filter.name": "ukf"})
    choice = filter_choice(config.filter)
    assert (choice.method, getattr(choice, name)) == ("ukf", value)
    for other in ("bayes", "candidate", "mine:Filter"):
        with pytest.raises(ConfigError, match="has no such option"):
            load({key: value, "filter.name": other})
    with pytest.raises(ConfigError, match="ekf has no such option"):
        load({"filter.bayes.step_sd_m": 7, "filter.name": "ekf"})


def test_the_filters_name():
    names = [
        filter_choice(load({"filter.name": name})[0].filter).name
        for name in ("candidate", "grid", "bayes")
    ]
    assert names == ["candidate", "grid", "bayes"]
    assert filter_choice(load({})[0].filter).name == "bayes"


@pytest.mark.parametrize(("key", "entry"), OF_JOURNEYS.items())
def test_settings_of_journeys_and_of_the_unit(key, entry, world_of):
    value, path, *other = entry
    expected = pytest.approx(other[0]) if other else value
    assert at(world_of(SMALL).settings, path) != expected
    config, fixed = load({**SMALL, key: value})
    found = world_of({**SMALL, key: value})
    assert at(found.settings, path) == expected
    assert found.sha256 != world_of(SMALL).sha256
    if path.startswith("imu."):
        name = path.removeprefix("imu.")
        for case in ("levels-bias20", "cell-3", "recovery-levels"):
            errors = CASES[case].errors_in(found.settings.imu, fixed)
            assert getattr(errors, name) == expected
    assert config.filter == load({})[0].filter


@pytest.mark.parametrize(
    "key",
    [f"journeys.{n}" for n in ("speed_mps", "beside", "change_side_m", "stop_every_m", "stop_s")],
)
def test_drivers_are_no_walkers(key):
    with pytest.raises(ConfigError, match="driving"):
        load({key: 2.0, "roads.profile": "driving"})
    assert load({"journeys.length_m": 900.0, "roads.profile": "driving"})


@pytest.mark.parametrize("name", OF_THE_GROUND_TRUTH)
def test_settings_of_the_ground_truth(name, world_of):
    value, beside = OF_THE_GROUND_TRUTH[name], GROUND_TRUTH_BESIDE.get(name, {})
    given = {**SMALL, "cells.sectors": 3, **beside}
    usual, other = world_of(given), world_of({**given, f"prediction.ground_truth.{name}": value})
    assert getattr(other.errors, name) == value
    assert other.sha256 != usual.sha256
    lattice = usual.streets.lattice
    rows, cols = np.indices((lattice.rows, lattice.cols))
    east, north = lattice.east_north(rows.ravel(), cols.ravel())
    off_db = other.ground_truth(1)(east, north) - usual.ground_truth(1)(east, north)
    assert np.abs(off_db).max() > 0.1
    # The filter's map is the same.
    manifests = [sha256_file(w.folder / "database" / "manifest.json") for w in (usual, other)]
    assert manifests[0] == manifests[1]


@pytest.mark.parametrize("key", OF_THE_MAP)
def test_settings_of_the_map(key, world_of):
    value, beside = OF_THE_MAP[key]
    given = {**SMALL, **beside}
    usual, other = world_of(given), world_of({**given, key: value})
    for database in ("database", "database-thinned"):
        files = [w.folder / database / "manifest.json" for w in (usual, other)]
        assert sha256_file(files[0]) != sha256_file(files[1]), database


def test_roofs_where_no_building_is_near(world_of, tmp_path):
    """A wall across the area: beyond 100 m of it, roofs have the default height."""
    ring = [[3.0, 0.0022], [3.0054, 0.0022], [3.0054, 0.0024], [3.0, 0.0024], [3.0, 0.0022]]
    polygon = {"type": "Polygon", "coordinates": [ring]}
    shape = {"type": "Feature", "properties": {}, "geometry": polygon}
    file = tmp_path / "buildings.geojson"
    file.write_text(json.dumps({"type": "FeatureCollection", "features": [shape]}))
    given = {**SMALL, "area.size_m": [600.0, 600.0], "buildings.layer": str(file)}
    given["buildings.default_height_m"] = 60.0
    given["prediction.ground_truth.model"] = "cost231_walfisch_ikegami"
    usual = world_of(given)
    predicted = world_of({**given, "prediction.default_roof_height_m": 20.0})
    real = world_of({**given, "prediction.ground_truth.default_roof_height_m": 20.0})
    usual_map, other_map, real_map = (
        sha256_file(made.folder / "database" / "manifest.json") for made in (usual, predicted, real)
    )
    assert other_map != usual_map == real_map
    far = np.repeat([500_100.0, 500_500.0], 2), np.tile([30.0, 570.0], 2)
    truths = [world.ground_truth(1)(*far) for world in (usual, predicted, real)]
    np.testing.assert_array_equal(truths[0], truths[1])
    assert np.abs(truths[2] - truths[0]).max() > 0.1


def test_reflected_satellites(world_of):
    usual, without = world_of(SMALL), world_of({**SMALL, "journeys.nlos_satellites": False})
    assert usual.reception.nlos is not None
    assert without.reception.nlos is None
    assert usual.sha256 != without.sha256


def test_the_same_settings_make_the_same_world(world_of, tmp_path):
    again, points = prepare_world(World.of(load(SMALL)[0]), tmp_path, 1)
    assert again.sha256 == world_of(SMALL).sha256
    assert points == 94
    other, _ = prepare_world(World.of(load(SMALL)[0]), tmp_path / "other", 2)
    # Another seed lacks other ways; streets and prediction are the same.
    for part in ("streets/world.json", "database/manifest.json"):
        assert sha256_file(other.folder / part) == sha256_file(again.folder / part)


def test_settings_without_a_name_of_their_own_are_not_fixed():
    _, fixed = load({"imu.sigma_trans_m": 0.4, "filter.bayes.map_sd_m": 5.0})
    assert fixed == frozenset()
    _, fixed = load({"imu.sigma_orient_deg": 4.0, "filter.bayes.scale": 0.1})
    assert fixed == {"imu.sigma_orient_deg", "scale"}
    # What a world's own file says holds only where the cases say nothing.
    config, _ = load({})
    assert config.imu.turns == "gyro"
    world = ImuNoise(sigma_orient_deg=30.0)
    assert CASES["levels-3"].errors_in(world).sigma_orient_deg == 3
