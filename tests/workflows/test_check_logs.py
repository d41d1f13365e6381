"""``check`` looks at the log or recordings that a configuration names, and at a survey's times."""

import math
import re

import numpy as np
import pandas as pd
import pytest
from command_line import ONE, change, mapfilter, settings
from made_recordings import MADE

from mapfilter.geodesy import unproject
from mapfilter.tracks.store import read_log


@pytest.fixture
def check(world):
    def found(path, *more):
        args = (*settings(track__path=f'"{path}"'), *more, "--json")
        done = mapfilter("check", "-c", world.toml, *args)
        findings = {f["code"]: f for f in done.json["findings"]}
        assert done.code == (2 if any(f["severity"] == "error" for f in findings.values()) else 0)
        return findings

    return found


def test_good_logs_have_no_findings(check, world, log):
    assert check(world.journeys) == {}
    assert check(log) == {}


def test_cells_that_the_plan_lacks(check, log):
    change(log / "radio.csv", cell=lambda c: c.where(c != "A", "X"))
    found = check(log)["log-cells-unknown"]
    assert found["severity"] == "warning"
    assert "1 serving cell that the plan lacks: X." in found["evidence"]
    change(log / "radio.csv", cell=lambda c: c.where(c.isna(), "X"))
    assert check(log)["log-cells-unknown"]["severity"] == "error"
    change(log / "radio.csv", cell=lambda c: c.where(c.isna()), arfcn=lambda n: n.where(n.isna()))
    assert "No serving cell is named" in check(log)["log-cells-unknown"]["evidence"]


def test_cells_of_a_second_sim_are_those_of_another_network(check, world, log, tmp_path):
    plan = pd.read_csv(world.plan)
    plan = plan.assign(mcc=244, mnc=91, lac=3021, ci=range(1, len(plan) + 1))
    plan.to_csv(tmp_path / "identified.csv", index=False)
    rows = pd.read_csv(log / "radio.csv")
    rows = rows[(rows["role"] == "serving") & rows["cell"].isin(plan["cell"])].iloc[:5]
    other = rows.iloc[:4].assign(cell="", mcc=244, mnc=5, lac=7, ci=[11, 11, 12, 13])
    pd.concat([rows, other]).to_csv(log / "radio.csv", index=False)
    identified = settings(cells__plan=f'"{tmp_path / "identified.csv"}"')
    evidence = check(log, *identified)["log-cells-unknown"]["evidence"]
    assert evidence == (
        "4 of 9 reports are of 3 serving cells that the plan lacks: 244-5-7-11, 244-5-7-12, "
        "244-5-7-13; 4 of them are of network 244-05, the plan holds 244-91."
    )


def test_headings_by_a_compass_are_a_finding(check, log):
    change(log / "motion.csv", heading_rad=lambda heading: math.pi / 2 - heading)
    found = check(log)
    assert set(found) == {"log-headings"}
    # By the truth, which judges filters, also with faults that are meant.
    assert found["log-headings"]["severity"] == "warning"
    assert found["log-headings"]["where"] == str(log)
    assert "headings run clockwise from north" in found["log-headings"]["evidence"]
    assert "pi/2 minus a" in found["log-headings"]["remedy"]


@pytest.fixture
def laps(tmp_path):
    """A log of a car that goes round a block of the world four times."""
    corner = np.arange(800) % 50 == 49
    turn = np.where(corner, np.pi / 2, 0.0)
    middle = np.cumsum(turn) - turn / 2
    motion = pd.DataFrame({"time_s": 0.4 * np.arange(800), "step_m": 2.0, "turn_rad": turn})
    motion["heading_rad"] = np.nan
    east, north = (np.cumsum(2.0 * way(middle)) for way in (np.cos, np.sin))
    place = {"east_m": 386_000.0 + east, "north_m": 6_671_900.0 + north}
    folder = tmp_path / "laps"
    folder.mkdir()
    motion.to_csv(folder / "motion.csv", index=False)
    places = pd.DataFrame({"time_s": motion["time_s"], **place})
    for name in ("truth", "gnss"):
        places.to_csv(folder / f"{name}.csv", index=False)
    (folder / "log.json").write_text('{"crs": "EPSG:32635"}')
    return folder


