"""Rows of benchmarks on recordings, against sums by hand."""

from math import isnan, nan

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapfilter.errors import InputError, StoreError
from mapfilter.experiments.recorded.benchmark import check_there
from mapfilter.experiments.recorded.rows import (
    Found,
    read_found,
    table_intervals,
    table_rows,
    unit_rows,
    worst_of,
    write_found,
)

ASKED = [
    "part",
    "method",
    "unit_count",
    "n",
    "median_m",
    "mean_m",
    "p95_m",
    "success",
    "success_low",
    "success_high",
    "coverage_95",
    "baseline_m",
    "published_m",
]


def _found(unit="u", errors=(1.0,), *, part="p", method="m", success=True, wrong=False, **more):
    given_m = np.array(errors, dtype=np.float64)
    covered = np.asarray(more.pop("covered", given_m <= 2.0))
    return Found(part, method, unit, success, success, wrong, given_m, covered, **more)


def test_a_row_has_the_columns_of_the_contract_and_sums_by_hand():
    found = [
        _found("a", (1.0, 2.0, 3.0), baseline_m=np.array([5.0, 7.0])),
        _found("a", (5.0,), success=False, wrong=True),
        _found("b", (9.0,), baseline_m=np.array([9.0, nan])),
    ]
    (row,) = table_rows(found, {("p", ""): 4.0})
    assert list(vars(row)) == ASKED
    assert (row.unit_count, row.n, row.median_m, row.mean_m) == (2, 5, 3.0, 4.0)
    assert row.p95_m == pytest.approx(5.0 + 0.8 * 4.0)
    assert row.success == pytest.approx(2 / 3)
    assert row.success_low < 2 / 3 < row.success_high
    assert row.coverage_95 == pytest.approx(2 / 5)
    assert (row.baseline_m, row.published_m) == (7.0, 4.0)
    (by_mean,) = table_rows([_found(baseline_m=np.array([1.0, 1.0, 10.0]))], baseline="mean")
    assert by_mean.baseline_m == 4.0


def test_figures_that_are_none_are_nan():
    (row,) = table_rows([_found(errors=(), success=None)])
    assert row.n == 0
    assert all(isnan(v) for v in (row.median_m, row.p95_m, row.success, row.coverage_95))
    assert isnan(row.published_m)


@pytest.mark.parametrize(
    ("key", "expected"), [(("p", "m"), 1.0), (("p", ""), 1.0), (("", ""), 1.0), (("q", ""), nan)]
)
def test_published_figures_are_of_a_method_a_part_or_all(key, expected):
    (row,) = table_rows([_found()], {key: 1.0})
    assert row.published_m == pytest.approx(expected, nan_ok=True)


def test_reports_of_a_table_are_units():
    (row,) = table_rows([_found(errors=(1.0, 2.0), count=3)])
    assert (row.unit_count, row.n) == (3, 2)


def test_errors_without_a_position_count_in_quantiles_and_coverage():
    errors = (1.0, 2.0, 6.0, np.inf, np.inf)
    (row,) = table_rows([_found(errors=errors, covered=np.array([True, True, True, False, False]))])
    assert (row.n, row.median_m, row.mean_m, row.p95_m) == (5, 6.0, 3.0, np.inf)
    assert row.coverage_95 == pytest.approx(3 / 5)
    # One of a hundred does not reach the 95 % quantile, one of ten does.
    for count, finite in ((100, True), (10, False)):
        (row,) = table_rows([_found(errors=(*range(1, count), np.inf))])
        assert np.isfinite(row.p95_m) == finite


def test_neighbouring_points_have_a_share_and_no_interval():
    points = [_found("trace", success=i > 0, dependent=True) for i in range(4)]
    (row,) = table_rows(points)
    assert row.success == 3 / 4
    assert isnan(row.success_low)
    assert isnan(row.success_high)


def test_intervals_are_over_what_is_independent():
    units = [_found(str(i), (i, i + 2.0)) for i in range(12)]
    runs = [_found("one", (1.0, 3.0)), _found("one", (2.0,)), _found("two", (9.0,))]
    reports = [_found("test", np.arange(50.0), count=50)]
    found = {
        "units": (units, 12),
        "runs": (runs, 3),
        "reports": (reports, 50),
    }
    for over, (own, count) in found.items():
        (row,), (interval,) = table_rows(own), table_intervals(own)
        assert (interval.over, interval.count) == (over, count)
        assert interval.median_low_m <= row.median_m <= interval.median_high_m
        assert interval.mean_low_m < row.mean_m < interval.mean_high_m
        assert interval.coverage_low < row.coverage_95 < interval.coverage_high


@pytest.mark.parametrize(
    "own",
    [
        [_found("a", (1.0, 2.0)), _found("b", (3.0,))],
        [_found("a", ()), _found("b", ()), _found("c", ())],
        [_found("a", (float(i),), dependent=True) for i in range(20)],
    ],
    ids=["two units", "no errors", "neighbouring points"],
)
def test_without_three_of_them_there_is_no_interval(own):
    (interval,) = table_intervals(own)
    assert interval.over == ""
    values = (interval.median_low_m, interval.mean_high_m, interval.coverage_low)
    assert all(isnan(value) for value in values)


@given(
    st.lists(st.lists(st.floats(0, 1e4) | st.just(np.inf), max_size=6), min_size=1, max_size=5),
    st.floats(0.0, 1e4),
)
def test_found_is_read_back(tmp_path_factory, errors, after_m):
    file = tmp_path_factory.mktemp("found") / "unit.json"
    written = [_found(str(i), each, after_m=after_m) for i, each in enumerate(errors)]
    write_found(written, file)
    back = read_found(file)
    for old, new in zip(written, back, strict=True):
        np.testing.assert_array_equal(old.error_m, new.error_m)
        np.testing.assert_array_equal(old.covered, new.covered)
        assert new.covered.dtype == np.bool_
        assert (old.after_m, old.success, old.unit) == (new.after_m, new.success, new.unit)
        assert isnan(new.seconds)


def test_figures_of_a_baseline_that_are_none_are_read_back(tmp_path):
    baseline_m = np.array([nan, 2.0, np.inf])
    write_found([_found(baseline_m=baseline_m)], tmp_path / "unit.json")
    (back,) = read_found(tmp_path / "unit.json")
    np.testing.assert_array_equal(back.baseline_m, baseline_m)


def test_an_edited_file_is_refused(tmp_path):
    file = tmp_path / "unit.json"
    write_found([_found()], file)
    file.write_text(file.read_text().replace("1.0", "2.0"))
    with pytest.raises(StoreError):
        read_found(file)


def test_units_and_the_worst_run():
    right = _found("a", (3.0, 30.0), seconds=2.0, real_s=20.0, note="fine", after_m=100.0)
    wrong = _found("a", (1.0,), success=False, wrong=True, seconds=2.0, real_s=20.0, after_m=300.0)
    (row,) = unit_rows([right, wrong])
    assert (row.runs, row.successes, row.wrong, row.after_m) == (2, 1, 1, 200.0)
    assert (row.real_time, row.note) == (10.0, "fine")
    assert worst_of([right, wrong]) is wrong
    assert worst_of([]) is None


def test_missing_files_are_named_together(tmp_path):
    with pytest.raises(InputError, match="the folder of the data set"):
        check_there(tmp_path / "kitti-osm", ("roads.tif",))
    (tmp_path / "truth").mkdir()
    with pytest.raises(InputError) as error:
        check_there(tmp_path, ("roads.tif", "truth/*.csv"))
    assert "roads.tif" in str(error.value)
    assert "truth/*.csv" in str(error.value)
