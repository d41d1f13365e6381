"""Headings of a log without positions: from true north to the north of an area's grid."""

import math

import numpy as np
import pandas as pd
import pytest

import mapfilter as mf
from mapfilter.errors import InputError
from mapfilter.geodesy import project
from mapfilter.lattice import Lattice
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.tracks.checks.placeless import in_frame
from mapfilter.tracks.log import make_log
from mapfilter.tracks.open_log import open_log
from mapfilter.tracks.open_options import CombineOptions, OpenOptions
from mapfilter.workflows.convert import run_convert

CRS, LAT, LON = "EPSG:32635", 60.17, 24.94
# Of the meridian of zone 35, 27 degrees east: by the sine of the latitude.
CONVERGENCE_RAD = math.radians((LON - 27.0) * math.sin(math.radians(LAT)))
LOCAL = "+proj=tmerc +lat_0=0 +lon_0=0 +k=1 +x_0=0 +y_0=0 +datum=WGS84 +units=m +type=crs"
AZIMUTH_DEG = 30.0


def plan():
    east, north = project(CRS, LON, LAT)
    cell = Cell("A", "A", float(east), float(north), 30.0, None, 50.0, 1800.0, "omni")
    return CellPlan(CRS, (cell,))


def recording(folder, heading="compass_deg", value=AZIMUTH_DEG, **more):
    """Write 40 s of steps with a direction and one cell."""
    rows = {"time": 1.7e9 + np.arange(40.0), "step_m": 1.4, heading: value}
    rows |= {"cell": "A", "level_dbm": -80.0, **more}
    path = folder / "walk.csv"
    pd.DataFrame(rows).to_csv(path, index=False)
    return path


def heading_rad(log):
    (found,) = set(log.motion["heading_rad"].dropna().round(9))
    return found


def located_heading_rad(log):
    return heading_rad(mf.locate(log, filter=mf.KalmanFilter().over_sites(plan()), seed=0).log)


def test_headings_of_a_compass_are_turned_to_the_grid_of_the_area(tmp_path):
    walk = recording(tmp_path)
    expected = math.radians(90.0 - AZIMUTH_DEG) + CONVERGENCE_RAD
    assert located_heading_rad(walk) == pytest.approx(expected, abs=1e-4)
    run_convert([walk], tmp_path / "log")
    log = mf.read_log(tmp_path / "log")
    assert heading_rad(log) == pytest.approx(math.radians(90.0 - AZIMUTH_DEG))
    assert located_heading_rad(log) == pytest.approx(expected, abs=1e-4)
    assert located_heading_rad(tmp_path / "log") == pytest.approx(expected, abs=1e-4)


def test_positions_or_an_origin_tell_the_place_themselves(tmp_path):
    walk = recording(tmp_path, lat=60.5, lon=27.0)
    expected = math.radians(90.0 - AZIMUTH_DEG)
    assert located_heading_rad(walk) == pytest.approx(expected, abs=1e-6)
    walk = recording(tmp_path)
    combine = CombineOptions(crs=CRS, origin_deg=(60.5, 27.0), about_deg=(LAT, LON))
    log = open_log(walk, options=OpenOptions(combine=combine)).log
    assert heading_rad(log) == pytest.approx(expected, abs=1e-6)


def test_headings_of_the_grid_stay_as_they_are_recorded(tmp_path):
    assert located_heading_rad(recording(tmp_path, "heading_rad", 0.5)) == pytest.approx(0.5)


def test_a_log_in_the_crs_of_the_area_is_turned_by_nothing():
    motion = pd.DataFrame({"time_s": np.arange(3.0), "step_m": 1.0, "heading_rad": 0.5})
    log = make_log(CRS, motion=motion)
    assert in_frame(log, CRS, (LAT, LON)) is log


def test_a_log_in_the_same_metres_by_another_name_is_one_of_the_area():
    places = pd.DataFrame({"time_s": np.arange(3.0), "east_m": 385_000.0, "north_m": 6_672_000.0})
    log = make_log("EPSG:3067", truth=places)
    found = in_frame(log, CRS, (LAT, LON))
    assert found.crs == CRS
    pd.testing.assert_frame_equal(found.truth, log.truth)
    elsewhere = make_log("EPSG:2393", truth=places)
    with pytest.raises(InputError, match="expected positions that EPSG:32635 covers"):
        in_frame(elsewhere, CRS, (LAT, LON))


def test_turned_headings_are_wrapped_and_noted():
    motion = pd.DataFrame({"time_s": np.arange(3.0), "step_m": 1.0})
    log = make_log(LOCAL, motion=motion.assign(heading_rad=[-np.pi, np.nan, 0.5]))
    found = in_frame(log, CRS, (LAT, LON))
    expected = [np.pi + CONVERGENCE_RAD, np.nan, 0.5 + CONVERGENCE_RAD]
    np.testing.assert_allclose(found.motion["heading_rad"], expected, atol=1e-4)
    noted = "taken to be in EPSG:32635, headings by its grid convergence there, 1.8 degrees"
    assert found.notes[-1] == f"no positions in the log: {noted}"
    turns = make_log(LOCAL, motion=motion.assign(turn_rad=0.1))
    assert in_frame(turns, CRS, (LAT, LON)).notes[-1].endswith("taken to be in EPSG:32635")


def test_the_middle_of_a_lattice_is_known_in_degrees():
    east, north = map(float, project(CRS, LON, LAT))
    lattice = Lattice(CRS, east - 100.0, north + 50.0, 10.0, 10, 20)
    assert lattice.middle_deg == pytest.approx((LAT, LON), abs=1e-9)
