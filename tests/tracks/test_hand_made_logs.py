"""Logs that people make by hand: other separators, stray files, steps that are none."""

import numpy as np
import pandas as pd
import pytest

from mapfilter.errors import InputError
from mapfilter.tracks.log import make_log
from mapfilter.tracks.log_folders import list_logs
from mapfilter.tracks.schema import TABLES
from mapfilter.tracks.store import read_log, write_log

CRS = "EPSG:32629"


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "walk").mkdir()
    (tmp_path / "walk" / "log.json").write_text('{"crs": "EPSG:32629"}')
    return tmp_path / "walk"


def refusal_of(read, *given, **more):
    with pytest.raises(InputError) as caught:
        read(*given, **more)
    return str(caught.value)


@pytest.mark.parametrize(
    "text",
    [
        "time_s,step_m\n1.5,1.4\n2.5,-0.25\n",
        "time_s;step_m\n1,5;1,4\n2,5;-0,25\n",
        "time_s;step_m\r\n1.5;1.4\r\n2.5;-.25\r\n",
        "time_s\tstep_m\n1,5\t1,4\n2,5\t-2,5e-1\n",
        "\ufeff\n time_s , step_m\n\n1.5,1.4\n\n2.5,-0.25\n\n",
    ],
)
def test_separators_and_decimal_commas(text, folder):
    (folder / "motion.csv").write_text(text, encoding="utf-8", newline="")
    log = read_log(folder)
    assert log.motion["time_s"].tolist() == [1.5, 2.5]
    assert log.motion["step_m"].tolist() == [1.4, -0.25]
    assert log.notes == ()


def test_commas_in_the_names_of_cells_stay(folder):
    (folder / "radio.csv").write_text("time_s;role;cell;level_dbm\n0,5;serving;1,5;-80,5\n")
    radio = read_log(folder).radio
    assert radio["cell"].tolist() == ["1,5"]
    assert radio["level_dbm"].tolist() == [-80.5]


def test_decimal_commas_between_commas_are_told(folder):
    (folder / "motion.csv").write_text("time_s,step_m\n1,0,1,4\n")
    assert "decimal commas between commas" in refusal_of(read_log, folder)


def test_rows_are_called_by_their_line_in_csv_and_counted_in_parquet(folder):
    (folder / "motion.csv").write_text("\ntime_s,step_m\n\n1,1.4\nsoon,1.4\n")
    assert "motion.csv row 5, time_s: expected seconds, found soon" in refusal_of(read_log, folder)
    (folder / "motion.csv").unlink()
    pd.DataFrame({"time_s": [0.0, np.inf]}).to_parquet(folder / "motion.parquet")
    assert "motion.parquet row 2, time_s: expected seconds, found inf" in refusal_of(
        read_log, folder
    )


def test_a_row_that_is_cut_off_is_told(folder):
    (folder / "motion.csv").write_text("time_s,step_m,heading_rad\n\n1,1.4,0\n2,1.")
    log = read_log(folder)
    how = "cut off within the row (without a line end), left out"
    assert log.notes == (f"{folder / 'motion.csv'} row 4: {how}",)
    assert log.motion["time_s"].tolist() == [1.0]
    (folder / "motion.csv").write_text("time_s,step_m,heading_rad\n1\n2,1.4\n3,1.4,0")
    assert read_log(folder).notes == ()


@pytest.mark.parametrize("name", ["raido.csv", "Radio.csv", "radio.CSV", "radio.txt", "radios.csv"])
def test_a_name_near_that_of_a_missing_table_is_refused(name, folder):
    (folder / name).write_text("time_s,role\n1,serving\n")
    told = refusal_of(read_log, folder)
    assert told.startswith(f"{folder / name}: expected tables called {', '.join(TABLES)}")
    assert told.endswith(f"found {name} (likely: radio.csv)")


def test_other_files_are_told_and_hidden_ones_are_not(folder):
    (folder / "radio.csv").write_text("time_s,role\n1,serving\n")
    for name in ("radio-old.csv", "weather.xlsx", ".DS_Store"):
        (folder / name).write_text("")
    assert read_log(folder).notes == tuple(
        f"{folder / name}: not a table of a log, not read"
        for name in ("radio-old.csv", "weather.xlsx")
    )


def test_tables_without_a_head(folder):
    (folder / "motion.csv").write_text("time_s\n1\n")
    (folder / "log.json").unlink()
    for read, path in ((read_log, folder), (list_logs, folder), (list_logs, folder.parent)):
        told = refusal_of(read, path)
        assert f"{folder}: expected log.json with the CRS" in told
        assert "found motion.csv without a log.json beside it" in told
        assert "or recordings: name the files with --log" in told


def test_a_table_in_place_of_its_folder(folder):
    (folder / "motion.csv").write_text("time_s\n1\n")
    for read in (read_log, list_logs):
        told = refusal_of(read, folder / "motion.csv")
        assert "found a file (likely: name the folder that it lies in)" in told


