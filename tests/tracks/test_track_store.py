"""Logs on disk: round trips, hand-made folders, damage."""

import json
import os
import shutil
from dataclasses import replace

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapfilter.errors import InputError, OutputError, StoreError
from mapfilter.tracks.imu_noise import ImuNoise
from mapfilter.tracks.kinds import leave_out
from mapfilter.tracks.log import make_log
from mapfilter.tracks.log_folders import is_log, list_logs
from mapfilter.tracks.schema import MISSING_SIGNS, TABLES
from mapfilter.tracks.store import read_log, write_log

CRS = "EPSG:32629"


@pytest.fixture
def log():
    return make_log(
        CRS,
        motion=pd.DataFrame(
            {"time_s": [0.1 + 0.2, 2.0], "step_m": [1 / 3, np.nan], "heading_rad": [0.1, -3.0]}
        ),
        radio=pd.DataFrame(
            {
                "time_s": [1.0, 1.0, 2.0],
                "role": ["serving", "neighbour", "serving"],
                "cell": ["NA", None, 'ü, "quoted"/..'],
                "arfcn": [512, None, 513],
                "bsic": [0, 63, None],
                "level_dbm": [-110.5, np.nan, -47.5],
                "censored": [-1, 0, 1],
            }
        ),
        truth=pd.DataFrame(
            {
                "time_s": [0.0, 1.0],
                "east_m": [531000.1, 531001.2],
                "north_m": [4555000.0, 4555000.7],
                "way_id": pd.array([1234567890123, None], dtype="Int64"),
            }
        ),
        start_utc_s=1_190_764_800.25,
        notes=["made by hand"],
    )


def assert_same(a, b):
    assert (a.crs, a.notes, a.imu) == (b.crs, b.notes, b.imu)
    np.testing.assert_equal(a.start_utc_s, b.start_utc_s)
    for table in TABLES:
        pd.testing.assert_frame_equal(getattr(a, table), getattr(b, table), check_exact=True)


@pytest.mark.parametrize("form", ["parquet", "csv"])
def test_round_trip(log, tmp_path, form):
    write_log(log, tmp_path / "walk", form)
    assert_same(read_log(tmp_path / "walk"), log)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["walk"]


def test_paths_may_be_text(log, tmp_path):
    write_log(log, str(tmp_path / "walk"))
    assert_same(read_log(str(tmp_path / "walk")), log)


@pytest.mark.parametrize("form", ["parquet", "csv"])
def test_equal_logs_give_equal_bytes(log, tmp_path, form):
    write_log(log, tmp_path / "a", form)
    write_log(read_log(tmp_path / "a"), tmp_path / "b", form)
    for file in (tmp_path / "a").iterdir():
        assert file.read_bytes() == (tmp_path / "b" / file.name).read_bytes()


times = st.floats(-4, 4)
finite = st.floats(-1e6, 1e6).filter(lambda value: value not in MISSING_SIGNS)


@settings(max_examples=25, deadline=None)
@given(st.lists(st.tuples(times, finite, finite | st.just(np.nan)), max_size=5))
def test_round_trip_of_any_numbers(tmp_path_factory, rows):
    folder = tmp_path_factory.mktemp("logs")
    table = pd.DataFrame(rows, columns=["time_s", "step_m", "turn_rad"], dtype=float)
    table["turn_rad"] = table["turn_rad"] % 6
    log = make_log(CRS, motion=table)
    for form in ("parquet", "csv"):
        write_log(log, folder / form, form)
        assert_same(read_log(folder / form), log)


def test_a_hand_made_folder_needs_only_the_crs(tmp_path):
    (tmp_path / "log.json").write_text('{"crs": "EPSG:32629"}')
    (tmp_path / "motion.csv").write_text("\ufefftime_s,step_m\n2,1.5\n1,1.4\n", encoding="utf-8")
    log = read_log(tmp_path)
    assert log.motion["step_m"].tolist() == [1.4, 1.5]
    assert len(log.radio) == 0
    assert log.notes == (f"{tmp_path / 'motion.csv'}: out of order in 1 place, sorted by time",)


