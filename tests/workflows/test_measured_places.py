"""Where and when levels of recordings and logs were measured, and which files are left out."""

import json

import numpy as np
import pandas as pd
import pytest

from mapfilter.errors import InputError
from mapfilter.geodesy import project
from mapfilter.survey.measurement_rows import NotMeasurementsError
from mapfilter.tracks.log import make_log
from mapfilter.tracks.store import write_log
from mapfilter.workflows.inputs.measured import recorded_rows

CRS = "EPSG:32635"
EAST_M, NORTH_M = (float(one[0]) for one in project(CRS, [24.94], [60.17]))
TIME, LAT, LON, LEVEL, ACCURACY = range(5)


def drive(tmp_path, *rows, name="drive.csv"):
    path = tmp_path / name
    head = "time,lat,lon,accuracy,mcc,mnc,lac,ci,rsrp,technology"
    path.write_text("\n".join([head, *rows]))
    return path


def place(time, lat=60.17, lon=24.94, accuracy=""):
    return f"{time},{lat},{lon},{accuracy},,,,,,"


def level(time, dbm=-80):
    return f"{time},,,,244,91,1,7,{dbm},LTE"


@pytest.mark.parametrize("accuracies", [(3, 12), (12, 3), ("", 12), (12, "")])
def test_a_level_between_two_positions_is_as_accurate_as_the_worse_one(tmp_path, accuracies):
    before, after = accuracies
    path = drive(
        tmp_path,
        place(1777629600, accuracy=before),
        level(1777629602),
        place(1777629604, accuracy=after),
    )
    assert recorded_rows(path).columns[ACCURACY].tolist() == [12.0]


@pytest.mark.parametrize(("apart_s", "placed"), [(10, True), (10.5, False)])
def test_positions_ten_seconds_apart_place_what_lies_between_them(tmp_path, apart_s, placed):
    path = drive(tmp_path, place(1777629600), level(1777629602), place(1777629600 + apart_s))
    rows = recorded_rows(path)
    assert len(rows.cell) == placed
    assert rows.aside["levels without a position within 10 s"] == 1 - placed


def log(tmp_path, **given):
    time_s = np.arange(4.0) + 20.0
    radio = pd.DataFrame({"time_s": time_s, "role": "serving", "cell": "A", "level_dbm": -80.0})
    gnss = {"time_s": time_s, "east_m": EAST_M, "north_m": NORTH_M}
    gnss |= {"var_east_m2": 9.0, "var_north_m2": 16.0}
    write_log(make_log(CRS, radio=radio, gnss=pd.DataFrame(gnss), **given), tmp_path / "log")
    return tmp_path / "log"


def test_fixes_of_a_log_are_as_accurate_as_both_axes_tell(tmp_path):
    columns = recorded_rows(log(tmp_path)).columns
    assert columns[ACCURACY] == pytest.approx(5.0)
    assert columns[LAT] == pytest.approx(60.17)
    truth = {"time_s": [20.0, 23.0], "east_m": EAST_M, "north_m": [NORTH_M, NORTH_M + 3.0]}
    columns = recorded_rows(log(tmp_path / "other", truth=pd.DataFrame(truth))).columns
    # The ground truth is exact, and tells of the way.
    assert np.isnan(columns[ACCURACY]).all()
    assert (np.diff(columns[LAT]) > 0).all()


def test_times_of_a_log_with_a_date_are_its_own_and_others_begin_at_one(tmp_path):
    assert recorded_rows(log(tmp_path)).columns[TIME].tolist() == [1.0, 2.0, 3.0, 4.0]
    dated = log(tmp_path / "dated", start_utc_s=1777629600.0)
    assert recorded_rows(dated).columns[TIME].tolist() == [1777629620.0 + k for k in range(4)]


def test_dates_that_may_be_read_in_two_ways_are_told_of_placed_levels_alone(tmp_path):
    """JSON of anything else is no drive test, whatever its dates are."""
    rows = [{"time": f"0{1 + k}/02/2026 10:00:00", "lat": 60.17, "lon": 24.94} for k in range(3)]
    other, drive_test = tmp_path / "other.json", tmp_path / "drive.json"
    other.write_text(json.dumps(rows))
    drive_test.write_text(json.dumps([{**row, "cell": "A", "level_dbm": -80} for row in rows]))
    with pytest.raises(NotMeasurementsError):
        recorded_rows(other)
    with pytest.raises(InputError, match="time") as caught:
        recorded_rows(drive_test)
    assert not isinstance(caught.value, NotMeasurementsError)
