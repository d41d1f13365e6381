"""Cell plans from and to tables of pandas, as those from and to files."""

import numpy as np
import pandas as pd
import pytest

import mapfilter as mf
from mapfilter.errors import ConfigError, InputError

CRS = "EPSG:32635"
GIVEN = pd.DataFrame(
    {
        "cell": ["K1", "K2", "R1"],
        "site": ["Kamppi", "Kamppi", "Rautatientori"],
        "lat": [60.1686, 60.1686, 60.1712],
        "lon": [24.938, 24.938, 24.9452],
        "height_m": [32, 32, 30.5],
        "azimuth_deg": [0, 120, np.nan],
        "eirp_dbm": 55,
        "frequency_mhz": 1800.2,
        "indoor": [False, False, True],
        "mcc": pd.array([244, 244, None], dtype="Int64"),
        "mnc": [91.0, 91.0, np.nan],
        "lac": [3021.0, 3021.0, np.nan],
        "ci": [11701.0, 68_719_476_735, np.nan],
        "technology": ["NR", "NR", None],
    }
)


def test_a_table_is_read_as_a_file_of_it(tmp_path):
    GIVEN.assign(indoor=GIVEN["indoor"].astype(int)).to_csv(tmp_path / "cells.csv", index=False)
    plan = mf.read_cell_plan(GIVEN, CRS)
    assert plan == mf.read_cell_plan(tmp_path / "cells.csv", CRS)
    assert plan["K2"].ci == 68_719_476_735
    assert plan["R1"].azimuth_deg is None
    assert plan["R1"].indoor


def test_a_plan_is_a_table_that_is_read_back():
    plan = mf.read_cell_plan(GIVEN, CRS)
    table = plan.to_dataframe()
    assert table["ci"].tolist()[:2] == [11701, 68_719_476_735]
    assert table["azimuth_deg"].isna().tolist() == [False, False, True]
    back = mf.read_cell_plan(table, CRS)
    for cell, other in zip(back.cells, plan.cells, strict=True):
        assert (cell.east_m, cell.north_m) == pytest.approx((other.east_m, other.north_m))
        assert (cell.id, cell.ci, cell.site, cell.indoor) == (
            *(other.id, other.ci, other.site),
            other.indoor,
        )
    points = plan.to_geodataframe()
    assert points.crs.to_epsg() == 32635
    assert points.geometry.x.tolist() == [cell.east_m for cell in plan.cells]
    empty = mf.CellPlan(CRS, ())
    assert len(empty.to_dataframe()) == len(empty.to_geodataframe()) == 0


def test_columns_of_other_names_and_defaults_are_those_of_files():
    given = GIVEN.rename(columns={"lat": "Breite"}).drop(columns="height_m")
    plan = mf.read_cell_plan(given, CRS, columns={"lat": "Breite"}, defaults={"height_m": 25})
    assert plan["K1"].height_m == 25


def test_faults_are_told_by_their_rows():
    with pytest.raises(InputError, match=r"table row 2, azimuth_deg: expected .*found 412"):
        mf.read_cell_plan(GIVEN.assign(azimuth_deg=[0, 412, 0]), CRS)
    with pytest.raises(InputError, match="cell plan: expected a table with rows"):
        mf.read_cell_plan(GIVEN.iloc[:0], CRS)
    with pytest.raises(ConfigError, match="expected a path"):
        mf.read_cell_plan(None, CRS)
