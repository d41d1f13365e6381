"""Files that are read in parts: as if they were read in one."""

import numpy as np
import pandas as pd
import pytest

from mapfilter.tracks.readers.format import ReadOptions
from mapfilter.tracks.readers.formats import read_recording
from mapfilter.tracks.readers.texts import text

ROWS = 400
ORDER = np.arange(ROWS)
TIME_S = 1.7e9 + ORDER
WAY_M = 1000.0 + np.cumsum(10.0 + 3.0 * np.sin(ORDER / 20.0))


def table(**columns):
    return pd.DataFrame({"time": TIME_S, **columns})


def read(rows, folder, monkeypatch, zone=""):
    """Read a table in one and in parts."""
    path = folder / "drive.csv"
    path.write_text(rows if isinstance(rows, str) else rows.to_csv(index=False))
    whole = read_recording(path, options=ReadOptions(zone=zone))
    monkeypatch.setattr(text, "_PART_BYTES", 3000)
    assert path.stat().st_size > 2 * 3000
    return whole, read_recording(path, options=ReadOptions(zone=zone))


ODOMETERS = {
    "metres": {"odometer_m": WAY_M.round(1)},
    "coarse": {"odometer_km": np.floor(WAY_M / 10) / 100},
    "very coarse": {"odometer_km": np.floor(WAY_M / 100) / 10, "yaw_rate_degps": ORDER % 7 - 3.0},
    "wrapping": {"odometer_m": np.floor(WAY_M) % 1024},
    "with a course": {"odometer_m": WAY_M.round(1), "bearing": ORDER % 360.0},
}


@pytest.mark.parametrize("columns", ODOMETERS.values(), ids=ODOMETERS)
def test_an_odometer_counts_on_over_the_parts_of_a_file(columns, tmp_path, monkeypatch):
    whole, parts = read(table(**columns), tmp_path, monkeypatch)
    pd.testing.assert_frame_equal(parts.tables["odometry"], whole.tables["odometry"])
    assert parts.notes == whole.notes


def test_an_odometer_keeps_its_times_where_a_later_part_shifts_them(tmp_path, monkeypatch):
    # The hour from 2 to 3 o'clock comes twice; only its second pass tells which is the first.
    utc = pd.to_datetime(np.arange(ROWS) * 20, unit="s", origin="2026-10-25 00:00:00", utc=True)
    rows = table(odometer_m=WAY_M.round(1)).assign(
        time=utc.tz_convert("Europe/Berlin").strftime("%Y-%m-%d %H:%M:%S")
    )
    whole, parts = read(rows, tmp_path, monkeypatch, "Europe/Berlin")
    pd.testing.assert_frame_equal(parts.tables["odometry"], whole.tables["odometry"])


def repeated_header():
    lines = table(lat=60.0 + 1e-5 * ORDER, lon=25.0).to_csv(index=False).splitlines()
    for at in (350, 250, 50):
        lines.insert(at, lines[0])
    return "\n".join(lines) + "\n"


BACK_S = np.where(ORDER % 50 == 49, 5.0, 0.0)
PLACED = {"lat": 60.0 + 1e-5 * ORDER, "lon": 25.0}
REMARKS = {
    "58 values are no numbers, taken as missing (first 'abc' in line 2)": table(
        **PLACED, level_dbm=-80.0, cell="A", ci=[f"{n}" if n % 7 else "abc" for n in ORDER]
    ),
    "40 values are not dBm in -200..0, ignored (first in line 2)": table(
        **PLACED, level_dbm=np.where(ORDER % 10, -80.0, 30.0), cell="A"
    ),
    "304 values beyond a turn, wrapped": table(step_m=1.0, compass_deg=np.linspace(0, 1500, ROWS)),
    "times go backwards in 8 places": table(**PLACED).assign(time=TIME_S - BACK_S),
    "3 lines repeat the header": repeated_header(),
    "200 yaw rates taken from rows beside those with speeds": table(
        wheel_speed_kmh=np.where(ORDER % 2, np.nan, 36.0),
        yaw_rate_degps=np.where(ORDER % 2, 1.0, np.nan),
    ),
    "200 of 400 speeds without a position in the row": table(
        lat=np.where(ORDER % 2, 60.0 + 1e-5 * ORDER, np.nan),
        lon=np.where(ORDER % 2, 25.0, np.nan),
        speed_mps=3.0,
    ),
    "400 values of W by column ew": table(**PLACED, ew="W"),
    "80 values are not 0..65535 as in GSM, ignored (first in line 2)": table(
        **PLACED,
        level_dbm=-80.0,
        technology="GSM",
        mcc=244,
        mnc=91,
        lac=7,
        ci=np.where(ORDER % 5, 100 + ORDER % 3, 70_000),
    ),
}


@pytest.mark.parametrize(("note", "rows"), REMARKS.items(), ids=REMARKS)
def test_counts_of_remarks_are_those_of_the_whole_file(note, rows, tmp_path, monkeypatch):
    whole, parts = read(rows, tmp_path, monkeypatch)
    assert parts.notes == whole.notes
    assert parts.ignored == whole.ignored
    assert len([one for one in parts.notes if note in one]) == 1
