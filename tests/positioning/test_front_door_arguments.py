"""Wrong arguments at the front door: the message names what was expected, found and exchanged."""

import os
import shutil
import subprocess
import sys

import pandas as pd
import pytest
from cross_world import LATTICE, make_database, walk_log

import mapfilter as mf
from mapfilter._arguments import Argument, check_arguments
from mapfilter.lattice import Lattice
from mapfilter.roads.maps import resolve_map


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("cross")
    make_database(folder)
    mf.write_log(walk_log(), folder / "log")
    return folder


@pytest.fixture(scope="module")
def database_path(folder):
    return next(file.parent for file in folder.rglob("manifest.json"))


@pytest.fixture(scope="module")
def world(folder, database_path):
    """Return one good argument of each kind, by name."""
    database = mf.open_database(database_path)
    rasters = mf.open_rasters(next(folder.rglob("*.tif")), "level")
    log = walk_log()
    return {
        "database": database,
        "rasters": rasters,
        "plan": database.plan,
        "log": log,
        "track": mf.locate(log, database, "candidate"),
    }


def own(database):
    """A custom filter, which is given a database."""
    raise AssertionError(database)


def refused(call, *expected):
    with pytest.raises(mf.MapfilterError) as caught:
        call()
    message = str(caught.value)
    for text in expected:
        assert text in message
    return message


def test_a_log_and_a_database_may_be_given_by_path(world, folder, database_path):
    by_object = world["track"].to_dataframe()
    for path in (database_path, str(database_path)):
        found = mf.locate(folder / "log", path, "candidate")
        pd.testing.assert_frame_equal(found.to_dataframe(), by_object)
    by_object = mf.locate_reports(world["log"], world["database"]).to_dataframe()
    found = mf.locate_reports(str(folder / "log"), database_path)
    pd.testing.assert_frame_equal(found.to_dataframe(), by_object)
    assert repr(mf.bound(database_path)) == repr(mf.bound(world["database"]))


def entry(path):
    """Return a path as os.scandir gives it, which is neither a Path nor a text."""
    with os.scandir(path.parent) as entries:
        return next(one for one in entries if one.name == path.name)


def test_an_entry_of_a_folder_is_a_path(world, folder, database_path, tmp_path):
    log, database = entry(folder / "log"), entry(database_path)
    found = mf.locate(log, database, "candidate")
    pd.testing.assert_frame_equal(found.to_dataframe(), world["track"].to_dataframe())
    assert mf.open_database(database).cell_ids == world["database"].cell_ids
    for given in (log, [log]):
        assert len(mf.read_log(given, truth=log).truth) == len(world["log"].truth)
    assert len(mf.locate_reports(log, database).to_dataframe())
    assert mf.open_rasters(entry(next(folder.rglob("*.tif"))), "level").files
    shutil.copy(resolve_map("helsinki"), tmp_path / "helsinki.osm.pbf")
    town = entry(tmp_path / "helsinki.osm.pbf")
    lattice = Lattice.covering("EPSG:32635", (385500.0, 6671500.0, 385700.0, 6671700.0), 10.0)
    assert len(mf.read_routes(town, lattice)) == len(mf.read_routes("helsinki", lattice))
    (tmp_path / "copy").mkdir()
    mf.write_log(world["log"], entry(tmp_path / "copy"))
    assert len(mf.read_log(tmp_path / "copy").truth) == len(world["log"].truth)


def test_a_path_without_a_database_is_named(world, tmp_path):
    refused(lambda: mf.locate(world["log"], tmp_path / "nothing"), "nothing")
    refused(lambda: mf.bound(str(tmp_path / "nothing")), "nothing")


@pytest.mark.parametrize(
    ("order", "call"),
    [
        ("log, database", lambda w: mf.locate(w["database"], w["log"])),
        ("log, database", lambda w: mf.locate_reports(w["database"], w["log"])),
        ("track, truth", lambda w: mf.score(w["log"].truth, w["track"])),
        ("rasters, plan, routes, out", lambda w: mf.build(w["plan"], w["rasters"], 0, "db")),
        ("rasters, plan, roads", lambda w: mf.simulate(w["plan"], w["rasters"], "helsinki")),
        (
            "database, rasters, roads, filters",
            lambda w: mf.sweep(w["rasters"], w["database"], "helsinki", {"a": "bayes"}),
        ),
        ("roads, lattice", lambda _: mf.read_routes(LATTICE, "helsinki")),
        ("log, folder", lambda w: mf.write_log("folder", w["log"])),
    ],
)
def test_exchanged_arguments_are_named_with_their_order(world, order, call):
    refused(lambda: call(world), f"arguments exchanged; the order is {order})")


