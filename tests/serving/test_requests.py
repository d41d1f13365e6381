"""What comes over the network is checked at the door, and all that is wrong is said at once."""

import asyncio
import gzip
import json
from dataclasses import replace
from math import nan

import numpy as np
import pandas as pd
import pytest
from asked_service import answer_of
from asking import SERVING, ask, documents, service
from positioning.cross_world import CRS

from mapfilter.geodesy import unproject
from mapfilter.positioning.fingerprints.locating import locate_by
from mapfilter.positioning.fingerprints.log_reports import reports_of_log
from mapfilter.positioning.merging import epochs
from mapfilter.radio.cells import Cell, CellPlan
from mapfilter.radio.plan_names import PlanNames
from mapfilter.serving.documents import RequestError
from mapfilter.serving.epoch_rows import read_epochs
from mapfilter.serving.geolocate import geolocator
from mapfilter.serving.places import placeless_note
from mapfilter.tracks.joining.identify import name_by_plan
from mapfilter.tracks.log import make_log


@pytest.fixture(scope="module")
def made(positioner, cross, locate):
    with service(positioner, cross.plan, locate=locate, body_bytes=20_000, receive_s=0.2) as one:
        yield one


def epoch(**fields):
    return {"epochs": [{"time_s": 1.0, **fields}]}


HOSTILE = {
    "cut off": b'{"epochs": [',
    "no JSON": b"epochs",
    "not UTF-8": b'{"epochs": "\xff"}',
    "NaN": b'{"epochs": [{"time_s": NaN}]}',
    "infinity": b'{"epochs": [{"time_s": -Infinity}]}',
    "deep": b'{"a":' * 3000 + b"1" + b"}" * 3000,
    "deep list": b"[" * 15_000,
    "digits": b'{"a":' + b"9" * 10_000 + b"}",
    "surrogate": b'{"epochs": "\\ud800"}',
    "surrogate key": b'{"\\udc00": 1}',
    "key twice": b'{"epochs": [], "epochs": []}',
    "list": b"[]",
    "number": b"1",
    "compressed": gzip.compress(b'{"epochs": []}'),
}


@pytest.mark.parametrize("body", HOSTILE.values(), ids=HOSTILE.keys())
@pytest.mark.parametrize("path", ["/sessions", "/v1/geolocate"])
def test_what_is_no_strict_json_is_refused(made, body, path):
    answer = answer_of(made, "POST", path, body)
    assert (answer.code, answer.reason) == (400, "parseError")
    assert answer.json["error"]["code"] == 400
    assert len(answer.body) < 1000
    assert not made.sessions.all


WRONG = {
    "epochs": {"epochs": 1},
    "no epoch": {"epochs": []},
    "nothing": {},
    "too many": {"epochs": [{"time_s": i} for i in range(301)]},
    "an epoch that is none": {"epochs": [1]},
    "an unknown key": {"epoch": []},
    "no time": {"epochs": [{}]},
    "a time as text": {"epochs": [{"time_s": "1"}]},
    "a time that overflows": {"epochs": [{"time_s": 10**400}]},
    "true": {"epochs": [{"time_s": True}]},
    "order": {"epochs": [{"time_s": 2}, {"time_s": 1}]},
    "equal times": {"epochs": [{"time_s": 1}, {"time_s": 1}]},
    "a table": epoch(motoin=[]),
    "truth": epoch(truth=[{"east_m": 1, "north_m": 1}]),
    "rows": epoch(radio={"role": "serving"}),
    "degrees": epoch(motion=[{"step_m": 1, "heading_rad": 90}]),
    "missing sign": epoch(motion=[{"step_m": -9999}]),
    "deviation below 0": epoch(motion=[{"step_m": 1, "sampling_sd_m": -1}]),
    "column": epoch(motion=[{"step": 1}]),
    "role": epoch(radio=[{**SERVING, "role": "best"}]),
    "no role": epoch(radio=[{"cell": "W"}]),
    "level": epoch(radio=[{**SERVING, "level_dbm": 40}]),
    "cell": epoch(radio=[{**SERVING, "cell": 7}]),
    "long cell": epoch(radio=[{**SERVING, "cell": "x" * 129}]),
    "escape": epoch(radio=[{**SERVING, "cell": "\x1b[2J"}]),
    "fraction": epoch(radio=[{**SERVING, "arfcn": 1.5}]),
    "carrier": epoch(radio=[{**SERVING, "technology": "GSM", "arfcn": 5000}]),
    "covariance": epoch(
        gnss=[{"east_m": 0, "north_m": 0, "var_east_m2": 1, "var_north_m2": 1,
               "cov_east_north_m2": 2}]
    ),
    "satellite": epoch(pseudoranges=[{"satellite": "G01", "x_m": 1.0, "y_m": 2.0, "z_m": 3.0}]),
}  # fmt: skip


