"""Positions far outside of the region of a CRS: left out with a note, or refused."""

import numpy as np
import pandas as pd
import pytest

import mapfilter as mf
from mapfilter.geodesy import project

LAT_DEG = np.full(30, 60.2)
LON_DEG = 25 + 1e-5 * np.arange(30)
FAR = np.where(np.arange(30) == 7, 130.0, LON_DEG)


def recording(folder, lon_deg, header="time,lat_deg,lon_deg,accuracy_m"):
    path = folder / "walk.csv"
    rows = (f"{1_700_000_000 + i},60.2,{lon:.6f},5" for i, lon in enumerate(lon_deg))
    path.write_text("\n".join([header, *rows, ""]))
    return path


def table(lon_deg):
    return pd.DataFrame({"time_s": np.arange(30.0), "lat_deg": LAT_DEG, "lon_deg": lon_deg})


@pytest.mark.parametrize("crs", ["", "EPSG:2393", "EPSG:3067"])
@pytest.mark.parametrize("role", ["gnss", "truth"])
def test_one_position_of_a_recording(tmp_path, crs, role):
    path = recording(tmp_path, FAR)
    log = mf.read_log(path, crs=crs, truth=path if role == "truth" else ())
    rows = getattr(log, role)
    assert len(rows) == 29
    assert np.ptp(rows["east_m"]) < 20
    name = crs or "EPSG:32635"
    note = f"walk.csv: 1 position left out: {name} has no such places; first 60.2, 130 (position 8)"
    assert note in log.notes


@pytest.mark.parametrize("role", ["gnss", "truth"])
def test_one_position_of_a_table(role):
    given = table(FAR).assign(accuracy_m=5.0) if role == "gnss" else table(FAR)
    log = mf.make_log("EPSG:2393", **{role: given})
    assert len(getattr(log, role)) == 29
    note = f"{role}: 1 position left out: EPSG:2393 has no such places; first 60.2, 130 (row 8)"
    assert note in log.notes


def test_a_crs_of_another_region_is_refused_with_the_zone_of_the_place(tmp_path):
    told = "expected positions that EPSG:32601 covers, found 60.2, 25 "
    hint = "a CRS of another region: at that place it is EPSG:32635"
    with pytest.raises(mf.MapfilterError) as refused:
        mf.read_log(recording(tmp_path, LON_DEG), crs="EPSG:32601")
    assert f"walk.csv: {told}(position 1) and 29 more" in str(refused.value)
    assert hint in str(refused.value)
    with pytest.raises(mf.MapfilterError) as refused:
        mf.make_log("EPSG:32601", gnss=table(LON_DEG))
    assert f"gnss: {told}(row 1) and 29 more" in str(refused.value)
    assert hint in str(refused.value)


@pytest.mark.parametrize(
    ("crs", "ground_m"), [("EPSG:3857", "50"), ("EPSG:3395", "50"), ("EPSG:6933", "57")]
)
def test_metres_of_the_world_are_none_on_the_ground(tmp_path, crs, ground_m):
    """A filter without a map would go on by steps that are half as long as the positions' way."""
    told = f": expected positions at which metres of {crs} are metres on the ground, found 60.2, 25"
    hint = "Web Mercator or another CRS of the world; at that place it is EPSG:32635"
    for where, made in (
        ("walk.csv", lambda: mf.read_log(recording(tmp_path, LON_DEG), crs=crs)),
        ("gnss", lambda: mf.make_log(crs, gnss=table(LON_DEG))),
        ("truth", lambda: mf.make_log(crs, truth=table(LON_DEG))),
    ):
        with pytest.raises(mf.MapfilterError) as refused:
            made()
        assert f"{where}{told}" in str(refused.value)
        assert f"where 100 m are {ground_m} m (likely: {hint})" in str(refused.value)


@pytest.mark.parametrize(
    ("crs", "ground_m"), [("EPSG:3857", "50"), ("EPSG:3395", "50"), ("EPSG:6933", "57")]
)
@pytest.mark.parametrize("name", ["gnss", "truth"])
def test_metres_of_the_world_given_as_metres_are_refused_alike(crs, ground_m, name):
    places = table(LON_DEG)
    east_m, north_m = project(crs, places["lon_deg"], places["lat_deg"])
    rows = pd.DataFrame({"time_s": places["time_s"], "east_m": east_m, "north_m": north_m})
    with pytest.raises(mf.MapfilterError) as refused:
        mf.make_log(crs, **{name: rows})
    told = f"{name}: expected positions at which metres of {crs} are metres on the ground, found 60"
    assert told in str(refused.value)
    hint = "at that place it is EPSG:32635, or give lat_deg and lon_deg"
    assert f", where 100 m are {ground_m} m (likely: " in str(refused.value)
    assert hint in str(refused.value)
    # At the equator they are right.
    on_equator = rows.assign(north_m=rows["north_m"] - rows["north_m"].iloc[0])
    if crs != "EPSG:6933":
        assert len(getattr(mf.make_log(crs, **{name: on_equator}), name)) == len(rows)


def test_a_single_position_where_metres_are_none_is_no_fault():
    """In the far north of it lengths of Europe's conic CRS are off by 15 %."""
    places = table(LON_DEG)
    assert mf.make_log("EPSG:3034", gnss=places.assign(lat_deg=[80.0, *places["lat_deg"][1:]]))
    with pytest.raises(mf.MapfilterError, match=r"found 80, 25\S*, where 100 m are 85 m"):
        mf.make_log("EPSG:3034", gnss=places.assign(lat_deg=80.0))


def test_metres_of_the_world_are_right_at_the_equator():
    log = mf.make_log("EPSG:3857", gnss=table(LON_DEG).assign(lat_deg=5.0))
    assert (len(log.gnss), log.notes) == (30, ())


def test_a_compound_crs_is_that_of_its_horizontal_part(tmp_path):
    log = mf.read_log(recording(tmp_path, LON_DEG), crs="EPSG:3067+3900")
    assert log.crs == "EPSG:3067"
    flat = mf.read_log(recording(tmp_path, LON_DEG), crs="EPSG:3067")
    assert log.gnss.equals(flat.gnss)
