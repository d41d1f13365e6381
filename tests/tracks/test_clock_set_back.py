"""A clock that is set back while an app logs: its rows are not sorted into each other."""

import numpy as np
import pandas as pd
import pytest

import mapfilter as mf
from mapfilter.tracks.readers.formats import read_recording

COUNT, AT = 400, 200
START_S = 1_777_629_600.0
WALK = pd.DataFrame(
    {
        "time": START_S + np.arange(COUNT),
        "steps": 2 * np.arange(COUNT),
        "compass_deg": 90.0,
        "mcc": 244,
        "mnc": 91,
        "lac": 3021,
        "ci": 300_802 + np.arange(COUNT) // 20,
        "level_dbm": -70.0,
        "latitude": 60.17,
        "longitude": 24.94 + 2e-5 * np.arange(COUNT),
    }
)


def written(tmp_path, time_s, name="walk.csv"):
    path = tmp_path / name
    WALK.iloc[: len(time_s)].assign(time=time_s).to_csv(path, index=False)
    return path


def set_back(back_s, until=COUNT):
    row = np.arange(COUNT)
    return WALK["time"].to_numpy() - np.where((row >= AT) & (row < until), back_s, 0)


def test_rows_before_the_step_are_earlier(tmp_path):
    """Cells of two streets came in turns, and the counter of steps fell from row to row."""
    log = mf.read_log(written(tmp_path, set_back(60)), crs="EPSG:32635")
    assert log.start_utc_s == START_S - 60
    for table in (log.motion, log.radio, log.gnss):
        np.testing.assert_allclose(table["time_s"], np.arange(COUNT), atol=1e-6)
    assert (np.diff(log.gnss["east_m"]) > 0).all()
    assert log.motion["step_m"].iloc[1:].max() == pytest.approx(1.4)
    assert [note for note in log.notes if "goes back" in note] == [
        "walk.csv: time goes back by 59 s after line 201, as when a clock is set back; earlier "
        "rows are taken 60 s earlier"
    ]
    assert not any("times go backwards" in note for note in log.notes)


def test_a_clock_that_is_set_forward_again_was_wrong_in_between(tmp_path):
    log = mf.read_log(written(tmp_path, set_back(60, AT + 100)), crs="EPSG:32635")
    assert log.start_utc_s == START_S
    np.testing.assert_allclose(log.gnss["time_s"], np.arange(COUNT), atol=1e-6)
    assert any("rows until it is set again are taken 60 s later" in note for note in log.notes)


def test_rows_out_of_order_and_second_series_are_sorted(tmp_path):
    late = WALK["time"].to_numpy().copy()
    late[[100, 101]] = late[[101, 100]]
    notes = read_recording(written(tmp_path, late)).notes
    assert "positions: times go backwards in 1 place; sorted" in notes
    twice = np.concatenate([WALK["time"].to_numpy()[::2], WALK["time"].to_numpy()[1::2]])
    notes = read_recording(written(tmp_path, twice)).notes
    assert "positions: times go backwards in 1 place; sorted" in notes


SENSORS = pd.DataFrame({"time": np.arange(5, COUNT), "steps": 2 * np.arange(5, COUNT)})
FIXES = WALK[["time", "latitude", "longitude"]]


@pytest.mark.parametrize("names", [(np.nan, np.nan), ("gps", "network"), ("unit 1", "unit 2")])
def test_series_of_which_the_second_begins_later_are_no_clock(tmp_path, names):
    """The first one was taken minutes earlier."""
    named = isinstance(names[0], str)
    other = FIXES.iloc[5:] if named else SENSORS.assign(time=START_S + SENSORS["time"])
    both = [one.assign(provider=name) for one, name in zip((FIXES, other), names, strict=True)]
    path = tmp_path / "both.csv"
    pd.concat(both).to_csv(path, index=False)
    found = read_recording(path)
    assert not any("clock is set back" in note for note in found.notes)
    assert found.tables["positions"]["time_s"].min() == START_S
    assert found.tables["positions"]["time_s"].max() == START_S + COUNT - 1


def test_exports_that_overlap_are_no_clock(tmp_path):
    """Rows that both have were taken twice, and the first ones a minute earlier."""
    path = tmp_path / "both.csv"
    pd.concat([WALK.iloc[:250], WALK.iloc[190:]]).to_csv(path, index=False)
    found = read_recording(path)
    assert not any("clock is set back" in note for note in found.notes)
    np.testing.assert_allclose(found.tables["positions"]["time_s"], WALK["time"])


def test_a_clock_that_a_first_fix_sets_is_still_one(tmp_path):
    """Rows before it have no positions, but what else the app logs."""
    table = WALK.assign(time=set_back(60), fix=(np.arange(COUNT) >= AT).astype(int))
    table.loc[table.index < AT, ["latitude", "longitude"]] = np.nan
    path = tmp_path / "first.csv"
    table.to_csv(path, index=False)
    assert any("clock is set back" in note for note in read_recording(path).notes)


def test_an_hour_of_local_times_is_a_matter_of_the_zone(tmp_path):
    local = pd.to_datetime(set_back(3600), unit="s").strftime("%Y-%m-%d %H:%M:%S")
    notes = read_recording(written(tmp_path, local)).notes
    assert any("a clock that was set back by an hour: --zone" in note for note in notes)
