"""Wrong logs, unknown cells, and what replay does with both."""

import json
import shutil

import numpy as np
import pandas as pd
import pytest
from command_line import assert_done, assert_refused, contents, mapfilter, settings

from mapfilter.filters.contract import Reason
from mapfilter.positioning.estimate_store import read_estimate
from mapfilter.tracks.store import read_log, write_log

ONE = "journey-0000-draw-000"


@pytest.fixture
def log(world, tmp_path):
    """A log folder as a person makes it: ``log.json`` with a CRS, and CSV tables."""
    folder = tmp_path / "my-walk"
    write_log(read_log(world.journeys / ONE), folder, "csv")
    crs = json.loads((folder / "log.json").read_text())["crs"]
    (folder / "log.json").write_text(json.dumps({"crs": crs}))
    return folder


@pytest.fixture
def replay(world, tmp_path):
    def replay(log, *more):
        given = ["--db", world.database, "--log", log, "--out", tmp_path / "out"]
        pictures = settings(output__pictures="none")
        return mapfilter("replay", "-c", world.toml, *given, *pictures, *more)

    return replay


def change(file, **columns):
    """Give columns of a CSV table new values, each a function of the old ones."""
    table = pd.read_csv(file)
    for name, function in columns.items():
        table[name] = function(table[name])
    table.to_csv(file, index=False)


def put(value, row=2):
    """Return a function that puts a value into a row of a column, counted from 1."""

    def changed(column):
        column = column.astype(object)
        column.iloc[row - 1] = value
        return column

    return changed


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
        ("motion", {"time_s": put("nan")}, "row 2, time_s: expected seconds, found nan"),
        ("motion", {"time_s": put("inf")}, "row 2, time_s: expected seconds, found inf"),
        ("radio", {"time_s": put("soon")}, "row 2, time_s: expected seconds, found soon"),
        ("truth", {"east_m": put("inf")}, "row 2, east_m: expected metres east, found inf"),
        ("truth", {"north_m": put("nan")}, "row 2, north_m: expected metres north, found nan"),
        ("motion", {"heading_rad": lambda h: h * 180 / np.pi}, "degrees given for radians"),
        ("radio", {"level_dbm": lambda v: -v}, "raw RXLEV given for dBm"),
        ("radio", {"role": put("servng")}, "row 2, role: expected serving or neighbour"),
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
    assert_log_refused(replay, log, "motion.csv row 2", "truth.csv row 2", "log, crs")


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
    assert_refused(replay(world.rasters), "rxlev.tif: expected a track log")
    assert not (tmp_path / "out").exists()


def test_another_crs_than_the_database(log, replay):
    (log / "log.json").write_text('{"crs": "EPSG:32634"}')
    before = contents(log.parent)
    told = "my-walk, crs: expected EPSG:32635, the database's, found EPSG:32634"
    assert_refused(replay(log), told, "log of another area or zone")
    assert contents(log.parent) == before


def test_one_bad_log_of_many_stops_all_before_anything_is_written(own_world, replay, tmp_path):
    (own_world.journeys / "journey-0001-draw-000" / "motion.parquet").unlink()
    head = own_world.journeys / ONE / "log.json"
    head.write_text(head.read_text().replace("EPSG:32635", "EPSG:32634"))
    told = f"{ONE}, crs", "journey-0001-draw-000/motion.parquet"
    assert_refused(replay(own_world.journeys), *told)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("more", "told"),
    [
        (["--filter", "kalman"], "setting filter.name: expected 'candidate', found 'kalman'"),
        (["--without", "gps"], "setting track.without.0: expected 'gnss', 'ta' or 'neighbours'"),
        (["--without", "gnss,"], "setting track.without.1: expected 'gnss', 'ta' or 'neighbours'"),
        (["--without", ""], "setting track.without.0: expected"),
        (["--set", "filter.threshold=0"], "setting filter.threshold: expected greater than"),
    ],
)
def test_options(more, told, log, replay):
    before = contents(log.parent)
    assert_refused(replay(log, *more), told)
    assert contents(log.parent) == before


