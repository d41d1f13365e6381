"""``evaluate global-positioning --world foreign|harsh|sensors`` on a few blocks."""

import json
from dataclasses import replace

import numpy as np
import pytest
from command_line import assert_refused, mapfilter

from mapfilter.database.store import open_database
from mapfilter.errors import ConfigError
from mapfilter.experiments.benchmarks.foreign import RouteRuns
from mapfilter.experiments.benchmarks.global_positioning import Batch, run_benchmark
from mapfilter.experiments.benchmarks.results import summarise
from mapfilter.experiments.benchmarks.world_cases import CASES_OF, FOREIGN, HARSH, SENSORS
from mapfilter.tracks.store import read_log
from mapfilter.workflows.evaluate import main_table
from mapfilter.workflows.evaluations.foreign import (
    load_foreign,
    missing_ways_file,
    prepare,
    run_foreign,
    write_journeys,
)
from mapfilter.workflows.inputs.filter_choice import filter_choice
from mapfilter.workflows.inputs.world import World

SMALL = [
    'area.map="manhattan"',
    "area.size_m=600,600",
    "area.resolution_m=10",
    "cells.sites=2",
    "cells.indoor=1",
    "journeys.length_m=250",
    "filter.bayes.max_particles=4000",
    "filter.bayes.min_search_particles=4000",
]
UNDRAWN = [*SMALL, 'output.pictures="none"']
FEW = ("levels-6", "cell-6")


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """The harsh world with the databases of two variants of every fault."""
    config, _ = load_foreign(None, SMALL)
    folder = tmp_path_factory.mktemp("harsh")
    world, _ = prepare(World.of(config), "harsh", folder, 1, tuple(HARSH), 2)
    return replace(world, length_m=250.0), config


def cells(log):
    return set(log.radio["cell"].dropna())


def same(table, other):
    return table.reset_index(drop=True).equals(other.reset_index(drop=True))


def test_the_prediction_and_the_filter_are_the_plain_worlds():
    config, fixed = load_foreign(None, [])
    assert config.prediction.shadowing_db == 0.0
    assert config.filter.name == "bayes"
    assert fixed == frozenset()
    assert load_foreign(None, ["journeys.length_m=900"])[1] == {"length_m"}


@pytest.mark.parametrize(
    "setting",
    ["journeys.fading_db=3", "imu.scale=0.1", "prediction.ground_truth.offset_db=1"],
)
def test_what_the_world_defines_is_refused(setting):
    with pytest.raises(ConfigError, match=f"{setting.split('=')[0]}.*has one definition"):
        load_foreign(None, [setting])


def test_drivers_and_unknown_cases_are_refused(tmp_path):
    with pytest.raises(ConfigError, match=r"roads\.profile"):
        load_foreign(None, ['roads.profile="driving"'])
    out = tmp_path / "out"
    told = mapfilter(
        "evaluate", "global-positioning", "--world", "harsh", "--case", "levels-6", "--out", out
    )
    assert_refused(told, "--case", "off-ways-30", "levels-6")
    assert not out.exists()


def test_the_command_prints_a_row_for_each_case(tmp_path):
    given = [arg for setting in UNDRAWN for arg in ("--set", setting)]
    told = mapfilter(
        "evaluate", "global-positioning", "--world", "foreign", *given, "--runs", "1",
        "--case", "levels-6", "--out", tmp_path, "--json",
    )  # fmt: skip
    table = told.json
    assert [row["name"] for row in table["cases"]] == ["levels-6"]
    assert table["cases"][0]["runs"] == 1
    assert json.loads((tmp_path / "table.json").read_text())["cases"] == table["cases"]


def test_runs_depend_on_the_seed_only(tmp_path):
    """Not on the number of runs, nor on the other cases; what is finished is kept."""
    config, fixed = load_foreign(None, UNDRAWN)

    def rows(folder, runs, cases, seed=3, **options):
        run_foreign(
            config, "foreign", tmp_path / folder, runs=runs, seed=seed, cases=cases, workers=1,
            fixed=fixed, **options,
        )  # fmt: skip
        files = sorted((tmp_path / folder / "batches").glob("*.json"))
        every = [row for file in files for row in json.loads(file.read_text())["rows"]]
        return {
            (row["case"], row["route"]): {k: v for k, v in row.items() if k != "seconds"}
            for row in every
        }

    few = rows("few", 1, FEW[:1])
    many = rows("many", 2, FEW)
    assert few[FEW[0], 0] == many[FEW[0], 0]
    assert set(many) == {(name, route) for name in FEW for route in range(2)}
    assert rows("many", 2, FEW, resume=True) == many
    assert rows("other", 1, FEW[:1], seed=4) != few


def test_faults_change_the_database_and_not_the_log(made):
    world, _ = made
    runs = RouteRuns(world, 0)
    clean = open_database(world.folder / "database")
    _, usual = runs.run(FOREIGN["levels-6"])
    for name in ("cells-moved", "cells-biased-8", "site-rotated", "new-cell", "district-6db"):
        _, log = runs.run(HARSH[name])
        assert same(log.radio, usual.radio), name
        assert same(log.motion, usual.motion), name
        given = open_database(world.folder / f"database-{name}-0")
        assert given.manifest["parts"] != clean.manifest["parts"], name


