"""Lines of separated values against the csv module; blocks, blanks, events and kinds of lines."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from mapfilter.tracks.readers.recorded.reading import Reading
from mapfilter.tracks.readers.texts import lines as _lines
from mapfilter.tracks.readers.texts.events import read_events
from mapfilter.tracks.readers.texts.grouped import columns_of, group_lines
from mapfilter.tracks.readers.texts.lines import LONGEST_LINE, blocks, good_lines
from mapfilter.tracks.readers.texts.separated_values import (
    header_columns,
    header_names,
    likely_separator,
    line_columns,
    split_blanks,
    value_columns,
)
from mapfilter.tracks.readers.texts.text import Text
from mapfilter.tracks.readers.texts.title_lines import below_title


def refused(reading):
    return {reason: np.concatenate(of).tolist() for reason, of in sorted(reading._refused.items())}


def table(rows):
    """Return lines, texts by column, rows counted, and what was refused."""
    reading = rows.reading
    return (
        rows.line.tolist(),
        [rows.texts(name).tolist() for name in rows.names],
        reading.rows,
        refused(reading),
    )


FEWER, MORE = (
    "fewer fields than 3 (likely: cut off, or another separator)",
    "more fields than 3 (likely: a separator within a field{})",
)


def by_the_csv_module(data, separator, least):
    """Read each line alone; blank ones are none, and absent last fields are empty."""
    lines, columns, count, bad = [], [[], [], []], 0, {}
    for number, line in enumerate(data.split("\n"), start=1):
        if not line.strip():
            continue
        count += 1
        fields = next(csv.reader([line], delimiter=separator))
        if '"' in line:
            fields = [one.replace(separator, " ") for one in fields]
        if len(fields) > 3 and not any(one.strip() for one in fields[3:]):
            fields = fields[:3]
        fields += [""] * (3 - len(fields)) * (least <= len(fields))
        if len(fields) == 3:
            lines.append(number)
            for column, one in zip(columns, fields, strict=True):
                column.append(one.strip())
            continue
        decimal = ", as decimal commas" if separator == "," else ""
        reason = FEWER if len(fields) < 3 else MORE.format(decimal)
        bad.setdefault(reason, []).append(number)
    return lines, columns, count, bad


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("separator", [",", ";", "\t"])
@pytest.mark.parametrize("quoted", [False, True])
def test_tables_are_read_as_line_by_line(seed, separator, quoted, monkeypatch):
    rng = np.random.default_rng(seed)
    words = ["1", "-2.5", "word", "", " blank ", "Ä"]
    if quoted:
        words += ['"in quotes"', f'"a{separator}b"', '"x y"']
    counts = rng.choice([3, 3, 3, 3, 2, 1, 4, 5], 60) - 1
    lines = [separator.join(["n", *rng.choice(words, count)]) for count in counts]
    lines += [*["1" + 4 * separator] * 3, "", "  "]
    rng.shuffle(lines)
    data = "\n".join(lines) + "\n" * int(seed % 2)
    least = 2 if seed % 4 < 2 else 3
    for size in (64, 1 << 21):
        monkeypatch.setattr(_lines, "_BLOCK_BYTES", size)
        rows = value_columns(
            memoryview(data.encode()), Reading(Path("a")), ("a", "b", "c"), separator, ragged=least
        )
        assert table(rows) == by_the_csv_module(data, separator, least)


def test_numbers_with_commas_in_quotes_have_points():
    given = b'"1,5","-0,25","x,5"\n"1,500","12,345,678","0,125"\n"1,25,5",2,3\n'
    rows = value_columns(memoryview(given), Reading(Path("a")), ("a", "b", "c"), ",")
    # Thousands stay, and their commas are blanks as others are.
    assert [rows.texts(name).tolist() for name in "abc"] == [
        ["1.5", "1 500", "1 25 5"],
        ["-0.25", "12 345 678", "2"],
        ["x 5", "0.125", "3"],
    ]


def test_a_quote_that_is_never_closed_ends_with_its_line():
    given = b'1,"2,3\n4,5,6\n"7,8",9,10\n'
    rows = value_columns(memoryview(given), Reading(Path("a")), ("a", "b", "c"), ",")
    assert rows.line.tolist() == [1, 2, 3]
    assert rows.texts("a").tolist() == ["1", "4", "7.8"]


def test_the_longest_line():
    for more, kept in ((0, [1, 2]), (1, [2])):
        for tail in (b"", b",,"):
            first = b"1,2," + b"x" * (LONGEST_LINE - 4 - len(tail) + more) + tail
            reading = Reading(Path("a"))
            _, rows = good_lines(first + b"\n4,5,6\n", 1, 3, ",", reading, 3)
            assert rows.tolist() == kept
            assert reading.rows == 2
            reasons = {f"longer than {LONGEST_LINE} characters": [1]} if more else {}
            assert refused(reading) == reasons


@pytest.mark.parametrize("size", [1, 5, 6, 7, 12, 100])
def test_blocks_are_whole_lines_of_about_a_size(size, monkeypatch):
    data = b"first\nsecond line\n\nx\nthe last one has no end"
    for piece in (2, 1 << 21):
        monkeypatch.setattr(_lines, "_BLOCK_BYTES", piece)
        found = list(blocks(memoryview(data), 7, size))
        assert b"".join(block for block, _ in found) == data
        at = 0
        for block, line in found:
            assert line == 7 + data[:at].count(b"\n")
            at += len(block)
            assert at == len(data) or block.endswith(b"\n")
            # It ends with the line in which its size is reached.
            assert at == len(data) or (b"\n" not in block[size:-1] and len(block) >= size)
    assert list(blocks(memoryview(b""), 1)) == []


def test_the_separator_and_the_names_of_a_header():
    assert [likely_separator(one) for one in ("a,b;c;d", "a\tb,c", "a|b|c", "a", "a;b,c")] == [
        *(";", ",", "|", ",", ",")
    ]
    assert header_names('Time ,"LAT, deg",lon', ",") == ("time", "lat, deg", "lon")
    assert header_names("", ",") == ()
    assert header_names("x" * (LONGEST_LINE + 5), ",") == ("x" * LONGEST_LINE,)


def test_the_first_line_that_is_not_blank_names_the_columns():
    reading = Reading(Path("a"))
    rows = header_columns(b"\n \nA;B;\n1;2\n3;4\n5\n", reading, 4)
    assert rows.names == ("a", "b", "")
    assert rows.line.tolist() == [7, 8]
    assert rows.texts("b").tolist() == ["2", "4"]
    assert refused(reading) == {FEWER: [9]}
    # Last fields may be absent where a program leaves them out.
    reading = Reading(Path("a"))
    assert header_columns(b"a,b,c\n1\n2,3,4\n", reading, ragged=1).line.tolist() == [2, 3]
    reading = Reading(Path("a"))
    assert header_columns(b"a,b,c\n1\n2,3\n", reading, ragged=2).line.tolist() == [3]
    assert len(header_columns(b" \n\n", Reading(Path("a")))) == 0


def test_headers_that_are_repeated_are_left_out_and_counted():
    reading = Reading(Path("a"))
    rows = header_columns(b"a,b\na,b\n1,2\na,b\na,b\n3,4\na,b\n5,6\n", reading)
    assert rows.texts("a").tolist() == ["1", "3", "5"]
    assert rows.line.tolist() == [3, 6, 8]
    assert reading.notes == ["4 lines repeat the header, left out"]
    # A header of one column may be a value.
    reading = Reading(Path("a"))
    assert header_columns(b"a\n1\na\n2\n", reading).texts("a").tolist() == ["1", "a", "2"]
    assert reading.notes == []


def test_lines_that_are_picked_keep_their_numbers():
    lines = [b"1 2", b"3", b"4 5"]
    rows = line_columns(lines, [10, 20, 35], Reading(Path("a")), ["x", "y"], " ")
    assert rows.line.tolist() == [10, 35]
    assert rows.texts("y").tolist() == ["2", "5"]
    assert len(line_columns([], [], Reading(Path("a")), ["x", "y"], " ")) == 0


@pytest.mark.parametrize(
    ("data", "split"),
    [
        (b"1  2\t3\n", b"1 2 3\n"),
        (b" 1 2 \n\t3 \t 4\n", b"1 2\n3 4\n"),
        (b"1 2\n3 4", b"1 2\n3 4"),
        (b"1 2\n3 4 ", b"1 2\n3 4"),
        (b"1\n\n 2", b"1\n\n2"),
    ],
)
def test_runs_of_blanks_are_one(data, split):
    assert split_blanks(data) == split


EVENTS = """#START,100000.000,x
POS,23:59:58.500,,1.5,60
POS,23:59:59.250,,"2,5",61
odd line
OTHER,00:00:00.000,1
POS,00:00:00.750,,4
NEG,00:00:01.000