def test_turns_and_steps_that_contradict_positions_are_findings(check, laps):
    assert not {"log-turns", "log-steps", "log-speeds"} & set(check(laps))
    change(laps / "motion.csv", turn_rad=lambda turn: -turn)
    found = check(laps)
    assert "log-steps" not in found
    assert found["log-turns"]["severity"] == "error"
    assert found["log-turns"]["where"] == str(laps)
    assert "motion.csv, turn_rad: turns run clockwise" in found["log-turns"]["evidence"]
    assert "counter-clockwise positive" in found["log-turns"]["remedy"]
    taken = check(laps, "--set", "track.factors.turn_rad=1")
    assert taken["log-turns"]["severity"] == "warning"
    assert "log-turns" not in check(laps, "--set", "track.factors.turn_rad=-1")
    change(laps / "motion.csv", step_m=lambda step_m: step_m / 0.4)
    found = check(laps)
    assert found["log-steps"]["severity"] == "error"
    assert "speeds in m/s, rows 0.4 s apart" in found["log-steps"]["evidence"]
    assert "not speeds" in found["log-steps"]["remedy"]


def test_steps_with_another_unit_are_one_finding(check, laps):
    """By the positions; not by the speed too, which would blame feet for km/h."""
    heading = np.angle(np.exp(1j * np.cumsum(pd.read_csv(laps / "motion.csv")["turn_rad"])))
    times = {"time_s": lambda time_s: 4 * time_s}
    change(laps / "truth.csv", **times)
    change(laps / "gnss.csv", **times)
    change(laps / "motion.csv", heading_rad=lambda _: heading, turn_rad=lambda _: None, **times)
    assert not {"log-steps", "log-speeds"} & set(check(laps))
    change(laps / "motion.csv", step_m=lambda step_m: 3.6 * step_m)
    found = check(laps)
    assert "(km/h for m/s or " in found["log-steps"]["evidence"]
    assert "log-speeds" not in found


def test_timing_advances_in_metres_are_a_finding(check, log):
    serving = pd.read_csv(log / "radio.csv")["role"] == "serving"
    metres = serving.map({True: 700, False: None}).astype("Int64")
    change(log / "radio.csv", timing_advance=lambda _: metres)
    found = check(log)
    assert set(found) == {"log-ranges"}
    assert found["log-ranges"]["severity"] == "warning"
    assert "(metres for steps" in found["log-ranges"]["evidence"]


@pytest.mark.parametrize(("decimals", "step_m"), [(3, 111), (4, None)])
def test_degrees_of_few_decimals_are_a_finding(check, log, decimals, step_m):
    truth = read_log(log).truth
    lon_deg, lat_deg = unproject(read_log(log).crs, truth["east_m"], truth["north_m"])
    degrees = {"lat_deg": lat_deg.round(decimals), "lon_deg": lon_deg.round(decimals)}
    pd.DataFrame({"time_s": truth["time_s"], **degrees}).to_csv(log / "gnss.csv", index=False)
    found = check(log)
    if step_m is None:
        assert "log-degrees-rounded" not in found
        return
    assert found["log-degrees-rounded"]["severity"] == "warning"
    evidence = found["log-degrees-rounded"]["evidence"]
    assert f"gnss.csv: degrees of {decimals} decimals, in steps of {step_m} m: errors" in evidence


def test_motion_alone_is_no_fault(check, log):
    for table in ("radio", "gnss", "truth"):
        (log / f"{table}.csv").unlink(missing_ok=True)
    assert check(log) == {}


def test_logs_of_another_place_or_system(check, log):
    change(log / "truth.csv", east_m=lambda e: e + 50_000)
    assert "All positions (truth) lie 50 km or more outside." in str(check(log))
    (log / "log.json").write_text('{"crs": "EPSG:32634"}')
    found = check(log)["log-outside-area"]["evidence"]
    # 435 km east in zone 34 are 103 km in zone 35; the area is at 385 km.
    assert re.fullmatch(r"All positions \(truth\) lie 28\d km or more outside\.", found)
    (log / "log.json").write_text('{"crs": "+proj=tmerc +lat_0=0 +lon_0=0 +type=crs"}')
    assert check(log)["crs-mixed"]["evidence"].startswith("The log is in a local frame: convert it")


def test_damaged_and_missing_logs(check, log, tmp_path):
    (log / "motion.csv").write_text("time_s,step_m\n0,a\n")
    found = check(log)["log-invalid"]
    assert "motion.csv row 2, step_m" in found["where"]
    assert "a track log" in check(tmp_path / "none")["log-invalid"]["evidence"]


