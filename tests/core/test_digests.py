"""The digests of results: any value that changes changes them, and a comparison says where."""

import math

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from digests import differences, digest, table_digests, without_times


@pytest.mark.parametrize(
    "values",
    [np.arange(6.0), np.arange(6).reshape(2, 3), np.array([True, False])],
    ids=["floats", "integers", "bools"],
)
def test_one_value_changes_the_digest_of_an_array(values):
    assert digest(values) == digest(values.copy())
    for index in range(values.size):
        changed = values.copy()
        before = changed.flat[index]
        changed.flat[index] = np.nextafter(before, 9) if values.dtype == float else not before
        if changed.flat[index] != before:
            assert digest(changed) != digest(values)


def test_kind_and_shape_count_and_the_bits_of_nan_do_not():
    values = np.arange(6.0)
    assert digest(values) != digest(values.reshape(2, 3))
    assert digest(values) != digest(values.astype(int))
    payload = np.array([0x7FF8000000000001], dtype=np.uint64).view(float)
    assert digest(payload) == digest(np.array([math.nan]))
    assert digest(np.array([0.0])) != digest(np.array([-0.0]))


def test_text_nulls_and_nested_figures_count():
    found = {digest(one) for one in (["a", "b"], ["a", "c"], ["a", None], [b"a"], {"a": 1.0}, [])}
    assert len(found) == 6
    assert digest({"a": 1, "b": 2}) == digest({"b": 2, "a": 1})


def test_a_table_s_digests_are_of_its_values_and_not_of_its_file(tmp_path):
    table = pa.table({"east_m": [1.0, math.nan], "status": ["SEARCHING", "TRACKING"]})
    for name, table_now in (("a", table), ("b", table.replace_schema_metadata({"version": "2"}))):
        pq.write_table(table_now, tmp_path / name, compression="zstd" if name == "a" else "snappy")
    assert table_digests(tmp_path / "a") == table_digests(tmp_path / "b")
    pq.write_table(table.set_column(0, "east_m", [[1.0, 2.0]]), tmp_path / "b")
    lines = list(differences(table_digests(tmp_path / "a"), table_digests(tmp_path / "b")))
    assert lines == ["east_m: differs"]


def test_a_comparison_says_where_and_times_are_left_out():
    before = {"build": {"points": "1"}, "replay": "2"}
    after = {"build": {"points": "3", "more": "4"}}
    assert list(differences(before, before)) == []
    assert list(differences(before, after)) == [
        "build / more: only after",
        "build / points: differs",
        "replay: only before",
    ]
    rows = {"rows": [{"name": "a", "seconds": 1.0, "error_m": 2.0}]}
    assert without_times(rows) == {"rows": [{"name": "a", "error_m": 2.0}]}
