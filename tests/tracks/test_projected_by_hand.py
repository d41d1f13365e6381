"""Logs in another CRS: places, headings and errors on the ground, and what a CRS does not cover."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from pyproj import Geod

from mapfilter.errors import Faults, InputError
from mapfilter.geodesy import project, unproject
from mapfilter.tracks.checks.beyond_crs import check_metres, within_crs, without_beyond
from mapfilter.tracks.log import make_log
from mapfilter.tracks.projected import projected_log, truth_in
from mapfilter.tracks.readers.recorded.recording import Clock, Recording
from mapfilter.tracks.stated_crs import crs_stated, placed_in

OWN, OTHER = "EPSG:32635", "EPSG:32634"
"""Zones about 27 and 21 degrees east: at 24.9 the north of their grids is 5 degrees apart."""
LAT, LON = 60.17, 24.94
GEOD = Geod(ellps="WGS84")


def walk(count=5, crs=OWN):
    """Places 10 m apart on the ground, north-east."""
    lon_deg, lat_deg, _ = GEOD.fwd(
        np.full(count, LON), np.full(count, LAT), np.full(count, 45.0), 10.0 * np.arange(count)
    )
    east_m, north_m = project(crs, lon_deg, lat_deg)
    return pd.DataFrame({"time_s": np.arange(float(count)), "east_m": east_m, "north_m": north_m})


def strayed(count=5):
    """The walk, with its third place in the far east."""
    rows = walk(count)
    rows.loc[2, ["east_m", "north_m"]] = np.ravel(project(OWN, 100.0, LAT))
    return rows


def azimuth_deg(crs, rows):
    lon_deg, lat_deg = unproject(crs, rows["east_m"], rows["north_m"])
    return GEOD.inv(lon_deg[0], lat_deg[0], lon_deg[-1], lat_deg[-1])[0]


def test_places_headings_and_errors_are_those_of_the_ground():
    rows = walk()
    way = rows[["east_m", "north_m"]].diff()
    heading_rad = np.arctan2(way["north_m"], way["east_m"])
    motion = pd.DataFrame({"time_s": rows["time_s"], "step_m": 10.0, "heading_rad": heading_rad})
    along = (way.iloc[-1] / np.hypot(*way.iloc[-1])).to_numpy()
    # Errors of 30 m along the way and of 2 m across it.
    errors = 896 * np.outer(along, along) + 4 * np.eye(2)
    gnss = rows.assign(
        var_east_m2=errors[0, 0], var_north_m2=errors[1, 1], cov_east_north_m2=errors[0, 1]
    )
    log = make_log(OWN, motion=motion.iloc[1:], gnss=gnss, truth=rows.iloc[:3])
    found = projected_log(log, OTHER)
    assert found.crs == OTHER
    for name in ("gnss", "truth"):
        table, before = getattr(found, name), getattr(log, name)
        np.testing.assert_allclose(
            np.column_stack(unproject(OTHER, table["east_m"], table["north_m"])),
            np.column_stack(unproject(OWN, before["east_m"], before["north_m"])),
            atol=1e-9,
        )
        assert azimuth_deg(OTHER, table) == pytest.approx(45.0, abs=1e-3)
        assert crs_stated(table) == OTHER
    moved = found.gnss[["east_m", "north_m"]].diff()
    expected_rad = np.arctan2(moved["north_m"], moved["east_m"]).to_numpy()[1:]
    np.testing.assert_allclose(found.motion["heading_rad"], expected_rad, atol=1e-3)
    turned_deg = np.degrees(expected_rad[0] - heading_rad.iloc[1])
    assert abs(turned_deg) > 4
    assert found.notes[-1] == (
        f"projected from {OWN} to {OTHER}: positions, headings by {turned_deg:.2f} degrees "
        "(grid convergence)"
    )
    one = found.gnss.iloc[1]
    turned = np.array(
        [
            [one["var_east_m2"], one["cov_east_north_m2"]],
            [one["cov_east_north_m2"], one["var_north_m2"]],
        ]
    )
    ahead = np.array([np.cos(expected_rad[0]), np.sin(expected_rad[0])])
    assert ahead @ turned @ ahead == pytest.approx(900, rel=1e-4)
    assert np.linalg.eigvalsh(turned) == pytest.approx([4, 900], rel=1e-6)
    # Steps stay, and so does the log that was given.
    assert found.motion["step_m"].tolist() == log.motion["step_m"].tolist()
    assert log.crs == OWN
    back = projected_log(found, OWN)
    for name in ("gnss", "truth", "motion"):
        pd.testing.assert_frame_equal(getattr(back, name), getattr(log, name), atol=1e-6)


def test_an_error_along_a_line_stays_none_across_it():
    gnss = walk().assign(var_east_m2=25.0, var_north_m2=0.0, cov_east_north_m2=0.0)
    found = projected_log(make_log(OWN, gnss=gnss), OTHER).gnss
    assert (found[["var_east_m2", "var_north_m2"]].to_numpy() >= 0).all()
    assert found[["var_east_m2", "var_north_m2"]].sum(axis=1).to_numpy() == pytest.approx(25.0)


HEADED = pd.DataFrame({"time_s": [1.0, 2.0], "step_m": 1.0, "heading_rad": [0.0, -3.1]})


def test_headings_without_positions_have_the_place_that_is_given():
    log = make_log(OWN, motion=HEADED)
    assert projected_log(log, OTHER) is log
    found = projected_log(log, OTHER, (LAT, LON))
    by_place = projected_log(make_log(OWN, motion=HEADED, truth=walk()), OTHER)
    assert found.motion["heading_rad"].tolist() == pytest.approx(
        by_place.motion["heading_rad"].tolist(), abs=1e-4
    )
    assert (found.motion["heading_rad"].abs() <= np.pi).all()
    assert "positions" not in found.notes[-1]
    # Turns need no place.
    turns = HEADED.drop(columns="heading_rad").assign(turn_rad=0.1)
    found = projected_log(make_log(OWN, motion=turns), OTHER)
    assert (found.crs, found.notes[-1]) == (OTHER, f"projected from {OWN} to {OTHER}")
    assert found.motion["turn_rad"].iloc[-1] == 0.1


def test_a_place_that_a_crs_does_not_cover_is_left_out_and_told():
    found = projected_log(make_log(OWN, truth=strayed()), "EPSG:3067")
    assert found.truth["time_s"].tolist() == [0.0, 1.0, 3.0, 4.0]
    assert found.notes[-1].startswith("log, truth: 1 position left out: EPSG:3067 has no such")
    assert found.notes[-1].endswith("(position 3)")


def test_a_truth_is_projected_where_it_states_another_crs():
    rows = walk()
    assert truth_in(OTHER, rows, "") is rows
    assert truth_in(OWN, rows, OWN) is rows
    empty = rows.iloc[:0]
    assert truth_in(OTHER, empty, OWN) is empty
    found = truth_in(OTHER, rows, OWN)
    np.testing.assert_allclose(found[["east_m", "north_m"]], walk(crs=OTHER).iloc[:, 1:], atol=1e-6)
    far = strayed()
    assert truth_in("EPSG:2393", far, OWN)["time_s"].tolist() == [0.0, 1.0, 3.0, 4.0]
    with pytest.raises(InputError, match=r"truth: expected positions that EPSG:2393 covers"):
        truth_in("EPSG:2393", far.iloc[[2]], OWN)


def test_a_table_states_its_crs_as_long_as_it_holds_its_places():
    rows = placed_in(OWN, walk())
    assert crs_stated(rows) == crs_stated(rows.iloc[1:3]) == OWN
    assert "crs" not in walk().attrs
    assert crs_stated(walk()) == ""
    # Of a way of one part its bounds decide.
    rows = placed_in(OWN, walk().iloc[:2])
    low, high = rows.min(), rows.max()
    for name in ("east_m", "north_m"):
        for edge, sign in ((low, -1), (high, 1)):
            for by_m in (0.0, 1e-6):
                moved = rows.assign(**{name: edge[name] + sign * by_m})
                assert crs_stated(moved) == ("" if by_m else OWN)
        assert crs_stated(rows.assign(**{name: "x"})) == ""
        assert crs_stated(rows.drop(columns=name)) == ""
    for name in ("crs", "bounds_m"):
        bare = rows.copy()
        del bare.attrs[name]
        assert crs_stated(bare) == ""


def told(lat_deg, beyond, crs=OWN, **more):
    faults = Faults()
    lat_deg = np.array(lat_deg)
    note = without_beyond(
        "a.csv", crs, np.full(len(lat_deg), LON), lat_deg, np.array(beyond, bool), faults, **more
    )
    return note, [(fault.expected, fault.got) for fault in faults.found]


def test_which_positions_are_told_to_be_beyond():
    assert told([60.0, 60.1], [0, 0]) == ("", [])
    note, faults = told([60.0, -60.1, -60.2], [0, 1, 1])
    assert note == (
        f"a.csv: 2 positions left out: {OWN} has no such places; first -60.1, 24.94 (position 2)"
    )
    assert faults == []
    note, _ = told([60.0, -60.1, -60.2], [0, 1, 1], row_numbers=np.array([7, 8, 9]))
    assert note.endswith("first -60.1, 24.94 (row 8)")
    expected = f"positions that {OWN} covers"
    assert told([-60.1], [1]) == ("", [(expected, "-60.1, 24.94 (position 1)")])
    note, faults = told([-60.1, -60.2, -60.3], [1, 1, 1])
    assert (note, faults) == ("", [(expected, "-60.1, 24.94 (position 1) and 2 more")])


def test_metres_of_the_world_are_told_by_the_middle_of_the_places():
    """At 60 degrees north 100 m of Web Mercator are 50 m; a single place may be wrong."""
    world = "EPSG:3857"
    note, ((expected, got),) = told([60.0, 0.0, 60.0, 85.0, 60.1], [0, 0, 0, 0, 0], crs=world)
    assert expected == "positions at which metres of EPSG:3857 are metres on the ground"
    assert got == "60, 24.94, where 100 m are 50 m"
    assert note == ""
    assert told([60.0, 0.0, 0.01, 0.0, 60.1], [0] * 5, crs=world) == ("", [])
    # Of the places within, of an even number the later one.
    assert told([0.0, 0.0, 60.0, 60.0], [0] * 4, crs=world)[1] != []
    assert told([0.0, 0.0, 0.0, 60.0, 60.0, 60.0], [0, 0, 0, 0, 1, 1], crs=world)[1] == []
    for lat_deg, count in ((60.0, 1), (0.0, 0)):
        faults = Faults()
        east_m, north_m = project(world, np.full(3, LON), [lat_deg, lat_deg, 80.0])
        check_metres("truth", world, east_m, north_m, faults)
        assert len(faults.found) == count
        assert not count or "give lat_deg and lon_deg" in faults.found[0].hint
    check_metres("truth", world, np.zeros(0), np.zeros(0), faults := Faults())
    assert not faults.found


def recording(crs="", **tables):
    return Recording(Path("drive.csv"), "csv", "", Clock("utc"), tables, 3, (), (), crs)


def test_recordings_lose_positions_that_a_crs_does_not_cover():
    degrees = pd.DataFrame({"time_s": [0.0, 1.0, 2.0], "lat_deg": LAT})
    degrees["lon_deg"] = [LON, LON, 100.0]
    metres = strayed(3)
    finland = "EPSG:3067"
    for given, local, is_checked in (
        (recording(positions=degrees), "", True),
        (recording(true_places=metres), OWN, True),
        (recording(OWN, places=metres), finland, True),
        (recording(places=metres), finland, False),
        (recording(places=metres), "", False),
        (recording(radio=metres), OWN, False),
    ):
        (found,), notes = within_crs([given], finland, local)
        (rows,) = found.tables.values()
        assert rows["time_s"].tolist() == ([0.0, 1.0] if is_checked else [0.0, 1.0, 2.0])
        assert rows.index.tolist() == list(range(len(rows)))
        assert [note.partition(":")[0] for note in notes] == ["drive.csv"] * is_checked
    with pytest.raises(InputError, match=r"drive\.csv: expected positions that EPSG:3067 covers"):
        within_crs([recording(truth=degrees.iloc[[2]])], finland, "")
