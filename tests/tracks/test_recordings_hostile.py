"""Damaged recordings: every reader reads what is whole, or refuses with a message; none crashes."""

import time

import numpy as np
import pytest
from fuzz import MUTATIONS, fuzz
from made_recordings import COUNT, MADE

from mapfilter.errors import InputError, MapfilterError
from mapfilter.tracks.readers import gnsslogger
from mapfilter.tracks.readers.formats import read_recording
from mapfilter.tracks.readers.recorded.recording import Recording
from mapfilter.tracks.readers.recorded.tables import RECORDED
from mapfilter.tracks.readers.texts import lines as lines_reader
from mapfilter.tracks.readers.texts import text as texts


def check(recording: Recording) -> None:
    """Check what every recording promises, whatever it was read from."""
    assert recording.tables
    for table, rows in recording.tables.items():
        assert len(rows), table
        if "time_s" in rows:
            time_s = rows["time_s"].to_numpy()
            assert np.isfinite(time_s).all()
            assert (np.diff(time_s) >= 0).all()
        for known in RECORDED[table]:
            values = rows[known.name]
            if known.text:
                assert not known.required or values.notna().all()
                continue
            numbers = values.to_numpy(dtype=float)
            assert not known.required or np.isfinite(numbers).all(), known.name
            inside = (numbers >= known.low) & (numbers <= known.high)
            assert (inside | np.isnan(numbers)).all(), (table, known.name)
    for found in recording.unusable:
        assert found.count >= len(found.lines) > 0
        assert found.reason


def some(count):
    """Return a quarter of the usual number of copies, for so many formats, else what is asked."""
    return count // 4 if count == MUTATIONS else count


@pytest.fixture
def read(tmp_path):
    def of(name, data):
        path = tmp_path / MADE[name][0]
        path.write_bytes(data)
        recording = read_recording(path)
        check(recording)
        return recording

    return of


@pytest.mark.parametrize("name", MADE)
def test_mutations_are_read_or_refused(name, read, mutation_count):
    sample = MADE[name][1].encode()
    tally = fuzz(sample, lambda data: read(name, data), some(mutation_count))
    assert tally.read > 0


@pytest.mark.parametrize("name", MADE)
def test_mutations_are_read_or_refused_as_the_named_format(name, tmp_path, mutation_count):
    path = tmp_path / MADE[name][0]

    def read_as(data):
        path.write_bytes(data)
        check(read_recording(path, name.partition("/")[0]))

    fuzz(MADE[name][1].encode(), read_as, some(mutation_count), seed=1)