@pytest.mark.parametrize("body", WRONG.values(), ids=WRONG.keys())
def test_epochs_with_a_fault_are_refused_with_its_place(cross, body):
    with pytest.raises(RequestError) as caught:
        read_epochs(body, PlanNames(cross.plan), nan)
    error = caught.value
    assert error.code == 400
    assert error.faults
    assert all(fault.where and fault.expected for fault in error.faults)


@pytest.mark.parametrize(
    ("body", "found"),
    [
        ({"epochs": [{"time_s": True}]}, "true"),
        ({"epochs": [{}]}, "null"),
        ({"epochs": [{"time_s": [None, False]}]}, "[null, false]"),
        (epoch(motion=[{"step_m": True}]), "true"),
        (epoch(radio=[{**SERVING, "arfcn": False}]), "false"),
        (epoch(radio=[{**SERVING, "cell": {"id": None}}]), '{"id": null}'),
        (epoch(radio=[{**SERVING, "technology": True}]), "true"),
    ],
)
def test_what_was_found_is_told_in_the_words_of_json(cross, body, found):
    with pytest.raises(RequestError) as caught:
        read_epochs(body, PlanNames(cross.plan), nan)
    (fault,) = caught.value.faults
    assert fault.got == found


def test_faults_of_a_report_are_told_in_the_words_of_json(made):
    body = {"cellTowers": [{"cellId": None}], "radioType": True}
    answer = answer_of(made, "POST", "/v1/geolocate", body)
    told = [one["message"] for one in answer.json["error"]["errors"]]
    assert told == [
        "radioType: expected gsm, wcdma, lte or nr, found true",
        "cellTowers[0].cellId: expected a whole number in 0..68719476735, found null",
    ]


@pytest.mark.parametrize(
    ("body", "mistake"),
    [
        ({"epochs": [{"time_s": 1.7e12}]}, "milliseconds for s"),
        (epoch(motion=[{"step_m": 1, "heading_rad": 90}]), "degrees given for radians"),
        (epoch(radio=[{**SERVING, "level_dbm": 40}]), "raw RXLEV given for dBm"),
        (epoch(radio=[{**SERVING, "level_dbm": 3.82}]), "a strong level plus an offset"),
        (epoch(radio=[{**SERVING, "level_dbm": 70}]), "a lost sign"),
        (epoch(radio=[{**SERVING, "level_dbm": 10**400}]), "level_dbm: expected dBm"),
        (epoch(radio=[{**SERVING, "timing_advance": 5000}]), "metres for steps"),
    ],
)
def test_values_beyond_their_range_name_the_likely_mistake(cross, body, mistake):
    """As the same values of a log do."""
    with pytest.raises(RequestError, match=mistake):
        read_epochs(body, PlanNames(cross.plan), nan)


@pytest.mark.parametrize(
    "name", ["mcc", "mnc", "lac", "ci", "arfcn", "bsic", "timing_advance", "level_dbm"]
)
@pytest.mark.parametrize("mark", [2**31 - 1, 2**63 - 1, float(2**31 - 1)])
def test_marks_of_android_for_unknown_values_are_named(cross, name, mark):
    """An unknown identity was that of a cell which the database lacks."""
    with pytest.raises(RequestError) as caught:
        read_epochs(epoch(radio=[{**SERVING, name: mark}]), PlanNames(cross.plan), nan)
    (fault,) = caught.value.faults
    assert fault.where.endswith(f".{name}")
    assert fault.hint == "Android's mark for an unknown value; leave the field out"


def test_marks_of_android_in_single_reports_are_named(made):
    tower = {"mobileCountryCode": 1, "mobileNetworkCode": 1, "cellId": 7}
    report = {"cellTowers": [{**tower, "timingAdvance": 2**31 - 1, "signalStrength": 2**31 - 1}]}
    answer = answer_of(made, "POST", "/v1/geolocate", report)
    assert answer.json["error"]["message"].count("Android's mark for an unknown value") == 2


