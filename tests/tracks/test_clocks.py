"""Tables of one log that count time differently."""

import numpy as np
import pandas as pd
import pytest

from mapfilter.errors import InputError
from mapfilter.tracks.log import make_log
from mapfilter.tracks.store import read_log, write_log

CRS = "EPSG:32629"


def motion(time_s):
    return pd.DataFrame({"time_s": time_s, "step_m": 1.4})


def radio(time_s):
    return pd.DataFrame({"time_s": time_s, "role": "serving", "cell": "A"})


def fault_of(**tables):
    with pytest.raises(InputError) as caught:
        make_log(CRS, **tables)
    assert len(caught.value.faults) == 1
    return str(caught.value)


TIME_S = np.arange(180.0)


@pytest.mark.parametrize("first_s", [0.0, 100.0])
def test_radio_in_milliseconds(first_s):
    message = fault_of(motion=motion(TIME_S), radio=radio((TIME_S[::2] + first_s) * 1000))
    assert "log, time_s: expected tables that overlap in time, found motion 0..179; " in message
    assert "likely: milliseconds for s in radio" in message


def test_motion_without_steps_in_milliseconds():
    message = fault_of(motion=motion(TIME_S * 1000).assign(step_m=np.nan), radio=radio(TIME_S))
    assert "likely: milliseconds for s in motion" in message


def test_motion_in_unix_time():
    message = fault_of(motion=motion(TIME_S + 1.7e9), radio=radio(TIME_S))
    assert "found motion 1700000000..1700000179; radio 0..179" in message
    assert "Unix time" in message


def test_radio_in_local_time_of_another_zone():
    assert "local time of another zone" in fault_of(
        motion=motion(TIME_S + 3600), radio=radio(TIME_S)
    )


def test_the_files_of_the_tables_are_named():
    with pytest.raises(InputError, match=r"walk/radio\.csv 0\.\.179"):
        make_log(
            CRS,
            motion=motion(TIME_S + 1e6),
            radio=radio(TIME_S),
            names={"radio": "walk/radio.csv"},
        )


@pytest.mark.parametrize(
    "radio_s",
    [
        [5.0],
        [0.0, 0.1, 0.18],  # a burst, 1000 times shorter
        np.arange(0.0, 180_000.0, 60.0),  # reports of two days, a short walk in them
        TIME_S + 400,  # radio that comes some minutes later
        [],
    ],
)
def test_tables_of_one_clock(radio_s):
    log = make_log(CRS, motion=motion(TIME_S), radio=radio(np.array(radio_s)))
    assert len(log.radio) == len(radio_s)


@pytest.mark.parametrize(
    ("start_utc_s", "first_s", "good"),
    [
        (-62_135_596_800.0, 0.0, True),
        (-62_135_596_801.0, 0.0, False),
        (-62_135_596_000.0, -801.0, False),
        (1e11, 9e10, True),
        (1.1e11, 0.0, False),
    ],
)
def test_starts_before_the_year_1_or_in_milliseconds_are_refused(start_utc_s, first_s, good):
    steps = motion([first_s, first_s + 1])
    if good:
        assert make_log(CRS, motion=steps, start_utc_s=start_utc_s).start_utc_s == start_utc_s
        return
    with pytest.raises(InputError, match="start_utc_s: expected UTC seconds"):
        make_log(CRS, motion=steps, start_utc_s=start_utc_s)


@pytest.mark.parametrize(
    ("start_utc_s", "first_s", "year", "cause"),
    [
        (1.78e9, 1.78e9, 2082, "time_s are Unix times already"),
        (1.78e9, 0.0, None, ""),
        (0.0, 1.78e9, None, ""),
        (3.2e8, 3e8, None, ""),
        (0.0, 0.0, 1970, "0 for an unknown start: leave it out"),
        (3e8, 10.0, 1979, "another moment than 1970-01-01, or 0"),
        (4.2e9, 10.0, 2103, "seconds since another moment than 1970-01-01"),
        (np.nan, 10.0, None, ""),
    ],
)
def test_a_start_in_no_usual_year_is_noted(tmp_path, start_utc_s, first_s, year, cause):
    log = make_log(CRS, motion=motion(TIME_S + first_s), start_utc_s=start_utc_s)
    told = [note for note in log.notes if note.startswith("log, start_utc_s")]
    assert len(told) == (year is not None)
    assert all(f"times begin in {year} (likely: " in note and cause in note for note in told)
    write_log(log, tmp_path / "log")
    assert read_log(tmp_path / "log").notes == log.notes


def test_days_of_a_spreadsheet_are_named_in_each_table():
    days = 46_143.416667 + TIME_S / 86_400
    with pytest.raises(InputError) as caught:
        make_log(CRS, motion=motion(days), radio=radio(days[::2]))
    assert [fault.where for fault in caught.value.faults] == ["motion, time_s", "radio, time_s"]
    assert all("days of a spreadsheet" in fault.hint for fault in caught.value.faults)
    assert caught.value.faults[0].got == "46143.416667 to 46143.418739"
    make_log(CRS, motion=motion(46_143 + TIME_S), radio=radio(46_143 + TIME_S))
