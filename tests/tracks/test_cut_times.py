"""Rows that have lost the fraction of their second are noted."""

import numpy as np
import pandas as pd
import pytest

import mapfilter as mf
from mapfilter.geodesy import unproject
from mapfilter.tracks.checks.cut_times import cut_times
from mapfilter.tracks.readers.formats import read_recording

START_UTC_S = 1_777_629_600
TIME_S = START_UTC_S + np.arange(600) / 10
CAUSE = "(likely: time stamps cut to whole seconds)"


@pytest.fixture
def noted(tmp_path):
    """Write columns with times of a file's clock, and return what is noted of them."""

    def of(time_s, **columns):
        path = tmp_path / "drive.csv"
        pd.DataFrame({"timestamp": time_s, **columns}).to_csv(path, index=False)
        recording = read_recording(path)
        return [note for note in recording.ignored if CAUSE in note]

    return of


def columns_of(name):
    number = np.arange(len(TIME_S))
    if name == "positions":
        lon, lat = unproject("EPSG:32635", 385_900.0 + 0.5 * number, 6_671_900.0 + 0.3 * number)
        return {"lat": lat.round(8), "lon": lon.round(8)}
    if name == "odometry":
        return {"speed_mps": 5 + np.sin(number / 30), "yaw_rate_radps": np.cos(number / 30)}
    # Equal steps, of which all but one in each second are duplicates.
    return {"step_m": 0.5, "compass_deg": 36.9}


@pytest.mark.parametrize("table", ["positions", "odometry", "motion"])
def test_rows_of_ten_in_a_second_whose_times_are_whole(table, noted):
    columns = columns_of(table)
    assert noted(TIME_S, **columns) == []
    (note,) = noted(np.floor(TIME_S), **columns)
    assert note.startswith(f"{table}: 540 of 600 rows have the time of another one")


def test_a_file_with_a_row_for_each_cell_repeats_its_steps(noted):
    time_s = START_UTC_S + np.repeat(np.arange(60), 4)
    cells = {"role": ["serving", *["neighbour"] * 3] * 60, "level_dbm": -80.0}
    cells["cell"] = [f"C{n}" for n in range(4)] * 60
    assert noted(time_s, step_m=1.4, compass_deg=36.9, **cells) == []


def test_a_log_of_tables_notes_it_too():
    motion = pd.DataFrame({"time_s": np.floor(np.arange(100) / 10), "step_m": 0.5})
    assert any(CAUSE in note for note in mf.make_log("EPSG:32635", motion=motion).notes)
    motion["time_s"] = np.arange(100) / 10
    assert not any(CAUSE in note for note in mf.make_log("EPSG:32635", motion=motion).notes)


@pytest.mark.parametrize(
    "time_s",
    [
        [],
        [np.nan, np.nan],
        np.repeat(np.arange(4.0), 10),
        np.repeat(np.arange(50.0), 2),
        np.repeat(np.arange(50) + 0.5, 10),
        np.r_[np.arange(50.0), np.full(100, 20.0)],
    ],
)
def test_few_times_and_times_with_fractions_are_not_cut(time_s):
    assert cut_times(np.asarray(time_s, dtype=float)) == ""


def test_fixes_of_several_providers_at_one_second_are_not_cut(tmp_path):
    """As of a phone whose fused, satellite and network positions have the same times."""
    providers = (("FLP", 3), ("GPS", 5), ("NLP", 400))
    fixes = [
        f"Fix,{name},60.17{error_m},{24.9 + 1e-5 * second:.6f},20.0,1.0,{error_m},{1000 * time}"
        for second, time in enumerate(range(START_UTC_S, START_UTC_S + 100))
        for name, error_m in providers
    ]
    header = "# Fix,Provider,Latitude,Longitude,Altitude,Speed,Accuracy,(UTC)TimeInMs"
    path = tmp_path / "gnss_log.txt"
    path.write_text("\n".join([header, *fixes]) + "\n")
    recording = read_recording(path)
    assert len(recording.tables["positions"]) == 300
    assert not [note for note in recording.ignored if CAUSE in note]
    thrice = [line for line in fixes if "GPS" in line for _ in range(3)]
    changed = [line.replace("20.0", f"2{k % 3}.0") for k, line in enumerate(thrice)]
    path.write_text("\n".join([header, *changed, *fixes]) + "\n")
    assert [note for note in read_recording(path).ignored if CAUSE in note]