@pytest.mark.parametrize(
    ("table", "column"),
    [("motion", "step_m"), ("motion", "heading_rad"), ("radio", "level_dbm"), ("radio", "bsic")],
)
def test_signs_for_missing_values(table, column):
    rows = pd.DataFrame({"time_s": [1.0], "role": ["serving"], column: ["-9999"]})
    told = refusal_of(
        make_log, CRS, **{table: rows if table == "radio" else rows.drop(columns="role")}
    )
    assert f"{table} row 1, {column}: expected" in told
    assert "found -9999 (likely: a sign for a missing value; leave the field empty)" in told


def walk(step_m, seconds=100):
    time_s = np.arange(1.0, seconds + 1)
    step_m = np.broadcast_to(step_m, time_s.shape)
    return pd.DataFrame({"time_s": time_s, "step_m": step_m, "heading_rad": 0.0})


def track(length_m, seconds=100):
    east_m = 531000 + np.linspace(0, length_m, seconds)
    time_s = np.arange(1.0, seconds + 1)
    return pd.DataFrame({"time_s": time_s, "east_m": east_m, "north_m": 4555000.0})


@pytest.mark.parametrize(
    ("step_m", "hint"),
    [
        (np.cumsum(np.full(100, 1.4)), "(likely: distance since the start; give its differences"),
        (np.arange(2.0, 202.0, 2.0), "(likely: a counter of steps, --column steps=COLUMN"),
        (1400.0, "centimetres or millimetres given for metres"),
        (-1.4, "a sign the other way round"),
        (0.0014, "kilometres given for metres"),
    ],
)
def test_steps_that_cannot_be(step_m, hint):
    told = refusal_of(make_log, CRS, motion=walk(step_m), truth=track(140))
    assert "motion, step_m: expected metres moved in each interval" in told
    assert hint in told


def test_steps_that_are_odd_but_can_be():
    log = make_log(CRS, motion=walk(0.0014))
    told = "motion, step_m: only 0.14 m in 99 s; kilometres for metres?"
    assert log.notes == (told,)


@pytest.mark.parametrize(
    "step_m",
    [
        0.0,
        1.4,
        80.0,
        np.minimum(np.arange(100) * 0.5, 14.0),
        1.4 + np.random.default_rng(0).normal(0, 2, 100),
        np.random.default_rng(0).normal(0, 0.2, 100),
    ],
    ids=["parked", "walk", "fast train", "car", "noisy walk", "noise"],
)
def test_steps_that_are_let_pass(step_m):
    assert make_log(CRS, motion=walk(step_m)).notes == ()


def test_a_few_steps_are_never_judged():
    assert len(make_log(CRS, motion=walk(1e5, 9)).motion) == 9


def test_a_table_that_ends_early_is_told_once_however_often_it_is_stored(tmp_path):
    heard = pd.DataFrame({"time_s": np.arange(1000.0), "role": "serving"})
    log = make_log(CRS, motion=walk(1.4), radio=heard)
    assert log.notes == ("motion: ends 899 s before radio, as if cut off",)
    write_log(log, tmp_path / "walk")
    assert read_log(tmp_path / "walk").notes == log.notes
    assert make_log(CRS, motion=walk(1.4), radio=heard[:130]).notes == ()


def test_neighbours_without_any_level_are_noted_once(tmp_path):
    heard = pd.DataFrame({"time_s": np.repeat(np.arange(6.0), 3), "arfcn": [1, 2, 3] * 6})
    heard["role"] = ["serving", "neighbour", "neighbour"] * 6
    heard["level_dbm"] = np.nan
    log = make_log(CRS, radio=heard)
    assert len(log.notes) == 1
    assert log.notes[0].startswith("radio: no row has a level (level_dbm); 12 neighbours are of")
    write_log(log, tmp_path / "walk")
    assert read_log(tmp_path / "walk").notes == log.notes
    heard.loc[17, "level_dbm"] = -80.0
    assert make_log(CRS, radio=heard).notes == ()
    assert make_log(CRS, radio=heard.iloc[:12]).notes == ()
    alone = heard.assign(role="serving", level_dbm=np.nan)
    assert make_log(CRS, radio=alone).notes == ()


@pytest.mark.parametrize("columns", [{}, {"turn_rad": np.append(0.1, np.full(99, np.nan))}])
def test_steps_without_any_direction_are_noted_once(columns, tmp_path):
    log = make_log(CRS, motion=walk(1.4).drop(columns="heading_rad").assign(**columns))
    (note,) = log.notes
    assert note.startswith("motion: no headings and no turns (heading_rad or turn_rad): ")
    write_log(log, tmp_path / "log")
    assert read_log(tmp_path / "log").notes == (note,)


@pytest.mark.parametrize("columns", [{"turn_rad": 0.0}, {"heading_rad": 1.0}, {"step_m": 0.0}])
def test_a_direction_or_rest_needs_no_note_on_directions(columns):
    motion = walk(1.4).drop(columns="heading_rad").assign(**columns)
    assert make_log(CRS, motion=motion).notes == ()
