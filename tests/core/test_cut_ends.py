"""Ends of tables that were cut while written or copied are left out; honest ones are kept."""

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapfilter._cut_ends import without_cut_row, without_zero_end

HEADER = b"time_s,value\n"
LEVELS_DBM = [-85 - n % 20 for n in range(30)]


def table(texts, end=b""):
    """Return the rows of a table below its header, without the last line's end."""
    return HEADER + b"\n".join(b"%d,%s" % (n, text) for n, text in enumerate(texts)) + end


def is_kept(data, separator=","):
    kept, why = without_cut_row(data, separator, len(HEADER))
    assert bool(why) == (kept != data)
    assert kept == data or kept == data[: data.rfind(b"\n") + 1]
    return not why


@given(
    value=st.floats(-1e6, 1e6),
    decimals=st.integers(1, 8),
    rows=st.integers(5, 60),
    data=st.data(),
)
def test_a_number_of_fixed_decimals_is_kept_whole_and_left_out_where_digits_are_lost(
    value, decimals, rows, data
):
    texts = [b"%.*f" % (decimals, value + n) for n in range(rows + 1)]
    assert is_kept(table(texts))
    most = decimals + 1 if decimals > 1 or rows >= 20 else 0
    if most:
        left = data.draw(st.integers(0, len(texts[-1]) - most))
        cut = table([*texts[:-1], texts[-1][:left]])
        assert not is_kept(cut)
        assert is_kept(cut + b"\n")


@given(
    values=st.lists(st.integers(30, 140), min_size=1, max_size=60),
    end=st.sampled_from([b"", b"\n", b"\r\n", b"\r"]),
)
def test_whole_numbers_of_one_size_are_kept(values, end):
    assert is_kept(table([b"-%d" % value for value in values], end))


@given(seed=st.integers(0, 2**32 - 1), rows=st.integers(5, 40))
def test_numbers_as_short_as_possible_are_hardly_ever_taken_for_cut(seed, rows):
    # Of all rows, in whichever order, one at most can be the last one that is left out.
    values = [random.Random(seed + n).randrange(100_000) / 100 for n in range(rows)]
    texts = [b"%g" % value for value in values]
    orders = [[*texts[:n], *texts[n + 1 :], texts[n]] for n in range(rows)]
    assert sum(not is_kept(table(order)) for order in orders) <= 1


@pytest.mark.parametrize("left", ["-8", "-1", "-", ""])
def test_a_whole_number_far_smaller_than_all_others_is_cut(left):
    texts = [b"%d" % level for level in LEVELS_DBM]
    assert is_kept(table(texts))
    assert not is_kept(table([*texts, left.encode()]))


@pytest.mark.parametrize("last", [b"-99", b"-20", b"0", b"-85", b"", b"n/a"])
def test_other_whole_numbers_are_not(last):
    texts = [b"%d" % level for level in LEVELS_DBM]
    if not last:
        texts[3] = b""
    assert is_kept(table([*texts, last]))


def test_a_speed_of_zero_ends_many_journeys():
    assert is_kept(table([*(b"%g" % (n + 0.25 * (n % 3 + 1)) for n in range(3, 40)), b"0"]))


@pytest.mark.parametrize(
    "rows", [b"0,1.25\n1,1.5\n2,1", b"0,1.25", b"", b"0,1\n1", b"0,1,1\n1\n2,1\n3"]
)
def test_little_is_known_of_few_rows(rows):
    expected = rows != b"0,1\n1"
    assert is_kept(HEADER + rows) == expected


def test_decimal_commas_and_quotes():
    texts = [b"%d,%02d" % (385_400 + n, n + 10) for n in range(10)]
    rows = b"time_s;value\n" + b"\n".join(b"%d;%s" % pair for pair in enumerate(texts))
    assert is_kept(rows, ";")
    assert not is_kept(rows + b"\n10;38", ";")
    assert is_kept(rows + b'\n10;"38"', ";")


def test_of_a_long_table_the_end_is_looked_at():
    data = table([b"385400.25"] * 50_000)
    assert is_kept(data)
    assert not is_kept(data[:-5])
    # A row far above is of another kind.
    assert not is_kept(HEADER + b"0,3\n" + data[len(HEADER) :][:-5])


@given(rows=st.integers(0, 20), zeros=st.integers(1, 5000), end=st.sampled_from([b"\n", b"\r\n"]))
def test_zero_bytes_at_the_end_take_no_whole_row(rows, zeros, end):
    data = end.join([b"time_s,value", *(b"%d,1.25" % n for n in range(rows))]) + end
    for part in (b"", b"77,1.2", b"7"):
        kept, note = without_zero_end(data + part + bytes(zeros))
        assert kept == data
        assert note.startswith(f"{zeros} zero byte{'s' * (zeros > 1)} at the end (line {rows + 2})")
        assert ("unfinished row" in note) == bool(part)
    assert without_zero_end(data) == (data, "")


def test_zero_bytes_elsewhere_and_whole_documents_stay():
    assert without_zero_end(b"a\n\0b\n") == (b"a\n\0b\n", "")
    assert without_zero_end(b'{"a":\n1}\0\0')[0] == b'{"a":\n1}'
    assert without_zero_end(b"\0\0") == (b"", "2 zero bytes at the end (line 1) left out")
