"""A leap second is the first of the next minute, in each way of writing a time."""

import numpy as np
import pytest

import mapfilter as mf
from mapfilter.clocks.times import parse_times
from mapfilter.survey.antennas_log import _iso
from mapfilter.survey.measurement_times import read_times

NEW_YEAR_S = 1_483_228_800.0
ISO = [
    "2016-12-31T23:59:60Z",
    "2016-12-31 23:59:60",
    "2016-12-31T23:59:60.000+00:00",
    "2017-01-01T00:59:60+01:00",
    "20161231T235960Z",
    "31.12.2016 23:59:60",
]
OTHERS = ["31-Dec-2016 23:59:60", "2016-12-31 11:59:60 PM", "2016-12-31T23:59:60 UTC"]
NONE = [
    "2016-12-31T23:60:00Z",
    "2016-12-31T23:59:61Z",
    "20161231T236000Z",
]


def unix_seconds(text):
    return float(read_times([text])[0][0])


def parsed(text):
    return float(parse_times(np.array([text], dtype=object), "UTC")[0][0])


@pytest.mark.parametrize("text", [*ISO, *OTHERS])
def test_times_of_recordings(text):
    assert parsed(text) == NEW_YEAR_S
    assert parsed(text.replace("60", "58", 1)) == NEW_YEAR_S - 2


@pytest.mark.parametrize("text", ISO)
def test_times_of_surveys(text):
    assert unix_seconds(text) == NEW_YEAR_S
    assert unix_seconds(text.replace("60", "58", 1)) == NEW_YEAR_S - 2


@pytest.mark.parametrize("text", NONE)
def test_sixty_minutes_are_no_time(text):
    assert np.isnan(parsed(text))
    assert np.isnan(unix_seconds(text))


def test_times_of_antennas_in_a_survey():
    text = _iso("2016-12-31 23:59:60:61 GMT+00:00")
    assert unix_seconds(text) == NEW_YEAR_S + 0.061


@pytest.mark.parametrize("zone", ["", "Europe/Berlin"])
def test_a_recording_over_a_leap_second(tmp_path, zone):
    day, hour = ("2017-01-01", 0) if zone else ("2016-12-31", 23)
    times = [f"{day} {hour:02d}:59:{second}{'' if zone else 'Z'}" for second in range(50, 61)]
    rows = (f"{time},{60 + 1e-5 * n:.5f},25,5" for n, time in enumerate(times))
    path = tmp_path / "walk.csv"
    path.write_text("\n".join(["time,lat_deg,lon_deg,accuracy_m", *rows, ""]))
    log = mf.read_log(path, zone=zone)
    assert log.start_utc_s == NEW_YEAR_S - 10
    assert log.gnss["time_s"].tolist() == list(range(11))
    assert not log.notes
