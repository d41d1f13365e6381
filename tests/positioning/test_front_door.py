"""The front door: names, laziness, how objects are shown, errors."""

import subprocess
import sys

import pandas as pd
import pytest
from cross_world import make_database, walk_log

import mapfilter as mf


@pytest.fixture(scope="module")
def database(tmp_path_factory):
    return make_database(tmp_path_factory.mktemp("cross"))


@pytest.mark.parametrize("name", mf.__all__)
def test_every_name_loads_and_is_documented(name):
    assert getattr(mf, name).__doc__


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = mf.nothing


def test_importing_it_loads_no_library():
    code = (
        "import sys, mapfilter; "
        "print(sorted({'numpy', 'pandas', 'geopandas', 'numba', 'pydantic'} & set(sys.modules)))"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"


@pytest.fixture(scope="module")
def track(database):
    return mf.locate(walk_log(), database, "candidate")


def test_objects_are_shown_in_two_lines(database, track):
    for one in (database, walk_log(), track, mf.score(track, walk_log().truth)):
        lines = repr(one).splitlines()
        assert 1 <= len(lines) <= 2, one
        assert max(map(len, lines)) <= 130, one


def test_a_track_as_tables_and_a_picture(track, database):
    table, places = track.to_dataframe(), track.to_geodataframe()
    assert len(table) == len(track)
    assert {"time_s", "east_m", "north_m", "radius_95_m", "status", "reason"} <= set(table)
    assert len(places) == table["east_m"].notna().sum() < len(table)
    assert places.crs == database.lattice.crs
    assert track.plot().get_title()
    assert "<table" in track._repr_html_()


@pytest.mark.parametrize("filter_", [mf.CandidateFilter(), "candidate"], ids=str)
def test_a_filter_is_given_by_options_or_name(filter_, database, track):
    found = mf.locate(walk_log(), database, filter_)
    pd.testing.assert_frame_equal(found.to_dataframe(), track.to_dataframe())


def test_a_score_has_the_error_of_each_epoch(track):
    score = mf.score(track, walk_log().truth)
    assert score.switched
    assert score.error_m.shape == (len(track),)
    assert list(score.to_dataframe()["success"]) == [score.success]
    assert repr(mf.score(track.estimate, walk_log().truth)) == repr(score)


def test_what_is_no_ground_truth_is_refused(track):
    with pytest.raises(mf.MapfilterError, match="columns time_s, east_m and north_m, found x"):
        mf.score(track, pd.DataFrame({"x": [1.0]}))
    with pytest.raises(mf.MapfilterError, match="two positions or more, found 1"):
        mf.score(track, walk_log().truth.iloc[:1])


def test_an_unknown_filter_is_refused(database):
    with pytest.raises(mf.MapfilterError, match="filter: expected bayes"):
        mf.locate(walk_log(), database, "bays")
