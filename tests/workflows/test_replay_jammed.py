"""Recordings of a drive whose GNSS is jammed, without a map: what the command prints."""

import json
import re

import numpy as np
import pandas as pd
import pytest
from command_line import assert_done, assert_refused, mapfilter, settings

from mapfilter.positioning.estimate_store import read_estimate

COUNT, JAMMED = 400, 120
METRES_PER_DEGREE = 111_195.0


@pytest.fixture
def drive():
    """Seconds at 10 m/s with a right angle each minute; positions end after two minutes."""
    time_s = np.arange(float(COUNT))
    turn = np.where(time_s % 60 >= 51, np.pi / 18, 0.0) * np.where(time_s % 120 < 60, 1, -1)
    heading = np.cumsum(turn)
    north_m, east_m = np.cumsum(10 * np.sin(heading)), np.cumsum(10 * np.cos(heading))
    known = time_s <= JAMMED
    rng = np.random.default_rng(3)
    scatter = rng.normal(0, 2 / METRES_PER_DEGREE, (2, COUNT))
    return pd.DataFrame(
        {
            "time": 1.78e9 + time_s,
            "latitude": np.where(known, 60 + north_m / METRES_PER_DEGREE + scatter[0], np.nan),
            "longitude": np.where(known, 25 + 2 * east_m / METRES_PER_DEGREE + scatter[1], np.nan),
            "Speed [km/h]": 36.0,
            "Yaw rate [deg/s]": np.degrees(turn),
        }
    )


@pytest.fixture
def replay(tmp_path):
    def of(tables, *more):
        given = []
        for name, rows in tables.items():
            rows.to_csv(tmp_path / f"{name}.csv", index=False)
            given += ["--log", tmp_path / f"{name}.csv"]
        given += ["--out", tmp_path / "out", *settings(output__pictures="none")]
        return mapfilter("replay", "--filter", "ekf", *given, *more)

    return of


def apart(drive):
    """The positions, and a file of speeds and yaw rates."""
    places, motion = ["time", "latitude", "longitude"], ["time", *drive.columns[3:]]
    return {"positions": drive[places].dropna(), "odometry": drive[motion]}


def test_a_drive_goes_on_by_odometry_with_units_in_its_header(drive, replay, tmp_path):
    done = assert_done(replay(apart(drive), "--json"))
    estimate = read_estimate(str(tmp_path / "out" / "estimate.parquet"))
    assert done.json["last_time_s"] == COUNT - 1
    radii_m = estimate.radii_m[:, -1]
    assert done.json["radius_95_median_m"] == np.median(radii_m[np.isfinite(radii_m)])
    assert done.json["radius_95_last_m"] == radii_m[-1]
    assert sum(done.json["seconds_by_status"].values()) == COUNT - 1
    figures = json.loads((tmp_path / "out" / "figures.json").read_text())
    assert figures["seconds_by_status"] == done.json["seconds_by_status"]
    text = assert_done(replay(apart(drive))).out
    assert re.search(
        r"\nradius_95_last_m: [\d.]+\nseconds_by_status:\n  CONVERGED: 1 \(0 %\)", text
    )
    assert re.search(r"\n  no_heading: \d+ \(no heading for the step, or turns that fixes", text)


def test_every_note_stands_on_stderr_once(drive, replay):
    for options in ([], ["--json"]):
        done = replay(apart(drive), *options)
        lines = done.err.splitlines()
        assert len(set(lines)) == len(lines) > 2
        if options:
            assert lines == [f"mapfilter: note: {note}" for note in done.json["notes"]]
        else:
            assert "notes:" not in done.out


def test_a_merged_file_whose_speeds_are_not_known_says_so(drive, replay):
    merged = drive.rename(columns={"Speed [km/h]": "velocity", "Yaw rate [deg/s]": "yaw"})
    done = replay({"merged": merged}, "--json")
    assert done.json["last_time_s"] == JAMMED
    told = "merged.csv: columns not used: velocity (speed_kmh?), yaw (likely: "
    assert done.err.count(told) == 1
    told = "rows go on for 279 s after the last one with a value that is used: of their columns "
    assert done.err.count(told) == 1


def test_a_merged_file_is_located_to_its_end_by_named_columns(drive, replay):
    option = "wheel_speed_mps=Speed [km/h]"
    unnamed = replay({"merged": drive})
    assert f"--column '{option.lower()}'" in unnamed.err
    done = assert_done(replay({"merged": drive}, "--json", "--column", option))
    assert done.json["last_time_s"] == COUNT - 1
    assert not any("rows go on" in note for note in done.json["notes"])