def test_some_cells_unknown(log, replay, tmp_path):
    table = pd.read_csv(log / "radio.csv")
    late = (table["role"] == "serving") & (table["time_s"] > 150)
    table.loc[late, "cell"] = "../new"
    table.to_csv(log / "radio.csv", index=False)
    outcome = replay(log, "--json")
    assert outcome.code == 3
    assert outcome.err == (
        "mapfilter: some cells are unknown to the database; their readings are labelled "
        "unknown_cell\n"
    )
    assert outcome.json["unused"]["unknown_cell"] == late.sum()
    estimate = read_estimate(tmp_path / "out" / "estimate.parquet")
    labelled = [u for u in estimate.unused if u.reason is Reason.UNKNOWN_CELL]
    assert {(u.kind, u.what) for u in labelled} == {("serving", "../new")}
    assert [u.time_s for u in labelled] == table.loc[late, "time_s"].tolist()
    motion = pd.read_csv(log / "motion.csv")
    assert len(estimate) >= len(motion)
    assert np.isfinite(estimate.east_m[-1])


def test_all_cells_unknown_with_pictures(log, replay, tmp_path):
    change(log / "radio.csv", cell=lambda c: c.where(c.isna(), "X"))
    outcome = replay(log, "--json", "--set=output.pictures=all")
    assert outcome.code == 3
    assert outcome.json["switched"] is False
    assert outcome.json["error_mean_m"] is None
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert {"estimate.parquet", "estimate.gpx", "estimate.geojson", "track.png"} <= names


@pytest.mark.parametrize("kept", [(), ("motion",), ("radio",), ("truth",), ("motion", "radio")])
def test_logs_of_few_tables(kept, log, replay, tmp_path):
    for table in ("motion", "radio", "gnss", "truth"):
        if table not in kept:
            (log / f"{table}.csv").unlink()
    outcome = replay(log, "--json", "--set=output.pictures=all")
    assert_done(outcome)
    assert "error_mean_m" not in outcome.json or kept == ("truth",)
    assert (tmp_path / "out" / "estimate.parquet").is_file()


def test_a_log_with_a_header_and_no_rows(log, replay):
    for table in ("motion", "radio", "gnss", "truth"):
        file = log / f"{table}.csv"
        file.write_text(file.read_text().splitlines()[0] + "\n")
    assert_done(replay(log, "--set=output.pictures=all"))


def test_what_is_left_out_is_counted(log, replay, tmp_path):
    change(log / "radio.csv", timing_advance=put(3))
    (log / "gnss.csv").write_text("time_s,east_m,north_m\n5,386000,6671800\n")
    neighbours = (pd.read_csv(log / "radio.csv")["role"] == "neighbour").sum()
    found = assert_done(replay(log, "--without", "neighbours,ta,gnss", "--json")).json
    assert found["unused"] == {}
    notes = json.loads((tmp_path / "out" / "figures.json").read_text())["notes"]
    left = ["gnss: 1 left out", "ta: 1 left out", f"neighbours: {neighbours} left out"]
    assert notes == left
    assert_done(replay(log))
    every = read_estimate(tmp_path / "out" / "estimate.parquet")
    assert {u.kind for u in every.unused} == {"neighbour", "gnss"}


def test_only_logs_that_know_their_start_give_times_in_gpx(log, replay, tmp_path):
    assert_done(replay(log))
    gpx = tmp_path / "out" / "estimate.gpx"
    assert "<time>" not in gpx.read_text()
    head = json.loads((log / "log.json").read_text())
    (log / "log.json").write_text(json.dumps({**head, "start_utc_s": 1_700_000_000}))
    assert_done(replay(log))
    assert "<time>2023-11-14T22:16:18.000Z<" in gpx.read_text()
    assert assert_done(mapfilter("info", log, "--json")).json["start_utc_s"] == 1_700_000_000
