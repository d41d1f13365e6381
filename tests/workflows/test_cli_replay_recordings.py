"""``replay`` takes recordings of other programs: cells by identity, motion, truth."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from command_line import IDENTITIES, ONE, assert_done, assert_refused, mapfilter, settings
from made_recordings import MADE

from mapfilter.angles import azimuth_from_heading_deg
from mapfilter.geodesy import unproject
from mapfilter.positioning.estimate_store import read_estimate
from mapfilter.tracks.store import read_log, write_log

START_UTC_S = 1_777_629_600


@pytest.fixture
def recordings(world, tmp_path):
    """A journey of the small world as two recordings and a truth, in UTC and WGS 84."""
    log = read_log(world.journeys / ONE)
    folder = tmp_path / "drive"
    folder.mkdir()
    radio = log.radio[log.radio["role"] == "serving"]
    lac, ci = zip(*(IDENTITIES[cell] for cell in radio["cell"]), strict=True)
    cells = pd.DataFrame({"time": START_UTC_S + radio["time_s"], "technology": "LTE"})
    cells = cells.assign(mcc=244, mnc=91, lac=lac, ci=ci, rsrp=radio["level_dbm"])
    cells.to_csv(folder / "cells.csv", index=False)
    motion = log.motion[["time_s", "step_m", "heading_rad"]]
    motion = motion.assign(time=START_UTC_S + motion.pop("time_s"))
    motion.to_csv(folder / "steps.csv", index=False)
    lon, lat = unproject(log.crs, log.truth["east_m"], log.truth["north_m"])
    truth = pd.DataFrame({"time": START_UTC_S + log.truth["time_s"], "lat": lat, "lon": lon})
    truth.to_csv(tmp_path / "truth.csv", index=False)
    return folder


def replayed(database, out, *args):
    given = settings(output__pictures="none", filter__margin_db=0.0, filter__update_length_m=10.0)
    given += ["--filter", "candidate"]
    return mapfilter("replay", "--db", database, "--out", out, *given, *args, "--json")


def test_recordings_of_a_journey_are_located(database, recordings, tmp_path, world):
    truth = ("--truth", tmp_path / "truth.csv")
    files = ("--log", recordings / "steps.csv", "--log", recordings / "cells.csv")
    done = replayed(database, tmp_path / "out", *files, *truth)
    assert done.code == 0, done.err
    found = done.json
    assert found["unknown_cells"] == {}
    assert any("named by the plan's identities" in note for note in found["notes"])
    original = read_log(world.journeys / ONE)
    serving = original.radio[original.radio["role"] == "serving"]
    write_log(replace(original, radio=serving), tmp_path / "plain")
    plain = replayed(database, tmp_path / "of", "--log", tmp_path / "plain").json
    assert found["switched"]
    assert found["error_mean_m"] == pytest.approx(plain["error_mean_m"], abs=1)
    # A folder is the same journey, and so is the log that convert makes of it.
    folder = replayed(database, tmp_path / "folder", "--log", recordings, *truth).json
    log = tmp_path / "log"
    assert_done(mapfilter("convert", recordings, *truth, "--out", log, "--crs", "EPSG:32635"))
    written = replayed(database, tmp_path / "again", "--log", log).json
    for other in (folder, written):
        assert other["epochs"] == found["epochs"]
    table, *others = (
        read_estimate(tmp_path / out / "estimate.parquet").to_dataframe()
        for out in ("out", "folder", "again")
    )
    for other in others:
        pd.testing.assert_frame_equal(other, table, check_exact=True)
    estimate = read_estimate(tmp_path / "out" / "estimate.parquet")
    motion_s = original.motion["time_s"].to_numpy()
    assert np.isin(np.round(motion_s, 3), np.round(estimate.time_s, 3)).mean() > 0.95


@pytest.fixture
def counted(world, recordings):
    """The journey as a phone that counts steps of 0.5 m, and whose compass is 10 degrees off."""
    motion = read_log(world.journeys / ONE).motion
    steps = (motion["step_m"].fillna(0.0).cumsum() / 0.5).round().astype(int)
    azimuth_deg = (azimuth_from_heading_deg(motion["heading_rad"]) - 10.0) % 360
    table = pd.DataFrame({"time": START_UTC_S + motion["time_s"], "steps": steps})
    table.assign(compass_deg=azimuth_deg).to_csv(recordings / "steps.csv", index=False)
    return ("--log", recordings / "steps.csv", "--log", recordings / "cells.csv")


def test_steps_are_counted_with_the_length_and_declination_given(database, counted, tmp_path):
    truth = ("--truth", tmp_path / "truth.csv")
    given = ("--step-length", "0.5", "--declination", "10")
    found = replayed(database, tmp_path / "out", *counted, *truth, *given)
    assert found.code == 0, found.err
    assert any("steps of 0.5 m by a counter" in note for note in found.json["notes"])
    assert not any("declination" in note for note in found.json["notes"])
    assert not any("no effect" in note for note in found.json["notes"])
    keys = ("--set", "track.walk.step_m=0.5", "--set", "track.walk.declination_deg=10")
    same = replayed(database, tmp_path / "same", *counted, *truth, *keys).json
    assert same["error_mean_m"] == found.json["error_mean_m"]
    for option, value, expected in (
        ("--step-length", "50", "metres above 0 and below 3, found 50"),
        ("--declination", "200", "degrees in -180..180, found 200"),
    ):
        wrong = mapfilter("replay", "--db", database, *counted, option, value)
        assert_refused(wrong, option, expected)
    off = ("--set", "track.steps=false")
    refused = mapfilter("replay", "--db", database, *counted, *given, *off)
    assert_refused(refused, "--step-length", "track.steps = false takes none")


def test_options_of_walks_that_a_log_does_not_use_are_noted(database, recordings, tmp_path):
    files = ("--log", recordings / "steps.csv", "--log", recordings / "cells.csv")
    truth = ("--truth", tmp_path / "truth.csv")
    log = tmp_path / "log"
    assert_done(mapfilter("convert", recordings, *truth, "--out", log, "--crs", "EPSG:32635"))
    for given, why in (
        ((*files, *truth), "motion is that of steps.csv"),
        (("--log", log), "the motion of a track log is used as it is"),
    ):
        options = ("--step-length", "0.8", "--declination", "10")
        notes = replayed(database, tmp_path / "out", *given, *options).json["notes"]
        for option in ("step_m = 0.8 (--step-length)", "declination_deg = 10 (--declination)"):
            assert any(note.startswith(f"{option} has no effect: {why}") for note in notes), why


def test_the_section_names_recordings(database, recordings, tmp_path):
    table = pd.read_csv(recordings / "steps.csv").rename(columns={"time": "Zeit"})
    table.to_csv(recordings / "steps.csv", index=False)
    config = tmp_path / "drive.toml"
    config.write_text(
        '[track]\npath = "drive/steps.csv"\nrecordings = ["drive/cells.csv"]\n'
        'truth = "truth.csv"\nformat = "csv"\n[track.columns]\ntime = "Zeit"\n'
    )
    given = "replay", "--db", database, "--out", tmp_path / "out", "-c", config
    assert_refused(
        mapfilter(*given, "--column", "level_dbm=Pegel"),
        "steps.csv, cells.csv, truth.csv",
        "a column Pegel for level_dbm",
    )
    # The other files have a usual name.
    assert replayed(database, tmp_path / "out", "-c", config).code == 0
    for path in (recordings / "cells.csv", tmp_path / "truth.csv"):
        path.write_text(path.read_text().replace("time,", "Zeit,", 1))
    done = replayed(database, tmp_path / "out", "-c", config)
    assert done.code == 0, done.err
    assert done.json["error_mean_m"] is not None


def test_a_drive_test_alone_says_what_it_lacks(database, recordings, tmp_path):
    cells = recordings / "cells.csv"
    done = replayed(database, tmp_path / "out", "--log", cells)
    assert done.code == 3
    assert "nothing is located in cells: no motion (mapfilter locate needs none)" in done.err


def test_speed_and_course_become_motion_on_request(database, recordings, tmp_path):
    truth = pd.read_csv(tmp_path / "truth.csv")
    cells = pd.read_csv(recordings / "cells.csv")
    places = {name: np.interp(cells["time"], truth["time"], truth[name]) for name in ("lat", "lon")}
    drive = cells.assign(**places, speed_mps=1.4, bearing=90.0)
    drive.to_csv(tmp_path / "drive.csv", index=False)
    path = tmp_path / "drive.csv"
    done = replayed(database, tmp_path / "out", "--log", path, "--without", "gnss")
    assert done.code == 3
    remedy = "no motion (--course-motion, track.course_motion, makes it from speed and course; "
    assert remedy + "mapfilter locate needs none" in done.err
    # As the truth they are no sensor any more, and yet make motion.
    given = ("--log", path, "--truth", path)
    assert remedy in replayed(database, tmp_path / "out", *given).err
    assert replayed(database, tmp_path / "out", *given, "--course-motion").code == 0
    given = ("--log", path, "--course-motion", "--without", "gnss")
    done = replayed(database, tmp_path / "out", *given)
    assert done.code == 0, done.err
    # Without speed and course it is made from positions.
    drive.drop(columns=["speed_mps", "bearing"]).to_csv(path, index=False)
    done = replayed(database, tmp_path / "out", *given[:2], *given[3:])
    assert "makes it from positions; mapfilter locate needs none)" in done.err
    # Positions are enough for a Kalman-type filter.
    drive[["time", "lat", "lon"]].to_csv(tmp_path / "fixes.csv", index=False)
    alone = ("--log", tmp_path / "fixes.csv")
    done = replayed(database, tmp_path / "out", *alone)
    assert "makes it from positions; --filter ekf needs none beside positions)" in done.err
    assert replayed(database, tmp_path / "out", *alone, "--filter", "ekf").code == 0
    done = replayed(database, tmp_path / "out", *given)
    assert done.code == 0, done.err
    assert "motion comes from GNSS" in done.out


def test_a_clock_that_is_off_is_set_by_an_offset(database, recordings, tmp_path):
    truth = pd.read_csv(tmp_path / "truth.csv")
    late = tmp_path / "late.csv"
    truth.assign(time=truth["time"] + 37.0).to_csv(late, index=False)
    right = replayed(
        database, tmp_path / "out", "--log", recordings, "--truth", tmp_path / "truth.csv"
    )
    given = ("--log", recordings, "--truth", late)
    wrong = replayed(database, tmp_path / "off", *given).json
    assert wrong["error_mean_m"] > 20 + right.json["error_mean_m"]
    for more in (
        ("--offset", "late.csv=-37"),
        ("--offset", f"{late}=-37.0"),
        ("--set", 'track.offsets_s={"late.csv" = -37.0}'),
    ):
        found = replayed(database, tmp_path / "on", *given, *more).json
        assert found["error_mean_m"] == pytest.approx(right.json["error_mean_m"], abs=1e-6)
    refused = replayed(database, tmp_path / "no", *given, "--offset", "lat.csv=1")
    assert_refused(refused, "--offset, track.offsets_s: expected the name of one of the recordings")
    refused = replayed(database, tmp_path / "no", *given, "--offset", "late.csv=soon")
    assert_refused(refused, "--offset late.csv: expected 1 number")


def test_refusals(database, recordings, tmp_path):
    (tmp_path / "far.csv").write_text("time,lat,lon\n1777629600,48.1,11.5\n1777629601,48.1,11.6\n")
    out = tmp_path / "out"
    assert_refused(
        mapfilter("replay", "--db", database, "--out", out, "--log", tmp_path / "far.csv"),
        "far.csv, gnss: expected positions near the database's",
    )
    for more, told in (
        (["--log", tmp_path / "none.csv"], "none.csv: expected a track log"),
        (["--log", recordings, "--zone", "Mars"], "Europe/Brussels"),
        (["--log", recordings, "--set", 'track.format="kml"'], "one of gnettrack"),
        (["--log", recordings, "--truth", tmp_path / "none.gpx"], "none.gpx"),
        (["--log", recordings / "cells.csv", "--log", database], "database: expected"),
    ):
        assert_refused(mapfilter("replay", "--db", database, "--out", out, *more), told)
        assert not out.exists()
    assert json.loads((database / "manifest.json").read_text())


def test_without_a_database_the_remedies_are_named(recordings, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    given = ("replay", "--log", recordings, "--out", tmp_path / "out")
    told = "database.path: expected a radio-route database, found none, and nothing at"
    assert_refused(mapfilter(*given), told, "--roads-only", "mapfilter locate", "--filter ekf")
    assert_refused(mapfilter(*given, "--filter", "ekf"), "cells.plan", "has no positions", "--db")


def test_why_positions_are_none_is_said_where_they_are_needed(tmp_path):
    """The note that told it was lost: only a cell plan was asked for."""
    rows = [f"{k},{525_200_000 + k},{134_000_000 + k},262-1-7-{k % 3},-80" for k in range(60)]
    (tmp_path / "e7.csv").write_text("\n".join(["time_s,lat,lon,cell,level_dbm", *rows]))
    given = ("replay", "--log", tmp_path / "e7.csv", "--filter", "ekf", "--out", tmp_path / "out")
    told = (
        "none used of 60 rows: lat_deg: not degrees in -90..90 (likely: degrees times 1e6 or 1e7; "
    )
    done = mapfilter(*given)
    assert_refused(done, "'e7.csv': expected positions", told, "cells.plan, or --db")


def test_notes_on_reading_come_before_an_error(tmp_path):
    """They tell why: of a replay that stops after reading, and of recordings that do not fit."""
    rows = [f"{k},262-1-7-{k % 3},-80,5.5" for k in range(60)]
    (tmp_path / "a.csv").write_text("\n".join(["time_s,cell,level_dbm,mood", *rows]))
    note = "mapfilter: note: a.csv: columns not used: mood"
    given = ("--log", tmp_path / "a.csv", "--filter", "ekf", "--out", tmp_path / "out")
    done = mapfilter("replay", *given)
    assert_refused(done, "cells.plan")
    assert sum(note in line for line in done.err.splitlines()[:-1]) == 1
    # Refused by what joins recordings, not by the reader.
    done = mapfilter("replay", *given, "--truth", tmp_path / "a.csv")
    assert_refused(done, "expected positions, as the truth")
    assert note in done.err.splitlines()[0]
    done = mapfilter("convert", tmp_path / "a.csv", "--truth", tmp_path / "a.csv", "--out", "log")
    assert_refused(done, "expected positions, as the truth")
    assert note in done.err.splitlines()[0]


def test_pseudoranges_that_no_filter_without_a_map_uses_are_said_to_be(tmp_path):
    file, text = MADE["smartloc"]
    (tmp_path / file).write_text(text)
    given = ("replay", "--log", tmp_path / file, "--filter", "ekf", "--out", tmp_path / "out")
    done = mapfilter(*given)
    assert done.code == 3
    assert "pseudoranges: only the filter bayes uses them, over a map" in done.err
    file, text = MADE["rinex-obs"]
    (tmp_path / file).write_text(text)
    done = mapfilter("replay", "--log", tmp_path / file, *given[3:])
    assert done.code == 3
    assert "their satellites have no places, for which the day's navigation file" in done.err


def test_positions_alone_need_neither_database_nor_plan(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    second = np.arange(60)
    rng = np.random.default_rng(4)
    true_deg = 60.17 + second * 1.4 / 111_195
    seen_deg = true_deg + rng.normal(0, 5, 60) / 111_195
    for name, lat in (("truth.csv", true_deg), ("fixes.csv", seen_deg)):
        rows = {"time": 1_777_629_600 + second, "lat": lat, "lon": 24.94}
        pd.DataFrame(rows).to_csv(tmp_path / name, index=False)
    files = ("--log", tmp_path / "fixes.csv", "--truth", tmp_path / "truth.csv")
    for more in (("--filter", "ekf"), ("--filter", "ukf", "--smooth")):
        done = mapfilter("replay", *files, *more, "--out", tmp_path / "out", "--json")
        assert done.code == 0, done.err
        assert done.json["switched"]
        assert done.json["error_mean_m"] < 5


def test_identities_in_the_radio_table_of_a_log_are_those_of_the_plan(database, world, tmp_path):
    """Columns mcc, mnc, lac and ci in place of a cell's id find the positions that ids find."""
    shutil.copytree(world.journeys / ONE, tmp_path / "named")
    log = read_log(tmp_path / "named")
    known = log.radio["cell"].map(IDENTITIES, na_action="ignore")
    lac, ci = (known.map(lambda of, at=at: of[at], na_action="ignore") for at in (0, 1))
    country = known.map(lambda _: 244, na_action="ignore")
    network = known.map(lambda _: 91, na_action="ignore")
    radio = log.radio.drop(columns="cell").assign(mcc=country, mnc=network, lac=lac, ci=ci)
    by_hand = tmp_path / "by-hand"
    by_hand.mkdir()
    (by_hand / "log.json").write_text(json.dumps({"crs": log.crs}))
    log.motion.to_csv(by_hand / "motion.csv", index=False)
    radio.to_csv(by_hand / "radio.csv", index=False)
    found = []
    for folder in ("named", "by-hand"):
        done = replayed(database, tmp_path / f"out-{folder}", "--log", tmp_path / folder)
        assert done.code == 0, done.err
        assert done.json["unknown_cells"] == {}
        found.append((done.json["switched"], done.json["epochs"], done.json["unused"]))
    assert found[0] == found[1]
    assert any("named by the plan's identities" in note for note in done.json["notes"])
