"""Fields that columns of a CSV are taken for, by their names, where these are not usual ones."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

import mapfilter as mf
from mapfilter.errors import InputError
from mapfilter.tracks.readers.formats import read_recording
from mapfilter.tracks.readers.plain.headers import likely_fields

TIME_S = 1.7e9 + np.arange(40.0)
PLACES = {"latitude": 60.17, "longitude": 24.94 + 1e-5 * np.arange(40)}
PLACED = ("time", "lat_deg", "lon_deg")


def unread(tmp_path, columns):
    path = tmp_path / "own.csv"
    pd.DataFrame({"time": TIME_S, **columns}).to_csv(path, index=False)
    return read_recording(path).unread


@pytest.mark.parametrize(
    "column",
    [
        *("zelle", "roll", "rsrq", "ecio", "ssid", "id", "vdop", "pdop", "rate", "uptime"),
        *("speed_accuracy", "heading_accuracy", "course_acc", "speed_limit", "network", "cqi"),
        *("gps_alt", "lattitude", "hacc", "gyroscope", "accelerometer", "mag", "acc_total"),
    ],
)
def test_a_column_of_something_else_resembles_no_field(column):
    assert likely_fields(column, PLACED) == []


@pytest.mark.parametrize(
    ("column", "field"),
    [
        *(("acc", "accuracy_m"), ("acc_m", "accuracy_m"), ("accurracy", "accuracy_m")),
        *(("elev", "altitude_m"), ("alti", "altitude_m"), ("press", "pressure_hpa")),
        *(("compas", "compass_deg"), ("rsrp1", "level_dbm"), ("accelrometer_y", "acc_y")),
    ],
)
def test_abbreviated_and_misspelt_names_are_known(column, field):
    assert likely_fields(column, PLACED) == [field]


@pytest.mark.parametrize(
    ("column", "field"),
    [("lattitude", "lat_deg"), ("londeg", "lon_deg"), ("timestmp", "time"), ("acc", None)],
)
def test_what_is_of_use_beside_positions_is_not_meant_without_any(column, field):
    assert likely_fields(column, ()) == [field] * (field is not None)


@pytest.mark.parametrize(
    ("step", "likely"),
    [
        (2 * np.arange(40), "step (steps?)"),
        (np.full(40, 0.7), "step (step_m?)"),
        (np.arange(40) % 3, "step (step_m or steps?)"),
    ],
)
def test_steps_are_lengths_or_a_counter_by_their_values(tmp_path, step, likely):
    assert unread(tmp_path, {**PLACES, "step": step}) == (likely,)


def test_a_counter_beside_another_one_is_not_a_length(tmp_path):
    columns = {"steps": np.arange(40), "step": np.arange(40), "compass_deg": 90.0}
    assert unread(tmp_path, columns) == ("step",)


def test_a_counter_that_is_named_as_a_length_is_refused_as_a_counter(tmp_path):
    path = tmp_path / "own.csv"
    step = 2 * np.arange(1, 41)
    pd.DataFrame({"time": TIME_S, **PLACES, "step": step}).to_csv(path, index=False)
    with pytest.raises(InputError, match=r'columns=\{"steps": "COLUMN"\}'):
        mf.read_log(path, columns={"step_m": "step"})
