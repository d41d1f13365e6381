"""Inputs that go together: nothing is found in them, predicted or as ground truth."""

from importlib.resources import as_file, files

import pytest
from command_line import assert_done, mapfilter


def assert_nothing_found(*given):
    outcome = assert_done(mapfilter("check", *given, "--json"))
    assert outcome.json == {"ok": True, "findings": []}


@pytest.fixture(scope="module")
def predicted(tmp_path_factory):
    """The rasters of the demo, at a coarser step, and its configuration."""
    out = tmp_path_factory.mktemp("demo")
    with as_file(files("mapfilter.data")) as data:
        given = ["-c", data / "demo.toml", "--set=area.resolution_m=10"]
        given.append(f"--set=output.dir={out}")
        assert_done(mapfilter("predict", *given))
        yield given, out


def test_the_demo(predicted):
    assert_nothing_found(*predicted[0])


def test_the_demo_where_the_ground_truth_differs_from_the_prediction(predicted):
    given, out = predicted
    assert_nothing_found(*given, f"--set=rasters.path={out / 'rxlev-ground-truth.tif'}")


def test_a_plan_by_rule_before_anything_runs(tmp_path):
    assert_nothing_found(f"--set=output.dir={tmp_path}", "--set=area.resolution_m=10")


def test_porto(shared_data, tmp_path):
    given = [
        f"--set=area.map={shared_data / 'osm-extracts' / 'porto.osm.pbf'}",
        "--set=area.southwest=-8.6235,41.1325",
        "--set=area.size_m=1600,1600",
        "--set=area.resolution_m=10",
        f"--set=output.dir={tmp_path}",
    ]
    assert_done(mapfilter("predict", *given))
    assert_nothing_found(*given)