@pytest.mark.parametrize("form", ["parquet", "csv"])
def test_an_unknown_start_is_null_and_reads_back(log, tmp_path, form):
    unknown = replace(log, start_utc_s=float("nan"))
    write_log(unknown, tmp_path / "walk", form)
    assert json.loads((tmp_path / "walk" / "log.json").read_text())["start_utc_s"] is None
    assert_same(read_log(tmp_path / "walk"), unknown)


def test_a_head_without_a_start_has_an_unknown_one(tmp_path):
    (tmp_path / "log.json").write_text('{"crs": "EPSG:32629"}')
    assert np.isnan(read_log(tmp_path).start_utc_s)


@pytest.mark.parametrize("start", [2**70, "1" + "0" * 400, -9e10, 3e11, "1e999", "[1]", '"now"'])
def test_starts_that_are_no_date(tmp_path, start):
    (tmp_path / "log.json").write_text(f'{{"crs": "EPSG:32629", "start_utc_s": {start}}}')
    with pytest.raises(InputError, match="start_utc_s: expected UTC seconds"):
        read_log(tmp_path)


def test_faults_name_file_and_row(tmp_path):
    (tmp_path / "log.json").write_text("{}")
    (tmp_path / "motion.csv").write_text("time_s,step_m\n1,1.4\nsoon,1.5\n")
    (tmp_path / "truth.csv").write_text("time_s,east_m,north_m\n1,531000,\n")
    with pytest.raises(InputError) as caught:
        read_log(tmp_path)
    message = str(caught.value)
    assert (
        f"{tmp_path / 'log.json'}, crs: expected a projected CRS in metres, found none" in message
    )
    assert f"{tmp_path / 'motion.csv'} row 3, time_s: expected seconds, found soon" in message
    assert (
        f"{tmp_path / 'truth.csv'} row 2, north_m: expected metres north, found nothing" in message
    )


@pytest.mark.parametrize("content", [b"", b"time_s,step_m\n1,2,3,4\n", b"\xff\xfe\x00", b'a,"b\n1'])
def test_unreadable_csv(tmp_path, content):
    (tmp_path / "log.json").write_text('{"crs": "EPSG:32629"}')
    (tmp_path / "motion.csv").write_bytes(content)
    with pytest.raises(InputError, match=r"motion\.csv"):
        read_log(tmp_path)


def test_parquet_texts_that_are_no_utf8_are_refused(tmp_path):
    table = pa.table({"time_s": [0.0], "cell": ["abcdef"], "level_dbm": [-80.0]})
    (tmp_path / "log.json").write_text('{"crs": "EPSG:32635"}')
    path = tmp_path / "radio.parquet"
    pq.write_table(table, path, compression="none", use_dictionary=False)
    path.write_bytes(path.read_bytes().replace(b"abcdef", b"\xbcbcdef"))
    with pytest.raises(InputError, match=r"radio\.parquet.*readable table.*UTF8"):
        read_log(tmp_path)


@pytest.mark.parametrize("content", [b"", b"PAR1", b"no parquet at all"])
def test_unreadable_parquet(tmp_path, content):
    (tmp_path / "log.json").write_text('{"crs": "EPSG:32629"}')
    (tmp_path / "gnss.parquet").write_bytes(content)
    with pytest.raises(InputError, match=r"gnss\.parquet.*cut off"):
        read_log(tmp_path)


def test_two_files_of_one_table(tmp_path, log):
    write_log(log, tmp_path / "walk")
    (tmp_path / "walk" / "log.json").write_text('{"crs": "EPSG:32629"}')
    (tmp_path / "walk" / "motion.csv").write_text("time_s\n1\n")
    with pytest.raises(InputError, match="both Parquet and CSV"):
        read_log(tmp_path / "walk")


