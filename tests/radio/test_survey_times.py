"""Times of drive tests in CSV: of all the layouts that recordings may have."""

from datetime import UTC, datetime

import numpy as np
import pytest

from mapfilter.survey import measurement_times
from mapfilter.survey.read_measurements import read_measurements

START_S = datetime(2026, 5, 13, 10, 0, 58, tzinfo=UTC).timestamp()
CLOCKS = ("10:00:58", "10:00:59", "10:01:00")


def read(tmp_path, header, times, **options):
    rows = [f"A,60.1{at:04d},24.9,-80,{one}" for at, one in enumerate(times)]
    path = tmp_path / "drive.csv"
    path.write_text("\n".join([f"cell,lat,lon,level_dbm,{header}", *rows]) + "\n")
    return read_measurements([path], **options)


@pytest.mark.parametrize(
    "layout",
    [
        "2026-05-13T{}Z",
        "2026-05-13 {}",
        "2026.05.13_{}",
        "2026/05/13 {}",
        "13.05.2026 {}",
        "13/05/2026 {}",
        "5/13/2026 {}",
        "13-05-26 {}",
        "13-May-2026 {}",
        "13/05/2026 {} AM",
        "13/05/2026 {} WET",
        "Wed May 13 {} GMT+00:00 2026",
        "20260513 {}",
    ],
)
def test_times_are_read_as_those_of_recordings(tmp_path, layout):
    """Only ISO 8601 and days with dots were read."""
    found = read(tmp_path, "time", [layout.format(clock) for clock in CLOCKS])
    assert found.time_s.tolist() == [START_S, START_S + 1, START_S + 2]


def test_numbers_of_dates_are_no_unix_times(tmp_path):
    """One of 12 digits was taken for a day in 1976, one of 14 for none."""
    found = read(tmp_path, "time", [20260513100058, 20260513100059])
    assert found.time_s.tolist() == [START_S, START_S + 1]
    found = read(tmp_path, "time", [202605131000, 202605131001])
    assert found.time_s.tolist() == [START_S - 58, START_S + 2]


def test_the_order_of_dates_and_names_of_zones_are_noted(tmp_path, monkeypatch):
    monkeypatch.setattr(measurement_times, "_TEXTS_KEPT", 5)
    days = [f"{day:02d}/05/2026 10:00:00 CEST" for day in range(1, 28)]
    found = read(tmp_path, "time", days)
    np.testing.assert_array_equal(np.diff(found.time_s), 86_400)
    assert "drive.csv: time: the day first in dates with slashes or hyphens" in found.notes
    assert "drive.csv: time: CEST taken for UTC+02:00" in found.notes


def test_what_is_unclear_is_said_with_a_remedy(tmp_path):
    found = read(tmp_path, "time", ["11/05/2026 10:00:00", "12/05/2026 10:00:00"])
    assert np.isnan(found.time_s).all()
    assert "'11/05/2026 10:00:00' in line 2 (day or month first? Write 2021" in found.notes[0]
    found = read(tmp_path, "time", ["2026-01-13 10:00:00 EST"])
    assert "EST is of several zones" in found.notes[0]


def test_days_beside_times_of_day(tmp_path):
    """Times of day beside their days were not understood."""
    found = read(tmp_path, "date,time", [f"13/05/2026,{clock}" for clock in CLOCKS])
    assert found.time_s.tolist() == [START_S, START_S + 1, START_S + 2]
    names = {"time": "uhrzeit"}
    found = read(tmp_path, "date,uhrzeit", [f"13.05.26,{one}" for one in CLOCKS], columns=names)
    assert found.time_s.tolist() == [START_S, START_S + 1, START_S + 2]
