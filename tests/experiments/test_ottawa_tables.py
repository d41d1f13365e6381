"""Tables of sessions that were found, by hand, and what is kept of them on disk."""

import json
from dataclasses import replace
from math import isnan, nan, radians

import numpy as np
import pytest

from mapfilter._json_files import sealed
from mapfilter.errors import StoreError
from mapfilter.evaluation.success import wilson_interval, wilson_interval_of_routes
from mapfilter.experiments.benchmarks.ottawa import (
    FOLDER,
    GOOD_M,
    LEFT_OUT,
    MAP_M,
    METHODS,
    PARTS,
    FoundSession,
    OttawaOptions,
)
from mapfilter.experiments.benchmarks.ottawa_sessions import LONGEST_GAP_S, ReckoningErrors
from mapfilter.experiments.benchmarks.ottawa_table import (
    LeftOut,
    part_intervals,
    part_rows,
    read_left_out,
    session_rows,
    worst_session,
    write_left_out,
)
from mapfilter.positioning.bayes.options import BayesFilter


def test_the_options_that_were_chosen():
    assert PARTS == ("lacolyoc", "uottawa", "carling")
    assert (FOLDER, LEFT_OUT) == ("cell-ottawa-lte", ("OpenCellID_20200830",))
    assert (GOOD_M, MAP_M, LONGEST_GAP_S, METHODS) == (20.0, 50.0, 30.0, ("bayes", "smoothed"))
    options = OttawaOptions()
    # What a user gets: nothing is set for this benchmark.
    assert options.filter == BayesFilter()
    assert options.errors == ReckoningErrors(0.10, radians(6), radians(5)) == ReckoningErrors()


def run(session, method="bayes", errors=(10.0, 30.0), **changed):
    errors = np.array(errors)
    given = {
        "part": "carling", "session": session, "method": method, "on_map": 0.8,
        "converged": True, "success": True, "switch_m": 100.0, "error_at_switch_m": 20.0,
        "lost": 1, "error_m": errors, "covered": errors < 25.0,
    }  # fmt: skip
    return FoundSession(**given | changed)


CENTROID_M = {"a": np.array([100.0, 200.0, 300.0]), "b": np.array([400.0])}


def test_the_worst_run_is_a_wrong_claim_before_a_large_error():
    """A run that never converged claims nothing, so it is none."""

    def of(name, filtered, error_m):
        return LeftOut(name, CENTROID_M["a"], (filtered, run(name, "smoothed", [error_m])))

    never = of("a", run("a", converged=False, success=False), 30.0)
    right, wrong = of("b", run("b"), 60.0), of("c", run("c", success=False), 40.0)
    assert worst_session([never, right]) == (1, 0)
    assert worst_session([never, right, wrong]) == (2, 0)
    assert worst_session([]) is None


def test_a_row_of_a_part_by_hand():
    found = [
        run("a"), run("a", errors=[50.0, 70.0, 90.0], success=False),
        run("b", errors=[20.0]), run("b", errors=[], success=True),
        run("a", "smoothed", errors=[5.0]), run("b", "smoothed", errors=[7.0, 9.0], success=False),
    ]  # fmt: skip
    bayes, smoothed, centroid = part_rows("carling", found, CENTROID_M)
    assert (bayes.part, bayes.method, bayes.unit_count, bayes.n) == ("carling", "bayes", 2, 6)
    every = np.array([10.0, 30, 50, 70, 90, 20])
    assert (bayes.median_m, bayes.mean_m) == (40.0, 45.0)
    assert bayes.p95_m == pytest.approx(np.quantile(every, 0.95))
    assert bayes.success == 0.75
    assert (bayes.success_low, bayes.success_high) == wilson_interval_of_routes([1, 2], [2, 2])
    # 10 and 20 of six are held.
    assert bayes.coverage_95 == pytest.approx(2 / 6)
    assert bayes.baseline_m == 250.0
    # Once each: runs are one by one.
    assert smoothed.success == 0.5
    assert (smoothed.success_low, smoothed.success_high) == wilson_interval(1, 2)
    assert (smoothed.method, smoothed.n, smoothed.median_m) == ("smoothed", 3, 7.0)
    assert (centroid.method, centroid.unit_count, centroid.n) == ("centroid", 2, 4)
    assert (centroid.median_m, centroid.mean_m, centroid.baseline_m) == (250.0, 250.0, 250.0)
    assert centroid.p95_m == pytest.approx(np.quantile([100, 200, 300, 400], 0.95))
    for value in (centroid.success, centroid.success_low, centroid.success_high,
                  centroid.coverage_95):  # fmt: skip
        assert isnan(value)


