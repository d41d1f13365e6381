"""Which of several columns of times is read: UTC goes before times from an unknown start."""

import numpy as np
import pandas as pd
import pytest

from mapfilter.tracks.readers.formats import read_recording
from mapfilter.tracks.readers.texts import text

START_S = 1_777_629_600.0
ELAPSED_S = np.arange(0.0, 60.0)
UTC = pd.to_datetime(START_S + ELAPSED_S, unit="s").strftime("%Y-%m-%d %H:%M:%S")
PLACES = {"latitude": 60.17, "longitude": 24.94 + 1e-5 * ELAPSED_S}


def read(tmp_path, columns):
    path = tmp_path / "flight.csv"
    pd.DataFrame({**columns, **PLACES}).to_csv(path, index=False)
    return read_recording(path)


@pytest.mark.parametrize(
    "others",
    [
        {"time(millisecond)": 1000 * ELAPSED_S, "datetime(utc)": UTC},
        {"Elapsed time [s]": ELAPSED_S, "GPS time [us]": 1e6 * (START_S + ELAPSED_S)},
        {"timestamp": 12e6 + 1e6 * ELAPSED_S, "time_utc_usec": 1e6 * (START_S + ELAPSED_S)},
    ],
)
def test_times_in_utc_go_before_those_from_an_unknown_start(tmp_path, others):
    """As of flights: their log counted from an unknown start, or its times were refused."""
    found = read(tmp_path, others)
    assert found.clock.kind == "utc"
    np.testing.assert_allclose(found.tables["positions"]["time_s"], START_S + ELAPSED_S)
    assert any(note.startswith("time") and [*others][1].lower() in note for note in found.notes)


def test_one_time_in_all_rows_does_not_replace_those_that_count(tmp_path):
    """It is the start of the recording."""
    found = read(tmp_path, {"Elapsed time [s]": ELAPSED_S, "Date time (UTC)": UTC[0]})
    assert found.clock.kind == "monotonic"
    np.testing.assert_allclose(found.tables["positions"]["time_s"], ELAPSED_S)


@pytest.mark.parametrize("part_bytes", [1000, 1 << 24])
@pytest.mark.parametrize(
    "others",
    [
        {"time(millisecond)": 1000 * ELAPSED_S, "datetime(utc)": UTC},
        {"Elapsed time [s]": ELAPSED_S, "GPS time [s]": START_S + ELAPSED_S},
    ],
)
def test_all_parts_of_a_large_file_have_the_times_of_one_column(
    tmp_path, monkeypatch, part_bytes, others
):
    """Those after the first part were read from the other column, which a note called used."""
    monkeypatch.setattr(text, "_PART_BYTES", part_bytes)
    found = read(tmp_path, others)
    assert found.clock.kind == "utc"
    np.testing.assert_allclose(found.tables["positions"]["time_s"], START_S + ELAPSED_S)
    unused, used = (name.lower() for name in others)
    assert not any(
        note.startswith((f"{used}: ", f"columns not used: {used}")) for note in found.notes
    )
    assert any(note.startswith(f"columns not used: {unused}") for note in found.notes)


def test_seconds_of_gps_since_1980_do_not_replace_those_that_count(tmp_path):
    """Taken for Unix times they are of 2016."""
    since_1980_s = START_S - 315_964_800 + 18 + ELAPSED_S
    found = read(tmp_path, {"time": ELAPSED_S, "GPS time [s]": since_1980_s})
    assert found.clock.kind == "monotonic"
    np.testing.assert_allclose(found.tables["positions"]["time_s"], ELAPSED_S)
