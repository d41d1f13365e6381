"""Starts and positions of another area are refused, with the mistake that explains them."""

import asyncio

import pytest
from asking import SERVING, ask, service
from positioning.cross_world import CROSSING, CRS, LATTICE

from mapfilter.geodesy import unproject

LON_DEG, LAT_DEG = (float(axis) for axis in unproject(CRS, *CROSSING))
EAST_M, NORTH_M = CROSSING
ELSEWHERE = "a position of another area or zone"


def fix(east_m, north_m):
    return {"east_m": east_m, "north_m": north_m, "var_east_m2": 9.0, "var_north_m2": 9.0}


def answers_of(positioner, cross, start, *requests):
    """The answers to the beginning of a session, and to one request of one epoch after another."""
    with service(positioner, cross.plan) as made:

        async def run():
            app = made.app()
            found = [await ask(app, "POST", "/sessions", {"start": start} if start else {})]
            assert len(made.sessions.all) == (found[0].code == 201)
            for time_s, rows in enumerate(requests):
                path = f"/sessions/{found[0].json['id']}/epochs"
                body = {"epochs": [{"time_s": float(time_s), **rows}]}
                found.append(await ask(app, "POST", path, body))
            return found

        return asyncio.run(run())


@pytest.mark.parametrize(
    ("lat_deg", "lon_deg", "cause"),
    [
        (LON_DEG, LAT_DEG, "latitude and longitude swapped"),
        (LAT_DEG, -LON_DEG, "a lost sign of longitude"),
        (LAT_DEG + 3000 / 111_000, LON_DEG, ELSEWHERE),
    ],
)
def test_a_start_of_another_area_is_refused(positioner, cross, lat_deg, lon_deg, cause):
    start = {"lat_deg": lat_deg, "lon_deg": lon_deg, "sd_m": 10.0}
    (answer,) = answers_of(positioner, cross, start)
    assert (answer.code, answer.reason) == (400, "invalid")
    (fault,) = answer.json["error"]["errors"]
    assert fault["location"] == "start"
    assert "km outside" in fault["message"]
    assert fault["message"].endswith(f"(likely: {cause})")


@pytest.mark.parametrize(("north_m", "sd_m"), [(400.0, 10.0), (3000.0, 700.0)])
def test_a_start_may_lie_outside_by_its_deviation(positioner, cross, north_m, sd_m):
    lon_deg, lat_deg = unproject(CRS, EAST_M, LATTICE.bounds_m[3] + north_m)
    start = {"lat_deg": float(lat_deg), "lon_deg": float(lon_deg), "sd_m": sd_m}
    assert answers_of(positioner, cross, start)[0].code == 201


@pytest.mark.parametrize(
    ("place", "cause"),
    [
        ((LON_DEG, LAT_DEG), "degrees given for metres"),
        ((NORTH_M, EAST_M), "east and north swapped"),
        ((EAST_M, NORTH_M + 20_000), ELSEWHERE),
    ],
)
def test_positions_of_another_area_are_refused_as_those_of_a_log(positioner, cross, place, cause):
    _, answer = answers_of(positioner, cross, None, {"gnss": [fix(*place)]})
    assert (answer.code, answer.reason) == (400, "invalid")
    (fault,) = answer.json["error"]["errors"]
    assert fault["location"] == "epochs[0].gnss"
    assert "expected positions near the database's 531000..531400 m east" in fault["message"]
    assert fault["message"].endswith(f"(likely: {cause})")


def test_degrees_are_refused_after_reports_too_but_not_a_spoofer(positioner, cross):
    heard = {"radio": [SERVING]}
    answers = answers_of(
        positioner,
        cross,
        None,
        heard,
        {**heard, "gnss": [fix(LON_DEG, LAT_DEG)]},
        {**heard, "gnss": [fix(LON_DEG, LAT_DEG + 1)]},
        {**heard, "gnss": [fix(EAST_M, NORTH_M + 20_000)]},
    )
    assert [one.code for one in answers] == [201, 200, 400, 400, 200]


def test_a_device_may_leave_the_area(positioner, cross):
    near, far = {"gnss": [fix(EAST_M, NORTH_M)]}, {"gnss": [fix(EAST_M, NORTH_M + 20_000)]}
    assert [one.code for one in answers_of(positioner, cross, None, near, far)] == [201, 200, 200]
