"""Dates behind times of day, and sections and headers of lines in fixed places."""

from datetime import UTC, datetime
from pathlib import Path

import pyarrow as pa
import pytest

from mapfilter.clocks.written_times import written_times
from mapfilter.tracks.readers.contained.fixed_lines import vbo_table
from mapfilter.tracks.readers.contained.google_timeline import timeline_records
from mapfilter.tracks.readers.formats import read_recording
from mapfilter.tracks.readers.texts.text import Text


@pytest.mark.parametrize("date", ["13.5.2026", "13/5/2026", "13-5-2026"])
def test_date_behind_times_of_day_is_no_fraction_and_not_that_of_the_name(
    tmp_path: Path, date: str
) -> None:
    path = tmp_path / "2026-06-01.csv"
    path.write_text(f"time,lat,lon\n10:00:05 {date},60.1,24.9\n10:00:06 {date},60.2,24.9\n")
    recording = read_recording(path)
    expected = datetime(2026, 5, 13, 10, 0, 5, tzinfo=UTC).timestamp()
    assert recording.tables["positions"]["time_s"].tolist() == [expected, expected + 1]


@pytest.mark.parametrize("dates", [("9.5.2026", "10.5.2026"), ("9/5/2026", "13/5/2026")])
def test_days_behind_equal_times_of_day_are_no_milliseconds(dates: tuple[str, str]) -> None:
    found = written_times(pa.chunked_array([[f"10:00:05 {one}" for one in dates]]))
    days = [datetime.fromtimestamp(one, UTC).day for one in found.time_s]
    assert days == [int(one[:2].strip("./")) for one in dates]
    assert not any("behind a blank" in note for note in found.notes)


def test_vbo_whose_comment_has_letters_that_are_longer_in_lower_case() -> None:
    text = (
        "File created on 13/05/2026 at 10:15\n[header]\nİİİİİİİİİİİİİİ\n[column names]\n"
        "time lat long velocity\n[data]\n101530.00 +3606.0 -01494.0 12.0\n"
    )
    found = vbo_table(Text(Path("a.vbo"), text.encode()))
    assert found is not None
    assert b"60.100000000" in found.data


def test_vbo_whose_times_are_beyond_the_last_year() -> None:
    text = (
        "File created on 31/12/9999 at 10:15\n[column names]\ntime lat long\n"
        "[data]\n250000 +3606.0 -01494.0\n"
    )
    found = vbo_table(Text(Path("a.vbo"), text.encode()))
    assert found is not None
    assert b"60.100000000" in found.data


def test_address_of_thousands_of_digits_is_left_out() -> None:
    scan = {"deliveryTime": "2026-05-01T10:00:00Z", "devicesRecords": [{"mac": "0" * 5000}]}
    records, notes = timeline_records({"rawSignals": [{"wifiScan": scan}]})
    assert not records
    assert notes[0] == "1 access point without an address left out"
