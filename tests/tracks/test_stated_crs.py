"""Parts of a table of positions state its CRS; the same projected by hand do not."""

import numpy as np
import pandas as pd
import pytest

from mapfilter.tracks.stated_crs import crs_stated, placed_in

CRS = "EPSG:32635"
WAY_M = np.cumsum(np.where(np.arange(1000) // 250 % 2, 3.0, 3.0j))


def placed():
    time_s = np.arange(float(WAY_M.size))
    return placed_in(
        CRS, pd.DataFrame({"time_s": time_s, "east_m": WAY_M.real, "north_m": WAY_M.imag})
    )


def test_parts_and_places_between_are_of_the_way():
    rows = placed()
    between = rows.rolling(2).mean().dropna()
    between.attrs = rows.attrs
    for part in (rows, rows.iloc[300:301], rows.iloc[::7], rows[::-1], between, rows.iloc[:0]):
        assert crs_stated(part) == CRS


@pytest.mark.parametrize("part", [slice(0, 1000), slice(100, 500), slice(400, 700)])
def test_a_part_that_was_projected_by_hand_within_the_extent_states_none(part):
    """It lay within the bounds of the whole, and was projected a second time."""
    rows = placed().iloc[part]
    moved = rows.assign(east_m=rows["east_m"] + 80, north_m=rows["north_m"] + 200)
    assert moved.attrs
    assert crs_stated(moved) == ""


def test_the_attributes_are_those_that_parquet_keeps(tmp_path):
    placed().to_parquet(tmp_path / "truth.parquet")
    assert crs_stated(pd.read_parquet(tmp_path / "truth.parquet")) == CRS
