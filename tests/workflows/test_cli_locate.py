"""``mapfilter locate``: logs, tables and databases in; a table, figures and a picture out."""

import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from command_line import assert_done, assert_refused, contents, mapfilter
from made_recordings import MADE

from mapfilter.tracks.log import make_log
from mapfilter.tracks.store import write_log

CRS = "EPSG:32635"
_ORIGIN_M = np.array([385_000.0, 6_672_000.0])


def walk(rng, *, cell="", truth=True):
    """A walk among four beacons, which a phone receives by a distance law."""
    beacons = np.array([[0, 0], [60, 5], [10, 55], [55, 60]])
    places = np.cumsum(rng.normal(0, 3, (70, 2)), axis=0) % 60
    distance = np.hypot(*(places[:, None] - beacons).transpose(2, 0, 1)) + 1
    level = np.round(-40 - 28 * np.log10(distance) + rng.normal(0, 2, distance.shape))
    report, beacon = np.nonzero(level > -88)
    radio = pd.DataFrame(
        {
            "time_s": report.astype(float),
            "role": "neighbour",
            "cell": [f"{cell}beacon-{b}" for b in beacon],
            "level_dbm": level[report, beacon],
        }
    )
    at = pd.DataFrame({"time_s": np.arange(70.0)})
    at[["east_m", "north_m"]] = places + _ORIGIN_M
    return make_log(CRS, radio=radio, truth=at if truth else None)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Three surveys, a walk, a walk without truth, and one among other beacons."""
    out = tmp_path_factory.mktemp("beacons")
    rng = np.random.default_rng(2)
    for number in range(3):
        write_log(walk(rng), out / "surveys" / f"survey-{number}")
    write_log(walk(rng), out / "walk")
    write_log(walk(rng, truth=False), out / "blind")
    write_log(walk(rng, cell="other-"), out / "elsewhere")
    return out


def test_a_walk_is_located_by_surveys(folder, tmp_path):
    before = contents(folder)
    outcome = assert_done(
        mapfilter(
            "locate", "--db", folder / "surveys", "--log", folder / "walk",
            "--out", tmp_path / "out", "--json",
        )
    )  # fmt: skip
    found = outcome.json
    assert found["reports"] == found["located"] == found["scored"]
    assert found["error_mean_m"] < found["centroid_mean_m"]
    assert found["validations"][0]["blocks"] == "logs"
    assert found["validations"][0]["folds"] == 3
    assert 0.75 < found["within_95"] <= 1
    table = pd.read_csv(tmp_path / "out" / "positions.csv")
    assert len(table) == found["reports"]
    np.testing.assert_allclose(table["error_m"].mean(), found["error_mean_m"], atol=1e-3)
    assert (table["radius_50_m"] <= table["radius_95_m"]).all()
    assert table["lat_deg"].between(60.1, 60.2).all()
    assert (tmp_path / "out" / "errors.png").stat().st_size > 5000
    assert json.loads((tmp_path / "out" / "figures.json").read_text()) == found
    assert contents(folder) == before


def test_equal_inputs_give_equal_tables(folder, tmp_path):
    for name in ("one", "two"):
        assert_done(
            mapfilter(
                "locate", "--db", folder / "surveys", "--log", folder / "walk",
                "--method", "probabilistic", "--out", tmp_path / name,
            )
        )  # fmt: skip
    one, two = ((tmp_path / name / "positions.csv").read_bytes() for name in ("one", "two"))
    assert one == two


def test_surveys_along_a_line_on_round_metres(tmp_path):
    """A corridor that has no width."""
    rng = np.random.default_rng(3)
    for name in ("surveys/one", "surveys/two", "walk"):
        log = walk(rng)
        on_line = log.truth.assign(east_m=_ORIGIN_M[0])
        write_log(replace(log, truth=on_line), tmp_path / name)
    given = ("--db", tmp_path / "surveys", "--log", tmp_path / "walk", "--out", tmp_path / "out")
    assert assert_done(mapfilter("locate", *given, "--json")).json["located"] > 60


def test_without_truth_there_is_no_score_and_no_picture(folder, tmp_path):
    outcome = assert_done(
        mapfilter(
            "locate", "--db", folder / "surveys", "--log", folder / "blind",
            "--method", "knn", "--out", tmp_path, "--json",
        )
    )  # fmt: skip
    assert "error_mean_m" not in outcome.json
    assert outcome.json["centroid_mean_m"] is None
    assert not (tmp_path / "errors.png").exists()


def test_a_log_without_reports_says_so(folder, tmp_path):
    """What followed the colon was empty."""
    motion = pd.DataFrame({"time_s": np.arange(9.0), "step_m": 1.0, "heading_rad": 0.0})
    write_log(make_log(CRS, motion=motion), tmp_path / "log")
    given = ("--db", folder / "surveys", "--log", tmp_path / "log", "--out", tmp_path / "out")
    outcome = mapfilter("locate", *given)
    assert outcome.code == 3
    assert "nothing is located: the log has no report of a cell" in outcome.err


def test_a_picture_of_an_older_run_does_not_stay(folder, tmp_path):
    (tmp_path / "mine.txt").write_text("mine")
    given = ["--db", folder / "surveys", "--out", tmp_path, "--method", "centroid", "--json"]
    for log, files in (
        ("walk", ["errors.png", "figures.json", "mine.txt", "positions.csv"]),
        ("blind", ["figures.json", "mine.txt", "positions.csv"]),
    ):
        outcome = assert_done(mapfilter("locate", *given, "--log", folder / log))
        assert sorted(path.name for path in tmp_path.iterdir()) == files
        told = {path.rpartition("/")[2] for path in outcome.json["outputs"]}
        assert told == {*files} - {"mine.txt"}


def test_several_logs_are_told_apart(folder, tmp_path):
    assert_done(
        mapfilter(
            "locate", "--db", folder / "walk", "--log", folder / "surveys",
            "--method", "centroid", "--out", tmp_path,
        )
    )  # fmt: skip
    table = pd.read_csv(tmp_path / "positions.csv")
    assert sorted(table["log"].unique()) == ["survey-0", "survey-1", "survey-2"]


def test_strangers_are_counted_and_not_located(folder, tmp_path):
    outcome = mapfilter(
        "locate", "--db", folder / "surveys", "--log", folder / "elsewhere",
        "--method", "knn", "--out", tmp_path, "--json",
    )  # fmt: skip
    assert outcome.code == 3
    assert outcome.err == "mapfilter: nothing is located: no transmitter of the database\n"
    assert outcome.json["located"] == 0
    assert outcome.json["not_located"] == {
        "no transmitter of the database": outcome.json["reports"]
    }


def test_a_table_is_located_by_a_table(tmp_path):
    rng = np.random.default_rng(0)
    for name in ("known", "asked"):
        places = rng.uniform(0, 30, (90, 2))
        level = -50 - 25 * np.log10(1 + np.hypot(*(places - [[0, 0]]).T)), -50 - places[:, 0]
        rows = pd.DataFrame(np.round(np.column_stack([*level, places]), 1))
        rows.columns = ["ap-1", "ap-2", "x", "y"]
        rows.to_csv(tmp_path / f"{name}.csv", index=False)
    outcome = assert_done(
        mapfilter(
            "locate", "--db", tmp_path / "known.csv", "--log", tmp_path / "asked.csv",
            "--crs", CRS, "--out", tmp_path / "out", "--json",
        )
    )  # fmt: skip
    assert outcome.json["error_median_m"] < 5


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--method", "best"], "probabilistic"),
        (["--level-error", "0"], "--level-error"),
    ],
)
def test_wrong_options_are_refused(folder, tmp_path, options, told):
    given = ["--db", folder / "surveys", "--log", folder / "walk", "--out", tmp_path / "out"]
    assert_refused(mapfilter("locate", *given, *options), told)
    assert not (tmp_path / "out" / "positions.csv").exists()


def test_faults_of_both_inputs_are_reported_together(tmp_path):
    outcome = mapfilter("locate", "--db", tmp_path / "no-db", "--log", tmp_path / "no-log")
    assert_refused(outcome, "no-db", "no-log")


def test_a_database_that_does_not_exist_is_told_as_one(folder, tmp_path):
    told = f"{tmp_path / 'none'}: expected a radio-route database, or logs or a table of reports"
    options = ("--db", str(tmp_path / "none"), "--log", str(folder / "walk"))
    assert_refused(mapfilter("locate", *options, "--out", str(tmp_path / "out")), told)


def test_a_log_without_truth_is_no_database(folder):
    outcome = mapfilter("locate", "--db", folder / "blind", "--log", folder / "walk")
    assert_refused(outcome, "reports with positions")


UPLOAD = "mcc,mnc,lac,cellid,lat,lon,signal,measured_at,rating,speed,direction,act,ta,psc,tac,pci"


def test_recordings_are_database_and_log_as_they_are(tmp_path):
    rng = np.random.default_rng(0)
    for name in ("db/monday", "db/tuesday", "walk"):
        place = np.abs(np.cumsum(rng.normal(0, 12, 200))) % 900
        level = np.round(-65 - 0.03 * place + rng.normal(0, 2, 200))
        rows = [
            f"302,720,1,{1000 + (at > 450)},{45 + at / 111_200:.7f},-75.7,{dbm:.0f},"
            f"{1_600_000_000_000 + 5000 * i},8,1,0,LTE,{int(at / 78)},,1,"
            for i, (at, dbm) in enumerate(zip(place, level, strict=True))
        ]
        file = tmp_path / f"{name}.csv"
        file.parent.mkdir(exist_ok=True)
        file.write_text("\n".join([UPLOAD, *rows]) + "\n")
    given = ["--db", tmp_path / "db", "--log", tmp_path / "walk.csv", "--out", tmp_path / "out"]
    found = assert_done(mapfilter("locate", *given, "--method", "probabilistic", "--json")).json
    assert found["located"] == 200
    assert found["validations"][0]["folds"] == 2
    # A step of the timing advance is 78 m of the street.
    assert found["error_median_m"] < 40 < found["centroid_median_m"]
    assert any("GNSS" in note for note in found["notes"])


def test_a_table_with_times_is_no_recording(tmp_path):
    rng = np.random.default_rng(0)
    names = ["WAP001", "WAP002", "LONGITUDE", "LATITUDE", "FLOOR", "TIMESTAMP"]
    for name in ("training", "validation"):
        at = rng.uniform(0, 30, 60)
        columns = [-60 - at, -90 + at, at - 7500, at + 4.86e6, 0 * at, 1.37e9 + at]
        rows = pd.DataFrame(np.round(np.column_stack(columns), 2), columns=names)
        rows.to_csv(tmp_path / f"{name}.csv", index=False)
    given = ["--db", tmp_path / "training.csv", "--log", tmp_path / "validation.csv"]
    found = assert_done(mapfilter("locate", *given, "--out", tmp_path / "out", "--json")).json
    assert found["transmitters"] == 2
    assert found["error_median_m"] < 3


def test_recordings_with_sensors_make_no_steps(tmp_path):
    file, text = MADE["indoor"]
    for number in range(3):
        (tmp_path / f"{number}-{file}").write_text(text)
    given = ("--db", tmp_path, "--log", tmp_path / f"0-{file}", "--out", tmp_path / "out", "--json")
    notes = " ".join(assert_done(mapfilter("locate", *given)).json["notes"])
    assert "local" in notes or "a frame of its own" in notes
    assert "steps" not in notes


def write_upload(path, zone_h=0, *, placed=True):
    """Write an upload of a walk along a street, in local times without a zone or in UTC."""
    seconds = np.arange(200) * 5
    rng = np.random.default_rng(0)
    place = np.abs(np.cumsum(rng.normal(0, 12, 200))) % 900
    time = pd.to_datetime(1_600_000_000 + 3600 * zone_h + seconds, unit="s")
    table = pd.DataFrame({"time": time.strftime("%Y-%m-%d %H:%M:%S") + "Z" * (not zone_h)})
    if placed:
        table = table.assign(lat=(45 + place / 111_200).round(7), lon=-75.7)
    else:
        table = table.assign(cell=np.where(place > 450, "B", "A"), role="serving")
        table["level_dbm"] = np.round(-65 - 0.03 * place + rng.normal(0, 2, 200))
    table.to_csv(path, index=False)
    return path


def test_a_recording_is_scored_by_another_one(tmp_path):
    cells = write_upload(tmp_path / "cells.csv", 2, placed=False)
    places = write_upload(tmp_path / "gps.csv")
    made = mapfilter(
        "convert", cells, "--truth", places, "--zone", "+02:00", "--out", tmp_path / "db"
    )
    assert_done(made)
    given = ["--db", tmp_path / "db", "--log", cells, "--out", tmp_path / "out", "--json"]
    assert "scored" not in assert_done(mapfilter("locate", *given)).json
    found = assert_done(mapfilter("locate", *given, "--truth", places, "--zone", "+02:00")).json
    assert found["scored"] == found["located"] == 200
    assert not any("no zone" in note for note in found["notes"])


def test_a_clock_of_the_truth_is_set_by_an_offset(tmp_path):
    cells = write_upload(tmp_path / "cells.csv", 2, placed=False)
    places = write_upload(tmp_path / "gps.csv")
    zone = ["--zone", "+02:00"]
    assert_done(mapfilter("convert", cells, "--truth", places, *zone, "--out", tmp_path / "db"))
    late = pd.read_csv(places)
    late["time"] = pd.to_datetime(late["time"]) + pd.Timedelta("300 s")
    late.to_csv(tmp_path / "late.csv", index=False)
    given = ["--db", tmp_path / "db", "--log", cells, "--out", tmp_path / "out", *zone, "--json"]
    right = assert_done(mapfilter("locate", *given, "--truth", places)).json
    given += ["--truth", tmp_path / "late.csv"]
    mended = assert_done(mapfilter("locate", *given, "--offset", "late.csv=-300")).json
    assert mended["error_mean_m"] == right["error_mean_m"]
    wrong = mapfilter("locate", *given, "--offset", "lat.csv=-300")
    assert_refused(wrong, "--offset: expected the name of one of the recordings (cells.csv, late.")
    assert_refused(mapfilter("locate", *given, "--offset", "late.csv=soon"), "1 number")


def test_a_track_log_takes_no_offset(folder, tmp_path):
    told = "a track log has the times of its tables"
    for log in ("walk", "surveys"):
        given = ["--db", folder / "surveys", "--out", tmp_path / "out", "--log", folder / log]
        outcome = mapfilter("locate", *given, "--offset", "walk=5")
        assert_refused(
            outcome, "--offset: expected the name of one of the recordings, found 'walk'"
        )
        assert told in outcome.err
        assert "parquet" not in outcome.err


def test_truth_and_zone_are_those_of_one_recording(folder, tmp_path):
    places = write_upload(tmp_path / "gps.csv")
    given = ["--db", folder / "surveys", "--out", tmp_path / "out", "--truth", places]
    for log, got in (("walk", "a track log"), ("surveys", "3 journeys")):
        outcome = mapfilter("locate", *given, "--log", folder / log)
        assert_refused(outcome, f"--truth of {folder / log}: expected a recording of one journey")
        assert_refused(outcome, f"found {got}")