@pytest.mark.parametrize("name", MADE)
def test_a_file_cut_off_anywhere_keeps_its_whole_rows(name, read):
    data = MADE[name][1].encode()
    whole = sum(len(rows) for rows in read(name, data).tables.values())
    counts = []
    for end in range(0, len(data), max(1, len(data) // 37)):
        try:
            counts.append(sum(len(rows) for rows in read(name, data[:end]).tables.values()))
        except InputError:
            counts.append(0)
    assert max(counts) <= whole
    # Half a file keeps about half of its rows; there are two ephemerides only.
    if not name.startswith("rinex-nav"):
        assert counts[len(counts) * 3 // 4] >= 0.4 * whole


# Formats that have all that another one needs, in columns of the same names.
ALIKE = {
    ("towercollector", "opencellid"), ("opencellid", "towercollector"),
    ("opencellid-cells", "opencellid"),
    ("csv", "towercollector"), ("csv", "opencellid"), ("csv", "phyphox"),
    ("csv", "gnettrack"),
}  # fmt: skip


@pytest.mark.parametrize("name", MADE)
def test_every_format_refuses_every_other_file(name, tmp_path):
    for other, (file, text) in MADE.items():
        if other.partition("/")[0] == name.partition("/")[0]:
            continue
        path = tmp_path / file
        path.write_text(text)
        kinds = name.partition("/")[0], other.partition("/")[0]
        if kinds in ALIKE:
            check(read_recording(path, kinds[0]))
            continue
        with pytest.raises(MapfilterError, match=f"use --format {kinds[1]}"):
            check(read_recording(path, kinds[0]))


COMMA = ["towercollector", "opencellid", "opencellid/mls", "opencellid-cells", "sensorlogger"]


@pytest.mark.parametrize("name", COMMA)
@pytest.mark.parametrize("separator", [";", "\t"])
def test_other_separators_and_decimal_commas_change_nothing(name, separator, read):
    text = MADE[name][1]
    plain = read(name, text.encode())
    other = text.replace(",", separator)
    tables = read(name, other.encode()).tables
    for table, rows in plain.tables.items():
        assert tables[table].equals(rows), table
    commas = read(name, other.replace(".", ",").encode()).tables
    for table in set(plain.tables) & {"positions", "cells"}:
        assert commas[table]["lat_deg"].equals(plain.tables[table]["lat_deg"])


@pytest.mark.parametrize("name", ["kitti", "tum"])
@pytest.mark.parametrize("separator", [";", "\t", ",", "  "])
def test_poses_with_other_separators_and_decimal_commas(name, separator, read):
    text = MADE[name][1]
    plain = read(name, text.encode()).tables["poses"]
    head, body = text.split("\n", 1) if name == "tum" else ("", text)
    other = body.replace(" ", separator)
    assert read(name, f"{head}\n{other}".strip().encode()).tables["poses"].equals(plain)
    if separator != ",":
        commas = f"{head}\n{other}".strip().replace(".", ",")
        assert read(name, commas.encode()).tables["poses"].equals(plain)


@pytest.mark.parametrize(
    ("name", "own", "other", "told"),
    [
        ("nmea", ",", ";", "NMEA 0183 with semicolons where commas should be"),
        ("gnsslogger", ",", ";", "a GnssLogger text log with semicolons"),
        ("indoor", "\t", ";", "with semicolons where tabs should be"),
    ],
)
def test_wrong_separators_are_told(name, own, other, told, read):
    with pytest.raises(InputError, match=told):
        read(name, MADE[name][1].replace(own, other).encode())


BY_LINES = [
    *("gnettrack", "towercollector", "opencellid", "opencellid/mls", "nmea", "gnsslogger"),
    *("smartloc", "smartloc-raw", "indoor", "phyphox", "sensorlogger", "tum", "csv"),
    *("nemo", "tems", "tems/lte"),
]


@pytest.mark.parametrize("name", BY_LINES)
def test_lines_that_are_repeated_change_nothing(name, read):
    lines = MADE[name][1].splitlines()
    third = len(lines) // 3
    twice = lines[:third] + [line for line in lines[third:] for _ in range(2)]
    plain = read(name, "\n".join(lines).encode())
    recording = read(name, "\n".join(twice).encode())
    for table, rows in plain.tables.items():
        assert len(recording.tables[table]) == len(rows), table
        assert recording.tables[table]["time_s"].equals(rows["time_s"]), table
    assert recording.unusable == ()


@pytest.mark.parametrize("name", [name for name in BY_LINES if name != "tems/lte"])
def test_times_that_go_backwards_are_sorted(name, read):
    lines = MADE[name][1].splitlines()
    half, part = len(lines) // 2, len(lines) // 4
    moved = lines[:half] + lines[half + part :] + lines[half : half + part]
    plain = read(name, "\n".join(lines).encode())
    recording = read(name, "\n".join(moved).encode())
    for table, rows in plain.tables.items():
        assert recording.tables[table]["time_s"].equals(rows["time_s"]), table
    assert any("go backwards" in note for note in recording.notes) or name == "nmea"


LEAP = {
    "gnettrack": ("_13.00.58", "_13.00.60"),
    "towercollector": ("10:00:58", "10:00:60"),
    "gpx": ("10:00:58Z", "10:00:60Z"),
    "csv": ("13:00:58+", "13:00:60+"),
    "antennas": ("13:00:58:500", "13:00:60:500"),
    "nemo": ("13:00:58.250", "13:00:60.250"),
    "tems": ("13:00:58.500", "13:00:60.500"),
    "tems/lte": ("13:00:58.500", "13:00:60.500"),
}


@pytest.mark.parametrize("name", LEAP)
def test_a_leap_second_is_the_first_of_the_next_minute(name, read):
    text = MADE[name][1]
    assert LEAP[name][0] in text
    plain = read(name, text.encode()).tables
    leap = read(name, text.replace(*LEAP[name]).encode())
    assert leap.unusable == ()
    for table, rows in leap.tables.items():
        late_s = rows["time_s"] - plain[table]["time_s"]
        assert late_s.iloc[-1] == 2.0, table
        assert set(late_s) == {0.0, 2.0}, table


YEAR = {
    "gpx": "2026-05-01T10:00:30",
    "towercollector": "2026-05-01T10:00:30",
    "csv": "2026-05-01T13:00:30",
    "antennas": "2026-05-01 13:00:30",
    "gnettrack": "2026.05.01_13.00.30",
    "tems": "01/05/2026 13:00:30",
}


@pytest.mark.parametrize("name", YEAR)
def test_a_time_that_jumps_years_is_refused_alone(name, read):
    text = MADE[name][1]
    assert YEAR[name] in text
    plain = read(name, text.encode()).tables
    jumped = read(name, text.replace(YEAR[name], YEAR[name].replace("2026", "2036")).encode())
    assert [one.reason for one in jumped.unusable] == [
        "time: more than a day away from all other rows"
    ]
    for table, rows in plain.items():
        moment = rows["time_s"].iloc[0] + 30.0
        left = rows["time_s"][(rows["time_s"] - moment).abs() > 0.6]
        assert jumped.tables[table]["time_s"].tolist() == left.tolist(), table


@pytest.mark.parametrize("name", COMMA)
def test_swapped_columns_change_nothing(name, read):
    text = MADE[name][1]
    plain = read(name, text.encode())
    rows = [line.split(",") for line in text.splitlines()]
    turned = "\n".join(",".join(reversed(row)) for row in rows)
    for table, expected in plain.tables.items():
        assert read(name, turned.encode()).tables[table].equals(expected), table


def test_latitude_and_longitude_swapped_in_the_file_are_told(read):
    text = MADE["opencellid"][1]
    far = text.replace(",24.94", ",124.94")
    swapped = "\n".join(
        ",".join([*row[:4], row[5], row[4], *row[6:]]) if i else ",".join(row)
        for i, row in enumerate(line.split(",") for line in far.splitlines())
    )
    recording = read("opencellid", swapped.encode())
    assert "positions" not in recording.tables
    assert "latitude and longitude swapped" in recording.unusable[0].reason


def test_a_quote_that_is_never_closed_ends_with_its_line(read):
    lines = MADE["towercollector"][1].splitlines()
    lines[5] = lines[5].replace('"P"', '"P')
    lines[7] = lines[7].replace(",LTE", ',"LTE')
    recording = read("towercollector", "\n".join(lines).encode())
    assert len(recording.tables["radio"]) == 2 * COUNT


@pytest.mark.parametrize("name", COMMA)
@pytest.mark.parametrize("quote", ["", '"'])
def test_a_separator_at_the_end_of_the_header_alone(name, quote, read):
    """All rows were refused, as if they were cut off."""
    plain = read(name, MADE[name][1].encode())
    head, *lines = MADE[name][1].splitlines()
    lines[0] = lines[0].replace("P", f"{quote}P{quote}")
    found = read(name, "\n".join([head + ",", *lines, ""]).encode())
    assert not found.unusable
    for table, rows in plain.tables.items():
        assert found.tables[table].equals(rows), table


def test_a_quoted_separator_does_not_stand_for_a_field_that_is_missing(read):
    """Counted with it, the line has all its fields, each but the first ones of its neighbour."""
    lines = MADE["opencellid"][1].splitlines()
    fields = lines[5].split(",")
    lines[5] = ",".join([*fields[:2], f'"{fields[2]},{fields[3]}"', *fields[4:]])
    assert lines[5].count(",") == lines[4].count(",")
    recording = read("opencellid", "\n".join(lines).encode())
    assert len(recording.tables["radio"]) == COUNT - 1
    assert "fewer fields" in recording.unusable[0].reason


def test_a_long_line_is_refused_alone(read):
    lines = MADE["opencellid"][1].splitlines()
    lines[5] += "x" * 100_000
    recording = read("opencellid", "\n".join(lines).encode())
    assert len(recording.tables["radio"]) == COUNT - 1


def test_a_gpx_with_entities_is_not_expanded(read):
    bomb = '<!DOCTYPE x [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;&a;&a;">]>'
    data = MADE["gpx"][1].replace("<gpx ", bomb + "<gpx ").encode()
    with pytest.raises(InputError):
        read("gpx", data)


BY_PARTS = [
    "tems",
    "tems/lte",
    "towercollector",
    "opencellid",
    "opencellid-cells",
    "phyphox",
    "sensorlogger",
    "csv",
]


@pytest.mark.parametrize("name", BY_PARTS)
def test_a_large_file_is_read_part_by_part(name, read, monkeypatch):
    lines = MADE[name][1].splitlines()
    lines[20] = "bad"
    data = "\n".join(["", *lines]).encode()
    whole = read(name, data)
    monkeypatch.setattr(texts, "_PART_BYTES", 300)
    parts = read(name, data)
    assert parts.unusable == whole.unusable
    assert parts.rows == whole.rows
    for table, rows in whole.tables.items():
        assert parts.tables[table].equals(rows), table


BY_BLOCKS = ["antennas", "kitti", "tum", "nmea", "gnsslogger", "rinex-obs", "indoor", "rinex-obs/2"]


@pytest.mark.parametrize("name", BY_BLOCKS)
def test_a_large_file_is_read_block_by_block(name, read, monkeypatch):
    lines = MADE[name][1].splitlines()
    lines[len(lines) // 2] = "bad"
    data = "\n".join(lines).encode()
    whole = read(name, data)
    monkeypatch.setattr(lines_reader, "_BLOCK_BYTES", 300)
    monkeypatch.setattr(gnsslogger, "_BLOCK_BYTES", 300)
    blocks = read(name, data)
    assert {one.reason: one.count for one in blocks.unusable} == {
        one.reason: one.count for one in whole.unusable
    }
    assert blocks.rows == whole.rows
    for table, rows in whole.tables.items():
        keys = [key for key in ("time_s", "satellite", "cell") if key in rows]
        mine, other = (
            of.sort_values(keys, kind="stable").reset_index(drop=True)
            for of in (blocks.tables[table], rows)
        )
        assert mine.equals(other), table


def test_a_number_of_many_digits_takes_no_time(tmp_path):
    path = tmp_path / "digits.txt"
    path.write_text(f"{'9' * 50_000}x\n" * 20)
    began_s = time.process_time()
    with pytest.raises(InputError, match="none of them"):
        read_recording(path)
    assert time.process_time() - began_s < 2.0
