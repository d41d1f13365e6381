"""Values that a plan lacks and that take a default are named where the plan is used."""

import pandas as pd
import pytest
from command_line import assert_done, assert_refused, mapfilter, settings

from mapfilter.database.store import open_database

NOTES = [
    "eirp_dbm = 47 for 3 of 3 cells without one",
    "frequency_mhz = 2100 for 3 of 3 cells without one",
]


@pytest.fixture
def plain(world, tmp_path):
    """Settings of a plan without power and frequency, its columns named by others."""
    plan = pd.read_csv(world.plan).drop(columns=["eirp_dbm", "frequency_mhz"])
    plan.rename(columns={"height_m": "Height"}).to_csv(tmp_path / "plan.csv", index=False)
    given = {"cells__plan": tmp_path / "plan.csv", "cells__eirp_dbm": 47.0}
    return settings(**given, cells__frequency_mhz=2100.0, cells__columns='{height_m="Height"}')


@pytest.mark.parametrize("command", ["predict", "build"])
def test_defaults_are_noted(command, world, plain, tmp_path):
    if command == "build":
        rasters = settings(rasters__path=world.rasters, rasters__quantity='"level"')
        plain = [*plain, *rasters]
    done = mapfilter(command, "-c", world.toml, "--out", tmp_path / "out", "--json", *plain)
    notes = assert_done(done).json["notes"]
    assert [note for note in notes if "without one" in note] == NOTES


def test_a_whole_plan_needs_no_note(world, tmp_path):
    done = mapfilter("predict", "-c", world.toml, "--out", tmp_path / "out", "--json")
    assert not [note for note in assert_done(done).json["notes"] if "without one" in note]


@pytest.mark.parametrize(("stated", "floor_dbm"), [(None, -125.0), (-104, -104.0)])
def test_the_floor_of_lte_is_noted_unless_it_is_given(stated, floor_dbm, world, tmp_path):
    pd.read_csv(world.plan).assign(technology="LTE").to_csv(tmp_path / "plan.csv", index=False)
    given = {"cells__plan": tmp_path / "plan.csv", "rasters__path": world.rasters}
    given |= {} if stated is None else {"database__floor_dbm": stated}
    done = mapfilter("build", "-c", world.toml, "--out", tmp_path, "--json", *settings(**given))
    notes = [note for note in assert_done(done).json["notes"] if "floor_dbm" in note]
    note = "database.floor_dbm = -125 is taken, the usual one of LTE cells"
    assert notes == ([note] if stated is None else [])
    assert open_database(tmp_path / "database").floor_dbm == floor_dbm


@pytest.fixture(params=["without a column", "empty"])
def powerless(request, world, tmp_path):
    """Settings of a build by a plan in mapfilter's own columns without any EIRP."""
    plan = pd.read_csv(world.plan)
    plan = plan.drop(columns="eirp_dbm") if request.param != "empty" else plan.assign(eirp_dbm="")
    plan.to_csv(tmp_path / "plan.csv", index=False)
    given = {"cells__plan": tmp_path / "plan.csv", "rasters__path": world.rasters}
    return settings(**given, rasters__quantity='"level"')


def test_a_value_that_is_stated_is_taken_for_a_plan_in_our_own_columns(world, powerless, tmp_path):
    stated = settings(cells__eirp_dbm=55)
    done = mapfilter("build", "-c", world.toml, "--out", tmp_path, "--json", *powerless, *stated)
    notes = assert_done(done).json["notes"]
    expected = ["eirp_dbm = 55 for 3 of 3 cells without one"]
    assert [note for note in notes if "without one" in note] == expected
    cells = open_database(tmp_path / "database").plan.cells
    assert {cell.eirp_dbm for cell in cells} == {55.0}
    assert all("eirp_dbm" in cell.assumes for cell in cells)


def test_a_value_that_nobody_states_is_missed_with_the_name_of_its_setting(
    world, powerless, tmp_path
):
    done = mapfilter("build", "-c", world.toml, "--out", tmp_path, *powerless)
    assert_refused(done, "eirp_dbm", "set cells.eirp_dbm, which is then taken for all cells")
