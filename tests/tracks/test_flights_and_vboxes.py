"""Gliders' IGC, Racelogic's VBO, RaceChrono's CSV and other tools whose layouts are published."""

import json

import numpy as np
import pandas as pd
import pytest

from mapfilter.errors import InputError
from mapfilter.tracks.readers.formats import format_of, read_recording

IGC = "AXXXABC\nHFDTE{date}\nHFPLTPILOT:x\n{fixes}GABCDEF\n"
FIX = "B{time}5206{m:03d}N00006200WA0058700{h:03d}\n"
VBO = (
    "File created on 19/03/2024 at 23:59:58\n\n[header]\nsatellites\ntime\n\n"
    "[comments]\nVBOX II\n\n"
    "[column names]\nsats time lat long velocity heading height YawRate\n\n[data]\n{}"
)
VBO_ROW = "008 {time} +03125.400000 -00060.000000 036.000 090.00 +0100.00 0.5\n"


def start_of(found):
    return pd.Timestamp(found.tables["positions"]["time_s"].iloc[0], unit="s")


def read(folder, name, content):
    path = folder / name
    path.write_text(content, encoding="utf-8")
    return read_recording(path)


@pytest.mark.parametrize("date", ["190324", "DATE:190324,01"])
def test_a_flight_over_midnight(tmp_path, date):
    """It was refused."""
    times = ("235958", "235959", "000000")
    fixes = "".join(FIX.format(time=one, m=300 + at, h=at) for at, one in enumerate(times))
    fixes += FIX.format(time="000001", m=300, h=0).replace("WA", "WV")
    found = read(tmp_path, "f.igc", IGC.format(date=date, fixes=fixes))
    places = found.tables["positions"]
    assert start_of(found) == pd.Timestamp("2024-03-19 23:59:58")
    assert np.diff(places["time_s"]).tolist() == [1.0, 1.0]
    assert places["lat_deg"].iloc[0] == pytest.approx(52 + 6.3 / 60)
    assert places["lon_deg"].iloc[0] == pytest.approx(-6.2 / 60)
    assert places["altitude_m"].tolist() == [0.0, 1.0, 2.0]
    assert any("1 fix without a height (V) left out" in note for note in found.notes)


def test_a_vbox_over_midnight(tmp_path):
    """It was refused; longitudes in it are positive to the west."""
    rows = "".join(VBO_ROW.format(time=one) for one in ("235959.00", "000000.00", "000001.50"))
    found = read(tmp_path, "r.vbo", VBO.format(rows))
    places = found.tables["positions"]
    assert start_of(found) == pd.Timestamp("2024-03-19 23:59:59")
    assert np.diff(places["time_s"]).tolist() == [1.0, 1.5]
    assert (places["lat_deg"].iloc[0], places["lon_deg"].iloc[0]) == pytest.approx((52.09, 1.0))
    assert places["speed_mps"].tolist() == pytest.approx([10.0] * 3)
    assert any("from the day of its creation on, 2024-03-19" in note for note in found.notes)


@pytest.mark.parametrize("content", [VBO.format("").replace("File created", "x"), VBO.format("")])
def test_a_vbox_without_a_date_or_rows(tmp_path, content):
    with pytest.raises(InputError):
        read(tmp_path, "r.vbo", content)


def test_a_race_of_racechrono(tmp_path):
    """Speeds that stand twice and rates of rotation were not used."""
    names = "timestamp,latitude,longitude,speed,speed,x_acc,y_acc,z_acc,"
    names += ",".join(f"{axis}_rate_of_rotation" for axis in "xyz")
    units = "unix time,deg,deg,m/s,m/s,G,G,G,deg/s,deg/s,deg/s"
    rows = [f"{1710889960 + at},50.33{at},6.94,20.0,21.0,0,0.1,1,0.1,0.2,30" for at in range(5)]
    found = read(tmp_path, "rc.csv", "\n".join(["Title", "", names, units, *rows, ""]))
    assert found.tables["positions"]["speed_mps"].tolist() == [20.0] * 5
    assert found.tables["gyroscope"]["z_radps"].tolist() == pytest.approx([np.radians(30)] * 5)
    assert any("several columns speed [m/s]: the first one" in note for note in found.ignored)


def test_axes_behind_a_dot(tmp_path):
    head = "Timestamp," + ",".join(
        f"{s}.{a}" for s in ("accelerometer", "gyroscope") for a in "xyz"
    )
    rows = [f"{1710889960600 + 20 * at},0.1,0.2,9.8,0,0,0.5" for at in range(5)]
    found = read(tmp_path, "s.csv", "\n".join([head, *rows, ""]))
    assert set(found.tables) == {"accelerometer", "gyroscope"}


def test_cells_of_sigcap(tmp_path):
    """Its times have a name of their own."""
    cell = {"pci": 12, "ci": 1280001, "tac": 7, "mcc": "244", "mnc": "91", "earfcn": 1300}
    records = [
        {
            "datetimeIso": f"2024-03-19T10:15:0{at}.000+0000",
            "location": {"latitude": 48.18, "longitude": 11.55, "hor_acc": 5},
            "cell_info": [
                {**cell, "rsrp": -95, "registered": True},
                {"pci": 13, "earfcn": 1300, "rsrp": -99, "registered": False},
            ],
            "wifi_info": [{"bssid": "a", "rssi": -60}],
        }
        for at in range(3)
    ]
    found = read(tmp_path, "s.json", json.dumps(records))
    assert found.tables["radio"]["level_dbm"].tolist() == [-95.0, -99.0] * 3
    assert len(found.tables["positions"]) == 3
    assert format_of(tmp_path / "s.json") is not None
