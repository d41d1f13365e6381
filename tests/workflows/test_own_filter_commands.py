"""The documentation's filter of one's own in every command that takes a filter by its name."""

import re
import sys
import textwrap
from pathlib import Path

import pytest
from command_line import assert_done, assert_refused, mapfilter, settings

from mapfilter.config.sections import FilterSection
from mapfilter.experiments.sweep.table import read_runs
from mapfilter.positioning.estimate_store import read_estimate
from mapfilter.positioning.locators import BUILT_IN, filter_options
from mapfilter.workflows.inputs.filter_choice import filter_choice

PAGE = Path(__file__).resolve().parents[2] / "docs" / "howto" / "own-filter.rst"
MINE = "my_filter_of_the_docs:MyFilter"
GRID = settings(
    sweep__sigma_orient_deg="3,6", sweep__routes=2, sweep__draws=1, output__pictures="none"
)


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A working folder with the page's filter in it, of fewer particles."""
    text = re.search(r"code-block:: python\n\n((?:   .*\n|\n)+)", PAGE.read_text("utf-8"))
    assert text is not None
    source = textwrap.dedent(text[1]).replace("size=5000", "size=300")
    (tmp_path / f"{MINE.partition(':')[0]}.py").write_text(source, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    return tmp_path


def test_a_replay(world, here):
    given = ["--db", world.database, "--log", world.journeys, "--out", here / "out"]
    found = assert_done(mapfilter("replay", *given, "--filter", MINE, "--json")).json
    assert found["filter"] == MINE
    assert found["logs"] == 2
    estimate = read_estimate(here / "out" / "journey-0000-draw-000" / "estimate.parquet")
    assert estimate.filter == MINE
    assert estimate.hypotheses[-1] == 300


def test_a_sweep_beside_other_filters_and_on_other_workers(own_world, here):
    own_world.toml.write_text(
        own_world.toml.read_text()
        + f"""[[sweep.readings]]
name = "mine"
filter = "{MINE}"
[[sweep.readings]]
name = "candidates"
"""
    )
    tables = []
    for more in ([], ["--workers", "2"]):
        out = here / f"out{len(tables)}"
        place = settings(database__path=own_world.database, rasters__path=own_world.rasters)
        given = [*GRID, *place, "--out", out, *more, "--json"]
        found = assert_done(mapfilter("sweep", "-c", own_world.toml, *given)).json
        assert {cell["filter"] for cell in found["cells"]} == {MINE, "candidate"}
        tables.append((out / "sweep" / "runs.parquet").read_bytes())
    assert tables[0] == tables[1]
    runs = read_runs(here / "out0" / "sweep" / "runs.parquet")
    assert set(runs[runs["reading"] == "mine"]["filter"]) == {MINE}


@pytest.mark.filterwarnings("default")
@pytest.mark.usefixtures("here")
def test_a_sweep_on_a_cluster(own_world):
    mine = ["-c", own_world.toml, *GRID, *settings(filter__name=MINE)]
    found = assert_done(mapfilter("sweep", *mine, "--cluster", "local:1", "--json")).json
    assert {cell["filter"] for cell in found["cells"]} == {MINE}


def test_a_benchmark(world, here):
    given = ["--filter", MINE, "--case", "cell-6", "--runs", "1", "--workers", "1"]
    out = here / "cases"
    file = world.benchmark_toml
    told = mapfilter("evaluate", "global-positioning", "-c", file, *given, "--out", out, "--json")
    (case,) = told.json["cases"]
    assert (case["name"], case["filter"], case["runs"]) == ("cell-6", MINE, 1)


@pytest.mark.parametrize("command", ["replay", "sweep", "evaluate"])
def test_a_filter_that_is_not_there_is_refused_before_anything_runs(command, world, here):
    name = ["global-positioning"] if command == "evaluate" else []
    gone = settings(filter__name="not_there:MyFilter")
    if command == "evaluate":
        gone = ["--filter", "not_there:MyFilter"]
    file = world.benchmark_toml if name else world.toml
    told = mapfilter(command, *name, "-c", file, *gone, "--out", here / "out")
    assert_refused(told, "not_there:MyFilter", "No module named 'not_there'")
    assert not (here / "out").exists()


def test_names_of_other_forms_are_refused(world):
    for name in ("my filter:F", "a:", ":b", "a:b:c", "1a:b", "a..b:c"):
        told = mapfilter("replay", "-c", world.toml, "--filter", name)
        assert_refused(told, "setting filter.name", "package.module:Name")


def test_it_has_no_hindsight(world, here):
    told = mapfilter("replay", "-c", world.toml, "--filter", MINE, "--smooth", "--out", here / "o")
    assert_refused(told, "--smooth", MINE)


@pytest.mark.parametrize("name", BUILT_IN)
def test_a_configuration_takes_each_built_in_filter_by_its_name(name):
    section = FilterSection(name=name)
    assert filter_options(section.name).name == name
    assert filter_choice(section) == filter_options(name)
    if hasattr(filter_options(name), "smooth"):
        assert FilterSection(name=name, smooth=True).smooth
        assert filter_choice(FilterSection(name=name, smooth=True)).smooth


def test_a_replay_without_a_map_takes_the_sites_of_the_database(own_world, tmp_path):
    log = own_world.journeys / "journey-0000-draw-000"
    given = ["--db", own_world.database, "--log", log, "--filter", "ekf", "--out", tmp_path / "o"]
    replayed = mapfilter("replay", *given, "--json").json
    assert (replayed["filter"], replayed["logs"]) == ("ekf", 1)
    assert (tmp_path / "o" / "track.png").is_file()


def test_a_sweep_of_a_filter_without_a_map_takes_the_sites_of_the_database(own_world, tmp_path):
    place = settings(database__path=own_world.database, rasters__path=own_world.rasters)
    grid = settings(sweep__routes=1, sweep__draws=1, output__pictures="none")
    ekf = [*grid, *place, *settings(filter__name="ekf", journeys__length_m=120)]
    ekf += ["--vary", "filter.kalman.step_sd_m=0.3,3"]
    assert_done(mapfilter("sweep", "-c", own_world.toml, *ekf, "--out", tmp_path))
    runs = read_runs(tmp_path / "sweep" / "runs.parquet")
    assert set(runs["filter"]) == {"ekf"}
    assert sorted(set(runs["filter.kalman.step_sd_m"])) == [0.3, 3.0]


def test_a_benchmark_of_a_filter_without_a_map(own_world, tmp_path):
    given = [*settings(area__resolution_m=10), "--filter", "ekf", "--runs", 1, "--workers", 1]
    given += ["--world", "easy", "--case", "cell-6", "--out", tmp_path, "--json"]
    told = mapfilter("evaluate", "global-positioning", "-c", own_world.benchmark_toml, *given)
    (case,) = assert_done(told).json["cases"]
    assert case["filter"] == "ekf"
