"""What a first-time user is likely to give instead, and what the message says to do with it."""

import numpy as np
import pandas as pd
import pytest
from cross_world import LATTICE, levels_dbm, make_database, make_plan, make_routes, walk_log

import mapfilter as mf


@pytest.fixture(scope="module")
def database(tmp_path_factory):
    return make_database(tmp_path_factory.mktemp("cross"))


def refused(call, *given, **named):
    with pytest.raises(mf.MapfilterError) as caught:
        call(*given, **named)
    return str(caught.value)


@pytest.fixture(scope="module")
def rasters(tmp_path_factory):
    path = tmp_path_factory.mktemp("rasters") / "levels.tif"
    levels = {cell.id: levels_dbm(cell) for cell in make_plan().cells}
    return mf.open_rasters(mf.write_rasters(path, LATTICE, levels))


def test_what_is_given_for_a_log(database):
    table = walk_log().motion
    for call in (mf.locate, mf.locate_reports):
        assert "mf.make_log(crs, motion=…) makes a log of it" in refused(call, table, database)
        several = {"journey-0000-draw-000": walk_log()}
        assert "give one of them" in refused(call, several, database)


def test_what_is_given_for_rasters_a_plan_and_routes(rasters, tmp_path):
    levels = dict(zip(rasters.cell_ids, rasters.read(), strict=True))
    plan, routes = make_plan(), make_routes()
    for arrays in (levels, rasters.read()):
        assert "write_rasters writes them" in refused(mf.open_rasters, arrays)
        assert "write_rasters writes them" in refused(
            mf.build, arrays, plan, routes, tmp_path / "d"
        )
        assert "write_rasters writes them" in refused(mf.simulate, arrays, plan, "helsinki")
    table = plan.to_dataframe()
    assert "read_cell_plan reads" in refused(mf.build, rasters, table, routes, tmp_path / "d")
    assert "read_routes reads" in refused(mf.build, rasters, plan, "helsinki", tmp_path / "d")


def test_what_is_given_for_a_picture(database, tmp_path):
    track = mf.locate(walk_log(), database, "candidate")
    message = refused(mf.save_picture, track, tmp_path / "track.png")
    assert "likely: what plot() of it returns" in message


@pytest.mark.parametrize("options", [mf.BayesFilter(), mf.GridFilter(), mf.CandidateFilter(),
                                     mf.KalmanFilter()], ids=lambda one: one.name)  # fmt: skip
def test_options_are_bound_to_a_database_and_not_to_its_path(options, database):
    message = refused(options.over, database.path)
    assert message.startswith(f"{type(options).__name__}.over, database: expected a database of")
    assert "likely: its path; open_database opens it" in message
    bound = options.over(database)
    # The map has too many numbers to be shown.
    assert len(repr(bound)) < 100
    assert repr(options.name) in repr(bound)
    assert database.crs in repr(bound)
    assert len(repr(bound.begin())) < 3000


def test_a_state_is_shown_in_one_line(database):
    bayes = mf.BayesFilter().over(database)
    assert repr(bayes.begin()) == "<BayesState SEARCHING: 0 hypotheses, 0 m travelled>"
    state = bayes.begin_at(*database.lattice.east_north(30, 40), 5.0, np.random.default_rng(0))
    assert repr(state).startswith("<BayesState TRACKING: ")


def test_an_epoch_is_made_of_names_at_the_front_door(database):
    bayes, rng = mf.BayesFilter().over(database), np.random.default_rng(0)
    cell = database.cell_ids[0]
    report = mf.ReportRow("serving", cell, level_dbm=-70.0)
    assert report == mf.ReportRow("serving", cell, None, None, -70.0, 0)
    epoch = mf.Epoch(0.0, (mf.MotionStep(1.4, 0.1),), (report,), mf.GnssFix(500.0, 900.0))
    _, output = bayes.step(bayes.begin(), epoch, rng)
    assert output.fix.time_s == 0.0


def test_everything_on_a_lattice_has_its_crs(database, rasters):
    for one in (database, rasters, make_routes(), make_plan()):
        assert one.crs == LATTICE.crs


def test_a_plan_has_positions_under_the_names_of_logs():
    plan = make_plan()
    table = plan.to_dataframe()
    degrees = table.rename(columns={"lat": "lat_deg", "lon": "lon_deg"})
    assert mf.read_cell_plan(degrees, plan.crs) == mf.read_cell_plan(table, plan.crs)
    metres = table.drop(columns=["lat", "lon"]).assign(
        east_m=[cell.east_m for cell in plan.cells], north_m=[cell.north_m for cell in plan.cells]
    )
    assert mf.read_cell_plan(metres, plan.crs).cells == plan.cells
    twice = refused(mf.read_cell_plan, metres.assign(east=metres["east_m"]), plan.crs)
    assert "expected one column of them, found east and east_m" in twice
    both = refused(mf.read_cell_plan, metres.assign(lat_deg=0.0, lon_deg=0.0), plan.crs)
    assert "expected lat and lon, or east and north, found both" in both


def test_messages_on_plans_name_arguments_of_python():
    table = make_plan().to_dataframe().drop(columns=["eirp_dbm"]).assign(colour="red")
    message = refused(mf.read_cell_plan, table, make_plan().crs)
    assert "name what it holds in columns)" in message
    assert 'set defaults={"eirp_dbm": …}, which is then taken for all cells' in message
    atoll = pd.DataFrame({"TX_ID": ["A"], "AZIMUT": [0], "HEIGHT": [30.0], "SITE_NAME": ["A"]})
    assert 'set layout="atoll"' in refused(mf.read_cell_plan, atoll, make_plan().crs)


def test_a_column_that_is_missing_is_named_once():
    radio = walk_log().radio.drop(columns="role")
    message = refused(mf.make_log, walk_log().crs, radio=radio)
    assert message == "radio: expected a column role, found none"