@pytest.mark.parametrize(
    ("row", "hint"),
    [
        ({"lat": 52.0, "lon": 13.0, "accuracy": 12}, "lat_deg"),
        ({"latitude": 52.0, "longitude": 13.0}, "lat_deg"),
        ({"lat": 52.0, "lng": 13.0}, "lat_deg"),
    ],
)
def test_positions_by_other_names_are_asked_for_in_degrees(cross, row, hint):
    """Only metres and their variances were asked for."""
    with pytest.raises(RequestError) as caught:
        read_epochs(epoch(gnss=[row]), PlanNames(cross.plan), nan)
    first, *others = caught.value.faults
    assert first.hint == hint
    assert first.expected.startswith("keys of lat_deg, lon_deg, accuracy_m, or east_m, north_m")
    assert len(others) == len(row) - 1


@pytest.mark.parametrize(
    "whole", [{"arfcn": 10, "bsic": 0}, {"timing_advance": 3}, {"censored": -1}], ids=str
)
def test_whole_numbers_may_have_a_point(cross, whole):
    """As columns of a data frame are written that has rows without them; a log takes them, too."""
    names = PlanNames(cross.plan)
    pointed = {name: float(value) for name, value in whole.items()}
    found = [
        read_epochs(json.loads(json.dumps(epoch(radio=[{**SERVING, **one}]))), names, nan)
        for one in (whole, pointed)
    ]
    assert found[0] == found[1]
    motion = pd.DataFrame({"time_s": [0.0, 1.0], "step_m": [1.4, 1.4]})
    log = make_log(CRS, motion=motion, radio=pd.DataFrame([{"time_s": 1.0, **SERVING, **pointed}]))
    assert log.radio.iloc[0][[*whole]].to_dict() == whole


def test_positions_may_be_as_phones_give_them(cross):
    row = {"lat_deg": 41.15, "lon_deg": -8.62, "accuracy_m": 7.575}
    fix = read_epochs(epoch(gnss=[row]), PlanNames(cross.plan), nan)[0].gnss
    lon_deg, lat_deg = unproject(CRS, fix.east_m, fix.north_m)
    assert (lat_deg, lon_deg) == pytest.approx((41.15, -8.62), abs=1e-9)
    # 68 % of a circular normal distribution lie within 1.515 deviations.
    assert (fix.var_east_m2, fix.var_north_m2) == pytest.approx((25.0, 25.0), rel=1e-3)
    assert fix.cov_east_north_m2 == 0
    bare = read_epochs(epoch(gnss=[{**row, "accuracy_m": None}]), PlanNames(cross.plan), nan)
    assert np.isnan(bare[0].gnss.var_east_m2)
    assert bare[0].gnss.east_m == fix.east_m


@pytest.mark.parametrize(
    ("changes", "where"),
    [
        ({"lat_deg": 91}, "epochs[0].gnss[0].lat_deg"),
        ({"lon_deg": None}, "epochs[0].gnss[0].lon_deg"),
        ({"accuracy_m": -1}, "epochs[0].gnss[0].accuracy_m"),
        ({"east_m": 1.0}, "epochs[0].gnss[0]"),
    ],
)
def test_faults_of_such_positions_are_named(cross, changes, where):
    body = epoch(gnss=[{"lat_deg": 41.15, "lon_deg": -8.62, "accuracy_m": 7.0, **changes}])
    with pytest.raises(RequestError) as caught:
        read_epochs(body, PlanNames(cross.plan), nan)
    assert [fault.where for fault in caught.value.faults] == [where]


def test_neighbours_without_a_carrier_have_that_of_the_serving_cell(cross):
    """As in a log."""
    cell = replace(cross.plan.cells[0], technology="LTE", arfcn=6300, bsic=7)
    names = PlanNames(CellPlan(cross.plan.crs, (cell,)))
    rows = [
        {"role": "serving", "cell": cell.id, "level_dbm": -80},
        {"role": "neighbour", "bsic": 8, "level_dbm": -90},
    ]
    radio = read_epochs(epoch(radio=rows), names, nan)[0].radio
    assert {row.role: row.arfcn for row in radio} == {"serving": None, "neighbour": 6300}