@pytest.mark.parametrize("kind", ["link", "device", "pipe", "folder"])
@pytest.mark.parametrize("name", ["motion.csv", "radio.csv", "almanac.txt"])
def test_a_table_that_is_no_file_is_refused_and_not_left_out(tmp_path, log, name, kind):
    write_log(log, tmp_path / "walk", "csv")
    (tmp_path / "walk" / "log.json").write_text('{"crs": "EPSG:32629"}')
    path = tmp_path / "walk" / name
    path.unlink(missing_ok=True)
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "folder":
        path.mkdir()
    else:
        path.symlink_to("/dev/zero" if kind == "device" else tmp_path / "gone")
    with pytest.raises(InputError, match=f"{name}: expected a readable file"):
        read_log(tmp_path / "walk")


def damaged(log, folder, change):
    write_log(log, folder, "csv")
    head = json.loads((folder / "log.json").read_text())
    change(head)
    (folder / "log.json").write_text(json.dumps(head))


def test_a_newer_version_is_refused(log, tmp_path):
    damaged(log, tmp_path / "walk", lambda head: head.update(version=2))
    with pytest.raises(StoreError, match="newer mapfilter"):
        read_log(tmp_path / "walk")


@pytest.mark.parametrize("version", [None, 0, "1", True])
def test_a_version_that_is_no_newer_one_is_not_called_newer(log, tmp_path, version):
    damaged(log, tmp_path / "walk", lambda head: head.update(version=version))
    with pytest.raises(StoreError, match=r"version 1, found .*edited or damaged"):
        read_log(tmp_path / "walk")


def test_another_format_is_refused(log, tmp_path):
    damaged(log, tmp_path / "walk", lambda head: head.update(format="mapfilter estimate"))
    with pytest.raises(StoreError, match="mapfilter track log"):
        read_log(tmp_path / "walk")


def test_strange_heads_are_refused(log, tmp_path):
    damaged(log, tmp_path / "walk", lambda head: head.update(notes="one", crss="EPSG:32629"))
    with pytest.raises(InputError, match="unknown key") as caught:
        read_log(tmp_path / "walk")
    assert "a list of texts" in str(caught.value)


@pytest.mark.parametrize("parts", [None, 3, ["motion.csv"], [{"path": "../motion.csv"}]])
def test_parts_must_be_tables_of_the_folder(log, tmp_path, parts):
    damaged(log, tmp_path / "walk", lambda head: head.update(parts=parts))
    with pytest.raises(StoreError, match="tables of a log"):
        read_log(tmp_path / "walk")


@pytest.mark.parametrize("form", ["parquet", "csv"])
def test_cut_off_missing_and_changed_parts_are_all_named(log, tmp_path, form):
    folder = tmp_path / "walk"
    write_log(log, folder, form)
    radio, motion = folder / f"radio.{form}", folder / f"motion.{form}"
    radio.write_bytes(radio.read_bytes()[:-3])
    content = bytearray(motion.read_bytes())
    content[-1] ^= 1
    motion.write_bytes(bytes(content))
    size = (folder / f"truth.{form}").stat().st_size
    (folder / f"truth.{form}").unlink()
    with pytest.raises(StoreError) as caught:
        read_log(folder)
    message = str(caught.value)
    assert f"radio.{form}" in message
    assert "likely: cut off" in message
    assert f"motion.{form}: expected SHA-256" in message
    assert f"truth.{form}: expected a file of {size} bytes, found no such file" in message


def test_a_cut_off_head(log, tmp_path):
    write_log(log, tmp_path / "walk")
    head = tmp_path / "walk" / "log.json"
    head.write_bytes(head.read_bytes()[:40])
    with pytest.raises(StoreError, match=r"log\.json"):
        read_log(tmp_path / "walk")


def test_finding_logs(log, tmp_path):
    for name in ("b", "a"):
        write_log(log, tmp_path / name)
    (tmp_path / "c").mkdir()
    assert list_logs(tmp_path) == [tmp_path / "a", tmp_path / "b"]
    assert list_logs(tmp_path / "a") == [tmp_path / "a"]
    assert is_log(tmp_path / "a")
    assert not is_log(tmp_path)
    assert list_logs(str(tmp_path)) == list_logs(tmp_path)
    assert is_log(str(tmp_path / "a"))
    for path in (tmp_path / "c", tmp_path / "nowhere"):
        with pytest.raises(InputError, match="track log"):
            list_logs(path)
        with pytest.raises(InputError, match="track log"):
            read_log(path)


