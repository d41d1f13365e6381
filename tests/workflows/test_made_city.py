"""Every command on a city that is made: no map is read, and the same seed gives the same."""

import pytest
from command_line import assert_done, assert_refused, mapfilter

from mapfilter.config.load import load_config
from mapfilter.database.store import open_database
from mapfilter.workflows.inputs.world import World

SMALL = ["area.size_m=600,600", "cells.sites=1", "cells.indoor=1", "area.seed=2"]


def settings(name):
    return [part for setting in [f"area.map={name}", *SMALL] for part in ("--set", setting)]


@pytest.mark.parametrize("name", ["synthetic", "manhattan"])
def test_the_whole_chain_runs_on_a_made_city(tmp_path, name):
    given = [*settings(name), "--set", "journeys.length_m=300", "--set", "output.pictures=none"]
    here = ["--set", f"output.dir={tmp_path}"]
    assert_done(mapfilter("check", *given, *here))
    assert_done(mapfilter("predict", *given, *here))
    built = mapfilter("build", *given, *here, "--json")
    assert_done(built)
    figures = built.json
    assert figures["points"] > 2000
    assert any("a city that does not exist" in note for note in figures["notes"])
    assert_done(mapfilter("simulate", *given, *here))
    located = mapfilter("replay", *given, *here)
    assert located.code == 0, located.err
    assert f"the logs are those of {tmp_path / 'journeys'}" in located.err
    database = open_database(tmp_path / "database")
    assert database.attribution == ""
    assert database.manifest["inputs"] != []


def test_a_made_city_has_a_place_and_a_size_of_its_own():
    area = load_config(None, ["area.map=synthetic"]).area
    assert (area.southwest, area.size_m, area.seed) == ((3.0, 0.0), (3000.0, 3000.0), 0)
    area = load_config(None, ["area.map=manhattan", "area.bbox=8,50,8.01,50.01"]).area
    assert area.southwest is None


def test_another_seed_is_another_city_and_no_file_is_named():
    first, other = (
        World.of(load_config(None, [f"area.seed={seed}", "area.map=synthetic", *SMALL[:3]]))
        for seed in (0, 1)
    )
    assert len(first.routes) != len(other.routes)
    assert first.streets.files == ()
    assert first.map_name == "synthetic"


def test_driving_needs_no_footways():
    world = World.of(load_config(None, ["area.map=synthetic", "roads.profile=driving", *SMALL]))
    names = {world.ways.class_names[code] for code in world.ways.way_class}
    assert not names & {"footway", "path", "pedestrian"}


def test_a_city_that_is_too_small_is_refused(tmp_path):
    given = ["--set", "area.map=synthetic", "--set", "area.size_m=50,50"]
    refused = mapfilter("predict", *given, "--set", f"output.dir={tmp_path}")
    assert_refused(refused, "synthetic city, size_m", "sides of 200 to 50000 m")
