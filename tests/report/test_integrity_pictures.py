"""Stanford diagrams, coverage and worst runs: what is drawn where."""

from math import nan

import numpy as np
import pytest
from matplotlib.collections import QuadMesh

from mapfilter.evaluation.stanford import StanfordCounts, stanford_bins, stanford_counts
from mapfilter.evaluation.truth import Truth
from mapfilter.filters.contract import Reason, Status
from mapfilter.positioning.estimate import TrackEstimate
from mapfilter.positioning.step_output import Fix
from mapfilter.report.basemap import BaseMap
from mapfilter.report.canvas import figure_of
from mapfilter.report.integrity import plot_coverage, plot_stanford, plot_worst_run
from mapfilter.report.saving import save

TIME_S = np.arange(200.0)
TRUTH = Truth(TIME_S, 500_000.0 + 1.4 * TIME_S, np.full(200, 100.0))
STREETS = (np.array([[499_900.0, 100.0], [500_400.0, 100.0]]),)
BASE = BaseMap((499_900.0, 0.0, 500_400.0, 200.0), STREETS)


def track(errors_m, levels_m, status=Status.TRACKING):
    errors, levels = np.broadcast_arrays(errors_m, levels_m, TIME_S)[:2]
    fixes = [
        Fix(
            float(t), TRUTH.east_m[i], 100.0 + errors[i], np.eye(2), np.array([3.0, 5.0, 9.0]),
            status, 1, 1.0, 0, nan, Reason.USED, 12.0, float(levels[i]),
        )
        for i, t in enumerate(TIME_S)
    ]  # fmt: skip
    return TrackEstimate.of_fixes("EPSG:32632", "bayes", fixes)


def texts(axes):
    return {text.get_text() for text in axes.texts}


def test_a_stanford_diagram_shows_each_bin_at_its_place():
    errors, levels = [5.5, 5.5, 70.5], [20.5, 20.5, 30.5]
    counts = stanford_counts(errors, levels, 50.0)
    axes = plot_stanford(stanford_bins(errors, levels, 50.0), counts, 50.0, title="a case")
    (mesh,) = (artist for artist in axes.collections if isinstance(artist, QuadMesh))
    held = mesh.get_array().filled(0)
    assert {(int(x), int(y)): held[y, x] for y, x in np.argwhere(held > 0)} == {
        (5, 20): 2.0,
        (70, 30): 1.0,
    }
    assert "available\n67 %" in texts(axes)
    assert "hazardous\n33 %" in texts(axes)
    assert "misleading\n0 %" in texts(axes)
    assert axes.get_xlim() == axes.get_ylim() == (0.0, 100.0)
    assert axes.get_title() == "a case"


def test_small_shares_are_not_rounded_to_nothing():
    axes = plot_stanford([], StanfordCounts(999_990, 3, 7), 50.0)
    assert {"misleading\n0.0003 %", "hazardous\n0.0007 %"} <= texts(axes)


def test_a_stanford_diagram_without_epochs(tmp_path):
    axes = plot_stanford([], StanfordCounts(), 25.0)
    assert axes.get_xlim() == (0.0, 50.0)
    assert save(axes, tmp_path / "empty.png").stat().st_size > 1000


def test_coverage_has_a_mark_and_an_interval_for_each_share():
    cases = {"one": [(0.5, 0.4, 0.6), (0.9, 0.85, 0.97)], "other": [(nan, nan, nan)] * 2}
    axes = plot_coverage(cases, (50, 95))
    assert [label.get_text() for label in axes.get_yticklabels()] == ["one", "other"]
    marks = [line.get_xydata() for line in axes.lines if line.get_marker() == "o"]
    assert [mark[0][0] for mark in marks] == [50.0, 90.0]
    spans = [bars.get_segments()[0][:, 0].tolist() for bars in axes.collections]
    np.testing.assert_allclose(spans, [[40.0, 60.0], [85.0, 97.0]])


@pytest.mark.parametrize("level_m", [20.0, np.inf, nan])
def test_a_worst_run_marks_its_epoch(tmp_path, level_m):
    errors = np.where((TIME_S > 80) & (TIME_S < 120), 70.0, 4.0)
    errors[100] = 90.0
    drawn = plot_worst_run(
        track(errors, level_m), TRUTH, BASE, (100, 81, 119), 50.0,
        title="levels-6, run 3: astray", reason="Worst at 100 s: TRACKING, 90 m off. " * 5,
    )  # fmt: skip
    left, right = drawn.axes
    assert drawn.get_suptitle() == "levels-6, run 3: astray"
    assert drawn.get_supxlabel().startswith("Worst at 100\N{NO-BREAK SPACE}s")
    (star,) = (line for line in right.lines if line.get_marker() == "*")
    assert star.get_xydata()[0] == pytest.approx([140.0, 90.0])
    assert len(left.patches) == (2 if level_m == 20.0 else 1)
    names = {text.get_text() for text in right.get_legend().get_texts()}
    assert ("protection level" in names) == (level_m == 20.0)
    assert {"error", "95 % radius", "worst"} <= names
    assert save(drawn, tmp_path / "worst.png").stat().st_size > 10_000


def test_the_log_of_another_city_is_drawn_without_its_truth():
    far = Truth(TIME_S, TRUTH.east_m + 50_000.0, TRUTH.north_m)
    drawn = plot_worst_run(
        track(4.0, 20.0), far, BASE, (100, 100, 100), 50.0, title="other-city", reason="far"
    )
    left, _ = drawn.axes
    assert "truth" not in left.get_legend_handles_labels()[1]
    assert left.get_title() == "the truth is outside the map"
    assert figure_of(left) is drawn
