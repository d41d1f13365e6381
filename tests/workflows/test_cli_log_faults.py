"""Wrong logs: one message, exit code 2, and nothing written."""

import os
import shutil

import numpy as np
import pandas as pd
import pytest
from command_line import (
    ONE,
    assert_done,
    assert_refused,
    change,
    contents,
    mapfilter,
    put,
    settings,
)

from mapfilter.geodesy import project, unproject


def assert_log_refused(replay, log, *told):
    before = contents(log.parent)
    assert_refused(replay(log), *told)
    assert_refused(mapfilter("info", log), *told)
    assert contents(log.parent) == before


def test_a_log_made_by_hand_is_replayed(log, replay, tmp_path):
    found = assert_done(replay(log, "--json")).json
    assert found["switched"] is True
    assert contents(tmp_path / "out")


@pytest.mark.parametrize(
    ("table", "columns", "told"),
    [
        ("motion", {"time_s": lambda t: t * 1000}, "milliseconds for s"),
        ("truth", {"time_s": lambda t: t * 1000}, "milliseconds for s"),
        ("radio", {"time_s": lambda t: t * 1000}, "milliseconds for s"),
        ("motion", {"time_s": lambda t: t + 1.7e9}, "tables that overlap in time"),
        ("motion", {"time_s": put("nan")}, "row 3, time_s: expected seconds, found nan"),
        ("motion", {"time_s": put("inf")}, "row 3, time_s: expected seconds, found inf"),
        ("radio", {"time_s": put("soon")}, "row 3, time_s: expected seconds, found soon"),
        ("truth", {"east_m": put("inf")}, "row 3, east_m: expected metres east, found inf"),
        ("truth", {"north_m": put("nan")}, "row 3, north_m: expected metres north, found nan"),
        ("motion", {"heading_rad": lambda h: h * 180 / np.pi}, "degrees given for radians"),
        ("radio", {"level_dbm": lambda v: -v}, "likely: a lost sign (70 for -70 dBm)"),
        ("radio", {"level_dbm": lambda v: np.round(v + 110)}, "raw RXLEV given for dBm"),
        ("radio", {"level_dbm": lambda v: v + 60}, "likely: a strong level plus an offset"),
        ("radio", {"role": put("servng")}, "row 3, role: expected serving or neighbour"),
    ],
)
def test_values(table, columns, told, log, replay):
    change(log / f"{table}.csv", **columns)
    assert_log_refused(replay, log, f"{table}.csv", told)


def test_degrees_for_metres(log, replay):
    change(
        log / "truth.csv",
        east_m=lambda e: 24.9 + (e - e.min()) * 1e-5,
        north_m=lambda n: 60.1 + (n - n.min()) * 1e-5,
    )
    assert_log_refused(replay, log, "truth.csv", "degrees given for metres")


def test_all_faults_of_a_log_are_told_together(log, replay):
    change(log / "motion.csv", time_s=put("inf"))
    change(log / "truth.csv", east_m=put("nan"))
    (log / "log.json").write_text('{"crs": "EPSG:4326"}')
    assert_log_refused(replay, log, "motion.csv row 3", "truth.csv row 3", "my-walk/log.json, crs")


@pytest.mark.parametrize(
    ("name", "text", "told"),
    [
        ("motion.csv", "", "motion.csv: expected a header line, found an empty file"),
        ("motion.csv", "time_s,step_m\n1,2,3\n", "motion.csv: expected a readable table"),
        ("motion.csv", "time,step_m\n1,2\n", "column time"),
        ("log.json", "", "log.json: expected JSON"),
        ("log.json", '{"crs": "EPSG', "log.json: expected JSON"),
        ("log.json", "{}", "crs: expected a projected CRS in metres, found none"),
        ("log.json", '{"crs": "EPSG:4326"}', "degrees given for metres"),
        ("log.json", '{"crs": "EPSG:32635", "version": 2}', "written by a newer mapfilter"),
        ("log.json", '{"crs": "EPSG:32635", "start": 3}', "log.json, start: expected one of"),
    ],
)
def test_files(name, text, told, log, replay):
    (log / name).write_text(text)
    assert_log_refused(replay, log, told)


@pytest.mark.parametrize("damage", ["cut off", "changed", "removed"])
def test_a_damaged_part(damage, world, replay, tmp_path):
    log = shutil.copytree(world.journeys / ONE, tmp_path / "walk")
    file = log / "radio.parquet"
    whole = file.read_bytes()
    middle = len(whole) // 2
    if damage == "removed":
        file.unlink()
    elif damage == "cut off":
        file.write_bytes(whole[:middle])
    else:
        file.write_bytes(whole[:middle] + bytes([whole[middle] ^ 1]) + whole[middle + 1 :])
    assert_log_refused(replay, log, "radio.parquet: expected")


def test_no_log(replay, tmp_path, world):
    assert_refused(replay(tmp_path / "none"), "none: expected a track log, or a folder of logs")
    (tmp_path / "empty").mkdir()
    assert_refused(replay(tmp_path / "empty"), "empty: expected", "found a folder without any")
    told = "rxlev.tif: expected a recording as text, found a TIFF raster"
    assert_refused(replay(world.rasters), told)
    assert not (tmp_path / "out").exists()


