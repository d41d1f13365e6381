"""LTE maps of Ottawa from real walks and rides, each session told by the others."""

import pickle

import numpy as np
import pytest
import shapely

from mapfilter.database.build import build
from mapfilter.lattice import Lattice
from mapfilter.rasters.opening import open_rasters
from mapfilter.roads.route_points import route_lattice
from mapfilter.roads.ways import Ways
from mapfilter.survey import measured_map
from mapfilter.survey.leave_out import leave_out
from mapfilter.survey.measured_map import fit_survey
from mapfilter.survey.options import SurveyOptions
from mapfilter.survey.read_measurements import read_measurements
from mapfilter.survey.residual_field import learn_shadowing
from mapfilter.survey.survey_rasters import surveyed_plan, write_survey


@pytest.fixture(scope="module")
def walks(shared_data):
    return read_measurements([shared_data / "cell-ottawa-lte" / "carling"]).accurate(50.0)


@pytest.fixture(scope="module")
def rides(shared_data):
    return read_measurements([shared_data / "cell-ottawa-lte" / "uottawa"]).accurate(50.0)


def test_real_uploads_are_read_whole(walks, rides):
    assert (len(walks), len(walks.sessions), len(walks.cell_ids)) == (1282, 8, 10)
    assert (len(rides), len(rides.sessions), len(rides.cell_ids)) == (517, 3, 33)
    assert walks.crs == rides.crs == "EPSG:32618"
    assert walks.notes == ("10 rows left out: positions less accurate than 50 m",)
    assert walks.level_dbm.min() >= -117
    assert set(walks.technologies.values()) == {"LTE"}


def test_real_logs_of_neighbours_are_read(shared_data):
    found = read_measurements([shared_data / "gsm-antennas-log"])
    assert len(found) == 38
    assert found.notes == ("20140924-192136.log: 6 levels given only as bounds (>)",)


@pytest.fixture(scope="module")
def learnt():
    """Shadowing is the same for each method: learnt from equal points and trends once."""
    known = {}

    def once(points, trends, start):
        key = pickle.dumps((points, trends, start))
        if key not in known:
            known[key] = learn_shadowing(points, trends, start)
        return known[key]

    return once


@pytest.mark.parametrize("method", ["gp", "knn"])
def test_residuals_tell_left_out_sessions_better_than_path_loss(
    walks, rides, method, learnt, monkeypatch
):
    monkeypatch.setattr(measured_map, "learn_shadowing", learnt)
    for rows, worst_db in ((walks, 4.7), (rides, 4.9)):
        found = leave_out(rows, SurveyOptions(method=method)).validation
        assert found.by_session
        assert found.predicted > 0.7 * found.measurements
        assert found.rmse_db < worst_db
        assert found.rmse_db < 0.95 * found.trend_rmse_db
        assert found.rmse_db < 0.85 * found.mean_rmse_db
        assert abs(found.bias_db) < 0.5
        assert 0.8 < found.deviation_factor < 1.4


def test_the_walks_become_a_database_of_their_own_tracks(walks, tmp_path):
    survey = fit_survey(walks, SurveyOptions())
    places = np.column_stack([walks.east_m, walks.north_m])
    west, south = places.min(axis=0)
    east, north = places.max(axis=0)
    lattice = Lattice.covering(walks.crs, (west - 50, south - 50, east + 50, north + 50), 5.0)
    mean = tmp_path / "rxlev.tif"
    ids = write_survey(survey, lattice, mean, tmp_path / "deviation.tif")
    plan = surveyed_plan(
        survey, ids, walks.identities, None, height_m=30.0, eirp_dbm=52.0, frequency_mhz=1900.0
    )
    tracks = [shapely.LineString(places[walks.session == i]) for i in range(len(walks.sessions))]
    count = len(tracks)
    ways = Ways(
        walks.crs,
        np.arange(1, count + 1),
        np.zeros(count, np.int16),
        ("track",),
        np.array(tracks),
        np.zeros(count, np.bool_),
        np.zeros(count, np.int8),
    )
    routes = route_lattice(ways, None, None, lattice)
    database = build(open_rasters(mean), plan, routes, tmp_path / "database", floor_dbm=-125.0)
    assert database.cell_ids == ids
    assert len(ids) == 10
    best = np.bincount(database.points().best_server, minlength=len(ids))
    assert best.sum() > 2000
    assert np.count_nonzero(best) >= 6
