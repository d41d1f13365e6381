"""Positions in degrees in the tables of a log."""

import numpy as np
import pandas as pd
import pytest
from pyproj import Transformer

import mapfilter as mf
from mapfilter.errors import InputError
from mapfilter.tracks.log import make_log
from mapfilter.tracks.store import read_log

CRS = "EPSG:32633"
LAT, LON = np.array([50.08, 50.081, 50.082]), np.array([14.42, 14.421, 14.42])


def positions(**more):
    return pd.DataFrame({"time_s": [0.0, 1.0, 2.0], "lat_deg": LAT, "lon_deg": LON, **more})


def test_positions_in_degrees_are_those_of_the_crs():
    log = make_log(CRS, gnss=positions(accuracy_m=[3.03, np.nan, 0.0]), truth=positions())
    east_m, north_m = Transformer.from_crs("EPSG:4326", CRS, always_xy=True).transform(LON, LAT)
    for table in (log.gnss, log.truth):
        assert table["east_m"].to_numpy() == pytest.approx(east_m, abs=1e-6)
        assert table["north_m"].to_numpy() == pytest.approx(north_m, abs=1e-6)
    # A radius of 68 % of two equal deviations is 1.51 of one: √(-2 ln 0.32).
    sd_m = np.sqrt(log.gnss["var_east_m2"].to_numpy())
    assert sd_m[0] == pytest.approx(3.03 / np.sqrt(-2 * np.log(0.32)), rel=5e-3)
    assert np.isnan(sd_m[1:]).all()
    assert log.gnss["cov_east_north_m2"].iloc[0] == 0
    assert "degrees" not in " ".join(log.notes)
    assert "not used" not in " ".join(log.notes)


@pytest.mark.parametrize("degrees", [False, True])
def test_an_accuracy_counts_beside_metres_too(degrees):
    given = make_log(CRS, gnss=positions()).gnss[["time_s", "east_m", "north_m"]]
    if degrees:
        given = given.assign(lat_deg=LAT, lon_deg=LON)
    stated = given.assign(accuracy_m=[3.03, np.nan, 0.0])
    log = make_log(CRS, gnss=stated)
    by_degrees = make_log(CRS, gnss=positions(accuracy_m=[3.03, np.nan, 0.0]))
    pd.testing.assert_frame_equal(log.gnss, by_degrees.gnss)
    assert not any("accuracy_m" in note for note in log.notes)
    with pytest.raises(InputError, match=r"gnss row 2, accuracy_m: expected metres in 0\.\.100000"):
        make_log(CRS, gnss=given.assign(accuracy_m=[3.03, -1.0, 0.0]))


def test_their_own_index_and_timestamps_are_kept():
    stamps = pd.to_datetime(
        ["2026-05-01 12:00:00Z", "2026-05-01 12:00:01Z", "2026-05-01 12:00:02Z"]
    )
    given = positions().drop(columns="time_s").set_index(stamps)
    log = make_log(CRS, gnss=given, truth=given.iloc[::-1])
    assert log.gnss["time_s"].tolist() == [0.0, 1.0, 2.0]
    assert log.gnss["east_m"].tolist() == log.truth["east_m"].tolist()


def test_a_folder_may_hold_them(tmp_path):
    folder = tmp_path / "walk"
    folder.mkdir()
    (folder / "log.json").write_text('{"crs": "EPSG:32633"}')
    positions(accuracy_m=5.0).to_csv(folder / "gnss.csv", index=False)
    read = read_log(folder)
    assert read.gnss.equals(make_log(CRS, gnss=positions(accuracy_m=5.0)).gnss)


@pytest.mark.parametrize(
    ("column", "row", "value", "told"),
    [
        ("lat_deg", 1, 100.0, "gnss row 2, lat_deg: expected degrees in -90..90, found 100.0"),
        ("lon_deg", 0, 5_548_000.0, "lon_deg: expected degrees in -180..180, found 5548000.0"),
        ("lat_deg", 2, np.nan, "gnss row 3, lat_deg: expected degrees in -90..90, found nan"),
        ("lat_deg", 2, "north", "gnss row 3, lat_deg: expected degrees in -90..90, found north"),
        ("accuracy_m", 0, -4.0, "gnss row 1, accuracy_m: expected metres in 0..100000, found -4.0"),
    ],
)
def test_what_is_no_position_is_told_with_its_row(column, row, value, told):
    given = positions(accuracy_m=5.0).astype({column: object})
    given.loc[row, column] = value
    with pytest.raises(mf.MapfilterError) as refused:
        make_log(CRS, gnss=given)
    assert told in str(refused.value)


