"""Dates that may be read in two ways: asked, unless something else of the file decides."""

import numpy as np
import pandas as pd
import pytest

import mapfilter as mf
from mapfilter.errors import InputError
from mapfilter.survey.measurement_times import WaitingTimes


def read(tmp_path, header, times, name="drive.csv"):
    rows = [f"{one},60.1{i:04d},24.9" for i, one in enumerate(times)]
    path = tmp_path / name
    path.write_text("\n".join([f"{header},lat,lon", *rows]) + "\n")
    return mf.read_log(path, zone="UTC")


def starts_on(log, day):
    return log.start_utc_s + log.gnss["time_s"].iloc[0] == pd.Timestamp(day, tz="UTC").timestamp()


@pytest.mark.parametrize("date", ["16/05/13", "16-05-13"])
def test_a_short_year_that_may_be_a_day_is_asked_for(tmp_path, date):
    """It was taken for 2016, though a log of 2013 writes it, too."""
    with pytest.raises(InputError, match="may be 2013-05-16 or 2016-05-13") as caught:
        read(tmp_path, "time", [f"{date} 10:00:00", f"{date} 10:00:01"])
    assert "put the date into the name of the file, as 2013-05-16.csv" in str(caught.value)


@pytest.mark.parametrize("day", ["2013-05-16", "2016-05-13"])
@pytest.mark.parametrize("name", ["{}.csv", "{}_drive.csv", "log {} 10.00.csv"])
def test_the_name_of_the_file_tells(tmp_path, day, name):
    log = read(tmp_path, "time", ["16/05/13 10:00:00", "16/05/13 10:00:01"], name.format(day))
    assert starts_on(log, f"{day} 10:00")
    assert any("by a date in the file or in its name" in note for note in log.notes)


def test_the_name_of_the_file_tells_day_from_month(tmp_path):
    """It was refused, although the name has the date."""
    for name, day in (("20260506.csv", "2026-05-06"), ("2026-06-05.csv", "2026-06-05")):
        log = read(tmp_path, "time", ["05/06/2026 10:00:00", "05/06/2026 10:00:01"], name)
        assert starts_on(log, f"{day} 10:00")
    with pytest.raises(InputError, match=r"day or month first.* name of the file"):
        read(tmp_path, "time", ["05/06/2026 10:00:00"], "export 2026-09-01.csv")


@pytest.mark.parametrize(
    ("header", "beside"),
    [("time,start", "2013-05-16"), ("time,gps_week", "1740"), ("time,start", "16.05.2013 09:59")],
)
def test_another_column_tells(tmp_path, header, beside):
    log = read(tmp_path, header, [f"16/05/13 10:00:0{n},{beside}" for n in (0, 1)])
    assert starts_on(log, "2013-05-16 10:00")


def test_over_the_end_of_a_year(tmp_path):
    with pytest.raises(InputError, match="which number is the day"):
        read(tmp_path, "time", ["31/12/13 23:59:59", "01/01/14 00:00:00"])
    log = read(tmp_path, "time", ["31/12/13 23:59:59", "01/01/14 00:00:00"], "2014-01-01.csv")
    assert starts_on(log, "2013-12-31 23:59:59")
    assert log.gnss["time_s"].tolist() == [0.0, 1.0]


def test_what_a_date_is_not_is_noted(tmp_path):
    """Next to no one writes a short year first, but then it would be another date."""
    log = read(tmp_path, "time", ["13/05/26 10:00:00", "13/05/26 10:00:01"])
    assert starts_on(log, "2026-05-13 10:00")
    assert any("(13/05/26: 2026-05-13, not 2013-05-26)" in note for note in log.notes)


def test_measurements_take_the_date_of_their_name(tmp_path):
    for name, day in (("2026-05-06.csv", "2026-05-06"), ("a.csv", "")):
        waiting = WaitingTimes()
        assert np.isnan(waiting.seconds(0, 2, "05/06/2026 10:00:00"))
        (found,), _ = waiting.read(tmp_path / name)
        wanted = pd.Timestamp(f"{day} 10:00", tz="UTC").timestamp() if day else np.nan
        assert found == wanted or (np.isnan(found) and not day)


def test_times_of_day_take_the_date_of_the_name_over_midnight(tmp_path):
    """They were refused, although the name has the date."""
    times = ["23:59:59", "00:00:00 5", "00:00:01"]
    log = read(tmp_path, "time", times, "log_2026-05-13.csv")
    assert starts_on(log, "2026-05-13 23:59:59")
    assert log.gnss["time_s"].tolist() == [0.0, 1.5, 2.0]
    assert any("those of 2026-05-13, by the name of the file" in note for note in log.notes)
    assert any("times go on with the next day" in note for note in log.notes)
    for name in ("log.csv", "2026-05-13 to 2026-05-14.csv"):
        with pytest.raises(InputError, match=r"without its date.* as 2026-05-01\.csv"):
            read(tmp_path, "time", times, name)


@pytest.mark.parametrize(
    ("times", "elapsed_s", "note"),
    [
        (["10:00:05 5", "10:00:05 75", "10:00:06 25"], [0.0, 0.25, 0.75], "decimals"),
        (["10:00:05 5", "10:00:05 75", "10:00:05 105"], [0.0, 0.07, 0.1], "whole milliseconds"),
        (["10:00:05 5Z", "10:00:06 5Z"], [0.0, 1.0], "decimals"),
        (["10:00:05 5 AM", "10:00:06 5 AM"], [0.0, 1.0], "decimals"),
        (["10:00:05 500+02:00", "10:00:06 505+02:00"], [0.0, 1.005], ""),
    ],
)
def test_a_fraction_behind_a_blank(tmp_path, times, elapsed_s, note):
    """With a zone it was refused; whole milliseconds without zeros were taken for decimals."""
    log = read(tmp_path, "time", [f"2026-05-13 {one}" for one in times])
    since_s = log.gnss["time_s"] - log.gnss["time_s"].iloc[0]
    assert since_s.tolist() == pytest.approx(elapsed_s, abs=1e-5)
    assert any(f"{note}" in one and "behind a blank" in one for one in log.notes) == bool(note)


@pytest.mark.parametrize(
    ("name", "day"), [("a.csv", "2026-05-13"), ("2013-05-26.csv", "2013-05-26")]
)
def test_dates_of_six_digits(tmp_path, name, day):
    log = read(tmp_path, "date,time", ["260513,100058", "260513,100059"], name)
    assert starts_on(log, f"{day} 10:00:58")
    assert any(f"(260513: {day}, not" in note for note in log.notes)
