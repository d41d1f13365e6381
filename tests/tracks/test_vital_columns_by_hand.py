"""Columns that must hold numbers: one of texts that are none is refused by its name in the file."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from mapfilter.errors import InputError
from mapfilter.tracks.readers.formats import read_recording
from mapfilter.tracks.readers.plain_csv import has_content

COUNT = 20
TIME_S = 1_777_629_600.0 + np.arange(COUNT)
PLACES = {"Lat": 60.0 + 1e-4 * np.arange(COUNT), "Lon": 25.0}


def read(tmp_path, **columns):
    path = tmp_path / "own.csv"
    pd.DataFrame({"time": TIME_S, **PLACES, **columns}).to_csv(path, index=False)
    return read_recording(path)


def told_of(tmp_path, **columns):
    """Return place and finding of the faults of columns that should hold numbers."""
    faults = ()
    try:
        read(tmp_path, **columns)
    except InputError as error:
        faults = error.faults
    return [
        (one.where.partition("own.csv, ")[2], one.got)
        for one in faults
        if one.expected == "numbers"
    ]


FEW = (
    *("step_m", "level_dbm", "bars", "acc_x", "gyr_x", "mag_x", "pressure", "wheel_speed"),
    *("odo_m", "odo_km", "vehicle_speed_kmh", "steps", "yaw_rate", "yaw_rate_dps", "speed_mps"),
    "speed_kmh",
)


@pytest.mark.parametrize(
    ("field", "column", "beside"),
    [
        ("step_m", "Step_m", {}),
        ("heading_rad", "Heading_rad", {"step_m": 0.7}),
        ("turn_rad", "Turn_rad", {"step_m": 0.7}),
        ("turn_deg", "Turn_deg", {"step_m": 0.7}),
        ("compass_deg", "Azimuth_deg", {"step_m": 0.7}),
        ("steps", "Step_Count", {}),
        ("level_dbm", "RSRP", {"mcc": 244, "mnc": 5, "tac": 1, "ci": 7}),
        ("bars", "Signal_Bars", {"mcc": 244, "mnc": 5, "tac": 1, "ci": 7}),
        ("yaw_rate_radps", "Yaw_Rate", {"wheel_speed": 8.0}),
        ("yaw_rate_degps", "Yaw_Rate_dps", {"wheel_speed": 8.0}),
        ("wheel_speed_mps", "Wheel_Speed", {}),
        ("wheel_speed_kmh", "Vehicle_Speed_kmh", {}),
        ("odometer_m", "Odo_m", {}),
        ("odometer_km", "Odo_km", {}),
    ],
)
def test_texts_that_are_no_numbers_are_refused_with_their_column(tmp_path, field, column, beside):
    """More than half of those that are given; of two or more, as one may mark missing values."""
    for bad, alike, is_refused in ((11, 0, True), (10, 0, False), (11, 1, False)):
        texts = [f"{0 if alike else n}.1.x" if n < bad else "1" for n in range(COUNT)]
        told = told_of(tmp_path, **beside, **{column: texts})
        name = column.lower()
        where = field if name == field else f"column {name} ({field})"
        got = f"11 of {COUNT} values that are none, such as '0.1.x'"
        assert told == [(where, got)] * is_refused


def test_values_out_of_range_are_refused_with_their_column(tmp_path):
    with pytest.raises(InputError) as caught:
        read(tmp_path, mcc=244, mnc=5, tac=1, ci=7, RSRP=np.linspace(100, 120, COUNT))
    assert {fault.where.partition("own.csv, ")[2] for fault in caught.value.faults} == {
        "column rsrp (level_dbm)"
    }


def test_of_two_columns_of_one_name_the_first_is_read(tmp_path):
    path = tmp_path / "own.csv"
    rows = [f"{one:.0f},60.{n:02},25.0,61.{n:02}" for n, one in enumerate(TIME_S)]
    path.write_text("\n".join(["time,lat,lon,LAT", *rows]) + "\n")
    found = read_recording(path)
    assert found.tables["positions"]["lat_deg"].max() < 61
    assert "several columns lat: the first one is read" in found.ignored


@pytest.mark.parametrize(
    ("names", "holds"),
    [
        ("time lat lon", True),
        ("lat lon", False),
        ("time lat", False),
        ("time east_m north_m", True),
        ("time north_m", False),
        ("time qx qy qz", True),
        ("time qx qy", False),
        *((f"time {name}", True) for name in FEW),
        *((f"time {name}", False) for name in ("acc_y", "altitude", "accuracy", "ci", "mcc")),
        # A signal is a level beside cells.
        ("time ci signal", True),
        ("time signal", False),
    ],
)  # fmt: skip
def test_which_columns_make_rows_of_a_journey(names, holds):
    assert has_content(names.split()) is holds
