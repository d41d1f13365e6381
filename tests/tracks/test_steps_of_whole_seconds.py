"""Rows of single steps whose times are whole seconds: those of one second are no repetitions."""

import numpy as np
import pandas as pd
import pytest

from mapfilter.tracks.readers.formats import read_recording

KEPT = "of the same second, as stamps are whole seconds: kept, and spread over it"
SECONDS = 300


def seconds_of(cadence_hz):
    """Return the second of each step of a walker."""
    return np.floor(np.arange(1, int(SECONDS * cadence_hz) + 1) / cadence_hz + 1e-9)


def read(folder, second, **columns):
    path = folder / "walk.csv"
    pd.DataFrame({"time": 1.7e9 + second, **columns}).to_csv(path, index=False)
    return read_recording(path)


@pytest.mark.parametrize("cadence_hz", [1.7, 1.9, 1.98, 2.0, 2.02, 2.1, 2.3])
def test_steps_of_one_length_all_count(cadence_hz, tmp_path):
    second = seconds_of(cadence_hz)
    found = read(tmp_path, second, step_m=0.7)
    assert found.tables["motion"]["step_m"].sum() == pytest.approx(0.7 * second.size)
    assert any(KEPT in note for note in found.notes)


@pytest.mark.parametrize("cadence_hz", [1.7, 1.9, 1.98, 2.02, 2.1, 2.3])
def test_steps_that_a_phone_detects_all_count(cadence_hz, tmp_path):
    second = seconds_of(cadence_hz)
    found = read(tmp_path, second, steps=1)
    assert found.tables["steps"]["count"].iloc[-1] == second.size


@pytest.mark.parametrize("step_m", [1.4, 0.7 + 0.01 * (np.arange(SECONDS) % 7)])
def test_rows_that_were_delivered_twice_count_once(step_m, tmp_path):
    """A second's way is no step, and ways of different lengths that come in pairs are no steps."""
    second = np.arange(SECONDS)
    found = read(tmp_path, np.repeat(second, 2), step_m=np.repeat(step_m * np.ones(SECONDS), 2))
    assert len(found.tables["motion"]) == SECONDS
    assert f"motion: {SECONDS} exact duplicate rows dropped" in found.notes


def test_a_counter_that_stands_still_is_no_step_in_each_row(tmp_path):
    found = read(tmp_path, np.repeat(np.arange(SECONDS), 2), steps=1)
    assert found.tables["steps"]["count"].eq(1).all()