def test_a_cell_that_is_off_is_silent_and_in_the_database(made):
    world, _ = made
    for route in range(2):
        case = HARSH["cells-off"]
        silent = world.given(case, route).silent
        _, log = RouteRuns(world, route).run(case)
        plan = world.city.streets.plan
        assert silent
        assert not cells(log) & set(silent)
        assert not set(log.radio["arfcn"]) & {plan[name].arfcn for name in silent}
        given = open_database(world.folder / f"database-cells-off-{route}")
        assert set(silent) <= set(given.cell_ids)


def test_a_new_cell_is_on_air_and_not_in_the_database(made):
    world, _ = made
    (new,) = world.given(HARSH["new-cell"], 0).affected
    _, log = RouteRuns(world, 0).run(HARSH["new-cell"])
    given = open_database(world.folder / "database-new-cell-0")
    assert world.city.streets.plan[new].arfcn in set(log.radio["arfcn"])
    assert new not in given.cell_ids


def test_missing_ways_are_missing_in_the_database_only(made):
    world, _ = made
    full, less = (
        open_database(world.folder / name) for name in ("database", "database-ways-missing-0")
    )
    assert len(less.points()) <= len(full.points())
    assert len(np.unique(less.points().way_id)) <= len(np.unique(full.points().way_id))
    file = missing_ways_file(world.folder / "database-ways-missing-0")
    missing = json.loads(file.read_text())["missing"]
    gone = set(full.points().way_id.tolist()) - set(less.points().way_id.tolist())
    assert gone - {0} <= set(missing)
    assert not set(missing) & set(less.points().way_id.tolist())


def test_the_other_city_is_far_away(made):
    world, _ = made
    walked, log = RouteRuns(world, 0).run(HARSH["other-city"])
    _, usual = RouteRuns(world, 0).run(FOREIGN["levels-6"])
    east = world.city.streets.lattice.bounds_m[2]
    assert walked.truth["east_m"].min() > east + 40_000.0
    assert not same(log.motion, usual.motion)
    assert cells(log) <= set(world.city.streets.plan.ids)


def test_indoors_levels_are_weaker(made):
    world, _ = made
    runs = RouteRuns(world, 0)
    walked, log = runs.run(HARSH["indoors-start"])
    serving = log.radio[log.radio["role"] == "serving"]
    inside = serving["time_s"] < 180.0
    difference = serving["level_dbm"][~inside].median() - serving["level_dbm"][inside].median()
    assert difference > 5.0
    assert walked.truth["time_s"].max() > 180.0 + 250.0 / 2.5


def test_serving_cells_only(made):
    world, _ = made
    _, log = RouteRuns(world, 0).run(FOREIGN["cell-6"])
    assert set(log.radio["role"]) == {"serving"}
    assert log.radio["level_dbm"].isna().all()


def test_journeys_are_written_with_what_is_wrong(made, tmp_path):
    world, _ = made
    found = write_journeys(world, "faults-together", 2, tmp_path / "logs")
    assert found == world.given(HARSH["faults-together"], 0)
    names = sorted(folder.name for folder in (tmp_path / "logs").iterdir())
    assert names == ["journey-0000", "journey-0001"]
    first, second = (read_log(tmp_path / "logs" / name) for name in names)
    assert not cells(first) & set(found.silent)
    assert first.truth is not None
    assert not same(first.motion, second.motion)
    _, again = RouteRuns(world, 0).run(HARSH["faults-together"])
    assert same(first.motion, again.motion)


@pytest.mark.parametrize("name", HARSH)
def test_every_case_runs(made, tmp_path, name):
    world, config = made
    choice = filter_choice(config.filter)
    rows = run_benchmark(Batch(world, choice, (name,), 0, 1), tmp_path)
    found = summarise(HARSH[name], choice.name, rows)
    assert (found.name, found.runs) == (name, 1)
    assert 0.0 <= found.claimed <= 1.0
    regions = (found.epochs_available, found.epochs_misleading, found.epochs_hazardous)
    unavailable = found.epochs_unavailable + found.epochs_unavailable_misleading
    assert sum(regions) + unavailable == rows[0]["claimed"]


def test_faulty_sensors_have_rows_of_their_own_and_one_together(tmp_path):
    """The run of a case without a fault stays out of it."""
    config, fixed = load_foreign(None, UNDRAWN)
    names = ("no-fault", "motion-ends", "radio-frozen")
    result = run_foreign(
        config, "sensors", tmp_path, runs=2, seed=3, cases=names, workers=1, fixed=fixed
    )
    *each, pooled = result.cases
    assert [case.name for case in each] == list(names)
    assert (pooled.name, pooled.runs) == ("pooled", 4)
    rows = {case["case"]: case for case in main_table(result)["cases"]}
    assert {"claimed", "wrong_converged", "fault_wrong", "fault_noticed_s"} <= set(rows["pooled"])
    files = sorted((tmp_path / "batches").glob("*.json"))
    found = [row for file in files for row in json.loads(file.read_text())["rows"]]
    claimed = sum(row["claimed"] for row in found if row["case"] != "no-fault")
    epochs = sum(row["epochs"] for row in found if row["case"] != "no-fault")
    assert pooled.claimed == pytest.approx(claimed / epochs)