@pytest.mark.parametrize(
    ("expected", "call"),
    [
        ("locate, log: expected a log of read_log", lambda w: mf.locate(None, w["database"])),
        ("locate, database: expected a database of", lambda w: mf.locate(w["log"], 3)),
        ("for the filter bayes, found None (likely: left out; ekf,", lambda w: mf.locate(w["log"])),
        ("for the filter own, found None", lambda w: mf.locate(w["log"], filter=own)),
        (
            "for the radio of the log, found None (likely: a log without positions; ",
            lambda w: mf.locate(w["log"], None, mf.KalmanFilter()),
        ),
        ("locate_reports, log: expected", lambda w: mf.locate_reports(3, w["database"])),
        ("locate_reports, database[0]", lambda w: mf.locate_reports(w["log"], [3])),
        ("score, truth: expected a log, or its table truth", lambda w: mf.score(w["track"], None)),
        ("score, truth: expected a log", lambda w: mf.score(w["track"], w["track"])),
        ("bound, database: expected", lambda _: mf.bound(None)),
        ("bound, errors: expected ErrorModel", lambda w: mf.bound(w["database"], errors=7)),
        ("bound, options: expected", lambda w: mf.bound(w["database"], options=7)),
        ("build, routes: expected", lambda w: mf.build(w["rasters"], w["plan"], "osm", "db")),
        ("simulate, imu: expected ImuNoise", lambda w: simulated(w, imu=mf.ImuNoise)),
        ("found the class ImuNoise", lambda w: simulated(w, imu=mf.ImuNoise)),
        ("simulate, reports", lambda w: simulated(w, reports=6.0)),
        ("simulate, walker", lambda w: simulated(w, walker=6.0)),
        ("simulate, roads", lambda w: mf.simulate(w["rasters"], w["plan"], None)),
        ("sweep, filters", lambda w: swept(w, mf.BayesFilter())),
        ("sweep, noises", lambda w: swept(w, {"a": "bayes"}, noises=6.0)),
        ("sweep, reports", lambda w: swept(w, {"a": "bayes"}, reports=6.0)),
        ("epochs, log: expected a log", lambda _: mf.epochs("log")),
        ("open_database, path", lambda w: mf.open_database(w["database"])),
        ("open_rasters, path", lambda _: mf.open_rasters(["a.tif"])),
        ("read_cell_plan, path", lambda _: mf.read_cell_plan(None, "EPSG:32629")),
        ("read_fingerprint_table, path", lambda _: mf.read_fingerprint_table(None)),
        ("read_routes, lattice", lambda w: mf.read_routes("helsinki", w["rasters"])),
        ("read_log, paths: expected a path, or several", lambda w: mf.read_log(w["log"])),
        ("read_log, paths: expected a path, or several, found none", lambda _: mf.read_log([])),
        ("read_log, crs: expected a CRS such as", lambda _: mf.read_log("log", crs=LATTICE)),
        ("read_log, truth: expected a path", lambda _: mf.read_log("log", truth=3)),
        ("read_log, paths[0]: expected a path, found 1", lambda _: mf.read_log([1])),
        ("read_log, paths[1]: expected a path, found None", lambda _: mf.read_log(["a", None])),
        ("read_log, paths: expected a path", lambda _: mf.read_log(b"a")),
        ("read_log, truth[0]: expected a path", lambda _: mf.read_log("log", truth=[b"a"])),
        ("write_log, folder", lambda w: mf.write_log(w["log"], None)),
    ],
)
def test_another_type_is_refused_by_name(world, expected, call):
    message = refused(lambda: call(world), expected)
    assert "exchanged" not in message


def simulated(world, **given):
    return mf.simulate(world["rasters"], world["plan"], "helsinki", **given)


def swept(world, filters, **given):
    return mf.sweep(world["database"], world["rasters"], "helsinki", filters, **given)


@pytest.mark.parametrize("seed", [-1, "1", 1.5, None, True])
@pytest.mark.parametrize(
    ("function", "call"),
    [
        ("locate", lambda w, seed: mf.locate(w["log"], w["database"], seed=seed)),
        ("locate_reports", lambda w, seed: mf.locate_reports(w["log"], w["database"], seed=seed)),
        ("bound", lambda w, seed: mf.bound(w["database"], seed=seed)),
        ("simulate", lambda w, seed: simulated(w, seed=seed)),
        ("sweep", lambda w, seed: swept(w, {"a": "bayes"}, seed=seed)),
    ],
)
def test_a_seed_that_is_none_is_refused_by_name(world, function, call, seed):
    refused(
        lambda: call(world, seed),
        f"{function}, seed: expected a whole number >= 0",
        f"found {seed!r}",
    )


def test_a_path_may_be_the_truth_of_recordings(folder):
    assert len(mf.read_log(folder / "log", truth=folder / "log").truth)


def test_arguments_in_a_ring_are_called_exchanged_and_a_lone_one_is_not():
    ring = [Argument("a", 1, str, "text"), Argument("b", [], int, "number")]
    ring.append(Argument("c", "x", list, "list"))
    assert refused(lambda: check_arguments("f", *ring)).count("exchanged") == 3
    alone = [Argument("a", "x", int, "number"), Argument("b", "y", str, "text")]
    assert refused(lambda: check_arguments("f", *alone)) == "f, a: expected number, found 'x'"


def test_a_long_text_is_shown_by_its_type():
    found = refused(lambda: check_arguments("f", Argument("a", "x" * 200, int, "number")))
    assert found == "f, a: expected number, found str"


def test_a_misspelt_name_is_followed_by_the_right_one():
    code = "import mapfilter; mapfilter.locat"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert "Did you mean: 'locate'?" in found.stderr