def test_sessions_of_which_half_lies_on_the_map_have_a_row_of_their_own():
    found = [run("a", method, on_map=0.5) for method in METHODS]
    found += [run("b", method, on_map=0.49, errors=[400.0]) for method in METHODS]
    rows = {row.method: row for row in part_rows("carling", found, CENTROID_M)}
    assert [one.method for one in part_intervals("carling", found, CENTROID_M)] == list(rows)
    assert list(rows) == ["bayes", "bayes-mapped", "smoothed", "smoothed-mapped", "centroid"]
    mapped = rows["bayes-mapped"]
    assert (mapped.unit_count, mapped.n, mapped.mean_m, mapped.baseline_m) == (1, 2, 20.0, 200.0)
    assert (rows["bayes"].n, rows["bayes"].unit_count) == (3, 2)
    none = [replace(one, on_map=0.1) for one in found]
    assert len(part_rows("carling", none, CENTROID_M)) == 3
    every = [replace(one, on_map=1.0) for one in found]
    assert len(part_rows("carling", every, CENTROID_M)) == 3


def test_intervals_of_the_sessions_on_the_map_leave_out_the_others():
    found = [run(name, method, on_map=0.9) for name in "abc" for method in METHODS]
    alone = {one.method: one for one in part_intervals("carling", found, {})}
    found += [run("d", method, on_map=0.1, errors=[400.0] * 9) for method in METHODS]
    centroid_m = {name: np.array([100.0, 300.0]) for name in "abcd"}
    every = {one.method: one for one in part_intervals("carling", found, centroid_m)}
    assert replace(every["smoothed-mapped"], method="smoothed") == alone["smoothed"]
    assert every["smoothed"].mean_high_m > 100 > every["smoothed-mapped"].mean_high_m
    assert (every["smoothed"].count, every["smoothed-mapped"].count) == (4, 3)
    centroid = every["centroid"]
    assert (centroid.over, centroid.count, centroid.mean_low_m) == ("units", 4, 200.0)
    assert isnan(centroid.coverage_low)


def test_a_part_without_any_fix():
    bayes, _, centroid = part_rows("carling", [], {})
    assert (bayes.unit_count, bayes.n, centroid.n) == (0, 0, 0)
    for value in (bayes.success_low, bayes.success_high, bayes.success, bayes.median_m,
                  bayes.mean_m, bayes.p95_m, bayes.coverage_95,
                  bayes.baseline_m, centroid.median_m):  # fmt: skip
        assert isnan(value)


def test_a_row_of_a_session_by_hand():
    found = [
        run("b"),
        run("a", switch_m=100.0, error_at_switch_m=10.0, lost=2),
        run("a", switch_m=300.0, error_at_switch_m=nan, errors=[50.0], success=False, lost=3),
        run("a", converged=False, success=False, switch_m=9.0, error_at_switch_m=9.0, errors=[]),
        run("a", "smoothed", errors=[5.0, 6.0, 7.0], lost=99),
        run("a", "smoothed", errors=[100.0]),
    ]
    first, second = session_rows(found, CENTROID_M)
    assert (first.part, first.session, first.on_map) == ("carling", "a", 0.8)
    assert (first.runs, first.converged, first.successes, first.n) == (3, 2, 1, 3)
    assert (first.switch_m, first.error_at_switch_m, first.median_m) == (200.0, 10.0, 30.0)
    assert first.coverage_95 == pytest.approx(1 / 3)
    assert (first.smoothed_m, first.centroid_m, first.lost) == (6.5, 200.0, 6)
    assert second.session == "b"
    assert isnan(second.smoothed_m)


def test_what_came_of_a_session_is_read_as_it_was_written(tmp_path):
    one = run("a", switch_m=nan, error_at_switch_m=np.inf, converged=False)
    whole = LeftOut("a", CENTROID_M["a"], (one, run("a", "smoothed", errors=[])))
    write_left_out(whole, tmp_path / "found.json")
    told = json.loads((tmp_path / "found.json").read_text())
    assert told["found"][0]["switch_m"] is None
    read = read_left_out(tmp_path / "found.json")
    assert read.session == "a"
    np.testing.assert_array_equal(read.centroid_m, CENTROID_M["a"])
    again = read.found[0]
    assert isnan(again.switch_m)
    assert isnan(again.error_at_switch_m)
    assert (again.converged, again.success, again.lost, again.on_map) == (False, True, 1, 0.8)
    assert (again.error_m.dtype, again.covered.dtype) == (np.float64, np.bool_)
    np.testing.assert_array_equal(again.error_m, one.error_m)
    np.testing.assert_array_equal(again.covered, one.covered)
    assert read.found[1].error_m.shape == (0,)


@pytest.mark.parametrize(
    "text",
    ["{}", '{"session": "a", "centroid_m": [], "found": [3]}',
     '{"session": "a", "centroid_m": [], "found": [{"part": "x"}]}',
     '{"session": "a", "centroid_m": ["x"], "found": []}'],
)  # fmt: skip
def test_what_is_damaged_is_told(tmp_path, text):
    (tmp_path / "found.json").write_text(json.dumps(sealed(json.loads(text))))
    with pytest.raises(StoreError, match="the results of a session"):
        read_left_out(tmp_path / "found.json")
