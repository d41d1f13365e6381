"""What must not change where a log is located: the future, the truth, the clock, the place."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from cross_world import CRS, LATTICE, WALK, levels_dbm, make_plan, make_routes, walk_tables

import mapfilter as mf
from mapfilter.database.build import build
from mapfilter.radio.cells import CellPlan
from mapfilter.rasters.geotiff_writer import write_rasters
from mapfilter.rasters.opening import open_rasters
from mapfilter.tracks.kinds import leave_out

FEW = {"max_particles": 1500, "min_search_particles": 800, "min_particles": 300}
FILTERS = {
    "bayes": mf.BayesFilter(**FEW),
    "candidate": mf.CandidateFilter(update_length_m=10.0),
    "ekf": mf.KalmanFilter(start_parts=5),
}
SEED = 5
ELSEWHERE_M = {"east_m": -5.0 * 2**14, "north_m": 5.0 * 2**18}
"""Whole pixels, and powers of two, so that coordinates lose no digits."""


def make_database(folder, crs=CRS, east_m=0.0, north_m=0.0):
    """Return the database of the cross, moved."""
    west_m, top_m = LATTICE.west_m + east_m, LATTICE.north_m + north_m
    lattice = replace(LATTICE, crs=crs, west_m=west_m, north_m=top_m)
    plan = make_plan()
    cells = tuple(
        replace(cell, east_m=cell.east_m + east_m, north_m=cell.north_m + north_m)
        for cell in plan.cells
    )
    items = ((cell.id, levels_dbm(cell)) for cell in plan.cells)
    write_rasters(folder / "rxlev.tif", lattice, items, plan.ids)
    rasters, routes = open_rasters(folder / "rxlev.tif"), replace(make_routes(), lattice=lattice)
    return build(rasters, CellPlan(crs, cells), routes, folder / "database", floor_dbm=-110.0)


@pytest.fixture(scope="module")
def elsewhere(tmp_path_factory):
    folder = tmp_path_factory.mktemp("elsewhere")
    return make_database(folder, "EPSG:32733", **ELSEWHERE_M)


def tables():
    """A walk with noise, levels of both cells each second, and some fixes."""
    given, rng = walk_tables(WALK[:2]), np.random.default_rng(8)
    motion, radio, truth = given["motion"], given["radio"], given["truth"]
    motion["step_m"] *= rng.normal(1.0, 0.05, len(motion))
    motion["heading_rad"] += rng.normal(0.05, 0.1, len(motion))
    at = LATTICE.row_col(truth["east_m"], truth["north_m"])
    west, east, _ = make_plan().cells
    levels_of = levels_dbm(east)[at], levels_dbm(west)[at]
    other = np.where(radio["cell"] == "E", "W", "E")
    rows = [
        radio.assign(role=role, cell=cells, level_dbm=np.where(cells == "E", *levels_of))
        for role, cells in (("serving", radio["cell"].to_numpy()), ("neighbour", other))
    ]
    heard = pd.concat(rows).sort_values("time_s", kind="stable", ignore_index=True)
    heard["level_dbm"] += rng.normal(0, 3, len(heard)).round()
    fixes = truth[(truth["time_s"] % 10 == 0) & truth["time_s"].between(70, 110)]
    fixes = fixes.assign(
        east_m=fixes["east_m"] + rng.normal(0, 5, len(fixes)), var_east_m2=25.0, var_north_m2=25.0
    )
    return {"motion": motion, "radio": heard, "truth": truth, "gnss": fixes}


def located(database, given, name, **options):
    log = mf.make_log(database.lattice.crs, **given)
    return mf.locate(log, database, FILTERS[name], seed=SEED, **options).to_dataframe()


@pytest.fixture(scope="module", params=FILTERS)
def name(request):
    return request.param


@pytest.fixture(scope="module")
def whole(database, name):
    return located(database, tables(), name)


@pytest.mark.parametrize("end_s", [40, 90])
def test_what_comes_later_changes_nothing(whole, database, name, end_s):
    begun = {key: table[table["time_s"] <= end_s] for key, table in tables().items()}
    found = located(database, begun, name)
    assert len(found) == end_s + 1
    pd.testing.assert_frame_equal(found, whole[: len(found)], check_exact=True)


def test_the_ground_truth_changes_nothing(whole, database, name):
    given = tables()
    del given["truth"]
    pd.testing.assert_frame_equal(located(database, given, name), whole, check_exact=True)


@pytest.mark.parametrize("kind", ["gnss", "neighbours"])
def test_what_is_left_out_might_as_well_not_be_there(database, name, kind):
    given = tables()
    left = leave_out(mf.make_log(CRS, **given), [kind])
    if kind == "gnss":
        del given["gnss"]
    else:
        given["radio"] = given["radio"][given["radio"]["role"] == "serving"]
    found = mf.locate(left, database, FILTERS[name], seed=SEED).to_dataframe()
    pd.testing.assert_frame_equal(found, located(database, given, name), check_exact=True)


def test_the_clock_may_begin_years_later(whole, database, name):
    """By a power of two: some draws of the Bayes filter are by the milliseconds modulo 2^32."""
    later_s = 2.0**29
    given = {key: table.assign(time_s=table["time_s"] + later_s) for key, table in tables().items()}
    found = located(database, given, name)
    found["time_s"] -= later_s
    pd.testing.assert_frame_equal(found, whole, check_exact=True)


def test_the_world_may_lie_elsewhere(whole, elsewhere, name):
    """In another zone of the other hemisphere."""
    given = tables()
    for key in ("truth", "gnss"):
        for axis, moved_m in ELSEWHERE_M.items():
            given[key][axis] += moved_m
    found = located(elsewhere, given, name)
    for axis, moved_m in ELSEWHERE_M.items():
        for column in found.columns.intersection([axis, f"runner_up_{axis}"]):
            found[column] -= moved_m
    pd.testing.assert_frame_equal(found, whole, rtol=1e-9, atol=1e-6)


def test_what_is_recorded_besides_changes_nothing(whole, database, name):
    found = located(database, tables(), name, record=True, snapshots=True)
    pd.testing.assert_frame_equal(found, whole, check_exact=True)


@pytest.mark.parametrize("name", ["candidate", "ekf"])
def test_the_order_of_the_rows_of_a_report_changes_nothing(database, name):
    """The draws of ``bayes`` follow the rows: another order is like another seed."""
    given = tables()
    turned = given["radio"].iloc[::-1].sort_values("time_s", kind="stable", ignore_index=True)
    assert (turned["role"].iloc[0], given["radio"]["role"].iloc[0]) == ("neighbour", "serving")
    found, before = (
        located(database, given | {"radio": one}, name) for one in (turned, given["radio"])
    )
    pd.testing.assert_frame_equal(found, before)
