"""Every parameter of every public function refuses values of a wrong type, by its name."""

import inspect
from dataclasses import dataclass
from typing import Literal

import numpy as np
import pandas as pd
import pytest
from cross_world import LATTICE, make_database, make_routes, walk_log
from matplotlib.figure import Figure

import mapfilter as mf
from mapfilter.errors import ConfigError
from mapfilter.lattice import Lattice
from mapfilter.options import Options
from mapfilter.radio.plan_files import write_cell_plan
from mapfilter.roads.osm import read_ways
from mapfilter.roads.routes import read_roads

FUNCTIONS = [name for name in mf.__all__ if inspect.isfunction(getattr(mf, name))]
PARAMETERS = [
    (name, parameter)
    for name in FUNCTIONS
    for parameter in inspect.signature(getattr(mf, name)).parameters
]
NAMES_ALONE = {
    ("make_log", "row_numbers"),
    ("read_log", "paths"),
    ("read_log", "truth"),
    ("sweep", "filters"),
    ("write_rasters", "items"),
}
"""Of what is given for "a" they use the name, or say what is wrong in words of their own."""


class Nothing:
    """A value that no parameter takes."""


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    """Return the arguments without a default of each public function."""
    folder = tmp_path_factory.mktemp("cross")
    make_database(folder)
    database = mf.open_database(next(file.parent for file in folder.rglob("manifest.json")))
    raster, log = next(folder.rglob("*.tif")), walk_log()
    rasters = mf.open_rasters(raster, "level")
    write_cell_plan(database.plan, folder / "cells.csv")
    world = {"rasters": rasters, "roads": "helsinki"}
    located = mf.locate(log, database, "candidate")
    return {
        "bound": {"database": database},
        "build": {
            "rasters": rasters,
            "plan": database.plan,
            "routes": make_routes(),
            "out": folder / "out",
        },
        "epochs": {"log": log},
        "locate": {"log": log, "database": database},
        "locate_reports": {"log": log, "database": database},
        "make_log": {"crs": log.crs, "motion": log.motion},
        "open_database": {"path": database.path},
        "open_rasters": {"path": raster},
        "read_cell_plan": {"path": folder / "cells.csv", "crs": log.crs},
        "read_estimate": {"path": folder / "track.parquet"},
        "read_fingerprint_table": {"path": folder / "table.csv"},
        "read_log": {"paths": folder},
        "read_routes": {"roads": "helsinki", "lattice": LATTICE},
        "save_picture": {"picture": Figure(), "path": folder / "picture.png"},
        "score": {"track": located, "truth": log.truth},
        "simulate": world | {"plan": database.plan},
        "sweep": world | {"database": database, "filters": {"a": "bayes"}},
        "write_estimate": {"track": located, "path": folder / "track.parquet"},
        "write_log": {"log": log, "folder": folder / "log"},
        "write_rasters": {
            "path": folder / "new.tif",
            "lattice": LATTICE,
            "items": {"a": np.zeros((LATTICE.rows, LATTICE.cols))},
        },
    }


def refused(good, function, **wrong):
    with pytest.raises(mf.MapfilterError) as caught:
        getattr(mf, function)(**good[function] | wrong)
    return caught.value


def test_all_public_functions_are_tried(good):
    assert sorted(good) == sorted(FUNCTIONS)


@pytest.mark.parametrize(("function", "parameter"), PARAMETERS)
def test_another_type_is_refused_by_the_name_of_the_parameter(good, function, parameter):
    wrongs = [Nothing(), [Nothing()], {1: Nothing()}]
    if (function, parameter) not in NAMES_ALONE:
        wrongs.append({"a": Nothing()})
    for wrong in wrongs:
        assert parameter in str(refused(good, function, **{parameter: wrong}))


@pytest.mark.parametrize(
    ("function", "wrong", "expected"),
    [
        ("locate", {"risk": "a"}, "locate, risk: expected a number > 0 and < 1, found 'a'"),
        ("locate", {"ways": "no"}, "locate, ways: expected true or false, found 'no'"),
        ("locate", {"record": 1}, "locate, record: expected true or false, found 1"),
        ("simulate", {"journeys": 1.5}, "simulate, journeys: expected a whole number >= 1"),
        ("simulate", {"journeys": 2.0}, "simulate, journeys: expected a whole number >= 1"),
        ("simulate", {"profile": "flying"}, "'walking' or 'driving', found 'flying'"),
        ("sweep", {"routes": 1.5}, "sweep, routes: expected a whole number >= 1, found 1.5"),
        (
            "sweep",
            {"filters": {1: mf.BayesFilter()}},
            "sweep, filters, key: expected a text, found 1",
        ),
        ("sweep", {"filters": "bayes"}, "sweep, filters: expected names and options, such as"),
        ("sweep", {"filters": {}}, "sweep, filters: expected at least one, names and options"),
        ("sweep", {"noises": [mf.ImuNoise(), 3]}, "sweep, noises[1]: expected ImuNoise, found 3"),
        ("open_rasters", {"crs": 3}, "open_rasters, crs: expected a text"),
        ("open_rasters", {"quantity": "levels"}, "expected 'level', 'loss', 'deviation'"),
        ("open_rasters", {"resampling": "cubic"}, "'nearest' or 'bilinear', found 'cubic'"),
        ("open_rasters", {"factor": True}, "open_rasters, factor: expected a number, found True"),
        ("open_rasters", {"nodata": np.False_}, "open_rasters, nodata: expected a number, found F"),
        ("open_database", {"verify": "all"}, "expected 'sizes' or 'full', found 'all'"),
        ("read_cell_plan", {"layout": "Atoll"}, "'plan', 'atoll', or 'opencellid', found 'Atoll'"),
        ("write_log", {"format": "CSV"}, "expected 'parquet' or 'csv', found 'CSV'"),
        ("read_routes", {"profile": "Walking"}, "'walking' or 'driving', found 'Walking'"),
        ("read_routes", {"landuse": ("a.tif",)}, "two paths: of a raster and of its table"),
    ],
)
def test_the_message_says_what_is_expected(good, function, wrong, expected):
    error = refused(good, function, **wrong)
    assert isinstance(error, ConfigError)
    assert expected in str(error)