def test_all_faults_of_a_request_are_named_together(cross):
    body = epoch(
        motion=[{"step_m": "1"}], radio=[{"role": "x"}, SERVING, {"role": "neighbour", "cell": ""}]
    )
    with pytest.raises(RequestError) as caught:
        read_epochs(body, PlanNames(cross.plan), nan)
    assert [fault.where for fault in caught.value.faults] == [
        "epochs[0].motion[0].step_m",
        "epochs[0].radio[0].role",
        "epochs[0].radio[2].cell",
    ]
    assert [one["location"] for one in caught.value.document["error"]["errors"]] == [
        fault.where for fault in caught.value.faults
    ]


def test_epochs_are_those_of_a_log_with_the_same_rows():
    cells = [("a", 262, 1, 5, 77), ("b", None, None, None, None)]
    plan = CellPlan(
        CRS,
        tuple(
            Cell(name, name, 531_000.0, 4_556_000.0, 30.0, None, 50.0, 1800.0, "omni",
                 mcc=mcc, mnc=mnc, lac=lac, ci=ci, arfcn=7, bsic=index)
            for index, (name, mcc, mnc, lac, ci) in enumerate(cells)
        ),
    )  # fmt: skip
    tables = {
        "motion": [{"step_m": 1.5, "heading_rad": 6.0, "sampling_sd_m": 2.5}, {"turn_rad": 0.1}],
        "radio": [
            {"role": "serving", "mcc": 262, "mnc": 1, "lac": 5, "ci": 77, "timing_advance": 2},
            {"role": "neighbour", "cell": "b", "level_dbm": -80.5, "censored": -1},
            {"role": "neighbour", "cell": "b", "level_dbm": -80.5, "censored": -1},
            {"role": "neighbour", "arfcn": 7, "bsic": 1},
            {"role": "neighbour", "cell": "262-1-5-77", "technology": "GSM"},
            # Neighbours that are known by their level alone are two where they are equal.
            {"role": "neighbour", "arfcn": 7, "level_dbm": -90.0},
            {"role": "neighbour", "arfcn": 7, "level_dbm": -90.0},
        ],
        "gnss": [{"east_m": 531_000.0, "north_m": 4_556_000.0, "var_east_m2": 4.0}],
        "pseudoranges": [
            {"satellite": "G01", "pseudorange_m": 2e7, "x_m": 2e7, "y_m": 1e7, "z_m": 0.0}
        ],
        "tdoa": [{"cell": "a", "reference": "b", "difference_m": 5.0}],
    }
    frames = {name: pd.DataFrame(rows).assign(time_s=3.0) for name, rows in tables.items()}
    expected = epochs(name_by_plan(make_log(CRS, **frames), plan))
    found = read_epochs({"epochs": [{"time_s": 3, **tables}]}, PlanNames(plan), nan)
    assert repr(found) == repr(expected)
    assert [step.sampling_sd_m for step in found[0].motion] == [2.5, 0.0]


@pytest.mark.parametrize(
    ("method", "path", "code"),
    [("GET", "/nothing", 404), ("PUT", "/sessions", 405),
     ("GET", "/sessions/../../etc/passwd", 404), ("GET", "/sessions/%2e%2e", 404),
     ("DELETE", "/sessions/\x00", 404)],
)  # fmt: skip
def test_other_paths_lead_nowhere(made, method, path, code):
    answer = answer_of(made, method, path)
    assert answer.code == code
    assert answer.json["error"]["code"] == code
    assert (f"method for this path, found {method}" in str(answer.json)) == (code == 405)


def test_a_report_is_located_as_locate_does_it(made, fitted, cross):
    body = {"cellTowers": [{"cellId": 1}]}
    unknown = answer_of(made, "POST", "/v1/geolocate", body)
    assert (unknown.code, unknown.reason) == (404, "notFound")
    cells = [replace_identity(cell, 100 + index) for index, cell in enumerate(cross.plan.cells)]
    named = geolocator(fitted, CellPlan(CRS, tuple(cells)))
    tower = {"mobileCountryCode": 262, "mobileNetworkCode": 1, "locationAreaCode": 9}
    towers = [
        {**tower, "cellId": 100 + index, "signalStrength": -60 - 9 * index} for index in (1, 0)
    ]
    found = named.answer({"cellTowers": towers, "radioType": "gsm", "considerIp": False})
    ids = [cells[1].id, cells[0].id]
    radio = pd.DataFrame(
        {"time_s": 0.0, "role": ["serving", "neighbour"], "cell": ids, "level_dbm": [-69.0, -60.0]}
    )
    expected = locate_by(fitted, reports_of_log(make_log(CRS, radio=radio)))
    table = expected.to_dataframe().iloc[0]
    assert found["accuracy"] == table["radius_95_m"] > 0
    assert found["location"] == {
        "lat": pytest.approx(table["lat_deg"], abs=1e-9),
        "lng": pytest.approx(table["lon_deg"], abs=1e-9),
    }