def test_recordings(check, tmp_path, world):
    log = read_log(world.journeys / ONE)
    lon, lat = unproject(log.crs, log.truth["east_m"], log.truth["north_m"])
    rows = pd.DataFrame({"time": 1_777_629_600 + log.truth["time_s"], "lat": lat, "lon": lon})
    rows.loc[rows.index[: len(rows) // 3], "lat"] = 99.0
    rows.to_csv(tmp_path / "drive.csv", index=False)
    found = check(tmp_path / "drive.csv")
    assert set(found) == {"log-rows-unused", "log-without-motion", "log-cells-unknown"}
    assert "lat_deg: not degrees in -90..90" in found["log-rows-unused"]["evidence"]
    rows.assign(time="yesterday").to_csv(tmp_path / "drive.csv", index=False)
    found = check(tmp_path / "drive.csv")
    assert set(found) == {"log-invalid"}
    assert "time" in found["log-invalid"]["evidence"]


def test_a_survey_without_times(tmp_path):
    text = MADE["opencellid"][1]
    head, *rows = text.splitlines()
    lines = [",".join([*r.split(",")[:7], "24.09.2014", *r.split(",")[8:]]) for r in rows]
    (tmp_path / "upload.csv").write_text("\n".join([head, *lines]))
    config = tmp_path / "survey.toml"
    config.write_text(
        '[area]\nmap = "none"\n[prediction]\nmodel = "survey"\n'
        '[prediction.survey]\nfiles = ["upload.csv"]\n[output]\ndir = "out"\n'
    )
    found = {f["code"]: f for f in mapfilter("check", "-c", config, "--json").json["findings"]}
    evidence = found["measurements-without-times"]["evidence"]
    assert "No time can be read in 1 of 1 sessions (upload)" in evidence
    assert "30 times not understood (levels kept), such as '24.09.2014' in line 2" in evidence
    assert "ISO 8601" in evidence


def test_notes_that_many_files_share_are_summed_up(tmp_path):
    head, *rows = MADE["opencellid"][1].splitlines()
    (tmp_path / "drives").mkdir()
    for i in range(5):
        lines = [",".join([*r.split(",")[:7], "soon", *r.split(",")[8:]]) for r in rows[: 20 + i]]
        (tmp_path / "drives" / f"d{i}.csv").write_text("\n".join([head, *lines]))
    config = tmp_path / "survey.toml"
    config.write_text(
        '[area]\nmap = "none"\n[prediction]\nmodel = "survey"\n[prediction.survey]\n'
        'files = ["drives"]\ncross_validate = false\n[output]\ndir = "out"\npictures = "none"\n'
    )
    notes = mapfilter("predict", "-c", config, "--json").json["notes"]
    of_times = [note for note in notes if "times not understood" in note]
    assert len(of_times) == 1
    assert of_times[0].startswith("110 times not understood (levels kept) in 5 files (")
    assert "such as 'soon' in line 2" in of_times[0]


def test_a_compass_that_runs_the_other_way_round_is_a_finding(check, laps, tmp_path):
    log = read_log(laps)
    lon, lat = unproject(log.crs, log.gnss["east_m"], log.gnss["north_m"])
    heading_deg = np.degrees(np.cumsum(log.motion["turn_rad"]))
    rows = {"time": 1.78e9 + log.motion["time_s"], "latitude": lat, "longitude": lon}
    walk = pd.DataFrame({**rows, "step_m": 2.0, "compass_deg": (90 - heading_deg) % 360})
    walk.to_csv(tmp_path / "walk.csv", index=False)
    assert "log-mirrored" not in check(tmp_path / "walk.csv")
    walk["compass_deg"] = -walk["compass_deg"] % 360
    walk.to_csv(tmp_path / "walk.csv", index=False)
    found = check(tmp_path / "walk.csv")["log-mirrored"]
    assert found["severity"] == "error"
    assert "azimuths that run counter-clockwise?" in found["evidence"]
    assert "track.factors.heading_rad = 1" in found["remedy"]
    factor = "track.factors.heading_rad=1"
    found = check(tmp_path / "walk.csv", "--set", factor)["log-mirrored"]
    assert found["severity"] == "warning"


def test_steps_in_feet_are_a_finding(check, log):
    rows = pd.read_csv(log / "motion.csv")
    speed_mps = rows["step_m"].iloc[1:].sum() / (rows["time_s"].iloc[-1] - rows["time_s"].iloc[0])
    change(log / "motion.csv", step_m=lambda step_m: step_m * 4.4 / speed_mps)
    found = check(log)
    assert found["log-speeds"]["severity"] == "warning"
    assert "steps of 4.4 m/s, expected 0.6 to 2.6 m/s" in found["log-speeds"]["evidence"]
    assert "filter.bayes.vehicle" in found["log-speeds"]["remedy"]
    assert "log-speeds" not in check(log, "--set", "filter.bayes.vehicle=true")