def test_each_route_may_have_one_case_which_is_the_same_as_among_all(tmp_path):
    """Which one is drawn depends on seed and route alone; cases without a route have no row."""
    config, fixed = load_foreign(None, UNDRAWN)
    names = tuple(SENSORS)
    given = {"runs": 3, "seed": 3, "cases": names, "workers": 1, "fixed": fixed}
    result = run_foreign(config, "sensors", tmp_path / "one", one_case=True, **given)
    *each, pooled = result.cases
    files = sorted((tmp_path / "one" / "batches").glob("*.json"))
    rows = [row for file in files for row in json.loads(file.read_text())["rows"]]
    assert [row["route"] for row in rows] == [0, 1, 2]
    drawn = [row["case"] for row in rows]
    assert [case.name for case in each] == [name for name in names if name in drawn]
    assert sum(case.runs for case in each) == 3
    assert pooled.runs == sum(name != "no-fault" for name in drawn)
    world = replace(prepare(World.of(config), "sensors", tmp_path, 3, names, 3)[0], length_m=250.0)
    whole = Batch(world, filter_choice(config.filter), names, 0, 3, one_case=True)
    assert [whole.cases_on(route) for route in range(3)] == [(name,) for name in drawn]
    assert len({whole.cases_on(route) for route in range(200)}) == len(names)
    alone = replace(whole, cases=(drawn[1],), first=1, end=2, one_case=False, fixed=fixed)
    (same,) = run_benchmark(alone, tmp_path / "alone")
    assert {**same, "seconds": 0} == {**rows[1], "seconds": 0}
    with pytest.raises(ConfigError, match="one_case"):
        run_foreign(config, "sensors", tmp_path / "one", resume=True, **given)
    # Finished batches are those of one case a route, and are not done again.
    done = []
    again = {"one_case": True, "resume": True, "progress": lambda *count: done.append(count)}
    resumed = run_foreign(config, "sensors", tmp_path / "one", **given, **again)
    assert repr(resumed.cases) == repr(result.cases)
    assert done == []


def test_a_single_fault_has_no_row_of_all_faults_together(tmp_path):
    config, fixed = load_foreign(None, UNDRAWN)
    given = {"runs": 1, "seed": 3, "workers": 1, "fixed": fixed}
    names = ("no-fault", "headings-mirrored")
    result = run_foreign(config, "sensors", tmp_path, cases=names, **given)
    assert [case.name for case in result.cases] == list(names)


@pytest.mark.parametrize("one_case", [False, True])
def test_a_single_run_of_a_fault_goes_on_with_more(tmp_path, one_case):
    """They are of further variants, whose databases the single one did not need."""
    config, fixed = load_foreign(None, UNDRAWN)
    given = {"seed": 3, "cases": ("cells-off",), "workers": 1, "fixed": fixed, "one_case": one_case}
    run_foreign(config, "harsh", tmp_path, runs=1, **given)
    (part,) = (tmp_path / "batches").glob("*.json")
    first = json.loads(part.read_text())["rows"]
    result = run_foreign(config, "harsh", tmp_path, runs=3, resume=True, **given)
    assert [case.runs for case in result.cases] == [3]
    again = json.loads(part.read_text())["rows"]
    assert [row["route"] for row in again] == [0, 1]
    assert {**again[0], "seconds": 0} == {**first[0], "seconds": 0}


def test_cases_of_a_walk_share_it_and_faults_change_the_log_only(made):
    world, _ = made
    runs = RouteRuns(replace(world, name="sensors"), 0)
    usual_walk, usual = RouteRuns(world, 0).run(FOREIGN["levels-6"])
    assert usual_walk.fault_at_s == np.inf
    for name in SENSORS:
        walked, log = runs.run(SENSORS[name])
        assert same(walked.truth, usual_walk.truth)
        assert 0.0 <= walked.fault_at_s < usual_walk.truth["time_s"].max()
        untouched = same(log.motion, usual.motion) and same(log.radio, usual.radio)
        # A clock that was set back is put right as the log is read.
        assert untouched is (name in ("no-fault", "clock-steps-back")), name
        assert (name == "clock-steps-back") is any("clock is set back" in n for n in log.notes)


def test_the_world_is_known_by_its_checksum(made):
    world, _ = made
    assert world.sha256 == replace(world).sha256
    assert world.sha256 != replace(world, offsets_db=(1.0, 0.0)).sha256
    assert world.sha256 != replace(world, length_m=None).sha256
    assert set(CASES_OF) == {"foreign", "harsh", "sensors"}