def replace_identity(cell, ci):
    values = {name: getattr(cell, name) for name in cell.__dataclass_fields__}
    return Cell(**{**values, "mcc": 262, "mnc": 1, "lac": 9, "ci": ci})


def test_access_points_are_cells_by_their_addresses(fitted, cross):
    ids = ("01:23:45:67:89:AB", *fitted.database.cell_ids[1:])
    database = replace(fitted.database, cell_ids=ids)
    made = geolocator(replace(fitted, database=database), cross.plan)
    point = {"macAddress": "01-23-45-67-89-ab", "signalStrength": -60}
    assert made.answer({"wifiAccessPoints": [point]})["accuracy"] > 0


def test_faults_of_a_report_are_named_together(made):
    body = {
        "cellTowers": [{"cellId": -1, "signalStrength": 5}, {"mobileCountryCode": 1000}],
        "wifiAccessPoints": [{"macAddress": "x"}],
        "radioType": "7g",
    }
    answer = answer_of(made, "POST", "/v1/geolocate", body)
    assert answer.code == 400
    places = {one["location"] for one in answer.json["error"]["errors"]}
    assert places == {
        "radioType",
        "cellTowers[0].cellId",
        "cellTowers[0].signalStrength",
        "cellTowers[1].mobileCountryCode",
        "cellTowers[1].cellId",
        "wifiAccessPoints[0].macAddress",
    }
    assert answer_of(made, "POST", "/v1/geolocate", {}).code == 400


def test_a_fault_of_the_service_shows_nothing_of_it(positioner, cross, capsys):
    class Broken:
        def answer(self, _):
            raise RuntimeError("inner words")

    with service(positioner, cross.plan, locate=Broken()) as made:
        answer = answer_of(made, "POST", "/v1/geolocate", {"cellTowers": []})
    assert (answer.code, answer.reason) == (500, "backendError")
    assert b"inner words" not in answer.body
    assert "inner words" in capsys.readouterr().err


def test_what_is_sent_is_strict_json(made):
    sent = documents(3)[0]

    async def run():
        app = made.app()
        session = (await ask(app, "POST", "/sessions", {"name": "ä"})).json["id"]
        answer = await ask(app, "POST", f"/sessions/{session}/epochs", {"epochs": sent})
        await ask(app, "DELETE", f"/sessions/{session}")
        return answer

    def refuse(name):
        raise ValueError(name)

    json.loads(asyncio.run(run()).body, parse_constant=refuse)
    assert np.isfinite(sent[0]["time_s"])


@pytest.mark.parametrize(
    "row",
    [
        {"lat_deg": 0, "lon_deg": 0.0, "accuracy_m": 0},
        {"lat_deg": None, "lon_deg": None, "accuracy_m": -1},
        {"lat_deg": "NaN", "lon_deg": ""},
    ],
    ids=str,
)
def test_a_position_that_is_none_counts_as_none(cross, row):
    """As such a row of a log does."""
    names = PlanNames(cross.plan)
    body = epoch(gnss=[row], motion=[{"step_m": 1.0}])
    (bare,), (found,) = (
        read_epochs(one, names, nan) for one in (epoch(motion=[{"step_m": 1.0}]), body)
    )
    assert found == bare
    assert placeless_note(body) == (
        "gnss: 1 row without a position left out (latitude and longitude both empty, or both 0: "
        "no fix; first epochs[0].gnss[0])",
    )
    assert placeless_note(epoch(gnss=[{"lat_deg": 0.0, "lon_deg": 8.0}], radio=None)) == ()
    metres = epoch(gnss=[{"east_m": 0.0, "north_m": 0.0}])
    assert placeless_note(metres) == ()
    assert read_epochs(metres, names, nan)[0].gnss is not None


@pytest.mark.parametrize("row", [{"lat_deg": 0, "lon_deg": None}, {"lat_deg": 41.0}], ids=str)
def test_half_a_position_is_a_fault(cross, row):
    with pytest.raises(RequestError) as caught:
        read_epochs(epoch(gnss=[row]), PlanNames(cross.plan), nan)
    assert [fault.where for fault in caught.value.faults] == ["epochs[0].gnss[0].lon_deg"]