def test_a_wrong_crs_puts_a_log_elsewhere(log, replay):
    (log / "log.json").write_text('{"crs": "EPSG:32634"}')
    before = contents(log.parent)
    where = "my-walk, truth: expected positions near the database's"
    told = where, "a wrong CRS: EPSG:32634 is stated for metres of EPSG:32635"
    note = "mapfilter: note: projected from EPSG:32634 to EPSG:32635: positions, headings by -5.2"
    assert_refused(replay(log), note, *told)
    assert contents(log.parent) == before


def test_a_crs_with_the_metres_of_the_database(log, replay):
    (log / "log.json").write_text('{"crs": "EPSG:25835"}')
    assert assert_done(replay(log, "--json")).json["switched"] is True


def test_single_reports_of_a_log_in_another_crs_need_no_positions(log, world, tmp_path):
    (log / "truth.csv").unlink()
    (log / "log.json").write_text('{"crs": "EPSG:2393"}')
    given = ("--db", world.database, "--log", log, "--method", "centroid", "--json")
    found = assert_done(mapfilter("locate", *given, "--out", tmp_path / "single"))
    assert found.json["reports"] > 0


def test_a_log_of_the_area_in_another_crs(log, replay, world, tmp_path):
    truth = pd.read_csv(log / "truth.csv")
    degrees = unproject("EPSG:32635", truth["east_m"], truth["north_m"])
    truth["east_m"], truth["north_m"] = project("EPSG:2393", *degrees)
    same = assert_done(replay(log, "--json")).json
    truth.to_csv(log / "truth.csv", index=False)
    (log / "log.json").write_text('{"crs": "EPSG:2393"}')
    found = assert_done(replay(log, "--json")).json
    assert any(note.startswith("projected from EPSG:2393 to ") for note in found["notes"])
    assert found["error_mean_m"] == pytest.approx(same["error_mean_m"], abs=2.0)
    given = ("--db", world.database, "--log", log, "--method", "centroid", "--json")
    single = assert_done(mapfilter("locate", *given, "--out", tmp_path / "single")).json
    assert single["error_median_m"] < 500
    findings = mapfilter("check", "-c", world.toml, *settings(track__path=str(log)), "--json").json
    assert not [one for one in findings["findings"] if one["code"].startswith(("crs", "log-out"))]


def test_one_bad_log_of_many_stops_all_before_anything_is_written(own_world, replay, tmp_path):
    (own_world.journeys / "journey-0001-draw-000" / "motion.parquet").unlink()
    head = own_world.journeys / ONE / "log.json"
    head.write_text(head.read_text().replace("EPSG:32635", "EPSG:32634"))
    told = f"{ONE}, truth", "journey-0001-draw-000/motion.parquet"
    assert_refused(replay(own_world.journeys), *told)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("more", "told"),
    [
        (["--filter", "kalman"], "setting filter.name: expected 'bayes', 'grid', 'candidate',"),
        (
            ["--without", "gps"],
            "setting track.without.0: expected 'gnss', 'fixes', 'pseudoranges', 'ta', 'tdoa'",
        ),
        (
            ["--without", "gnss,"],
            "setting track.without.1: expected 'gnss', 'fixes', 'pseudoranges', 'ta', 'tdoa'",
        ),
        (["--without", ""], "setting track.without.0: expected"),
        (["--set", "filter.threshold=0"], "setting filter.threshold: expected a whole number >= 1"),
    ],
)
def test_options(more, told, log, replay):
    before = contents(log.parent)
    assert_refused(replay(log, *more), told)
    assert contents(log.parent) == before


@pytest.mark.parametrize(
    ("change_m", "hint"),
    [
        (lambda e, n: (n, e), "east and north swapped"),
        (lambda e, n: (e + 50_000, n), "log of another area or zone"),
        (lambda e, n: (e, n - 10_000), "log of another area or zone"),
    ],
)
@pytest.mark.parametrize("table", ["truth", "gnss"])
def test_positions_far_off_the_database(table, change_m, hint, log, replay, tmp_path):
    rows = pd.read_csv(log / "truth.csv")[["time_s", "east_m", "north_m"]]
    rows["east_m"], rows["north_m"] = change_m(rows["east_m"], rows["north_m"])
    rows.to_csv(log / f"{table}.csv", index=False)
    told = f"my-walk, {table}: expected positions near the database's "
    assert_refused(replay(log), told, hint)
    assert not (tmp_path / "out").exists()


def test_a_log_that_leaves_the_database_is_replayed(log, replay):
    change(log / "truth.csv", east_m=lambda e: e + np.linspace(-2_000, 50_000, len(e)))
    assert_done(replay(log))


def test_a_log_whose_name_is_no_text(own_world, replay):
    odd = own_world.journeys / os.fsdecode(b"walk-\xff")
    (own_world.journeys / ONE).rename(odd)
    assert_refused(replay(own_world.journeys), "logs: expected a path in UTF-8, found ")