@pytest.mark.parametrize(
    ("column", "low", "high"),
    [("lat_deg", -90, 90), ("lon_deg", -180, 180), ("accuracy_m", 0, 100_000)],
)
def test_each_range_ends_where_it_is_told_to(column, low, high):
    for value, is_in in ((low, True), (high, True), (low - 0.001, False), (high + 0.001, False)):
        given = positions(accuracy_m=5.0)
        given.loc[1, column] = value
        if is_in:
            # At a pole, or on the other side of the earth, the zone has no coordinates.
            assert len(make_log(CRS, gnss=given).gnss) >= len(given) - 1
            continue
        with pytest.raises(mf.MapfilterError, match=f"row 2, {column}: expected .*{low}..{high},"):
            make_log(CRS, gnss=given)


def test_degrees_beside_metres_are_not_used():
    given = positions(east_m=458_000.0, north_m=5_548_000.0)
    log = make_log(CRS, gnss=given)
    assert set(log.gnss["east_m"]) == {458_000.0}
    assert "gnss: column lat_deg is not used" in log.notes


def test_neither_metres_nor_degrees():
    with pytest.raises(mf.MapfilterError, match="or lat_deg and lon_deg, found neither"):
        make_log(CRS, truth=positions().rename(columns={"lat_deg": "y", "lon_deg": "x"}))


def test_a_wrong_crs_is_the_only_fault_of_degrees():
    with pytest.raises(mf.MapfilterError) as refused:
        make_log("EPSG:4326", gnss=positions(accuracy_m=5.0))
    assert "neither" not in str(refused.value)
    assert "crs" in str(refused.value)


def test_given_variances_count_and_a_truth_has_no_accuracy():
    given = positions(accuracy_m=5.0, var_east_m2=4.0, var_north_m2=4.0, cov_east_north_m2=0.0)
    log = make_log(CRS, gnss=given, truth=positions(accuracy_m=5.0))
    assert set(log.gnss["var_east_m2"]) == {4.0}
    assert "var_east_m2" not in log.truth
    unused = [note for note in log.notes if "not used" in note]
    assert unused == ["gnss: column accuracy_m is not used", "truth: column accuracy_m is not used"]


@pytest.mark.parametrize(("decimals", "sd_m"), [(3, 32.1), (2, 321.0), (4, None)])
def test_degrees_of_few_decimals_have_their_error(decimals, sd_m):
    """As those of a recording."""
    step = np.arange(12)
    degrees = {"lat_deg": (50.0 + 3e-3 * step).round(decimals), "lon_deg": 14.0 + step / 100}
    rows = pd.DataFrame({"time_s": 1.0 * step, **degrees})
    if decimals == 4:
        rows["lat_deg"] += 1e-4
    log = make_log(CRS, gnss=rows.assign(accuracy_m=[3.03] * 11 + [np.nan]), truth=rows)
    found_m = np.sqrt(log.gnss["var_east_m2"].to_numpy())
    if sd_m is None:
        assert (log.notes, found_m[0]) == ((), pytest.approx(2.0, rel=1e-3))
        assert np.isnan(found_m[-1])
        return
    assert found_m == pytest.approx([np.hypot(2.0, sd_m)] * 11 + [sd_m], rel=2e-3)
    of = f"degrees of {decimals} decimals, in steps of {111195 / 10**decimals:.0f} m: errors"
    assert [note.split(": ", 1)[1].startswith(of) for note in log.notes] == [True, True]
    assert [note.split(": ", 1)[0] for note in log.notes] == ["gnss", "truth"]
    stated = {"var_east_m2": 4.0, "var_north_m2": 4.0, "cov_east_north_m2": 0.0}
    assert set(make_log(CRS, gnss=rows.assign(**stated)).gnss["var_east_m2"]) == {4.0}
    # A few rows may be round by chance, and a place that was stated once is no receiver's.
    assert make_log(CRS, gnss=rows.iloc[:9]).notes == ()
    assert make_log(CRS, gnss=rows.assign(lat_deg=50.0, lon_deg=14.0)).notes == ()


@pytest.mark.parametrize(
    ("columns", "hint"),
    [
        (["Latitude", "Longitude"], "latitude and longitude; call them lat_deg and lon_deg"),
        (["lat", "lng"], "lat and lng; call them lat_deg and lon_deg"),
        (["x", "y"], "x and y; call them east_m and north_m if they are metres"),
        (["geometry"], "points; give east_m and north_m, their x and y"),
    ],
)
def test_positions_by_other_names_are_told_what_they_are_called(columns, hint):
    with pytest.raises(InputError) as caught:
        make_log("EPSG:32635", truth=pd.DataFrame({name: [0.0] for name in ("time_s", *columns)}))
    assert hint in str(caught.value)
