"""NMEA sentences of loggers that write a time stamp, or another word, before each of them."""

from functools import reduce

import numpy as np
import pandas as pd
import pytest

from mapfilter.tracks.readers.formats import read_recording

NOON_S = 1_714_564_800.0


def sentence(body):
    return f"${body}*{reduce(lambda total, letter: total ^ ord(letter), body, 0):02X}"


def gga(time_s, north=0):
    time = pd.to_datetime(time_s, unit="s").strftime("%H%M%S.00")
    minutes = f"6010.{2000 + 10 * north:04d},N,02456.1000,E"
    return sentence(f"GPGGA,{time},{minutes},1,08,1.0,20.0,M,18.0,M,,")


def rmc(time_s, north=0):
    time, day = pd.to_datetime(time_s, unit="s").strftime("%H%M%S.00 %d%m%y").split()
    minutes = f"6010.{2000 + 10 * north:04d},N,02456.1000,E"
    return sentence(f"GPRMC,{time},A,{minutes},10.0,0.0,{day},,,A")


def read(tmp_path, lines):
    path = tmp_path / "log.txt"
    path.write_text("\n".join(lines) + "\n")
    return read_recording(path)


def test_sentences_without_a_time_pass_no_midnight(tmp_path):
    """In the afternoon, where nothing has a date: all times after them were a day late."""
    lost = [sentence("GPGGA,,,,,,0,,,,,,,,")] * 2
    start_s = NOON_S + 11.9 * 3600
    lines = [gga(start_s + 60 * k, k) for k in range(20)]
    rows = read(tmp_path, [*lost, *lines[:3], *lost, *lines[3:], *lost]).tables["positions"]
    np.testing.assert_allclose(rows["time_s"], 23.9 * 3600 + 60 * np.arange(20.0))


def test_positions_without_a_time_are_counted(tmp_path):
    timeless = sentence("GPGGA,,6010.2000,N,02456.1000,E,1,08,1.0,20.0,M,18.0,M,,")
    found = read(tmp_path, [gga(NOON_S), timeless, timeless, gga(NOON_S + 1)])
    assert len(found.tables["positions"]) == 2
    assert [(one.count, one.lines) for one in found.unusable] == [(2, (2, 3))]


def test_stamps_beside_a_pause_tell_the_day_in_a_long_file(tmp_path):
    """Of long files not every stamp is read."""
    time_s = NOON_S + np.append(np.arange(2400.0), 90_000 + np.arange(2401.0))
    stamps = pd.to_datetime(time_s, unit="s").strftime("%Y-%m-%d %H:%M:%S ")
    lines = [stamps[k] + gga(one_s, k % 700) for k, one_s in enumerate(time_s)]
    np.testing.assert_array_equal(read(tmp_path, lines).tables["positions"]["time_s"], time_s)


@pytest.mark.parametrize(
    "before",
    [
        "2024-05-01T12:00:00.123 ",
        "123456,",
        "1714564800123 ",
        "[12:00:00.123] ",
        "2024-05-01,12:00:00,",
        "12:00:00  ",
        "INFO gps: ",
        '"2024-05-01 12:00:00";',
    ],
)
def test_what_stands_before_a_sentence_is_left_out(before, tmp_path):
    """The file was refused as a CSV without a column of times."""
    lines = [text for k in range(30) for text in (rmc(NOON_S + k, k), gga(NOON_S + k, k))]
    plain = read(tmp_path, lines)
    stamped = read(tmp_path, [before + line for line in lines])
    assert stamped.format == "nmea"
    pd.testing.assert_frame_equal(stamped.tables["positions"], plain.tables["positions"])
    assert not stamped.unusable
    assert stamped.notes == plain.notes == ()


@pytest.mark.parametrize(
    ("stamp", "local_h"),
    [
        ("%Y-%m-%dT%H:%M:%S.123Z ", 0),
        ("%Y-%m-%dT%H:%M:%S+02:00,", 2),
        ("%Y/%m/%d %H:%M:%S ", -7),
        ("%Y-%m-%d %H:%M:%S,", 10),
        ("epoch", 0),
        ("epoch_ms", 0),
    ],
)
def test_its_date_counts_where_no_sentence_has_one(stamp, local_h, tmp_path):
    """Times counted from an unknown midnight. The log goes on over one."""
    time_s = NOON_S + 43_200 + np.arange(-300.0, 300.0, 10.0)
    lines = []
    for k, at_s in enumerate(time_s.tolist()):
        before = pd.to_datetime(at_s + 3600 * local_h, unit="s").strftime(stamp)
        if stamp.startswith("epoch"):
            before = f"{at_s + 0.2:.3f} " if stamp == "epoch" else f"{1000 * at_s + 200:.0f} "
        lines.append(before + gga(at_s, k))
    found = read(tmp_path, lines)
    np.testing.assert_array_equal(found.tables["positions"]["time_s"], time_s)
    assert found.clock.kind == "utc"
    assert "dates are those of the time stamps before the sentences" in found.notes


@pytest.mark.parametrize("before", ["", "123456,", "12:00:00.123 ", "2024-13-41T10:00:00 "])
def test_without_a_date_times_count_from_a_midnight(before, tmp_path):
    found = read(tmp_path, [before + gga(NOON_S + k, k) for k in range(20)])
    assert found.clock.kind == "monotonic"
    assert found.tables["positions"]["time_s"].iloc[0] == 43_200.0


def test_a_table_with_a_sentence_among_its_columns_stays_a_table(tmp_path):
    rows = [f'{NOON_S + k},-80,60.17,24.93,"{gga(NOON_S + k, k)}"' for k in range(20)]
    found = read(tmp_path, ["time,level_dbm,lat,lon,sentence", *rows])
    assert found.format == "csv"