def test_each_wrong_entry_of_a_mapping_is_named(good):
    wrong = {"height_m": "30", "eirp_dbm": True, "frequency_mhz": 1800, 3: 4}
    error = refused(good, "read_cell_plan", defaults=wrong, columns={"cell": 1})
    assert isinstance(error, ConfigError)
    assert str(error).splitlines() == [
        "read_cell_plan, columns['cell']: expected a column's name, found 1",
        "read_cell_plan, defaults['height_m']: expected a number, found '30'",
        "read_cell_plan, defaults['eirp_dbm']: expected a number, found True",
        "read_cell_plan, defaults, key: expected a text, found 3",
    ]
    error = refused(good, "read_routes", half_width_by_class_m={"residential": "8"})
    assert "half_width_by_class_m['residential']: expected metres, found '8'" in str(error)


def test_all_wrong_arguments_are_named_together(good):
    error = refused(good, "simulate", journeys=0, draws="a", length_m=-1, imu=3, seed=-1)
    assert len(error.faults) == 5


def test_a_profile_is_refused_wherever_roads_are_read():
    with pytest.raises(ConfigError, match="read_roads, profile: expected 'walking' or 'driving'"):
        read_roads("helsinki", LATTICE, profile="Driving")
    with pytest.raises(ConfigError, match="read_ways, profile: expected 'walking' or 'driving'"):
        read_ways("helsinki", "", LATTICE.crs, LATTICE.bounds_m)


def test_numbers_and_truth_values_of_numpy_are_taken(good):
    found = mf.locate(**good["locate"], filter="candidate", ways=np.True_, risk=np.float64(1e-3))
    assert len(found) == len(good["score"]["track"])
    assert mf.make_log("EPSG:32629", vehicle=np.False_).vehicle is False
    town = Lattice.covering("EPSG:32635", (385500.0, 6671500.0, 385700.0, 6671700.0), 10.0)
    kept = mf.read_routes("helsinki", town, buildings=np.False_, water=np.False_)
    assert len(kept) == len(mf.read_routes("helsinki", town, buildings=False, water=False))


def test_texts_and_arrays_of_numpy_are_taken(good):
    assert mf.open_rasters(good["open_rasters"]["path"], np.str_("level")).quantity == "level"
    whole = mf.read_cell_plan(**good["read_cell_plan"])
    bounds_m = np.array(LATTICE.bounds_m) + np.array([-1e5, -1e5, 1e5, 1e5])
    for given in (bounds_m, pd.Series(bounds_m), list(bounds_m), tuple(bounds_m)):
        assert mf.read_cell_plan(**good["read_cell_plan"], bounds_m=given) == whole
    for wrong in (bounds_m[:3], bounds_m[None], np.full(4, np.nan), "abcd"):
        assert "bounds_m: expected west" in str(refused(good, "read_cell_plan", bounds_m=wrong))
    notes = np.array(["one", "another"])
    assert mf.make_log("EPSG:32629", notes=notes).notes == ("one", "another")


def test_options_hold_values_of_python_for_those_of_numpy():
    @dataclass(frozen=True, slots=True)
    class Some(Options):
        box: tuple[float, float]
        on: bool
        how: Literal["a", "b"]

    some = Some(np.array([1.0, 2.0]), np.True_, np.str_("b"))
    assert (some.box, some.on, some.how) == ((1.0, 2.0), True, "b")
    assert some.on is True
    assert [type(one) for one in some.box] == [float, float]
    with pytest.raises(ConfigError) as caught:
        Some(np.zeros(3), np.int64(1), np.str_("c"))
    assert len(caught.value.faults) == 3


def test_a_choice_of_another_option_is_named():
    with pytest.raises(ConfigError, match=r"level_error_db: .*'ukf' \(likely: method='ukf'\)"):
        mf.KalmanFilter("ukf")
    with pytest.raises(ConfigError, match=r"at_threshold='stall'"):
        mf.CandidateFilter(np.str_("stall"))
    with pytest.raises(ConfigError) as caught:
        mf.KalmanFilter("kf")
    assert "likely" not in str(caught.value)