def test_speeds_without_yaw_rates_say_what_follows(drive, replay):
    tables = apart(drive)
    tables["odometry"] = tables["odometry"].drop(columns="Yaw rate [deg/s]")
    done = assert_done(replay(tables, "--json"))
    assert "odometry: no yaw rates (a column such as Yaw rate [deg/s] or yaw_rate_radps): " in (
        done.err
    )
    assert "directions are unknown, so that uncertainty grows by the way gone" in done.err
    assert done.json["seconds_by_status"]["UNCERTAIN"] > 0


def test_steps_without_directions_say_what_follows(drive, replay):
    steps = pd.DataFrame({"time": drive["time"], "step_m": 10.0})
    done = replay({**apart(drive), "odometry": steps})
    assert "motion: no headings and no turns (a column compass_deg, heading_rad or turn_rad): " in (
        done.err
    )
    counted = steps.assign(steps=np.arange(COUNT)).drop(columns="step_m")
    done = replay({**apart(drive), "odometry": counted})
    assert "which way they went is unknown, so there is no motion" in done.err
    told = f"located until {JAMMED} s, rows go on until {COUNT - 1} s: neither motion nor "
    assert told in done.err


def test_a_track_that_is_lost_long_before_its_end_says_so(drive, replay):
    steps = pd.DataFrame({"time": drive["time"], "step_m": 0.5})
    done = replay({**apart(drive), "odometry": steps})
    assert re.search(
        r"located until \d+ s, rows go on until 399 s: LOST from there on, as ", done.err
    )


def test_turns_that_drift_are_named_as_the_likely_mistake(drive, replay):
    """Of a gyroscope that is assumed to have no bias, and has one of 3 deg/s."""
    turn = np.radians(drive["Yaw rate [deg/s]"].to_numpy() + 3.0)
    motion = pd.DataFrame({"time": drive["time"], "step_m": 10.0, "turn_rad": turn})
    places = drive[["time", "latitude", "longitude"]].dropna().iloc[::5]
    tables = {"positions": places, "odometry": motion}
    done = replay(tables, "--set", "filter.kalman.turn_rate_sd_deg_per_s=0.001")
    told = re.search(
        r"LOST from there on, as the readings contradict the position \(likely: a gyroscope "
        r"noisier than stated: turns drift by (\S+) deg/s beside the course of the positions",
        done.err,
    )
    assert told is not None, done.err
    assert float(told[1]) == pytest.approx(3.0, abs=0.4)
    # By default it is taken into account.
    done = replay(tables)
    assert "turn_rate_sd_deg_per_s is as large" in done.err
    assert "LOST" not in done.err


def test_motion_alone_has_nothing_to_start_from(drive, replay, tmp_path):
    done = replay({"odometry": apart(drive)["odometry"]})
    assert done.code == 3
    assert "nothing is located in odometry: no positions and no radio to start from\n" in done.err
    scored = replay(apart(drive), "--truth", tmp_path / "positions.csv")
    assert "to start from (those of the truth serve for scores only)" in scored.err


def test_exchanged_degrees_of_the_truth_are_refused(drive, replay, tmp_path):
    names = {"latitude": "longitude", "longitude": "latitude"}
    truth = apart(drive)["positions"].rename(columns=names)
    truth.to_csv(tmp_path / "truth.csv", index=False)
    done = replay(apart(drive), "--truth", tmp_path / "truth.csv")
    told = "truth.csv, latitude and longitude", "latitude and longitude swapped in one of the two"
    assert_refused(done, *told)


def test_a_track_that_is_lost_by_exchanged_degrees_names_them(drive, replay):
    names = {"latitude": "longitude", "longitude": "latitude"}
    tables = apart(drive)
    # They are lost at once, as turns contradict them.
    tables["positions"] = tables["positions"][:50].rename(columns=names)
    assert "latitude and longitude are swapped)" in replay(tables).err


def test_a_log_with_exchanged_degrees_is_named_beside_the_cell_plan(drive, replay, tmp_path):
    names = {"latitude": "longitude", "longitude": "latitude"}
    places = apart(drive)["positions"].rename(columns=names)
    phone = places.assign(mcc=1, mnc=1, lac=1, ci=1, rsrp=-80)
    head = "cell,site,lat,lon,height_m,azimuth_deg,eirp_dbm,frequency_mhz"
    (tmp_path / "cells.csv").write_text(f"{head}\nA,A,60.0,25.0,30,0,55,1800\n")
    plan = "cells.plan=" + json.dumps(str(tmp_path / "cells.csv"))
    done = replay({"phone": phone}, "--set", plan)
    assert_refused(done, "swapped, or so in the log, by whose positions the CRS is EPSG:")
