"""Columns of azimuths without a unit in their name, beside steps."""

import numpy as np
import pandas as pd
import pytest

import mapfilter as mf

COUNT = 120
EAST_THEN_NORTH = np.where(np.arange(COUNT) < COUNT // 2, 90.0, 0.0)


def log_of(path, **columns):
    time_s = 1_777_629_600 + np.arange(float(COUNT))
    pd.DataFrame({"time": time_s, **columns}).to_csv(path / "steps.csv", index=False)
    return mf.read_log(path / "steps.csv")


@pytest.mark.parametrize("steps", [{"steps": 2 * np.arange(COUNT)}, {"step_m": 1.4}], ids=str)
@pytest.mark.parametrize("name", ["azimuth", "Azimuth", "compass"])
def test_azimuths_in_degrees_are_those_of_a_compass(tmp_path, steps, name):
    log = log_of(tmp_path, **steps, **{name: EAST_THEN_NORTH})
    named = log_of(tmp_path, **steps, compass_deg=EAST_THEN_NORTH)
    pd.testing.assert_frame_equal(log.motion, named.motion)
    # Counter-clockwise from east.
    assert log.motion["heading_rad"].iloc[10] == pytest.approx(0.0, abs=1e-9)
    assert log.motion["heading_rad"].iloc[-10] == pytest.approx(np.pi / 2)
    told = f"{name.lower()}: taken for degrees clockwise from north, by its values"
    assert any(told in note for note in log.notes)


@pytest.mark.parametrize(
    ("columns", "option"),
    [
        ({"heading": EAST_THEN_NORTH}, 'columns={"compass_deg": "heading"}'),
        ({"azimuth": np.radians(EAST_THEN_NORTH)}, 'columns={"compass_deg": "azimuth"}'),
        ({"azimuth": EAST_THEN_NORTH, "ci": 12, "mcc": 1, "mnc": 1, "rsrp": -90},
         'columns={"compass_deg": "azimuth"}'),
        ({"azimuth": 5 * EAST_THEN_NORTH}, 'columns={"compass_deg": "azimuth"}'),
    ],
    ids=["heading", "radians", "cells", "no degrees"],
)  # fmt: skip
def test_what_may_be_another_direction_is_named_with_its_option(tmp_path, columns, option):
    log = log_of(tmp_path, steps=2 * np.arange(COUNT), **columns)
    assert log.motion.empty
    assert any(option in note for note in log.notes)


def test_another_direction_goes_before_an_azimuth(tmp_path):
    turns = {"steps": 2 * np.arange(COUNT), "turn_deg": np.diff(EAST_THEN_NORTH, prepend=90.0)}
    log = log_of(tmp_path, **turns, azimuth=EAST_THEN_NORTH)
    pd.testing.assert_frame_equal(log.motion, log_of(tmp_path, **turns).motion)