def test_files_beside_a_log_and_logs_made_by_hand_are_not_replaced(log, tmp_path):
    folder = tmp_path / "walk"
    write_log(log, folder, "csv")
    (folder / "notes.txt").write_text("mine")
    with pytest.raises(OutputError, match=r"other files \(notes\.txt\)"):
        write_log(log, folder)
    assert (folder / "notes.txt").read_text() == "mine"
    (folder / "notes.txt").unlink()
    (folder / "log.json").write_text('{"crs": "EPSG:32629"}')
    with pytest.raises(OutputError, match=r"gnss\.csv, log\.json"):
        write_log(log, folder)
    assert len(read_log(folder).motion) == 2


def test_writing_replaces_a_log_and_nothing_else(log, tmp_path):
    write_log(log, tmp_path / "walk", "csv")
    write_log(log, tmp_path / "walk", "parquet")
    assert not (tmp_path / "walk" / "motion.csv").exists()
    (tmp_path / "photos").mkdir()
    (tmp_path / "photos" / "cat.jpg").write_bytes(b"cat")
    with pytest.raises(OutputError, match=r"other files \(cat\.jpg\)"):
        write_log(log, tmp_path / "photos")
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError):
        write_log(log, tmp_path / "file")
    assert (tmp_path / "photos" / "cat.jpg").read_bytes() == b"cat"


def test_a_log_can_be_moved(log, tmp_path):
    write_log(log, tmp_path / "a")
    shutil.move(tmp_path / "a", tmp_path / "b")
    assert_same(read_log(tmp_path / "b"), log)


@pytest.mark.parametrize("form", ["parquet", "csv"])
def test_errors_of_motion_travel_with_a_log(log, tmp_path, form):
    measured = ImuNoise(
        period_s=0.5,
        sigma_trans_m=0.07,
        bias_sd_deg=8.5,
        scale=0.1,
        turns="gyro",
        heading_correlation_s=2.5,
        gyro_bias_deg_per_s=0.02,
    )
    write_log(replace(log, imu=measured), tmp_path / "log", form)
    back = read_log(tmp_path / "log")
    assert back.imu == measured
    assert leave_out(back, ["radio"]).imu == measured


def test_a_log_without_errors_of_motion_states_none(log, tmp_path):
    write_log(log, tmp_path / "log")
    assert "imu" not in json.loads((tmp_path / "log" / "log.json").read_text())
    assert read_log(tmp_path / "log").imu is None


def test_whose_motion_it_is_travels_with_the_log(log, tmp_path):
    write_log(log, tmp_path / "unknown")
    assert "vehicle" not in json.loads((tmp_path / "unknown" / "log.json").read_text())
    assert read_log(tmp_path / "unknown").vehicle is None
    for vehicle in (True, False):
        write_log(replace(log, vehicle=vehicle), tmp_path / "log")
        assert leave_out(read_log(tmp_path / "log"), ["radio"]).vehicle is vehicle
    (tmp_path / "log.json").write_text(json.dumps({"crs": CRS, "vehicle": "yes"}))
    with pytest.raises(InputError, match="vehicle: expected true, false or null, found 'yes'"):
        read_log(tmp_path)


@pytest.mark.parametrize(
    ("imu", "named"),
    [
        ({"sigma_trans_m": -1}, "imu.sigma_trans_m: expected a number >= 0, found -1"),
        ({"sigma_trans": 1}, "imu.sigma_trans: expected one of period_s.*sigma_trans_m"),
        ({"turns": "wheels"}, "imu.turns: expected"),
        ([0.2, 3.0], "imu: expected errors of dead reckoning by their names"),
        ({"scale": float("nan")}, "imu.scale"),
        ({"period_s": 0, "bias_sd_deg": 400}, "(?s)imu.period_s.*imu.bias_sd_deg"),
    ],
)
def test_wrong_errors_of_motion_are_refused(tmp_path, imu, named):
    (tmp_path / "log.json").write_text(json.dumps({"crs": CRS, "imu": imu}))
    with pytest.raises(InputError, match=named):
        read_log(tmp_path)