POS,no time,,7,8
"""


@pytest.mark.parametrize("size", [16, 1 << 21])
def test_events_by_kind_and_place(size, monkeypatch):
    monkeypatch.setattr(_lines, "_BLOCK_BYTES", size)
    reading, others = Reading(Path("a")), {}
    parts = list(read_events(EVENTS.encode(), ",", ("POS", "NEG"), reading, others))
    assert (len(parts) == 1) is (size > 100)
    assert others == {"#START": 1, "OTHER": 1}
    assert refused(reading) == {"no line of this format": [4]}
    assert reading.rows == 8
    kind = np.concatenate([part.kind for part in parts]).tolist()
    line = np.concatenate([part.line for part in parts]).tolist()
    fields = np.concatenate([part.fields for part in parts]).tolist()
    time_s = np.concatenate([part.time_s for part in parts])
    assert kind == ["POS", "POS", "POS", "NEG", "POS"]
    assert line == [2, 3, 6, 7, 9]
    assert fields == [5, 5, 4, 2, 5]
    day_s = 86_400.0
    expected = [day_s - 1.5, day_s - 0.75, day_s + 0.75, day_s + 1.0, np.nan]
    np.testing.assert_allclose(time_s, expected)
    texts = []
    for part in parts:
        at = np.flatnonzero(part.kind == "POS")
        rows = part.columns(at, x=3, y=np.full(len(at), 4), none=-1, beyond=9)
        assert rows.line.tolist() == part.line[at].tolist()
        assert not rows.decimal_comma
        names = ("x", "y", "none", "beyond")
        texts += list(zip(*(rows.texts(one).tolist() for one in names), strict=True))
    # Within quotes a separator is a blank.
    assert texts == [("1.5", "60", "", ""), ("2 5", "61", "", ""), ("4", "", "", ""),
                     ("7", "8", "", "")]  # fmt: skip


def test_lines_by_the_kind_that_they_name():
    data = b"A 1 2\nB 3\n\nA 4 5\nC_C 6\nC_C 7\n?! 8\nskip\n" + b"D" * 50 + b" 9\n"
    reading = Reading(Path("a"))
    groups = group_lines(
        data, reading, lambda line: b"" if line == b"skip" else line.split()[0],
        frozenset(("A", "B")),
    )  # fmt: skip
    assert groups == {"A": ([b"A 1 2", b"A 4 5"], [1, 4]), "B": ([b"B 3"], [2])}
    assert reading.rows == 4
    assert refused(reading) == {"no line of this format": [7, 9]}
    assert reading.notes == ["2 rows of 'C_C' are not used"]
    rows = columns_of(groups, "A", "kind x y", " ", reading)
    assert rows.line.tolist() == [1, 4]
    assert rows.number("y").tolist() == [2.0, 5.0]
    assert columns_of(groups, "E", "kind x", " ", reading) is None
    assert len(columns_of(groups, "B", "kind x y", " ", Reading(Path("a")))) == 0
    assert columns_of(groups, "B", "kind x y", " ", Reading(Path("a")), least=2).line.tolist() == [
        2
    ]


@pytest.mark.parametrize(("above", "found"), [(0, False), (1, True), (29, True), (30, False)])
def test_a_header_stands_below_29_lines_of_a_title_at_most(above, found):
    data = b"a title\n" * above + b"time,lat\n1,2\n"
    text = Text(Path("a.csv"), data, ("noted",), 5)
    below = below_title(text, lambda line: line.first_line.startswith("time"))
    assert (below is not None) is found
    if found:
        assert (below.data, below.line) == (b"time,lat\n1,2\n", 5 + above)
        lines = "1 line" if above == 1 else f"{above} lines"
        assert below.notes == ("noted", f"{lines} above the header left out")
