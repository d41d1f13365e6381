"""Starts and positions of another area are refused, with the mistake that explains them."""

import asyncio

import pytest
from asking import SERVING, ask, service
from positioning.cross_world import CROSSING, CRS, LATTICE

from mapfilter.geodesy import project, unproject
from mapfilter.lattice import Lattice
from mapfilter.positioning.bayes.state import BayesState
from mapfilter.positioning.epochs import Epoch, GnssFix, ReportRow
from mapfilter.serving.places import check_fixes

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


@pytest.mark.parametrize("north_m", [6_000.0, 45_000.0, 900_000.0])
def test_a_device_whose_receiver_is_misled_is_located_by_its_cells(positioner, cross, north_m):
    misled = [
        {
            "motion": [{"step_m": 10.0, "heading_rad": 0.0}],
            "radio": [SERVING],
            "gnss": [fix(EAST_M + 10.0 * number, NORTH_M + north_m)],
        }
        for number in range(12)
    ]
    _, *answers = answers_of(positioner, cross, None, *misled)
    assert [one.code for one in answers] == [200] * 12
    found = [one.json["fixes"][0] for one in answers]
    # A place that is far from all hypotheses alike favours none of them.
    assert all(abs(one["north_m"] - NORTH_M) < 300 for one in found)
    assert found[-1]["radius_95_m"] < found[0]["radius_95_m"]


def test_a_mistake_is_refused_beside_cells_too(positioner, cross):
    for place in ((NORTH_M, EAST_M), (LON_DEG, LAT_DEG), (LON_DEG * 1e7, LAT_DEG * 1e7)):
        swapped = {"radio": [SERVING], "gnss": [fix(*place)]}
        assert [one.code for one in answers_of(positioner, cross, None, swapped)] == [201, 400]


def test_once_there_is_a_belief_only_degrees_for_metres_are_refused(positioner, cross):
    heard = {"radio": [SERVING]}
    answers = answers_of(
        positioner,
        cross,
        None,
        heard,
        {**heard, "gnss": [fix(LON_DEG, LAT_DEG)]},
        {**heard, "gnss": [fix(LON_DEG, LAT_DEG + 1)]},
        {**heard, "gnss": [fix(LON_DEG * 1e7, LAT_DEG * 1e7)]},
        {**heard, "gnss": [fix(EAST_M, NORTH_M + 20_000)]},
        {"gnss": [fix(EAST_M, NORTH_M + 20_000)]},
        {**heard, "gnss": [fix(NORTH_M, EAST_M)]},
    )
    assert [one.code for one in answers] == [201, 200, 400, 400, 400, 200, 200, 200]


@pytest.mark.parametrize("lon_deg", [-0.04, -0.06, -0.08, -0.1])
@pytest.mark.parametrize("believed", [False, True])
def test_true_positions_beside_the_meridian_of_greenwich_count(lon_deg, believed):
    crs = "EPSG:32631"
    west_m, north_m = (float(axis[0]) for axis in project(crs, [0.02], [51.5]))
    lattice = Lattice(crs, west_m, north_m, 5.0, 400, 400)
    east_m, north_m = (float(axis[0]) for axis in project(crs, [lon_deg], [51.49]))
    row = ReportRow("serving", "W", None, None, -70.0, 0)
    radio = () if believed else (row,)
    epoch = Epoch(0.0, radio=radio, gnss=GnssFix(east_m, north_m))
    # Only whether there is a belief counts.
    before = BayesState(belief=object() if believed else None)
    check_fixes([epoch], before, lattice)


def test_a_device_may_leave_the_area(positioner, cross):
    near, far = {"gnss": [fix(EAST_M, NORTH_M)]}, {"gnss": [fix(EAST_M, NORTH_M + 20_000)]}
    assert [one.code for one in answers_of(positioner, cross, None, near, far)] == [201, 200, 200]


def test_an_answer_names_positions_that_are_none(positioner, cross):
    """Also degrees of 0, which otherwise would be those of another area."""
    nowhere = {"lat_deg": 0.0, "lon_deg": 0.0, "accuracy_m": 0.0}
    _, answer, again = answers_of(
        positioner, cross, None, {"gnss": [nowhere]}, {"radio": [SERVING]}
    )
    assert (answer.code, again.code) == (200, 200)
    assert answer.json["notes"] == [
        "gnss: 1 row without a position left out (latitude and longitude both empty, or both 0: "
        "no fix; first epochs[0].gnss[0])"
    ]
    assert answer.json["fixes"][0]["unused"] == []
    assert again.json["notes"] == []
