"""The CRS of a log, by what its recordings state: which it is, and where its middle lies."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from pyproj import CRS

from mapfilter.errors import InputError
from mapfilter.geodesy import grid_convergence_rad, project, short_crs
from mapfilter.tracks.checks.placeless import in_frame, is_local_frame
from mapfilter.tracks.joining.frame import Frame
from mapfilter.tracks.log import make_log
from mapfilter.tracks.readers.recorded.recording import Clock, Recording

ZONE, FINLAND = "EPSG:32635", "EPSG:2393"
LAT, LON = 60.17, 24.94
ORIGIN = (61.5, 23.75)


def recording(name="a.csv", crs="", **tables):
    return Recording(Path(name), "csv", "", Clock("utc"), tables, 3, (), (), crs)


def degrees(lat=LAT, lon=LON):
    lon_deg = np.array([lon - 0.01, lon, lon + 0.02])
    return pd.DataFrame(
        {
            "time_s": [0.0, 1.0, 2.0],
            "lat_deg": [lat - 0.01, lat, lat + 0.02],
            "lon_deg": (lon_deg + 180) % 360 - 180,
        }
    )


def metres(crs=None, lat=LAT, lon=LON):
    """Places about a place of a CRS, or about the origin of a frame."""
    east_m, north_m = project(crs, lon, lat) if crs else (0.0, 0.0)
    return pd.DataFrame(
        {
            "time_s": [0.0, 1.0, 2.0],
            "east_m": east_m + np.array([-30.0, 0.0, 90.0]),
            "north_m": north_m + np.array([-30.0, 0.0, 90.0]),
        }
    )


def origin_of(crs):
    values = {one.name: one.value for one in CRS(crs).coordinate_operation.params}
    return values["Latitude of natural origin"], values["Longitude of natural origin"]


NOWHERE = "no positions: the CRS of the log is a local frame"
NO_EFFECT = "--origin has no effect: no positions in metres of a local frame"
OWN_METRES = (
    "a.csv: metres in a frame of its own, placed at latitude 0 and longitude 0; see --origin and "
    "--crs"
)


@pytest.mark.parametrize(
    ("tables", "stated", "given", "crs", "middle", "notes"),
    [
        # Degrees: the zone of their middle, unless another CRS is given.
        ({"positions": degrees()}, "", {}, ZONE, (LAT, LON), []),
        ({"truth": degrees(-33.0, 151.0)}, "", {}, "EPSG:32756", (-33.0, 151.0), []),
        ({"positions": degrees(10.0, 179.995)}, "", {}, "EPSG:32660", (10.0, 179.995), []),
        ({"positions": degrees()}, "", {"crs": FINLAND}, FINLAND, (LAT, LON), []),
        ({"positions": degrees()}, "", {"origin": ORIGIN}, ZONE, (LAT, LON), [NO_EFFECT]),
        # Metres of a CRS that the file states, which lie where they lie.
        ({"places": metres(FINLAND)}, FINLAND, {}, FINLAND, (LAT, LON), []),
        ({"places": metres(FINLAND)}, FINLAND, {"crs": ZONE}, ZONE, (LAT, LON), []),
        ({"true_places": metres(ZONE)}, ZONE, {"origin": ORIGIN}, ZONE, (LAT, LON), [NO_EFFECT]),
        # Metres of a frame of its own: at 0, 0, at the origin that is given, or of the CRS.
        ({"places": metres()}, "", {}, (0, 0), None, [OWN_METRES]),
        ({"places": metres()}, "", {"origin": ORIGIN}, ORIGIN, ORIGIN, []),
        ({"true_places": metres()}, "", {"origin": ORIGIN}, ORIGIN, ORIGIN, []),
        ({"places": metres()}, "", {"crs": ZONE, "origin": ORIGIN}, ZONE, ORIGIN, []),
        ({"places": metres(ZONE)}, "", {"crs": ZONE}, ZONE, (LAT, LON), []),
        # Nothing: headings may have a place.
        ({"radio": metres()}, "", {}, (0, 0), None, [NOWHERE]),
        ({"radio": metres()}, "", {"crs": ZONE}, ZONE, None, []),
        ({"radio": metres()}, "", {"crs": ZONE, "origin": ORIGIN}, ZONE, ORIGIN, []),
        ({"radio": metres()}, "", {"crs": ZONE, "about": (LAT, LON)}, ZONE, (LAT, LON), []),
        ({"radio": metres()}, "", {"about": (LAT, LON)}, (0, 0), None, [NOWHERE]),
        ({"radio": metres()}, "", {"origin": ORIGIN}, (0, 0), None, [NOWHERE, NO_EFFECT]),
    ],
)
def test_the_crs_of_a_log_and_where_it_lies(tables, stated, given, crs, middle, notes):
    frame = Frame(
        [recording(crs=stated, **tables)],
        given.get("crs", ""),
        given.get("origin"),
        given.get("about"),
    )
    if isinstance(crs, str):
        assert frame.crs == crs
    else:
        assert origin_of(frame.crs) == crs
    assert frame.notes == notes
    if middle is None:
        assert np.isnan([frame.lat_deg, frame.lon_deg]).all()
        assert frame.convergence_rad == 0.0
    else:
        assert (frame.lat_deg, frame.lon_deg) == pytest.approx(middle, abs=1e-6)
        expected = grid_convergence_rad(frame.crs, middle[1], middle[0])
        assert frame.convergence_rad == pytest.approx(expected, abs=1e-7)


def test_places_in_metres_come_into_the_crs_of_the_log():
    rows = metres(FINLAND)
    for crs, given in ((ZONE, FINLAND), (FINLAND, FINLAND)):
        frame = Frame([recording(crs=given, places=rows)], crs, None)
        east_m, north_m = frame.east_north(rows, given)
        assert (east_m[1], north_m[1]) == pytest.approx(np.ravel(project(crs, LON, LAT)), abs=1e-3)
    # Of a frame of its own by its origin; without one the numbers stay.
    own = metres()
    frame = Frame([recording(places=own)], ZONE, ORIGIN)
    at = np.array(frame.east_north(own, ""))[:, 1]
    assert at == pytest.approx(np.ravel(project(ZONE, *reversed(ORIGIN))), abs=1e-3)
    frame = Frame([recording(places=own)], ZONE, None)
    np.testing.assert_array_equal(frame.east_north(own, ""), own[["east_m", "north_m"]].T)
    east_m, north_m = frame.east_north(degrees(), "")
    assert (east_m[1], north_m[1]) == pytest.approx(np.ravel(project(ZONE, LON, LAT)), abs=1e-6)


def test_degrees_beside_metres_of_another_frame_need_its_origin():
    both = [recording("b.csv", positions=degrees()), recording("c.csv", places=metres())]
    with pytest.raises(InputError) as caught:
        Frame(both, "", None)
    (fault,) = caught.value.faults
    assert (fault.where, fault.hint) == ("c.csv", "give --origin LAT,LON of the frame")
    assert origin_of(Frame(both, "", ORIGIN).crs) == ORIGIN
    frame = Frame(both, ZONE, None)
    assert (frame.crs, frame.notes) == (ZONE, [])
    # The middle is that of the degrees.
    assert (frame.lat_deg, frame.lon_deg) == pytest.approx((LAT, LON))
    stated = [
        recording("b.csv", positions=degrees()),
        recording("c.csv", ZONE, places=metres(ZONE)),
    ]
    assert Frame(stated, "", None).crs == ZONE


def test_a_place_that_the_crs_has_not_is_no_middle():
    far = metres().assign(east_m=[2e7, 2e7, 2e7])
    frame = Frame([recording(places=far)], "EPSG:3067", None)
    assert np.isnan(frame.lat_deg)
    assert frame.convergence_rad == 0.0


LOCAL = "+proj=tmerc +lat_0=0 +lon_0=0 +k=1 +x_0=0 +y_0=0 +datum=WGS84 +units=m +type=crs"


@pytest.mark.parametrize(
    ("crs", "is_local"),
    [
        (LOCAL, True),
        (LOCAL.replace("lat_0=0", "lat_0=60"), False),
        (LOCAL.replace("lon_0=0", "lon_0=24"), False),
        (ZONE, False),
        ("EPSG:3857", False),
        ("+proj=utm +zone=35 +datum=WGS84 +type=crs", False),
    ],
)
def test_which_crs_is_a_local_frame(crs, is_local):
    assert is_local_frame(crs) is is_local


HEADED = pd.DataFrame({"time_s": [1.0, 2.0], "step_m": 1.0, "heading_rad": [0.0, 3.1]})


def test_a_log_of_a_local_frame_is_in_the_frame_of_an_area_if_it_has_no_positions():
    local = make_log(LOCAL, motion=HEADED)
    found = in_frame(local, ZONE)
    assert found.motion["heading_rad"].tolist() == pytest.approx([0.0, 3.1])
    assert found.notes == (*local.notes, f"no positions in the log: taken to be in {ZONE}")
    found = in_frame(local, ZONE, (LAT, 20.0))
    turned_rad = grid_convergence_rad(ZONE, 20.0, LAT)
    assert turned_rad < -0.1
    # Clockwise from true north to grid north is what headings from grid east are greater by.
    assert found.motion["heading_rad"].tolist() == pytest.approx([turned_rad, 3.1 + turned_rad])
    assert found.notes[-1].endswith(
        f", headings by its grid convergence there, {np.degrees(-turned_rad):.1f} degrees"
    )
    turns = make_log(LOCAL, motion=HEADED.drop(columns="heading_rad").assign(turn_rad=0.0))
    assert "headings" not in in_frame(turns, ZONE, (LAT, 20.0)).notes[-1]
    for table in ("truth", "gnss"):
        placed = make_log(LOCAL, motion=HEADED, **{table: metres()})
        assert in_frame(placed, ZONE) is placed
    assert in_frame(local, local.crs) is local


def test_a_log_of_the_same_metres_keeps_its_numbers():
    log = make_log("EPSG:25835", motion=HEADED, truth=metres("EPSG:25835"))
    found = in_frame(log, ZONE)
    assert (found.crs, found.notes) == (ZONE, log.notes)
    assert found.truth["east_m"].tolist() == log.truth["east_m"].tolist()
    other = in_frame(log, FINLAND)
    assert short_crs(other.crs) == FINLAND
    assert other.notes[-1].startswith(f"projected from EPSG:25835 to {FINLAND}")
